// Reads safetensors files by name.
#pragma once

#include <ldi/formats/safetensors.hpp>
#include <ldi/io/file.hpp>

#include <filesystem>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Raises file_access, and those of decode_safetensors().
inline named_tensors load_safetensors(const std::filesystem::path& path) {
    return decode_safetensors(read_file(path), path.string());
}

}}  // namespace ldi
