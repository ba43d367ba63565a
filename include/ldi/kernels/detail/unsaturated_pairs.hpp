// Weights that vpmaddubsw can be given. It adds two products of a byte and a signed byte in 16 bits and saturates: 255 * 127 * 2
// is too much. Products are exact for all inputs if the positive weights that meet in one 16-bit sum add up to at most 128, and
// the negative ones to at least -128. Few weights of a trained network are so large; what does not fit into one sum goes to
// another.
#pragma once

#include <algorithm>
#include <cstdint>

namespace ldi::avx2 {

/// What weights may still be added to one 16-bit sum.
struct sum_room {
    int most = 128, least = -128;

    bool fits(int positive, int negative) const { return positive <= most && negative >= least; }
    void fill(int weight) { (weight > 0 ? most : least) -= weight; }

    /// Takes as much of `rest` as fits.
    std::int8_t take(int& rest) {
        const int part = std::clamp(rest, (std::max)(least, -128), (std::min)(most, 127));
        fill(part);
        rest -= part;
        return static_cast<std::int8_t>(part);
    }
};

}  // namespace ldi::avx2
