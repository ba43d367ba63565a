// Adds two tensors in float. Each x86 instruction set includes this file inside its namespace and target region, after
// detail/lanes_*.hpp.

struct adder {
    static constexpr std::size_t width = 4 * lane_count;  ///< bytes per step
    float_lanes a_scale, b_scale, offset;

    explicit adder(const add_u8_constants& sum)
        : a_scale(spread(sum.a_scale)), b_scale(spread(sum.b_scale)), offset(spread(sum.offset)) {}

    [[gnu::always_inline]] int_lanes lanes(const std::uint8_t* a, const std::uint8_t* b, std::size_t first) const {
        return round(fused(load_bytes(a + first), a_scale, fused(load_bytes(b + first), b_scale, offset)));
    }
    [[gnu::always_inline]] void add(const std::uint8_t* a, const std::uint8_t* b, std::uint8_t* result) const {
        const int_lanes low = pack_words(lanes(a, b, 0), lanes(a, b, lane_count));
        const int_lanes high = pack_words(lanes(a, b, 2 * lane_count), lanes(a, b, 3 * lane_count));
        store(result, gather_lanes(pack_bytes(low, high)));
    }
};
