// kernels/gemm_u8.hpp with AMX: how the product is cut into tiles stands in gemm_u8/tiles.hpp, here are the instructions.
//
// A product of full tiles, 16 x 64 x 16, takes 16 cycles, eight times less than two vpdpbusd a cycle need for it. Requantizing
// takes AVX-512 2 to 3 cycles for 16 sums, 128 to 192 for the 64 vectors of four tiles; up to 128 inputs (2 x 64 cycles) it is
// the longer of the two, and runs while the tile unit multiplies.
#pragma once

#include <ldi/kernels/detail/lanes_avx512vnni.hpp>
#include <ldi/kernels/gemm_u8/tiles.hpp>

#if LDI_HAS_AMX_KERNELS

#include <cstddef>
#include <cstdint>

namespace ldi::inline LDI_CONFIGURATION::amx {

LDI_BEGIN_TARGET(LDI_AMX_FEATURES)

/// The processor's tile unit. The instructions are written out because g++ 12's own functions do not say that they read memory,
/// and because a tile's number then can be a template argument.
struct tile_unit {
    const float_requantization& output;

    void configure(const detail::tile_configuration& shapes) {
        asm volatile("{ldtilecfg (%0)|ldtilecfg [%0]}" : : "r"(&shapes) : "memory");
    }
    void release() { asm volatile("tilerelease" : : : "memory"); }

    template <int tile>
    void load(const void* rows, std::size_t bytes_between) {
        asm volatile("{tileloadd (%0,%1,1), %%tmm%c2|tileloadd tmm%c2, [%0+%1*1]}"
                     :
                     : "r"(rows), "r"(bytes_between), "i"(tile)
                     : "memory");
    }
    template <int tile>
    void store(void* rows, std::size_t bytes_between) {
        asm volatile("{tilestored %%tmm%c2, (%0,%1,1)|tilestored [%0+%1*1], tmm%c2}"
                     :
                     : "r"(rows), "r"(bytes_between), "i"(tile)
                     : "memory");
    }
    template <int sums, int pixels, int weights>
    void multiply_add() {
        asm volatile("{tdpbusd %%tmm%c2, %%tmm%c1, %%tmm%c0|tdpbusd tmm%c0, tmm%c1, tmm%c2}"
                     :
                     : "i"(sums), "i"(pixels), "i"(weights));
    }
    void requantize(const detail::tile_sums& sums);
};

/// The bytes of four vectors of sums, one vector after the other.
template <class Requantizer>
[[gnu::always_inline]] inline __m512i requantize_four(const Requantizer& requantize, const std::int32_t* a, const std::int32_t* b,
                                                      const std::int32_t* c, const std::int32_t* d) {
    return avx512vnni::swap_lanes(requantize.pack_lanes(requantize(_mm512_load_si512(a)), requantize(_mm512_load_si512(b)),
                                                        requantize(_mm512_load_si512(c)), requantize(_mm512_load_si512(d))));
}

/// 32 sums of each pixel, two pixels at a time.
template <class Requantizer>
inline void requantize_wide(const Requantizer& requantize, const detail::tile_sums& sums, std::size_t tile) {
    constexpr std::size_t row_sums = detail::tiled_outputs, half = detail::tile_outputs;
    const std::int32_t* values = sums.values + tile * sums.rows * row_sums;
    std::uint8_t* result = sums.results[tile];
    const std::size_t outputs = sums.outputs, rows = sums.rows;
    const auto mask = static_cast<__mmask32>(avx512vnni::first_bytes(sums.used));
    std::size_t row = 0;
    for (; row + 2 <= rows; row += 2, values += 2 * row_sums, result += 2 * outputs) {
        const __m512i bytes = requantize_four(requantize, values, values + half, values + row_sums, values + row_sums + half);
        if (outputs == row_sums) {
            _mm512_storeu_si512(result, bytes);
        } else {
            _mm256_mask_storeu_epi8(result, mask, _mm512_castsi512_si256(bytes));
            _mm256_mask_storeu_epi8(result + outputs, mask, _mm512_extracti64x4_epi64(bytes, 1));
        }
    }
    if (row == rows) return;
    const __m512i bytes = requantize_four(requantize, values, values + half, values, values + half);
    _mm256_mask_storeu_epi8(result, mask, _mm512_castsi512_si256(bytes));
}

/// 16 sums of each pixel, four pixels at a time; behind the last pixel, the last once more.
template <class Requantizer>
inline void requantize_narrow(const Requantizer& requantize, const detail::tile_sums& sums, std::size_t tile) {
    constexpr std::size_t row_sums = detail::tile_outputs;
    const std::int32_t* const values = sums.values + tile * sums.rows * row_sums;
    std::uint8_t* const result = sums.results[tile];
    const std::size_t outputs = sums.outputs, last = sums.rows - 1;
    const auto mask = static_cast<__mmask16>(avx512vnni::first_bytes(sums.used));
    for (std::size_t row = 0; row <= last; row += 4) {
        const std::size_t second = row + 1 < last ? row + 1 : last, third = row + 2 < last ? row + 2 : last,
                          fourth = row + 3 < last ? row + 3 : last;
        const __m512i bytes = requantize_four(requantize, values + row * row_sums, values + second * row_sums,
                                              values + third * row_sums, values + fourth * row_sums);
        _mm_mask_storeu_epi8(result + row * outputs, mask, _mm512_castsi512_si128(bytes));
        _mm_mask_storeu_epi8(result + second * outputs, mask, _mm512_extracti32x4_epi32(bytes, 1));
        _mm_mask_storeu_epi8(result + third * outputs, mask, _mm512_extracti32x4_epi32(bytes, 2));
        _mm_mask_storeu_epi8(result + fourth * outputs, mask, _mm512_extracti32x4_epi32(bytes, 3));
    }
}

template <class Requantizer>
inline void requantize_tiles(const float_requantization& output, const detail::tile_sums& sums) {
    const Requantizer requantize(output);
    for (std::size_t tile = 0; tile < 2; ++tile)
        sums.row_sums == detail::tiled_outputs ? requantize_wide(requantize, sums, tile)
                                               : requantize_narrow(requantize, sums, tile);
}

inline void tile_unit::requantize(const detail::tile_sums& sums) {
    if (sums.rows == 0) return;
    output.zero_point == 0 ? requantize_tiles<avx512vnni::rectifier>(output, sums)
                           : requantize_tiles<avx512vnni::requantizer>(output, sums);
}

/// Flattened so that the instructions, which only functions of this region may hold, come to stand in the loops of the product.
[[gnu::flatten]] inline void gemm_u8(const gemm_u8_weights& weights, const std::uint8_t* const* segments,
                                     std::size_t pixel_stride, std::size_t pixels, std::uint8_t* result) {
    tile_unit unit{weights.fast};
    detail::tiled_product(unit, weights, segments, pixel_stride).compute(pixels, result);
}

LDI_END_TARGET

}  // namespace ldi::amx

#endif
