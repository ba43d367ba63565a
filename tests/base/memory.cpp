#include <ldi/base/buffer.hpp>
#include <ldi/base/memory.hpp>

#include "tests/support/counted_memory.hpp"

#include <catch2/catch.hpp>

#include <cstdint>
#include <random>
#include <string>
#include <thread>
#include <type_traits>
#include <vector>

using namespace ldi;

namespace {

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

static_assert(std::is_constructible_v<memory_scope, const memory&>);
static_assert(!std::is_constructible_v<memory_scope, memory>, "the scope would keep the address of a temporary");
template <class Scope>
concept outlives_its_block = requires(const memory& from) {
    new Scope(from);
};
static_assert(!outlives_its_block<memory_scope>, "a scope that operator new creates could outlive its block");

}  // namespace

TEMPLATE_TEST_CASE("a buffer behaves like std::vector, and its memory is aligned", "", std::int32_t, std::string) {
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
                // Appends an element of the buffer itself.
                if (!theirs.empty()) ours.push_back(ours.front()), theirs.push_back(theirs.front());
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
    CHECK(ours.empty());  // NOLINT: moved-from buffers are valid, which this tests
    ours = moved;
    CHECK(ours == moved);
}

TEST_CASE("a buffer's count equals the index of the next appended value") {
    ldi::buffer<char> values;
    for (std::int32_t i = 0; i < 10; ++i) {
        REQUIRE(values.count() == i);
        values.push_back('a');
        REQUIRE(&values[values.count() - 1] == &values.back());
    }
}

TEST_CASE("a buffer inserts and erases values anywhere, as std::vector does") {
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

TEST_CASE("a buffer allocates from the current memory scope, and frees its memory in that scope from any scope or thread") {
    testing::counted_memory outer, inner;
    buffer<float> kept;
    {
        const memory_scope scope(outer.source);
        buffer<float> first(100);
        CHECK((outer.blocks == 1 && outer.bytes == 400));
        {
            const memory_scope nested(inner.source);
            kept = buffer<float>(10);
            first.resize(10000);  // grows in the memory from which it was first allocated
            CHECK((inner.blocks == 1 && outer.bytes >= 40000));
        }
        CHECK(&current_memory() == &outer.source);
    }
    CHECK((outer.blocks == 0 && outer.bytes == 0));
    CHECK(inner.blocks == 1);
    std::thread([&] { kept = {}; }).join();
    CHECK((inner.blocks == 0 && inner.bytes == 0));
}

TEST_CASE("after a buffer's first allocation fails, the next one uses the memory scope that is current at that time") {
    testing::counted_memory later;
    buffer<int> values;
    {
        testing::counted_memory full;
        full.most = 0;
        const memory_scope scope(full.source);
        CHECK_THROWS_AS(values.resize(10), std::bad_alloc);
        CHECK_THROWS_AS(values.resize(static_cast<std::size_t>(-1) / 2), error);
    }
    const memory_scope scope(later.source);
    values.resize(10);
    CHECK(later.blocks == 1);
    values = {};
    CHECK(later.blocks == 0);
}

TEST_CASE("a buffer that cannot grow throws and keeps its values") {
    testing::counted_memory memory;
    const memory_scope scope(memory.source);
    {
        buffer<std::string> values(3, "some text that does not lie in the string itself");
        memory.most = memory.calls;
        CHECK_THROWS_AS(values.resize(1000), std::bad_alloc);
        memory.most = memory.calls;
        CHECK_THROWS_WITH(values.reserve(static_cast<std::size_t>(-1) / 2), Catch::Contains("too large"));
        CHECK(values.size() == 3);
        CHECK(values[2] == "some text that does not lie in the string itself");
    }
    CHECK(memory.blocks == 0);
}

namespace {
struct unmakeable {
    explicit unmakeable(bool fails) {
        if (fails) throw 1;
        ++alive;
    }
    unmakeable(unmakeable&&) noexcept { ++alive; }
    ~unmakeable() { --alive; }
    static inline int alive = 0;
};
}  // namespace

TEST_CASE("a value whose constructor throws is not appended and not destroyed") {
    {
        buffer<unmakeable> values;
        values.reserve(3);
        values.emplace_back(false);
        CHECK_THROWS_AS(values.emplace_back(true), int);
        CHECK(values.size() == 1);
        values.emplace_back(false);
        values.emplace_back(false);
        CHECK_THROWS_AS(values.emplace_back(true), int);  // at full capacity, so that the buffer would have to grow
        CHECK(values.size() == 3);
        CHECK(unmakeable::alive == 3);
    }
    CHECK(unmakeable::alive == 0);
}

namespace {
// Has no move constructor, so that growing a buffer copies it. Copies throw once `budget` is used up.
struct uncopyable {
    explicit uncopyable(int number) : value(number) { ++alive; }
    uncopyable(const uncopyable& other) : value(other.value) {
        if (budget-- == 0) throw 1;
        ++alive;
    }
    uncopyable& operator=(const uncopyable&) = default;
    ~uncopyable() { --alive; }
    int value;
    static inline int alive = 0, budget = 0;
};
}  // namespace

TEST_CASE("a buffer keeps its values when a copy throws while it grows or is assigned") {
    uncopyable::budget = 1000;
    {
        buffer<uncopyable> values, others;
        values.reserve(5), others.reserve(5);
        for (int i = 0; i < 5; ++i) values.emplace_back(i), others.emplace_back(10 + i);
        for (int copies = 0; copies < 5; ++copies) {
            uncopyable::budget = copies;
            CHECK_THROWS_AS(values.reserve(100), int);
            uncopyable::budget = copies;
            CHECK_THROWS_AS(values = others, int);
            REQUIRE(values.size() == 5);
            for (int i = 0; i < 5; ++i) CHECK(values[i].value == i);
            CHECK(uncopyable::alive == 10);
        }
        uncopyable::budget = 1000;
        values = others;
        CHECK((values.size() == 5 && values[4].value == 14));
    }
    CHECK(uncopyable::alive == 0);
}

namespace {
struct throwing_move {
    explicit throwing_move(int number) : value(number) {}
    throwing_move(const throwing_move&) = default;
    throwing_move(throwing_move&& other) : value(other.value) {
        other.value = -1;
        if (value == 3) throw 1;
    }
    int value;
};
}  // namespace

TEST_CASE("a buffer that grows does not move values whose move constructor may throw") {
    buffer<throwing_move> values;
    values.reserve(5);
    for (int i = 0; i < 5; ++i) values.emplace_back(i);
    CHECK_NOTHROW(values.reserve(100));
    for (int i = 0; i < 5; ++i) CHECK(values[i].value == i);
}

TEST_CASE("copying a buffer of buffers releases the copies made so far if memory runs out") {
    testing::counted_memory memory;
    const memory_scope scope(memory.source);
    {
        const buffer<buffer<float>> original(5, buffer<float>(10, 1.5F));
        const std::size_t kept = memory.blocks;
        for (std::size_t more = 0; more < 6; ++more) {
            memory.most = memory.calls + more;
            CHECK_THROWS_AS(buffer<buffer<float>>(original), std::bad_alloc);
            CHECK(memory.blocks == kept);
            memory.most = memory.calls + more;
            CHECK_THROWS_AS((buffer<buffer<float>>(5, original[0])), std::bad_alloc);
            CHECK(memory.blocks == kept);
        }
        memory.most = static_cast<std::size_t>(-1);
        CHECK(buffer<buffer<float>>(original) == original);
    }
    CHECK(memory.blocks == 0);
}
