// Output stage of depthwise_u8. Each x86 instruction set includes this file inside its namespace and target region, after
// detail/lanes_*.hpp.

/// Requantizes the sums of a depthwise convolution, and packs them to bytes in the order of the channels.
struct depthwise_results {
    using requantizer_type = requantizer;

    static requantizer requantizer_of(const depthwise_u8_weights& weights) { return requantizer(weights.fast); }
    [[gnu::always_inline]] static int_lanes requantized(const requantizer& requantize, const four_vectors& sums) {
        return requantize.pack_lanes(requantize(sums.v[0]), requantize(sums.v[1]), requantize(sums.v[2]), requantize(sums.v[3]));
    }
};
