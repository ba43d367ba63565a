// Contract of the kernels of kernels/gemm_u8.hpp, and the packing code that all instruction sets share.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/kernels/detail/choose_target.hpp>
#include <ldi/kernels/detail/panel_cut.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/kernels/prepared.hpp>
#include <ldi/kernels/requantize_float.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The weights of one layer in the order in which gemm_u8() reads them.
struct gemm_u8_data {
    using value_type = std::uint8_t;
    static constexpr std::size_t max_segments = 7;

    isa target = isa::scalar;
    std::size_t segments = 1, inputs = 0, outputs = 0;
    /// Weights minus their zero point, for scalar, WebAssembly, and AVX2 with a single output.
    buffer<std::int16_t> wide;
    /// Weights minus their zero point, for AVX2, VNNI and NEON. If the layer's weights fit in signed bytes only when negated, all
    /// of them are stored negated (choose_target()).
    buffer<std::int8_t> narrow;
    /// For AVX2, which splits the weights of four inputs into terms (avx2_packing.hpp). For each segment of each panel: the
    /// number of pairs of terms, the number of single terms, and the first input of each term.
    buffer<std::uint32_t> order;
    buffer<std::int32_t> bias;  ///< zero points folded in; padded with zeros to whole vectors
    requantization output;      ///< on NEON, `bias` and the multiplier are negated if `narrow` is
    /// Float form of `output`. If `narrow` is negated, so are this form and `bias`. On WebAssembly, `fast` has the constants of
    /// an unfused_requantization. Scalar and NEON do not use `fast`.
    float_requantization fast;

    /// On WebAssembly, whether an unfused form is exact. If not, `fast` is empty, and the kernel requantizes in integers.
    bool has_float_form() const { return fast.scale != 0; }

    /// Whether the lanes of AVX2, AVX-512 and WebAssembly contain inputs instead of outputs: for a single output with enough
    /// inputs to fill a vector.
    bool is_single_output() const { return outputs == 1 && inputs >= 64; }
};

/// Made by pack_gemm_u8().
using gemm_u8_weights = prepared<gemm_u8_data>;

/// One instruction set's kernel: a row of `gemm_u8_kernels`.
struct gemm_u8_kernel {
    isa set;
    /// minimum number of outputs; with fewer, too many lanes stay empty, and the kernel of `otherwise` (kernels/isa.hpp) is
    /// faster
    std::size_t min_outputs;
    /// Appends to `wide`, `narrow` and `order` the data that run() reads. The caller has set all other members; the function
    /// for NEON changes `bias` and the multiplier in `output`. See pack_gemm_u8() of kernels/gemm_u8.hpp.
    void (*pack)(gemm_u8_data& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point);
    /// Same parameters as gemm_u8() of kernels/gemm_u8.hpp.
    void (*run)(const gemm_u8_data& weights, const std::uint8_t* const* segments, std::size_t pixel_stride, std::size_t pixels,
                std::uint8_t* result);
};

namespace detail {

/// Number of inputs that one VNNI or NEON instruction multiplies per output.
inline constexpr std::size_t gemm_group = 4;

/// Arguments of gemm_u8() for one panel of outputs.
///
/// Value        type of the inputs
/// Weights      position in the packed weights: a pointer, or a struct with a member skip(segment_count, lanes)
/// group_size   number of inputs per group of the weights
template <class Value, class Weights, std::size_t group_size>
struct gemm_panel_of {
    const Value* const* segments;
    std::size_t segment_count, groups, pixel_stride, pixels;
    Weights weights;
    const std::int32_t* bias;
    std::uint8_t* result;
    std::size_t outputs, held = 0;  ///< number of outputs of the layer, and of the panel

    gemm_panel_of(const gemm_u8_data& packed, Weights values, const Value* const* of_first_pixel, std::size_t stride,
                  std::size_t pixel_count, std::uint8_t* to)
        : segments(of_first_pixel),
          segment_count(packed.segments),
          groups(groups_of(packed.inputs, group_size)),
          pixel_stride(stride),
          pixels(pixel_count),
          weights(values),
          bias(packed.bias.data()),
          result(to),
          outputs(packed.outputs) {}

    const Value* segment(std::size_t s, std::size_t first) const { return segments[s] + first * pixel_stride; }

    /// Advances to the next panel.
    void skip(std::size_t lanes) {
        bias += lanes, result += lanes;
        if constexpr (std::is_pointer_v<Weights>)
            weights += segment_count * groups * lanes * group_size;
        else
            weights.skip(segment_count, lanes);
    }
};

/// Layout of the weights of a layer with a single output, in the order of the inputs; pads each segment to a multiple of `lanes`.
/// Panels of outputs would use only one lane of each vector.
constexpr panel_layout single_output_layout(std::size_t lanes) { return {lanes, 1, 1}; }

/// Appends weights minus their zero point.
///
/// sign  -1 to negate the weights, else 1
template <class Stored>
void append_weights(buffer<Stored>& to, const gemm_u8_data& packed, std::span<const std::uint8_t> weights, int weight_zero_point,
                    int sign, const panel_layout& layout) {
    append_panels(to, {packed.outputs, packed.segments, packed.inputs}, layout,
                  [&](std::size_t i) { return sign * (weights[i] - weight_zero_point); });
}

/// Whether the sums of one output stay within the limit of pack_gemm_u8().
inline bool sums_fit(std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point, std::int64_t bias) {
    std::int64_t sum = 0;
    for (const std::uint8_t w : weights) sum += std::abs(w - weight_zero_point);
    return 510 * sum + std::abs(bias) < std::int64_t{1} << 31;
}

/// Folds the zero points into `bias`, the start value of each sum of `input * (weight - zero point)`.
inline void fold_zero_points(gemm_u8_data& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point,
                             std::span<const std::int32_t> bias, std::uint8_t input_zero_point) {
    constexpr std::size_t largest_vector = 16;
    packed.bias.resize((packed.outputs + largest_vector - 1) / largest_vector * largest_vector);
    const std::size_t inputs = packed.segments * packed.inputs;
    for (std::size_t o = 0; o < packed.outputs; ++o) {
        const auto of_output = weights.subspan(o * inputs, inputs);
        LDI_ASSERT(sums_fit(of_output, weight_zero_point, bias[o]));
        std::int64_t sum = 0;
        for (const std::uint8_t w : of_output) sum += w - weight_zero_point;
        const std::int64_t folded = bias[o] - sum * input_zero_point;
        packed.bias[o] = static_cast<std::int32_t>(is_negated(packed.fast) ? -folded : folded);
    }
}

}  // namespace detail
}}  // namespace ldi
