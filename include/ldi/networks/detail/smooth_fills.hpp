// The smooth colours that the inpainting network starts from: pyramids of masked 3 x 3 averages over the links of a layered
// image. examples/training/farbrausch/README.md says what they are, step by step.
#pragma once

#include <ldi/core/detail/four_floats.hpp>
#include <ldi/core/executor.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/kernels/detail/aligned_vector.hpp>
#include <ldi/networks/detail/farbrausch_work.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <span>
#include <utility>
#include <vector>

namespace ldi::detail {

/// red, green, blue, and 1 where there is a colour; four zeros where there is none.
using masked_colour = lanes::four_floats;

/// Masked colours side by side.
class masked_colours {
public:
    masked_colours() = default;
    explicit masked_colours(std::size_t count) : values_(count * lanes::wide) {}

    std::size_t size() const { return values_.size() / lanes::wide; }
    masked_colour operator[](std::int32_t i) const { return lanes::load(at(i)); }
    void set(std::int32_t i, masked_colour colour) { lanes::store(at(i), colour); }
    bool has(std::int32_t i) const { return at(i)[3] != 0.0F; }
    const float* at(std::int32_t i) const { return values_.data() + static_cast<std::size_t>(i) * lanes::wide; }
    float* at(std::int32_t i) { return values_.data() + static_cast<std::size_t>(i) * lanes::wide; }
    std::span<const float> values() const { return values_; }

private:
    aligned_vector<float> values_;
};

/// The average of `count = sum[3]` colours whose sum this is.
inline masked_colour average_of(masked_colour sum) {
    static constexpr std::array<float, 10> reciprocals{0.0F,     1.0F,     1.0F / 2, 1.0F / 3, 1.0F / 4,
                                                       1.0F / 5, 1.0F / 6, 1.0F / 7, 1.0F / 8, 1.0F / 9};
    const float reciprocal = reciprocals[static_cast<std::size_t>(sum[3])];
    masked_colour average = sum * reciprocal;
    average[3] = reciprocal > 0.0F ? 1.0F : 0.0F;
    return average;
}

/// Calls `store(output, average)` for every output of a plan of 3 x 3 windows, with the average of those `value(pixel)` in its
/// window that are colours. Sums are taken column by column wherever the window lies, so results don't depend on the plan.
template <executor Executor, class Value, class Store>
void average_windows(const convolution_plan& plan, Executor& threads, Value&& value, Store&& store) {
    LDI_ASSERT(plan.kernel_size == 3);
    parallel_for(threads, plan.segments.size(), 256, [&](std::size_t begin, std::size_t end) {
        for (std::size_t s = begin; s < end; ++s) {
            const std::int32_t upper = plan.rows[3 * s], middle = plan.rows[3 * s + 1], lower = plan.rows[3 * s + 2];
            const auto column = [&](std::int32_t x) { return (value(upper + x) + value(middle + x)) + value(lower + x); };
            const convolution_plan::segment segment = plan.segments[s];
            masked_colour left = column(-1);
            if (plan.stride == 2) {
                for (std::int32_t i = 0; i < segment.count; ++i) {
                    const masked_colour centre = column(2 * i), right = column(2 * i + 1);
                    store(segment.first + i, average_of((left + centre) + right));
                    left = right;
                }
                continue;
            }
            masked_colour centre = column(0);
            for (std::int32_t i = 0; i < segment.count; ++i) {
                const masked_colour right = column(i + 1);
                store(segment.first + i, average_of((left + centre) + right));
                left = centre, centre = right;
            }
        }
    });
    parallel_for(threads, plan.irregular.size(), 1024, [&](std::size_t begin, std::size_t end) {
        for (std::size_t o = begin; o < end; ++o) {
            const std::int32_t* const window = plan.windows.data() + 9 * o;
            const auto at = [&](std::size_t element) {
                return window[element] == no_pixel ? masked_colour{} : value(window[element]);
            };
            const auto column = [&](std::size_t x) { return (at(x) + at(3 + x)) + at(6 + x); };
            store(plan.irregular[o], average_of((column(0) + column(1)) + column(2)));
        }
    });
}

/// What the network starts from, in rows of `read` of level 0.
struct smooth_fills {
    masked_colours
        input;  ///< in rows of `read` of level 0: red, green, blue of fill - tone, and 1 where the colour is known, else 0
    std::vector<float> fill;  ///< in rows of `decoded` of level 0: red, green, blue
};

template <executor Executor>
class smooth_filler {
public:
    smooth_filler(const photo_layers& layers, std::vector<farbrausch_level>& levels, int growth, Executor& threads)
        : colours_(layers.column<colour_column>()),
          known_(layers.column<known_column>()),
          levels_(levels),
          growth_(growth),
          threads_(threads) {
        for (std::size_t v = 0; v < unit_.size(); ++v) unit_[v] = static_cast<float>(v) / 255.0F;
    }

