// Adds two tensors in float or in integers. Each x86 instruction set includes this file inside its namespace and target region,
// after detail/lanes_*.hpp, with LDI_LANES as in detail/generic/lanes_x86.hpp.

struct float_adder {
    static constexpr std::size_t width = 4 * lane_count;  ///< bytes per step
    float_lanes a_scale, b_scale, offset;

    explicit float_adder(const add_u8_data& sum)
        : a_scale(spread(sum.a_scale)), b_scale(spread(sum.b_scale)), offset(spread(sum.offset)) {}

    [[gnu::always_inline]] int_lanes lanes(const std::uint8_t* a, const std::uint8_t* b, std::size_t first) const {
        return round(fused(to_float(load_bytes(a + first)), a_scale, fused(to_float(load_bytes(b + first)), b_scale, offset)));
    }
    [[gnu::always_inline]] void add(const std::uint8_t* a, const std::uint8_t* b, std::uint8_t* result) const {
        const int_lanes low = pack_words(lanes(a, b, 0), lanes(a, b, lane_count));
        const int_lanes high = pack_words(lanes(a, b, 2 * lane_count), lanes(a, b, 3 * lane_count));
        store(result, gather_lanes(pack_bytes(low, high)));
    }
};

/// Applies add_quantized() to vectors.
struct integer_adder {
    static constexpr std::size_t width = 4 * lane_count;  ///< bytes per step
    int_lanes bias, a_multiplier, b_multiplier, zero_point;
    __m128i shift;  ///< the addition's shift minus 1; rounding shifts by 1 more bit

    explicit integer_adder(const add_u8_data& sum)
        : bias(spread(sum.exact.bias)),
          a_multiplier(spread(sum.exact.a_multiplier)),
          b_multiplier(spread(sum.exact.b_multiplier)),
          zero_point(LDI_LANES(set1_epi16)(static_cast<short>(sum.exact.zero_point))),
          shift(_mm_cvtsi32_si128(sum.exact.shift - 1)) {}

    /// Returns sums without the zero point. To divide by a power of two, adds one half and shifts, which rounds halves up.
    /// Negative halves must round down, away from zero, so the function first subtracts 1 from negative values.
    [[gnu::always_inline]] int_lanes lanes(const std::uint8_t* a, const std::uint8_t* b, std::size_t first) const {
        const int_lanes products = LDI_LANES(add_epi32)(LDI_LANES(mullo_epi32)(load_bytes(a + first), a_multiplier),
                                                        LDI_LANES(mullo_epi32)(load_bytes(b + first), b_multiplier));
        const int_lanes sums = LDI_LANES(add_epi32)(products, bias);
        const int_lanes lowered = LDI_LANES(add_epi32)(sums, LDI_LANES(srai_epi32)(sums, 31));
        const int_lanes twice = LDI_LANES(sra_epi32)(lowered, shift);
        return LDI_LANES(srai_epi32)(LDI_LANES(add_epi32)(twice, spread(1)), 1);
    }
    [[gnu::always_inline]] int_lanes words(const std::uint8_t* a, const std::uint8_t* b, std::size_t first) const {
        return LDI_LANES(adds_epi16)(pack_words(lanes(a, b, first), lanes(a, b, first + lane_count)), zero_point);
    }
    [[gnu::always_inline]] void add(const std::uint8_t* a, const std::uint8_t* b, std::uint8_t* result) const {
        store(result, gather_lanes(pack_bytes(words(a, b, 0), words(a, b, 2 * lane_count))));
    }
};
