// kernels/gemm_u8.hpp with AMX: how the product is cut into tiles stands in detail/gemm_u8_tiles.hpp, here are the instructions.
//
// A product of full tiles, 16 x 64 x 16, takes 16 cycles, eleven times less than vpdpbusd needs for it. Requantising takes
// AVX-512 some 3 cycles for 16 sums, 192 for the 64 vectors of four tiles of sums; up to 192 inputs (3 x 64 cycles) it is the
// longer of the two, and runs while the tile unit multiplies.
#pragma once

#include <ldi/kernels/detail/gemm_u8_tiles.hpp>
#include <ldi/kernels/detail/lanes_avx512vnni.hpp>

#if LDI_HAS_AMX_KERNELS

#include <cstddef>
#include <cstdint>

namespace ldi::amx {

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

/// 32 sums of each pixel, two pixels at a time.
inline void requantize_wide(const avx512vnni::requantizer& requantize, const detail::tile_sums& sums, std::size_t tile) {
    const std::int32_t* values = sums.values + tile * sums.rows * sums.row_sums;
    std::uint8_t* result = sums.results[tile];
    const auto mask = static_cast<__mmask32>(avx512vnni::first_bytes(sums.used));
    for (std::size_t row = 0; row < sums.rows; row += 2, values += 64, result += 2 * sums.outputs) {
        const bool has_second = row + 1 < sums.rows;
        const std::int32_t* const second = has_second ? values + 32 : values;
        const __m512i bytes = avx512vnni::swap_lanes(
            requantize.pack_lanes(requantize(_mm512_load_si512(values)), requantize(_mm512_load_si512(values + 16)),
                                  requantize(_mm512_load_si512(second)), requantize(_mm512_load_si512(second + 16))));
        _mm256_mask_storeu_epi8(result, mask, _mm512_castsi512_si256(bytes));
        if (has_second) _mm256_mask_storeu_epi8(result + sums.outputs, mask, _mm512_extracti64x4_epi64(bytes, 1));
    }
}

/// 16 sums of each pixel, four pixels at a time; behind the last pixel, the last once more.
inline void requantize_narrow(const avx512vnni::requantizer& requantize, const detail::tile_sums& sums, std::size_t tile) {
    const std::int32_t* const values = sums.values + tile * sums.rows * sums.row_sums;
    const auto mask = static_cast<__mmask16>(avx512vnni::first_bytes(sums.used));
    for (std::size_t row = 0; row < sums.rows; row += 4) {
        const std::size_t last = sums.rows - 1;
        const std::size_t rows[4] = {row, row + 1 < last ? row + 1 : last, row + 2 < last ? row + 2 : last,
                                     row + 3 < last ? row + 3 : last};
        const __m512i bytes = avx512vnni::swap_lanes(requantize.pack_lanes(
            requantize(_mm512_load_si512(values + 16 * rows[0])), requantize(_mm512_load_si512(values + 16 * rows[1])),
            requantize(_mm512_load_si512(values + 16 * rows[2])), requantize(_mm512_load_si512(values + 16 * rows[3]))));
        std::uint8_t* const result = sums.results[tile];
        _mm_mask_storeu_epi8(result + rows[0] * sums.outputs, mask, _mm512_castsi512_si128(bytes));
        _mm_mask_storeu_epi8(result + rows[1] * sums.outputs, mask, _mm512_extracti32x4_epi32(bytes, 1));
        _mm_mask_storeu_epi8(result + rows[2] * sums.outputs, mask, _mm512_extracti32x4_epi32(bytes, 2));
        _mm_mask_storeu_epi8(result + rows[3] * sums.outputs, mask, _mm512_extracti32x4_epi32(bytes, 3));
    }
}

inline void tile_unit::requantize(const detail::tile_sums& sums) {
    const avx512vnni::requantizer to_bytes(output);
    for (std::size_t tile = 0; tile < 2 && sums.rows > 0; ++tile)
        sums.row_sums == 32 ? requantize_wide(to_bytes, sums, tile) : requantize_narrow(to_bytes, sums, tile);
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
