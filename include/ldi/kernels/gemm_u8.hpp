// Matrix product of 8-bit activations and 8-bit weights, requantised to 8 bits: the 1 x 1 convolution, and with its windows laid
// out as rows (kernels/window_rows.hpp) any dense one. This header is the contract of the family and its portable implementation.
#pragma once

#include <ldi/kernels/requantize.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace ldi {

/// The weights of one layer in the order that gemm_u8() reads them. Only pack_gemm_u8() makes sound ones.
struct gemm_u8_weights {
    /// Outputs that lie side by side in memory: input by input, the weights of `panel` outputs.
    static constexpr std::size_t panel = 8;

    std::size_t inputs = 0, outputs = 0;
    std::vector<std::int16_t> values;  ///< weight minus its zero point, panels x inputs x panel; unused outputs are 0
    std::vector<std::int32_t> bias;    ///< panels x panel; the input's zero point is folded in
    requantization output;
};

/// weights           outputs x inputs, row-major
/// bias              outputs, in units of input scale * weight scale
/// input_zero_point  of the activations
///
/// For every output, `510 * sum |weight - zero point| + |bias|` must be below 2^31, so that no order of summation overflows.
inline gemm_u8_weights pack_gemm_u8(std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point,
                                    std::span<const std::int32_t> bias, std::uint8_t input_zero_point,
                                    const requantization& output) {
    constexpr std::size_t panel = gemm_u8_weights::panel;
    LDI_ASSERT(!bias.empty() && weights.size() % bias.size() == 0);
    gemm_u8_weights packed;
    packed.outputs = bias.size();
    packed.inputs = weights.size() / bias.size();
    packed.output = output;
    const std::size_t panels = (packed.outputs + panel - 1) / panel;
    packed.values.resize(panels * panel * packed.inputs);
    packed.bias.resize(panels * panel);
    for (std::size_t o = 0; o < packed.outputs; ++o) {
        std::int32_t sum = 0;
        std::int16_t* const column = packed.values.data() + o / panel * panel * packed.inputs + o % panel;
        for (std::size_t i = 0; i < packed.inputs; ++i) {
            const std::int32_t weight = weights[o * packed.inputs + i] - std::int32_t{weight_zero_point};
            column[i * panel] = static_cast<std::int16_t>(weight);
            sum += weight;
        }
        packed.bias[o] = bias[o] - sum * input_zero_point;
    }
    return packed;
}

namespace scalar {

/// The sums of `pixels` rows of the input with one panel of weights, requantised.
template <std::size_t pixels>
inline void gemm_u8_tile(const std::uint8_t* input, std::size_t inputs, const std::int16_t* weights, const std::int32_t* bias,
                         std::size_t outputs_in_panel, const requantization& output, std::uint8_t* result,
                         std::size_t result_stride) {
    constexpr std::size_t panel = gemm_u8_weights::panel;
    std::int32_t sums[pixels][panel];
    for (std::size_t p = 0; p < pixels; ++p)
        for (std::size_t o = 0; o < panel; ++o) sums[p][o] = bias[o];
    for (std::size_t i = 0; i < inputs; ++i, weights += panel)
        for (std::size_t p = 0; p < pixels; ++p) {
            const std::int16_t x = input[p * inputs + i];
            for (std::size_t o = 0; o < panel; ++o) sums[p][o] += std::int32_t{x} * std::int32_t{weights[o]};
        }
    for (std::size_t p = 0; p < pixels; ++p)
        for (std::size_t o = 0; o < outputs_in_panel; ++o) result[p * result_stride + o] = requantize(sums[p][o], output);
}

inline void gemm_u8(const gemm_u8_weights& weights, const std::uint8_t* input, std::size_t rows, std::uint8_t* result) {
    constexpr std::size_t panel = gemm_u8_weights::panel, tile = 4;
    for (std::size_t first = 0; first < weights.outputs; first += panel) {
        const std::int16_t* const values = weights.values.data() + first * weights.inputs;
        const std::int32_t* const bias = weights.bias.data() + first;
        const std::size_t count = (std::min)(panel, weights.outputs - first);
        std::size_t row = 0;
        for (; row + tile <= rows; row += tile)
            gemm_u8_tile<tile>(input + row * weights.inputs, weights.inputs, values, bias, count, weights.output,
                               result + row * weights.outputs + first, weights.outputs);
        for (; row < rows; ++row)
            gemm_u8_tile<1>(input + row * weights.inputs, weights.inputs, values, bias, count, weights.output,
                            result + row * weights.outputs + first, weights.outputs);
    }
}

}  // namespace scalar

/// input   rows x inputs, row-major
/// result  rows x outputs, row-major; must not overlap the input
inline void gemm_u8(const gemm_u8_weights& weights, const std::uint8_t* input, std::size_t rows, std::uint8_t* result) {
    scalar::gemm_u8(weights, input, rows, result);
}

}  // namespace ldi
