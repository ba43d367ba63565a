// Packs weights for depthwise_u8/avx2.hpp, split into terms so that no 16-bit sum can saturate (detail/unsaturated_pairs.hpp).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/kernels/depthwise_u8/contract.hpp>
#include <ldi/kernels/depthwise_u8/stretches.hpp>
#include <ldi/kernels/detail/unsaturated_pairs.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx2 {

inline constexpr std::size_t depthwise_max_channels = 32;  ///< maximum per unit

/// Weights of one channel in one column that are not yet assigned to a term.
struct depthwise_rest {
    int rows[3];

    bool is_zero() const { return rows[0] == 0 && rows[1] == 0 && rows[2] == 0; }
    void take(std::int8_t* four) {
        sum_room low, high;
        four[0] = low.take(rows[0]), four[2] = high.take(rows[2]);
        four[1] = low.take(rows[1]), four[3] = high.take(rows[1]);
    }
};

/// Packs weights unit by unit. Appends the number of terms of each unit to `order`. Appends to `narrow`, for each term and each
/// column of the window, 4 vectors of 8 channels x 4 bytes; detail::depthwise_order defines the order of the channels.
inline void pack_depthwise_u8(depthwise_u8_data& packed, const detail::depthwise_source& source) {
    const int sign = detail::is_negated(packed.fast) ? -1 : 1;
    for (std::size_t done = 0; done < packed.channels;) {
        const detail::depthwise_unit unit(packed.channels, done, depthwise_max_channels);
        const detail::depthwise_order<depthwise_max_channels> order(unit);
        buffer<depthwise_rest> rest;
        for (std::size_t column = 0; column < 3; ++column)
            for (std::size_t c : order.channels)
                rest.push_back({{sign * source.weight(c, column), sign * source.weight(c, 3 + column),
                                 sign * source.weight(c, 6 + column)}});
        std::uint32_t terms = 0;
        while (terms == 0 || !std::all_of(rest.begin(), rest.end(), [](const depthwise_rest& r) { return r.is_zero(); })) {
            for (depthwise_rest& weights : rest) {
                std::int8_t four[4];
                weights.take(four);
                packed.narrow.insert(packed.narrow.end(), four, four + 4);
            }
            ++terms;
        }
        packed.order.push_back(terms);
        for (std::size_t c : order.channels) packed.bias.push_back(sign * source.folded_bias(c));
        done = unit.end();
    }
}

}}}  // namespace ldi::avx2
