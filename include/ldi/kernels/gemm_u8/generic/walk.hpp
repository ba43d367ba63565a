// Loop of gemm_u8 over the pixels of one panel of outputs. Each x86 instruction set includes this file inside its namespace and
// target region. Kernel::tile(pixels, vectors, panel, requantize, first) computes one tile.

/// Computes all pixels of a panel in tiles of `pixels` pixels.
template <class Kernel, std::size_t pixels, std::size_t vectors, class Requantizer, class Panel>
inline void gemm_u8_tiles(const Panel& given, const float_requantization& output) {
    const Panel panel = given;  // a local copy, which results cannot alias
    const Requantizer requantize(output);
    constexpr std::make_index_sequence<vectors> wide{};
    if (panel.pixels < pixels) {
        for (std::size_t p = 0; p < panel.pixels; ++p) Kernel::tile(std::index_sequence<0>{}, wide, panel, requantize, p);
        return;
    }
    for (std::size_t p = 0; p < panel.pixels; p += pixels) {  // the last tile may overlap the one before it
        const std::size_t first = p + pixels <= panel.pixels ? p : panel.pixels - pixels;
        Kernel::tile(std::make_index_sequence<pixels>{}, wide, panel, requantize, first);
    }
}
