// Loads the depth network as its authors published it: https://github.com/facebookresearch/one_shot_3d_photography, folder model.
#pragma once

#include <ldi/io/file.hpp>
#include <ldi/networks/caffe2.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <ldi/nn/network_description.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace ldi {

/// folder  holds tiefenrausch.pb and tiefenrausch_init.pb
/// Errors: file_access, and those of read_caffe2() and tiefenrausch.
inline tiefenrausch load_tiefenrausch(const std::filesystem::path& folder) {
    const std::vector<std::byte> network = read_file(folder / "tiefenrausch.pb"),
                                 weights = read_file(folder / "tiefenrausch_init.pb");
    const auto bytes = [](const std::vector<std::byte>& file) {
        return std::span<const std::uint8_t>(reinterpret_cast<const std::uint8_t*>(file.data()), file.size());
    };
    network_description description = read_caffe2(bytes(network), bytes(weights));
    description.where = folder.string();
    return tiefenrausch(description);
}

}  // namespace ldi
