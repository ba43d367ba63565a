// Reads the primary picture and the metadata of HEIC and AVIF files with libheif. Ignores gain maps and other pictures. libheif
// applies the rotation and crop that the file states, so the EXIF orientation is ignored.
#pragma once

#include <ldi/io/detail/exif.hpp>
#include <ldi/io/detail/heif_items.hpp>
#include <ldi/io/detail/stored_photo.hpp>
#include <ldi/io/detail/zeroed_allocations.hpp>

#include <libheif/heif.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

struct heif_deleter {
    void operator()(heif_context* context) const { heif_context_free(context); }
    void operator()(const heif_image_handle* handle) const { heif_image_handle_release(handle); }
    void operator()(const heif_image* picture) const { heif_image_release(picture); }
    void operator()(heif_decoding_options* options) const { heif_decoding_options_free(options); }
    void operator()(heif_color_profile_nclx* profile) const { heif_nclx_color_profile_free(profile); }
    void operator()(const heif_depth_representation_info* info) const { heif_depth_representation_info_free(info); }
};
using heif_context_handle = std::unique_ptr<heif_context, heif_deleter>;
using heif_picture_handle = std::unique_ptr<const heif_image_handle, heif_deleter>;
using heif_pixels = std::unique_ptr<const heif_image, heif_deleter>;

/// Raises the ldi::error that corresponds to an error of libheif.
[[noreturn]] inline void refuse_heif(const heif_error& said, const std::string& where) {
    const bool is_unsupported = said.code == heif_error_Unsupported_feature || said.code == heif_error_Unsupported_filetype;
    const bool is_too_large = said.subcode == heif_suberror_Security_limit_exceeded;
    std::string_view message = said.message;
    while (message.ends_with('\n')) message.remove_suffix(1);  // some of libheif's messages end with a newline
    std::string found = "'" + std::string(message) + "'";
    if (heif_get_version_number() < 0x01130800)  // 1.19.8
        found += std::string("; this build uses libheif ") + heif_get_version() +
                 ", but some iPhone photos need version 1.19.8: update libheif, or save the photo as JPEG";
    raise(is_too_large                                      ? error_code::too_large
          : said.code == heif_error_Memory_allocation_error ? error_code::out_of_memory
          : is_unsupported                                  ? error_code::unsupported
                                                            : error_code::invalid_data,
          where, "a HEIC or AVIF file that libheif can read", found);
}

inline void check_heif(const heif_error& said, const std::string& where) {
    if (said.code != heif_error_Ok) refuse_heif(said, where);
}

/// An open file in memory. The bytes must outlive this object.
struct heif_file {
    heif_file(std::span<const std::byte> bytes, decoding_budget& budget, const std::string& where)
        : items(checked(bytes, budget, where), budget, where), context(heif_context_alloc()) {
        if (!context)
            raise(error_code::out_of_memory, where, "memory for a file of " + std::to_string(bytes.size()) + " bytes",
                  "too little memory");
        const std::size_t longest_side = (std::min)(budget.max_pixels(), std::size_t{65535});
        heif_context_set_maximum_image_size_limit(context.get(), static_cast<int>(longest_side));
        limit(budget);
        check_heif(heif_context_read_from_memory_without_copy(context.get(), bytes.data(), bytes.size(), nullptr), where);
        heif_image_handle* handle = nullptr;
        check_heif(heif_context_get_primary_image_handle(context.get(), &handle), where);
        primary.reset(handle);
    }

    heif_items items;
    heif_context_handle context;
    heif_picture_handle primary;

private:
    static std::span<const std::byte> checked(std::span<const std::byte> bytes, const decoding_budget& budget,
                                              const std::string& where) {
        budget.check_format(picture_format::heif, where);
        return bytes;
    }

    /// Sets libheif's own limits, if this version of libheif has them.
    void limit([[maybe_unused]] const decoding_budget& budget) {
#if LIBHEIF_NUMERIC_VERSION >= 0x01130000
        heif_security_limits* const limits = heif_context_get_security_limits(context.get());
        if (limits == nullptr) return;
        limits->max_image_size_pixels = budget.max_pixels();
        limits->max_number_of_tiles = 4096;
        limits->max_items = 4096;
        limits->max_memory_block_size = budget.left();
#if LIBHEIF_NUMERIC_VERSION >= 0x01140000
        limits->max_total_memory = budget.left();
#endif
#endif
    }
};

/// Decodes a picture. Raises out_of_memory if less memory is available than `charged`, the bytes that heif_items charged for it.
inline heif_pixels decode_heif_pixels(const heif_image_handle* handle, heif_colorspace space, heif_chroma chroma, double charged,
                                      const std::string& where) {
    const std::unique_ptr<heif_decoding_options, heif_deleter> options(heif_decoding_options_alloc());
    if (options) options->convert_hdr_to_8bit = 1;
    constexpr std::size_t for_threads = 64'000'000;  // stacks of libheif's threads
    const std::size_t needed = static_cast<std::size_t>(charged) + for_threads;
    require_memory(needed, where);
    heif_image* pixels = nullptr;
    const heif_error said = [&] {
        const zeroed_allocations zeroed;
        return heif_decode_image(handle, &pixels, space, chroma, options.get());
    }();
    // libheif's decoders report a lack of memory as a damaged file. Raises out_of_memory if twice the estimated memory is not
    // available now.
    if (said.code == heif_error_Decoder_plugin_error) require_memory(2 * needed, where);
    check_heif(said, where);
    return heif_pixels(pixels);
}

