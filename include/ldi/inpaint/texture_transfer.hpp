// Texture for inpainted pixels, copied from the photo. An inpainter that returns the mean of all plausible colors returns no
// texture. This stage adds high frequencies that it copies from known pixels of the same surface, near the silhouette. Each
// unknown pixel copies from a known pixel with similar blurred surroundings (after Yi et al., "Contextual Residual Aggregation
// for Ultra High-Resolution Image Inpainting", 2020). Where no known pixel is similar enough, the stage adds grain
// (inpaint/grain.hpp). Not in the paper.
//
// High frequencies have a mean of zero and contain no edges that must align, so patches may end anywhere. The seams between
// patches need no blending, which would average and weaken the texture. The stage attenuates detail that is stronger than the
// photo's detail around the hole, for example an edge or a leaf in front of the sky.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/inpaint/detail/texture_cells.hpp>
#include <ldi/inpaint/detail/texture_looks.hpp>
#include <ldi/inpaint/detail/texture_search.hpp>
#include <ldi/inpaint/grain.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of add_texture().
struct texture_options {
    /// Strength relative to the texture of the photo, 0 to 100; 0 leaves only grain.
    float strength = 1.0F;
    /// Limit of a pixel's texture, as a multiple of the photo's detail around it, 0 to 1000. Texture approaches the limit
    /// gradually. With a large limit, edges are copied as well.
    float crest = 4.0F;
    /// Known pixels are sources of texture up to this distance from the nearest inpainted pixel, in steps along links, 1 to 200.
    /// On the stereo pairs and scenes of bench/quality, LPIPS is the same with 16 and 32.
    int reach = 16;
    /// Mean difference of blurred colors, in gray levels from 0 to 255, up to which a source counts as similar. Between this
    /// value and twice this value, texture fades to grain.
    float tolerance = 13.0F;
    /// Rounds of the search, in alternating directions, 1 to 60. With one round, LPIPS is the same on these photographs, but a
    /// few pixels in large holes find no source and get grain instead.
    int rounds = 2;
};

namespace detail {

/// Three channels of color.
using texture_color = std::array<float, 3>;

/// Finds a source of texture for each unknown pixel, and returns the detail to copy from the source.
class texture_transfer {
public:
    /// cells  result of find_texture_cells() for `g`, options.reach and `margin`
    /// color  the column of a layered image with this graph
    template <executor Executor>
    texture_transfer(const graph_view& g, texture_cells cells, array_view<const std::uint8_t> color,
                     const texture_options& options, Executor& threads)
        : options_(options),
          cells_(std::move(cells)),
          looks_(look_at(cells_, color, threads)),
          source_(texture_search(g, cells_, looks_.surroundings, options.reach).run(options.rounds, threads)) {}

    /// Width of the cells' margin in steps; the blur and the taps of source cells read the margin.
    static constexpr int margin = 3;

    const texture_cells& cells() const { return cells_; }

    /// Returns the similarity of a cell and its source, 0 to 1.
    float likeness(std::int32_t cell) const {
        if (source_[cell] == no_pixel) return 0.0F;
        const float difference = nearest_float(difference_of(looks_.surroundings[cell], looks_.surroundings[source_[cell]])) /
                                 nearest_float(tap_values);
        if (difference <= options_.tolerance) return 1.0F;
        return (std::max)(2.0F - difference / options_.tolerance, 0.0F);  // a tolerance of 0 accepts only equal surroundings
    }

    /// Returns the texture of an unknown cell, zero if it has no source.
    ///
    /// noise  the photo's detail around the cell
    texture_color texture(std::int32_t cell, float noise) const {
        if (source_[cell] == no_pixel) return {};
        texture_color result;
        const float max_value = options_.crest * noise;
        for (std::size_t c = 0; c < 3; ++c) {
            const float value = nearest_float(looks_.detail[source_[cell]][c]) / 16.0F;
            result[c] = value * (options_.strength * (max_value > 0.0F ? max_value / (max_value + std::abs(value)) : 0.0F));
        }
        return result;
    }

private:
    texture_options options_;
    texture_cells cells_;
    texture_looks looks_;
    buffer<std::int32_t> source_;
};

inline void check_options(const texture_options& options) {
    check_option("texture_options, strength", options.strength, 0.0F, 100.0F);
    check_option("texture_options, crest", options.crest, 0.0F, 1000.0F);
    check_option("texture_options, reach", nearest_float(options.reach), 1.0F, 200.0F);
    check_option("texture_options, tolerance", options.tolerance, 0.0F, 255.0F);
    check_option("texture_options, rounds", nearest_float(options.rounds), 1.0F, 60.0F);
}

}  // namespace detail

/// Adds texture to every pixel whose known_column is 0, and grain where no source is similar; other pixels do not change.
///
/// layers   in canonical order; every pixel has a color
/// options  if the strength is 0, add_texture() is equivalent to add_grain()
/// grain    its limit and its rounds also apply to measuring the photo's detail; if the limit is 0, nothing is added
///
/// Raises invalid_option like add_grain(), and for a strength outside [0, 100], a crest outside [0, 1000], a tolerance outside
/// [0, 255], a reach outside [1, 200], or rounds outside [1, 60]. Linear time; several threads also sort the groups of linked
/// unknown pixels. Memory: up to 80 bytes per pixel, with several threads 115, if all pixels are unknown or near unknown pixels.
template <has_columns<color_column, known_column> Layers, executor Executor = const serial_executor>
void add_texture(Layers& layers, const texture_options& options = {}, const grain_options& grain = {}, Executor&& threads = {}) {
    detail::check_options(options);
    detail::check_options(grain);
    if (options.strength == 0.0F) return add_grain(layers, grain);
    if (grain.limit == 0.0F) return;
    const auto& g = layers.topology();
    const array_view<const std::uint8_t> known = layers.template column<known_column>();
    if (std::find(known.begin(), known.end(), std::uint8_t{0}) == known.end()) return;
    buffer<float> around;
    detail::texture_cells found;
    detail::run_both(
        threads, [&] { around = detail::detail_around_unknown(layers, grain.limit, grain.rounds); },
        [&] { found = detail::find_texture_cells(g, known, options.reach, detail::texture_transfer::margin); });
    const detail::texture_transfer transfer(g, std::move(found), layers.template column<color_column>(), options, threads);
    const detail::texture_cells& cells = transfer.cells();
    parallel_for(threads, cells.kinds.size(), 8192, [&](std::size_t first, std::size_t last) {
        auto next = std::count(cells.kinds.begin(), cells.kinds.begin() + first, detail::texture_cells::kind::unknown);
        for (std::size_t c = first; c < last; ++c) {
            const auto cell = static_cast<std::int32_t>(c);
            if (!cells.is_unknown(cell)) continue;
            const std::int32_t pixel = cells.pixel[cell];
            const float noise = around[next++], likeness = transfer.likeness(cell);
            const float rest = (1.0F - likeness) * grain.strength * noise * detail::grain_at(g.x()[pixel], g.y()[pixel]);
            const detail::texture_color texture = transfer.texture(cell, noise);
            const auto color = layers.template at<color_column>(pixel);
            for (std::size_t k = 0; k < 3; ++k) color[k] = detail::rounded_to_byte(color[k] + likeness * texture[k] + rest);
        }
    });
}

}}  // namespace ldi
