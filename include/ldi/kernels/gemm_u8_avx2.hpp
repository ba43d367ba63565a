// kernels/gemm_u8.hpp with vpmaddubsw, which adds two products of a byte and a signed byte in 16 bits, and vpmaddwd, which adds
// two of these sums to each of 8 sums of 32 bits.
//
// The 16-bit sums saturate; detail/unsaturated_pairs.hpp says for which weights they can't. Most weights are so small that the
// products of two groups of four inputs may meet in one 16-bit sum before it is widened: 5 instructions for 64 products. Which
// groups go together, and which weights have to be split over two, is found when weights are packed, for each panel of 16
// outputs. (vpmaddwd on inputs of 16 bits, which never saturates, takes 8.)
#pragma once

#include <ldi/base/memory.hpp>
#include <ldi/base/stable_sort.hpp>
#include <ldi/kernels/detail/gemm_u8_weights.hpp>
#include <ldi/kernels/detail/lanes_avx2.hpp>
#include <ldi/kernels/detail/unsaturated_pairs.hpp>

#if LDI_HAS_X86_KERNELS

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <utility>

namespace ldi::avx2 {

inline constexpr std::size_t gemm_lanes = 8, gemm_most_vectors = 2, gemm_group = 4;

/// A single output would use one lane of 8: its weights lie as the inputs do, segment by segment in whole vectors.
inline void pack_single_output(gemm_u8_weights& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    const int sign = detail::is_negated(packed.fast) ? -1 : 1;
    const std::size_t padded = (packed.inputs + 15) / 16 * 16;
    for (std::size_t s = 0; s < packed.segments; ++s)
        for (std::size_t i = 0; i < padded; ++i)
            packed.wide.push_back(static_cast<std::int16_t>(
                i < packed.inputs ? sign * (weights[s * packed.inputs + i] - int{weight_zero_point}) : 0));
}

/// Weights of four inputs for the outputs of a panel, none of which can saturate a sum; several make up one group's.
struct gemm_term {
    static constexpr std::size_t most_weights = gemm_most_vectors * gemm_lanes * gemm_group;

    std::uint32_t first_input = 0;
    int heaviest = 0;                        ///< of `load`
    std::int8_t weights[most_weights] = {};  ///< outputs x 4
    std::uint8_t load[most_weights] = {};    ///< half of what meets in each 16-bit sum: outputs x 2 x (positive, negative)

    /// Whether no sum could saturate if the products of both met in it, eight of them at a time.
    bool fits(const gemm_term& other) const {
        constexpr std::uint64_t most = 64, each = 0x0101010101010101;
        for (std::size_t i = 0; i < most_weights; i += 8) {
            std::uint64_t a = 0, b = 0;
            std::memcpy(&a, load + i, 8), std::memcpy(&b, other.load + i, 8);
            if (((a + b + (127 - most) * each) & (128 * each)) != 0) return false;
        }
        return true;
    }
};

/// Splits `rest`, the weights of one group, outputs x 4.
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

/// The terms in an order in which those that may share their sums are side by side, and how many such pairs it begins with.
struct paired_terms {
    buffer<const gemm_term*> order;
    std::size_t pairs = 0;

    explicit paired_terms(const buffer<gemm_term>& terms) {
        buffer<const gemm_term*> rest, singles;  // the lightest last
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
            rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(partner));
        }
        pairs = order.size() / 2;
        order.insert(order.end(), singles.begin(), singles.end());
    }

private:
    /// `i` if there is none among the lightest, which are the likeliest.
    static std::size_t find_partner(const buffer<const gemm_term*>& rest, std::size_t i) {
        constexpr std::size_t tries = 8;
        for (std::size_t t = 0; t < tries && rest.size() - 1 - t > i; ++t)
            if (rest[i]->fits(*rest[rest.size() - 1 - t])) return rest.size() - 1 - t;
        return i;
    }
};

