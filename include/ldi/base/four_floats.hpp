// Four adjacent floats: one register on every processor that ldi has kernels for. GCC and clang provide this vector type. ldi
// uses it explicitly, because auto-vectorization of loops with comparisons depends on the compiler's version and flags. With
// other compilers, or LDI_STANDARD_ONLY, a struct with the same operations replaces it. Its results are the same for values that
// are not NaN.
//
// Functions that accept or return the vector are noexcept, here and elsewhere. If a function may throw, Emscripten's -fexceptions
// calls it through JavaScript, which rejects vectors with a TypeError.
#pragma once

#include <ldi/base/config.hpp>
#include <ldi/base/numbers.hpp>

#include <cstddef>
#include <cstring>

#if LDI_HAS_EXTENSIONS && defined(__SSE__)
#include <xmmintrin.h>
#endif

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail { namespace lanes {

#if LDI_HAS_EXTENSIONS

using four_floats = float __attribute__((vector_size(16)));

/// Returns `a` in the lanes where the comparison holds, `b` in the others.
template <class Comparison>
four_floats select(Comparison holds, four_floats a, four_floats b) noexcept {
    return holds ? a : b;
}

/// Whether a comparison holds for all four floats.
template <class Comparison>
bool all_of(Comparison holds) noexcept {
    return (holds[0] & holds[1] & holds[2] & holds[3]) != 0;
}

#if defined(__SSE__)
// GCC does not compile the comparisons after #else to these single instructions.
inline four_floats smaller(four_floats a, four_floats b) noexcept { return _mm_min_ps(a, b); }
inline four_floats larger(four_floats a, four_floats b) noexcept { return _mm_max_ps(a, b); }
#else
inline four_floats smaller(four_floats a, four_floats b) noexcept { return b < a ? b : a; }
inline four_floats larger(four_floats a, four_floats b) noexcept { return b < a ? a : b; }
#endif

#else

struct four_floats {
    float lane[4];

    four_floats() = default;
    four_floats(float all) : lane{all, all, all, all} {}
    four_floats(float a, float b, float c, float d) : lane{a, b, c, d} {}

    float& operator[](std::size_t i) { return lane[i]; }
    float operator[](std::size_t i) const { return lane[i]; }

    four_floats operator-() const { return {-lane[0], -lane[1], -lane[2], -lane[3]}; }
    four_floats& operator+=(const four_floats& b) { return *this = *this + b; }
    four_floats& operator-=(const four_floats& b) { return *this = *this - b; }
    four_floats& operator*=(const four_floats& b) { return *this = *this * b; }
    four_floats& operator/=(const four_floats& b) { return *this = *this / b; }
    friend four_floats operator+(const four_floats& a, const four_floats& b) {
        return {a[0] + b[0], a[1] + b[1], a[2] + b[2], a[3] + b[3]};
    }
    friend four_floats operator-(const four_floats& a, const four_floats& b) {
        return {a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3]};
    }
    friend four_floats operator*(const four_floats& a, const four_floats& b) {
        return {a[0] * b[0], a[1] * b[1], a[2] * b[2], a[3] * b[3]};
    }
    friend four_floats operator/(const four_floats& a, const four_floats& b) {
        return {a[0] / b[0], a[1] / b[1], a[2] / b[2], a[3] / b[3]};
    }
};

struct four_comparisons {
    bool lane[4];

    friend four_comparisons operator&(const four_comparisons& a, const four_comparisons& b) {
        return {{a.lane[0] && b.lane[0], a.lane[1] && b.lane[1], a.lane[2] && b.lane[2], a.lane[3] && b.lane[3]}};
    }
};

inline four_comparisons operator<(const four_floats& a, const four_floats& b) {
    return {{a[0] < b[0], a[1] < b[1], a[2] < b[2], a[3] < b[3]}};
}
inline four_comparisons operator>(const four_floats& a, const four_floats& b) { return b < a; }

inline four_floats select(const four_comparisons& holds, const four_floats& a, const four_floats& b) {
    return {holds.lane[0] ? a[0] : b[0], holds.lane[1] ? a[1] : b[1], holds.lane[2] ? a[2] : b[2], holds.lane[3] ? a[3] : b[3]};
}
inline bool all_of(const four_comparisons& holds) { return holds.lane[0] && holds.lane[1] && holds.lane[2] && holds.lane[3]; }

inline four_floats rounded_product(const four_floats& a, const four_floats& b) {
    return {detail::rounded_product(a[0], b[0]), detail::rounded_product(a[1], b[1]), detail::rounded_product(a[2], b[2]),
            detail::rounded_product(a[3], b[3])};
}

inline four_floats smaller(const four_floats& a, const four_floats& b) { return select(b < a, b, a); }
inline four_floats larger(const four_floats& a, const four_floats& b) { return select(b < a, a, b); }

#endif

inline constexpr std::size_t wide = sizeof(four_floats) / sizeof(float);

inline four_floats load(const float* from) noexcept {
    four_floats v;
    std::memcpy(&v, from, sizeof v);
    return v;
}

inline void store(float* to, four_floats v) noexcept { std::memcpy(to, &v, sizeof v); }

}}}}  // namespace ldi::detail::lanes
