// Processor features that kernels require.
#pragma once

#include <ldi/base/config.hpp>

namespace ldi { inline namespace LDI_CONFIGURATION {

enum class cpu_feature {
    none,
    avx2,
    fma,
    avx_vnni,
    avx512,  ///< F, BW and VL
    avx512_vnni,
    arm_dot_product,
    wasm_simd128,
};

}}  // namespace ldi
