// Packs weights for gemm_u8/avx2.hpp.
//
// 16-bit sums cannot saturate if the weights are small enough (detail/unsaturated_pairs.hpp). Most weights are so small that
// two groups of four inputs can share their 16-bit sums, which are then widened together. For each panel of up to 16 outputs,
// the code below finds groups that can share sums. It splits weights that are too large into several terms.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/stable_sort.hpp>
#include <ldi/kernels/detail/unsaturated_pairs.hpp>
#include <ldi/kernels/gemm_u8/contract.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx2 {

inline constexpr std::size_t gemm_lanes = 8, gemm_max_vectors = 2, gemm_tile_pixels[] = {8, 4};
using detail::gemm_group;

/// A term of a group. A group has the weights of four inputs for all outputs of a panel, and is the sum of one or more terms. The
/// weights of a term are so small that they cannot saturate a 16-bit sum.
struct gemm_term {
    static constexpr std::size_t max_weights = gemm_max_vectors * gemm_lanes * gemm_group;

    std::uint32_t first_input = 0;
    int heaviest = 0;                       ///< maximum of `load`
    std::int8_t weights[max_weights] = {};  ///< outputs x 4
    /// Two loads per 16-bit sum: the total of its positive weights and the absolute total of its negative weights, both halved
    /// and rounded up. Shape: outputs x 2 sums x 2 loads.
    std::uint8_t load[max_weights] = {};

    /// Whether the products of both terms can share their 16-bit sums. Compares eight bytes at a time.
    bool fits(const gemm_term& other) const {
        constexpr std::uint64_t max_load = 64, each = 0x0101010101010101;
        for (std::size_t i = 0; i < max_weights; i += 8) {
            std::uint64_t a = 0, b = 0;
            std::memcpy(&a, load + i, 8), std::memcpy(&b, other.load + i, 8);
            if (((a + b + (127 - max_load) * each) & (128 * each)) != 0) return false;
        }
        return true;
    }
};

/// Splits the weights of one group into terms.
///
/// rest  weights that are not yet part of a term, outputs x 4; all 0 on return
inline void split_group(std::span<int> rest, std::size_t first_input, buffer<gemm_term>& terms) {
    bool is_empty = false;
    while (!is_empty) {
        gemm_term& term = terms.emplace_back();
        term.first_input = static_cast<std::uint32_t>(first_input);
        is_empty = true;
        for (std::size_t i = 0; i < rest.size(); i += 2) {
            int a = rest[i], b = rest[i + 1];
            if (!fit_one_sum(a, b)) {
                sum_room room;
                a = room.take(rest[i]), b = room.take(rest[i + 1]);
                is_empty = false;
            } else {
                rest[i] = rest[i + 1] = 0;
            }
            const int positive = ((std::max)(a, 0) + (std::max)(b, 0) + 1) / 2;
            const int negative = (1 - (std::min)(a, 0) - (std::min)(b, 0)) / 2;
            term.weights[i] = static_cast<std::int8_t>(a), term.weights[i + 1] = static_cast<std::int8_t>(b);
            term.load[i] = static_cast<std::uint8_t>(positive), term.load[i + 1] = static_cast<std::uint8_t>(negative);
            term.heaviest = (std::max)(term.heaviest, (std::max)(positive, negative));
        }
    }
}

/// Terms in the order in which the kernel reads them: first pairs of terms that share their 16-bit sums, then single terms.
struct paired_terms {
    buffer<const gemm_term*> order;
    std::size_t pairs = 0;

    explicit paired_terms(const buffer<gemm_term>& terms) {
        buffer<const gemm_term*> rest, singles;  // sorted by descending `heaviest`
        for (const gemm_term& term : terms) rest.push_back(&term);
        stable_sort(rest, [](const gemm_term* a, const gemm_term* b) { return a->heaviest > b->heaviest; });
        for (std::size_t i = 0; i < rest.size(); ++i) {
            const std::size_t partner = find_partner(rest, i);
            if (partner == i) {
                singles.push_back(rest[i]);
                continue;
            }
            order.push_back(rest[i]);
            order.push_back(rest[partner]);
            rest.erase(rest.begin() + partner);
        }
        pairs = order.size() / 2;
        order.insert(order.end(), singles.begin(), singles.end());
    }

private:
    /// Searches the terms with the lowest `heaviest`, which are most likely to fit. Returns `i` if no term fits.
    static std::size_t find_partner(const buffer<const gemm_term*>& rest, std::size_t i) {
        constexpr std::size_t tries = 8;
        for (std::size_t t = 0; t < tries && rest.size() - 1 - t > i; ++t)
            if (rest[i]->fits(*rest[rest.size() - 1 - t])) return rest.size() - 1 - t;
        return i;
    }
};

/// Packs weights panel by panel, segment by segment. Appends to `order` the number of pairs of terms, the number of single
/// terms, and the first input of each term. Appends to `narrow` vectors of 8 outputs x 4 inputs, term by term.
inline void pack_gemm_u8(gemm_u8_data& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    const int sign = detail::is_negated(packed.fast) ? -1 : 1;
    if (packed.is_single_output())
        return detail::append_weights(packed.wide, packed, weights, weight_zero_point, sign, detail::single_output_layout(16));
    const detail::panel_cut cut(packed.outputs, gemm_lanes, gemm_max_vectors);
    buffer<gemm_term> terms;
    std::size_t first = 0;
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t outputs = cut.vectors_in(panel) * gemm_lanes;
        for (std::size_t s = 0; s < packed.segments; ++s) {
            terms.clear();
            for (std::size_t g = 0; g < packed.inputs; g += gemm_group) {
                int group[gemm_term::max_weights] = {};
                for (std::size_t o = first; o < first + outputs && o < packed.outputs; ++o)
                    for (std::size_t i = g; i < g + gemm_group && i < packed.inputs; ++i)
                        group[(o - first) * gemm_group + i - g] =
                            sign * (weights[(o * packed.segments + s) * packed.inputs + i] - int{weight_zero_point});
                split_group({group, outputs * gemm_group}, g, terms);
            }
            const paired_terms paired(terms);
            packed.order.push_back(static_cast<std::uint32_t>(paired.pairs));
            packed.order.push_back(static_cast<std::uint32_t>(terms.size() - 2 * paired.pairs));
            for (const gemm_term* term : paired.order) {
                packed.order.push_back(term->first_input);
                packed.narrow.insert(packed.narrow.end(), term->weights, term->weights + outputs * gemm_group);
            }
        }
        first += outputs;
    }
}

}}}  // namespace ldi::avx2
