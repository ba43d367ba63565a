// Requantization with a zero point of 0. Each x86 instruction set includes this file inside its namespace and target region,
// after these definitions:
//
//     float_lanes, int_lanes                   vectors of 32-bit values
//     spread(float)                            one value in all lanes
//     scale_and_truncate(sums, scale, offset)  trunc(fma(float(sums), scale, offset)); offset may depend on the lane
//     pack_bytes(a, b, c, d)                   saturated bytes: in each 128-bit lane 4 values of a, then of b, c, d

/// Requantizes with a zero point of 0. The offset has the same sign for all values, because negative values become 0 with
/// either sign.
struct rectifier {
    float_lanes scale, offset;

    explicit rectifier(const float_requantization& r)
        : scale(spread(r.scale)), offset(spread(r.offset < 0 ? -r.offset : r.offset)) {}

    [[gnu::always_inline]] int_lanes operator()(int_lanes sums) const { return scale_and_truncate(sums, scale, offset); }
    [[gnu::always_inline]] int_lanes pack_lanes(int_lanes a, int_lanes b, int_lanes c, int_lanes d) const {
        return pack_bytes(a, b, c, d);
    }
};
