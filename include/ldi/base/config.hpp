// Settings that a user can define before including any header of ldi, and properties of the compiler that ldi detects.
//
// LDI_ASSERT(condition)   checks that the API is used as documented. Defaults to assert(). You can redirect it to a macro of
//                         your engine; all translation units that define it must use the same definition.
// LDI_HAS_EXCEPTIONS      0 or 1; detected unless defined. With 0, errors go to the handler of base/error.hpp.
// LDI_STANDARD_ONLY       disables the extensions of GCC and clang: vector types, and kernels for specific instruction sets.
//                         Scalar code then computes everything, as it always does with other compilers.
// LDI_CONFIGURATION       name of the inline namespace that contains all of ldi, such as v0_1_0 or v0_1_0_ndebug_avx2_fma. Do
//                         not define it.
//
// Translation units of one program may be compiled with different settings: the namespace separates their code, which the linker
// would otherwise merge. Types of one configuration therefore differ from those of another, so an ldi::error thrown in one
// configuration can be caught in another only as std::runtime_error. Each configuration has its own error handler and its own
// current memory per thread. Settings that change the layout of the standard library's types, such as _GLIBCXX_DEBUG, must be the
// same everywhere.
#pragma once

#include <ldi/version.hpp>

#include <cassert>

#if !defined(LDI_STANDARD_ONLY) && defined(__GNUC__)
#define LDI_HAS_EXTENSIONS 1
#define LDI_STANDARD_PART
#else
#define LDI_HAS_EXTENSIONS 0
#define LDI_STANDARD_PART _standard
#endif

// ---- parts of the namespace's name

#if defined(LDI_ASSERT)
#define LDI_ASSERTION_PART _own_assert
#elif defined(NDEBUG)
#define LDI_ASSERTION_PART _ndebug
#else
#define LDI_ASSERTION_PART
#endif

#ifndef LDI_ASSERT
#define LDI_ASSERT(condition) assert(condition)
#endif

#ifndef LDI_HAS_EXCEPTIONS
#if defined(__cpp_exceptions) || defined(__EXCEPTIONS) || defined(_CPPUNWIND)
#define LDI_HAS_EXCEPTIONS 1
#else
#define LDI_HAS_EXCEPTIONS 0
#endif
#endif

#if LDI_HAS_EXCEPTIONS
#define LDI_EXCEPTION_PART
#else
#define LDI_EXCEPTION_PART _no_exceptions
#endif

// Instructions that the compiler may use anywhere in this translation unit.
#if defined(__AVX512VBMI__)
#define LDI_VECTOR_PART _avx512vbmi
#elif defined(__AVX512VL__)
#define LDI_VECTOR_PART _avx512vl
#elif defined(__AVX512F__)
#define LDI_VECTOR_PART _avx512
#elif defined(__AVX2__)
#define LDI_VECTOR_PART _avx2
#elif defined(__AVX__)
#define LDI_VECTOR_PART _avx
#elif defined(__SSE4_2__)
#define LDI_VECTOR_PART _sse4_2
#elif defined(__SSE4_1__)
#define LDI_VECTOR_PART _sse4_1
#elif defined(__SSSE3__)
#define LDI_VECTOR_PART _ssse3
#elif defined(__SSE3__)
#define LDI_VECTOR_PART _sse3
#elif defined(__ARM_FEATURE_SVE)
#define LDI_VECTOR_PART _sve
#elif defined(__wasm_relaxed_simd__)
#define LDI_VECTOR_PART _relaxed_simd
#elif defined(__wasm_simd128__)
#define LDI_VECTOR_PART _simd
#else
#define LDI_VECTOR_PART
#endif

#if defined(__AVX512VNNI__) || defined(__AVXVNNI__) || defined(__ARM_FEATURE_DOTPROD)
#define LDI_DOT_PRODUCT_PART _dot
#else
#define LDI_DOT_PRODUCT_PART
#endif

#if defined(__FMA__) || defined(__FMA4__)
#define LDI_FMA_PART _fma
#else
#define LDI_FMA_PART
#endif

#if defined(__BMI__) || defined(__BMI2__) || defined(__LZCNT__) || defined(__ARM_FEATURE_ATOMICS)
#define LDI_BIT_PART _bmi
#elif defined(__POPCNT__)
#define LDI_BIT_PART _popcnt
#else
#define LDI_BIT_PART
#endif

#if defined(__FAST_MATH__)
#define LDI_MATH_PART _fast_math
#elif defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__
#define LDI_MATH_PART _finite_math  // the compiler removes checks for NaN
#else
#define LDI_MATH_PART
#endif

#if defined(__GNUC__) && !defined(__GXX_RTTI) || defined(_MSC_VER) && !defined(_CPPRTTI)
#define LDI_TYPE_INFO_PART _no_rtti
#else
#define LDI_TYPE_INFO_PART
#endif

#define LDI_JOIN(a, b, c, d, e, f, g, h, i, j, k, l) v##a##_##b##_##c##d##e##f##g##h##i##j##k##l
#define LDI_JOIN_VALUES(a, b, c, d, e, f, g, h, i, j, k, l) LDI_JOIN(a, b, c, d, e, f, g, h, i, j, k, l)
#define LDI_CONFIGURATION                                                                                                 \
    LDI_JOIN_VALUES(LDI_VERSION_MAJOR, LDI_VERSION_MINOR, LDI_VERSION_PATCH, LDI_EXCEPTION_PART, LDI_ASSERTION_PART,      \
                    LDI_TYPE_INFO_PART, LDI_VECTOR_PART, LDI_DOT_PRODUCT_PART, LDI_FMA_PART, LDI_BIT_PART, LDI_MATH_PART, \
                    LDI_STANDARD_PART)
