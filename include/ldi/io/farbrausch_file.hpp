// Reads the inpainting network by name.
#pragma once

#include <ldi/formats/farbrausch.hpp>
#include <ldi/io/file.hpp>

#include <filesystem>
#include <optional>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Raises file_access, and what decode_farbrausch() raises.
inline farbrausch load_farbrausch(const std::filesystem::path& path, std::optional<arithmetic> kind = arithmetic::float32) {
    return decode_farbrausch(read_file(path), path.string(), kind);
}

}}  // namespace ldi
