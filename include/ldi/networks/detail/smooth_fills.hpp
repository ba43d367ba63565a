// Computes the smooth colors that the inpainting network starts from, with pyramids of masked 3 x 3 averages along the links of a
// layered image. The fill continues the known colors smoothly into unknown pixels. The tone is the average color of a wide
// neighborhood; the network reads colors relative to it. examples/training/farbrausch/README.md explains the steps.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/networks/detail/farbrausch_work.hpp>
#include <ldi/networks/detail/masked_averages.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// The network's input, and the fill that the network corrects.
struct smooth_fills {
    buffer<float> input;  ///< per pixel of `read` of level 0: fill - tone in red, green, blue, and 1 for a known color, else 0
    buffer<float> fill;   ///< per pixel of `decoded` of level 0: red, green, blue
};

template <executor Executor>
class smooth_filler {
public:
    smooth_filler(const graph_view& g, array_view<const std::uint8_t> colors, array_view<const std::uint8_t> known,
                  buffer<farbrausch_level>& levels, int growth, Executor& threads)
        : graph_(g), colors_(colors), known_(known), levels_(levels), growth_(growth), threads_(threads) {
        for (std::size_t v = 0; v < unit_.size(); ++v) unit_[v] = nearest_float(v) / 255.0F;
    }

    smooth_fills run() {
        const std::size_t depth = levels_.size() - 1;
        buffer<masked_colors> known(depth + 1);  // level 0 stays empty: the photo replaces it
        for (std::size_t i = 0; i < depth; ++i) {
            known[i + 1] = masked_colors(levels_[i + 1].pixel_count);
            const auto store = [&](std::int32_t output, masked_color c) noexcept { known[i + 1].set(output, c); };
            if (i == 0)
                average_windows(
                    levels_[i].average_coarse, threads_, [&](std::int32_t p) noexcept { return photo(p); }, store);
            else
                average_windows(
                    levels_[i].average_coarse, threads_, [&](std::int32_t p) noexcept { return known[i][p]; }, store);
            levels_[i].average_coarse = {};
        }
        masked_colors fill = known[depth];
        spread(fill, levels_[depth].average, known[depth], growth_);
        masked_colors tone = fill;
        for (std::size_t i = depth - 1; i > 0; --i) {
            fill = from_above(fill, levels_[i].above, known[i]);
            spread(fill, levels_[i].average, known[i], 2 << i);
            tone = average_from_above(tone, i, known[i]);
            known[i] = {};
        }
        return finest(fill, tone);
    }

private:
    masked_color photo(std::int32_t pixel) const noexcept {
        if (known_[pixel] == 0) return masked_color{};
        const std::uint8_t* const color = colors_.data() + 3 * std::ptrdiff_t{pixel};
        return masked_color{unit_[color[0]], unit_[color[1]], unit_[color[2]], 1.0F};
    }

