// Grain for inpainted pixels. An inpainter returns the mean of all plausible colors, and a mean is smooth: beside sand, leaves
// or film grain it looks blurred. add_grain() adds noise as strong as the photo's fine detail nearby, and almost none in smooth
// areas such as a sky. Video codecs do the same ("film grain synthesis" of AV1). Not in the paper.
//
// Detail is the difference between a pixel's brightness and the mean of its neighbors. It is measured at known pixels near
// unknown ones, but a few pixels away from silhouettes, because lenses and JPEG blur colors there. The square root of the
// detail diffuses along the links of the layered image to the unknown pixels. The square root reduces the influence of a few
// edges among smooth pixels. The noise depends only on a pixel's position, so results are deterministic.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/other_bytes.hpp>
#include <ldi/inpaint/detail/diffuse_unknown.hpp>
#include <ldi/inpaint/detail/hash.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of add_grain().
struct grain_options {
    /// Standard deviation of the grain, relative to the high-frequency content of the surrounding photo, 0 to 100; 0 disables
    /// grain. Values below 1 look better, because part of that content is texture; 0.6 was chosen by eye.
    float strength = 0.6F;
    /// Maximum standard deviation that counts as noise, in gray levels, 0 to 255. Stronger detail is an edge, and is limited to
    /// this value.
    float limit = 20.0F;
    /// Gauss-Seidel rounds on each level of the diffusion, 1 to 64.
    int rounds = 2;
};

namespace detail {

/// Returns the noise at a position, the same on every layer: mean 0, variance 1, approximately normal, independent of other
/// positions.
inline float grain_at(std::int32_t x, std::int32_t y) {
    const std::uint32_t h = hash(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
    const float sum = nearest_float((h & 255) + (h >> 8 & 255) + (h >> 16 & 255) + (h >> 24));  // sum of four uniform bytes
    return (sum - 510.0F) / 147.8F;  // minus the mean, 4 * 127.5; divided by the standard deviation, sqrt(4 * (256^2 - 1) / 12)
}

/// Measures the photo's grain at known pixels.
class grain_meter {
public:
    /// color, known  the columns of a layered image with this graph
    grain_meter(const graph_view& g, array_view<const std::uint8_t> color, array_view<const std::uint8_t> known)
        : graph_(g), color_(color), known_(known) {}

    /// Walks `smeared` steps from `pixel` toward side `s`, away from an unknown pixel and only over known pixels, and returns
    /// the detail at the pixel that it reaches. Detail is the difference between the brightness of the pixel and the mean of
    /// its neighbors. A pair of opposite neighbors (left and right, or upper and lower) counts only if both are known, so that
    /// a linear gradient has no detail. Returns 0 if no pair is known.
    float detail_at(std::int32_t pixel, side s) const {
        for (int step = 0; step < smeared; ++step)
            if (const std::int32_t next = known_neighbor(pixel, s); next != no_pixel) pixel = next;
        float sum = 0.0F, count = 0.0F;
        for (const auto& [one, other] : {std::array{side::left, side::right}, std::array{side::up, side::down}}) {
            const std::int32_t a = known_neighbor(pixel, one), b = known_neighbor(pixel, other);
            if (a == no_pixel || b == no_pixel) continue;
            sum += brightness(a) + brightness(b);
            count += 2.0F;
        }
        return count > 0.0F ? std::abs(brightness(pixel) - sum / count) : 0.0F;
    }

    /// Squared mean of the square roots of detail, (E |d|^0.5)^2, for normal noise with standard deviation 1. d is the difference
    /// between a pixel and the mean of its four neighbors, with a standard deviation of sqrt(1 + 1/4). The value is 0.676 times
    /// this deviation.
    static constexpr float of_unit_noise = 0.756F;

private:
    // Steps from the known neighbor of an unknown pixel to the pixel where detail is measured. This distance exceeds the blur
    // that lens and JPEG cause at silhouettes, but is less than the width of small objects. Tuned by experiment.
    static constexpr int smeared = 3;

    std::int32_t known_neighbor(std::int32_t pixel, side s) const {
        const std::int32_t found = graph_.neighbor(pixel, s);
        return found != no_pixel && known_[found] != 0 ? found : no_pixel;
    }

    float brightness(std::int32_t pixel) const {
        const std::uint8_t* color = color_.data() + 3 * std::ptrdiff_t{pixel};
        return 0.299F * color[0] + 0.587F * color[1] + 0.114F * color[2];
    }

    graph_view graph_;
    array_view<const std::uint8_t> color_;
    array_view<const std::uint8_t> known_;
};

inline void check_option(const char* name, float value, float minimum, float maximum) {
    if (!(value >= minimum && value <= maximum))
        raise(error_code::invalid_option, name,
              std::to_string(static_cast<int>(minimum)) + " to " + std::to_string(static_cast<int>(maximum)),
              detail::to_text(value));
}

inline void check_options(const grain_options& options) {
    check_option("grain_options, strength", options.strength, 0.0F, 100.0F);
    check_option("grain_options, limit", options.limit, 0.0F, 255.0F);
    check_option("grain_options, rounds", nearest_float(options.rounds), 1.0F, 64.0F);
}

/// Estimates the photo's detail around each unknown pixel, as the standard deviation of equally strong noise in gray levels.
/// Returns one value per unknown pixel, in ascending order of the pixels.
///
/// limit   above 0; maximum of the standard deviation
/// rounds  Gauss-Seidel rounds on each level of the diffusion
template <has_columns<color_column, known_column> Layers>
buffer<float> detail_around_unknown(const Layers& layers, float limit, int rounds) {
    const grain_meter meter(layers.topology(), layers.template column<color_column>(), layers.template column<known_column>());
    buffer<float> result;
    std::uint8_t root = 0;  // sqrt(noise / limit), scaled to 0 to 255
    diffuse_unknown<1>(
        layers.topology(), layers.template column<known_column>(), rounds,
        [&](std::int32_t pixel, side s) {
            const float noise = meter.detail_at(pixel, s) / grain_meter::of_unit_noise;
            root = rounded_to_byte(255.0F * std::sqrt((std::min)(noise / limit, 1.0F)));
            return &root;
        },
        [] {},
        [&](std::int32_t, const diffusion<1>::value_type& diffused) {
            const float part = diffused[0] / 255.0F;
            result.push_back(limit * part * part);
        });
    return result;
}

}  // namespace detail

/// Adds grain to every pixel whose known_column is 0; other pixels do not change. Raises invalid_option unless the strength is in
/// [0, 100], the limit in [0, 255], and the number of rounds in [1, 64].
///
/// layers  in canonical order; every pixel has a color
template <has_columns<color_column, known_column> Layers>
void add_grain(Layers& layers, const grain_options& options = {}) {
    detail::check_options(options);
    if (options.strength == 0.0F || options.limit == 0.0F) return;
    const auto& g = layers.topology();
    const buffer<float> around = detail::detail_around_unknown(layers, options.limit, options.rounds);
    std::int32_t next = 0;
    for_each_unknown(layers.template column<known_column>(), [&](std::int32_t i) {
        const float grain = options.strength * around[next++] * detail::grain_at(g.x()[i], g.y()[i]);
        for (std::uint8_t& value : layers.template at<color_column>(i)) value = detail::rounded_to_byte(value + grain);
    });
}

}}  // namespace ldi
