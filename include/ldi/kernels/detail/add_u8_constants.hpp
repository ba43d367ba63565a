// What one quantized addition needs to know: see kernels/add_u8.hpp.
#pragma once

#include <ldi/kernels/isa.hpp>
#include <ldi/kernels/requantize.hpp>

namespace ldi {

/// Only prepare_add_u8() makes sound ones.
struct add_u8_constants {
    isa target = isa::scalar;
    quantized_addition exact;
    /// Not used by scalar and NEON: `clamp(round_to_even(fma(a, a_scale, fma(b, b_scale, offset))))`.
    float a_scale = 0, b_scale = 0, offset = 0;
};

}  // namespace ldi
