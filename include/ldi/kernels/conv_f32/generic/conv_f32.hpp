// conv_f32() of one instruction set. The set includes this file inside its namespace and target region, after its
// conv_f32_tiles.

inline constexpr detail::panel_layout conv_f32_layout{conv_f32_tiles::group, conv_f32_tiles::width, conv_f32_tiles::max_vectors};

inline void conv_f32(const conv_f32_weights& weights, const float* const* rows, std::size_t pixel_stride, std::size_t pixels,
                     const float* ratios, float* result) {
    conv_panels<conv_f32_tiles>(
        weights, detail::conv_panel_input<float>{rows, weights.rows, weights.inputs, pixel_stride, weights.values.data()}, pixels,
        detail::conv_panel_output<float>(weights, ratios, result));
}