    /// Returns the known colors, and for unknown pixels the color of the parent.
    masked_colors from_above(const masked_colors& coarse, const buffer<std::int32_t>& above, const masked_colors& known) const {
        masked_colors result = known;
        parallel_for(threads_, above.size(), 4096, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i)
                if (const std::int32_t p = static_cast<std::int32_t>(i); !known.has(p) && above[i] != no_pixel)
                    result.set(p, coarse[above[i]]);
        });
        return result;
    }

    /// Replaces each unknown color by the average of its window, `passes` times.
    void spread(masked_colors& colors, const convolution_plan& windows, const masked_colors& known, int passes) {
        buffer<std::int32_t> unknown;
        for (std::int32_t i = 0; i < known.count(); ++i)
            if (!known.has(i)) unknown.push_back(i);
        spread_at(colors, restrict_and_renumber(windows, unknown), unknown, passes);
    }

    /// Replaces the colors at `places` by the averages of their windows, `passes` times.
    ///
    /// windows  the windows of `places`, in the same order
    void spread_at(masked_colors& colors, const convolution_plan& windows, std::span<const std::int32_t> places, int passes) {
        masked_colors next(places.size());
        for (int pass = 0; pass < passes; ++pass) {
            average_windows(
                windows, threads_, [&](std::int32_t p) noexcept { return colors[p]; },
                [&](std::int32_t output, masked_color c) noexcept { next.set(output, c); });
            parallel_for(threads_, places.size(), 4096, [&](std::size_t first, std::size_t last) {
                for (std::size_t i = first; i < last; ++i) colors.set(places[i], next[static_cast<std::int32_t>(i)]);
            });
        }
    }

    /// Averages each pixel's window once. Each pixel of the window contributes the color of its parent, or its own known color
    /// if the parent has none.
    masked_colors average_from_above(const masked_colors& coarse, std::size_t level, const masked_colors& known) {
        const buffer<std::int32_t>& above = levels_[level].above;
        masked_colors result(levels_[level].pixel_count);
        average_windows(
            levels_[level].average, threads_,
            [&](std::int32_t p) noexcept { return above_or(coarse, above, p, [&]() noexcept { return known[p]; }); },
            [&](std::int32_t output, masked_color c) noexcept { result.set(output, c); });
        return result;
    }

    template <class Else>
    static masked_color above_or(const masked_colors& coarse, const buffer<std::int32_t>& above, std::int32_t pixel,
                                 Else&& otherwise) noexcept {
        const std::int32_t from = above[pixel];
        if (from != no_pixel) {
            const masked_color color = coarse[from];
            if (color[3] != 0.0F) return color;
        }
        return otherwise();
    }

    /// Computes level 0 at the pixels that the network reads.
    smooth_fills finest(const masked_colors& fill_above, const masked_colors& tone_above) {
        const farbrausch_level& level = levels_[0];
        const pixel_subset& read = level.read;
        masked_colors fill(read.size());
        buffer<std::int32_t> unknown, rows;
        for (std::int32_t row = 0; row < fill.count(); ++row) {
            const std::int32_t pixel = read.pixels[row];
            if (known_[pixel] == 0) unknown.push_back(pixel), rows.push_back(row);
            fill.set(row, base_color(pixel, fill_above));
        }
        convolution_plan windows = restrict_and_renumber(level.average, unknown);
        renumber_inputs(windows, read);
        spread_at(fill, windows, rows, 2);
        color_along_links(fill, fill_above);
        smooth_fills result;
        result.fill.resize(3 * level.decoded.size());
        for (std::size_t d = 0; d < level.decoded.size(); ++d) {
            const std::int32_t row = read.row_of[level.decoded[d]];
            const masked_color color = fill.has(row) ? fill[row] : mean();
            for (std::size_t c = 0; c < 3; ++c) result.fill[3 * d + c] = color[c];
        }
        average_windows(
            restrict_to(level.average, read.pixels), threads_,
            [&](std::int32_t p) noexcept { return above_or(tone_above, level.above, p, [&]() noexcept { return photo(p); }); },
            [&](std::int32_t pixel, masked_color tone) noexcept {
                const std::int32_t row = read.row_of[pixel];
                const masked_color color = fill.has(row) ? fill[row] : mean();
                masked_color relative = color - (tone[3] != 0.0F ? tone : color);
                relative[3] = known_[pixel] != 0 ? 1.0F : 0.0F;
                fill.set(row, relative);
            });
        result.input = fill.release();
        return result;
    }

    /// Colors pixels that have no color on this or a coarser level. Such pixels exist where few links connect a surface to the
    /// rest, because these links may be missing on coarser levels. Colors spread along links from colored pixels, one link per
    /// pass: each pixel becomes the average of its colored neighbors.
    void color_along_links(masked_colors& fill, const masked_colors& fill_above) {
        for (std::int32_t row = 0; row < fill.count(); ++row) {
            if (fill.has(row)) continue;
            if (alone_.empty()) run_waves(fill_above);
            fill.set(row, base_color(levels_[0].read.pixels[row], fill_above));
        }
    }

    /// Gives a color to each pixel that has none on this or a coarser level. Includes pixels that the network does not read;
    /// otherwise, colors would depend on which pixels it reads.
    void run_waves(const masked_colors& fill_above) {
        const buffer<std::int32_t>& above = levels_[0].above;
        for (std::int32_t p = 0; p < above.count(); ++p)
            if (known_[p] == 0 && (above[p] == no_pixel || !fill_above.has(above[p]))) alone_.push_back(p);
        alone_colors_ = masked_colors(alone_.size());
        buffer<std::int32_t> waiting(alone_.size()), next, reached;
        for (std::int32_t i = 0; i < alone_.count(); ++i) waiting[i] = i;
        masked_colors found(alone_.size());
        for (bool advances = true; advances; waiting.swap(next)) {
            next.clear(), reached.clear();
            for (const std::int32_t i : waiting) {
                masked_color sum{};
                for (const side s : all_sides)
                    if (const std::int32_t n = graph_.neighbor(alone_[i], s); n != no_pixel)
                        sum = sum + base_color(n, fill_above);
                found.set(i, average_of(sum));
                (found.has(i) ? reached : next).push_back(i);
            }
            for (const std::int32_t i : reached) alone_colors_.set(i, found[i]);
            advances = !reached.empty();
        }
    }

    /// Returns the color of a pixel before averaging with its neighbors.
    masked_color base_color(std::int32_t pixel, const masked_colors& fill_above) const noexcept {
        if (known_[pixel] != 0) return photo(pixel);
        const std::int32_t above = levels_[0].above[pixel];
        if (above != no_pixel && fill_above.has(above)) return fill_above[above];
        const auto found = std::lower_bound(alone_.begin(), alone_.end(), pixel);
        return found != alone_.end() && *found == pixel ? alone_colors_[static_cast<std::int32_t>(found - alone_.begin())]
                                                        : masked_color{};
    }

    /// Mean of all known colors, for surfaces that no link connects to a known color.
    masked_color mean() noexcept {
        std::call_once(mean_is_known_, [&] {
            std::array<std::uint64_t, 3> sum{};
            std::uint64_t count = 0;
            for (std::size_t p = 0; p < known_.size(); ++p) {
                if (known_[p] == 0) continue;
                ++count;
                for (std::size_t c = 0; c < 3; ++c) sum[c] += colors_[3 * p + c];
            }
            const double scale = 1.0 / (255.0 * nearest_double(std::max<std::uint64_t>(count, 1)));
            for (std::size_t c = 0; c < 3; ++c) mean_[c] = static_cast<float>(nearest_double(sum[c]) * scale);
        });
        return mean_;
    }

    graph_view graph_;
    array_view<const std::uint8_t> colors_, known_;
    buffer<farbrausch_level>& levels_;
    int growth_;
    Executor& threads_;
    std::array<float, 256> unit_{};
    buffer<std::int32_t> alone_;  // pixels of level 0 without a color on any level
    masked_colors alone_colors_;
    std::once_flag mean_is_known_;
    masked_color mean_{};
};

}}}  // namespace ldi::detail
