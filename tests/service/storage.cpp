#include <examples/service/storage.hpp>

#include <catch2/catch.hpp>
#include <tests/support/files.hpp>

#include <fcntl.h>
#include <stdio.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

using namespace ldi;
using namespace ldi::examples;
using ldi::testing::byte_string;
using ldi::testing::raised;
using ldi::testing::scratch_folder;

namespace {

/// Names of all files in a folder, sorted.
std::vector<std::string> names_in(const std::filesystem::path& folder) {
    std::vector<std::string> names;
    for (const auto& item : std::filesystem::directory_iterator(folder)) names.push_back(item.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

/// Fails with the next of some errors, or else returns one byte.
class failing_storage : public storage {
public:
    explicit failing_storage(std::vector<error_code> errors) : errors_(std::move(errors)) {
        std::reverse(errors_.begin(), errors_.end());
    }
    void check(const std::string&) const override {}
    std::optional<std::vector<std::byte>> find(const std::string& key, std::size_t) override {
        fail_if_wanted(key);
        return byte_string(1);
    }
    void put(const std::string& key, std::span<const std::byte>) override { fail_if_wanted(key); }
    std::string where(const std::string& key) const override { return key; }

private:
    void fail_if_wanted(const std::string& key) {
        if (errors_.empty()) return;
        const error_code code = errors_.back();
        errors_.pop_back();
        raise(code, key, "no error", "one");
    }
    std::vector<error_code> errors_;
};

/// Counts the calls of on_failure.
struct counted_patience {
    int failures = 0;
    std::atomic<bool> is_ending{false};

    patient_storage of(std::vector<error_code> errors, double patience) {
        return patient_storage(std::make_unique<failing_storage>(std::move(errors)), patient_storage::duration(patience),
                               is_ending, [this](const std::string&) { ++failures; });
    }
};

}  // namespace

TEST_CASE("a patient storage retries only while a storage is unavailable") {
    counted_patience counted;
    patient_storage lucky = counted.of({error_code::unavailable, error_code::unavailable}, 20);
    CHECK(lucky.get("a", 10) == byte_string(1));
    CHECK(counted.failures == 2);
    CHECK(lucky.is_there());
    for (const error_code code : {error_code::file_access, error_code::too_large}) {
        patient_storage wrong = counted.of({code}, 20);
        CHECK(raised([&] { wrong.put("a", byte_string(1)); }) == code);
        CHECK(wrong.is_there());
    }
    CHECK(counted.failures == 2);
}

TEST_CASE("a patient storage fails when its patience or the worker ends") {
    counted_patience counted;
    patient_storage hasty = counted.of({error_code::unavailable, error_code::unavailable}, 0);
    CHECK(raised([&] { hasty.find("a", 10); }) == error_code::unavailable);
    CHECK(!hasty.is_there());
    CHECK(raised([&] { hasty.find("a", 10); }) == error_code::unavailable);
    CHECK(hasty.find("a", 10));
    CHECK(hasty.is_there());
    counted.is_ending = true;
    patient_storage ending = counted.of({error_code::unavailable}, 20);
    CHECK(raised([&] { ending.find("a", 10); }) == error_code::unavailable);
    CHECK(counted.failures == 3);
}

TEST_CASE("after many missing photos in a row, a storage counts as unavailable, and each further one is tried again") {
    constexpr std::size_t many = patient_storage::max_failures_in_a_row;
    counted_patience counted;
    patient_storage storage = counted.of(std::vector<error_code>(many + 2, error_code::file_access), 0.01);
    for (std::size_t i = 0; i + 1 < many; ++i) CHECK(raised([&] { storage.get("a", 10); }) == error_code::file_access);
    CHECK(counted.failures == 0);
    CHECK(raised([&] { storage.get("a", 10); }) == error_code::file_access);  // number `many`, and once more
    CHECK(counted.failures == 1);
    CHECK(storage.get("a", 10) == byte_string(1));  // fails first
    CHECK(storage.is_there());
    CHECK(counted.failures == 2);
}

TEST_CASE("a folder whose disk is mounted or unmounted is unavailable for now") {
    const scratch_folder folder;
    std::filesystem::create_directory(folder / "disk");
    folder_storage storage(folder / "disk");
    CHECK(raised([&] { storage.get("a", 10); }) == error_code::unavailable);  // empty, as a place without its disk
    CHECK(storage.find("a", 10) == std::nullopt);
    std::filesystem::rename(folder / "disk", folder / "place");
    std::filesystem::create_directory(folder / "disk");
    storage.put("a", byte_string(5));
    CHECK(storage.get("a", 10).size() == 5);
    CHECK(raised([&] { storage.get("b", 10); }) == error_code::file_access);
    std::filesystem::rename(folder / "disk", folder / "other");
    CHECK(raised([&] { storage.get("a", 10); }) == error_code::unavailable);
    std::filesystem::rename(folder / "place", folder / "disk");
    CHECK(raised([&] { storage.get("a", 10); }) == error_code::unavailable);
    CHECK(raised([&] { storage.put("b", byte_string(5)); }) == error_code::unavailable);
    std::filesystem::rename(folder / "disk", folder / "place");
    std::filesystem::rename(folder / "other", folder / "disk");
    CHECK(storage.get("a", 10).size() == 5);
}

TEST_CASE("a folder returns the bytes that were last stored under a key") {
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

TEST_CASE(
    "find() returns nothing only if there is nothing with the key, so that a folder with the name of an object is noticed") {
    const scratch_folder folder;
    folder_storage storage(folder / ".");
    storage.put("album/a.json", byte_string(5));
    std::filesystem::create_directory(folder / "album/b.json");
    CHECK(storage.find("album/a.json", 10) == byte_string(5));
    CHECK(storage.find("album/c.json", 10) == std::nullopt);
    CHECK(storage.find("nowhere/a.json", 10) == std::nullopt);
    CHECK(raised([&] { storage.find("album/b.json", 10); }) == error_code::file_access);
    CHECK(raised([&] { storage.find("album/a.json/c", 10); }) == error_code::file_access);
    CHECK(raised([&] { folder_storage(folder / "absent").find("a", 10); }) == error_code::unavailable);
}

TEST_CASE("a folder that refuses new files is unavailable for now, because the photo is not at fault") {
    const std::filesystem::path refusing = "/sys/kernel";  // not even root can add files there
    if (!std::filesystem::exists(refusing)) {
        WARN("skipped: there is no " << refusing);
        return;
    }
    CHECK(raised([&] { folder_storage(refusing).put("ldi_test", byte_string(5)); }) == error_code::unavailable);
}

TEST_CASE("a photo that may not be read, or an output that may not be replaced, is not a failure of the storage") {
    const scratch_folder folder;
    const std::filesystem::path place = folder / "photos";
    std::filesystem::create_directory(place);
    folder_storage storage(place);
    storage.put("a.jpg", byte_string(5));
    storage.put("locked/a.jpg", byte_string(5));
    storage.put("kept.glb", byte_string(5));
    std::filesystem::permissions(place, std::filesystem::perms::all);
    std::filesystem::permissions(place / "kept.glb", std::filesystem::perms::owner_read | std::filesystem::perms::others_read);
    for (const char* const name : {"a.jpg", "locked"}) std::filesystem::permissions(place / name, std::filesystem::perms::none);
    const bool is_root = ::geteuid() == 0;  // root may read any file
    if (is_root) REQUIRE(::seteuid(65534) == 0);
    const std::optional<error_code> of_file = raised([&] { storage.get("a.jpg", 100); });
    const std::optional<error_code> of_folder = raised([&] { storage.get("locked/a.jpg", 100); });
    const std::optional<error_code> of_output = raised([&] { storage.put("kept.glb", byte_string(5)); });
    const std::optional<error_code> of_new_output = raised([&] { storage.put("locked/b.glb", byte_string(5)); });
    if (is_root) REQUIRE(::seteuid(0) == 0);
    for (const auto& code : {of_file, of_folder, of_output}) CHECK(code == error_code::file_access);
    CHECK(of_new_output == error_code::unavailable);  // a folder may become writable, and other outputs need it, too
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
    // The path of the storage itself may be a symbolic link, because the caller chooses this path.
    std::filesystem::create_symlink("in", folder / "link");
    folder_storage(folder / "link").put("a", byte_string(4));
    CHECK(storage.get("a", 10).size() == 4);
}

TEST_CASE("a reader receives either all old or all new bytes of an object, even if the object has hard links") {
    constexpr std::size_t size = 4'000'000;
    const scratch_folder folder;
    folder_storage storage(folder / ".");
    storage.put("a", byte_string(size, std::byte{0}));
    std::atomic<bool> is_done{false};
    std::size_t mixed = 0, reads = 0;
    std::thread reader([&] {
        for (folder_storage same(folder / "."); !is_done; ++reads) {
            const byte_string bytes = same.get("a", size);
            mixed += bytes.size() != size || std::count(bytes.begin(), bytes.end(), bytes[0]) != std::ptrdiff_t{size} ? 1U : 0U;
        }
    });
    for (int i = 1; i <= 20; ++i) {
        const std::filesystem::path twin = folder / ("twin" + std::to_string(i));
        std::filesystem::create_hard_link(folder / "a", twin);
        storage.put("a", byte_string(size, static_cast<std::byte>(i)));
        CHECK(read_file(twin)[0] == static_cast<std::byte>(i - 1));
        std::filesystem::remove(twin);
    }
    is_done = true;
    reader.join();
    CHECK(mixed == 0);
    CHECK(reads > 0);
}

TEST_CASE("if several writers replace an object at the same time, the bytes of one of them and no other file remain") {
    const scratch_folder folder;
    std::vector<std::thread> writers;
    for (int i = 1; i <= 4; ++i)
        writers.emplace_back([&folder, i] {
            folder_storage storage(folder / ".");
            for (int k = 0; k < 25; ++k) storage.put("album/a", byte_string(100'000, static_cast<std::byte>(i)));
        });
    for (std::thread& writer : writers) writer.join();
    const byte_string bytes = folder_storage(folder / ".").get("album/a", 100'000);
    CHECK(bytes == byte_string(100'000, bytes[0]));
    CHECK(names_in(folder / "album") == std::vector<std::string>{"a"});
}

TEST_CASE("a folder storage writes nothing outside its folder, even while another thread replaces subfolders with links") {
    const scratch_folder folder;
    for (const char* name : {"in/album", "out"}) std::filesystem::create_directories(folder / name);
    std::filesystem::create_symlink("../out", folder / "in/link");
    std::atomic<bool> is_done{false};
    std::thread stranger([&] {
        while (!is_done)
            ::renameat2(AT_FDCWD, (folder / "in/album").c_str(), AT_FDCWD, (folder / "in/link").c_str(), RENAME_EXCHANGE);
    });
    folder_storage storage(folder / "in");
    int written = 0;
    for (int i = 0; i < 500; ++i) {
        try {
            storage.put("album/a" + std::to_string(i), byte_string(10));
            ++written;
        } catch (const error&) {  // the folder was a link
        }
    }
    is_done = true;
    stranger.join();
    CHECK(written > 0);
    CHECK(names_in(folder / "out").empty());
}

TEST_CASE("unfinished files of killed processes are removed, and those of other writers are kept") {
    const scratch_folder folder;
    for (const char* name : {".ldi-1.put", ".ldi-2.put", ".ldi-3.tmp"}) write_file(folder / name, byte_string(3));
    const ldi::examples::file_handle written(folder / ".ldi-2.put", O_WRONLY);
    REQUIRE(::flock(written.number(), LOCK_EX) == 0);
    folder_storage(folder / ".").put("a", byte_string(4));
    CHECK(names_in(folder / ".") == std::vector<std::string>{".ldi-2.put", ".ldi-3.tmp", "a"});
}

TEST_CASE("a storage searches each folder only once for unfinished files, because folders may have millions of files") {
    const scratch_folder folder;
    std::filesystem::create_directories(folder / "album");
    folder_storage storage(folder / ".");
    storage.put("a", byte_string(4));
    for (const char* name : {".ldi-1.put", "album/.ldi-2.put"}) write_file(folder / name, byte_string(3));
    storage.put("b", byte_string(4));
    storage.put("album/a", byte_string(4));
    CHECK(names_in(folder / ".") == std::vector<std::string>{".ldi-1.put", "a", "album", "b"});
    CHECK(names_in(folder / "album") == std::vector<std::string>{"a"});
}

TEST_CASE("a replaced object keeps its permissions") {
    const scratch_folder folder;
    folder_storage storage(folder / ".");
    storage.put("a", byte_string(4));
    std::filesystem::permissions(folder / "a", std::filesystem::perms(0640));
    storage.put("a", byte_string(5));
    CHECK(std::filesystem::status(folder / "a").permissions() == std::filesystem::perms(0640));
    CHECK(storage.get("a", 5).size() == 5);
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
