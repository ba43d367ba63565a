// Weights that vpmaddubsw can be given. It adds two products of a byte and a signed byte in 16 bits and saturates: 255 * 127 * 2
// is too much. Products are exact for all inputs if the positive weights that meet in one 16-bit sum add up to at most 128, and
// the negative ones to at least -128. Few weights of a trained network are so large; what does not fit into one sum goes to
// another.
#pragma once

#include <ldi/base/config.hpp>

#include <algorithm>
#include <cstdint>

namespace ldi::inline LDI_CONFIGURATION::avx2 {

/// What weights may still be added to one 16-bit sum.
struct sum_room {
    int most = 128, least = -128;

    /// Takes as much of `rest` as fits.
    std::int8_t take(int& rest) {
        const int part = std::clamp(rest, (std::max)(least, -128), (std::min)(most, 127));
        most -= (std::max)(part, 0);
        least -= (std::min)(part, 0);
        rest -= part;
        return static_cast<std::int8_t>(part);
    }
};

/// Whether these weights are signed bytes that may meet in one 16-bit sum. (Of different signs, they always may.)
inline bool fit_one_sum(int a, int b) { return a >= -128 && a <= 127 && b >= -128 && b <= 127 && a + b >= -128 && a + b <= 128; }

}  // namespace ldi::avx2
