// kernels/conv_u8.hpp with AVX-VNNI: vpdpbusd computes four products for each of 8 lanes. The weights have the layout of AVX2.
#pragma once

#include <ldi/kernels/conv_u8/avx2.hpp>
#include <ldi/kernels/conv_u8/contract.hpp>
#include <ldi/kernels/detail/target.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace avx_vnni {

LDI_BEGIN_TARGET(LDI_AVX_VNNI_FEATURES)

struct conv_u8_set : avx2::conv_u8_set {
    static constexpr std::size_t pixels[] = {12, 6, 4};

    [[gnu::always_inline]] static __m256i add_products(__m256i sums, __m256i inputs, __m256i weights) {
        return _mm256_dpbusd_avx_epi32(sums, inputs, weights);
    }
};

#include <ldi/kernels/detail/generic/conv_tiles.hpp>
#include <ldi/kernels/detail/generic/conv_walk.hpp>
using conv_u8_tiles = conv_tiles<conv_pieces<conv_u8_set>>;

LDI_END_TARGET

}}}  // namespace ldi::avx_vnni

#endif
