// Loads networks from their weight files: safetensors files, and the two Caffe2 files of the depth network that the paper's
// authors published (https://github.com/facebookresearch/one_shot_3d_photography, folder model).
#pragma once

#include <ldi/formats/farbrausch.hpp>
#include <ldi/formats/safetensors.hpp>
#include <ldi/formats/silhouettes.hpp>
#include <ldi/formats/tiefenrausch.hpp>
#include <ldi/io/caffe2.hpp>
#include <ldi/io/file.hpp>
#include <ldi/networks/tiefenrausch.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <system_error>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Loads all tensors of a safetensors file. Raises file_access and the errors of decode_safetensors().
inline named_tensors load_safetensors(const std::filesystem::path& path) {
    return decode_safetensors(read_file(path), path.string());
}

/// Loads an inpainting network. decode_farbrausch() explains `kind`. Raises file_access and the errors of decode_farbrausch().
inline farbrausch load_farbrausch(const std::filesystem::path& path, std::optional<arithmetic> kind = arithmetic::float32) {
    return decode_farbrausch(read_file(path), path.string(), kind);
}

/// Loads a silhouette network. Raises file_access and the errors of decode_silhouettes().
inline silhouette_network load_silhouettes(const std::filesystem::path& path) {
    return decode_silhouettes(read_file(path), path.string());
}

/// Loads a depth network from a safetensors file. Raises file_access and the errors of decode_tiefenrausch().
inline tiefenrausch load_tiefenrausch_file(const std::filesystem::path& path) {
    return decode_tiefenrausch(read_file(path), path.string());
}

/// Loads the published depth network. Raises file_access and the errors of read_caffe2() and tiefenrausch.
///
/// folder  contains tiefenrausch.pb and tiefenrausch_init.pb
inline tiefenrausch load_tiefenrausch(const std::filesystem::path& folder) {
    const std::filesystem::path network_file = folder / "tiefenrausch.pb", weight_file = folder / "tiefenrausch_init.pb";
    const std::vector<std::byte> network = read_file(network_file), weights = read_file(weight_file);
    const auto bytes = [](const std::vector<std::byte>& file) {
        return std::span<const std::uint8_t>(reinterpret_cast<const std::uint8_t*>(file.data()), file.size());
    };
    return tiefenrausch(read_caffe2(bytes(network), bytes(weights), network_file.string(), weight_file.string()));
}

/// Loads a depth network.
///
/// path  a folder with the published network, or a safetensors file
///
/// Raises the errors of load_tiefenrausch() for a folder, and those of load_tiefenrausch_file() for a file.
inline tiefenrausch load_depth_network(const std::filesystem::path& path) {
    std::error_code ignored;
    return std::filesystem::is_directory(path, ignored) ? load_tiefenrausch(path) : load_tiefenrausch_file(path);
}

}}  // namespace ldi
