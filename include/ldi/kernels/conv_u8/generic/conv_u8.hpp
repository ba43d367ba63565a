// conv_u8() of one instruction set. The set includes this file inside its namespace and target region, after its conv_u8_tiles.

inline constexpr detail::panel_layout conv_u8_layout{conv_u8_tiles::group, conv_u8_tiles::width, conv_u8_tiles::max_vectors};

/// Same parameters as conv_u8() of kernels/conv_u8.hpp.
///
/// Result  float or std::uint8_t
template <class Result>
void conv_u8(const conv_u8_weights& weights, const std::uint8_t* const* rows, std::size_t pixel_stride, std::size_t pixels,
             const float* ratios, Result* result) {
    const auto* const values = reinterpret_cast<const std::uint8_t*>(weights.values.data());
    conv_panels<conv_u8_tiles>(weights,
                               detail::conv_panel_input<std::uint8_t>{rows, weights.rows, weights.inputs, pixel_stride, values},
                               pixels, detail::conv_u8_panel_output<Result>(weights, ratios, result));
}
