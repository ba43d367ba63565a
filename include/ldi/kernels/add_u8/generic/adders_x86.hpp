// Adds two tensors in float or in integers. Each x86 instruction set includes this file inside its namespace and target region,
// after detail/lanes_*.hpp.

struct float_adder {
    static constexpr std::size_t width = 4 * lane_count;  ///< bytes per step
    float_lanes a_scale, b_scale, offset;

    explicit float_adder(const add_u8_constants& sum)
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

struct integer_adder {
    static constexpr std::size_t width = 4 * lane_count;  ///< bytes per step
    integer_addition sum;

    explicit integer_adder(const add_u8_constants& constants) : sum(constants.exact) {}

    [[gnu::always_inline]] int_lanes words(const std::uint8_t* a, const std::uint8_t* b, std::size_t first) const {
        const std::size_t second = first + lane_count;
        const int_lanes low = sum(load_bytes(a + first), load_bytes(b + first));
        return sum.add_zero_point(pack_words(low, sum(load_bytes(a + second), load_bytes(b + second))));
    }
    [[gnu::always_inline]] void add(const std::uint8_t* a, const std::uint8_t* b, std::uint8_t* result) const {
        store(result, gather_lanes(pack_bytes(words(a, b, 0), words(a, b, 2 * lane_count))));
    }
};
