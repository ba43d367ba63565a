// kernels/gemm_u8.hpp in portable C++.
#pragma once

#include <ldi/kernels/detail/scalar_tiles.hpp>
#include <ldi/kernels/gemm_u8/contract.hpp>

#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace scalar {

inline void pack_gemm_u8(gemm_u8_data& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    detail::append_weights(packed.wide, packed, weights, weight_zero_point, 1, panels);
}

inline void gemm_u8(const gemm_u8_data& weights, const std::uint8_t* const* segments, std::size_t pixel_stride,
                    std::size_t pixels, std::uint8_t* result) {
    const auto store = [&weights, result](std::size_t p, std::size_t o, std::int32_t sum) {
        result[p * weights.outputs + o] = requantize(sum, weights.output);
    };
    compute_tiles(
        {weights.outputs, weights.segments, weights.inputs}, segments, pixel_stride, pixels, weights.wide.data(),
        [bias = weights.bias.data()](std::size_t o) { return bias[o]; }, store);
}

}}}  // namespace ldi::scalar
