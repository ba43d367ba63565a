#include <ldi/io/file.hpp>

#include <catch2/catch.hpp>
#include <tests/support/files.hpp>

#include <csignal>
#if defined(__linux__)
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>
#endif

using namespace ldi;
using namespace ldi::testing;

TEST_CASE("read_file() returns the bytes that write_file() wrote") {
    const scratch_folder folder;
    std::mt19937 random(1);
    for (std::size_t size : {0u, 1u, 17u, 65535u, 65536u, 65537u, 300000u}) {
        byte_string bytes(size);
        for (std::byte& b : bytes) b = static_cast<std::byte>(random());
        write_file(folder / "file", bytes);
        CHECK(read_file(folder / "file") == bytes);
        CHECK(folder.file_count() == 1);
    }
}

TEST_CASE("a file longer than the limit is refused, and a file of exactly that length is read") {
    const scratch_folder folder;
    write_file(folder / "file", byte_string(100000));
    CHECK(read_file(folder / "file", 100000).size() == 100000);
    CHECK(raised([&] { read_file(folder / "file", 99999); }) == error_code::too_large);
}

TEST_CASE("errors of reading and writing name the path and the reason") {
    const scratch_folder folder;
    CHECK_THAT(message_of([&] { read_file(folder / "absent.jpg"); }),
               Catch::Contains("absent.jpg") && Catch::Contains("no such file"));
    CHECK(raised([&] { read_file(folder / "absent.jpg"); }) == error_code::file_access);
    CHECK(raised([&] { read_file(folder / ""); }) == error_code::file_access);
    CHECK_THAT(message_of([&] { write_file(folder / "absent/file", {}); }),
               Catch::Contains("absent") && Catch::Contains("found no folder"));
    CHECK(raised([&] { write_file(folder / "absent/file", {}); }) == error_code::file_access);
    CHECK(folder.file_count() == 0);
}

TEST_CASE("a failed write keeps the existing content and leaves no temporary file") {
    const scratch_folder folder;
    std::filesystem::create_directories(folder / "taken");
    CHECK(raised([&] { write_file(folder / "taken", bytes_of("new")); }) == error_code::file_access);
    CHECK(std::filesystem::is_directory(folder / "taken"));
    CHECK(folder.file_count() == 1);

    const std::string too_long(300, 'n');
    CHECK(raised([&] { write_file(folder / too_long, bytes_of("new")); }) == error_code::file_access);
    CHECK(folder.file_count() == 1);
}

TEST_CASE("write_file() writes to a device file instead of replacing it") {
    if (!std::filesystem::is_character_file("/dev/null") || !std::filesystem::is_character_file("/dev/full")) return;
    write_file("/dev/null", bytes_of("gone"));
    CHECK(std::filesystem::is_character_file("/dev/null"));
    CHECK_THAT(message_of([] { write_file("/dev/full", byte_string(100000)); }),
               Catch::Contains("/dev/full") && Catch::Contains("No space left"));
}

TEST_CASE("writing keeps a file's permissions, and follows symbolic links without replacing them") {
    const scratch_folder folder;
    std::filesystem::create_directory(folder / "sub");
    for (const char* name : {"sub/file", "closed"}) write_file(folder / name, bytes_of("a rather long old content"));
    std::filesystem::create_symlink("sub/file", folder / "link");
    std::filesystem::create_symlink("sub/new", folder / "dangling");
    const std::filesystem::perms rare =
        std::filesystem::perms::owner_read | std::filesystem::perms::owner_write | std::filesystem::perms::others_exec;
    std::filesystem::permissions(folder / "closed", rare);
    for (const char* name : {"link", "dangling", "closed"}) write_file(folder / name, bytes_of(name));
    CHECK(std::filesystem::is_symlink(folder / "link"));
    CHECK(read_file(folder / "sub/file") == bytes_of("link"));
    CHECK(std::filesystem::is_symlink(folder / "dangling"));
    CHECK(read_file(folder / "sub/new") == bytes_of("dangling"));
    CHECK(std::filesystem::status(folder / "closed").permissions() == rare);
    CHECK(read_file(folder / "closed") == bytes_of("closed"));
    CHECK(folder.file_count() == 4);
}

#if defined(__linux__)

TEST_CASE("only the owner can read a file's new content before the file is replaced") {
    const scratch_folder folder;
    write_file(folder / "secret", bytes_of("old"));
    std::filesystem::permissions(folder / "secret", std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    // A limit of 1000 bytes per file ends the child process in the middle of writing.
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        const rlimit none{0, 0}, some{1000, 1000};
        ::setrlimit(RLIMIT_CORE, &none), ::setrlimit(RLIMIT_FSIZE, &some);
        std::signal(SIGXFSZ, SIG_DFL);
        write_file(folder / "secret", byte_string(100'000));
        ::_exit(0);
    }
    int status = 0;
    REQUIRE(::waitpid(child, &status, 0) == child);
    REQUIRE(WIFSIGNALED(status));
    CHECK(folder.file_count() == 2);
    for (const auto& entry : std::filesystem::directory_iterator(folder / "."))
        CHECK((entry.status().permissions() & ~std::filesystem::perms::owner_all) == std::filesystem::perms::none);
    CHECK(read_file(folder / "secret") == bytes_of("old"));
}

#endif
