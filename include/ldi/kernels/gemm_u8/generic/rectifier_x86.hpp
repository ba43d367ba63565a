// Requantization of gemm_u8 with a zero point of 0. AVX2 and AVX-512 include this file inside their namespace and target region,
// after detail/lanes_*.hpp.

struct rectifier {
    float_lanes scale, offset;

    explicit rectifier(const float_requantization& r)
        : scale(spread(r.scale)), offset(spread(r.offset < 0 ? -r.offset : r.offset)) {}

    [[gnu::always_inline]] int_lanes operator()(int_lanes sums) const { return truncate(fused(to_float(sums), scale, offset)); }
    [[gnu::always_inline]] int_lanes pack_lanes(int_lanes a, int_lanes b, int_lanes c, int_lanes d) const {
        return pack_bytes(pack_words(a, b), pack_words(c, d));
    }
};
