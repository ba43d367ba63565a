// Loads a depth network from a safetensors file (formats/tiefenrausch.hpp), or from the folder of the published network
// (io/published_network.hpp).
#pragma once

#include <ldi/formats/tiefenrausch.hpp>
#include <ldi/io/file.hpp>
#include <ldi/io/published_network.hpp>

#include <filesystem>
#include <system_error>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Loads a depth network from a safetensors file. Raises file_access and the errors of decode_tiefenrausch().
inline tiefenrausch load_tiefenrausch_file(const std::filesystem::path& path) {
    return decode_tiefenrausch(read_file(path), path.string());
}

/// Loads a depth network.
///
/// path  a folder with the published network (load_tiefenrausch()), or a file (load_tiefenrausch_file())
inline tiefenrausch load_depth_network(const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::is_directory(path, ignored) ? load_tiefenrausch(path) : load_tiefenrausch_file(path);
}

}}  // namespace ldi
