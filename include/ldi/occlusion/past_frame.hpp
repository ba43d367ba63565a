// Continues surfaces past the photo's border. A moving camera sees past the border. grow_past_frame() continues every surface
// that reaches the border, as far as a camera within the motion budget sees it. The paper hides the border behind a smaller frame
// instead.
//
// The frame is a window as large as the photo, at a disparity in the middle of the range (window_disparity). Surfaces at this
// disparity do not move relative to the frame. Other surfaces move in any direction. Their maximum movement is the maximum
// parallax times the difference between their disparity and the window's. Each surface continues past the border by at least
// this distance, at the disparity of its border pixel. The colors of the continuation are those of the photo, mirrored at the
// border along the surface, slightly softened, and sheared so that lines continue straight (detail/border_lines.hpp). This
// costs little, keeps the photo's texture, and leaves no seam.
//
// The lattice gets a margin of the same width on all four sides. The photo's center stays the lattice's center. To later stages,
// the result looks like a photo from the same camera with a larger sensor (photo_facts::layers_camera()).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/grown_pixels.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/core/validate.hpp>
#include <ldi/occlusion/detail/frame_growth.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Frame in which viewers show a 3D photo.
enum class photo_frame : std::uint8_t {
    grow,  ///< the photo's size: surfaces continue past its border
    crop,  ///< the paper's frame, smaller than the photo: surfaces end at its border
};

/// Returns how far past the photo's border a camera within the motion budget sees a surface, in pixels.
///
/// disparity  of the surface, in [0, 1]
/// camera     camera that took the photo
/// motion     photo_facts::motion
inline float reach_past_frame(float disparity, const pinhole_camera& camera, float motion) {
    const float parallax = max_parallax(camera.width, camera.height, motion);
    // In a stereo pair, the window is at the nearest surface, and each eye's view shifts by at most a sixtieth of the width
    // (render/stereo.hpp).
    const float eye = (std::min)(0.5F * parallax, detail::nearest_float(camera.width) / 60.0F);
    const float d = std::clamp(disparity, 0.0F, 1.0F);
    return (std::max)(std::abs(d - window_disparity) * parallax, (1.0F - d) * eye) + mesh_pixels + mesh_disparity * parallax;
}

namespace detail {

/// Returns the color of a pixel of the photo, softened with its neighbors' colors. Full detail past the border would only repeat
/// the photo and increase the size of the compressed texture.
///
/// margin  photo_facts::margin of the layers
template <has_column<color_column> Layers>
std::array<std::uint8_t, 3> softened_color(const Layers& layers, std::int32_t margin, std::int32_t pixel) {
    const graph& g = layers.topology();
    const auto color = layers.template column<color_column>();
    std::array<int, 3> sum{};
    int count = 0;
    const auto add = [&](std::int32_t i, int weight) {
        for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * color.data()[3 * std::ptrdiff_t{i} + std::ptrdiff_t(c)];
        count += weight;
    };
    add(pixel, 2);
    const std::int32_t x = g.x()[pixel], y = g.y()[pixel];
    for (const side s : all_sides) {
        const std::int32_t u = x + step_x(s), v = y + step_y(s);
        if ((std::min)(u, v) < margin || u >= g.width() - margin || v >= g.height() - margin) continue;
        if (const std::int32_t i = g.neighbor(pixel, s); i != no_pixel) add(i, 1);
    }
    // Multiplication by a reciprocal returns exactly (sum + count / 2) / count for sums of up to six bytes.
    static constexpr std::array<int, 7> reciprocals{0, 0, 32768, 21846, 16384, 13108, 10923};
    std::array<std::uint8_t, 3> result{};
    for (std::size_t c = 0; c < 3; ++c)
        result[c] = static_cast<std::uint8_t>((sum[c] + count / 2) * reciprocals[static_cast<std::size_t>(count)] >> 16);
    return result;
}

}  // namespace detail

