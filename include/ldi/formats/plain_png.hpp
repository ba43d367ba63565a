// Writes PNG files with the standard library alone, so that callers need no encoder for textures. Filters the rows and encodes
// their bytes with one Huffman code, without searching for repetitions. Photographs become 4 to 15 % larger than with libpng
// (io/picture.hpp). Pictures with large uniform areas become many times larger. Uncompressed (stored) blocks would need less
// code, but would double the size of the file. For example, the file of the crop examples/learn/archway.ppm would have 166 kB
// instead of 82 kB. PNG: ISO/IEC 15948; zlib: RFC 1950; deflate: RFC 1951.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/formats/checksums.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Encodes an H x W x 1 or H x W x 3 picture with at least one pixel as PNG. Raises mismatch for any other number of channels and
/// for a picture without pixels, and too_large beyond 1 GB.
buffer<std::byte> encode_plain_png(image_view<const std::uint8_t> picture);

namespace detail::plain_png {

/// Symbols of the Huffman code: the 256 byte values and the end of the data.
inline constexpr std::size_t symbols = 257, end_of_data = 256;
inline constexpr int max_code_length = 15;

/// Returns the neighbor closest to left + upper - upper left.
inline int paeth(int left, int upper, int upper_left) {
    const int to_left = std::abs(upper - upper_left), to_upper = std::abs(left - upper_left);
    const int to_upper_left = std::abs(left + upper - 2 * upper_left);
    if (to_left <= to_upper && to_left <= to_upper_left) return left;
    return to_upper <= to_upper_left ? upper : upper_left;
}

/// Applies one of PNG's filters, 0 to 4, to row y: stores the differences between the values and their predictions from
/// neighbors. Returns the sum of the absolute differences.
template <int filter>
std::size_t filter_row(image_view<const std::uint8_t> picture, std::size_t y, std::byte* to) {
    const std::size_t channels = picture.channels(), values = picture.width() * channels;
    const std::uint8_t *const row = picture.row(y), *const above = y == 0 ? nullptr : picture.row(y - 1);
    std::size_t sum = 0;
    for (std::size_t i = 0; i < values; ++i) {
        const int left = i < channels ? 0 : row[i - channels], upper = above == nullptr ? 0 : above[i];
        const int upper_left = above == nullptr || i < channels ? 0 : above[i - channels];
        const int predicted = filter == 0   ? 0
                              : filter == 1 ? left
                              : filter == 2 ? upper
                              : filter == 3 ? (left + upper) / 2
                                            : paeth(left, upper, upper_left);
        const std::uint8_t difference = static_cast<std::uint8_t>(row[i] - predicted);
        to[i] = std::byte{difference};
        sum += difference < 128 ? difference : 256U - difference;
    }
    return sum;
}

/// Filters each row with the filter that minimizes the sum of absolute differences. The number of the filter precedes the row.
inline buffer<std::byte> filtered(image_view<const std::uint8_t> picture) {
    const std::size_t values = picture.width() * picture.channels();
    buffer<std::byte> result(picture.height() * (values + 1), unset), tried(values, unset);
    for (std::size_t y = 0; y < picture.height(); ++y) {
        std::byte* const row = result.data() + y * (values + 1);
        std::size_t smallest = SIZE_MAX;
        const auto try_filter = [&]<int filter>(std::integral_constant<int, filter>) {
            const std::size_t sum = filter_row<filter>(picture, y, tried.data());
            if (sum >= smallest) return;
            smallest = sum;
            row[0] = std::byte{filter};
            std::memcpy(row + 1, tried.data(), values);
        };
        const auto try_all = [&]<int... filters>(std::integer_sequence<int, filters...>) {
            (try_filter(std::integral_constant<int, filters>{}), ...);
        };
        try_all(std::make_integer_sequence<int, 5>{});
    }
    return result;
}

/// Computes the code lengths of a Huffman code from symbol counts, of which at least two must be positive. Symbols that do not
/// occur have length 0.
inline std::array<int, symbols> huffman_lengths(const std::array<std::size_t, symbols>& counts) {
    struct node {
        std::size_t count, symbol;  // only leaves have a symbol
        std::size_t parent;
    };
    std::array<node, 2 * symbols> nodes;
    std::size_t leaves = 0;
    for (std::size_t s = 0; s < symbols; ++s)
        if (counts[s] > 0) nodes[leaves++] = {counts[s], s, 0};
    std::sort(nodes.data(), nodes.data() + leaves,
              [](const node& a, const node& b) { return std::pair(a.count, a.symbol) < std::pair(b.count, b.symbol); });
    // Like the sorted leaves, inner nodes are created in ascending order of their counts, so the smallest remaining node is
    // either the next leaf or the next inner node.
    std::size_t next_leaf = 0, next_inner = leaves, count = leaves;
    const auto take_smallest = [&] {
        const bool is_leaf = next_inner == count || (next_leaf < leaves && nodes[next_leaf].count <= nodes[next_inner].count);
        const std::size_t taken = is_leaf ? next_leaf++ : next_inner++;
        nodes[taken].parent = count;
        return nodes[taken].count;
    };
    while (count < 2 * leaves - 1) {
        const std::size_t first = take_smallest(), second = take_smallest();
        nodes[count++] = {first + second, 0, 0};
    }
    std::array<int, 2 * symbols> depth{};
    std::array<int, symbols> lengths{};
    for (std::size_t i = count - 1; i-- > 0;) {
        depth[i] = depth[nodes[i].parent] + 1;
        if (i < leaves) lengths[nodes[i].symbol] = depth[i];
    }
    return lengths;
}

/// Computes code lengths of at most 15 bits, the limit of deflate.
inline std::array<int, symbols> code_lengths(std::array<std::size_t, symbols> counts) {
    for (;;) {
        const std::array<int, symbols> lengths = huffman_lengths(counts);
        if (*std::max_element(lengths.begin(), lengths.end()) <= max_code_length) return lengths;
        for (std::size_t& count : counts)
            count = (count + 1) / 2;  // reduces the ratios between counts; positive counts stay positive
    }
}

/// Writes the lowest 32 bits of a number, highest byte first.
inline void put_big_endian(std::byte* to, std::size_t value) {
    for (int i = 0; i < 4; ++i) to[i] = static_cast<std::byte>(value >> (24 - 8 * i) & 255);
}

/// Packs codes of up to 32 bits into bytes, lowest bit first.
class bit_writer {
public:
    explicit bit_writer(buffer<std::byte>& to) : to_(to) {}

