// Storage for photos and outputs: objects of bytes, named by keys. A folder_storage keeps them in a folder, an s3_storage on a
// server (s3_storage.hpp); a patient_storage wraps either one and retries.
#pragma once

#include "../photo3d/file_system.hpp"
#include "../photo3d/staging_folder.hpp"
#include "message.hpp"

#include <ldi/base/error.hpp>
#include <ldi/io/system_error.hpp>

#include <dirent.h>
#include <fcntl.h>
#include <limits.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <thread>
#include <type_traits>
#include <unordered_set>
#include <utility>
#include <vector>

namespace ldi::examples {

/// Objects of bytes, named by keys. One thread at a time may use a storage.
class storage {
public:
    static constexpr std::size_t max_object_bytes = std::size_t{1} << 30;

    virtual ~storage() = default;

    /// Raises invalid_data for a key that put() would not accept.
    virtual void check(const std::string& key) const = 0;

    /// Returns an object, or nothing if there is nothing with this key. Raises file_access if the key names something that can't
    /// be read, such as a folder, too_large if the object has more than max_bytes, and unavailable for failures of the storage
    /// itself: no network, no space, wrong credentials.
    virtual std::optional<std::vector<std::byte>> find(const std::string& key, std::size_t max_bytes) = 0;

    /// Returns an object that must exist. Raises file_access if it does not, unavailable if the whole storage seems to be absent,
    /// and the errors of find().
    virtual std::vector<std::byte> get(const std::string& key, std::size_t max_bytes) {
        std::optional<std::vector<std::byte>> found = find(key, max_bytes);
        if (!found && is_empty()) raise(error_code::unavailable, where(key), "a storage with objects", "an empty folder");
        if (!found) raise(error_code::file_access, where(key), "an object", "none");
        return std::move(*found);
    }

    /// Whether the storage is known to have no objects at all, as a folder does whose disk is not mounted.
    virtual bool is_empty() const { return false; }

    /// Writes an object. Anyone who reads it meanwhile gets all old bytes or all new bytes. Raises the same errors as find().
    virtual void put(const std::string& key, std::span<const std::byte> bytes) = 0;

    /// Returns the place of an object for messages: its path or its URL.
    virtual std::string where(const std::string& key) const = 0;
};

/// A folder, possibly on another machine. Untrusted users may have written to it. The functions therefore do not follow links,
/// so that they read and write nothing outside the folder, and open only regular files. If another folder takes the place of this
/// one, because a disk was mounted or unmounted, they raise unavailable.
class folder_storage : public storage {
public:
    explicit folder_storage(std::filesystem::path folder) : folder_(std::move(folder)) { remember(open_root()); }

    void check(const std::string& key) const override {
        constexpr std::size_t max_name = NAME_MAX, max_path = PATH_MAX;
        check_key(key);
        std::size_t longest = 0;
        for (const std::filesystem::path& name : std::filesystem::path(key)) longest = std::max(longest, name.native().size());
        if (longest > max_name || (folder_ / key).native().size() >= max_path)
            raise(error_code::invalid_data, "message",
                  "a key whose names have at most " + std::to_string(max_name) + " bytes each", key);
    }

    std::optional<std::vector<std::byte>> find(const std::string& key, std::size_t max_bytes) override {
        const std::optional<file_handle> folder = find_folder_of(key);
        if (!folder) return std::nullopt;
        // Without O_NONBLOCK, opening a pipe without a writer would block forever.
        const file_handle file(*folder, name_of(key), O_RDONLY | O_NOFOLLOW | O_NONBLOCK);
        if (file.number() < 0 && errno == ENOENT) return std::nullopt;
        if (file.number() < 0) fail_to_open(key, "a file that can be read");
        struct stat facts {};
        if (::fstat(file.number(), &facts) != 0) fail(key, "a file that can be read");
        if (!S_ISREG(facts.st_mode)) raise(error_code::file_access, where(key), "a file", "something else, such as a pipe");
        const std::size_t size = static_cast<std::size_t>(facts.st_size);
        std::vector<std::byte> bytes(std::min(size, max_bytes) + 1);  // one more, to detect a file that grows
        std::size_t used = 0;
        while (used < bytes.size()) {
            const ssize_t got = ::read(file.number(), bytes.data() + used, bytes.size() - used);
            if (got < 0 && errno == EINTR) continue;
            if (got < 0) fail(key, "a file that can be read");
            if (got == 0) break;
            used += static_cast<std::size_t>(got);
        }
        if (used > max_bytes)
            raise(error_code::too_large, where(key), "at most " + std::to_string(max_bytes) + " bytes", std::to_string(size));
        bytes.resize(used);
        return bytes;
    }

