// Reads depth from HEIC and AVIF files, which store it as an auxiliary picture. Apple's XMP or the file's depth representation
// information (ISO 23008-2) states the range of the depth. libheif distinguishes depth from gain maps and mattes by the type of
// the auxiliary picture.
#pragma once

#include <ldi/io/detail/heif_file.hpp>
#include <ldi/io/detail/jpeg_depth.hpp>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Meaning of a depth picture's values, as far as the file states it.
struct heif_depth_facts {
    std::optional<depth_meaning> meaning;  ///< empty if the file states no range, or a nonuniform disparity
    bool is_order_known = false;           ///< whether the file states that values are disparities or distances
    bool is_distance = false;              ///< whether larger values are farther
};

/// Reads the facts about a depth picture from Apple's XMP or, if there is none, from the depth representation information.
///
/// photo  the primary picture
/// depth  its auxiliary picture `id`
inline heif_depth_facts heif_facts(const heif_image_handle* photo, const heif_image_handle* depth, heif_item_id id,
                                   decoding_budget& budget, const std::string& where) {
    xmp_properties xmp;
    for (const std::vector<std::byte>& block : heif_metadata(depth, "mime", budget, where)) xmp.add(block, budget, where);
    if (const std::optional<depth_meaning> meaning = apple_meaning(xmp)) return {meaning, true, false};
    const heif_depth_representation_info* stated = nullptr;
    if (heif_image_handle_get_depth_image_representation_info(photo, id, &stated) == 0) return {};
    const std::unique_ptr<const heif_depth_representation_info, heif_deleter> info(stated);
    heif_depth_facts facts{std::nullopt, true, info->depth_representation_type == heif_depth_representation_type_uniform_Z};
    const bool has_disparities = info->has_d_min != 0 && info->has_d_max != 0,
               has_distances = info->has_z_near != 0 && info->has_z_far != 0;
    switch (info->depth_representation_type) {
        case heif_depth_representation_type_uniform_disparity:
            if (has_disparities) facts.meaning = depth_meaning{depth_coding::disparity, info->d_min, info->d_max, 0};
            break;
        case heif_depth_representation_type_uniform_inverse_Z:  // white is at z_near
            if (has_distances) facts.meaning = depth_meaning{depth_coding::range_inverse, info->z_far, info->z_near, 0};
            break;
        case heif_depth_representation_type_uniform_Z:
            if (has_distances) facts.meaning = depth_meaning{depth_coding::range_linear, info->z_near, info->z_far, 0};
            break;
        default: break;
    }
    return facts;
}

/// Returns the brightness of a picture's pixels, H x W x 1, from 0 to 1.
inline image<float> heif_gray(const heif_image* pixels, const std::string& where) {
    int stride = 0;
    // A gray picture that was coded as RGB has no luma channel.
    const heif_channel channel = heif_image_has_channel(pixels, heif_channel_Y) ? heif_channel_Y : heif_channel_G;
    const std::uint8_t* const from = heif_image_get_plane_readonly(pixels, channel, &stride);
    const int width = heif_image_get_width(pixels, channel), height = heif_image_get_height(pixels, channel),
              bits = heif_image_get_bits_per_pixel_range(pixels, channel);
    if (from == nullptr || width < 1 || height < 1 || bits < 1 || bits > 16)
        raise(error_code::invalid_data, where, "a gray picture with 1 to 16 bits per sample",
              from == nullptr ? "none"
                              : std::to_string(width) + " x " + std::to_string(height) + ", " + std::to_string(bits) + " bits");
    image<float> values(static_cast<std::size_t>(height), static_cast<std::size_t>(width), 1, unset);
    const float scale = 1.0F / nearest_float((1U << bits) - 1);
    for (std::size_t y = 0; y < values.height(); ++y) {
        const std::uint8_t* const row = from + y * static_cast<std::size_t>(stride);
        for (std::size_t x = 0; x < values.width(); ++x)
            values.row(y)[x] = scale * nearest_float(bits <= 8 ? row[x] : unsigned{row[2 * x]} | unsigned{row[2 * x + 1]} << 8);
    }
    return values;
}

/// Finds and decodes the depth of a photo. The result is upright. Raises unsupported, invalid_data, too_large.
inline std::optional<found_depth> find_heif_depth(std::span<const std::byte> bytes, decoding_budget& budget,
                                                  const std::string& where) {
    heif_file file(bytes, budget, where);
    heif_item_id id = 0;
    if (heif_image_handle_get_list_of_depth_image_IDs(file.primary.get(), &id, 1) < 1) return std::nullopt;
    const std::string here = where + ", depth";
    heif_image_handle* handle = nullptr;
    check_heif(heif_image_handle_get_depth_image_handle(file.primary.get(), id, &handle), here);
    const heif_picture_handle depth(handle);
    const std::optional<double> charged = file.items.take_depth(budget);
    if (!charged) return std::nullopt;
    const auto [meaning, is_order_known, is_distance] = heif_facts(file.primary.get(), depth.get(), id, budget, here);
    const heif_pixels pixels = decode_heif_pixels(depth.get(), heif_colorspace_undefined, heif_chroma_undefined, *charged, here);
    image<float> values = heif_gray(pixels.get(), here);
    if (!meaning) {
        if (is_distance)
            for (float& v : values) v = 1.0F - v;
        return found_depth{std::move(values), false, "HEIC depth without a range", false, !is_order_known};
    }
    return found_depth{to_disparity(std::move(values), *meaning, here), meaning->unit > 0,
                       meaning->coding == depth_coding::disparity ? "HEIC disparity" : "HEIC depth"};
}

}}}  // namespace ldi::detail
