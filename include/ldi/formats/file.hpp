// Whole files in, whole files out. A file that ldi writes appears complete under its name or not at all; file_set.hpp says how,
// and does the same for several files that belong together.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/formats/detail/file_system.hpp>
#include <ldi/formats/file_set.hpp>

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <span>
#include <string>
#include <system_error>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// All bytes of a file.
///
/// max_bytes  a longer file raises error_code::too_large, before more than this is in memory
/// Raises file_access where the file can't be opened or read, or is a folder; unavailable, too_large.
std::vector<std::byte> read_file(const std::filesystem::path& path, std::size_t max_bytes = std::size_t{1} << 30);

/// Writes a file, or replaces it. What stood there before stays untouched until the new content is complete and on the disk. A
/// link is written through; permissions, owner and other names of the file are kept. Devices and pipes, which can't be replaced,
/// are written to directly.
///
/// Raises file_access, unavailable, invalid_option for an empty name; the message names the path and the reason, and nothing
/// temporary is left.
void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes);

inline std::vector<std::byte> read_file(const std::filesystem::path& path, std::size_t max_bytes) {
    std::error_code ignored;
    const std::filesystem::file_status status = std::filesystem::status(path, ignored);
    if (std::filesystem::is_directory(status)) raise(error_code::file_access, path.string(), "a readable file", "a folder");
    errno = 0;
    std::ifstream file(path, std::ios::binary);
    if (!file) detail::raise_system_error(errno, path, "a readable file");

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
        if (file.bad()) detail::raise_system_error(errno, path, "a readable file");
        if (!file) return bytes;
    }
}

inline void write_file(const std::filesystem::path& path, std::span<const std::byte> bytes) {
    file_set files;
    files.write(path, bytes);
    files.commit();
}

}}  // namespace ldi