/// Returns the metadata blocks of a type ("Exif", or "mime" for XMP), except empty blocks and blocks above 4 MiB.
inline std::vector<std::vector<std::byte>> heif_metadata(const heif_image_handle* handle, const char* type,
                                                         decoding_budget& budget, const std::string& where) {
    constexpr std::size_t limit = std::size_t{4} << 20;
    const int count = heif_image_handle_get_number_of_metadata_blocks(handle, type);
    std::vector<heif_item_id> identifiers(static_cast<std::size_t>((std::max)(count, 0)));
    heif_image_handle_get_list_of_metadata_block_IDs(handle, type, identifiers.data(), count);
    std::vector<std::vector<std::byte>> blocks;
    for (const heif_item_id id : identifiers) {
        const std::size_t size = heif_image_handle_get_metadata_size(handle, id);
        if (size == 0 || size > limit) continue;
        budget.charge(nearest_double(size), where, "metadata of " + std::to_string(size) + " bytes");
        std::vector<std::byte> block(size);
        if (heif_image_handle_get_metadata(handle, id, block.data()).code == heif_error_Ok) blocks.push_back(std::move(block));
    }
    return blocks;
}

/// Returns the ICC profile. If there is no ICC profile, returns the numbers of the color primaries and of the transfer curve
/// (ITU-T H.273).
inline color_profile heif_profile(const heif_image_handle* handle) {
    color_profile profile;
    const std::size_t size = heif_image_handle_get_raw_color_profile_size(handle);
    if (size > 0 && size <= max_profile_bytes) {
        profile.icc.resize(size);
        if (heif_image_handle_get_raw_color_profile(handle, profile.icc.data()).code == heif_error_Ok) return profile;
        profile.icc.clear();
    }
    heif_color_profile_nclx* stated = nullptr;
    const heif_error said = heif_image_handle_get_nclx_color_profile(handle, &stated);
    const std::unique_ptr<heif_color_profile_nclx, heif_deleter> owner(stated);
    if (said.code != heif_error_Ok || !owner) return profile;
    profile.primaries = static_cast<unsigned>(stated->color_primaries);
    profile.transfer = static_cast<unsigned>(stated->transfer_characteristics);
    return profile;
}

/// Decodes the primary picture. Raises unsupported, invalid_data, too_large.
inline stored_photo decode_heif(std::span<const std::byte> bytes, decoding_budget& budget, const std::string& where) {
    heif_file file(bytes, budget, where);
    const heif_image_handle* const primary = file.primary.get();
    const double charged = file.items.take_primary(budget).more_memory;
    const bool has_alpha = heif_image_handle_has_alpha_channel(primary) != 0;
    const heif_pixels pixels = decode_heif_pixels(
        primary, heif_colorspace_RGB, has_alpha ? heif_chroma_interleaved_RGBA : heif_chroma_interleaved_RGB, charged, where);
    int stride = 0;
    const std::uint8_t* const from = heif_image_get_plane_readonly(pixels.get(), heif_channel_interleaved, &stride);
    const int width = heif_image_get_width(pixels.get(), heif_channel_interleaved),
              height = heif_image_get_height(pixels.get(), heif_channel_interleaved);
    if (from == nullptr || width < 1 || height < 1)
        raise(error_code::invalid_data, where, "an undamaged HEIC or AVIF file", "no picture");

    stored_photo photo;
    const std::size_t channels = has_alpha ? 4 : 3;
    photo.picture = allocate_picture(static_cast<std::size_t>(height), static_cast<std::size_t>(width), channels, where);
    const std::size_t row = photo.picture.width * channels;
    for (std::size_t y = 0; y < photo.picture.height; ++y)
        std::memcpy(photo.picture.samples.get() + y * row, from + y * static_cast<std::size_t>(stride), row);
    if (has_alpha && heif_image_handle_is_premultiplied_alpha(primary) != 0) lay_on_white(photo.picture);
    photo.profile = heif_profile(primary);
    for (const std::vector<std::byte>& block : heif_metadata(primary, "Exif", budget, where)) {
        // The first four bytes state how many more bytes to skip.
        const std::size_t begin = block.size() < 4 ? block.size() : std::size_t{big_endian_32(block, 0)} + 4;
        if (begin >= block.size()) continue;
        photo.focal_length_35mm = read_exif(std::span(block).subspan(begin)).focal_length_35mm;
    }
    return photo;
}

}}}  // namespace ldi::detail
