// Contract of the kernels of kernels/gemm_u8.hpp, and the packing code that all instruction sets share.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/kernels/detail/choose_target.hpp>
#include <ldi/kernels/detail/panel_cut.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/kernels/requantize_float.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The weights of one layer in the order in which gemm_u8() reads them. Valid only if pack_gemm_u8() made them.
struct gemm_u8_weights {
    static constexpr std::size_t max_segments = 7;

    isa target = isa::scalar;
    std::size_t segments = 1, inputs = 0, outputs = 0;
    buffer<std::int16_t> wide;  ///< scalar, WebAssembly, and a single output with AVX2: weight minus its zero point
    /// AVX2, VNNI, NEON: weight minus its zero point. All of them are negated if only then they fit in signed bytes
    /// (choose_target())
    buffer<std::int8_t> narrow;
    /// AVX2, for each segment of each panel: the number of pairs of terms, the number of single terms, and the first input of
    /// each term
    buffer<std::uint32_t> order;
    buffer<std::int32_t> bias;  ///< zero points folded in; padded with zeros to whole vectors
    requantization output;      ///< NEON: if `narrow` is negated, so are `bias` and the multiplier
    /// Float form of `output`, negated if `narrow` is negated; `bias` then is, too. On WebAssembly, the constants of an
    /// unfused_requantization. Scalar and NEON do not use it.
    float_requantization fast;

    /// Whether lanes contain inputs instead of outputs: for a single output with enough inputs to fill a vector.
    bool is_single_output() const { return outputs == 1 && inputs >= 64; }
};

/// One instruction set's kernel: a row of `gemm_u8_kernels`.
struct gemm_u8_kernel {
    isa set;
    /// minimum number of outputs; with fewer, too many lanes stay empty, and the kernel of `otherwise` (kernels/isa.hpp) is
    /// faster
    std::size_t min_outputs;
    /// Appends to `wide`, `narrow` and `order` the data that run() reads; the caller has set all other members. See
    /// pack_gemm_u8() of kernels/gemm_u8.hpp.
    void (*pack)(gemm_u8_weights& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point);
    /// Same parameters as gemm_u8() of kernels/gemm_u8.hpp.
    void (*run)(const gemm_u8_weights& weights, const std::uint8_t* const* segments, std::size_t pixel_stride, std::size_t pixels,
                std::uint8_t* result);
};

namespace detail {

/// Number of inputs that one VNNI or NEON instruction multiplies per output.
inline constexpr std::size_t gemm_group = 4;

/// Number of groups of four inputs, rounded up.
constexpr std::size_t groups_of_four(std::size_t inputs) { return (inputs + gemm_group - 1) / gemm_group; }

/// Arguments of gemm_u8() for one panel of weights in groups of four inputs.
struct panel_of_groups {
    const std::uint8_t* const* segments;
    std::size_t segment_count, groups, pixel_stride, pixels;
    const std::int8_t* weights;
    const std::int32_t* bias;
    std::uint8_t* result;
    std::size_t outputs, held = 0;  ///< number of outputs of the layer, and of the panel

    void skip(std::size_t lanes) { weights += segment_count * groups * lanes * gemm_group; }
};

/// Appends the weights of a layer with a single output in the order of the inputs, and pads each segment with zeros to a multiple
/// of `multiple`. The panel layout would use only one lane of each vector.
///
/// sign  -1 for negated weights
template <class Stored>
void append_single_output(buffer<Stored>& to, const gemm_u8_weights& packed, std::span<const std::uint8_t> weights,
                          int weight_zero_point, int sign, std::size_t multiple) {
    const std::size_t padded = (packed.inputs + multiple - 1) / multiple * multiple;
    for (std::size_t s = 0; s < packed.segments; ++s)
        for (std::size_t i = 0; i < padded; ++i)
            to.push_back(
                static_cast<Stored>(i < packed.inputs ? sign * (weights[s * packed.inputs + i] - weight_zero_point) : 0));
}

/// Appends weights panel by panel, segment by segment, in groups of four inputs: vectors of `lanes` outputs x 4 inputs, padded
/// with zeros.
///
/// sign  -1 for negated weights
inline void append_groups_of_four(gemm_u8_weights& packed, std::span<const std::uint8_t> weights, int weight_zero_point, int sign,
                                  std::size_t lanes, std::size_t max_vectors) {
    const panel_cut cut(packed.outputs, lanes, max_vectors);
    std::size_t first = 0;
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t last = first + cut.vectors_in(panel) * lanes;
        for (std::size_t s = 0; s < packed.segments; ++s)
            for (std::size_t group = 0; group < packed.inputs; group += gemm_group)
                for (std::size_t o = first; o < last; ++o)
                    for (std::size_t i = group; i < group + gemm_group; ++i) {
                        const bool exists = o < packed.outputs && i < packed.inputs;
                        const int weight =
                            exists ? weights[(o * packed.segments + s) * packed.inputs + i] - weight_zero_point : 0;
                        packed.narrow.push_back(static_cast<std::int8_t>(sign * weight));
                    }
        first = last;
    }
}

/// Folds the zero points into `bias`, the start value of each sum of `input * (weight - zero point)`.
inline void fold_zero_points(gemm_u8_weights& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point,
                             std::span<const std::int32_t> bias, std::uint8_t input_zero_point) {
    constexpr std::size_t largest_vector = 16;
    packed.bias.resize((packed.outputs + largest_vector - 1) / largest_vector * largest_vector);
    const std::size_t inputs = packed.segments * packed.inputs;
    for (std::size_t o = 0; o < packed.outputs; ++o) {
        std::int32_t sum = 0;
        for (std::size_t i = 0; i < inputs; ++i) sum += weights[o * inputs + i] - weight_zero_point;
        packed.bias[o] = bias[o] - sum * input_zero_point;
        if (is_negated(packed.fast)) packed.bias[o] = -packed.bias[o];
    }
}

}  // namespace detail
}}  // namespace ldi
