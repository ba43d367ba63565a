// Checksums for PNG and zlib: CRC-32 (ISO 3309, RFC 1952) and Adler-32 (RFC 1950).
#pragma once

#include <ldi/base/config.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {

/// Row k contains the CRC remainder of each byte value followed by k zero bytes. With eight rows, crc32() processes eight
/// bytes at a time.
using crc32_rows = std::array<std::array<std::uint32_t, 256>, 8>;

inline crc32_rows make_crc32_rows() {
    crc32_rows rows{};
    for (std::uint32_t byte = 0; byte < 256; ++byte) {
        std::uint32_t remainder = byte;
        for (int bit = 0; bit < 8; ++bit) remainder = (remainder >> 1) ^ ((remainder & 1) != 0 ? 0xEDB88320 : 0);
        rows[0][byte] = remainder;
    }
    for (std::size_t row = 1; row < 8; ++row)
        for (std::size_t byte = 0; byte < 256; ++byte)
            rows[row][byte] = (rows[row - 1][byte] >> 8) ^ rows[0][rows[row - 1][byte] & 255];
    return rows;
}

}  // namespace detail

/// Continues a CRC-32 with more bytes. Returns the checksum of the preceding bytes and these bytes.
///
/// before  checksum of the preceding bytes; 0 if there are none
inline std::uint32_t crc32(std::span<const std::byte> bytes, std::uint32_t before = 0) {
    static const detail::crc32_rows rows = detail::make_crc32_rows();
    const auto at = [&](std::size_t i) { return std::to_integer<std::uint32_t>(bytes[i]); };
    std::uint32_t remainder = ~before;
    std::size_t i = 0;
    for (; i + 8 <= bytes.size(); i += 8) {
        const std::uint32_t first = remainder ^ (at(i) | at(i + 1) << 8 | at(i + 2) << 16 | at(i + 3) << 24);
        remainder = rows[7][first & 255] ^ rows[6][first >> 8 & 255] ^ rows[5][first >> 16 & 255] ^ rows[4][first >> 24] ^
                    rows[3][at(i + 4)] ^ rows[2][at(i + 5)] ^ rows[1][at(i + 6)] ^ rows[0][at(i + 7)];
    }
    for (; i < bytes.size(); ++i) remainder = (remainder >> 8) ^ rows[0][(remainder ^ at(i)) & 255];
    return ~remainder;
}

/// Returns the Adler-32 of the bytes.
inline std::uint32_t adler32(std::span<const std::byte> bytes) {
    constexpr std::uint32_t modulus = 65521;
    constexpr std::size_t max_at_once = 5552;  // with more bytes, sum_of_sums could overflow
    std::uint32_t sum = 1, sum_of_sums = 0;
    while (!bytes.empty()) {
        const std::size_t count = (std::min)(bytes.size(), max_at_once);
        for (const std::byte byte : bytes.first(count)) sum += std::to_integer<std::uint32_t>(byte), sum_of_sums += sum;
        sum %= modulus, sum_of_sums %= modulus;
        bytes = bytes.subspan(count);
    }
    return sum_of_sums << 16 | sum;
}

}}  // namespace ldi