    std::string where(const std::string& key) const override { return (folder_ / key).string(); }

    bool is_empty() const override {
        std::error_code failure;
        const std::filesystem::directory_iterator items(folder_, failure);
        return !failure && items == std::filesystem::directory_iterator();
    }

    void put(const std::string& key, std::span<const std::byte> bytes) override {
        check(key);
        const file_handle folder = make_folder_of(key);
        struct stat facts {};
        if (::fstatat(folder.number(), name_of(key).c_str(), &facts, AT_SYMLINK_NOFOLLOW) == 0 && !S_ISREG(facts.st_mode))
            raise(error_code::file_access, where(key), "a regular file or none",
                  "a link, or something else that is not a regular file");
        if (searched_.insert(std::filesystem::path(key).parent_path().string()).second)  // searches each folder once
            remove_abandoned(folder);
        if (::faccessat(folder.number(), name_of(key).c_str(), W_OK, AT_EACCESS) != 0 && errno != ENOENT)
            fail_to_open(key, "a file that can be replaced");
        temporary_file file(folder);
        if (!file.write(bytes) || !file.put_in_place(name_of(key))) fail(key, "a writable place");
    }

private:
    /// Device and number of a folder.
    using identity = std::pair<dev_t, ino_t>;

    /// A new file of a folder that is not complete yet: .ldi-NUMBER.put. It is locked, so that other processes can recognize the
    /// files that killed processes left. All functions work on the open folder, so that nothing outside it is written even if
    /// somebody replaces folders with links meanwhile.
    class temporary_file {
    public:
        explicit temporary_file(const file_handle& folder) : folder_(folder) {
            struct stat facts {};
            do {  // repeats if another process has removed the file as abandoned before this one locked it
                name_ = temporary_name() + ".put";
                file_ = file_handle(folder, name_, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW, 0666);
            } while (file_.number() >= 0 && ::flock(file_.number(), LOCK_EX) == 0 && ::fstat(file_.number(), &facts) == 0 &&
                     facts.st_nlink == 0);
        }
        temporary_file(const temporary_file&) = delete;
        temporary_file& operator=(const temporary_file&) = delete;
        ~temporary_file() {
            const int reason = errno;
            if (file_.number() >= 0) ::unlinkat(folder_.number(), name_.c_str(), 0);  // fails if the file is in place
            errno = reason;
        }

        /// Writes all bytes to the disk. False after a failure, with errno set.
        bool write(std::span<const std::byte> bytes) {
            if (file_.number() < 0) return false;
            while (!bytes.empty()) {
                const ssize_t written = ::write(file_.number(), bytes.data(), bytes.size());
                if (written < 0 && errno == EINTR) continue;
                if (written < 0) return false;
                bytes = bytes.subspan(static_cast<std::size_t>(written));
            }
            return ::fsync(file_.number()) == 0;
        }

        /// Replaces the file `name`. Keeps the file's permissions, and also its owner if the system allows it. False after a
        /// failure, with errno set.
        bool put_in_place(const std::string& name) {
            struct stat old {};
            if (::fstatat(folder_.number(), name.c_str(), &old, AT_SYMLINK_NOFOLLOW) == 0) {
                static_cast<void>(::fchown(file_.number(), old.st_uid, old.st_gid) == 0);
                if (::fchmod(file_.number(), old.st_mode & 07777) != 0) return false;
            }
            if (::renameat(folder_.number(), name_.c_str(), folder_.number(), name.c_str()) != 0) return false;
            ::fsync(folder_.number());  // some file systems do not support this
            return true;
        }

