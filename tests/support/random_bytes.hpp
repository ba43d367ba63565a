// Random numbers for tests of kernels.
#pragma once

#include <ldi/kernels/isa.hpp>

#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

namespace ldi::testing {

struct random_bytes {
    std::mt19937 engine{1};

    int in(int least, int most) { return std::uniform_int_distribution<int>(least, most)(engine); }
    std::size_t size_in(int least, int most) { return static_cast<std::size_t>(in(least, most)); }
    std::uint8_t byte(int least = 0, int most = 255) { return static_cast<std::uint8_t>(in(least, most)); }
    ldi::buffer<std::uint8_t> bytes(std::size_t count, int least = 0, int most = 255) {
        ldi::buffer<std::uint8_t> result(count);
        for (std::uint8_t& value : result) value = byte(least, most);
        return result;
    }
    ldi::buffer<std::int32_t> integers(std::size_t count, int least, int most) {
        ldi::buffer<std::int32_t> result(count);
        for (std::int32_t& value : result) value = in(least, most);
        return result;
    }
};

/// Every instruction set of this machine, scalar first.
inline std::vector<ldi::isa> available_isas() {
    std::vector<ldi::isa> sets;
    for (const ldi::instruction_set& set : ldi::instruction_sets)
        if (ldi::is_available(set.id)) sets.push_back(set.id);
    return sets;
}

}  // namespace ldi::testing
