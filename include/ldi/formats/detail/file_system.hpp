// What the standard library's files do not know: the operating system's reasons, content that is safe on the disk, locks that end
// with the process that holds them, and owners. On systems without POSIX the last three do nothing.
#pragma once

#include <ldi/base/error.hpp>

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

#if __has_include(<unistd.h>) && __has_include(<sys/file.h>)
#define LDI_HAS_POSIX_FILES 1
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>
#else
#define LDI_HAS_POSIX_FILES 0
#endif

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// The operating system's reason, from errno.
inline std::string system_reason(int error_number) {
    return error_number == 0 ? std::string("an input or output error") : std::generic_category().message(error_number);
}

/// Whether the same call may succeed later, without anybody changing what it is called with.
inline bool may_pass(int error_number) {
    switch (error_number) {
        case ENOSPC:
        case EIO:
        case ENOMEM:
        case EPIPE:
        case EMFILE:
        case ENFILE:
        case EAGAIN:
        case EBUSY:
#ifdef EDQUOT
        case EDQUOT:
#endif
            return true;
        default: return false;
    }
}

[[noreturn]] inline void raise_system_error(int error_number, const std::filesystem::path& where, std::string_view expected) {
    raise(may_pass(error_number) ? error_code::unavailable : error_code::file_access, where.string(), expected,
          error_number == ENOENT ? "no such file" : "an error: " + system_reason(error_number));
}

/// errno after a failure, which functions below return: never 0.
inline int last_error() { return errno == 0 ? EIO : errno; }

/// Creates a file or replaces its content.
inline int write_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    errno = 0;
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    if (!file) return last_error();
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    file.close();  // a full disk may show only here
    return file ? 0 : last_error();
}

#if LDI_HAS_POSIX_FILES

/// An open file or folder.
class file_handle {
public:
    file_handle() = default;
    file_handle(const std::filesystem::path& path, int flags) : number_(::open(path.c_str(), flags | O_CLOEXEC)) {}
    /// In a folder.
    file_handle(const file_handle& folder, const std::filesystem::path& name, int flags)
        : number_(::openat(folder.number_, name.c_str(), flags | O_CLOEXEC)) {}
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

/// Waits until the content of a file, or the names in a folder, are on the disk.
inline int synchronize(const std::filesystem::path& path) {
    const file_handle file(path, O_RDONLY);
    if (file.number() < 0) return last_error();
    if (::fsync(file.number()) == 0 || errno == EINVAL || errno == ENOTSUP) return 0;  // some file systems can't
    return last_error();
}

/// A lock on a folder, which ends with the process at the latest, however that ends.
class folder_lock {
public:
    folder_lock() = default;
    /// may_wait  for another process that holds it
    folder_lock(const std::filesystem::path& folder, bool may_wait)
        : folder_(folder, O_RDONLY | O_DIRECTORY | O_NOFOLLOW),
          is_held_(folder_.number() >= 0 && ::flock(folder_.number(), may_wait ? LOCK_EX : LOCK_EX | LOCK_NB) == 0) {}
    /// False also where the file system knows no locks.
    bool is_held() const { return is_held_; }
    /// Whether the folder still has this name, and belongs to whom this process works for.
    bool is_own(const std::filesystem::path& name) const {
        struct stat locked, named;
        return ::fstat(folder_.number(), &locked) == 0 && ::lstat(name.c_str(), &named) == 0 && locked.st_ino == named.st_ino &&
               locked.st_dev == named.st_dev && locked.st_uid == ::geteuid();
    }

private:
    file_handle folder_;
    bool is_held_ = false;
};

/// Keeps others from a file who lock it, too; waits for them.
class file_lock {
public:
    explicit file_lock(const std::filesystem::path& path) : file_(path, O_WRONLY) { ::flock(file_.number(), LOCK_EX); }

private:
    file_handle file_;
};

/// The same for all names of one file, different for different files; empty where there is none.
inline std::string file_identity(const std::filesystem::path& path) {
    struct stat found;
    if (::stat(path.c_str(), &found) != 0) return {};
    return std::to_string(found.st_dev) + ":" + std::to_string(found.st_ino);
}

inline int check_writable(const std::filesystem::path& path) {
    return ::faccessat(AT_FDCWD, path.c_str(), W_OK, AT_EACCESS) == 0 ? 0 : last_error();
}

/// Gives one file the owner, the group and the permissions of another.
inline int copy_ownership(const std::filesystem::path& from, const std::filesystem::path& to) {
    struct stat wanted, made;
    if (::stat(from.c_str(), &wanted) != 0 || ::stat(to.c_str(), &made) != 0) return last_error();
    const bool is_others = wanted.st_uid != made.st_uid || wanted.st_gid != made.st_gid;
    if (is_others && ::chown(to.c_str(), wanted.st_uid, wanted.st_gid) != 0) return last_error();
    return ::chmod(to.c_str(), wanted.st_mode & 07777) == 0 ? 0 : last_error();
}

#else

inline int synchronize(const std::filesystem::path&) { return 0; }

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

inline std::string file_identity(const std::filesystem::path&) { return {}; }

inline int check_writable(const std::filesystem::path&) { return 0; }

inline int copy_ownership(const std::filesystem::path& from, const std::filesystem::path& to) {
    std::error_code failure;
    std::filesystem::permissions(to, std::filesystem::status(from, failure).permissions(), failure);
    return failure.value();
}

#endif

/// Gives a file that is there the content of another without replacing it, so that its other names see it, too.
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

}  // namespace detail
}}  // namespace ldi
