// Reads a depth network from the bytes of a safetensors file as examples/training/tiefenrausch_small/export.py writes it: a small
// student of the published network, in the same arithmetic. formats/tiefenrausch_file.hpp reads it by name.
#pragma once

#include <ldi/formats/safetensors.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <ldi/nn/dense/quantized_weights.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <utility>

namespace ldi::inline LDI_CONFIGURATION {

/// "output" in the metadata says what the result stands for, "disparity" or "log disparity".
///
/// Raises those of decode_safetensors(), read_quantized_network() and tiefenrausch; mismatch where the metadata tell of another
/// network.
inline tiefenrausch decode_tiefenrausch(std::span<const std::byte> bytes, const std::string& where = "weights",
                                        isa target = best_isa()) {
    const named_tensors file = decode_safetensors(bytes, where);
    for (const auto& [key, expected] :
         {std::pair{"format", "ldi"}, std::pair{"name", "tiefenrausch_small"}, std::pair{"version", "1"}})
        detail::check_metadata(file, "a depth network", key, expected);
    const auto output = file.metadata.find("output");
    const bool is_linear = output != file.metadata.end() && output->second == "disparity";
    if (!is_linear) detail::check_metadata(file, "a depth network", "output", "log disparity");
    return tiefenrausch(read_quantized_network(file), target,
                        is_linear ? network_output::disparity : network_output::log_disparity);
}

}  // namespace ldi
