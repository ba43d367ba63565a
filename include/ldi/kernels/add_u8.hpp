// Addition of two 8-bit tensors, each in its own quantization. This header is the contract of the family; one file for each
// instruction set implements it, all with equal results.
#pragma once

#include <ldi/base/memory.hpp>
#include <ldi/kernels/add_u8_avx2.hpp>
#include <ldi/kernels/add_u8_avx512vnni.hpp>
#include <ldi/kernels/add_u8_neon.hpp>
#include <ldi/kernels/add_u8_wasm.hpp>
#include <ldi/kernels/detail/add_u8_constants.hpp>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi {

/// result[i] = a[i] + b[i]. The result may be a or b itself, but may not overlap them otherwise.
inline void add_u8(const add_u8_constants& sum, const std::uint8_t* a, const std::uint8_t* b, std::size_t count,
                   std::uint8_t* result) {
    switch (sum.target) {
#if LDI_HAS_X86_KERNELS
        case isa::avx512vnni: return avx512vnni::add_u8(sum, a, b, count, result);
        case isa::avx2: return avx2::add_u8(sum, a, b, count, result);
#endif
#if LDI_HAS_ARM_KERNELS
        case isa::neon_dot_product: return neon::add_u8(sum, a, b, count, result);
#endif
#if LDI_HAS_WASM_KERNELS
        case isa::wasm_simd128: return wasm_simd128::add_u8(sum, a, b, count, result);
#endif
        default: break;
    }
    for (std::size_t i = 0; i < count; ++i) result[i] = add_quantized(a[i], b[i], sum.exact);
}

namespace detail {

/// Whether the float form with these constants gives what the integer form does, for `a` and every b.
inline bool is_exact(const add_u8_constants& sum, std::size_t a, const buffer<std::uint8_t>& expected) {
    std::uint8_t as[256], bs[256], found[256];
    std::memset(as, static_cast<int>(a), sizeof as);
    for (int i = 0; i < 256; ++i) bs[i] = static_cast<std::uint8_t>(i);
    add_u8(sum, as, bs, 256, found);
    return std::memcmp(found, expected.data() + a * 256, 256) == 0;
}

/// Whether it does for all pairs of values. `suspect` is where the last candidate failed, which refutes many others.
inline bool is_exact(const add_u8_constants& sum, const buffer<std::uint8_t>& expected, std::size_t& suspect) {
    if (!is_exact(sum, suspect, expected)) return false;
    for (std::size_t a = 0; a < 256; ++a)
        if (!is_exact(sum, a, expected)) {
            suspect = a;
            return false;
        }
    return true;
}

}  // namespace detail

/// target  to prepare for. If no float form agrees with the integer form on all 65,536 pairs, `result.target` is scalar
inline add_u8_constants prepare_add_u8(isa target, const quantized_addition& exact) {
    add_u8_constants sum{without_tiles(target), exact};
    if (target == isa::scalar || target == isa::neon_dot_product) return sum;  // they compute the integer form
    buffer<std::uint8_t> expected(65536);
    for (std::size_t i = 0; i < expected.size(); ++i)
        expected[i] = add_quantized(static_cast<std::uint8_t>(i / 256), static_cast<std::uint8_t>(i % 256), exact);
    // Of 65,536 sums some lie closer to a tie than float can tell; among the neighbors of the real constants a few are lucky.
    const double unit = std::ldexp(1.0, -exact.shift);
    const float a_scale = static_cast<float>(exact.a_multiplier * unit), b_scale = static_cast<float>(exact.b_multiplier * unit);
    const double offset = exact.bias * unit + exact.zero_point;
    std::size_t suspect = 0;
    for (int step = 0; step <= 48; ++step)
        for (int a_step = -3; a_step <= 3; ++a_step)
            for (int b_step = -3; b_step <= 3; ++b_step) {
                const int offset_step = step % 2 == 0 ? step / 2 : -(step + 1) / 2;
                sum.offset = static_cast<float>(offset + offset_step * 0x1p-18);
                sum.a_scale = a_scale * (1 + static_cast<float>(a_step) * 0x1p-23F);
                sum.b_scale = b_scale * (1 + static_cast<float>(b_step) * 0x1p-23F);
                if (detail::is_exact(sum, expected, suspect)) return sum;
            }
    sum.target = isa::scalar;
    return sum;
}

}  // namespace ldi
