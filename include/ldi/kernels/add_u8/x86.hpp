// kernels/add_u8.hpp with AVX2 and AVX-512: float arithmetic with two fused multiply-adds per vector of 8 or 16
// values, or integer arithmetic where no float form is exact.
#pragma once

#include <ldi/kernels/add_u8/contract.hpp>
#include <ldi/kernels/detail/lanes_avx2.hpp>
#include <ldi/kernels/detail/lanes_avx512vnni.hpp>

#if LDI_HAS_X86_KERNELS

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace avx2 {
LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)
#define LDI_LANES(operation) _mm256_##operation
#include <ldi/kernels/add_u8/generic/adders_x86.hpp>
#undef LDI_LANES
#include <ldi/kernels/add_u8/generic/walk.hpp>
#include <ldi/kernels/add_u8/generic/walk_forms.hpp>
LDI_END_TARGET
}  // namespace avx2

namespace avx512vnni {
LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)
#define LDI_LANES(operation) _mm512_##operation
#include <ldi/kernels/add_u8/generic/adders_x86.hpp>
#undef LDI_LANES
#include <ldi/kernels/add_u8/generic/walk.hpp>
#include <ldi/kernels/add_u8/generic/walk_forms.hpp>
LDI_END_TARGET
}  // namespace avx512vnni

}}  // namespace ldi

#endif
