// Reads photos together with their depth. Phones store depth inside the photo's file. A second file beside the photo may also
// provide depth.
//
// JPEG files contain depth as GDepth, Dynamic Depth or Apple's format (requires pugixml). HEIC and AVIF files contain depth as
// an auxiliary picture (requires libheif and pugixml). The right half of a PNG file is depth if the right half is gray and the
// left half is colored. The depth map of `photo.jpg` may be a file beside it named `photo_depth.png` or similar, as in
// Facebook's 3D photos.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/image.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/detail/correlation.hpp>
#include <ldi/io/detail/orientation.hpp>
#include <ldi/io/detail/readers.hpp>
#include <ldi/io/detail/side_by_side.hpp>
#include <ldi/io/photo.hpp>

#if defined(LDI_WITH_PUGIXML)
#include <ldi/io/detail/jpeg_depth.hpp>
#if defined(LDI_WITH_LIBHEIF)
#include <ldi/io/detail/heif_depth.hpp>
#endif
#endif

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Depth that belongs to a photo.
struct photo_depth {
    image<float> disparity;  ///< h x w x 1, upright, larger is nearer; NaN for unknown pixels; see fill_invalid()
    /// Whether values are 1 / distance up to a factor. If false, a shift is unknown as well, or only the order of distances is
    /// known.
    bool is_inverse_depth = false;
    bool is_metric = false;              ///< values are 1 / distance in meters
    bool is_white_near_a_guess = false;  ///< whether ldi only assumes that white is near; see invert_if_contradicted()
    std::string source;                  ///< description, such as "GDepth, RangeInverse", or the path of the file
};

struct photo_with_depth {
    ldi::photo photo;
    std::optional<photo_depth> depth;
    std::string refused;  ///< message of the error if a depth map could not be used, else empty; the photo is valid in both cases
};

/// Finds the depth map beside a photo by its name: for `photo.jpg`, `photo_depth` with the extension png, jpg, jpeg, PNG, JPG,
/// JPEG, pfm or npy, in this order. Returns an empty path if there is none.
inline std::filesystem::path depth_map_beside(const std::filesystem::path& photo);

/// Inverts a depth map of unknown direction if a network's estimate contradicts the map, that is, if the correlation of map and
/// estimate is -0.2 or less. Otherwise, white stays near. Returns whether it inverted the map. If so, appends ", black is near"
/// to depth.source.
///
/// depth     depth.disparity must not contain NaN
/// estimate  h x w x 1, disparity of the same photo, in any size
inline bool invert_if_contradicted(photo_depth& depth, const image<float>& estimate);

inline namespace LDI_READERS {

/// Decodes a photo and the depth inside the file. Raises the errors of decode_photo().
photo_with_depth decode_photo_with_depth(std::span<const std::byte> bytes, const photo_options& options = {},
                                         const std::string& where = "photo");

/// Decodes a photo and the depth map from a second file. Assumes that white is near in the map
/// (photo_depth::is_white_near_a_guess). If the map can't be used, decodes the depth inside the photo's file instead, if there
/// is any. Raises the errors of decode_photo().
photo_with_depth decode_photo_with_map(std::span<const std::byte> photo_bytes, std::span<const std::byte> map_bytes,
                                       const photo_options& options = {}, const std::string& where = "photo",
                                       const std::string& map_where = "depth map");

/// Composites decoded pixels, for example from a browser, on white. Adds the depth inside their file, and the focal length if the
/// file is a JPEG, PNG, GIF or BMP. Raises invalid_data and unsupported if such a file has an invalid or unsupported header.
///
/// pixels  H x W x 4, upright: red, green, blue, opacity, 0 to 255
/// bytes   file from which the pixels were decoded
photo_with_depth with_depth_inside(image_view<const std::uint8_t> pixels, std::span<const std::byte> bytes,
                                   const photo_options& options = {}, const std::string& where = "photo");

/// Returns the size of a photo, and the memory that decode_photo_with_depth() followed by fill_invalid() needs. Raises the
/// errors of decode_photo_with_depth() that the header can cause.
decoding_estimate estimate_photo_with_depth(std::span<const std::byte> bytes, const photo_options& options = {},
                                            const std::string& where = "photo");

/// Loads a photo and the depth map beside it, such as `photo_depth.png` for `photo.jpg`. Works like decode_photo_with_map(), or
/// like decode_photo_with_depth() if there is no such map. Also raises the errors of read_file().
photo_with_depth load_photo_with_depth(const std::filesystem::path& path, const photo_options& options = {});

}  // inline namespace

// ----------------------------------------------------------------------------------------------------------------------------

inline std::filesystem::path depth_map_beside(const std::filesystem::path& photo) {
    for (const char* ending : {".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG", ".pfm", ".npy"}) {
        std::filesystem::path companion = photo;
        companion.replace_filename(photo.stem().string() + "_depth" + ending);
        std::error_code ignored;
        if (std::filesystem::is_regular_file(companion, ignored)) return companion;
    }
    return {};
}

