// Draws a chart into the atlas with its padding (paper, section "Texture Atlas Generation", both paddings). Filter padding, a
// few texels thick, is copied from the neighboring chart where the surface continues, and diffused where it ends. Macroblock
// padding is also diffused. This padding fills the rest of every 16 x 16 block that the padded chart touches, because JPEG
// mixes the colors within a block.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/diffusion.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/validate.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Side, in texels, of the square blocks in which JPEG encodes color (with 4:2:0 subsampling, the default of most encoders).
inline constexpr std::int32_t macroblock_side = 16;

/// Origin of a texel's color: the classes of the paper's Figure "atlas".
enum class texel_kind : std::uint8_t {
    empty,       ///< outside the blocks of all charts
    photo,       ///< a pixel visible in the photo
    refilled,    ///< a visible pixel beside a silhouette, inpainted because its color was mixed
    occluded,    ///< an inpainted pixel behind another pixel
    copied,      ///< filter padding from the neighboring chart
    diffused,    ///< filter padding where the surface ends
    macroblock,  ///< the remaining texels of a chart's blocks
};

/// A rectangle of the atlas, in texels.
struct atlas_rectangle {
    std::int32_t x = 0, y = 0, width = 0, height = 0;
};

inline constexpr std::int32_t max_filter_padding = 1024;

/// Options of chart_padder: the texels around a chart that continue its colors.
struct padding_options {
    std::int32_t filter_padding = 4;  ///< thickness in texels, along rows and columns; 1 to max_filter_padding
    int diffusion_rounds = 4;         ///< rounds per level (core/diffusion.hpp), 0 or more
};

/// Draws and pads charts one by one. Keep an object to reuse its memory. Use one object per thread. Several objects may draw
/// charts at the same time if their rectangles share no texel.
class chart_padder {
public:
    /// g        graph of the layers, a graph or graph_view. All arguments must outlive this object
    /// colors   K x 3
    /// kind_of  K values: photo, refilled or occluded for each pixel
    /// color    colors of the atlas, H x W x 3
    /// kind     kinds of the atlas's texels, H x W x 1; all `empty` before the first chart
    ///
    /// Raises mismatch if sizes do not fit together or an invariant of the graph does not hold.
    template <class Graph>
    chart_padder(const Graph& g, std::span<const std::uint8_t> colors, std::span<const texel_kind> kind_of,
                 image<std::uint8_t>& color, image<texel_kind>& kind)
        : graph_(g),
          colors_(colors.data()),
          kind_of_(kind_of.data()),
          color_(color.data()),
          kind_(kind.data()),
          stride_(static_cast<std::ptrdiff_t>(kind.width())),
          height_(static_cast<std::ptrdiff_t>(kind.height())) {
        if (colors.size() != 3 * g.size() || kind_of.size() != g.size() || color.channels() != 3 || kind.channels() != 1 ||
            color.height() != kind.height() || color.width() != kind.width())
            raise(error_code::mismatch, "chart_padder",
                  "a color and a kind for each pixel, and an atlas of H x W x 3 colors and H x W x 1 kinds",
                  "arrays of other sizes");
        check_topology(g, "chart_padder");
    }

    /// Draws and pads a chart.
    ///
    /// room  the rectangle of blocks that is reserved for the chart. All four numbers are multiples of 16, and the chart is at
    ///       least `filter_padding` texels away from every side. Texels that remain empty keep their color
    ///
    /// Raises mismatch if `room` does not meet these conditions, if two pixels of the chart have the same position, or if a
    /// pixel lies outside the chart's box.
    void draw(const chart& c, chart_placement placement, atlas_rectangle room, const padding_options& options) {
        check_room(c, placement, room, options.filter_padding);
        draw_own(c, placement);
        find_border(c, placement);
        for (std::int32_t i = 0; i < options.filter_padding; ++i) grow_border();
        fill_blocks(room, options.diffusion_rounds);
    }

private:
    struct border_texel {
        std::ptrdiff_t texel;
        std::int32_t pixel;  // pixel that the texel shows; no_pixel beyond the surface's end
    };

    void check_room(const chart& c, chart_placement placement, atlas_rectangle room, std::int32_t padding) const {
        const auto holds = [&](std::int64_t first, std::int64_t length, std::int64_t at, std::int64_t size, std::int64_t all) {
            return first >= 0 && length >= 0 && first + length <= all && first % macroblock_side == 0 &&
                   length % macroblock_side == 0 && at - padding >= first && at + size + padding <= first + length;
        };
        if (padding < 1 || !holds(room.x, room.width, placement.x, c.width, stride_) ||
            !holds(room.y, room.height, placement.y, c.height, height_))
            raise(error_code::mismatch, "chart_padder", "blocks in the atlas that contain the chart and its padding",
                  std::to_string(room.width) + " x " + std::to_string(room.height) + " for a chart of " +
                      std::to_string(c.width) + " x " + std::to_string(c.height));
    }

