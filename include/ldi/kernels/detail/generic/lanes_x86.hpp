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
