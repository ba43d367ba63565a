// The packed weights of kernels/conv_f32.hpp and kernels/conv_bf16.hpp, and what packing has in common in all arithmetics and on
// all instruction sets.
#pragma once

#include <ldi/config.hpp>
#include <ldi/kernels/bfloat16.hpp>
#include <ldi/kernels/detail/aligned_vector.hpp>
#include <ldi/kernels/detail/panel_cut.hpp>
#include <ldi/kernels/isa.hpp>

#include <cstddef>
#include <span>

namespace ldi {

/// What happens to a value after the bias: x stays where it is positive, and becomes negative_slope * x elsewhere.
struct activation {
    float negative_slope;  ///< 0 to 1
};
inline constexpr activation no_activation{1.0F};
inline constexpr activation relu{0.0F};
constexpr activation leaky_relu(float negative_slope) { return {negative_slope}; }

/// The weights of one layer in the order that its kernel reads them. Only pack_conv_f32() and its like make sound ones.
template <class Value>
struct conv_weights {
    using value_type = Value;  ///< of the inputs too

    isa target = isa::scalar;
    std::size_t rows = 1, inputs = 0, outputs = 0;
    float negative_slope = 1.0F;
    detail::aligned_vector<Value> values;
    detail::aligned_vector<float> bias;  ///< padded with zeros to whole panels
};
using conv_f32_weights = conv_weights<float>;
using conv_bf16_weights = conv_weights<bfloat16>;

/// What a kernel reads for one panel of outputs.
template <class Value>
struct conv_panel_input {
    const Value* const* rows;
    std::size_t row_count, inputs, pixel_stride;
    const Value* weights;
};

/// What a kernel does with the sums of one panel.
template <class Result>
struct conv_panel_output {
    const float *bias, *ratios;
    float negative_slope;
    std::size_t stride;  ///< values from pixel to pixel
    std::size_t count;   ///< outputs from here on, to the last of the layer
    Result* values;

    /// Goes on to the next panel.
    void skip(std::size_t lanes) { bias += lanes, values += lanes, count -= lanes < count ? lanes : count; }
};

namespace detail {

/// How many groups of inputs that are multiplied together a stretch has, the last one perhaps in part.
constexpr std::size_t groups_of(std::size_t inputs, std::size_t group) { return (inputs + group - 1) / group; }

/// Panel by panel, row by row, group by group: the weights of a panel's outputs side by side, and of each output those of as many
/// inputs as a kernel multiplies together. Zeros behind the last input and the last output.
///
/// weights  outputs x rows x inputs, row-major
template <std::size_t group, class Value>
inline void append_conv_panels(conv_weights<Value>& packed, std::span<const Value> weights, std::span<const float> bias,
                               std::size_t lanes, std::size_t most_vectors) {
    const panel_cut cut(packed.outputs, lanes, most_vectors);
    const std::size_t inputs = packed.inputs;
    std::size_t first = 0;
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t last = first + cut.vectors_in(panel) * lanes;
        for (std::size_t r = 0; r < packed.rows; ++r)
            for (std::size_t i = 0; i < groups_of(inputs, group) * group; i += group)
                for (std::size_t o = first; o < last; ++o)
                    for (std::size_t g = i; g < i + group; ++g)
                        packed.values.push_back(o < packed.outputs && g < inputs ? weights[(o * packed.rows + r) * inputs + g]
                                                                                 : Value{});
        for (std::size_t o = first; o < last; ++o) packed.bias.push_back(o < packed.outputs ? bias[o] : 0.0F);
        first = last;
    }
}

}  // namespace detail
}  // namespace ldi
