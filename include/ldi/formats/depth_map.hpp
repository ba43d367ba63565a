// Depth maps that people have: PNG of 8 or 16 bits, JPEG companions, PFM and NPY, of disparity or meters, with holes. They all
// become one thing: disparity, larger nearer, up to a positive scale and a shift, NaN where the file knows nothing.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/formats/detail/float_map.hpp>
#include <ldi/formats/detail/picture_decoder.hpp>
#include <ldi/formats/file.hpp>
#include <ldi/formats/picture_limits.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <span>
#include <string>

namespace ldi::inline LDI_CONFIGURATION {

/// The quantity that a stored value grows with.
enum class depth_map_kind {
    disparity,  ///< nearness, up to a scale and a shift (1 / distance, stereo disparity, what a network gives)
    meters,     ///< distance from the camera; 0 and below is invalid
};

struct depth_map_options {
    depth_map_kind kind = depth_map_kind::disparity;
    bool white_is_near = true;  ///< false: disparity whose smallest values are nearest (Lens Blur companions). Not for meters.
    bool invalid_zero = false;  ///< a stored 0 means unknown (16-bit PNG files of sensors and stereo benchmarks)
    float scale = 1;            ///< multiplies every stored value; 0.001 for meters stored as millimeters. Positive.
    picture_limits limits = {.max_pixels = 64'000'000};
};

/// Decodes a depth map in memory: gray PNG (a value is 0 to 255, or 0 to 65,535 in 16-bit files), gray JPEG, PFM, or NPY of
/// float32 or float64 (H x W, also with axes of length 1 before or behind). Color files whose channels agree count as gray;
/// alpha and EXIF orientation are ignored.
///
/// Returns H x W x 1 disparity, larger nearer; in 1 / meter for depth_map_kind::meters. NaN where the file holds none: NaN,
/// infinity, and 0 as the options have it.
/// Raises unsupported, invalid_data, too_large, invalid_option.
image<float> decode_depth_map(std::span<const std::byte> bytes, const depth_map_options& options = {},
                              const std::string& where = "depth map");

/// decode_depth_map() of a file; also raises file_access.
image<float> load_depth_map(const std::filesystem::path& path, const depth_map_options& options = {});

/// Gives every NaN pixel the value of the nearest valid one, counted in steps up, down, left and right; among equally near ones
/// the choice is fixed. Raises invalid_data if no pixel is valid.
image<float> fill_invalid(image<float> depth_map, const std::string& where = "depth map");

/// Checks that a depth map can belong to a photo: their sizes may differ, their proportions by at most 2 %. Raises mismatch.
///
/// photo  an image or a view
template <class Picture>
void check_fits(const image<float>& depth_map, const Picture& photo, const std::string& where = "depth map") {
    const auto ratio = [](const auto& picture) {
        return detail::nearest_double(picture.width()) / detail::nearest_double(picture.height());
    };
    const double map_ratio = ratio(depth_map), photo_ratio = ratio(photo);
    if (std::abs(std::log(map_ratio / photo_ratio)) <= std::log(1.02)) return;
    const auto size = [](std::size_t w, std::size_t h) { return std::to_string(w) + " x " + std::to_string(h); };
    raise(error_code::mismatch, where, "the proportions of the photo, " + size(photo.width(), photo.height()),
          size(depth_map.width(), depth_map.height()));
}

namespace detail {

/// The values of a gray PNG or JPEG file. Raises as decode_depth_map() does.
template <class Sample>
image<float> decode_gray(std::span<const std::byte> bytes, const picture_header& header, const std::string& where) {
    const decoded_picture<Sample> picture = decode_picture<Sample>(bytes, header, where);
    image<float> result(picture.height, picture.width, 1, unset);
    const std::size_t count = picture.height * picture.width;
    const Sample* sample = picture.samples.get();
    if (picture.channels < 3) {
        for (std::size_t i = 0; i < count; ++i, sample += picture.channels) result.data()[i] = sample[0];
        return result;
    }
    // Gray saved as color differs between channels by what JPEG loses; a color-mapped picture of depth differs by
    // far more. The limit, 3 % of the full range on average, was chosen by trial.
    double difference = 0;
    for (std::size_t i = 0; i < count; ++i, sample += picture.channels) {
        result.data()[i] = sample[1];
        difference += std::abs(sample[0] - sample[1]) + std::abs(sample[2] - sample[1]);
    }
    if (difference / nearest_double(count) > 0.03 * (std::numeric_limits<Sample>::max)())
        raise(error_code::unsupported, where, "a gray depth map", "a color picture");
    return result;
}

inline image<float> decode_stored_depth(std::span<const std::byte> bytes, const picture_limits& limits,
                                        const std::string& where) {
    if (is_pfm(bytes)) return decode_pfm(bytes, limits.max_pixels, where);
    if (is_npy(bytes)) return decode_npy(bytes, limits.max_pixels, where);
    if (!is_jpeg(bytes) && !is_png(bytes))
        raise(bytes.empty() ? error_code::invalid_data : error_code::unsupported, where, "a gray PNG, JPEG, PFM or NPY file",
              describe_format(bytes));
    const picture_header header = read_picture_header(bytes, where);
    check_limits(header, bytes.size(), limits, where);
    return header.bits == 16 ? decode_gray<std::uint16_t>(bytes, header, where) : decode_gray<std::uint8_t>(bytes, header, where);
}

}  // namespace detail

inline image<float> decode_depth_map(std::span<const std::byte> bytes, const depth_map_options& options,
                                     const std::string& where) {
    if (!(options.scale > 0) || !std::isfinite(options.scale))
        raise(error_code::invalid_option, "depth map scale", "a positive number", detail::to_text(options.scale));
    image<float> result = detail::decode_stored_depth(bytes, options.limits, where);
    const std::span<float> values(result.data(), result.size());
    constexpr float invalid = std::numeric_limits<float>::quiet_NaN();
    float largest = -std::numeric_limits<float>::infinity(), smallest = -largest;
    const bool is_meters = options.kind == depth_map_kind::meters;
    for (float& v : values) {
        if (options.invalid_zero && v == 0) v = invalid;
        v *= options.scale;
        if (is_meters) v = v > 0 && std::isfinite(v) ? 1 / v : invalid;
        if (!std::isfinite(v)) v = invalid;
        largest = (std::max)(largest, v), smallest = (std::min)(smallest, v);  // keep what they are where v is NaN
    }
    if (options.kind == depth_map_kind::disparity && !options.white_is_near) {
        // The difference of two floats may exceed their range; that of their halves never does.
        const float factor = std::isfinite(largest - smallest) ? 1.0F : 0.5F;
        for (float& v : values) v = factor * largest - factor * v;
    }
    return result;
}

inline image<float> load_depth_map(const std::filesystem::path& path, const depth_map_options& options) {
    return decode_depth_map(read_file(path), options, path.string());
}

inline image<float> fill_invalid(image<float> depth_map, const std::string& where) {
    const std::size_t w = depth_map.width(), count = depth_map.size();
    float* const values = depth_map.data();
    buffer<std::size_t> reached;  // breadth-first, so that nearer sources come first
    reached.reserve(count);
    for (std::size_t i = 0; i < count; ++i)
        if (!std::isnan(values[i])) reached.push_back(i);
    if (reached.empty()) raise(error_code::invalid_data, where, "at least one valid depth", "none");
    for (std::size_t next = 0; next < reached.size(); ++next) {
        const std::size_t i = reached[next], x = i % w;
        const auto pass_on = [&](bool exists, std::size_t neighbor) {
            if (!exists || !std::isnan(values[neighbor])) return;
            values[neighbor] = values[i];
            reached.push_back(neighbor);
        };
        pass_on(i >= w, i - w);
        pass_on(i + w < count, i + w);
        pass_on(x > 0, i - 1);
        pass_on(x + 1 < w, i + 1);
    }
    return depth_map;
}

}  // namespace ldi
