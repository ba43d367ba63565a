// kernels/add_u8.hpp in portable C++.
#pragma once

#include <ldi/kernels/add_u8/contract.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace scalar {

inline void add_u8(const add_u8_data& sum, const std::uint8_t* a, const std::uint8_t* b, std::size_t count,
                   std::uint8_t* result) {
    for (std::size_t i = 0; i < count; ++i) result[i] = add_quantized(a[i], b[i], sum.exact);
}

}}}  // namespace ldi::scalar
