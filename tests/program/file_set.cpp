#include <examples/photo3d/file_set.hpp>

#include <catch2/catch.hpp>
#include <tests/support/files.hpp>

#if LDI_HAS_POSIX_FILES
#include <sys/wait.h>
#endif

using namespace ldi;
using namespace ldi::testing;
using ldi::examples::file_set;
namespace fs = std::filesystem;

namespace {

/// The content of a folder and all folders in it: names, types, contents.
std::string state_of(const fs::path& folder) {
    std::vector<std::string> lines;
    for (const fs::directory_entry& item : fs::recursive_directory_iterator(folder)) {
        std::string line = item.path().string();
        if (item.is_symlink()) line += " -> " + fs::read_symlink(item.path()).string();
        if (!item.is_symlink() && item.is_regular_file())
            for (const std::byte b : read_file(item.path())) line += static_cast<char>(b);
        lines.push_back(line);
    }
    std::sort(lines.begin(), lines.end());
    std::string state;
    for (const std::string& line : lines) state += line + "\n";
    return state;
}

/// Writes one file as a set.
void put(const fs::path& path, const byte_string& bytes) {
    file_set files;
    files.write(path, bytes);
    files.commit();
}

bool holds(const fs::path& path, std::string_view text) { return read_file(path) == bytes_of(text); }

}  // namespace

TEST_CASE("all files of a set appear when it is committed") {
    const scratch_folder folder;
    fs::create_directory(folder / "other");
    put(folder / "b", bytes_of("old"));
    file_set files;
    files.write(folder / "a", bytes_of("1"));
    files.write(folder / "b", bytes_of("2"));
    const fs::path reserved = files.reserve(folder / "other/c");
    CHECK((fs::status(reserved.parent_path()).permissions() & (fs::perms::group_all | fs::perms::others_all)) == fs::perms::none);
    put(reserved, bytes_of("3"));
    CHECK_FALSE(fs::exists(folder / "a"));
    CHECK(holds(folder / "b", "old"));
    CHECK_FALSE(fs::exists(folder / "other/c"));
    files.commit();
    CHECK(holds(folder / "a", "1"));
    CHECK(holds(folder / "b", "2"));
    CHECK(holds(folder / "other/c", "3"));
    CHECK(folder.file_count() == 3);
    CHECK_FALSE(fs::exists(reserved.parent_path()));
}

TEST_CASE("a set that is not committed leaves all existing files unchanged") {
    const scratch_folder folder;
    put(folder / "b", bytes_of("old"));
    const std::string before = state_of(folder / "");
    {
        file_set files;
        files.write(folder / "a", bytes_of("1"));
        files.write(folder / "b", bytes_of("2"));
        files.create_folder(folder / "new/deeper");
        files.write(folder / "new/deeper/c", bytes_of("3"));
        CHECK(state_of(folder / "") != before);
    }
    CHECK(state_of(folder / "") == before);
}

TEST_CASE("if one file cannot be moved to its path, all others are restored") {
    const scratch_folder folder;
    put(folder / "b", bytes_of("old"));
    put(folder / "first", bytes_of("older"));
    fs::create_hard_link(folder / "first", folder / "second");
    const std::string before = state_of(folder / "");
    file_set files;
    files.write(folder / "a", bytes_of("1"));
    files.write(folder / "b", bytes_of("2"));
    files.write(folder / "first", bytes_of("a longer content"));
    files.write(folder / "c", bytes_of("3"));
    fs::create_directories(folder / "c/in the way");
    CHECK(raised([&] { files.commit(); }) == error_code::file_access);
    fs::remove_all(folder / "c");
    CHECK(state_of(folder / "") == before);
    CHECK(fs::equivalent(folder / "first", folder / "second"));
}

TEST_CASE("a set with a reserved file that was not written cannot be committed") {
    const scratch_folder folder;
    file_set files;
    files.write(folder / "a", bytes_of("1"));
    (void)files.reserve(folder / "b");
    CHECK(raised([&] { files.commit(); }) == error_code::file_access);
    files.discard();
    CHECK(folder.file_count() == 0);
}

TEST_CASE("a path that leads to an input or to another output is refused as an output, and so is a path without a file name") {
    const scratch_folder folder;
    put(folder / "photo.jpg", bytes_of("photo"));
    fs::create_symlink("photo.jpg", folder / "link");
    fs::create_symlink("absent", folder / "dangling");
    fs::create_hard_link(folder / "photo.jpg", folder / "twin");
    fs::create_directory(folder / "sub");
    fs::create_directory_symlink(folder / "sub", folder / "same");
    const std::string before = state_of(folder / "");
    file_set files;
    files.protect(folder / "photo.jpg");
    files.claim(folder / "dangling");
    files.claim(folder / "sub/out");
    for (const char* name : {"photo.jpg", "link", "twin", "sub/../photo.jpg", "dangling", "absent", "sub/out", "same/out"}) {
        INFO(name);
        CHECK(raised([&] { files.claim(folder / name); }) == error_code::invalid_option);
    }
    CHECK_THAT(message_of([&] { files.claim(folder / "link"); }), Catch::Contains("photo.jpg") && Catch::Contains("same file"));
    CHECK(raised([&] { files.claim(""); }) == error_code::invalid_option);
    CHECK(raised([&] { files.claim(folder / "sub/"); }) == error_code::invalid_option);
    CHECK(raised([&] { files.write(folder / "twin", bytes_of("new")); }) == error_code::invalid_option);
    files.write(folder / "sub/out", bytes_of("new"));
    CHECK(raised([&] { files.write(folder / "sub/out", bytes_of("twice")); }) == error_code::invalid_option);
    files.discard();
    CHECK(state_of(folder / "") == before);
}