    smooth_fills run() {
        const std::size_t depth = levels_.size() - 1;
        std::vector<masked_colours> known(depth + 1);  // of level 0 it is the photo itself
        for (std::size_t i = 0; i < depth; ++i) {
            known[i + 1] = masked_colours(levels_[i + 1].pixel_count);
            const auto store = [&](std::int32_t output, masked_colour c) { known[i + 1].set(output, c); };
            if (i == 0)
                average_windows(
                    levels_[i].average_coarse, threads_, [&](std::int32_t p) { return photo(p); }, store);
            else
                average_windows(
                    levels_[i].average_coarse, threads_, [&](std::int32_t p) { return known[i][p]; }, store);
        }
        masked_colours fill = known[depth];
        spread(fill, levels_[depth].average, known[depth], growth_);
        masked_colours tone = fill;
        for (std::size_t i = depth - 1; i > 0; --i) {
            fill = from_above(fill, levels_[i].above, known[i]);
            spread(fill, levels_[i].average, known[i], 2 << i);
            tone = average_from_above(tone, i, known[i]);
            known[i] = {};
        }
        return finest(fill, tone);
    }

private:
    masked_colour photo(std::int32_t pixel) const {
        const std::size_t p = static_cast<std::size_t>(pixel);
        if (known_[p] == 0) return masked_colour{};
        return masked_colour{unit_[colours_[3 * p]], unit_[colours_[3 * p + 1]], unit_[colours_[3 * p + 2]], 1.0F};
    }

    /// What is known, and elsewhere the colour above.
    masked_colours from_above(const masked_colours& coarse, const std::vector<std::int32_t>& above,
                              const masked_colours& known) const {
        masked_colours result = known;
        parallel_for(threads_, above.size(), 4096, [&](std::size_t first, std::size_t last) {
            for (std::size_t i = first; i < last; ++i)
                if (const std::int32_t p = static_cast<std::int32_t>(i); !known.has(p) && above[i] != no_pixel)
                    result.set(p, coarse[above[i]]);
        });
        return result;
    }

    /// Averages what is not known, `passes` times.
    void spread(masked_colours& colours, const convolution_plan& windows, const masked_colours& known, int passes) {
        std::vector<std::int32_t> unknown;
        for (std::size_t i = 0; i < known.size(); ++i)
            if (!known.has(static_cast<std::int32_t>(i))) unknown.push_back(static_cast<std::int32_t>(i));
        spread_at(colours, restrict_to(windows, unknown), passes);
    }

    void spread_at(masked_colours& colours, const convolution_plan& unknown, int passes) {
        masked_colours next = colours;
        for (int pass = 0; pass < passes; ++pass) {
            average_windows(
                unknown, threads_, [&](std::int32_t p) { return colours[p]; },
                [&](std::int32_t output, masked_colour c) { next.set(output, c); });
            std::swap(colours, next);
        }
    }

