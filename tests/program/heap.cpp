#include <examples/photo3d/heap.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

using namespace ldi::examples;

TEST_CASE("memory of the program is aligned, and each block keeps its contents") {
    const ldi::memory& memory = program_memory();
    for (const std::size_t alignment : {std::size_t{8}, std::size_t{16}, std::size_t{64}}) {
        std::vector<void*> blocks;
        for (std::size_t bytes = 1; bytes < 5'000'000; bytes = 2 * bytes + 1) {
            void* const block = memory.allocate(memory.context, bytes, alignment);
            REQUIRE(block != nullptr);
            REQUIRE(reinterpret_cast<std::uintptr_t>(block) % alignment == 0);
            std::memset(block, static_cast<int>(blocks.size()), bytes);
            blocks.push_back(block);
        }
        for (std::size_t bytes = 1, i = 0; i < blocks.size(); bytes = 2 * bytes + 1, ++i) {
            const auto* const values = static_cast<const unsigned char*>(blocks[i]);
            REQUIRE(std::all_of(values, values + bytes, [&](unsigned char v) { return v == i; }));
            memory.release(memory.context, blocks[i], bytes);
        }
    }
#if !defined(__SANITIZE_ADDRESS__)
    CHECK(memory.allocate(memory.context, std::numeric_limits<std::size_t>::max(), 64) == nullptr);
#endif
}

TEST_CASE("pages that the system provides ahead of their use keep the values that are written meanwhile") {
    for (int round = 0; round < 8; ++round) {
        const pages_ahead pages(std::size_t{16} << 20);
        std::vector<std::vector<unsigned char>> blocks;
        for (int i = 1; i <= 16; ++i) blocks.emplace_back(std::size_t{1} << 20, static_cast<unsigned char>(i));
        for (const std::vector<unsigned char>& block : blocks)
            REQUIRE(static_cast<std::size_t>(std::count(block.begin(), block.end(), block[0])) == block.size());
    }
}

TEST_CASE("pages are not needed ahead of their use if there are none, or not enough memory") {
    const pages_ahead none(0), most(std::numeric_limits<std::size_t>::max());
    CHECK(std::vector<int>(1000, 1).back() == 1);
}
