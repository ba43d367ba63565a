// Full-size textures. Depth has less detail than the photo, so layered images are smaller than the photo: at the photo's size,
// they would take more time and memory without looking better. Only textures benefit from the full size. draw_sheet() redraws
// the charts with visible pixels on separate sheets, with one texel per pixel of the photo. The atlas remains the texture of
// completely hidden charts and of soft edges. Callers draw one sheet at a time, so that only one must be in memory.
//
//     made = make_photo3d(photo, estimator, inpainter, for_sheets(options, photo.height(), photo.width()));   // photo3d.hpp
//     const sheet_layout layout = lay_out_sheets(made.layers, made.charts, made.atlas, photo.height(), photo.width(),
//                                                {.margin = made.facts.margin});
//     const textured_mesh mesh = move_to_sheets(made.mesh, made.charts, made.atlas, layout);   // mesh/move_to_sheets.hpp
//     // textures of the mesh: made.atlas.color, then for each s from 1 to layout.sizes.size() - 1
//     draw_sheet(layout, s, made.charts, made.atlas, made.photo, photo);
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/texture/atlas.hpp>
#include <ldi/texture/detail/sheet_painter.hpp>
#include <ldi/texture/packing.hpp>
#include <ldi/texture/sheet_layout.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Raises mismatch unless the atlas has a color and a kind for every texel.
inline void check_texels(const texture_atlas& atlas) {
    if (atlas.color.channels() != 3 || atlas.kind.channels() != 1 || atlas.color.height() != atlas.kind.height() ||
        atlas.color.width() != atlas.kind.width())
        raise(error_code::mismatch, "sheets", "an atlas of H x W x 3 colors and H x W x 1 kinds",
              shape_text(atlas.color) + " and " + shape_text(atlas.kind));
}

/// Raises mismatch unless the atlas has this padding around the chart.
inline void check_padding(const chart& shape, chart_placement in_atlas, const texture_atlas& atlas, std::int32_t padding) {
    const std::int64_t right = std::int64_t{in_atlas.x} + shape.width + padding,
                       bottom = std::int64_t{in_atlas.y} + shape.height + padding;
    if (in_atlas.x < padding || in_atlas.y < padding || right > static_cast<std::int64_t>(atlas.kind.width()) ||
        bottom > static_cast<std::int64_t>(atlas.kind.height()))
        raise(error_code::mismatch, "sheets", "an atlas of these charts with a padding of " + std::to_string(padding),
              "a chart of " + std::to_string(shape.width) + " x " + std::to_string(shape.height) + " at (" +
                  std::to_string(in_atlas.x) + ", " + std::to_string(in_atlas.y) + ") in an atlas of " +
                  std::to_string(atlas.kind.width()) + " x " + std::to_string(atlas.kind.height()));
}

/// Raises mismatch unless the rectangle lies on a sheet of this size.
inline void check_room(const atlas_rectangle& room, rectangle_size sheet) {
    if (room.x < 0 || room.y < 0 || room.width < 0 || room.height < 0 || std::int64_t{room.x} + room.width > sheet.width ||
        std::int64_t{room.y} + room.height > sheet.height)
        raise(error_code::mismatch, "sheets",
              "a rectangle on a sheet of " + std::to_string(sheet.width) + " x " + std::to_string(sheet.height),
              std::to_string(room.width) + " x " + std::to_string(room.height) + " at (" + std::to_string(room.x) + ", " +
                  std::to_string(room.y) + ")");
}

inline void check_place(const sheet_layout& layout, std::size_t c, const chart& shape) {
    const sheet_placement& place = layout.placements[c];
    if (place.photo_x != layout.across.first_at(std::int64_t{shape.x} - layout.padding) ||
        place.photo_y != layout.down.first_at(std::int64_t{shape.y} - layout.padding))
        raise(error_code::mismatch, "draw_sheet", "the charts passed to lay_out_sheets()",
              "chart " + std::to_string(c) + " at another position");
}

}  // namespace detail

