// Splits weights so that vpmaddubsw multiplies them exactly. The instruction adds two products of a byte and a signed byte in
// 16 bits. The sum can saturate: 255 * 127 * 2 does not fit. The sum is exact for all inputs if its positive weights add up to
// at most 128, and its negative weights to at least -128. Few weights of a trained network exceed these limits. The kernel
// multiplies the excess in a separate sum.
#pragma once

#include <ldi/base/config.hpp>

#include <algorithm>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx2 {

/// Remaining capacity of one 16-bit sum: maximum and minimum of the weights that still fit.
struct sum_room {
    int max = 128, min = -128;

    /// Subtracts the largest part of `rest` that fits, and returns this part.
    std::int8_t take(int& rest) {
        const int part = std::clamp(rest, (std::max)(min, -128), (std::min)(max, 127));
        max -= (std::max)(part, 0);
        min -= (std::min)(part, 0);
        rest -= part;
        return static_cast<std::int8_t>(part);
    }
};

/// Whether both weights are signed bytes and the sum of their products with any two bytes fits in 16 bits. Signed bytes of
/// opposite signs always satisfy this.
inline bool fit_one_sum(int a, int b) { return a >= -128 && a <= 127 && b >= -128 && b <= 127 && a + b >= -128 && a + b <= 128; }

}}}  // namespace ldi::avx2