    private:
        const file_handle& folder_;
        std::string name_;
        file_handle file_;
    };

    /// Removes the unfinished files that killed processes left in a folder.
    static void remove_abandoned(const file_handle& folder) {
        const int again = ::openat(folder.number(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC);  // closedir() closes it
        if (again < 0) return;
        const std::unique_ptr<DIR, int (*)(DIR*)> items(::fdopendir(again), ::closedir);
        for (const dirent* item = nullptr; items && (item = ::readdir(items.get())) != nullptr;) {
            const std::string name = item->d_name;
            if (!name.starts_with(".ldi-") || !name.ends_with(".put")) continue;
            // For a lock of the whole file, NFS needs a file that is open for writing.
            const file_handle file(folder, name, O_RDWR | O_NOFOLLOW | O_NONBLOCK);
            struct stat facts {};
            if (file.number() >= 0 && ::flock(file.number(), LOCK_EX | LOCK_NB) == 0 && ::fstat(file.number(), &facts) == 0 &&
                S_ISREG(facts.st_mode) && facts.st_uid == ::geteuid())
                ::unlinkat(folder.number(), name.c_str(), 0);
        }
    }

    file_handle open_root() const { return file_handle(folder_, O_RDONLY | O_DIRECTORY); }

    /// Returns nothing if the folder does not exist. The device is 0 for network file systems, whose number changes when they are
    /// mounted again.
    static std::optional<identity> identity_of(const file_handle& folder) {
        struct stat facts {};
        if (folder.number() < 0 || ::fstat(folder.number(), &facts) != 0) return std::nullopt;
        return identity{major(facts.st_dev) == 0 ? 0 : facts.st_dev, facts.st_ino};
    }

    void remember(const file_handle& root) const {
        if (!identity_ && !is_empty()) identity_ = identity_of(root);
    }

    static std::string name_of(const std::string& key) { return std::filesystem::path(key).filename().string(); }

    /// Same as fail(), but the permissions of a single file or folder are not a failure of the storage.
    [[noreturn]] void fail_to_open(const std::string& key, const char* expected) const {
        if (errno == EACCES || errno == EPERM) raise_system_error(errno, where(key), expected);
        fail(key, expected);
    }

    /// Raises the error of the last system call.
    ///
    /// expected  for messages
    [[noreturn]] void fail(const std::string& key, const char* expected) const {
        if (errno == ELOOP || errno == EMLINK || errno == ENOTDIR)
            raise(error_code::file_access, where(key), expected,
                  "a link (links are not followed), or a file instead of a folder");
        if (errno == ENOENT || errno == EISDIR || errno == ENAMETOOLONG) raise_system_error(errno, where(key), expected);
        // Any other error is one of the storage, such as a read-only disk, and a later try may succeed.
        raise(error_code::unavailable, where(key), expected, "an error: " + system_reason(last_error()));
    }

    /// Opens the folder of an object; empty if it does not exist. Raises invalid_data, file_access, unavailable.
    std::optional<file_handle> find_folder_of(const std::string& key) const {
        file_handle folder = open_folder_of(key, false);
        if (folder.number() >= 0) return folder;
        if (errno == ENOENT) return std::nullopt;
        fail_to_open(key, "a folder");
    }

    /// Opens the folder of an object, and makes missing folders. Raises invalid_data, file_access, unavailable.
    file_handle make_folder_of(const std::string& key) const {
        file_handle folder = open_folder_of(key, true);
        if (folder.number() < 0) fail(key, "a folder");
        return folder;
    }

    /// Opens the folder of an object, one folder of the path after the other. After a failure, the result is invalid and errno
    /// has the reason.
    file_handle open_folder_of(const std::string& key, bool makes_missing) const {
        check_key(key);
        file_handle folder = open_root();
        // The folder may be on a disk that is not mounted at the moment: a later attempt may succeed.
        if (folder.number() < 0) raise(error_code::unavailable, folder_.string(), "a folder", "none");
        remember(folder);
        if (identity_ && identity_of(folder) != identity_)
            raise(error_code::unavailable, folder_.string(), "the same folder as before",
                  "another, because a disk was mounted or unmounted");
        for (const std::filesystem::path& name : std::filesystem::path(key).parent_path()) {
            const bool is_made = !makes_missing || ::mkdirat(folder.number(), name.c_str(), 0777) == 0 || errno == EEXIST;
            folder = is_made ? file_handle(folder, name, O_RDONLY | O_DIRECTORY | O_NOFOLLOW) : file_handle();
            if (folder.number() < 0) break;
        }
        return folder;
    }

    std::filesystem::path folder_;
    mutable std::optional<identity>
        identity_;  // empty while the folder is absent or empty, because its disk may be mounted later
    std::unordered_set<std::string> searched_;  // folders of objects
};

/// Retries operations of another storage that is temporarily unavailable.
class patient_storage : public storage {
public:
    using duration = std::chrono::duration<double>;

