// Vectors of depthwise_u8: interleaved inputs and sums. Each x86 instruction set includes this file inside its namespace and
// target region, after detail/lanes_*.hpp, with LDI_LANES as in detail/generic/lanes_x86.hpp.

/// Four vectors of 32-bit values.
struct four_vectors {
    int_lanes v[4];
};

/// Interleaves bytes: each 32-bit value of the result contains one byte of a, of b, of c, and of d. Vector i contains bytes 4 i
/// to 4 i + 3 of every 16.
[[gnu::always_inline]] inline four_vectors interleave_bytes(int_lanes a, int_lanes b, int_lanes c, int_lanes d) {
    const int_lanes ab_low = LDI_LANES(unpacklo_epi8)(a, b), ab_high = LDI_LANES(unpackhi_epi8)(a, b);
    const int_lanes cd_low = LDI_LANES(unpacklo_epi8)(c, d), cd_high = LDI_LANES(unpackhi_epi8)(c, d);
    return {{LDI_LANES(unpacklo_epi16)(ab_low, cd_low), LDI_LANES(unpackhi_epi16)(ab_low, cd_low),
             LDI_LANES(unpacklo_epi16)(ab_high, cd_high), LDI_LANES(unpackhi_epi16)(ab_high, cd_high)}};
}

/// Requantizes the sums of a depthwise convolution, and packs them to bytes in the order of the channels.
struct depthwise_results {
    using requantizer_type = requantizer;

    static requantizer requantizer_of(const depthwise_u8_data& weights) { return requantizer(weights.fast); }
    [[gnu::always_inline]] static int_lanes requantized(const requantizer& requantize, const four_vectors& sums) {
        return requantize.pack_lanes(requantize(sums.v[0]), requantize(sums.v[1]), requantize(sums.v[2]), requantize(sums.v[3]));
    }
};
