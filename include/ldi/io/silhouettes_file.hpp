// Reads the silhouette network by name.
#pragma once

#include <ldi/formats/silhouettes.hpp>
#include <ldi/io/file.hpp>

#include <filesystem>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Raises file_access, and what decode_silhouettes() raises.
inline silhouette_network load_silhouettes(const std::filesystem::path& path) {
    return decode_silhouettes(read_file(path), path.string());
}

}}  // namespace ldi
