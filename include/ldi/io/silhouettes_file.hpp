// Loads the silhouette network from a file.
#pragma once

#include <ldi/formats/silhouettes.hpp>
#include <ldi/io/file.hpp>

#include <filesystem>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Loads a silhouette network. Raises file_access and the errors of decode_silhouettes().
inline silhouette_network load_silhouettes(const std::filesystem::path& path) {
    return decode_silhouettes(read_file(path), path.string());
}

}}  // namespace ldi
