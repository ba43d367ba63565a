// Deterministic pseudorandom bits, for noise and choices that depend only on a position.
#pragma once

#include <ldi/base/config.hpp>

#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Combines two numbers and applies the finalizer of MurmurHash3 (Austin Appleby, public domain).
constexpr std::uint32_t hash(std::uint32_t a, std::uint32_t b) {
    std::uint32_t h = a * 0x9E3779B1U ^ b * 0x85EBCA77U ^ 0x27D4EB2FU;
    h = (h ^ h >> 16) * 0x85EBCA6BU;
    h = (h ^ h >> 13) * 0xC2B2AE35U;
    return h ^ h >> 16;
}

}}}  // namespace ldi::detail
