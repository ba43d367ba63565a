// Decodes the silhouette network from the bytes of a safetensors file that examples/training/silhouettes/export.py wrote.
// io/weight_files.hpp loads it from a file.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/formats/detail/json.hpp>
#include <ldi/formats/safetensors.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/networks/silhouettes.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Decodes a silhouette network.
///
/// bytes   the whole file
/// where   name of the file in messages
/// target  instruction set for which to pack the weights; must be available (is_available()), else raises invalid_option
///
/// Raises the errors of decode_safetensors() and of silhouette_network's constructor. Also raises mismatch if the metadata
/// describes a different kind of network, and unsupported if it specifies a different architecture or different constants of
/// the band (depth/step_band.hpp).
inline silhouette_network decode_silhouettes(std::span<const std::byte> bytes, const std::string& where = "weights",
                                             isa target = best_isa()) {
    const named_tensors file = decode_safetensors(bytes, where);
    detail::check_metadata(file, "a silhouette network", "format", "ldi");
    detail::check_metadata(file, "a silhouette network", "name", "silhouettes");
    const auto found = file.metadata.find("architecture");
    if (found == file.metadata.end())
        raise(error_code::mismatch, where, "a silhouette network's architecture in the metadata", "no such entry");
    const std::string here = where + ", architecture";
    const detail::json_value text = detail::read_json_object(found->second, 4, here);
    // Any other value would require a different band or different arithmetic.
    const std::string_view fixed[][2] = {{"version", "1"},        {"layout", "\"out,in,height,width\""},
                                         {"prior", "6.0"},        {"kernel", "3"},
                                         {"max_step", "0.02"},    {"min_step", "0.06"},
                                         {"sides_radius", "4"},   {"band_radius", "12"},
                                         {"region_radius", "16"}, {"activation", "\"relu, none in the last\""}};
    for (const auto& [key, value] : fixed)
        if (const detail::json_value is = detail::json_member(text, key); is.text != value)
            raise(error_code::unsupported, here, std::string(key) + " " + std::string(value), detail::printable(is.text));
    return silhouette_network(file, target);
}

}}  // namespace ldi
