// Writes GLB files to disk.
#pragma once

#include <ldi/formats/glb.hpp>
#include <ldi/io/file.hpp>

#include <cstddef>
#include <filesystem>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Encodes a mesh with encode_glb() and writes it to a file; also raises file_access.
inline void save_glb(const std::filesystem::path& path, const textured_mesh& mesh,
                     std::span<const std::span<const std::byte>> textures, const glb_options& options = {}) {
    write_file(path, encode_glb(mesh, textures, options));
}

/// Writes a mesh with one texture.
inline void save_glb(const std::filesystem::path& path, const textured_mesh& mesh, std::span<const std::byte> texture,
                     const glb_options& options = {}) {
    write_file(path, encode_glb(mesh, texture, options));
}

}}  // namespace ldi
