// Reads and writes whole files. A written file appears complete under its name or not at all.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/io/system_error.hpp>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <random>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#if defined(__unix__) || defined(__APPLE__)
#include <fcntl.h>
#include <unistd.h>
#endif

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Maximum size of a file that read_file() reads by default.
inline constexpr std::size_t max_file_bytes = std::size_t{1} << 30;

/// Reads all bytes of a file.
///
/// max_bytes  maximum size of the file; a larger file raises too_large
///
/// Raises file_access if the file cannot be opened or read, or is a folder. Raises unavailable instead if the same call may
/// succeed later.
std::vector<std::byte> read_file(const std::filesystem::path& path, std::size_t max_bytes = max_file_bytes);

/// Writes or replaces a file. Writes a temporary file `.ldi-NUMBER.tmp` in the same folder first, and renames it when its
/// content is on the disk. Follows symbolic links and keeps permissions. Other hard links to a replaced file keep the old
/// content. Writes directly to devices and pipes.
///
/// Raises file_access, or unavailable if the same call may succeed later, and invalid_option for an empty name. After an error,
/// the old file is unchanged and the temporary file is removed.
void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes);

/// Waits until the content of a file, or the names in a folder, are on the disk. Does nothing on systems without fsync().
/// Returns 0 or an error number.
int synchronize(const std::filesystem::path& path);

/// Resolves symbolic links. The target need not exist. If the target's folder does not exist, returns the path as resolved so
/// far.
std::filesystem::path follow_links(std::filesystem::path path);

inline std::vector<std::byte> read_file(const std::filesystem::path& path, std::size_t max_bytes) {
    std::error_code ignored;
    const std::filesystem::file_status status = std::filesystem::status(path, ignored);
    if (std::filesystem::is_directory(status)) raise(error_code::file_access, path.string(), "a readable file", "a folder");
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file) raise_system_error(errno, path, "a readable file");

    // Reserves the reported size to avoid copies. Reads to the end of the file nevertheless, because pipes and growing files
    // report no reliable size.
    constexpr std::size_t chunk = std::size_t{1} << 16;
    const auto too_large = [&] {
        raise(error_code::too_large, path.string(), "at most " + std::to_string(max_bytes) + " bytes", "more");
    };
    std::vector<std::byte> bytes;
    if (std::filesystem::is_regular_file(status)) {
        const std::uintmax_t size = std::filesystem::file_size(path, ignored);
        if (!ignored && size > max_bytes) too_large();
        if (!ignored) bytes.reserve(static_cast<std::size_t>(size) + chunk);  // the last read requests a chunk beyond the end
    }
    for (;;) {
        const std::size_t used = bytes.size();
        bytes.resize(used + chunk);
        file.read(reinterpret_cast<char*>(bytes.data() + used), static_cast<std::streamsize>(chunk));
        bytes.resize(used + static_cast<std::size_t>(file.gcount()));
        if (bytes.size() > max_bytes) too_large();
        if (file.bad()) raise_system_error(errno, path, "a readable file");
        if (!file) return bytes;
    }
}

inline int synchronize([[maybe_unused]] const std::filesystem::path& path) {
#if defined(__unix__) || defined(__APPLE__)
    const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (file < 0) return last_error();
    int failure = ::fsync(file) == 0 ? 0 : last_error();
    if (failure == EINVAL || failure == ENOTSUP) failure = 0;  // not supported by this file system
    ::close(file);
    return failure;
#else
    return 0;
#endif
}

inline std::filesystem::path follow_links(std::filesystem::path path) {
    std::error_code failure;
    for (int links = 0; links < 40 && std::filesystem::is_symlink(std::filesystem::symlink_status(path, failure)); ++links)
        path = path.parent_path() / std::filesystem::read_symlink(path, failure);  // an absolute link replaces the whole path
    const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
    const std::filesystem::path real = std::filesystem::canonical(folder, failure);
    return failure ? path : real / path.filename();
}

/// Creates a file or replaces its content directly, without a temporary file. Returns 0 or an error number.
inline int write_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    errno = 0;
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    if (!file) return last_error();
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    file.close();  // a full disk may be detected only here
    return file ? 0 : last_error();
}

namespace detail {

/// Creates an empty file. Returns 0 or an error number.
///
/// is_private  whether only the owner may open the file, on systems that have such permissions
inline int create_file(const std::filesystem::path& path, [[maybe_unused]] bool is_private) {
#if defined(__unix__) || defined(__APPLE__)
    const int file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, is_private ? 0600 : 0666);
    return file < 0 || ::close(file) != 0 ? last_error() : 0;
#else
    return write_bytes(path, {});
#endif
}

/// Returns a random file name in the folder. Its 64 random bits make it practically certain that no other file has this name.
inline std::filesystem::path temporary_name(const std::filesystem::path& folder) {
    std::random_device random;
    std::string digits;
    for (int i = 0; i < 16; ++i) digits += "0123456789abcdef"[random() % 16];
    return folder / (".ldi-" + digits + ".tmp");
}

}  // namespace detail

inline void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    constexpr const char* expected = "a writable place";
    if (path.empty()) raise(error_code::invalid_option, "output", "the name of a file", "an empty name");
    std::error_code failure;
    const std::filesystem::file_status status = std::filesystem::status(path, failure);
    if (std::filesystem::is_directory(status)) raise(error_code::file_access, path.string(), expected, "a folder");
    const bool exists = std::filesystem::exists(status);
    if (exists && !std::filesystem::is_regular_file(status)) {
        if (const int error_number = write_bytes(path, bytes); error_number != 0)
            raise_system_error(error_number, path, expected);
        return;
    }
    const std::filesystem::path target = follow_links(path), folder = target.parent_path();
    if (!std::filesystem::is_directory(folder, failure))
        raise(error_code::file_access, path.string(), expected, "no folder " + folder.string());
    errno = 0;
    if (exists && !std::fstream(target, std::ios::binary | std::ios::in | std::ios::out)) {
        if (may_succeed_later(errno)) raise_system_error(errno, path, expected);
        raise(error_code::file_access, path.string(), expected, "a protected file");
    }
    const std::filesystem::path temporary = detail::temporary_name(folder);
    // The permissions of an existing file may be narrower than the default. Nobody else may open the temporary file before it
    // gets these permissions.
    int error_number = detail::create_file(temporary, exists);
    if (error_number == 0) error_number = write_bytes(temporary, bytes);
    if (error_number == 0) error_number = synchronize(temporary);
    if (error_number == 0 && exists) {
        std::filesystem::permissions(temporary, status.permissions(), failure);
        error_number = failure.default_error_condition().value();  // Windows has numbers of its own
    }
    if (error_number == 0) {
        std::filesystem::rename(temporary, target, failure);
        error_number = failure.default_error_condition().value();
    }
    if (error_number != 0) {
        std::filesystem::remove(temporary, failure);
        raise_system_error(error_number, path, expected);
    }
    synchronize(folder);
}

}}  // namespace ldi