/// Continues all surfaces past the photo's border and returns the width of the lattice's new margin (photo_facts::margin).
///
/// layers  layers on the photo's lattice, in canonical order; every pixel has a color
/// facts   properties of the photo; only camera and motion are read, and the margin must be 0
///
/// A new pixel shows a pixel of the photo: it gets that pixel's softened color and the disparity of the border pixel, and its
/// known_column is 0. The new_pixel rules of all other columns compute its values from the pixel that it shows. A rim of one
/// color along a side, such as the edge of a scanned slide, would become a line across the picture. Therefore, colors from
/// the photo's interior replace those of the rim, and the rim's pixels become unknown. The result is in canonical order. Runs
/// in linear time. Raises invalid_option for a motion that is negative, infinite or NaN. Raises mismatch if `facts` has a
/// margin, if the camera and the lattice differ in size, or if the layers are not in canonical order. Raises invalid_data for
/// disparities that are not finite. Raises too_large for 2^31 or more pixels or positions, and for a side above
/// max_lattice_side; the layers are then empty.
template <payload_column... Columns, executor Executor = const serial_executor>
std::int32_t grow_past_frame(layered_image<Columns...>& layers, const photo_facts& facts, Executor&& threads = {}) {
    static_assert(has_columns<layered_image<Columns...>, color_column, disparity_column, known_column>);
    if (!(facts.motion >= 0) || std::isinf(facts.motion))
        raise(error_code::invalid_option, "photo_facts::motion", "0 or more, finite", detail::to_text(facts.motion));
    if (layers.size() == 0) return 0;
    const std::int32_t columns = layers.topology().width(), rows = layers.topology().height();
    if (facts.margin != 0 || facts.camera.width != columns || facts.camera.height != rows)
        raise(error_code::mismatch, "grow_past_frame", "a lattice of the photo's size, and a margin of 0",
              std::to_string(columns) + " x " + std::to_string(rows) + " pixels for a photo of " +
                  std::to_string(facts.camera.width) + " x " + std::to_string(facts.camera.height) + " with a margin of " +
                  std::to_string(facts.margin));
    check_disparities(layers.template column<disparity_column>(), "grow_past_frame");
    const graph& in = layers.topology();
    const auto is_ordered = [&](std::int32_t first, std::int32_t last) {
        const lattice_coordinate* const y = in.y().data();
        const std::int32_t* const right = in.right().data();
        bool is_in_order = true;  // vectorized, because this runs over all pixels
        for (std::int32_t i = (std::max)(first, 1); i < last; ++i) is_in_order &= y[i - 1] <= y[i];
        for (std::int32_t i = first; i < last; ++i) is_in_order &= (right[i] == no_pixel) | (right[i] == i + 1);
        return is_in_order;
    };
    if (!is_ordered(0, in.count())) {
        std::int32_t pixel = 0;
        while (is_ordered(pixel, pixel + 1)) ++pixel;
        raise(error_code::mismatch, "grow_past_frame", "layers in canonical order",
              "pixel " + std::to_string(pixel) + " out of order");
    }
    std::optional<detail::frame_growth> growth;
    std::int32_t margin = 0;
    // Inside grow() the layers are empty, but these views are valid.
    const array_view<const std::uint8_t> old_color = layers.template column<color_column>(),
                                         old_known = layers.template column<known_column>();
    const array_view<const float> old_disparity = layers.template column<disparity_column>();
    constexpr float too_far = 32768.0F;  // with a margin of this width, a side exceeds max_lattice_side
    const auto continue_surfaces = [&](graph_builder base) {
        graph old = std::move(base).build(detail::unchecked);
        const auto reach = [&](std::int32_t pixel) {
            const float pixels = std::ceil(reach_past_frame(old_disparity[pixel], facts.camera, facts.motion));
            return static_cast<std::int32_t>((std::min)(pixels, too_far));
        };
        growth.emplace(old, old_color, old_known, old_disparity, reach);
        margin = growth->margin();
        constexpr std::int64_t limit = (std::numeric_limits<std::int32_t>::max)();
        const std::int64_t width = std::int64_t{old.width()} + 2 * margin, height = std::int64_t{old.height()} + 2 * margin;
        if (growth->count() > limit || width * height > limit || (std::max)(width, height) > max_lattice_side)
            raise(error_code::too_large, "grow_past_frame",
                  "fewer than 2^31 pixels, at most " + std::to_string(max_lattice_side) + " per side",
                  std::to_string(width) + " x " + std::to_string(height));
        return growth->run(graph_builder(std::move(old)), threads);
    };
    const buffer<grown_piece> pieces = layers.grow(continue_surfaces, threads);
    const auto copy_color = [&](std::int32_t from, std::int32_t to) {
        const auto shown = layers.template at<color_column>(from);
        std::copy(shown.begin(), shown.end(), layers.template at<color_column>(to).begin());
    };
    const buffer<std::int32_t>& new_index = growth->pixels().new_index();
    for (const auto& [pixel, source] : growth->repainted()) {
        copy_color(new_index[source], new_index[pixel]);
        layers.template column<known_column>()[new_index[pixel]] = 0;
    }
    const auto disparity = layers.template column<disparity_column>();
    for_each_piece(threads, pieces, [&](const grown_piece& p, std::int32_t to) {
        for (std::int32_t i = p.first; p.is_new && i < p.first + p.count; ++i, ++to) {
            // Replaces the values that the new_pixel rules set: black, and the disparity of the pixel that the new pixel shows.
            const auto color = detail::softened_color(layers, margin, new_index[growth->pixels().origins()[i]]);
            std::copy(color.begin(), color.end(), layers.template at<color_column>(to).begin());
            disparity[to] = disparity[new_index[growth->pixels().borders()[i]]];
        }
    });
    return margin;
}

}}  // namespace ldi