namespace detail {

/// Returns the Pearson correlation of two maps of one photo, which may differ in size and may contain NaN. Returns NaN if a map
/// is constant.
inline double correlation_of(const image<float>& a, const image<float>& b) {
    constexpr std::size_t samples = 64;  // along each side
    const auto sample = [](const image<float>& map, std::size_t y, std::size_t x) {
        return double{map.row((2 * y + 1) * map.height() / (2 * samples))[(2 * x + 1) * map.width() / (2 * samples)]};
    };
    correlation result;
    for (std::size_t y = 0; y < samples; ++y)
        for (std::size_t x = 0; x < samples; ++x) {
            const double u = sample(a, y, x), v = sample(b, y, x);
            if (std::isfinite(u) && std::isfinite(v)) result.add(u, v);
        }
    return result.value();
}

/// Calls `read` for the depth of a photo, and checks that the depth fits the photo and has a valid pixel. After an error
/// other than out_of_memory and unavailable, stores the error's text in result.refused and leaves result.depth empty.
template <class Read>
void try_depth(photo_with_depth& result, const std::string& where, Read&& read) {
    try {
        result.depth = read();
        if (!result.depth) return;
        check_fits(result.depth->disparity, result.photo.color, where);
        const auto is_valid = [](float v) { return !std::isnan(v); };
        const image<float>& map = result.depth->disparity;
        if (std::none_of(map.begin(), map.end(), is_valid))
            raise(error_code::invalid_data, where, "at least one valid depth", "none");
    } catch (const error& e) {
        if (e.code() == error_code::out_of_memory || e.code() == error_code::unavailable)
            throw;  // the same call may succeed later
        result.depth.reset();
        result.refused = e.what();
    }
}

}  // namespace detail

inline bool invert_if_contradicted(photo_depth& depth, const image<float>& estimate) {
    constexpr float max_correlation = -0.2F;
    image<float>& map = depth.disparity;
    const float correlation = static_cast<float>(detail::correlation_of(map, estimate));
    if (std::isnan(correlation) || correlation > max_correlation) return false;
    const auto [lowest, highest] = std::minmax_element(map.begin(), map.end());
    const float low = *lowest, high = *highest;
    const bool fits = std::isfinite(high - low);
    for (float& v : map) v = fits ? high - v + low : static_cast<float>(double{high} - double{v} + double{low});
    depth.source += ", black is near";
    return true;
}

namespace detail::inline LDI_READERS {

/// Finds the depth inside a JPEG, HEIC or AVIF file.
inline std::optional<photo_depth> find_depth_inside([[maybe_unused]] std::span<const std::byte> bytes,
                                                    [[maybe_unused]] decoding_budget& budget,
                                                    [[maybe_unused]] const std::string& where) {
#if defined(LDI_WITH_PUGIXML)
    std::optional<found_depth> found;
    unsigned orientation = 1;
    if (is_jpeg(bytes)) {
        const picture_header header = read_jpeg_header(bytes, where);
        if (const std::optional<located_depth> located = locate_jpeg_depth(bytes, header, budget, where))
            found = decode_located(*located, budget);
        orientation = read_exif(header.exif).orientation;
    }
#if defined(LDI_WITH_LIBHEIF)
    if (is_heif(bytes)) found = find_heif_depth(bytes, budget, where);
#endif
    if (found)
        return photo_depth{turn_upright(std::move(found->disparity), orientation), found->is_inverse_depth, found->is_metric,
                           found->is_white_near_a_guess, std::move(found->source)};
#endif
    return std::nullopt;
}

/// Adds the depth inside a file to its photo.
inline void add_depth_inside(photo_with_depth& result, std::span<const std::byte> bytes, decoding_budget& budget,
                             const std::string& where) {
    budget.lower_max_pixels(depth_map_options().limits.max_pixels);  // depth maps have a lower pixel limit than photos
    try_depth(result, where, [&] { return find_depth_inside(bytes, budget, where); });
}

/// Charges the cost of find_depth_inside().
inline void take_depth_inside([[maybe_unused]] std::span<const std::byte> bytes, [[maybe_unused]] decoding_budget& budget,
                              [[maybe_unused]] const std::string& where) {
#if defined(LDI_WITH_PUGIXML)
    if (is_jpeg(bytes)) {
        const picture_header header = read_jpeg_header(bytes, where);
        const std::optional<located_depth> located = locate_jpeg_depth(bytes, header, budget, where);
        if (located) take_depth_header(located->depth, budget, located->where);
        if (located && !located->confidence.empty()) take_depth_header(located->confidence, budget, located->where);
    }
#if defined(LDI_WITH_LIBHEIF)
    if (is_heif(bytes)) heif_items(bytes, budget, where).take_depth(budget);
#endif
#endif
}

/// Returns the memory in bytes for splitting a picture into halves. The left half needs 3 bytes per pixel for colors. The right
/// half needs a float per pixel, and another 4 bytes per pixel for fill_invalid().
inline double memory_of_halves(std::size_t height, std::size_t width) {
    return nearest_double(height) * nearest_double(width) / 2 * (3 + 2 * sizeof(float));
}

/// Adds the depth stored in a photo's own file: the right half of a PNG file, or the depth inside a JPEG, HEIC or AVIF file.
inline void add_stored_depth(photo_with_depth& result, std::span<const std::byte> bytes, decoding_budget& budget,
                             const std::string& where) {
    if (!is_png(bytes) || !is_side_by_side(result.photo.color)) return add_depth_inside(result, bytes, budget, where);
    const image<std::uint8_t>& stored = result.photo.color;
    budget.charge(memory_of_halves(stored.height(), stored.width()), where, "a photo beside its depth map");
    const image<std::uint8_t> both = std::move(result.photo.color);
    const std::size_t half = both.width() / 2;
    result.photo.color = take_columns<std::uint8_t>(both, 0, half, 3);
    result.depth = photo_depth{take_columns<float>(both, half, half, 1), false, false, true, "the right half"};
}

/// Decodes a photo with a depth map from another file, or with the depth inside its own file if that map can't be used.
///
/// read_map  accepts depth_map_options and returns the map
template <class ReadMap>
photo_with_depth decode_photo_with(ReadMap&& read_map, std::span<const std::byte> bytes, const photo_options& options,
                                   const std::string& where, const std::string& map_where) {
    depth_map_options map_options;
    map_options.formats = options.formats;
    decoding_budget budget(options.limits, options.formats, bytes.size());
    photo_with_depth result;
    result.photo = decode_photo_within(bytes, budget, options.long_side, where);
    try_depth(result, map_where, [&] { return photo_depth{read_map(map_options), false, false, true, map_where}; });
    if (result.depth) return result;
    const std::string refused = std::move(result.refused);
    result.refused.clear();
    add_stored_depth(result, bytes, budget, where);
    if (result.refused.empty()) result.refused = refused;
    return result;
}

}  // namespace detail