TEST_CASE("a file set removes files that killed processes left, unless leave_abandoned() was called") {
    const scratch_folder folder;
    fs::create_directory(folder / ".ldi-0123.tmp");
    put(folder / ".ldi-0123.tmp/0", bytes_of("half"));  // its folder belongs to another process
    {
        file_set files;
        files.leave_abandoned();
        files.write(folder / "a", bytes_of("new"));
        files.commit();
    }
    CHECK(fs::exists(folder / ".ldi-0123.tmp/0"));
    put(folder / "a", bytes_of("newer"));
    CHECK(folder.file_count() == 1);
}

TEST_CASE("claim() detects obstacles to an output and leaves no file behind") {
    const scratch_folder folder;
    fs::create_directory(folder / "sub");
    fs::create_symlink("circle", folder / "circle");
    const std::string before = state_of(folder / "");
    file_set files;
    for (const std::string& name : std::vector<std::string>{"absent/out", "sub", "circle", std::string(300, 'n')}) {
        INFO(name);
        CHECK(raised([&] { files.claim(folder / name); }) == error_code::file_access);
    }
    files.claim(folder / "out");
    CHECK(state_of(folder / "") == before);
}

TEST_CASE("writing follows symbolic links and keeps permissions and hard links") {
    const scratch_folder folder;
    fs::create_directory(folder / "sub");
    for (const char* name : {"sub/file", "twin", "closed"}) put(folder / name, bytes_of("a rather long old content"));
    fs::create_symlink("sub/file", folder / "link");
    fs::create_symlink("sub/new", folder / "dangling");
    fs::create_hard_link(folder / "twin", folder / "other twin");
    const fs::perms rare = fs::perms::owner_read | fs::perms::owner_write | fs::perms::others_exec;
    fs::permissions(folder / "closed", rare);
    for (const char* name : {"link", "dangling", "twin", "closed"}) put(folder / name, bytes_of(name));
    CHECK(fs::is_symlink(folder / "link"));
    CHECK(holds(folder / "sub/file", "link"));
    CHECK(fs::is_symlink(folder / "dangling"));
    CHECK(holds(folder / "sub/new", "dangling"));
    CHECK(holds(folder / "other twin", "twin"));
    CHECK(fs::equivalent(folder / "twin", folder / "other twin"));
    CHECK(fs::status(folder / "closed").permissions() == rare);
    CHECK(holds(folder / "closed", "closed"));
    CHECK(folder.file_count() == 6);
}

TEST_CASE("a discarded set writes no more files") {
    const scratch_folder folder;
    file_set files;
    files.write(folder / "a", bytes_of("1"));
    files.discard();
    CHECK(folder.file_count() == 0);
    CHECK(raised([&] { files.write(folder / "b", bytes_of("2")); }) == error_code::canceled);
    CHECK(raised([&] { files.create_folder(folder / "c"); }) == error_code::canceled);
    CHECK(raised([&] { files.commit(); }) == error_code::canceled);
    CHECK(folder.file_count() == 0);
}

TEST_CASE("a full device prevents all files of a set from appearing") {
    if (!fs::is_character_file("/dev/full")) return;
    const scratch_folder folder;
    put(folder / "a", bytes_of("old"));
    file_set files;
    files.write(folder / "a", bytes_of("new"));
    files.write("/dev/full", bytes_of("text"));
    CHECK(raised([&] { files.commit(); }) == error_code::unavailable);
    CHECK(holds(folder / "a", "old"));
    CHECK(folder.file_count() == 1);
}

#if LDI_HAS_POSIX_FILES
TEST_CASE("a set removes files left by a killed process, but not those of a running one") {
    const scratch_folder folder;
    int ready[2];
    REQUIRE(pipe(ready) == 0);
    const pid_t child = fork();
    if (child == 0) {
        file_set files;
        files.write(folder / "a", bytes_of("child"));
        (void)::write(ready[1], "!", 1);
        for (;;) pause();
    }
    char byte;
    REQUIRE(::read(ready[0], &byte, 1) == 1);
    CHECK(folder.file_count() == 1);
    put(folder / "b", bytes_of("parent"));
    CHECK(folder.file_count() == 2);
    kill(child, SIGKILL);
    waitpid(child, nullptr, 0);
    CHECK(folder.file_count() == 2);
    put(folder / "b", bytes_of("parent"));
    CHECK(folder.file_count() == 1);
    CHECK(holds(folder / "b", "parent"));
    close(ready[0]), close(ready[1]);
}

TEST_CASE("if many processes write the same file, it has the complete content of one of them") {
    for (const bool has_other_name : {false, true}) {
        const scratch_folder folder;
        put(folder / "file", bytes_of("old"));
        if (has_other_name) fs::create_hard_link(folder / "file", folder / "other");
        std::vector<pid_t> children;
        for (int i = 0; i < 8; ++i) {
            children.push_back(fork());
            if (children.back() != 0) continue;
            const byte_string content(static_cast<std::size_t>(200000 + 1000 * i), static_cast<std::byte>(i));
            for (int k = 0; k < 5; ++k)
                if (raised([&] { put(folder / "file", content); })) _exit(1);
            _exit(0);
        }
        for (const pid_t child : children) {
            int status = 1;
            waitpid(child, &status, 0);
            CHECK(status == 0);
        }
        const byte_string last = read_file(folder / "file");
        REQUIRE(!last.empty());
        CHECK(last == byte_string(200000 + 1000 * std::to_integer<std::size_t>(last[0]), last[0]));
        CHECK(folder.file_count() == (has_other_name ? 2 : 1));
    }
}
#endif
