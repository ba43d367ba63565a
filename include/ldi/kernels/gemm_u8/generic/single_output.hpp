// gemm_u8 with a single output: the lanes of a vector contain inputs. AVX2, AVX-512 and WebAssembly include this file inside
// their namespace and target region, after walk.hpp and these definitions:
//
//     single_output_inputs, single_output_pixels       inputs per step; pixels per call of store_totals()
//     add_inputs(sums, from, weights)                  returns the sums plus the products of one step
//     add_rest(sums, from, count, weights)             the same for fewer inputs; optional
//     store_totals(sums, start, to)                    stores `start` plus the total of each pixel's vector of sums
//     store_pixel<1>(sums, requantize, count, result)  requantizes a vector of sums and stores the first `count` results

template <class Weight>
[[gnu::always_inline]] inline gemm_vector add_rest(gemm_vector sums, const std::uint8_t* from, std::size_t count,
                                                   const Weight* weights) {
    alignas(16) std::uint8_t inputs[single_output_inputs] = {};
    std::memcpy(inputs, from, count);
    return add_inputs(sums, inputs, weights);
}

/// Computes the sums of one pixel.
template <class Weight>
[[gnu::always_inline]] inline gemm_vector single_output_sums(const gemm_u8_data& layer, const Weight* weights,
                                                             const std::uint8_t* const* segments, std::size_t offset) {
    gemm_vector sums{};
    for (std::size_t s = 0; s < layer.segments; ++s) {
        const std::uint8_t* const x = segments[s] + offset;
        std::size_t i = 0;
        for (; i + single_output_inputs <= layer.inputs; i += single_output_inputs, weights += single_output_inputs)
            sums = add_inputs(sums, x + i, weights);
        if (i == layer.inputs) continue;
        sums = add_rest(sums, x + i, layer.inputs - i, weights);
        weights += single_output_inputs;
    }
    return sums;
}

template <class Weight, class Requantizer>
inline void gemm_u8_single_output(const gemm_u8_data& layer, const Weight* weights, const Requantizer& requantize,
                                  const std::uint8_t* const* segments, std::size_t pixel_stride, std::size_t pixels,
                                  std::uint8_t* result) {
    for (std::size_t first = 0; first < pixels; first += gemm_lanes) {
        alignas(64) std::int32_t totals[gemm_lanes] = {};
        const std::size_t count = pixels - first < gemm_lanes ? pixels - first : gemm_lanes;
        for (std::size_t i = 0; i < count; i += single_output_pixels) {
            gemm_vector sums[single_output_pixels];
            for (std::size_t p = 0; p < single_output_pixels; ++p) {  // repeats the last pixel at the end
                const std::size_t pixel = single_output_pixels == 1 || first + i + p < pixels ? first + i + p : pixels - 1;
                sums[p] = single_output_sums(layer, weights, segments, pixel * pixel_stride);
            }
            store_totals(sums, layer.bias[0], totals + i);
        }
        const gemm_vector values = load_bias(totals);
        store_pixel<1>(&values, requantize, count, result + first);
    }
}