inline namespace LDI_READERS {

inline photo_with_depth decode_photo_with_depth(std::span<const std::byte> bytes, const photo_options& options,
                                                const std::string& where) {
    detail::decoding_budget budget(options.limits, options.formats, bytes.size());
    photo_with_depth result;
    result.photo = detail::decode_photo_within(bytes, budget, options.long_side, where);
    detail::add_stored_depth(result, bytes, budget, where);
    return result;
}

inline decoding_estimate estimate_photo_with_depth(std::span<const std::byte> bytes, const photo_options& options,
                                                   const std::string& where) {
    detail::decoding_budget budget(options.limits, options.formats, bytes.size());
    const picture_header header = detail::take_photo_header(bytes, budget, where);
    if (detail::is_png(bytes))
        budget.charge((std::min)(detail::memory_of_halves(header.height, header.width), detail::nearest_double(budget.left())),
                      where, "a photo beside its depth map");
    budget.lower_max_pixels(depth_map_options().limits.max_pixels);
    try {
        detail::take_depth_inside(bytes, budget, where);
    } catch (const error&) {  // decoding the depth will raise the same error
    }
    return {header.height, header.width, budget.charged() + detail::max_profile_memory};
}

inline photo_with_depth decode_photo_with_map(std::span<const std::byte> photo_bytes, std::span<const std::byte> map_bytes,
                                              const photo_options& options, const std::string& where,
                                              const std::string& map_where) {
    const auto decode = [&](const depth_map_options& map_options) { return decode_depth_map(map_bytes, map_options, map_where); };
    return detail::decode_photo_with(decode, photo_bytes, options, where, map_where);
}

inline photo_with_depth with_depth_inside(image_view<const std::uint8_t> pixels, std::span<const std::byte> bytes,
                                          const photo_options& options, const std::string& where) {
    detail::decoding_budget budget(options.limits, options.formats, bytes.size());
    photo_with_depth result;
    result.photo.color = detail::over_white(pixels);
    if (detail::is_plain(bytes))
        result.photo.focal_length_35mm = detail::read_exif(detail::read_plain_header(bytes, where).exif).focal_length_35mm;
    detail::add_stored_depth(result, bytes, budget, where);
    return result;
}

inline photo_with_depth load_photo_with_depth(const std::filesystem::path& path, const photo_options& options) {
    const std::vector<std::byte> bytes = read_file(path);
    const std::filesystem::path map = depth_map_beside(path);
    if (map.empty()) return decode_photo_with_depth(bytes, options, path.string());
    const auto load = [&](const depth_map_options& map_options) { return load_depth_map(map, map_options); };
    return detail::decode_photo_with(load, bytes, options, path.string(), map.string());
}

}  // inline namespace

}}  // namespace ldi
