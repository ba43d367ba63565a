#include <ldi/base/memory.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <cstdlib>
#include <random>
#include <string>
#include <thread>
#include <vector>

using namespace ldi;

namespace {

/// Memory that counts what is out, and says no when `left` calls have been served.
struct counted {
    std::size_t blocks = 0, bytes = 0, left = static_cast<std::size_t>(-1);
    memory source{this, &allocate, &release};

    static void* allocate(void* context, std::size_t bytes, std::size_t alignment) {
        counted& self = *static_cast<counted*>(context);
        if (self.left-- == 0) return nullptr;
        ++self.blocks, self.bytes += bytes;
        return std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
    }
    static void release(void* context, void* block, std::size_t bytes) {
        counted& self = *static_cast<counted*>(context);
        --self.blocks, self.bytes -= bytes;
        std::free(block);
    }
};

template <class T>
T value(int i);
template <>
std::int32_t value<std::int32_t>(int i) {
    return i;
}
template <>
std::string value<std::string>(int i) {
    return "a value too long to lie in the string itself: " + std::to_string(i);
}

template <class T>
bool equal(const buffer<T>& a, const std::vector<T>& b) {
    return std::equal(a.begin(), a.end(), b.begin(), b.end());
}

}  // namespace

TEMPLATE_TEST_CASE("a buffer does what a vector does", "", std::int32_t, std::string) {
    std::mt19937 random(1);
    buffer<TestType> ours;
    std::vector<TestType> theirs;
    for (int step = 0; step < 4000; ++step) {
        const TestType v = value<TestType>(step);
        const std::size_t count = random() % 40;
        switch (random() % 8) {
            case 0: ours.resize(count), theirs.resize(count); break;
            case 1: ours.resize(count, v), theirs.resize(count, v); break;
            case 2: ours.assign(count, v), theirs.assign(count, v); break;
            case 3: {
                const buffer<TestType> copy = ours;
                ours.append(copy.begin(), copy.end());
                const std::vector<TestType> more = theirs;
                theirs.insert(theirs.end(), more.begin(), more.end());
                break;
            }
            case 4:
                if (!theirs.empty()) ours.push_back(ours.front()), theirs.push_back(theirs.front());  // from inside itself
                break;
            case 5:
                if (!theirs.empty()) ours.pop_back(), theirs.pop_back();
                break;
            case 6: ours.reserve(count), theirs.reserve(count); break;
            default: ours.push_back(v), theirs.push_back(v);
        }
        if (theirs.size() > 500) ours.clear(), theirs.clear();
        REQUIRE(equal(ours, theirs));
        REQUIRE(reinterpret_cast<std::uintptr_t>(ours.data()) % buffer_alignment == 0);
    }
    buffer<TestType> moved = std::move(ours);
    CHECK(equal(moved, theirs));
    CHECK(ours.empty());  // NOLINT: that it may be looked at is what is tested
    ours = moved;
    CHECK(ours == moved);
}

TEST_CASE("values are inserted and erased in the middle") {
    std::mt19937 random(2);
    buffer<std::int32_t> ours;
    std::vector<std::int32_t> theirs;
    for (std::int32_t step = 0; step < 2000; ++step) {
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(random() % (theirs.size() + 1));
        if (random() % 2 == 0 && at < static_cast<std::ptrdiff_t>(theirs.size())) {
            CHECK(ours.erase(ours.begin() + at) - ours.begin() == at);
            theirs.erase(theirs.begin() + at);
        } else {
            const std::int32_t values[] = {step, -step, step};
            CHECK(ours.insert(ours.begin() + at, values, values + 3) - ours.begin() == at);
            theirs.insert(theirs.begin() + at, values, values + 3);
        }
        REQUIRE(equal(ours, theirs));
    }
}

TEST_CASE("memory comes from where the scope says, and goes back there from anywhere") {
    counted outer, inner;
    buffer<float> kept;
    {
        const memory_scope scope(outer.source);
        buffer<float> first(100);
        CHECK((outer.blocks == 1 && outer.bytes == 400));
        {
            const memory_scope nested(inner.source);
            kept = buffer<float>(10);
            first.resize(10000);  // stays where it began
            CHECK((inner.blocks == 1 && outer.bytes >= 40000));
        }
        CHECK(&current_memory() == &outer.source);
    }
    CHECK((outer.blocks == 0 && outer.bytes == 0));
    CHECK(inner.blocks == 1);
    std::thread([&] { kept = {}; }).join();
    CHECK((inner.blocks == 0 && inner.bytes == 0));
}

TEST_CASE("a buffer that gets no memory throws, and keeps what it had") {
    counted memory;
    const memory_scope scope(memory.source);
    {
        buffer<std::string> values(3, "some text that does not lie in the string itself");
        memory.left = 0;
        CHECK_THROWS_AS(values.resize(1000), std::bad_alloc);
        memory.left = 0;
        CHECK_THROWS_AS(values.reserve(static_cast<std::size_t>(-1) / 2), std::bad_alloc);
        CHECK(values.size() == 3);
        CHECK(values[2] == "some text that does not lie in the string itself");
    }
    CHECK(memory.blocks == 0);
}
