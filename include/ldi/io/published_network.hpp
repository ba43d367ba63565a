// Loads the depth network that its authors published: https://github.com/facebookresearch/one_shot_3d_photography, folder model.
#pragma once

#include <ldi/io/caffe2.hpp>
#include <ldi/io/file.hpp>
#include <ldi/networks/tiefenrausch.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION {

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

}}  // namespace ldi