    /// The colour above where there is one, else what is known; averaged once.
    masked_colours average_from_above(const masked_colours& coarse, std::size_t level, const masked_colours& known) {
        const std::vector<std::int32_t>& above = levels_[level].above;
        masked_colours result(levels_[level].pixel_count);
        average_windows(
            levels_[level].average, threads_,
            [&](std::int32_t p) { return above_or(coarse, above, p, [&] { return known[p]; }); },
            [&](std::int32_t output, masked_colour c) { result.set(output, c); });
        return result;
    }

    template <class Else>
    static masked_colour above_or(const masked_colours& coarse, const std::vector<std::int32_t>& above, std::int32_t pixel,
                                  Else&& otherwise) {
        const std::int32_t from = above[static_cast<std::size_t>(pixel)];
        if (from != no_pixel) {
            const masked_colour colour = coarse[from];
            if (colour[3] != 0.0F) return colour;
        }
        return otherwise();
    }

    /// Level 0, at the pixels that the network reads.
    smooth_fills finest(const masked_colours& fill_above, const masked_colours& tone_above) {
        const farbrausch_level& level = levels_[0];
        const pixel_subset& read = level.read;
        masked_colours fill(read.size());
        std::vector<std::int32_t> unknown;
        for (std::size_t row = 0; row < read.size(); ++row) {
            const std::int32_t pixel = read.pixels[row], above = level.above[static_cast<std::size_t>(pixel)];
            if (known_[static_cast<std::size_t>(pixel)] != 0)
                fill.set(static_cast<std::int32_t>(row), photo(pixel));
            else if (unknown.push_back(pixel); above != no_pixel)
                fill.set(static_cast<std::int32_t>(row), fill_above[above]);
        }
        spread_at(fill, on_subsets(restrict_to(level.average, unknown), read, read), 2);

        smooth_fills result;
        result.fill.resize(3 * level.decoded.size());
        for (std::size_t d = 0; d < level.decoded.size(); ++d) {
            const std::int32_t row = read.row_of[static_cast<std::size_t>(level.decoded.pixels[d])];
            const masked_colour colour = fill.has(row) ? fill[row] : mean();
            for (std::size_t c = 0; c < 3; ++c) result.fill[3 * d + c] = colour[c];
        }
        average_windows(
            restrict_to(level.average, read.pixels), threads_,
            [&](std::int32_t p) { return above_or(tone_above, level.above, p, [&] { return photo(p); }); },
            [&](std::int32_t pixel, masked_colour tone) {
                const std::int32_t row = read.row_of[static_cast<std::size_t>(pixel)];
                masked_colour relative = (fill.has(row) ? fill[row] : mean()) - (tone[3] != 0.0F ? tone : mean());
                relative[3] = known_[static_cast<std::size_t>(pixel)] != 0 ? 1.0F : 0.0F;
                fill.set(row, relative);
            });
        result.input = std::move(fill);
        return result;
    }

    /// The average of all known colours: few surfaces are so far from any that they need it.
    masked_colour mean() {
        std::call_once(mean_is_known_, [&] {
            std::array<std::uint64_t, 3> sum{};
            std::uint64_t count = 0;
            for (std::size_t p = 0; p < known_.size(); ++p) {
                if (known_[p] == 0) continue;
                ++count;
                for (std::size_t c = 0; c < 3; ++c) sum[c] += colours_[3 * p + c];
            }
            const double scale = 1.0 / (255.0 * static_cast<double>(std::max<std::uint64_t>(count, 1)));
            for (std::size_t c = 0; c < 3; ++c) mean_[c] = static_cast<float>(static_cast<double>(sum[c]) * scale);
        });
        return mean_;
    }

    const std::vector<std::uint8_t>&colours_, &known_;
    std::vector<farbrausch_level>& levels_;
    int growth_;
    Executor& threads_;
    std::array<float, 256> unit_{};
    std::once_flag mean_is_known_;
    masked_colour mean_{};
};

}  // namespace ldi::detail
