// Computes the smooth colors that the inpainting network starts from, with pyramids of masked 3 x 3 averages along the links of a
// layered image. The fill continues the known colors smoothly into unknown pixels. The tone is the average color of a wide
// neighborhood; the network reads colors relative to it. examples/training/farbrausch/README.md explains the steps.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/networks/detail/farbrausch_work.hpp>
#include <ldi/networks/detail/masked_averages.hpp>
#include <ldi/nn/ldi/pixel_subset.hpp>
#include <ldi/nn/ldi/restrict_plan.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// The colors of a subset of a level's pixels.
class subset_colors {
public:
    subset_colors(pixel_subset pixels, const masked_colors& all) : pixels_(std::move(pixels)), colors_(pixels_.size()) {
        pixels_.for_each_run([&](std::int32_t first, std::int32_t count, std::int32_t row) {
            for (std::int32_t i = 0; i < count; ++i) colors_.set(row + i, all[first + i]);
        });
    }
    masked_color operator[](std::int32_t pixel) const noexcept { return colors_[pixels_.row_of(pixel)]; }
    bool has(std::int32_t pixel) const noexcept { return colors_.has(pixels_.row_of(pixel)); }

private:
    pixel_subset pixels_;
    masked_colors colors_;
};

/// The network's input, and the fill that the network corrects.
template <class Value>
struct smooth_fills {
    buffer<Value> input;  ///< per pixel of `read` of level 0: color - tone (red, green, blue), then 1 for a known color, else 0
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

    /// convert  converts a float to the type of the network's input
    template <class Convert>
    auto run(const Convert& convert) {
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
        masked_colors fill = std::move(known[depth]);
        spread(fill, levels_[depth].average, unknown_pixels(fill), growth_);
        masked_colors tone = fill;
        for (std::size_t i = depth - 1; i > 0; --i) {
            tone = average_from_above(tone, i, known[i]);
            const buffer<std::int32_t> unknown = unknown_pixels(known[i]);
            fill_from_above(known[i], unknown, fill, levels_[i].above);
            fill = std::move(known[i]);
            spread(fill, levels_[i].average, unknown, 2 << i);
            levels_[i].average = {};
        }
        return finest(std::move(fill), tone, convert);
    }

private:
    masked_color photo(std::int32_t pixel) const noexcept {
        if (known_[pixel] == 0) return masked_color{};
        const std::uint8_t* const color = colors_.data() + 3 * std::ptrdiff_t{pixel};
        return masked_color{unit_[color[0]], unit_[color[1]], unit_[color[2]], 1.0F};
    }

    /// Returns the pixels without a color, ascending.
    static buffer<std::int32_t> unknown_pixels(const masked_colors& colors) {
        buffer<std::int32_t> result;
        for (std::int32_t i = 0; i < colors.count(); ++i)
            if (!colors.has(i)) result.push_back(i);
        return result;
    }