    std::ptrdiff_t texel_of(std::int32_t pixel, const chart& c, chart_placement placement) const {
        return (graph_.y()[pixel] - c.y + placement.y) * stride_ + (graph_.x()[pixel] - c.x + placement.x);
    }

    std::ptrdiff_t step(side s) const { return step_y(s) * stride_ + step_x(s); }

    /// Calls `visit(pixel, texel, count)` for each run of pixels that are consecutive in memory and in a row of the atlas.
    template <class Visit>
    void for_each_stretch(const chart& c, chart_placement placement, Visit&& visit) const {
        for (const chart_pixels::run& r : c.pixels.runs()) {
            if (r.count > graph_.count() - r.first) refuse_outside(r.first + (r.count - 1));
            for (std::int32_t pixel = r.first, end = pixel + r.count, count = 0; pixel < end; pixel += count) {
                const std::int32_t x = graph_.x()[pixel], y = graph_.y()[pixel];
                for (count = 1; pixel + count < end;) {
                    if (graph_.x()[pixel + count] != x + count || graph_.y()[pixel + count] != y) break;
                    ++count;
                }
                if (x < c.x || y < c.y || std::int64_t{x} + count > std::int64_t{c.x} + c.width || y - c.y >= c.height)
                    refuse_outside(pixel);
                visit(pixel, texel_of(pixel, c, placement), std::ptrdiff_t{count});
            }
        }
    }

    [[noreturn]] static void refuse_outside(std::int32_t pixel) {
        raise(error_code::mismatch, "chart_padder", "pixels in the chart's box", "pixel " + std::to_string(pixel) + " outside");
    }

    void draw_own(const chart& c, chart_placement placement) {
        for_each_stretch(c, placement, [&](std::int32_t pixel, std::ptrdiff_t texel, std::ptrdiff_t count) {
            unsigned taken = 0;  // without branches, so that the compiler can vectorize the loop
            for (std::ptrdiff_t t = texel; t < texel + count; ++t) taken |= static_cast<unsigned>(kind_[t] != texel_kind::empty);
            if (taken != 0) refuse_overlap(pixel, texel);
            std::copy_n(kind_of_ + pixel, count, kind_ + texel);
            std::copy_n(colors_ + 3 * std::ptrdiff_t{pixel}, 3 * count, color_ + 3 * texel);
        });
    }

    /// Raises mismatch for the first pixel of a run whose texel already belongs to another pixel.
    [[noreturn]] void refuse_overlap(std::int32_t pixel, std::ptrdiff_t texel) const {
        for (; kind_[texel] == texel_kind::empty; ++texel) ++pixel;
        raise(error_code::mismatch, "make_atlas", "charts with at most one pixel per position",
              "a chart with pixel " + std::to_string(pixel) + " and an earlier one at (" + std::to_string(graph_.x()[pixel]) +
                  ", " + std::to_string(graph_.y()[pixel]) + ")");
    }

    void copy_color(std::ptrdiff_t texel, std::int32_t pixel) {
        for (std::ptrdiff_t channel = 0; channel < 3; ++channel)
            color_[3 * texel + channel] = colors_[3 * std::ptrdiff_t{pixel} + channel];
    }

    void find_border(const chart& c, chart_placement placement) {
        border_.clear();
        for_each_stretch(c, placement, [&](std::int32_t pixel, std::ptrdiff_t texel, std::ptrdiff_t count) {
            constexpr std::ptrdiff_t block = 32;  // texels tested together; few blocks have a texel at the border
            for (std::ptrdiff_t i = 0; i < count; i += block) {
                const std::ptrdiff_t end = (std::min)(i + block, count);
                int found = 0;
                for (std::ptrdiff_t t = i; t < end; ++t) found |= static_cast<int>(is_at_border(texel + t));
                for (std::ptrdiff_t t = i; found != 0 && t < end; ++t)
                    if (is_at_border(texel + t)) border_.push_back({texel + t, pixel + static_cast<std::int32_t>(t)});
            }
        });
    }

    /// Whether a texel next to `texel` is empty. The function has no branches, so that the compiler can vectorize it.
    bool is_at_border(std::ptrdiff_t texel) const {
        const auto is_empty = [&](std::ptrdiff_t t) { return static_cast<int>(kind_[t] == texel_kind::empty); };
        return (is_empty(texel - 1) | is_empty(texel + 1) | is_empty(texel - stride_) | is_empty(texel + stride_)) != 0;
    }

