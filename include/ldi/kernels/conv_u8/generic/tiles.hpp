// Tiles of conv_u8. AVX2, AVX-VNNI, NEON and WebAssembly include this file inside their namespace and target region, after their
// primitives in a namespace conv_u8_set:
//
//     width, group, max_vectors, pixels[]             as in detail/generic/conv_walk.hpp
//     sums_type                                       `width` sums of 32 bits
//     inputs_type                                     one group of a pixel's inputs, repeated for each output
//     weights_type                                    a group's weights for `width` outputs
//     load_inputs(from, count)                        loads 1 to `group` inputs and pads the group with zeros
//     load_weights(from)                              loads a group's weights for `width` outputs
//     add_products(sums, inputs, weights)             returns the sums plus the products of one group
//     finish_vector(output, pixel, from, sums, ratio)  stores the results of up to `width` outputs, starting at `from`

struct conv_u8_tiles {
    static constexpr std::size_t group = conv_u8_set::group, width = conv_u8_set::width, max_vectors = conv_u8_set::max_vectors,
                                 rest_pixels = 4;
    static constexpr const auto& pixels = conv_u8_set::pixels;

    template <class Result, std::size_t... p, std::size_t... v>
    static void tile(std::index_sequence<p...> pixels_of_tile, std::index_sequence<v...> vectors,
                     const detail::conv_panel_input<std::uint8_t>& input, std::size_t first_pixel,
                     const detail::conv_u8_panel_output<Result>& out) {
        conv_u8_set::sums_type sums[sizeof...(p) * sizeof...(v)] = {};
        const std::size_t stride = input.pixel_stride;
        const std::uint8_t* weights = input.weights;
        for (std::size_t r = 0; r < input.row_count; ++r) {
            const std::uint8_t* x = input.rows[r] + first_pixel * stride;
            std::size_t rest = input.inputs;
            for (; rest >= group; rest -= group, x += group, weights += sizeof...(v) * width * group)
                add_groups(pixels_of_tile, vectors, sums, x, stride, group, weights);
            if (rest == 0) continue;
            add_groups(pixels_of_tile, vectors, sums, x, stride, rest, weights);
            weights += sizeof...(v) * width * group;
        }
        (finish_pixel(vectors, sums + p * sizeof...(v), out, first_pixel + p), ...);
    }

private:
    /// Adds the products of `count` inputs of every pixel and all vectors of weights.
    template <std::size_t... p, std::size_t... v>
    [[gnu::always_inline]] static void add_groups(std::index_sequence<p...>, std::index_sequence<v...> vectors,
                                                  conv_u8_set::sums_type* sums, const std::uint8_t* inputs, std::size_t stride,
                                                  std::size_t count, const std::uint8_t* weights) {
        const conv_u8_set::weights_type w[] = {conv_u8_set::load_weights(weights + v * width * group)...};
        (add_group(vectors, sums + p * sizeof...(v), conv_u8_set::load_inputs(inputs + p * stride, count), w), ...);
    }
    template <std::size_t... v>
    [[gnu::always_inline]] static void add_group(std::index_sequence<v...>, conv_u8_set::sums_type* sums,
                                                 conv_u8_set::inputs_type inputs, const conv_u8_set::weights_type* weights) {
        ((sums[v] = conv_u8_set::add_products(sums[v], inputs, weights[v])), ...);
    }
    template <class Result, std::size_t... v>
    [[gnu::always_inline]] static void finish_pixel(std::index_sequence<v...>, const conv_u8_set::sums_type* sums,
                                                    const detail::conv_u8_panel_output<Result>& out, std::size_t pixel) {
        const float ratio = out.ratios == nullptr ? 1.0F : out.ratios[pixel];
        (conv_u8_set::finish_vector(out, pixel, v * width, sums[v], ratio), ...);
    }
};
