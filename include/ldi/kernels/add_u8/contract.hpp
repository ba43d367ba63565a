// Contract of the kernels of kernels/add_u8.hpp: their inputs and results.
#pragma once

#include <ldi/kernels/isa.hpp>
#include <ldi/kernels/prepared.hpp>
#include <ldi/kernels/requantize.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Constants of an addition.
struct add_u8_data {
    using value_type = std::uint8_t;

    isa target = isa::scalar;
    quantized_addition exact;
    bool is_float = false;  ///< whether the kernel computes the float form, which then equals `exact` on all pairs of values
    /// Constants of the float form `clamp(round_to_even(fma(a, a_scale, fma(b, b_scale, offset))))`. WebAssembly has no fma and
    /// also rounds the products. Scalar and NEON do not use the constants.
    float a_scale = 0, b_scale = 0, offset = 0;
};

/// Made by prepare_add_u8().
using add_u8_constants = prepared<add_u8_data>;

/// One instruction set's kernel: a row of `add_u8_kernels`.
struct add_u8_kernel {
    isa set;
    bool has_float_form;  ///< whether the kernel has the float form, which is faster than the integer form
    /// Same parameters as add_u8() of kernels/add_u8.hpp.
    void (*run)(const add_u8_data& sum, const std::uint8_t* a, const std::uint8_t* b, std::size_t count, std::uint8_t* result);
};

}}  // namespace ldi