    void put(std::uint32_t bits, int count) {
        waiting_ |= std::uint64_t{bits} << waiting_bits_;
        for (waiting_bits_ += count; waiting_bits_ >= 8; waiting_bits_ -= 8, waiting_ >>= 8)
            to_.push_back(static_cast<std::byte>(waiting_ & 255));
    }
    /// Writes the last bits, padded with zeros to a whole byte.
    void finish() { put(0, (8 - waiting_bits_) % 8); }

private:
    buffer<std::byte>& to_;
    std::uint64_t waiting_ = 0;
    int waiting_bits_ = 0;
};

/// Reverses a code, because deflate stores codes highest bit first.
inline std::uint32_t reversed(std::uint32_t code, int bits) {
    std::uint32_t result = 0;
    for (int bit = 0; bit < bits; ++bit) result |= (code >> bit & 1) << (bits - 1 - bit);
    return result;
}

/// Assigns codes by length as deflate does: shorter codes first, equal lengths in the order of symbols.
inline std::array<std::uint32_t, symbols> codes_of(const std::array<int, symbols>& lengths) {
    std::array<std::uint32_t, symbols> codes{};
    std::uint32_t code = 0;
    for (int length = 1; length <= max_code_length; ++length, code <<= 1)
        for (std::size_t s = 0; s < symbols; ++s)
            if (lengths[s] == length) codes[s] = reversed(code++, length);
    return codes;
}

/// Appends a zlib stream of one deflate block.
inline void append_compressed(std::span<const std::byte> bytes, buffer<std::byte>& to) {
    std::array<std::size_t, symbols> counts{};
    for (const std::byte byte : bytes) ++counts[std::to_integer<std::size_t>(byte)];
    counts[end_of_data] = 1;
    const std::array<int, symbols> lengths = code_lengths(counts);
    const std::array<std::uint32_t, symbols> codes = codes_of(lengths);

    to.push_back(std::byte{0x78}), to.push_back(std::byte{0x01});
    bit_writer writer(to);
    writer.put(0b101, 3);  // the last block, with its own Huffman codes
    // The block states 257 code lengths and the length of one distance code, which is unused. In this block, the code for
    // lengths assigns 4 bits to each of the lengths 0 to 15, so each length is written as a 4-bit number. The symbols 16, 17
    // and 18 are unused.
    writer.put(0, 5), writer.put(0, 5), writer.put(15, 4);
    for (int i = 0; i < 19; ++i) writer.put(i < 3 ? 0 : 4, 3);
    for (const int length : lengths) writer.put(reversed(static_cast<std::uint32_t>(length), 4), 4);
    writer.put(0, 4);
    for (const std::byte byte : bytes) {
        const std::size_t symbol = std::to_integer<std::size_t>(byte);
        writer.put(codes[symbol], lengths[symbol]);
    }
    writer.put(codes[end_of_data], lengths[end_of_data]);
    writer.finish();
    to.resize(to.size() + 4);
    put_big_endian(to.end() - 4, adler32(bytes));
}

/// Appends a chunk. Calls append_body() to append the chunk's content.
template <class AppendBody>
void append_chunk(buffer<std::byte>& file, std::string_view type, AppendBody&& append_body) {
    const std::size_t begin = file.size();
    file.resize(begin + 8);
    std::memcpy(file.data() + begin + 4, type.data(), 4);
    append_body();
    const std::size_t end = file.size();
    put_big_endian(file.data() + begin, end - begin - 8);
    const std::uint32_t checksum = crc32({file.data() + begin + 4, end - begin - 4});
    file.resize(end + 4);
    put_big_endian(file.data() + end, checksum);
}

}  // namespace detail::plain_png