/// Returns the largest chart_options::max_side with which every chart fits on a sheet. Raises too_large if this size would be
/// below 16, and invalid_option unless the scale is above 0.
///
/// scale  pixels of the photo per pixel of the layered image, on the axis where this ratio is larger
inline std::int32_t max_chart_side(double scale, const sheet_options& options = {}) {
    if (!(scale > 0)) raise(error_code::invalid_option, "max_chart_side", "a scale above 0", detail::to_text(scale));
    // Chart edges that lie inside a texel are rounded outward, which may add a texel on each side.
    const double side = std::floor(detail::nearest_double(options.max_side - 2) / scale) - 2.0 * options.padding;
    if (!(side >= 16))
        raise(error_code::too_large, "max_chart_side",
              "a scale at which charts of 16 pixels fit on sheets of " + std::to_string(options.max_side),
              detail::to_text(scale));
    return static_cast<std::int32_t>((std::min)(side, 1e6));
}

/// Allocates a rectangle on a sheet, at the photo's resolution, for every chart with a pixel that the photo shows.
///
/// layers                     known_column marks the pixels that the photo shows
/// charts, atlas              made from these layers
/// photo_height, photo_width  size of the photo for draw_sheet()
///
/// Raises invalid_option for invalid sheet_options, mismatch if inputs don't fit together, and too_large for a chart that fits
/// on no sheet, or for a side of the photo above 2^30.
template <has_columns<known_column> Layers>
sheet_layout lay_out_sheets(const Layers& layers, const chart_set& charts, const texture_atlas& atlas, std::size_t photo_height,
                            std::size_t photo_width, const sheet_options& options = {}) {
    if (options.max_side < macroblock_side || options.max_side % macroblock_side != 0 || options.padding < 1)
        raise(error_code::invalid_option, "sheet_options", "a side that is a multiple of 16, a padding of at least 1",
              std::to_string(options.max_side) + " and " + std::to_string(options.padding));
    const auto& g = layers.topology();
    check_charts(charts, g, "lay_out_sheets");
    if (options.margin < 0 || 2 * std::int64_t{options.margin} >= (std::min)(g.width(), g.height()))
        raise(error_code::mismatch, "lay_out_sheets", "a lattice larger than twice the margin, which is at least 0",
              std::to_string(g.width()) + " x " + std::to_string(g.height()) + " with a margin of " +
                  std::to_string(options.margin));
    if (atlas.placements.size() != charts.charts.size())
        raise(error_code::mismatch, "lay_out_sheets", "an atlas of " + std::to_string(charts.charts.size()) + " charts",
              std::to_string(atlas.placements.size()) + " charts");
    detail::check_texels(atlas);
    if (photo_height == 0 || photo_width == 0 || layers.size() == 0)
        raise(error_code::mismatch, "lay_out_sheets", "a photo and layers with at least one pixel",
              std::to_string(photo_height) + " x " + std::to_string(photo_width) + " and " + std::to_string(layers.size()));
    if ((std::max)(photo_height, photo_width) > std::size_t{1} << 30)
        raise(error_code::too_large, "lay_out_sheets", "a photo with sides of at most 2^30",
              std::to_string(photo_height) + " x " + std::to_string(photo_width));
    sheet_layout layout;
    layout.padding = options.padding;
    layout.across = {static_cast<std::int64_t>(photo_width), g.width() - 2 * options.margin, options.margin};
    layout.down = {static_cast<std::int64_t>(photo_height), g.height() - 2 * options.margin, options.margin};
    layout.sizes.push_back({static_cast<std::int32_t>(atlas.color.width()), static_cast<std::int32_t>(atlas.color.height())});
    layout.placements.resize(charts.charts.size());

    const auto known = layers.template column<known_column>();
    buffer<rectangle_size> blocks;
    buffer<std::int32_t> enlarged;
    for (std::int32_t c = 0; c < charts.charts.count(); ++c) {
        const chart& shape = charts.charts[c];
        detail::check_padding(shape, atlas.placements[c], atlas, options.padding);
        if (std::none_of(shape.pixels.begin(), shape.pixels.end(), [&](std::int32_t pixel) { return known[pixel] != 0; }))
            continue;
        sheet_placement& place = layout.placements[c];
        const auto reach = [&](const sheet_scale& scale, std::int64_t at, std::int64_t length, std::int32_t& photo_at) {
            const std::int64_t first = scale.first_at(at - options.padding), last = scale.last_at(at + length + options.padding);
            constexpr std::int64_t limit = (std::numeric_limits<std::int32_t>::max)();
            if (first < -limit || last > limit || last - first > options.max_side)
                raise(error_code::too_large, "lay_out_sheets",
                      "charts of at most " + std::to_string(options.max_side) + " photo pixels per side",
                      std::to_string(last - first));
            photo_at = static_cast<std::int32_t>(first);
            return static_cast<std::int32_t>((last - first + macroblock_side - 1) / macroblock_side);
        };
        const std::int32_t across = reach(layout.across, shape.x, shape.width, place.photo_x);
        blocks.push_back({across, reach(layout.down, shape.y, shape.height, place.photo_y)});
        enlarged.push_back(c);
    }
    const sheet_packing packed = pack_on_sheets(blocks, options.max_side / macroblock_side);
    for (const rectangle_size& used : packed.sheets)
        layout.sizes.push_back({used.width * macroblock_side, used.height * macroblock_side});
    for (std::int32_t i = 0; i < enlarged.count(); ++i) {
        sheet_placement& place = layout.placements[enlarged[i]];
        place.sheet = packed.sheet_of[i] + 1;
        place.room = {packed.corners[i].x * macroblock_side, packed.corners[i].y * macroblock_side,
                      blocks[i].width * macroblock_side, blocks[i].height * macroblock_side};
    }
    return layout;
}

