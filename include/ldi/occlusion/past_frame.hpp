// Surfaces past the photo's frame. A camera that moves sees past the photo's border. grow_past_frame() continues every surface
// that reaches the border as far as a camera within the motion budget sees it. Not in the paper, which hides the border behind a
// smaller frame.
//
// The frame is a window as large as the photo, in the middle of its disparities (window_disparity). A surface there does not move
// in the window; any other moves by the motion's share of its difference in disparity, to any side. So each surface goes on past
// the border by that distance, at the border pixel's disparity. Its colors are the photo's, mirrored at the border along the
// surface, and shifted so that lines which leave the photo go on straight (detail/border_lines.hpp): that costs next to nothing,
// and has the photo's texture without a seam.
//
// The lattice gets a margin of one width on all four sides. The middle of the photo stays the middle of the lattice, so that
// later stages see a photo of the same camera with a larger sensor (photo_facts::layers_camera()).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/occlusion/detail/frame_growth.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// The frame through which a 3D photo is seen.
enum class photo_frame : std::uint8_t {
    grow,  ///< as large as the photo: surfaces go on past its border
    crop,  ///< the paper's, smaller than the photo: surfaces end at its border
};

/// Distance past the photo's border, in pixels, at which a camera within the motion budget may see a surface.
///
/// camera  that took the photo
/// motion  photo_facts::motion
inline float reach_past_frame(float disparity, const pinhole_camera& camera, float motion) {
    // Errors of the mesh that its tolerances allow (mesh/simplify.hpp, mesh/studs.hpp): its outline is a pixel off, disparities a
    // few hundredths.
    constexpr float mesh_pixels = 2.0F, mesh_disparity = 0.02F;
    const float width = detail::nearest_float(camera.width);
    const float pixels_per_disparity = motion * (std::max)(width, detail::nearest_float(camera.height));
    // The window of a pair of pictures is at the nearest surface. Each eye moves by a sixtieth of the width at most
    // (render/stereo.hpp).
    const float eye = (std::min)(0.5F * pixels_per_disparity, width / 60.0F);
    const float d = std::clamp(disparity, 0.0F, 1.0F);
    return (std::max)(std::abs(d - window_disparity) * pixels_per_disparity, (1.0F - d) * eye) + mesh_pixels +
           mesh_disparity * pixels_per_disparity;
}

/// Continues all surfaces past the photo's border.
///
/// layers  of a photo, in canonical order, with a color everywhere; their lattice is the photo's
/// facts   camera and motion are read
///
/// Returns the width of the lattice's new margin (photo_facts::margin). The new pixels are unknown, and every column but
/// disparity has the value of the pixel that they show, or that of the column's new_pixel rule. A rim of one color along a side,
/// such as the edge of a scanned slide, is painted over with what is inwards of it, and becomes unknown: else it would be a line
/// across the picture. The result is in canonical order.
/// Raises too_large if there would be 2^31 pixels or positions. Linear time.
template <payload_column... Columns>
std::int32_t grow_past_frame(layered_image<Columns...>& layers, const photo_facts& facts) {
    static_assert(has_columns<layered_image<Columns...>, color_column, disparity_column, known_column>);
    if (layers.size() == 0) return 0;
    std::optional<detail::frame_growth> growth;
    std::int32_t margin = 0;
    const buffer<grown_piece> pieces = layers.grow([&](graph_builder base) {
        const graph old = std::move(base).build();
        const array_view<const float> disparity = layers.template column<disparity_column>();
        const auto reach = [&](std::int32_t pixel) {
            return static_cast<std::int32_t>(std::ceil(reach_past_frame(disparity[pixel], facts.camera, facts.motion)));
        };
        growth.emplace(old, layers.template column<color_column>(), layers.template column<known_column>(), disparity, reach);
        margin = growth->margin();
        constexpr std::int64_t limit = (std::numeric_limits<std::int32_t>::max)();
        const std::int64_t width = std::int64_t{old.width()} + 2 * margin, height = std::int64_t{old.height()} + 2 * margin;
        if (growth->count() > limit || width * height > limit)
            raise(error_code::too_large, "grow_past_frame", "fewer than 2^31 pixels",
                  std::to_string(width) + " x " + std::to_string(height));
        return growth->run();
    });
    const auto copy_color = [&](std::int32_t from, std::int32_t to) {
        const auto shown = layers.template at<color_column>(from);
        std::copy(shown.begin(), shown.end(), layers.template at<color_column>(to).begin());
    };
    const buffer<std::int32_t>& new_index = growth->new_index();
    for (const auto& [pixel, source] : growth->repainted()) {
        copy_color(new_index[source], new_index[pixel]);
        layers.template column<known_column>()[new_index[pixel]] = 0;
    }
    const auto disparity = layers.template column<disparity_column>();
    std::int32_t to = 0;
    for (const grown_piece& p : pieces) {
        for (std::int32_t i = p.first; p.is_new && i < p.first + p.count; ++i) {
            // Colors of new pixels are black until now (color_column), and disparities those of the pixels that they show.
            const std::int32_t at = to + i - p.first;
            copy_color(new_index[growth->origins()[i]], at);
            disparity[at] = disparity[new_index[growth->borders()[i]]];
        }
        to += p.count;
    }
    return margin;
}

}}  // namespace ldi
