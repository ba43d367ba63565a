// The weighted median that turns blurred depth edges into steps (paper, section "Depth Pre-processing"). The filter sorts the
// 5 x 5 samples around a pixel by value. It selects the sample for which the total weight of the smaller values is closest to
// the total weight of the larger values. Weights decrease with the disparity difference from the center. Samples next to an
// edge have zero weight, which forces a decision between the two sides.
//
// Sorting networks process four pixels at once. They sort columns of five samples and merge pairs of columns. Neighboring
// windows share the sorted columns and pairs. For each window, the networks then merge two pairs and a column. A sample's
// weight depends only on its value, so only values are sorted.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/four_floats.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/depth/detail/check_map.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of weighted_median().
struct weighted_median_options {
    /// Standard deviation of the Gaussian weight over the disparity difference from the center, above 0.
    float sigma = 0.2F;
};

namespace detail::median {

using namespace lanes;

inline constexpr std::size_t radius = 2, diameter = 5, samples = 25;
inline constexpr float none = std::numeric_limits<float>::infinity();

inline void sort_two(four_floats& a, four_floats& b) {
    const four_floats low = smaller(a, b);
    b = larger(a, b);
    a = low;
}

// A comparator of a network: moves the smaller value to `low`.
struct comparator {
    unsigned char low, high;
};

// A sorting network. merge() implements Batcher's odd-even merge: it accepts the positions of the elements of two sorted lists,
// appends comparators to the network, and returns the positions in merged order.
template <std::size_t Capacity>
struct network {
    std::array<comparator, Capacity> comparators{};
    std::size_t count = 0;
};

struct positions {
    std::array<unsigned char, samples> at{};
    std::size_t count = 0;
    constexpr void add(unsigned char p) { at[count++] = p; }
};

template <std::size_t Capacity>
constexpr positions merge(network<Capacity>& n, const positions& a, const positions& b) {
    if (a.count == 0) return b;
    if (b.count == 0) return a;
    if (a.count == 1 && b.count == 1) {
        n.comparators[n.count++] = {a.at[0], b.at[0]};
        positions both;
        both.add(a.at[0]), both.add(b.at[0]);
        return both;
    }
    positions a_even, a_odd, b_even, b_odd;
    for (std::size_t i = 0; i < a.count; ++i) (i % 2 == 0 ? a_even : a_odd).add(a.at[i]);
    for (std::size_t i = 0; i < b.count; ++i) (i % 2 == 0 ? b_even : b_odd).add(b.at[i]);
    // Merges the even elements of both lists, then the odd elements, then orders neighbors in the interleaved list.
    const positions even = merge(n, a_even, b_even), odd = merge(n, a_odd, b_odd);
    positions merged;
    merged.add(even.at[0]);
    std::size_t i = 1, j = 0;
    while (i < even.count || j < odd.count) {
        if (i < even.count && j < odd.count) n.comparators[n.count++] = {odd.at[j], even.at[i]};
        if (j < odd.count) merged.add(odd.at[j++]);
        if (i < even.count) merged.add(even.at[i++]);
    }
    return merged;
}

constexpr positions range(unsigned char first, unsigned char last) {
    positions p;
    for (unsigned char i = first; i < last; ++i) p.add(i);
    return p;
}

template <std::size_t Capacity>
struct merge_network {
    network<Capacity> steps;
    positions order;  // position of the i-th smallest value after the merge
};

template <std::size_t Capacity>
constexpr merge_network<Capacity> make_merge(unsigned char first_list, unsigned char both_lists) {
    merge_network<Capacity> m;
    m.order = merge(m.steps, range(0, first_list), range(first_list, both_lists));
    return m;
}

inline constexpr merge_network<16> merge_columns = make_merge<16>(5, 10);
inline constexpr merge_network<48> merge_pairs = make_merge<48>(10, 20);
inline constexpr merge_network<64> merge_last = make_merge<64>(20, 25);
inline constexpr std::array<comparator, 9> sort_five = {{{0, 1}, {3, 4}, {2, 4}, {2, 3}, {1, 4}, {0, 3}, {0, 2}, {1, 3}, {1, 2}}};

// Runs a network on registers. The network is known at compile time, so that the compiled code consists only of comparators.
template <const auto& Network, std::size_t... Step>
inline void run(four_floats* values, std::index_sequence<Step...>) {
    (sort_two(values[Network.steps.comparators[Step].low], values[Network.steps.comparators[Step].high]), ...);
}

template <const auto& Network>
inline void run(four_floats* values) {
    run<Network>(values, std::make_index_sequence<Network.steps.count>{});
}

// Intermediate results that neighboring windows of a row share: sorted columns, and sorted pairs of columns.
struct sorted_columns {
    buffer<float> single[diameter], pair[2 * diameter];  // the i-th smallest value at every x