/// Draws a sheet, H x W x 3, gray outside charts. Where the layered image has the photo's color, copies texels from the photo.
/// Beside silhouettes, and where the layered image's color differs from the photo's, removes the neighboring surface's
/// contribution from the photo's color. Where the photo shows another surface, interpolates the colors of the atlas.
///
/// sheet          1 to layout.sizes.size() - 1
/// charts, atlas  those passed to lay_out_sheets()
/// worked_on      the photo from which the layered image was made, at the layered image's size without its margin
/// photo          the same photo, at the size passed to lay_out_sheets()
///
/// Raises mismatch if inputs don't fit together.
template <executor Executor = const serial_executor>
image<std::uint8_t> draw_sheet(const sheet_layout& layout, std::size_t sheet, const chart_set& charts, const texture_atlas& atlas,
                               image_view<const std::uint8_t> worked_on, image_view<const std::uint8_t> photo,
                               Executor&& threads = {}) {
    const auto is_of = [](image_view<const std::uint8_t> picture, std::int64_t height, std::int64_t width) {
        return picture.channels() == 3 && static_cast<std::int64_t>(picture.height()) == height &&
               static_cast<std::int64_t>(picture.width()) == width;
    };
    if (sheet < 1 || sheet >= layout.sizes.size() || layout.placements.size() != charts.charts.size() ||
        atlas.placements.size() != charts.charts.size() || !is_of(photo, layout.down.photo, layout.across.photo) ||
        !is_of(worked_on, layout.down.layers, layout.across.layers))
        raise(error_code::mismatch, "draw_sheet",
              "a sheet above 0 and below " + std::to_string(layout.sizes.size()) + ", " +
                  std::to_string(layout.placements.size()) + " charts and placements, a photo of " +
                  std::to_string(layout.down.photo) + " x " + std::to_string(layout.across.photo) + " x 3 and one of " +
                  std::to_string(layout.down.layers) + " x " + std::to_string(layout.across.layers) + " x 3",
              "sheet " + std::to_string(sheet) + ", " + std::to_string(charts.charts.size()) + " charts, " +
                  std::to_string(atlas.placements.size()) + " placements, " + detail::shape_text(photo) + " and " +
                  detail::shape_text(worked_on));
    detail::check_texels(atlas);
    const rectangle_size size = layout.sizes[sheet];
    image<std::uint8_t> drawn(static_cast<std::size_t>(size.height), static_cast<std::size_t>(size.width), 3, std::uint8_t{128});
    for (std::size_t c = 0; c < charts.charts.size(); ++c) {
        if (static_cast<std::size_t>(layout.placements[c].sheet) != sheet) continue;
        detail::check_padding(charts.charts[c], atlas.placements[c], atlas, layout.padding);
        detail::check_room(layout.placements[c].room, size);
        detail::check_place(layout, c, charts.charts[c]);
        const detail::sheet_painter painter(layout, charts.charts[c], layout.placements[c], atlas, atlas.placements[c], worked_on,
                                            photo);
        parallel_for(threads, painter.rows(), 32, [&](std::size_t first, std::size_t last) {
            for (std::size_t y = first; y < last; ++y) painter.draw(static_cast<std::int32_t>(y), drawn);
        });
    }
    return drawn;
}

}}  // namespace ldi
