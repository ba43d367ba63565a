// Limits the number of deflate blocks in PNG files. stb_image builds two tables for each block, which takes about a microsecond,
// even if the block is empty and occupies only 10 bits. Deflate: RFC 1951.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/formats/picture_header.hpp>

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>

#if __has_include(<zlib.h>)  // the page's converter is built without zlib
#include <array>

#include <zlib.h>
#endif

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Maximum number of deflate blocks in the picture of a PNG file. Encoders write fewer than 100,000 for a picture of 48
/// megapixels.
inline constexpr std::size_t max_png_blocks = 1'000'000;

/// Maximum number of deflate blocks in a color profile. Encoders write fewer than 1,000.
inline constexpr std::size_t max_profile_blocks = 50'000;

#if __has_include(<zlib.h>)

/// Counts the deflate blocks of a zlib stream that arrives in parts.
class deflate_block_counter {
public:
    /// max_blocks  the counter stops after one block more
    explicit deflate_block_counter(std::size_t max_blocks) : max_blocks_(max_blocks) {
        constexpr int any_window_without_header = -15;
        is_ready_ = inflateInit2(&stream_, any_window_without_header) == Z_OK;
    }
    deflate_block_counter(const deflate_block_counter&) = delete;
    deflate_block_counter& operator=(const deflate_block_counter&) = delete;
    ~deflate_block_counter() { inflateEnd(&stream_); }

    /// Inflates the next part. Returns false if memory runs out, or the data is damaged.
    bool read(std::span<const std::byte> part) {
        const std::size_t header = (std::min)(part.size(), header_left_);
        header_left_ -= header;
        part = part.subspan(header);
        stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(part.data()));  // zlib does not write to it
        stream_.avail_in = static_cast<uInt>(part.size());
        while (is_ready_ && !has_ended_ && stream_.avail_in > 0 && blocks_ <= max_blocks_) {
            stream_.next_out = inflated_.data();
            stream_.avail_out = static_cast<uInt>(inflated_.size());
            const int result = inflate(&stream_, Z_BLOCK);
            has_ended_ = result == Z_STREAM_END;
            if (result != Z_OK && !has_ended_) return false;
            if (has_ended_ || (stream_.data_type & 128) != 0) ++blocks_;  // 128: zlib stopped at the end of a block
        }
        return is_ready_;
    }

    std::size_t blocks() const { return blocks_; }

private:
    z_stream stream_ = {};
    std::array<Bytef, 32768> inflated_;  // its contents are not used
    std::size_t header_left_ = 2;        // bytes of the zlib header that have not been read
    std::size_t blocks_ = 0, max_blocks_;
    bool is_ready_ = false, has_ended_ = false;
};

/// Raises too_large if the picture of a PNG file has more than max_png_blocks deflate blocks, and invalid_data if its data is
/// damaged. Does not inflate data that is too short for so many blocks.
///
/// bytes  a whole file whose chunks have been checked by read_picture_header()
inline void limit_png_blocks(std::span<const std::byte> bytes, const std::string& where) {
    const auto for_each_part = [&](auto&& read) {
        for (std::size_t at = 8; at + 12 <= bytes.size();) {
            const std::size_t length = big_endian_32(bytes, at);
            if (has_text(bytes, at + 4, "IEND")) return;
            if (has_text(bytes, at + 4, "IDAT")) read(bytes.subspan(at + 8, length));
            at += 12 + length;
        }
    };
    std::size_t compressed = 0;
    for_each_part([&](std::span<const std::byte> part) { compressed += part.size(); });
    if (compressed < max_png_blocks / 8 * 10) return;

    deflate_block_counter counter(max_png_blocks);
    for_each_part([&](std::span<const std::byte> part) {
        if (!counter.read(part)) damaged(picture_format::png, where, "data that cannot be inflated");
    });
    if (counter.blocks() > max_png_blocks)
        raise(error_code::too_large, where,
              "a PNG file with at most " + std::to_string(max_png_blocks) + " blocks of compressed data", "more blocks");
}

/// Whether a zlib stream has at most `max_blocks` deflate blocks and is not damaged; false also if memory runs out.
inline bool has_few_blocks(std::span<const std::byte> stream, std::size_t max_blocks) {
    deflate_block_counter counter(max_blocks);
    return counter.read(stream) && counter.blocks() <= max_blocks;
}

#else

inline bool has_few_blocks(std::span<const std::byte>, std::size_t) { return true; }
inline void limit_png_blocks(std::span<const std::byte>, const std::string&) {}

#endif

}}}  // namespace ldi::detail
