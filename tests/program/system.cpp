#include <examples/photo3d/system.hpp>

#include <catch2/catch.hpp>
#include <tests/support/files.hpp>

#include <cstddef>
#include <filesystem>
#include <string_view>

using ldi::examples::smallest_limit;

TEST_CASE("the smallest memory limit counts, and files without a number are ignored") {
    const ldi::testing::scratch_folder folder;
    const auto file = [&](const char* name, std::string_view text) {
        ldi::write_file(folder / name, ldi::testing::bytes_of(text));
        return folder / name;
    };
    const std::filesystem::path small = file("small", "2000000\n"), large = file("large", "9223372036854771712\n"),
                                none = file("none", "max\n"), empty = file("empty", ""),
                                overflow = file("overflow", "99999999999999999999999\n");
    CHECK(smallest_limit(3'000'000, {}) == 3'000'000);
    CHECK(smallest_limit(3'000'000, {small}) == 2'000'000);
    CHECK(smallest_limit(1'000'000, {small}) == 1'000'000);
    CHECK(smallest_limit(3'000'000, {none, empty, overflow, large, folder / "absent"}) == 3'000'000);
    CHECK(smallest_limit(3'000'000, {none, small, large}) == 2'000'000);
}

TEST_CASE("the available memory is at least what this process uses") {
    CHECK(ldi::examples::available_memory() > ldi::examples::memory_in_use());
}
