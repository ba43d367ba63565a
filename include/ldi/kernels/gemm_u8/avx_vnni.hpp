// kernels/gemm_u8.hpp with AVX-VNNI's vpdpbusd, which adds four products of a byte and a signed byte to each of 8 sums, exactly:
// 32 products per instruction, compared to 64 with five instructions of AVX2.
//
// An instruction has a latency of 5 cycles, and two can start per cycle (Alder Lake), so at least 10 independent sums are
// necessary to hide the latency. Tiles have 12 sums. Together with two vectors of weights and one of inputs, they occupy 15 of
// the 16 registers.
#pragma once

#include <ldi/kernels/gemm_u8/avx2.hpp>
#include <ldi/kernels/gemm_u8/contract.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx_vnni {

inline constexpr std::size_t gemm_lanes = 8, gemm_max_vectors = 2, gemm_tile_pixels[] = {12, 6};
using detail::gemm_group;
using gemm_panel = detail::gemm_panel_of<std::uint8_t, const std::int8_t*, gemm_group>;

inline void pack_gemm_u8(gemm_u8_data& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    const int sign = detail::is_negated(packed.fast) ? -1 : 1;
    detail::append_weights(packed.narrow, packed, weights, weight_zero_point, sign, {gemm_group, gemm_lanes, gemm_max_vectors});
}

LDI_BEGIN_TARGET(LDI_AVX_VNNI_FEATURES)

template <std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<v...>, __m256i* sums, __m256i inputs,
                                                const __m256i* weights) {
    ((sums[v] = _mm256_dpbusd_avx_epi32(sums[v], inputs, weights[v])), ...);
}

/// Multiply-adds four inputs of every pixel and all vectors of weights.
template <std::size_t... p, std::size_t... v>
[[gnu::always_inline]] inline void multiply_add(std::index_sequence<p...>, std::index_sequence<v...> vectors, __m256i* sums,
                                                const std::uint8_t* inputs, std::size_t stride, const std::int8_t* weights) {
    const __m256i w[] = {_mm256_load_si256(reinterpret_cast<const __m256i*>(weights) + v)...};
    (multiply_add(vectors, sums + p * sizeof...(v), avx2::spread_four(inputs + p * stride), w), ...);
}

using avx2::gemm_vector, avx2::load_bias;

struct gemm_kernel : avx2::gemm_results {
    template <std::size_t... p, std::size_t... v>
    [[gnu::always_inline]] static void add_segment(std::index_sequence<p...> pixels, std::index_sequence<v...> vectors,
                                                   __m256i* sums, const std::uint8_t* x, const gemm_panel& panel,
                                                   const std::int8_t*& weights) {
        for (std::size_t g = 0; g < panel.groups; ++g) {
            multiply_add(pixels, vectors, sums, x, panel.pixel_stride, weights);
            x += gemm_group;
            weights += sizeof...(v) * gemm_lanes * gemm_group;
        }
    }
};
using gemm_half_kernel = gemm_kernel;

#include <ldi/kernels/gemm_u8/generic/walk.hpp>

inline void gemm_u8(const gemm_u8_data& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                    std::size_t pixels, std::uint8_t* result) {
    gemm_u8_panels<avx2::rectifier, avx2::requantizer>(
        weights.outputs, weights.fast, gemm_panel(weights, weights.narrow.data(), segments, pixel_stride, pixels, result));
}

LDI_END_TARGET

}}}  // namespace ldi::avx_vnni

#endif
