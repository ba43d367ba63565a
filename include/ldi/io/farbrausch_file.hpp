// Loads the inpainting network from a file.
#pragma once

#include <ldi/formats/farbrausch.hpp>
#include <ldi/io/file.hpp>

#include <filesystem>
#include <optional>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Loads an inpainting network. `kind` is the same as in decode_farbrausch(). Raises file_access and the errors of
/// decode_farbrausch().
inline farbrausch load_farbrausch(const std::filesystem::path& path, std::optional<arithmetic> kind = arithmetic::float32) {
    return decode_farbrausch(read_file(path), path.string(), kind);
}

}}  // namespace ldi