    /// Gives each unknown pixel the color of its parent.
    void fill_from_above(masked_colors& colors, const buffer<std::int32_t>& unknown, const masked_colors& coarse,
                         const buffer<std::int32_t>& above) const {
        parallel_for(threads_, unknown.size(), 4096, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i)
                if (above[unknown[i]] != no_pixel) colors.set(unknown[i], coarse[above[unknown[i]]]);
        });
    }

    /// Replaces each unknown color with the average of its window, `passes` times.
    void spread(masked_colors& colors, const convolution_plan& windows, const buffer<std::int32_t>& unknown, int passes) {
        const convolution_plan unknown_windows = restrict_and_renumber(windows, unknown);
        masked_colors next(unknown.size());
        for (int pass = 0; pass < passes; ++pass) {
            average_windows(
                unknown_windows, threads_, [&](std::int32_t p) noexcept { return colors[p]; },
                [&](std::int32_t output, masked_color c) noexcept { next.set(output, c); });
            parallel_for(threads_, unknown.size(), 4096, [&](std::size_t first, std::size_t last) {
                for (std::size_t i = first; i < last; ++i) colors.set(unknown[i], next[static_cast<std::int32_t>(i)]);
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
    template <class Convert>
    auto finest(masked_colors fill_above, const masked_colors& tone_above, const Convert& convert) {
        farbrausch_level& level = levels_[0];
        const pixel_subset unknown = pixel_subset::where(known_.size(), [&](std::int32_t pixel) { return known_[pixel] == 0; });
        const subset_colors above_unknown = colors_above(unknown, fill_above);
        fill_above = {};
        const masked_colors unknown_color = unknown_colors(unknown, above_unknown);
        const auto color = [&](std::int32_t pixel) noexcept {
            if (known_[pixel] != 0) return photo(pixel);
            const std::int32_t i = unknown.row_of(pixel);
            return unknown_color.has(i) ? unknown_color[i] : mean();
        };
        smooth_fills<decltype(convert(0.0F))> result;
        result.fill.resize(3 * level.decoded.size(), unset);
        level.decoded.for_each_run([&](std::int32_t first, std::int32_t count, std::int32_t row) {
            for (std::int32_t i = 0; i < count; ++i) {
                const masked_color at = color(first + i);
                for (std::size_t c = 0; c < 3; ++c) result.fill[3 * static_cast<std::size_t>(row + i) + c] = at[c];
            }
        });
        const convolution_plan read_windows = restrict_to(level.average, level.read);
        level.average = {};
        result.input.resize(lanes::wide * level.read.size(), unset);
        average_windows(
            read_windows, threads_,
            [&](std::int32_t p) noexcept { return above_or(tone_above, level.above, p, [&]() noexcept { return photo(p); }); },
            [&](std::int32_t pixel, masked_color tone) noexcept {
                const masked_color here = color(pixel);
                masked_color relative = here - (tone[3] != 0.0F ? tone : here);
                relative[3] = known_[pixel] != 0 ? 1.0F : 0.0F;
                auto* const to = result.input.data() + lanes::wide * static_cast<std::size_t>(level.read.row_of(pixel));
                for (std::size_t c = 0; c < lanes::wide; ++c) to[c] = convert(relative[c]);
            });
        return result;
    }

    /// Returns the colors of the parents of unknown pixels, which are a small part of the level's colors.
    subset_colors colors_above(const pixel_subset& unknown, const masked_colors& fill_above) const {
        buffer<std::uint8_t> marks(levels_[1].pixel_count);
        unknown.for_each_run([&](std::int32_t first, std::int32_t count, std::int32_t) {
            for (std::int32_t i = first; i < first + count; ++i)
                if (const std::int32_t above = levels_[0].above[i]; above != no_pixel) marks[above] = 1;
        });
        return {pixel_subset::marked(marks), fill_above};
    }

    /// Returns the colors of all unknown pixels, averaged with their neighbors twice.
    ///
    /// Also colors the pixels that have a color neither on this level nor on a coarser one. Such pixels exist where only a few
    /// links connect a surface to the rest of the image, because these links may be missing on coarser levels. Colors then
    /// spread from colored pixels along links, one link per pass: each pixel reached by a pass becomes the average of its
    /// colored neighbors.
    masked_colors unknown_colors(const pixel_subset& unknown, const subset_colors& fill_above) {
        const buffer<std::int32_t> pixels = unknown.pixels();
        const convolution_plan windows = restrict_and_renumber(levels_[0].average, pixels);
        masked_colors once(unknown.size()), twice(unknown.size());
        average_windows(
            windows, threads_, [&](std::int32_t p) noexcept { return base_color(p, fill_above); },
            [&](std::int32_t i, masked_color c) noexcept { once.set(i, c); });
        average_windows(
            windows, threads_, [&](std::int32_t p) noexcept { return known_[p] != 0 ? photo(p) : once[unknown.row_of(p)]; },
            [&](std::int32_t i, masked_color c) noexcept { twice.set(i, c); });
        for (std::int32_t i = 0; i < twice.count(); ++i) {
            if (twice.has(i)) continue;
            if (alone_.empty()) run_waves(fill_above);
            twice.set(i, base_color(pixels[i], fill_above));
        }
        return twice;
    }

    /// Colors each pixel that has a color neither on this level nor on a coarser one. This includes pixels that the network
    /// does not read. Otherwise, the colors would depend on which pixels the network reads.
    void run_waves(const subset_colors& fill_above) {
        const buffer<std::int32_t>& above = levels_[0].above;
        for (std::int32_t p = 0; p < above.count(); ++p)
            if (known_[p] == 0 && (above[p] == no_pixel || !fill_above.has(above[p]))) alone_.push_back(p);
        alone_colors_ = masked_colors(alone_.size());
        buffer<std::int32_t> candidates(alone_.size()), reached;
        for (std::int32_t i = 0; i < alone_.count(); ++i) candidates[i] = i;
        masked_colors found(alone_.size());
        buffer<std::uint8_t> is_candidate(alone_.size());  // in the next wave
        while (!candidates.empty()) {
            reached.clear();
            for (const std::int32_t i : candidates) {
                masked_color sum{};
                for (const side s : all_sides)
                    if (const std::int32_t n = graph_.neighbor(alone_[i], s); n != no_pixel)
                        sum = sum + base_color(n, fill_above);
                found.set(i, average_of(sum));
                if (found.has(i)) reached.push_back(i);
            }
            for (const std::int32_t i : reached) alone_colors_.set(i, found[i]);
            candidates.clear();
            for (const std::int32_t i : reached)
                for (const side s : all_sides) {
                    const std::int32_t n = graph_.neighbor(alone_[i], s);
                    const std::int32_t next = n == no_pixel ? no_pixel : find_alone(n);
                    if (next == no_pixel || alone_colors_.has(next) || is_candidate[next] != 0) continue;
                    is_candidate[next] = 1;
                    candidates.push_back(next);
                }
        }
    }

    /// Returns the index of a pixel in alone_, or no_pixel.
    std::int32_t find_alone(std::int32_t pixel) const noexcept {
        const auto found = std::lower_bound(alone_.begin(), alone_.end(), pixel);
        return found != alone_.end() && *found == pixel ? static_cast<std::int32_t>(found - alone_.begin()) : no_pixel;
    }

    /// Returns the color of a pixel before averaging with its neighbors.
    masked_color base_color(std::int32_t pixel, const subset_colors& fill_above) const noexcept {
        if (known_[pixel] != 0) return photo(pixel);
        const std::int32_t above = levels_[0].above[pixel];
        if (above != no_pixel)
            if (const masked_color color = fill_above[above]; color[3] != 0.0F) return color;
        const std::int32_t found = find_alone(pixel);
        return found != no_pixel ? alone_colors_[found] : masked_color{};
    }

    /// Mean of all known colors, for surfaces that no link connects to a known color.
    masked_color mean() {
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