/// Panel by panel, segment by segment: in `order` the number of pairs of terms and of single terms and the first input of each;
/// in `narrow` vectors of 8 outputs x 4 inputs, all of one term, then all of the next.
inline void pack_gemm_u8(gemm_u8_weights& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    if (packed.is_single_output()) return pack_single_output(packed, weights, weight_zero_point);
    const detail::panel_cut cut(packed.outputs, gemm_lanes, gemm_most_vectors);
    const int sign = detail::is_negated(packed.fast) ? -1 : 1;
    buffer<gemm_term> terms;
    std::size_t first = 0;
    for (std::size_t panel = 0; panel < cut.panels; ++panel) {
        const std::size_t outputs = cut.vectors_in(panel) * gemm_lanes;
        for (std::size_t s = 0; s < packed.segments; ++s) {
            terms.clear();
            for (std::size_t g = 0; g < packed.inputs; g += gemm_group) {
                int group[gemm_term::most_weights] = {};
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

LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)

/// What one call of gemm_u8() does for one panel.
struct gemm_panel {
    const std::uint8_t* const* segments;
    std::size_t segment_count, pixel_stride, pixels;
    const std::uint32_t* order;
    const std::int8_t* weights;
    const std::int32_t* bias;
    std::uint8_t* result;
    std::size_t outputs, held;  ///< from one pixel's results to the next; of the panel
};

[[gnu::always_inline]] inline __m256i spread_four(const std::uint8_t* inputs) {
    std::int32_t four = 0;
    std::memcpy(&four, inputs, sizeof four);
    return _mm256_set1_epi32(four);
}

[[gnu::always_inline]] inline __m256i widen(__m256i sum, __m256i products) {
    return _mm256_add_epi32(sum, _mm256_madd_epi16(products, _mm256_set1_epi16(1)));
}

template <std::size_t... v>
[[gnu::always_inline]] inline void add_term(std::index_sequence<v...>, __m256i* sums, __m256i inputs, const __m256i* weights) {
    ((sums[v] = widen(sums[v], _mm256_maddubs_epi16(inputs, weights[v]))), ...);
}

template <std::size_t... v>
[[gnu::always_inline]] inline void add_pair(std::index_sequence<v...>, __m256i* sums, __m256i a, __m256i b,
                                            const __m256i* a_weights, const __m256i* b_weights) {
    ((sums[v] = widen(sums[v], _mm256_add_epi16(_mm256_maddubs_epi16(a, a_weights[v]), _mm256_maddubs_epi16(b, b_weights[v])))),
     ...);
}

template <std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void add_term(std::index_sequence<p...>, std::index_sequence<v...> vectors, __m256i* sums,
                                            const std::uint8_t* x, std::size_t stride, const __m256i* weights) {
    const __m256i w[] = {_mm256_load_si256(weights + v)...};
    (add_term(vectors, sums + p * sizeof...(v), spread_four(x + p * stride), w), ...);
}

template <std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void add_pair(std::index_sequence<p...>, std::index_sequence<v...> vectors, __m256i* sums,
                                            const std::uint8_t* a, const std::uint8_t* b, std::size_t stride,
                                            const __m256i* weights) {
    const __m256i a_weights[] = {_mm256_load_si256(weights + v)...};
    const __m256i b_weights[] = {_mm256_load_si256(weights + sizeof...(v) + v)...};
    (add_pair(vectors, sums + p * sizeof...(v), spread_four(a + p * stride), spread_four(b + p * stride), a_weights, b_weights),
     ...);
}

template <std::size_t... v>
[[gnu::always_inline]] inline void copy(std::index_sequence<v...>, __m256i* to, const __m256i* from) {
    ((to[v] = from[v]), ...);
}

/// The results of 32 / outputs pixels, of 8 or 16 outputs each.
template <std::size_t vectors, class Requantizer>
[[gnu::always_inline]] inline void store_four(const __m256i* sums, const Requantizer& requantize, std::uint8_t* result,
                                              std::size_t outputs) {
    const __m256i bytes =
        gather_lanes(requantize.pack_lanes(requantize(sums[0]), requantize(sums[1]), requantize(sums[2]), requantize(sums[3])));
    const __m128i low = _mm256_castsi256_si128(bytes), high = _mm256_extracti128_si256(bytes, 1);
    if constexpr (vectors == 2) {
        _mm_storeu_si128(reinterpret_cast<__m128i*>(result), low);
        _mm_storeu_si128(reinterpret_cast<__m128i*>(result + outputs), high);
    } else {
        _mm_storel_epi64(reinterpret_cast<__m128i*>(result), low);
        _mm_storel_epi64(reinterpret_cast<__m128i*>(result + outputs), _mm_unpackhi_epi64(low, low));
        _mm_storel_epi64(reinterpret_cast<__m128i*>(result + 2 * outputs), high);
        _mm_storel_epi64(reinterpret_cast<__m128i*>(result + 3 * outputs), _mm_unpackhi_epi64(high, high));
    }
}

template <std::size_t vectors, class Requantizer>
[[gnu::always_inline]] inline void store_pixel(const __m256i* sums, const Requantizer& requantize, std::uint8_t* result,
                                               std::size_t held) {
    const __m256i a = requantize(sums[0]), b = vectors > 1 ? requantize(sums[vectors - 1]) : a;
    store_first(result, gather_lanes(requantize.pack_lanes(a, b, a, b)), held);
}

template <std::size_t vectors, class Requantizer, std::size_t... i>
[[gnu::always_inline]] inline void store_filled(std::index_sequence<i...>, const __m256i* sums, const Requantizer& requantize,
                                                std::uint8_t* result, std::size_t outputs) {
    (store_four<vectors>(sums + 4 * i, requantize, result + 4 / vectors * i * outputs, outputs), ...);
}

template <class Requantizer, std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void gemm_u8_tile(std::index_sequence<p...> pixels, std::index_sequence<v...> vectors,
                                                const gemm_panel& panel, const Requantizer& requantize, std::size_t first) {
    __m256i sums[sizeof...(p) * sizeof...(v)];
    const __m256i start[] = {_mm256_loadu_si256(reinterpret_cast<const __m256i*>(panel.bias + v * gemm_lanes))...};
    (copy(vectors, sums + p * sizeof...(v), start), ...);
    const __m256i* weights = reinterpret_cast<const __m256i*>(panel.weights);
    const std::uint32_t* order = panel.order;
    const std::size_t stride = panel.pixel_stride;
    for (std::size_t s = 0; s < panel.segment_count; ++s) {
        const std::uint8_t* const x = panel.segments[s] + first * stride;
        const std::uint32_t *const singles = order + 2 + 2 * order[0], *const end = singles + order[1];
        for (order += 2; order != singles; order += 2, weights += 2 * sizeof...(v))
            add_pair(pixels, vectors, sums, x + order[0], x + order[1], stride, weights);
        for (; order != end; ++order, weights += sizeof...(v)) add_term(pixels, vectors, sums, x + *order, stride, weights);
    }
    constexpr std::size_t count = sizeof...(p) * sizeof...(v);
    std::uint8_t* const result = panel.result + first * panel.outputs;
    if constexpr (count % 4 == 0)
        if (panel.held == sizeof...(v) * gemm_lanes)
            return store_filled<sizeof...(v)>(std::make_index_sequence<count / 4>{}, sums, requantize, result, panel.outputs);
    (store_pixel<sizeof...(v)>(sums + p * sizeof...(v), requantize, result + p * panel.outputs, panel.held), ...);
}

template <std::size_t pixels, std::size_t vectors, class Requantizer>
inline void gemm_u8_panel(const gemm_panel& given, const float_requantization& output) {
    const gemm_panel panel = given;  // no other memory can be what the results are written to
    const Requantizer requantize(output);
    constexpr std::make_index_sequence<vectors> wide{};
    if (panel.pixels < pixels) {
        for (std::size_t p = 0; p < panel.pixels; ++p) gemm_u8_tile(std::index_sequence<0>{}, wide, panel, requantize, p);
        return;
    }
    for (std::size_t p = 0; p < panel.pixels; p += pixels) {  // the last tile may overlap the one before
        const std::size_t first = p + pixels <= panel.pixels ? p : panel.pixels - pixels;
        gemm_u8_tile(std::make_index_sequence<pixels>{}, wide, panel, requantize, first);
    }
}

template <std::size_t pixels, std::size_t vectors>
inline void gemm_u8_panel(const gemm_panel& panel, const float_requantization& output) {
    output.zero_point == 0 ? gemm_u8_panel<pixels, vectors, rectifier>(panel, output)
                           : gemm_u8_panel<pixels, vectors, requantizer>(panel, output);
}

/// The sum of one pixel and one output.
[[gnu::always_inline]] inline std::int32_t single_output_sum(const gemm_u8_weights& weights, const std::uint8_t* const* segments,
                                                             std::size_t offset) {
    __m256i sums = _mm256_setzero_si256();
    const std::int16_t* w = weights.wide.data();
    for (std::size_t s = 0; s < weights.segments; ++s) {
        const std::uint8_t* const x = segments[s] + offset;
        std::size_t i = 0;
        for (; i + 16 <= weights.inputs; i += 16, w += 16) {
            const __m256i inputs = _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(x + i)));
            sums = _mm256_add_epi32(sums, _mm256_madd_epi16(inputs, _mm256_load_si256(reinterpret_cast<const __m256i*>(w))));
        }
        if (i == weights.inputs) continue;
        alignas(16) std::uint8_t rest[16] = {};
        std::memcpy(rest, x + i, weights.inputs - i);
        const __m256i inputs = _mm256_cvtepu8_epi16(_mm_load_si128(reinterpret_cast<const __m128i*>(rest)));
        sums = _mm256_add_epi32(sums, _mm256_madd_epi16(inputs, _mm256_load_si256(reinterpret_cast<const __m256i*>(w))));
        w += 16;
    }
    const __m128i half = _mm_add_epi32(_mm256_castsi256_si128(sums), _mm256_extracti128_si256(sums, 1));
    const __m128i pair = _mm_add_epi32(half, _mm_shuffle_epi32(half, 0x4E));
    return _mm_cvtsi128_si32(_mm_add_epi32(pair, _mm_shuffle_epi32(pair, 0xB1)));
}

inline void gemm_u8_single_output(const gemm_u8_weights& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                                  std::size_t pixels, std::uint8_t* result) {
    const requantizer requantize(weights.fast);
    for (std::size_t first = 0; first < pixels; first += gemm_lanes) {
        alignas(32) std::int32_t sums[gemm_lanes] = {};
        const std::size_t count = pixels - first < gemm_lanes ? pixels - first : gemm_lanes;
        for (std::size_t p = 0; p < count; ++p)
            sums[p] = weights.bias[0] + single_output_sum(weights, segments, (first + p) * pixel_stride);
        const __m256i values = requantize(_mm256_load_si256(reinterpret_cast<const __m256i*>(sums)));
        store_first(result + first, gather_lanes(requantize.pack_lanes(values, values, values, values)), count);
    }
}

inline void gemm_u8(const gemm_u8_weights& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                    std::size_t pixels, std::uint8_t* result) {
    if (weights.is_single_output()) return gemm_u8_single_output(weights, segments, pixel_stride, pixels, result);
    const detail::panel_cut cut(weights.outputs, gemm_lanes, gemm_most_vectors);
    gemm_panel panel{segments,
                     weights.segments,
                     pixel_stride,
                     pixels,
                     weights.order.data(),
                     weights.narrow.data(),
                     weights.bias.data(),
                     result,
                     weights.outputs,
                     0};
    std::size_t rest = weights.outputs;
    for (std::size_t i = 0; i < cut.panels; ++i) {
        const std::size_t vectors = cut.vectors_in(i), lanes = vectors * gemm_lanes;
        panel.held = rest < lanes ? rest : lanes;
        if (vectors == 1)
            gemm_u8_panel<8, 1>(panel, weights.fast);
        else
            gemm_u8_panel<4, 2>(panel, weights.fast);
        rest -= panel.held;
        panel.bias += lanes;
        panel.result += panel.held;
        for (std::size_t s = 0; s < weights.segments; ++s) {
            const std::size_t terms = 2 * panel.order[0] + panel.order[1];
            panel.order += 2 + terms;
            panel.weights += terms * lanes * gemm_group;
        }
    }
}

LDI_END_TARGET

}  // namespace ldi::avx2

#endif
