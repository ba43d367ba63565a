// Reads a depth network from the bytes of a safetensors file that examples/training/tiefenrausch_small/export.py wrote. The
// network is small, was trained on the outputs of other networks, and uses the same arithmetic as the published Tiefenrausch.
// io/weight_files.hpp loads it from disk.
#pragma once

#include <ldi/formats/safetensors.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <ldi/nn/dense/quantized_weights.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Reads a side length in pixels from the metadata. Returns `otherwise` if the metadata has no entry `key`.
inline std::size_t size_in(const named_tensors& file, const char* key, std::size_t otherwise) {
    const auto found = file.metadata.find(key);
    if (found == file.metadata.end()) return otherwise;
    const std::string& digits = found->second;
    if (digits.empty() || digits.size() > 4 || digits.find_first_not_of("0123456789") != std::string::npos)
        raise(error_code::invalid_data, place_in(file.where, std::string("metadata \"") + key + "\""),
              "a number of pixels with one to four digits", printable(digits));
    std::size_t size = 0;
    for (const char digit : digits) size = 10 * size + static_cast<std::size_t>(digit - '0');
    return size;
}

}  // namespace detail

/// Decodes a depth network. The metadata entry "output" specifies the kind of result: "disparity" or "log disparity". The
/// optional entries "details_long_side" and "layout_long_side" set the members of depth_network_sizes.
///
/// bytes   the whole file
/// where   name of the file in messages
/// target  instruction set for which to pack the weights; must be available (is_available()), else raises invalid_option
///
/// Raises the errors of decode_safetensors(), read_quantized_network() and the constructor of tiefenrausch, and mismatch if the
/// metadata describes a different network.
inline tiefenrausch decode_tiefenrausch(std::span<const std::byte> bytes, const std::string& where = "weights",
                                        isa target = best_isa()) {
    const named_tensors file = decode_safetensors(bytes, where);
    for (const auto& [key, expected] :
         {std::pair{"format", "ldi"}, std::pair{"name", "tiefenrausch_small"}, std::pair{"version", "1"}})
        detail::check_metadata(file, "a depth network", key, expected);
    const auto output = file.metadata.find("output");
    const bool is_linear = output != file.metadata.end() && output->second == "disparity";
    if (!is_linear) detail::check_metadata(file, "a depth network", "output", "log disparity");
    depth_network_sizes sizes;
    sizes.details = detail::size_in(file, "details_long_side", sizes.details);
    sizes.layout = detail::size_in(file, "layout_long_side", sizes.layout);
    return tiefenrausch(read_quantized_network(file), target,
                        is_linear ? network_output::disparity : network_output::log_disparity, sizes);
}

}}  // namespace ldi
