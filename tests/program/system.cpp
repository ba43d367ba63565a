#include <examples/photo3d/system.hpp>

#include <catch2/catch.hpp>
#include <tests/support/files.hpp>

#include <cstddef>
#include <filesystem>
#include <sstream>
#include <string_view>
#include <vector>

using ldi::examples::smallest_limit;

TEST_CASE("the smallest memory limit applies, and limit files without a number are ignored") {
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

TEST_CASE("the memory limits of a process are those of its control group and of all parent groups") {
    using paths = std::vector<std::filesystem::path>;
    const auto files = [](const char* groups) {
        std::istringstream text(groups);
        return ldi::examples::files_of_limits(text);
    };
    CHECK(files("") == paths{});
    CHECK(files("0::/\n") == paths{"/sys/fs/cgroup/memory.max"});
    CHECK(files("0::/system.slice/job 7.service\n") == paths{"/sys/fs/cgroup/memory.max",
                                                             "/sys/fs/cgroup/system.slice/memory.max",
                                                             "/sys/fs/cgroup/system.slice/job 7.service/memory.max"});
    CHECK(files("12:pids:/a\n4:cpu,memory:/docker/1\n1:name=systemd:/b\nnonsense\n") ==
          paths{"/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/docker/memory.limit_in_bytes",
                "/sys/fs/cgroup/memory/docker/1/memory.limit_in_bytes"});
}

TEST_CASE("the available memory is at least what this process uses") {
    CHECK(ldi::examples::available_memory() > ldi::examples::memory_in_use());
}
