// Loops of conv_f32 and conv_u8 over panels of outputs and tiles of pixels. Each instruction set includes this file inside its
// namespace and target region. The template parameter Kernel provides the primitives:
//
//     layout        order of the weights
//     pixels[v]     number of pixels in a full tile with v + 1 vectors
//     rest_pixels   maximum number of pixels in the tiles that follow the full tiles
//     tile(pixels, vectors, input, first_pixel, output)   computes one tile

/// Computes pixels first to last - 1 in the largest possible tiles.
template <class Kernel, std::size_t pixels, std::size_t vectors, class Input, class Output>
inline void conv_panel(const Input& input, std::size_t first, std::size_t last, const Output& out) {
    for (; first + pixels <= last; first += pixels)
        Kernel::tile(std::make_index_sequence<pixels>{}, std::make_index_sequence<vectors>{}, input, first, out);
    if constexpr (pixels > 1)
        if (first < last)
            conv_panel<Kernel, (pixels > Kernel::rest_pixels ? Kernel::rest_pixels : pixels / 2), vectors>(input, first, last,
                                                                                                           out);
}

/// Computes all outputs panel by panel. Calls go through a table, so that the compiler keeps the loops of each size in a
/// separate function.
template <class Kernel, class Input, class Output, std::size_t... v>
inline void conv_panels(std::index_sequence<v...>, Input input, std::size_t pixels, Output out) {
    static constexpr void (*panel_functions[])(const Input&, std::size_t, std::size_t,
                                               const Output&) = {conv_panel<Kernel, Kernel::pixels[v], v + 1, Input, Output>...};
    constexpr detail::panel_layout layout = Kernel::layout;
    const detail::panel_cut cut(out.count, layout.lanes, layout.max_vectors);
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t vectors = cut.vectors_in(panel), lanes = vectors * layout.lanes;
        panel_functions[vectors - 1](input, 0, pixels, out);
        input.weights += input.row_count * detail::groups_of(input.inputs, layout.group) * layout.group * lanes;
        out.skip(lanes);
    }
}

/// conv_f32() or conv_u8() with this kernel.
template <class Kernel, class Weights, class Value, class Result>
inline void conv(const Weights& weights, const Value* const* rows, std::size_t pixel_stride, std::size_t pixels,
                 const float* ratios, Result* result) {
    conv_panels<Kernel>(std::make_index_sequence<Kernel::layout.max_vectors>{},
                        detail::conv_panel_input(weights, rows, pixel_stride), pixels,
                        typename Weights::template panel_output<Result>(weights, ratios, result));
}