    /// patience    time in seconds after which a request fails; 0: no retries
    /// is_ending   stops the retries when it becomes true
    /// on_failure  is called with the message of every failure
    patient_storage(std::unique_ptr<storage> tried, duration patience, const std::atomic<bool>& is_ending,
                    std::function<void(const std::string&)> on_failure)
        : tried_(std::move(tried)), patience_(patience), is_ending_(is_ending), on_failure_(std::move(on_failure)) {}

    void check(const std::string& key) const override { tried_->check(key); }
    std::optional<std::vector<std::byte>> find(const std::string& key, std::size_t max_bytes) override {
        return patiently([&] { return tried_->find(key, max_bytes); });
    }
    /// Same as storage::get(). After many photos in a row that are missing or can't be read, part of the storage may be absent.
    /// From then on, the function waits before it tries again and fails, so that few photos become dead letters until somebody
    /// notices that is_there() is false.
    std::vector<std::byte> get(const std::string& key, std::size_t max_bytes) override {
        try {
            return get_and_count(key, max_bytes);
        } catch (const error& failed) {
            if (failed.code() != error_code::file_access || failures_in_a_row_ < max_failures_in_a_row || is_ending_) throw;
            on_failure_(std::to_string(failures_in_a_row_) + " photos in a row are missing or can't be read: " + failed.what());
        }
        is_there_ = false;
        std::this_thread::sleep_for(std::min(patience_, max_pause));
        return get_and_count(key, max_bytes);
    }
    void put(const std::string& key, std::span<const std::byte> bytes) override {
        patiently([&] { return tried_->put(key, bytes), 0; });
    }
    std::string where(const std::string& key) const override { return tried_->where(key); }

    bool is_empty() const override { return tried_->is_empty(); }

    /// Whether the storage was available at the last try. Any thread may call it.
    bool is_there() const { return is_there_; }

    static constexpr std::size_t max_failures_in_a_row = 20;

private:
    static constexpr duration max_pause{5};

    std::vector<std::byte> get_and_count(const std::string& key, std::size_t max_bytes) {
        std::vector<std::byte> bytes = patiently([&] {
            try {
                return tried_->get(key, max_bytes);
            } catch (const error& failed) {
                if (failed.code() == error_code::file_access) ++failures_in_a_row_;
                throw;
            }
        });
        failures_in_a_row_ = 0;
        return bytes;
    }

    template <class Function>
    std::invoke_result_t<Function> patiently(Function function) {
        const auto begun = std::chrono::steady_clock::now();
        for (duration pause(0.1);; pause = std::min(2 * pause, max_pause)) {
            try {
                std::invoke_result_t<Function> result = function();
                is_there_ = true;
                return result;
            } catch (const error& failed) {
                is_there_ = failed.code() != error_code::unavailable;
                if (is_there_) throw;
                on_failure_(failed.what());
                if (std::chrono::steady_clock::now() - begun + pause > patience_ || is_ending_) throw;
            }
            std::this_thread::sleep_for(pause);
        }
    }

    std::unique_ptr<storage> tried_;
    duration patience_;
    const std::atomic<bool>& is_ending_;
    std::function<void(const std::string&)> on_failure_;
    std::atomic<bool> is_there_{true};
    std::size_t failures_in_a_row_ = 0;
};

}  // namespace ldi::examples
