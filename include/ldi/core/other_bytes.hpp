// Visits the few values of a byte column that differ from the usual value, such as the unknown pixels of a photo.
#pragma once

#include <ldi/base/array_view.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Calls see(i) for each i with values[i] != usual, in ascending order. Skips eight usual values at a time.
template <class See>
void for_each_other_byte(array_view<const std::uint8_t> values, std::uint8_t usual, See&& see) {
    const std::uint8_t* const value = values.data();
    const std::int32_t count = values.count();
    std::uint64_t all_usual = 0;
    std::memset(&all_usual, usual, sizeof(all_usual));
    std::int32_t i = 0;
    for (std::uint64_t word = 0; i + 8 <= count; i += 8) {
        std::memcpy(&word, value + i, sizeof(word));
        for (std::int32_t k = i; word != all_usual && k < i + 8; ++k)
            if (value[k] != usual) see(k);
    }
    for (; i < count; ++i)
        if (value[i] != usual) see(i);
}

/// Calls see(i) for each i with known[i] == 0, in ascending order.
template <class See>
void for_each_unknown(array_view<const std::uint8_t> known, See&& see) {
    for_each_other_byte(known, 1, [&](std::int32_t i) {
        if (known[i] == 0) see(i);
    });
}

}}  // namespace ldi
