// Reads WebP files with libwebp.
#pragma once

#include <ldi/io/detail/exif.hpp>
#include <ldi/io/detail/stored_photo.hpp>
#include <ldi/io/detail/webp_lossless.hpp>

#include <webp/decode.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Calls use(body) with the body of each chunk of a RIFF file that has this name. Sizes are little-endian, and chunks are padded
/// to even sizes. A chunk that is cut off ends with the file.
template <class Use>
void for_each_riff_chunk(std::span<const std::byte> bytes, std::string_view name, Use use) {
    for (std::size_t at = 12; at + 8 <= bytes.size();) {
        const std::size_t size = little_endian_32(bytes, at + 4), here = (std::min)(size, bytes.size() - at - 8);
        if (has_text(bytes, at, name)) use(bytes.subspan(at + 8, here));
        at += 8 + here + here % 2;
    }
}

/// Returns the body of the first chunk of a RIFF file with this name; empty if there is none.
inline std::span<const std::byte> riff_chunk(std::span<const std::byte> bytes, std::string_view name) {
    std::span<const std::byte> first;
    for_each_riff_chunk(bytes, name, [&](std::span<const std::byte> body) {
        if (first.empty()) first = body;
    });
    return first;
}

/// Returns an upper bound of the memory in bytes for libwebp's tables of prefix codes, which only lossless pictures and lossless
/// alpha have. Raises invalid_data for several chunks of one kind, because libwebp may decode any of them.
inline std::size_t table_bytes_of(std::span<const std::byte> bytes, const picture_header& header, const std::string& where) {
    std::size_t needed = 0;
    for (const std::string_view kind : {"VP8L", "ALPH"}) {
        std::size_t chunks = 0;
        for_each_riff_chunk(bytes, kind, [&](std::span<const std::byte> body) {
            if (++chunks > 1) damaged(picture_format::webp, where, "several chunks " + std::string(kind));
            const std::size_t begin = kind == "VP8L" ? 5 : 1;
            const bool is_lossless = body.size() > begin && (kind == "VP8L" || (body[0] & std::byte{3}) == std::byte{1});
            if (is_lossless) needed += lossless_webp(body.subspan(begin), header.width, header.height).table_bytes();
        });
    }
    return needed;
}

/// Reads the header. Raises unsupported (an animation), invalid_data.
inline picture_header read_webp_header(std::span<const std::byte> bytes, const std::string& where) {
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), &features) != VP8_STATUS_OK)
        damaged(picture_format::webp, where, "a bad header");
    if (features.has_animation) raise(error_code::unsupported, where, "a WebP file with a single picture", "an animation");
    picture_header header;
    header.format = picture_format::webp;
    header.width = static_cast<std::size_t>(features.width), header.height = static_cast<std::size_t>(features.height);
    header.memory_per_pixel = 11;  // decoded samples (4), libwebp's copy in lossless files (4), RGB photo (3)
    header.has_alpha = features.has_alpha != 0;
    header.more_memory = nearest_double(table_bytes_of(bytes, header, where));
    return header;
}

/// Decodes a WebP file. Raises unsupported, invalid_data, too_large, out_of_memory.
inline stored_photo decode_webp(std::span<const std::byte> bytes, decoding_budget& budget, const std::string& where) {
    budget.check_format(picture_format::webp, where);
    const picture_header header = read_webp_header(bytes, where);
    budget.charge(header, where);
    stored_photo photo;
    const std::size_t channels = header.has_alpha ? 4 : 3;
    photo.picture = allocate_picture(header.height, header.width, channels, where);
    require_memory(8 * header.width * header.height + static_cast<std::size_t>(header.more_memory), where);
    WebPDecoderConfig into;
    WebPInitDecoderConfig(&into);
    into.output.colorspace = header.has_alpha ? MODE_RGBA : MODE_RGB;
    into.output.is_external_memory = 1;
    into.output.u.RGBA.rgba = photo.picture.samples.get();
    into.output.u.RGBA.stride = static_cast<int>(header.width * channels);
    into.output.u.RGBA.size = header.width * channels * header.height;
    const VP8StatusCode status = WebPDecode(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), &into);
    if (status == VP8_STATUS_OUT_OF_MEMORY)
        raise(error_code::out_of_memory, where,
              "memory for " + std::to_string(header.width) + " x " + std::to_string(header.height) + " pixels",
              "too little memory");
    if (status != VP8_STATUS_OK) damaged(picture_format::webp, where, "a picture that is cut off or damaged");

    std::span<const std::byte> exif = riff_chunk(bytes, "EXIF");
    if (has_text(exif, 0, std::string_view("Exif\0\0", 6))) exif = exif.subspan(6);
    const exif_facts facts = read_exif(exif);
    photo.orientation = facts.orientation, photo.focal_length_35mm = facts.focal_length_35mm;
    const std::span<const std::byte> icc = riff_chunk(bytes, "ICCP");
    if (icc.size() <= max_profile_bytes) photo.profile.icc.assign(icc.begin(), icc.end());
    return photo;
}

}}}  // namespace ldi::detail
