// File functions beyond the standard library: locks that end with their process, identities, and owners. Locks require POSIX.
// On other systems, temporary folders of killed processes remain, and if two processes write the same set of files, the final
// files may come from both.
#pragma once

#include <ldi/io/file.hpp>
#include <ldi/io/system_error.hpp>

#include <array>
#include <cerrno>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <ios>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#if defined(__unix__) || defined(__APPLE__)
#define LDI_HAS_POSIX_FILES 1
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#else
#define LDI_HAS_POSIX_FILES 0
#if defined(_WIN32)
#include "windows_api.hpp"
#endif
#endif

namespace ldi::examples {

#if LDI_HAS_POSIX_FILES

/// An open file or folder.
class file_handle {
public:
    file_handle() = default;
    file_handle(const std::filesystem::path& path, int flags) : number_(::open(path.c_str(), flags | O_CLOEXEC)) {}
    /// Opens a file in a folder.
    ///
    /// mode  permissions of a new file
    file_handle(const file_handle& folder, const std::filesystem::path& name, int flags, mode_t mode = 0)
        : number_(::openat(folder.number_, name.c_str(), flags | O_CLOEXEC, mode)) {}
    file_handle(file_handle&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
    file_handle& operator=(file_handle&& other) noexcept {
        std::swap(number_, other.number_);
        return *this;
    }
    ~file_handle() {
        if (number_ >= 0) ::close(number_);
    }
    int number() const { return number_; }

private:
    int number_ = -1;
};

/// A lock on a folder. The lock ends no later than the process, even if the process is killed.
class folder_lock {
public:
    folder_lock() = default;
    /// may_wait  whether to wait for another process that holds the lock
    folder_lock(const std::filesystem::path& folder, bool may_wait)
        : folder_(folder, O_RDONLY | O_DIRECTORY | O_NOFOLLOW),
          is_held_(folder_.number() >= 0 && ::flock(folder_.number(), may_wait ? LOCK_EX : LOCK_EX | LOCK_NB) == 0) {}
    /// Whether this object holds the lock. Also false if the file system does not support locks.
    bool is_held() const { return is_held_; }
    /// Whether the folder still has this name, and belongs to the user of this process.
    bool is_own(const std::filesystem::path& name) const {
        struct stat locked, named;
        return ::fstat(folder_.number(), &locked) == 0 && ::lstat(name.c_str(), &named) == 0 && locked.st_ino == named.st_ino &&
               locked.st_dev == named.st_dev && locked.st_uid == ::geteuid();
    }

private:
    file_handle folder_;
    bool is_held_ = false;
};

/// An exclusive lock on a file. The constructor waits until no other file_lock holds the file.
class file_lock {
public:
    explicit file_lock(const std::filesystem::path& path) : file_(path, O_WRONLY) { ::flock(file_.number(), LOCK_EX); }

private:
    file_handle file_;
};

/// Returns the same text for all names of one file, and different texts for different files; empty if there is no file.
inline std::string file_identity(const std::filesystem::path& path) {
    struct stat found;
    if (::stat(path.c_str(), &found) != 0) return {};
    return std::to_string(found.st_dev) + ":" + std::to_string(found.st_ino);
}

/// Returns 0 if this process may write to a file or folder, otherwise an error number.
inline int check_writable(const std::filesystem::path& path) {
    return ::faccessat(AT_FDCWD, path.c_str(), W_OK, AT_EACCESS) == 0 ? 0 : last_error();
}

/// Copies owner, group and permissions from one file to another. Returns 0 or an error number.
inline int copy_ownership(const std::filesystem::path& from, const std::filesystem::path& to) {
    struct stat wanted, made;
    if (::stat(from.c_str(), &wanted) != 0 || ::stat(to.c_str(), &made) != 0) return last_error();
    const bool is_others = wanted.st_uid != made.st_uid || wanted.st_gid != made.st_gid;
    if (is_others && ::chown(to.c_str(), wanted.st_uid, wanted.st_gid) != 0) return last_error();
    return ::chmod(to.c_str(), wanted.st_mode & 07777) == 0 ? 0 : last_error();
}

#else

class folder_lock {
public:
    folder_lock() = default;
    folder_lock(const std::filesystem::path&, bool) {}
    bool is_held() const { return false; }
    bool is_own(const std::filesystem::path&) const { return true; }
};

class file_lock {
public:
    explicit file_lock(const std::filesystem::path&) {}
};

#if defined(_WIN32)
inline std::string file_identity(const std::filesystem::path& path) {
    const HANDLE file = CreateFileW(path.c_str(), 0, FILE_SHARE_READ | FILE_SHARE_WRITE | FILE_SHARE_DELETE, nullptr,
                                    OPEN_EXISTING, FILE_FLAG_BACKUP_SEMANTICS, nullptr);  // also opens folders
    if (file == INVALID_HANDLE_VALUE) return {};
    BY_HANDLE_FILE_INFORMATION found{};
    const bool is_known = GetFileInformationByHandle(file, &found) != 0;
    CloseHandle(file);
    if (!is_known) return {};
    return std::to_string(found.dwVolumeSerialNumber) + ":" + std::to_string(found.nFileIndexHigh) + ":" +
           std::to_string(found.nFileIndexLow);
}
#else
inline std::string file_identity(const std::filesystem::path&) { return {}; }
#endif

inline int check_writable(const std::filesystem::path&) { return 0; }

inline int copy_ownership(const std::filesystem::path& from, const std::filesystem::path& to) {
    std::error_code failure;
    std::filesystem::permissions(to, std::filesystem::status(from, failure).permissions(), failure);
    return failure.value();
}

#endif

/// Overwrites an existing file with the content of another, so that all hard links of the file show the new content. Returns 0
/// or an error number.
inline int overwrite(const std::filesystem::path& path, const std::filesystem::path& content) {
    errno = 0;
    std::ifstream from(content, std::ios::binary);
    std::fstream to(path, std::ios::binary | std::ios::in | std::ios::out);
    if (!from || !to) return last_error();
    std::array<char, 1 << 16> chunk;
    std::uintmax_t size = 0;
    while (to && (from.read(chunk.data(), chunk.size()) || from.gcount() > 0)) {
        to.write(chunk.data(), from.gcount());
        size += static_cast<std::uintmax_t>(from.gcount());
    }
    to.close();
    if (from.bad() || !to) return last_error();
    std::error_code failure;
    std::filesystem::resize_file(path, size, failure);
    return failure ? failure.value() : synchronize(path);
}

}  // namespace ldi::examples