    explicit sorted_columns(std::size_t stride) {
        for (buffer<float>& plane : single) plane.resize(stride + wide);
        for (buffer<float>& plane : pair) plane.resize(stride + wide);
    }

    // Sorts the columns of five rows, then merges each column with the next one.
    //
    // rows    five rows of `stride` samples; a sample is infinite if its weight is zero
    // stride  multiple of `wide`
    void sort(const std::array<const float*, diameter>& rows, std::size_t stride) {
        for (std::size_t x = 0; x < stride; x += wide) {
            four_floats v[diameter];
            for (std::size_t r = 0; r < diameter; ++r) v[r] = load(rows[r] + x);
            for (const comparator& c : sort_five) sort_two(v[c.low], v[c.high]);
            for (std::size_t r = 0; r < diameter; ++r) store(single[r].data() + x, v[r]);
        }
        for (std::size_t x = 0; x + wide < stride; x += wide) {
            four_floats v[2 * diameter];
            for (std::size_t r = 0; r < diameter; ++r) {
                v[r] = load(single[r].data() + x);
                v[diameter + r] = load(single[r].data() + x + 1);
            }
            run<merge_columns>(v);
            for (std::size_t r = 0; r < 2 * diameter; ++r) store(pair[r].data() + x, v[merge_columns.order.at[r]]);
        }
    }

    // Filters the four pixels whose windows start at columns x to x + 3.
    //
    // If all 25 samples have a weight above 1 - 2/26, the middle sample is the best balanced one: the sums of the 12 weights on
    // either side differ by less than 24/26. For every other sample, the sums differ by more. The weighted median then equals
    // the plain median.
    four_floats filter(std::size_t x, four_floats center, float sigma) const noexcept {
        const four_floats low =
            smaller(smaller(load(pair[0].data() + x), load(pair[0].data() + x + 2)), load(single[0].data() + x + 4));
        const four_floats high =
            larger(larger(load(pair[9].data() + x), load(pair[9].data() + x + 2)), load(single[4].data() + x + 4));
        const auto alike = (high - center < 0.39F * sigma) & (center - low < 0.39F * sigma);  // all weights above 0.926
        return all_of(alike) ? merge_and_take_middle(x) : merge_and_weigh(x, center, sigma);
    }

private:
    void merge(std::size_t x, four_floats* all) const {
        four_floats v[samples];
        for (std::size_t r = 0; r < 2 * diameter; ++r) {
            v[r] = load(pair[r].data() + x);
            v[2 * diameter + r] = load(pair[r].data() + x + 2);
        }
        run<merge_pairs>(v);
        for (std::size_t r = 0; r < 4 * diameter; ++r) all[r] = v[merge_pairs.order.at[r]];
        for (std::size_t r = 0; r < diameter; ++r) all[4 * diameter + r] = load(single[r].data() + x + 4);
        run<merge_last>(all);
    }

    four_floats merge_and_take_middle(std::size_t x) const noexcept {
        four_floats all[samples];
        merge(x, all);
        return all[merge_last.order.at[samples / 2]];
    }

