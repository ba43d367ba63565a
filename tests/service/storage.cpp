#include <examples/service/storage.hpp>

#include <catch2/catch.hpp>
#include <tests/support/files.hpp>

#include <sys/stat.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

using namespace ldi;
using namespace ldi::examples;
using ldi::testing::byte_string;
using ldi::testing::raised;
using ldi::testing::scratch_folder;

TEST_CASE("a folder returns the bytes last stored under a key") {
    const scratch_folder folder;
    folder_storage storage(folder / ".");
    for (const std::size_t size : {0U, 1U, 70'000U}) {
        const byte_string bytes(size, std::byte{7});
        storage.put("album/of/a.glb", bytes);
        CHECK(storage.get("album/of/a.glb", size) == bytes);
        if (size > 0) CHECK(raised([&] { storage.get("album/of/a.glb", size - 1); }) == error_code::too_large);
    }
    CHECK(raised([&] { storage.get("album/b.glb", 10); }) == error_code::file_access);
    CHECK(raised([&] { storage.get("album/of", 10); }) == error_code::file_access);
    CHECK(raised([&] { storage.get("album/of/a.glb/b", 10); }) == error_code::file_access);
    CHECK(raised([&] { folder_storage(folder / "absent").get("a", 10); }) == error_code::unavailable);
}

TEST_CASE("symbolic links inside a folder are not followed") {
    const scratch_folder folder;
    std::filesystem::create_directories(folder / "in");
    std::filesystem::create_directories(folder / "out");
    write_file(folder / "out/secret", byte_string(3));
    std::filesystem::create_symlink("../out/secret", folder / "in/file");
    std::filesystem::create_symlink("../out", folder / "in/folder");
    std::filesystem::create_symlink("../out/new", folder / "in/dangling");
    folder_storage storage(folder / "in");
    for (const char* key : {"file", "folder/secret", "dangling"}) {
        CHECK(raised([&] { storage.get(key, 10); }) == error_code::file_access);
        CHECK(raised([&] { storage.put(key, byte_string(5)); }) == error_code::file_access);
    }
    CHECK(raised([&] { storage.put("folder/new", byte_string(5)); }) == error_code::file_access);
    CHECK(read_file(folder / "out/secret").size() == 3);
    CHECK_FALSE(std::filesystem::exists(folder / "out/new"));
    // The path of the storage itself may be a symbolic link, because the caller chooses it.
    std::filesystem::create_symlink("in", folder / "link");
    folder_storage(folder / "link").put("a", byte_string(4));
    CHECK(storage.get("a", 10).size() == 4);
}

TEST_CASE("a pipe in a folder is refused without waiting") {
    const scratch_folder folder;
    REQUIRE(::mkfifo((folder / "pipe").c_str(), 0600) == 0);
    folder_storage storage(folder / ".");
    CHECK(raised([&] { storage.get("pipe", 10); }) == error_code::file_access);
    CHECK(raised([&] { storage.put("pipe", byte_string(5)); }) == error_code::file_access);
}

TEST_CASE("keys that a folder cannot store are refused in advance") {
    const scratch_folder folder;
    const folder_storage storage(folder / ".");
    CHECK_NOTHROW(storage.check("album/" + std::string(255, 'k')));
    CHECK(raised([&] { storage.check("album/" + std::string(256, 'k')); }) == error_code::invalid_data);
    CHECK(raised([&] { storage.check("../a"); }) == error_code::invalid_data);
}
