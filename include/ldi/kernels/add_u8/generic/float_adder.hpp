// Adds two tensors in float. Each x86 instruction set includes this file inside its namespace and target region, after
// detail/lanes_*.hpp and these definitions:
//
//     lane_count                    32-bit lanes per vector
//     add_scaled(a, b, scales...)   one vector: round(a * a_scale + (b * b_scale + offset)), fused
//     store_in_order(to, bytes)     stores the result of pack_bytes(a, b, c, d) in the order a, b, c, d

struct adder {
    static constexpr std::size_t width = 4 * lane_count;  ///< bytes per step
    float_lanes a_scale, b_scale, offset;

    explicit adder(const add_u8_constants& sum)
        : a_scale(spread(sum.a_scale)), b_scale(spread(sum.b_scale)), offset(spread(sum.offset)) {}

    [[gnu::always_inline]] int_lanes lanes(const std::uint8_t* a, const std::uint8_t* b, std::size_t first) const {
        return add_scaled(a + first, b + first, a_scale, b_scale, offset);
    }
    [[gnu::always_inline]] void add(const std::uint8_t* a, const std::uint8_t* b, std::uint8_t* result) const {
        store_in_order(result, pack_bytes(lanes(a, b, 0), lanes(a, b, lane_count), lanes(a, b, 2 * lane_count),
                                          lanes(a, b, 3 * lane_count)));
    }
};
