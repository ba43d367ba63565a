// Counts the groups of prefix codes in a lossless WebP picture before libwebp decodes it. libwebp allocates tables for every
// group, and a small file may have 65,536 groups. Reference: RFC 9649, "WebP Image Format", sections 3.4 to 3.8.
#pragma once

#include <ldi/base/buffer.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Reads the part of a lossless picture that precedes its pixels. Stops at the first error, which libwebp then reports.
class lossless_webp {
public:
    /// stream         a VP8L chunk after its header of 5 bytes, or an ALPH chunk after its header of 1 byte
    /// width, height  size of the picture in pixels
    lossless_webp(std::span<const std::byte> stream, std::size_t width, std::size_t height) : bytes_(stream) {
        for (int transforms = 0; bits(1) != 0 && transforms < 4; ++transforms) {
            const std::uint32_t kind = bits(2);
            if (kind < 2) {
                skip_blocks(width, height);
            } else if (kind == 3) {  // a palette; small palettes pack several pixels into one
                const std::size_t colors = bits(8) + 1;
                read_picture(colors);
                width = divided(width, colors <= 2 ? 3 : colors <= 4 ? 2 : colors <= 16 ? 1 : 0);
            }
        }
        cache_bits_ = bits(1) != 0 ? bits(4) : 0;
        if (bits(1) != 0) groups_ = skip_blocks(width, height) + 1;
    }

    /// Upper bound of the memory for libwebp's tables, in bytes.
    std::size_t table_bytes() const {
        // Per group, entries of 4 bytes: at most 2,300 for four codes of bytes and distances, 654 + 2^cache_bits for the fifth;
        // also a structure of 600 bytes.
        return groups_ * (600 + 4 * (2300 + 656 + (std::size_t{1} << (std::min)(cache_bits_, 11U))));
    }

private:
    /// A canonical prefix code: the number of symbols of each length, and all symbols in the order of their codes.
    struct prefix_code {
        std::array<std::uint16_t, 16> count{};
        buffer<std::uint16_t> symbols;
    };

    static std::size_t divided(std::size_t size, std::uint32_t bits) { return (size + (std::size_t{1} << bits) - 1) >> bits; }

    bool is_over() const { return at_ > 8 * bytes_.size(); }

    std::uint32_t bits(std::uint32_t count) {
        std::uint32_t value = 0;
        for (std::uint32_t i = 0; i < count; ++i, ++at_)
            if (at_ < 8 * bytes_.size()) value |= ((std::to_integer<std::uint32_t>(bytes_[at_ / 8]) >> (at_ % 8)) & 1U) << i;
        return value;
    }

    prefix_code code_of(std::span<const std::uint8_t> lengths) {
        prefix_code code;
        for (const std::uint8_t length : lengths) ++code.count[length];
        code.count[0] = 0;
        std::array<std::size_t, 16> next{};
        for (std::size_t length = 1; length < 16; ++length) next[length] = next[length - 1] + code.count[length - 1];
        code.symbols.resize(next[15] + code.count[15]);
        for (std::size_t symbol = 0; symbol < lengths.size(); ++symbol)
            if (lengths[symbol] != 0) code.symbols[next[lengths[symbol]]++] = static_cast<std::uint16_t>(symbol);
        return code;
    }

    std::uint32_t next_symbol(const prefix_code& code) {
        if (code.symbols.size() <= 1) return code.symbols.empty() ? 0 : code.symbols[0];  // takes no bits
        std::uint32_t value = 0, first = 0, index = 0;
        for (std::size_t length = 1; length < 16; ++length) {
            value = 2 * value + bits(1), first *= 2;
            if (value < first + code.count[length]) return value >= first ? code.symbols[index + value - first] : give_up();
            first += code.count[length], index += code.count[length];
        }
        return give_up();
    }

    std::uint32_t give_up() {
        at_ = 8 * bytes_.size() + 1;
        return 0;
    }

    prefix_code read_code(std::size_t alphabet) {
        buffer<std::uint8_t> lengths(alphabet, std::uint8_t{0});
        if (bits(1) != 0) {  // one or two symbols
            const bool has_two = bits(1) != 0;
            const std::uint32_t first = bits(bits(1) != 0 ? 8 : 1), second = has_two ? bits(8) : first;
            for (const std::size_t symbol : {first, second}) lengths[(std::min)(symbol, alphabet - 1)] = 1;
            return code_of(lengths);
        }
        constexpr std::array<std::uint8_t, 19> order{17, 18, 0, 1, 2, 3, 4, 5, 16, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15};
        std::array<std::uint8_t, 19> length_of_length{};
        const std::uint32_t known = 4 + bits(4);
        for (std::uint32_t i = 0; i < known && i < order.size(); ++i)
            length_of_length[order[i]] = static_cast<std::uint8_t>(bits(3));
        const prefix_code code = code_of(length_of_length);
        std::size_t left = alphabet;
        if (bits(1) != 0) left = 2 + bits(2 + 2 * bits(3));
        std::uint8_t previous = 8;
        for (std::size_t symbol = 0; symbol < alphabet && left > 0 && !is_over(); --left) {
            const std::uint32_t length = next_symbol(code);
            if (length < 16) {
                lengths[symbol++] = static_cast<std::uint8_t>(length);
                if (length != 0) previous = static_cast<std::uint8_t>(length);
                continue;
            }
            const std::size_t repeats = length == 16 ? 3 + bits(2) : length == 17 ? 3 + bits(3) : 11 + bits(7);
            const std::size_t end = (std::min)(symbol + repeats, alphabet);
            std::fill(lengths.begin() + symbol, lengths.begin() + end, length == 16 ? previous : std::uint8_t{0});
            symbol = end;
        }
        return code_of(lengths);
    }

    /// Returns the value that a prefix and the bits after it encode.
    std::size_t copied(std::uint32_t prefix) {
        if (prefix < 4) return prefix + 1;
        const std::uint32_t extra = (prefix - 2) / 2;
        return (std::size_t{2 + prefix % 2} << extra) + bits(extra) + 1;
    }

    /// Skips a picture that has one value for each block of a larger picture. Returns the largest value (see read_picture()).
    std::size_t skip_blocks(std::size_t width, std::size_t height) {
        const std::uint32_t block = bits(3) + 2;
        return read_picture(divided(width, block) * divided(height, block));
    }

    /// Reads a picture with a single group of codes. Returns the largest value of its red and green samples, as one number of 16
    /// bits. Copied pixels cannot have a larger value than the pixels that they copy.
    std::size_t read_picture(std::size_t pixels) {
        const std::size_t cache = bits(1) != 0 ? std::size_t{1} << (std::min)(bits(4), 11U) : 0;
        const prefix_code green = read_code(280 + cache), red = read_code(256), blue = read_code(256), alpha = read_code(256),
                          distance = read_code(40);
        std::size_t largest = 0;
        for (std::size_t i = 0; i < pixels && !is_over();) {
            const std::size_t before = at_;
            const std::uint32_t symbol = next_symbol(green);
            if (symbol < 256) {
                largest = (std::max)(largest, std::size_t{256 * next_symbol(red) + symbol});
                next_symbol(blue), next_symbol(alpha);
                ++i;
            } else if (symbol < 280) {
                i += copied(symbol - 256);
                copied(next_symbol(distance));
            } else {
                ++i;
            }
            if (at_ == before) break;  // no symbol takes bits, so all pixels are equal
        }
        return largest;
    }

    std::span<const std::byte> bytes_;
    std::size_t at_ = 0;  // in bits
    std::uint32_t cache_bits_ = 0;
    std::size_t groups_ = 1;
};

}}}  // namespace ldi::detail
