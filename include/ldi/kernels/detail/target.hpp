// Compiles code for several instruction sets in one header, independently of the user's compiler flags. Functions between
// LDI_BEGIN_TARGET("features") and LDI_END_TARGET are compiled for the named processor features in every translation unit. Code
// between the two macros must not contain lambdas or standard templates over vector types. If it calls a function that uses
// intrinsics, that function must also be between the macros. Write loops over registers as fold expressions: g++ 12 keeps an
// array in registers only if every index is a constant.
#pragma once

#include <ldi/base/config.hpp>

#if LDI_HAS_EXTENSIONS && (defined(__x86_64__) || defined(__i386__))
#define LDI_HAS_X86_KERNELS 1
#include <immintrin.h>
#else
#define LDI_HAS_X86_KERNELS 0
#endif

#if LDI_HAS_EXTENSIONS && defined(__AARCH64EL__)
#define LDI_HAS_ARM_KERNELS 1
#include <arm_neon.h>
#else
#define LDI_HAS_ARM_KERNELS 0
#endif

#if LDI_HAS_EXTENSIONS && defined(__wasm_simd128__)
#define LDI_HAS_WASM_KERNELS 1
#include <wasm_simd128.h>
#else
#define LDI_HAS_WASM_KERNELS 0
#endif

#define LDI_PRAGMA(text) _Pragma(#text)

#if defined(__clang__)
#define LDI_BEGIN_TARGET(features) LDI_PRAGMA(clang attribute push(__attribute__((target(features))), apply_to = function))
#define LDI_END_TARGET LDI_PRAGMA(clang attribute pop)
#else
// g++ 12 warns about values that its own intrinsics leave undefined on purpose. Its partial redundancy elimination copies every
// sum of a matrix product to the stack, which halves the speed. Its scheduling before register allocation, on by default for Arm,
// loads all weights of a tile early and therefore spills them.
#define LDI_BEGIN_TARGET(features)                            \
    LDI_PRAGMA(GCC push_options)                              \
    LDI_PRAGMA(GCC target(features))                          \
    LDI_PRAGMA(GCC optimize("no-tree-pre,no-schedule-insns")) \
    LDI_PRAGMA(GCC diagnostic push)                           \
    LDI_PRAGMA(GCC diagnostic ignored "-Wuninitialized") LDI_PRAGMA(GCC diagnostic ignored "-Wmaybe-uninitialized")
#define LDI_END_TARGET LDI_PRAGMA(GCC diagnostic pop) LDI_PRAGMA(GCC pop_options)
#endif

#if LDI_HAS_X86_KERNELS
#define LDI_AVX2_FEATURES "avx2,fma"
#define LDI_AVX_VNNI_FEATURES "avx2,fma,avxvnni"
#define LDI_AVX512VNNI_FEATURES "avx2,fma,avx512f,avx512bw,avx512vl,avx512vnni"
#endif
#if LDI_HAS_ARM_KERNELS
#if defined(__clang__)
#define LDI_NEON_FEATURES "dotprod"
#elif __ARM_ARCH >= 9  // armv8.2-a would be a lower architecture, and g++ would warn about one of its own macros
#define LDI_NEON_FEATURES "+dotprod"
#else
#define LDI_NEON_FEATURES "arch=armv8.2-a+dotprod"
#endif
#endif
