// Vectors of 32-bit values, and requantization of 32-bit sums in float. Each x86 instruction set includes this file inside its
// namespace and target region, after these definitions:
//
//     float_lanes, int_lanes         vector types
//     LDI_LANES(operation)           name of the intrinsic function for these vectors
//     load, store, load_bytes        load and store whole vectors; load_bytes() extends each byte to 32 bits
//     add_sign(offset, sign, value)  (value & sign) ^ offset

inline constexpr std::size_t lane_count = sizeof(int_lanes) / sizeof(std::int32_t);

[[gnu::always_inline]] inline float_lanes spread(float value) { return LDI_LANES(set1_ps)(value); }
[[gnu::always_inline]] inline int_lanes spread(std::int32_t value) { return LDI_LANES(set1_epi32)(value); }
[[gnu::always_inline]] inline float_lanes to_float(int_lanes values) { return LDI_LANES(cvtepi32_ps)(values); }
[[gnu::always_inline]] inline int_lanes truncate(float_lanes values) { return LDI_LANES(cvttps_epi32)(values); }
[[gnu::always_inline]] inline int_lanes round(float_lanes values) { return LDI_LANES(cvtps_epi32)(values); }
/// Returns a * b + c, rounded once.
[[gnu::always_inline]] inline float_lanes fused(float_lanes a, float_lanes b, float_lanes c) {
    return LDI_LANES(fmadd_ps)(a, b, c);
}
/// Saturates 32-bit values to 16 bits. Each 128-bit lane of the result contains 4 values of a, then 4 of b.
[[gnu::always_inline]] inline int_lanes pack_words(int_lanes a, int_lanes b) { return LDI_LANES(packs_epi32)(a, b); }
/// Saturates 16-bit values to bytes. Each 128-bit lane of the result contains 8 values of a, then 8 of b.
[[gnu::always_inline]] inline int_lanes pack_bytes(int_lanes a, int_lanes b) { return LDI_LANES(packus_epi16)(a, b); }

/// Applies add_quantized() to vectors of bytes that were extended to 32 bits.
struct integer_addition {
    int_lanes bias, a_multiplier, b_multiplier, zero_point;
    __m128i shift;  ///< the addition's shift minus 1; rounding shifts by 1 more bit

    explicit integer_addition(const quantized_addition& sum)
        : bias(spread(sum.bias)),
          a_multiplier(spread(sum.a_multiplier)),
          b_multiplier(spread(sum.b_multiplier)),
          zero_point(LDI_LANES(set1_epi16)(static_cast<short>(sum.zero_point))),
          shift(_mm_cvtsi32_si128(sum.shift - 1)) {}

    /// Returns sums without the zero point. A shift that adds half rounds halves up. Subtracting 1 from negative values first
    /// makes it round their halves down, away from zero.
    [[gnu::always_inline]] int_lanes operator()(int_lanes a, int_lanes b) const {
        const int_lanes products =
            LDI_LANES(add_epi32)(LDI_LANES(mullo_epi32)(a, a_multiplier), LDI_LANES(mullo_epi32)(b, b_multiplier));
        const int_lanes sums = LDI_LANES(add_epi32)(products, bias);
        const int_lanes lowered = LDI_LANES(add_epi32)(sums, LDI_LANES(srai_epi32)(sums, 31));
        const int_lanes twice = LDI_LANES(sra_epi32)(lowered, shift);
        return LDI_LANES(srai_epi32)(LDI_LANES(add_epi32)(twice, spread(1)), 1);
    }
    [[gnu::always_inline]] int_lanes add_zero_point(int_lanes words) const { return LDI_LANES(adds_epi16)(words, zero_point); }
};

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

/// Applies a float_requantization to vectors.
struct requantizer {
    float_lanes scale, offset;
    int_lanes sign, zero_point;

    explicit requantizer(const float_requantization& r)
        : scale(spread(r.scale)),
          // If the zero point is 0, negative results clamp to 0 for either sign of the offset, so one sign serves all values.
          offset(spread(r.zero_point == 0 && r.offset < 0 ? -r.offset : r.offset)),
          sign(spread(r.zero_point == 0 ? 0 : -0x7FFFFFFF - 1)),
          zero_point(LDI_LANES(set1_epi16)(static_cast<short>(r.zero_point))) {}

    [[gnu::always_inline]] int_lanes operator()(int_lanes sums) const {
        const float_lanes value = to_float(sums);
        return truncate(fused(value, scale, add_sign(offset, sign, value)));
    }

    /// Packs to bytes and adds the zero point. Each 128-bit lane of the result contains 4 values of a, then 4 of b, of c, and of
    /// d; gather_lanes() restores their order.
    [[gnu::always_inline]] int_lanes pack_lanes(int_lanes a, int_lanes b, int_lanes c, int_lanes d) const {
        const int_lanes low = LDI_LANES(adds_epi16)(pack_words(a, b), zero_point);
        return pack_bytes(low, LDI_LANES(adds_epi16)(pack_words(c, d), zero_point));
    }
};

/// Requantizes with a zero point of 0.
struct rectifier {
    float_lanes scale, offset;

    explicit rectifier(const float_requantization& r)
        : scale(spread(r.scale)), offset(spread(r.offset < 0 ? -r.offset : r.offset)) {}

    [[gnu::always_inline]] int_lanes operator()(int_lanes sums) const { return truncate(fused(to_float(sums), scale, offset)); }
    [[gnu::always_inline]] int_lanes pack_lanes(int_lanes a, int_lanes b, int_lanes c, int_lanes d) const {
        return pack_bytes(pack_words(a, b), pack_words(c, d));
    }
};
