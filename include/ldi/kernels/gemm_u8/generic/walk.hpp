// Loops of gemm_u8 over panels of outputs and tiles of pixels. Each instruction set includes this file inside its namespace and
// target region, after these definitions:
//
//     gemm_lanes, gemm_max_vectors   outputs per vector; vectors per panel
//     gemm_tile_pixels[v]            pixels of a full tile with v + 1 vectors
//     gemm_vector, load_bias(from)   gemm_lanes sums; loads their start values
//     gemm_panel                     arguments of one panel, a detail::gemm_panel_of
//     gemm_kernel                    add_segment(pixels, vectors, sums, inputs, panel, weights) adds the products of one segment
//                                    and moves `weights` to the next; store(pixels, vectors, sums, panel, requantize, result)
//                                    stores the results
//     gemm_half_kernel               the same for tiles whose last vector is at most half full; may equal gemm_kernel
//
// Pixels and vectors are index sequences, so that loops over them are unrolled and the sums of a tile stay in registers.

template <std::size_t... v>
[[gnu::always_inline]] inline void copy_sums(std::index_sequence<v...>, gemm_vector* to, const gemm_vector* from) {
    ((to[v] = from[v]), ...);
}

/// Computes one tile: sizeof...(p) pixels from `first` on, with sizeof...(v) vectors of outputs.
template <class Kernel, class Requantizer, std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void gemm_u8_tile(std::index_sequence<p...> pixels, std::index_sequence<v...> vectors,
                                                const gemm_panel& panel, const Requantizer& requantize, std::size_t first) {
    gemm_vector sums[sizeof...(p) * sizeof...(v)];
    const gemm_vector start[] = {load_bias(panel.bias + v * gemm_lanes)...};
    (copy_sums(vectors, sums + p * sizeof...(v), start), ...);
    auto weights = panel.weights;
    for (std::size_t s = 0; s < panel.segment_count; ++s)
        Kernel::add_segment(pixels, vectors, sums, panel.segment(s, first), panel, weights);
    Kernel::store(pixels, vectors, sums, panel, requantize, panel.result + first * panel.outputs);
}

/// Computes all pixels of a panel.
template <class Kernel, std::size_t vectors, class Requantizer, class Output>
inline void gemm_u8_tiles(const gemm_panel& given, const Output& output) {
    const gemm_panel panel = given;  // a local copy, so that stored results cannot alias it
    const Requantizer requantize(output);
    constexpr std::size_t pixels = gemm_tile_pixels[vectors - 1];
    constexpr std::make_index_sequence<vectors> wide{};
    if (panel.pixels < pixels) {
        for (std::size_t p = 0; p < panel.pixels; ++p) gemm_u8_tile<Kernel>(std::index_sequence<0>{}, wide, panel, requantize, p);
        return;
    }
    for (std::size_t p = 0; p < panel.pixels; p += pixels) {  // the last tile may overlap the one before it
        const std::size_t first = p + pixels <= panel.pixels ? p : panel.pixels - pixels;
        gemm_u8_tile<Kernel>(std::make_index_sequence<pixels>{}, wide, panel, requantize, first);
    }
}

template <std::size_t vectors, class Requantizer, class Output>
inline void gemm_u8_panel(const gemm_panel& panel, const Output& output) {
    if constexpr (!std::is_same_v<gemm_kernel, gemm_half_kernel>)
        if (panel.held <= vectors * gemm_lanes - gemm_lanes / 2)
            return gemm_u8_tiles<gemm_half_kernel, vectors, Requantizer>(panel, output);
    gemm_u8_tiles<gemm_kernel, vectors, Requantizer>(panel, output);
}

/// Computes all panels. Calls go through a table, so that the compiler keeps the loops of each size in a separate function.
template <class Rectifier, class Requantizer, class Output, std::size_t... v>
inline void gemm_u8_panels(std::index_sequence<v...>, std::size_t outputs, const Output& output, gemm_panel panel) {
    static constexpr void (*panel_functions[2][sizeof...(v)])(const gemm_panel&, const Output&) = {
        {gemm_u8_panel<v + 1, Requantizer, Output>...}, {gemm_u8_panel<v + 1, Rectifier, Output>...}};
    const detail::panel_cut cut(outputs, gemm_lanes, gemm_max_vectors);
    std::size_t rest = outputs;
    for (std::size_t i = 0; i < cut.panels; ++i) {
        const std::size_t vectors = cut.vectors_in(i), lanes = vectors * gemm_lanes;
        panel.held = rest < lanes ? rest : lanes;
        panel_functions[output.zero_point == 0][vectors - 1](panel, output);
        rest -= panel.held;
        panel.skip(lanes);
    }
}

/// Computes all outputs of all pixels.
///
/// Rectifier    requantizer for a zero point of 0
/// Requantizer  requantizer for other zero points
template <class Rectifier, class Requantizer, class Output>
inline void gemm_u8_panels(std::size_t outputs, const Output& output, const gemm_panel& panel) {
    gemm_u8_panels<Rectifier, Requantizer>(std::make_index_sequence<gemm_max_vectors>{}, outputs, output, panel);
}