    four_floats merge_and_weigh(std::size_t x, four_floats center, float sigma) const noexcept {
        four_floats all[samples];
        merge(x, all);
        // Gaussian weights of the sorted samples: exp(-x) as (1 - x/32 + x^2/2048)^32, with an error of at most 0.0003.
        const float falloff = 1.0F / (64.0F * sigma * sigma);
        const four_floats zero = {}, one = zero + 1.0F;
        four_floats weight[samples], total = zero;
        for (std::size_t s = 0; s < samples; ++s) {
            const four_floats difference = all[merge_last.order.at[s]] - center;
            const four_floats t = falloff * difference * difference;
            four_floats w = one - t + 0.5F * t * t;
            w *= w, w *= w, w *= w, w *= w, w *= w;
            weight[s] = select(t < one, w, zero);  // weights beyond this are below 1e-13
            total += weight[s];
        }
        four_floats preceding = zero, best = zero + none, result = center;
        for (std::size_t s = 0; s < samples; ++s) {
            const four_floats difference = preceding + preceding + weight[s] - total;
            const four_floats imbalance = select(difference < zero, -difference, difference);
            const auto better = (weight[s] > zero) & (imbalance < best);
            best = select(better, imbalance, best);
            result = select(better, all[merge_last.order.at[s]], result);
            preceding += weight[s];
        }
        return result;
    }
};

}  // namespace detail::median

/// Applies the weighted median. Returns H x W x 1.
///
/// disparity  H x W x 1, finite
/// surface    rule that decides whether neighboring samples belong to one surface
///
/// Samples next to another surface (left, right, above or below), and samples outside the image, have zero weight. A pixel keeps
/// its value if all weights are zero. Raises mismatch for another number of channels, invalid_data for values that are not
/// finite, invalid_option if sigma is not above 0. Linear time; 9 bytes per pixel.
template <executor Executor = const serial_executor>
image<float> weighted_median(image_view<const float> disparity, surface_rule surface = {},
                             const weighted_median_options& options = {}, Executor&& threads = {}) {
    using namespace detail::median;
    detail::check_map(disparity, "weighted_median");
    detail::check_finite(disparity, "weighted_median");
    if (!(options.sigma > 0.0F))
        raise(error_code::invalid_option, "weighted_median_options::sigma", "above 0", detail::to_text(options.sigma));
    const std::size_t rows = disparity.height(), columns = disparity.width();
    image<float> result(rows, columns, 1, unset);
    if (rows == 0 || columns == 0) return result;

    // Pads the samples for the windows. Padding and samples next to an edge are `none`, which has no weight.
    const std::size_t stride = (columns + 2 * radius + 2 * wide - 1) / wide * wide;
    buffer<float> seen((rows + 2 * radius) * stride, none);
    const float threshold = surface.max_step;
    parallel_for(threads, rows, 16, [&](std::size_t first, std::size_t last) {
        for (std::size_t y = first; y < last; ++y) {
            const float* here = disparity.row(y);
            const float* above = y > 0 ? disparity.row(y - 1) : here;
            const float* below = y + 1 < rows ? disparity.row(y + 1) : here;
            float* out = seen.data() + (y + radius) * stride + radius;
            const auto sample = [&](std::size_t x, float left, float right) {
                const float v = here[x];
                const float vertical = (std::max)(std::abs(v - above[x]), std::abs(v - below[x]));
                const float horizontal = (std::max)(std::abs(v - left), std::abs(v - right));
                out[x] = (std::max)(vertical, horizontal) > threshold ? none : v;
            };
            sample(0, here[0], here[columns > 1 ? 1 : 0]);
            for (std::size_t x = 1; x + 1 < columns; ++x) sample(x, here[x - 1], here[x + 1]);
            if (columns > 1) sample(columns - 1, here[columns - 2], here[columns - 1]);
        }
    });

    parallel_for(threads, rows, 8, [&](std::size_t first, std::size_t last) {
        sorted_columns sorted(stride);
        for (std::size_t y = first; y < last; ++y) {
            std::array<const float*, diameter> window;
            for (std::size_t r = 0; r < diameter; ++r) window[r] = seen.data() + (y + r) * stride;
            sorted.sort(window, stride);
            const float* center = disparity.row(y);
            float* out = result.row(y);
            std::size_t x = 0;
            for (; x + wide <= columns; x += wide) store(out + x, sorted.filter(x, load(center + x), options.sigma));
            if (x < columns) {
                float rest[wide] = {};
                std::copy_n(center + x, columns - x, rest);
                store(rest, sorted.filter(x, load(rest), options.sigma));
                std::copy_n(rest, columns - x, out + x);
            }
        }
    });
    return result;
}

}}  // namespace ldi
