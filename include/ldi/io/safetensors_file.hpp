// Loads safetensors files.
#pragma once

#include <ldi/formats/safetensors.hpp>
#include <ldi/io/file.hpp>

#include <filesystem>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Loads all tensors of a file. Raises file_access and the errors of decode_safetensors().
inline named_tensors load_safetensors(const std::filesystem::path& path) {
    return decode_safetensors(read_file(path), path.string());
}

}}  // namespace ldi
