// Adds two 8-bit tensors, each in its own quantization. Each instruction set has a file in add_u8/; all of them return the same
// bits.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/kernels/add_u8/contract.hpp>
#include <ldi/kernels/add_u8/neon.hpp>
#include <ldi/kernels/add_u8/scalar.hpp>
#include <ldi/kernels/add_u8/wasm.hpp>
#include <ldi/kernels/add_u8/x86.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <numeric>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// One kernel per instruction set.
inline constexpr add_u8_kernel add_u8_kernels[] = {
#if LDI_HAS_X86_KERNELS
    {isa::avx2, true, avx2::add_u8},
    {isa::avx512vnni, true, avx512vnni::add_u8},
#endif
#if LDI_HAS_ARM_KERNELS
    {isa::neon_dot_product, false, neon::add_u8},
#endif
#if LDI_HAS_WASM_KERNELS
    {isa::wasm_simd128, true, wasm_simd128::add_u8},
#endif
    {isa::scalar, false, scalar::add_u8},
};
static_assert(find_kernel(add_u8_kernels, isa::scalar).set == isa::scalar);

/// Adds two tensors of `count` bytes: result[i] = a[i] + b[i]. The result may be a or b itself, but must not overlap them
/// partially.
inline void add_u8(const add_u8_constants& sum, const std::uint8_t* a, const std::uint8_t* b, std::size_t count,
                   std::uint8_t* result) {
    find_kernel(add_u8_kernels, sum->target).run(*sum, a, b, count, result);
}

namespace detail {

inline constexpr std::array<std::uint8_t, 256> all_bytes = [] {
    std::array<std::uint8_t, 256> bytes{};
    std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
    return bytes;
}();

/// Whether the float form with these constants equals the integer form for `a` and every b.
inline bool is_exact(const add_u8_data& sum, std::uint8_t a, const buffer<std::uint8_t>& expected) {
    std::uint8_t as[256], found[256];
    std::memset(as, a, sizeof as);
    find_kernel(add_u8_kernels, sum.target).run(sum, as, all_bytes.data(), 256, found);
    return std::memcmp(found, expected.data() + a * 256, 256) == 0;
}

/// Whether the float form equals the integer form for all pairs of values. `suspect` is the value of `a` for which the last
/// candidate failed; testing it first rejects most candidates early.
inline bool is_exact(const add_u8_data& sum, const buffer<std::uint8_t>& expected, std::uint8_t& suspect) {
    if (!is_exact(sum, suspect, expected)) return false;
    for (const std::uint8_t a : all_bytes)
        if (!is_exact(sum, a, expected)) {
            suspect = a;
            return false;
        }
    return true;
}

}  // namespace detail

/// Prepares an addition for add_u8().
///
/// target  instruction set to prepare for; must be available (is_available()), else raises invalid_option. The kernel computes
///         the integer form if no float form agrees with it on all 65,536 pairs
/// exact   the addition in integers
inline add_u8_constants prepare_add_u8(isa target, const quantized_addition& exact) {
    const add_u8_kernel& kernel = find_kernel(add_u8_kernels, target);
    check_available("prepare_add_u8", target);
    add_u8_data sum{kernel.set, exact};
    if (!kernel.has_float_form) return detail::prepared_from(sum);
    sum.is_float = true;
    buffer<std::uint8_t> expected;
    expected.reserve(65536);
    for (const std::uint8_t a : detail::all_bytes)
        for (const std::uint8_t b : detail::all_bytes) expected.push_back(add_quantized(a, b, exact));
    // Some of the 65,536 sums lie closer to a tie than float can resolve, so the exact constants may fail. Slightly different
    // constants may still agree on all pairs.
    const double unit = std::ldexp(1.0, -exact.shift);
    const float a_scale = static_cast<float>(exact.a_multiplier * unit), b_scale = static_cast<float>(exact.b_multiplier * unit);
    const double offset = exact.bias * unit + exact.zero_point;
    std::uint8_t suspect = 0;
    for (int step = 0; step <= 48; ++step)
        for (int a_step = -3; a_step <= 3; ++a_step)
            for (int b_step = -3; b_step <= 3; ++b_step) {
                const int offset_step = step % 2 == 0 ? step / 2 : -(step + 1) / 2;
                sum.offset = static_cast<float>(offset + offset_step * 0x1p-18);
                sum.a_scale = a_scale * (1 + detail::nearest_float(a_step) * 0x1p-23F);
                sum.b_scale = b_scale * (1 + detail::nearest_float(b_step) * 0x1p-23F);
                if (detail::is_exact(sum, expected, suspect)) return detail::prepared_from(sum);
            }
    sum.is_float = false;
    return detail::prepared_from(sum);
}

}}  // namespace ldi
