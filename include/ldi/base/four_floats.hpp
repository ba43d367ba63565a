// Four floats side by side: one register on every processor that ldi has kernels for. GCC and clang have this type on x86 and
// Arm. It is spelled out because their code for ordinary loops with comparisons depends on version and flags.
#pragma once

#include <ldi/base/config.hpp>

#include <cstddef>
#include <cstring>

#if defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail { namespace lanes {

using four_floats = float __attribute__((vector_size(16)));
inline constexpr std::size_t wide = sizeof(four_floats) / sizeof(float);

inline four_floats load(const float* from) {
    four_floats v;
    std::memcpy(&v, from, sizeof v);
    return v;
}

inline void store(float* to, four_floats v) { std::memcpy(to, &v, sizeof v); }

#if defined(__SSE__)
// GCC does not see that the comparisons below are one instruction each.
inline four_floats smaller(four_floats a, four_floats b) { return _mm_min_ps(a, b); }
inline four_floats larger(four_floats a, four_floats b) { return _mm_max_ps(a, b); }
#else
inline four_floats smaller(four_floats a, four_floats b) { return b < a ? b : a; }
inline four_floats larger(four_floats a, four_floats b) { return b < a ? a : b; }
#endif

}}}}  // namespace ldi::detail::lanes
