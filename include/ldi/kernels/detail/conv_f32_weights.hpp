// The packed weights of kernels/conv_f32.hpp, and what packing has in common on all instruction sets.
#pragma once

#include <ldi/config.hpp>
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

/// The weights of one layer in the order that conv_f32() reads them. Only pack_conv_f32() makes sound ones.
struct conv_f32_weights {
    isa target = isa::scalar;
    std::size_t rows = 1, inputs = 0, outputs = 0;
    float negative_slope = 1.0F;
    detail::aligned_vector<float> values;
    detail::aligned_vector<float> bias;  ///< padded with zeros to whole panels
};

/// What a kernel reads for one panel of outputs.
struct conv_panel_input {
    const float* const* rows;
    std::size_t row_count, inputs, pixel_stride;
    const float* weights;
};

/// What a kernel does with the sums of one panel.
struct conv_panel_output {
    const float *bias, *ratios;
    float negative_slope;
    std::size_t stride;  ///< values from pixel to pixel
    std::size_t count;   ///< outputs from here on, to the last of the layer
    float* values;

    /// Goes on to the next panel.
    void skip(std::size_t lanes) { bias += lanes, values += lanes, count -= lanes < count ? lanes : count; }
};

namespace detail {

/// Panel by panel, row by row, input by input: the weights of a panel's outputs side by side, zeros behind the last one.
///
/// weights  outputs x rows x inputs, row-major
inline void append_conv_f32_panels(conv_f32_weights& packed, std::span<const float> weights, std::span<const float> bias,
                                   std::size_t lanes, std::size_t most_vectors) {
    const panel_cut cut(packed.outputs, lanes, most_vectors);
    const std::size_t inputs = packed.rows * packed.inputs;
    std::size_t first = 0;
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t last = first + cut.vectors_in(panel) * lanes;
        for (std::size_t i = 0; i < inputs; ++i)
            for (std::size_t o = first; o < last; ++o)
                packed.values.push_back(o < packed.outputs ? weights[o * inputs + i] : 0.0F);
        for (std::size_t o = first; o < last; ++o) packed.bias.push_back(o < packed.outputs ? bias[o] : 0.0F);
        first = last;
    }
}

}  // namespace detail
}  // namespace ldi
