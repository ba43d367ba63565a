// Arguments of kernels/conv_f32.hpp and kernels/conv_u8.hpp for one panel of outputs, on all instruction sets.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/kernels/detail/panel_cut.hpp>

#include <cstddef>
#include <limits>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// The input pixels, and the weights of one panel.
template <class Value, class Weight>
struct conv_panel_input {
    const Value* const* rows;  ///< addresses of the first pixel's pieces
    /// Pieces per pixel, inputs per piece, and the distance between the pieces of adjacent pixels, in values.
    std::size_t row_count, inputs, pixel_stride;
    const Weight* weights;  ///< weights of the panel

    template <class Weights>
    conv_panel_input(const Weights& layer, const Value* const* of_first_pixel, std::size_t stride)
        : rows(of_first_pixel), row_count(layer.rows), inputs(layer.inputs), pixel_stride(stride), weights(layer.values.data()) {}

    /// Number of values by which a kernel advances its prefetch address per group of inputs. Kernels prefetch the next tile's
    /// inputs at an even pace, because the hardware prefetcher loads these inputs too late.
    std::size_t fetch_step(std::size_t tile_pixels, std::size_t group) const {
        return tile_pixels * pixel_stride / groups_of(inputs, group);
    }
};
template <class Weights, class Value>
conv_panel_input(const Weights&, const Value* const*, std::size_t)
    -> conv_panel_input<Value, typename decltype(Weights::values)::value_type>;

/// Lower limit of values before an activation. It is finite for relu, because 0 * -infinity is NaN.
constexpr float lowest_before(float negative_slope) {
    using limits = std::numeric_limits<float>;
    return negative_slope > 0.0F ? -limits::infinity() : limits::lowest();
}

/// Destination of one panel's results, and the constants that turn sums into results.
template <class Result>
struct conv_panel_output {
    const float *bias, *ratios;  ///< bias: one per output of the panel; ratios: one per pixel, or nullptr
    float negative_slope, lowest;
    std::size_t stride;  ///< distance between adjacent pixels, in values
    std::size_t count;   ///< remaining outputs of the layer
    Result* values;

    template <class Weights>
    conv_panel_output(const Weights& weights, const float* of_pixels, Result* result)
        : bias(weights.bias.data()),
          ratios(of_pixels),
          negative_slope(weights.negative_slope),
          lowest(lowest_before(negative_slope)),
          stride(weights.outputs),
          count(weights.outputs),
          values(result) {}

    /// Advances to the next panel.
    void skip(std::size_t lanes) { bias += lanes, values += lanes, count -= lanes < count ? lanes : count; }
};

}}}  // namespace ldi::detail