inline buffer<std::byte> encode_plain_png(image_view<const std::uint8_t> picture) {
    using namespace detail::plain_png;
    if (picture.empty() || (picture.channels() != 1 && picture.channels() != 3))
        raise(error_code::mismatch, "encode_plain_png", "H x W x 1 or H x W x 3 values, at least one pixel",
              detail::shape_text(picture));
    constexpr std::size_t max_bytes = std::size_t{1} << 30;
    if (picture.width() > max_bytes / picture.channels() / picture.height() || picture.height() > max_bytes / 2)
        raise(error_code::too_large, "encode_plain_png", "a picture below 1 GB",
              std::to_string(picture.width()) + " x " + std::to_string(picture.height()) + " pixels");
    constexpr std::string_view signature = "\x89PNG\r\n\x1A\n";
    buffer<std::byte> file(signature.size());
    std::memcpy(file.data(), signature.data(), signature.size());
    append_chunk(file, "IHDR", [&] {
        const std::size_t begin = file.size();
        file.resize(begin + 13);  // the last three bytes stay 0: compression method 0, filter method 0, not interlaced
        put_big_endian(file.data() + begin, picture.width());
        put_big_endian(file.data() + begin + 4, picture.height());
        file[begin + 8] = std::byte{8};                                                            // bit depth
        file[begin + 9] = std::byte{picture.channels() == 3 ? std::uint8_t{2} : std::uint8_t{0}};  // RGB or gray
    });
    append_chunk(file, "IDAT", [&] { append_compressed(filtered(picture), file); });
    append_chunk(file, "IEND", [] {});
    return file;
}

}}  // namespace ldi
