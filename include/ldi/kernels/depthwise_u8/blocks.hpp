// Blocks of 16 channels, for kernels that first interleave the columns of three rows in memory.
#pragma once

#include <ldi/kernels/depthwise_u8/contract.hpp>

#include <cstddef>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

inline constexpr std::size_t depthwise_block = 16;

inline std::size_t depthwise_blocks(const depthwise_u8_weights& weights) {
    return (weights.channels + depthwise_block - 1) / depthwise_block;
}

/// First channel of a block. The last block overlaps the one before it, so that it is full.
inline std::size_t block_start(std::size_t channels, std::size_t block) {
    if (channels < depthwise_block) return 0;
    return block * depthwise_block + depthwise_block <= channels ? block * depthwise_block : channels - depthwise_block;
}

}}}  // namespace ldi::detail
