// Packing of weights, which kernels/conv_f32.hpp and kernels/conv_u8.hpp share on all instruction sets.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/kernels/conv_f32/weights.hpp>
#include <ldi/kernels/detail/panel_cut.hpp>
#include <ldi/kernels/isa.hpp>

#include <cstddef>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Arguments of a convolution for one panel of outputs: pixels and weights.
template <class Value>
struct conv_panel_input {
    const Value* const* rows;
    std::size_t row_count, inputs, pixel_stride;
    const Value* weights;
};

/// Destination of one panel's results, and the constants that turn sums into results.
template <class Result>
struct conv_panel_output {
    const float *bias, *ratios;
    float negative_slope;
    std::size_t stride;  ///< distance between adjacent pixels, in values
    std::size_t count;   ///< remaining outputs of the layer
    Result* values;

    /// Advances to the next panel.
    void skip(std::size_t lanes) { bias += lanes, values += lanes, count -= lanes < count ? lanes : count; }
};

namespace detail {

/// Number of groups into which `count` inputs are divided, rounded up.
constexpr std::size_t groups_of(std::size_t count, std::size_t group) { return (count + group - 1) / group; }

/// Appends weights by panel, row and group. Within a panel, the outputs are adjacent, each with the weights of one group of
/// inputs. Pads the last group and the last panel with zeros.
///
/// layer    conv_f32_weights or conv_u8_weights, with `outputs`, `rows` and `inputs` set
/// weights  outputs x rows x inputs, row-major
template <std::size_t group, class Layer, class Value>
void append_panels(buffer<Value>& values, const Layer& layer, std::span<const Value> weights, std::size_t lanes,
                   std::size_t max_vectors) {
    const panel_cut cut(layer.outputs, lanes, max_vectors);
    const std::size_t inputs = layer.inputs;
    std::size_t first = 0;
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t last = first + cut.vectors_in(panel) * lanes;
        for (std::size_t r = 0; r < layer.rows; ++r)
            for (std::size_t i = 0; i < groups_of(inputs, group) * group; i += group)
                for (std::size_t o = first; o < last; ++o)
                    for (std::size_t g = i; g < i + group; ++g)
                        values.push_back(o < layer.outputs && g < inputs ? weights[(o * layer.rows + r) * inputs + g] : Value{});
        first = last;
    }
}

inline void append_conv_panels(conv_f32_weights& packed, std::span<const float> weights, std::span<const float> bias,
                               std::size_t lanes, std::size_t max_vectors) {
    append_panels<1>(packed.values, packed, weights, lanes, max_vectors);
    packed.bias.assign(bias.begin(), bias.end());
    packed.bias.resize(groups_of(packed.outputs, lanes) * lanes, 0.0F);
}

}  // namespace detail
}}  // namespace ldi
