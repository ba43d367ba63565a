// A translation unit that configurations.py compiles several times, with different flags, and links into one program.
#include <ldi/ldi.hpp>

#include <vector>

/// A user's own payload.
struct temperature {
    using scalar = float;
    static constexpr std::size_t channels = 1;
    static constexpr scalar new_pixel(scalar origin) { return ldi::zeroed(origin); }
};

/// Computes a number with many parts of the library. The number must be the same in every configuration.
double LDI_UNIT() {
    ldi::graph_builder builder(ldi::make_grid(9, 7));
    builder.unlink(10, ldi::side::right);
    const ldi::graph grid = std::move(builder).build();
    ldi::image<std::uint8_t> picture(20, 30, 3);
    for (std::size_t i = 0; i < picture.size(); ++i) picture.data()[i] = static_cast<std::uint8_t>(i * 7);
    ldi::serial_executor threads;
    const ldi::image<std::uint8_t> small = ldi::area_resize(picture, 7, 9, threads);
    const ldi::image<float> disparity(7, 9, 1, 0.5F);
    const auto layer = ldi::lift(small, disparity).with<temperature>(ldi::buffer<float>(63, 2.0F));
    ldi::textured_mesh mesh{{0, 0, -1, 0, -1, -1, 1, 0, -1.1F}, {0, 0, 0, 1, 1, 0}, {}, {0, 1, 2}};
    const ldi::buffer<std::byte> glb = ldi::encode_glb(mesh, small);
    double sum =
        static_cast<double>(glb.size() + layer.size() + ldi::coarsen(grid, ldi::orphan_rule::adopt_nearest).topology.size());
    for (const std::byte byte : glb) sum += std::to_integer<int>(byte);
#if LDI_HAS_EXCEPTIONS
    try {
        ldi::encode_glb({}, small);
        return 0;
    } catch (const ldi::error& e) {
        if (e.code() != ldi::error_code::invalid_data) return 0;
    }
#endif
    return ldi::validate(grid).has_value() ? 0 : sum;
}
