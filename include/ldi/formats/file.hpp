// Whole files in, whole files out. A file that ldi writes appears complete under its name or not at all: it is written beside its
// place under a temporary name and then renamed.
#pragma once

#include <ldi/base/error.hpp>

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

namespace ldi::inline LDI_CONFIGURATION {

/// All bytes of a file.
///
/// max_bytes  a longer file raises error_code::too_large, before more than this is in memory
/// Raises file_access where the file can't be opened or read, or is a folder; too_large.
std::vector<std::byte> read_file(const std::filesystem::path& path, std::size_t max_bytes = std::size_t{1} << 30);

/// Writes a file, or replaces it. What stood there before stays untouched until the new content is complete. Devices and pipes,
/// which can't be replaced, are written to directly.
///
/// Raises file_access; the message names the path and the reason, and no temporary file is left.
void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes);

namespace detail {

/// The operating system's reason, from errno.
inline std::string system_reason(int error_number) {
    return error_number == 0 ? std::string("an input or output error") : std::generic_category().message(error_number);
}

/// A name in the same folder (so that renaming does not copy) that nobody else uses.
inline std::filesystem::path temporary_name_beside(const std::filesystem::path& path) {
    std::random_device random;
    const std::uint64_t number = (std::uint64_t{random()} << 32) | random();
    std::string name = ".ldi-";
    for (int shift = 60; shift >= 0; shift -= 4) name += "0123456789abcdef"[(number >> shift) & 15];
    return path.parent_path() / (name + ".tmp");
}

/// Empty on success, else the reason.
inline std::string write_bytes(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    errno = 0;
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    if (!file) return system_reason(errno);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    file.close();  // a full disk may show only here
    return file ? std::string() : system_reason(errno);
}

}  // namespace detail

inline std::vector<std::byte> read_file(const std::filesystem::path& path, std::size_t max_bytes) {
    const auto refused = [&](const std::string& reason) {
        raise(error_code::file_access, path.string(), "a readable file", reason);
    };
    std::error_code ignored;
    const std::filesystem::file_status status = std::filesystem::status(path, ignored);
    if (std::filesystem::is_directory(status)) refused("a folder");
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file) refused(detail::system_reason(errno));

    // The size that the system reports saves copies; only what is really read counts, since pipes and growing files have none.
    constexpr std::size_t chunk = std::size_t{1} << 16;
    const auto too_large = [&] {
        raise(error_code::too_large, path.string(), "at most " + std::to_string(max_bytes) + " bytes", "more");
    };
    std::vector<std::byte> bytes;
    if (std::filesystem::is_regular_file(status)) {
        const std::uintmax_t size = std::filesystem::file_size(path, ignored);
        if (!ignored && size > max_bytes) too_large();
        if (!ignored) bytes.reserve(static_cast<std::size_t>(size) + chunk);  // the last read asks for a chunk beyond the end
    }
    for (;;) {
        const std::size_t used = bytes.size();
        bytes.resize(used + chunk);
        file.read(reinterpret_cast<char*>(bytes.data() + used), static_cast<std::streamsize>(chunk));
        bytes.resize(used + static_cast<std::size_t>(file.gcount()));
        if (bytes.size() > max_bytes) too_large();
        if (file.bad()) refused(detail::system_reason(errno));
        if (!file) return bytes;
    }
}

inline void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    const auto refused = [&](const std::string& reason) {
        raise(error_code::file_access, path.string(), "a writable place", reason);
    };
    std::error_code failure;
    const std::filesystem::file_status there = std::filesystem::status(path, failure);
    if (std::filesystem::is_directory(there)) refused("a folder");
    if (std::filesystem::exists(there) && !std::filesystem::is_regular_file(there)) {
        const std::string reason = detail::write_bytes(path, bytes);
        if (!reason.empty()) refused(reason);
        return;
    }
    const std::filesystem::path temporary = detail::temporary_name_beside(path);
    std::string reason = detail::write_bytes(temporary, bytes);
    if (reason.empty()) {
        std::filesystem::rename(temporary, path, failure);
        if (!failure) return;
        reason = failure.message();
    }
    std::filesystem::remove(temporary, failure);
    refused(reason);
}

}  // namespace ldi
