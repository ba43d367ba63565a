// Tiles of conv_f32 and conv_u8. AVX2, AVX-VNNI, NEON and WebAssembly include this file inside their namespace and target region,
// after conv_walk.hpp. The template parameter Set provides the primitives:
//
//     layout, pixels, rest_pixels               as in conv_walk.hpp
//     sums_type                                 vector of sums
//     finish(output, pixel, from, sums, ratio)  stores the results of a vector of sums, the first for output `from`
//     add_piece(pixels, vectors, sums, inputs, from, fetch, weights)
//                                               adds the products of one piece of all pixels, and moves `weights` to the next
//                                               piece. `from` is the conv_panel_input, `fetch` its fetch_step()
//
// If conv_pieces provides add_piece(), these primitives are required instead:
//
//     weights_type, load_weights(from)     weights of one group for a vector of outputs; loads them
//     load_inputs(from, count)             loads up to a group of inputs, pads it with zeros, and repeats it for each output
//     add_products(sums, inputs, weights)  returns the sums plus the products of one group

/// Adds the products of one group of a pixel's inputs.
template <class Set, class Inputs, std::size_t... v>
[[gnu::always_inline]] inline void add_group(std::index_sequence<v...>, typename Set::sums_type* sums, Inputs inputs,
                                             const typename Set::weights_type* weights) {
    ((sums[v] = Set::add_products(sums[v], inputs, weights[v])), ...);
}

/// Adds the products of one group of `count` inputs of all pixels, and moves `weights` to the next group.
template <class Set, class Value, class Weight, std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void add_group(std::index_sequence<p...>, std::index_sequence<v...> vectors,
                                             typename Set::sums_type* sums, const Value* inputs, std::size_t stride,
                                             std::size_t count, const Weight*& weights) {
    constexpr std::size_t vector = Set::layout.group * Set::layout.lanes;
    const typename Set::weights_type w[] = {Set::load_weights(weights + v * vector)...};
    (add_group<Set>(vectors, sums + p * sizeof...(v), Set::load_inputs(inputs + p * stride, count), w), ...);
    weights += sizeof...(v) * vector;
}

/// Adds the products of a piece group by group.
template <class Set>
struct conv_pieces : Set {
    template <class Pixels, class Vectors, class Sums, class Input, class Weight>
    [[gnu::always_inline]] static void add_piece(Pixels pixels, Vectors vectors, Sums* sums, const std::uint8_t* inputs,
                                                 const Input& from, std::size_t, const Weight*& weights) {
        constexpr std::size_t group = Set::layout.group;
        std::size_t rest = from.inputs;
        for (; rest >= group; rest -= group, inputs += group)
            add_group<Set>(pixels, vectors, sums, inputs, from.pixel_stride, group, weights);
        if (rest != 0) add_group<Set>(pixels, vectors, sums, inputs, from.pixel_stride, rest, weights);
    }
};

template <class Set>
struct conv_tiles : Set {
    template <class Input, class Output, std::size_t... p, std::size_t... v>
    static void tile(std::index_sequence<p...> tile_pixels, std::index_sequence<v...> vectors, const Input& input,
                     std::size_t first_pixel, const Output& out) {
        typename Set::sums_type sums[sizeof...(p) * sizeof...(v)] = {};
        const Input from = input;  // a local copy, so that the compiler keeps it in registers
        const auto* weights = from.weights;
        const std::size_t fetch = from.fetch_step(sizeof...(p), Set::layout.group);
        for (std::size_t r = 0; r < from.row_count; ++r)
            Set::add_piece(tile_pixels, vectors, sums, from.rows[r] + first_pixel * from.pixel_stride, from, fetch, weights);
        (finish_pixel(vectors, sums + p * sizeof...(v), out, first_pixel + p), ...);
    }

private:
    template <class Output, std::size_t... v>
    [[gnu::always_inline]] static void finish_pixel(std::index_sequence<v...>, const typename Set::sums_type* sums,
                                                    const Output& out, std::size_t pixel) {
        const float ratio = out.ratios == nullptr ? 1.0F : out.ratios[pixel];
        (Set::finish(out, pixel, v * Set::layout.lanes, sums[v], ratio), ...);
    }
};
