// Texture atlas of a layered image: its charts, padded and packed in one picture (paper, section "Texture Atlas Generation").
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/other_bytes.hpp>
#include <ldi/core/validate.hpp>
#include <ldi/texture/packing.hpp>
#include <ldi/texture/padding.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of make_atlas().
struct atlas_options {
    padding_options padding;
    /// Maximum width and height of the atlas in texels, at least 16; rounded down to a multiple of 16. Every GPU of the last ten
    /// years supports the default.
    std::int32_t max_side = 8192;
};

/// The texture of a mesh, and the position of each chart in this texture; the result of make_atlas().
struct texture_atlas {
    image<std::uint8_t> color;           ///< H x W x 3, sides multiples of 16; gray outside charts
    image<texel_kind> kind;              ///< H x W x 1: the origin of each texel's color
    buffer<chart_placement> placements;  ///< one per chart
    float fill = 0;                      ///< fraction of texels that belong to a pixel of the layered image
    /// Thickness of the filter padding around charts, in texels. Hems and soft edges of the mesh have the colors of this
    /// padding.
    std::int32_t filter_padding = padding_options{}.filter_padding;
};

namespace detail {

/// Classifies each pixel as photo, refilled or occluded.
template <class Layers>
buffer<texel_kind> pixel_kinds(const Layers& layers) {
    const auto& g = layers.topology();
    const auto disparity = layers.template column<disparity_column>();
    const auto known = layers.template column<known_column>();
    buffer<float> front(g.position_count(), -std::numeric_limits<float>::infinity());
    for (std::int32_t i = 0; i < g.count(); ++i) {
        float& nearest = front[g.position_of(i)];
        nearest = (std::max)(nearest, disparity[i]);
    }
    buffer<texel_kind> kinds(g.size(), texel_kind::photo);
    for_each_unknown(known, [&](std::int32_t i) {
        kinds[i] = disparity[i] < front[g.position_of(i)] ? texel_kind::occluded : texel_kind::refilled;
    });
    return kinds;
}

}  // namespace detail

/// Packs, draws and pads all charts. Every pixel of `layers` must have a color. known_column marks the photo's own colors, and
/// affects only `kind`. Raises too_large if the charts do not fit in the atlas, or if a chart is larger than max_chart_box;
/// invalid_option for an option outside its range; and mismatch if `layers` is a view whose graph violates an invariant, if the
/// charts do not belong to `layers`, or if a chart has two pixels at one position. Time is linear in pixels and texels, except
/// for packing, whose time is proportional to the number of charts times the number of distinct chart sizes. Memory is up to 32
/// bytes per pixel and per texel, and 4 per position of the lattice.
template <has_columns<color_column, disparity_column, known_column> Layers, executor Executor = const serial_executor>
texture_atlas make_atlas(const Layers& layers, const chart_set& charts, const atlas_options& options = {},
                         Executor&& threads = {}) {
    const std::int32_t padding = options.padding.filter_padding;
    if (padding < 1 || padding > max_filter_padding)
        raise(error_code::invalid_option, "filter_padding", "1 to " + std::to_string(max_filter_padding),
              std::to_string(padding));
    if (options.padding.diffusion_rounds < 0)
        raise(error_code::invalid_option, "diffusion_rounds", "0 or more", std::to_string(options.padding.diffusion_rounds));
    if (options.max_side < macroblock_side)
        raise(error_code::invalid_option, "atlas_options::max_side", "at least " + std::to_string(macroblock_side),
              std::to_string(options.max_side));
    check_topology(layers.topology(), "make_atlas");
    check_charts(charts, layers.topology(), "make_atlas");

    const auto blocks = [&](std::int32_t length) {
        return static_cast<std::int32_t>((std::int64_t{length} + 2 * padding + macroblock_side - 1) / macroblock_side);
    };
    buffer<rectangle_size> sizes;
    sizes.reserve(charts.charts.size());
    std::int64_t area = 0;  // in macroblocks
    for (const chart& c : charts.charts) {
        sizes.push_back({blocks(c.width), blocks(c.height)});
        area += std::int64_t{sizes.back().width} * sizes.back().height;
    }
    const std::int32_t max_blocks = options.max_side / macroblock_side;
    if (area > std::int64_t{max_blocks} * max_blocks)
        raise(error_code::too_large, "make_atlas",
              "charts that fit an atlas of " + std::to_string(options.max_side) + " x " + std::to_string(options.max_side) +
                  " texels (use a smaller photo, a lower photo3d --geometry-size, or a smoother depth map)",
              std::to_string(charts.charts.size()) + " charts of " + std::to_string(area * macroblock_side * macroblock_side) +
                  " texels");
    const packing packed = pack(sizes, max_blocks);

    texture_atlas atlas;
    atlas.filter_padding = padding;
    const std::size_t atlas_width = static_cast<std::size_t>(packed.sheet.width * macroblock_side);
    const std::size_t atlas_height = static_cast<std::size_t>(packed.sheet.height * macroblock_side);
    atlas.color = image<std::uint8_t>(atlas_height, atlas_width, 3, 128);
    atlas.kind = image<texel_kind>(atlas_height, atlas_width, 1, texel_kind::empty);
    atlas.fill =
        detail::nearest_float(layers.size()) / detail::nearest_float(std::max<std::size_t>(atlas_height * atlas_width, 1));

    const buffer<texel_kind> kinds = detail::pixel_kinds(layers);
    atlas.placements.resize(charts.charts.size());
    parallel_for(threads, charts.charts.size(), 1, [&](std::size_t first, std::size_t last) {
        chart_padder padder(layers.topology(), layers.template column<color_column>(), kinds, atlas.color, atlas.kind);
        for (std::size_t i = first; i < last; ++i) {
            const atlas_rectangle room{packed.corners[i].x * macroblock_side, packed.corners[i].y * macroblock_side,
                                       sizes[i].width * macroblock_side, sizes[i].height * macroblock_side};
            atlas.placements[i] = {room.x + padding, room.y + padding};
            padder.draw(charts.charts[i], atlas.placements[i], room, options.padding);
        }
    });
    return atlas;
}

}}  // namespace ldi