    /// Widens the filter padding by one texel. Where two surfaces face each other, each fills half of the gap. A surface that
    /// continues takes precedence over one that ends.
    void grow_border() {
        next_border_.clear();
        for (const border_texel& b : border_) {
            if (b.pixel == no_pixel) continue;
            for (side s : all_sides) {
                const std::ptrdiff_t texel = b.texel + step(s);
                const std::int32_t beyond = graph_.neighbor(b.pixel, s);
                if (beyond == no_pixel || kind_[texel] != texel_kind::empty) continue;
                kind_[texel] = texel_kind::copied;
                copy_color(texel, beyond);
                next_border_.push_back({texel, beyond});
            }
        }
        for (const border_texel& b : border_)
            for (side s : all_sides) {
                const std::ptrdiff_t texel = b.texel + step(s);
                if (kind_[texel] != texel_kind::empty) continue;
                kind_[texel] = texel_kind::diffused;
                next_border_.push_back({texel, no_pixel});
            }
        border_.swap(next_border_);
    }

    static constexpr unsigned bit(texel_kind k) { return 1U << static_cast<unsigned>(k); }
    static bool is_known(texel_kind k) { return k >= texel_kind::photo && k <= texel_kind::copied; }
    static bool is_unknown(texel_kind k) { return k > texel_kind::copied; }

    /// Diffuses colors into all unknown texels of the blocks that the padded chart touches.
    void fill_blocks(atlas_rectangle room, int rounds) {
        diffusion_.start();
        unknown_.clear();
        cell_above_.assign(static_cast<std::size_t>(room.width), 0);
        for (std::int32_t y = 0; y < room.height; ++y) {
            if (y % macroblock_side == 0) find_open_blocks(room, y);
            for (std::int32_t block : open_blocks_)
                for (std::int32_t x = block; x < block + macroblock_side; ++x) add_unknown(room, x, y);
        }
        diffusion_.solve(rounds);
        for (std::int32_t i = 0; i < unknown_.count(); ++i) {
            const diffusion<3>::value_type& value = diffusion_.value(i + 1);
            std::uint8_t* const color = color_ + 3 * unknown_[i];
            for (std::size_t channel = 0; channel < 3; ++channel) color[channel] = detail::rounded_mean(value[channel]);
        }
    }

    /// Lists the blocks with unknown texels in one row of blocks, and marks their empty texels as `macroblock`.
    void find_open_blocks(atlas_rectangle room, std::int32_t y) {
        open_blocks_.clear();
        for (std::int32_t x = 0; x < room.width; x += macroblock_side) {
            texel_kind* corner = kind_ + (room.y + y) * stride_ + room.x + x;
            unsigned seen = 0;
            for (std::int32_t i = 0; i < macroblock_side; ++i)
                for (std::int32_t j = 0; j < macroblock_side; ++j) seen |= bit(corner[i * stride_ + j]);
            if (seen == bit(texel_kind::empty) || (seen & (bit(texel_kind::empty) | bit(texel_kind::diffused))) == 0) continue;
            open_blocks_.push_back(x);
            for (std::int32_t i = 0; i < macroblock_side; ++i)
                std::replace(corner + i * stride_, corner + i * stride_ + macroblock_side, texel_kind::empty,
                             texel_kind::macroblock);
        }
    }

    void add_unknown(atlas_rectangle room, std::int32_t x, std::int32_t y) {
        const std::ptrdiff_t texel = (room.y + y) * stride_ + room.x + x;
        if (!is_unknown(kind_[texel])) return;
        const std::int32_t cell = diffusion_.add_cell(x, y);
        unknown_.push_back(texel);
        const auto look = [&](bool inside, std::ptrdiff_t other) {
            if (inside && is_known(kind_[other])) diffusion_.add_known_neighbor(cell, color_ + 3 * other);
            return inside && is_unknown(kind_[other]);
        };
        if (look(x > 0, texel - 1)) diffusion_.link_left(cell, cell - 1);
        if (look(y > 0, texel - stride_)) diffusion_.link_up(cell, cell_above_[x]);
        look(x + 1 < room.width, texel + 1);
        look(y + 1 < room.height, texel + stride_);
        cell_above_[x] = cell;
    }

    graph_view graph_;
    const std::uint8_t* colors_;
    const texel_kind* kind_of_;
    std::uint8_t* color_;
    texel_kind* kind_;
    std::ptrdiff_t stride_, height_;
    buffer<border_texel> border_, next_border_;
    diffusion<3> diffusion_;
    buffer<std::ptrdiff_t> unknown_;  // texel of each diffusion cell
    buffer<std::int32_t> cell_above_, open_blocks_;
};

}}  // namespace ldi
