// Reads depth maps from 8- or 16-bit PNG, JPEG, PFM and NPY files. A file stores disparity or distance, and may have unknown
// pixels. The result is always disparity: larger is nearer, known up to a positive scale and a shift. Unknown pixels are NaN.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/formats/float_map.hpp>
#include <ldi/formats/picture_formats.hpp>
#include <ldi/io/detail/decoding_budget.hpp>
#include <ldi/io/detail/picture_decoder.hpp>
#include <ldi/io/file.hpp>
#include <ldi/io/picture_limits.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <span>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Meaning of a stored value.
enum class depth_map_kind {
    disparity,  ///< nearness, up to a scale and a shift (1 / distance, stereo disparity, output of a network)
    meters,     ///< distance from the camera; values of 0 and below are invalid
};

struct depth_map_options {
    depth_map_kind kind = depth_map_kind::disparity;
    /// Whether larger values are nearer. False for depth maps from Google's Lens Blur, for example. Ignored for meters.
    bool white_is_near = true;
    bool invalid_zero = false;  ///< a stored 0 means unknown (16-bit PNG files from sensors and stereo benchmarks)
    float scale = 1;            ///< positive factor that multiplies every stored value; 0.001 for distances in millimeters
    picture_limits limits = {.max_pixels = 64'000'000};
    picture_formats formats = {};  ///< formats that may be read
};

/// Decodes a depth map in memory: gray PNG (values 0 to 255, or 0 to 65,535 in 16-bit files), gray JPEG, PFM, or NPY of float32
/// or float64 (H x W, with any axes of length 1 before or after). Color files whose channels agree count as gray; alpha and EXIF
/// orientation are ignored.
///
/// Returns H x W x 1 disparity; larger is nearer. The unit is 1 / meter for depth_map_kind::meters. Unknown pixels become NaN:
/// stored NaN and infinity, stored 0 with invalid_zero, and distances that are not positive. Raises unsupported, invalid_data,
/// too_large and out_of_memory, and invalid_option for a scale that is not positive and finite.
///
/// where  name of the depth map in messages
image<float> decode_depth_map(std::span<const std::byte> bytes, const depth_map_options& options = {},
                              const std::string& where = "depth map");

/// Returns the size of a depth map, and the memory that decode_depth_map() followed by fill_invalid() needs. Raises the errors
/// of decode_depth_map() that the header can cause.
decoding_estimate estimate_depth_map(std::span<const std::byte> bytes, const depth_map_options& options = {},
                                     const std::string& where = "depth map");

/// Loads a depth map from a file as decode_depth_map() does; also raises file_access.
image<float> load_depth_map(const std::filesystem::path& path, const depth_map_options& options = {});

/// Fills every NaN pixel with the value of the nearest valid pixel. Distance is the number of steps up, down, left and right;
/// ties are broken deterministically. Raises invalid_data if no pixel is valid.
image<float> fill_invalid(image<float> depth_map, const std::string& where = "depth map");

/// Shrinks a depth map: averages the known pixels of square blocks. Uses the smallest blocks that reduce the map to at most
/// max_pixels pixels. A larger map would only cost memory: the stages of the 3D photo conversion copy the map, and the program
/// photo3d uses at most 4096 pixels per side.
///
/// depth_map   H x W x 1; NaN for unknown pixels; a block without known pixels becomes NaN
/// max_pixels  above 0
image<float> shrink_depth_map(image<float> depth_map, std::size_t max_pixels = 32'000'000);

/// Checks that a depth map can belong to a photo: the aspect ratios differ by at most 2 %. The sizes may differ. Raises
/// mismatch.
///
/// depth_map, photo  of any size; the photo is an image or a view
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

/// Decodes the values of a gray PNG or JPEG file. Raises the errors of decode_depth_map().
template <class Sample>
image<float> decode_gray_as(std::span<const std::byte> bytes, const picture_header& header, const std::string& where) {
    const decoded_picture<Sample> picture = decode_picture<Sample>(bytes, header, where);
    image<float> result(picture.height, picture.width, 1, unset);
    const std::size_t count = picture.height * picture.width;
    const Sample* sample = picture.samples.get();
    if (picture.channels < 3) {
        for (std::size_t i = 0; i < count; ++i, sample += picture.channels) result.data()[i] = sample[0];
        return result;
    }
    // The channels of a gray picture saved as color differ only by JPEG compression errors. The channels of a color-mapped depth
    // map differ by far more. The limit on the mean of |red - green| + |blue - green| is 3 % of the full range; it was tuned by
    // experiment.
    double difference = 0;
    for (std::size_t i = 0; i < count; ++i, sample += picture.channels) {
        result.data()[i] = sample[1];
        difference += std::abs(sample[0] - sample[1]) + std::abs(sample[2] - sample[1]);
    }
    if (difference / nearest_double(count) > 0.03 * (std::numeric_limits<Sample>::max)())
        raise(error_code::unsupported, where, "a gray depth map", "a color picture");
    return result;
}

inline image<float> decode_gray(std::span<const std::byte> bytes, const picture_header& header, const std::string& where) {
    return header.bits == 16 ? decode_gray_as<std::uint16_t>(bytes, header, where)
                             : decode_gray_as<std::uint8_t>(bytes, header, where);
}

/// Reads a header and charges the peak memory of the map. This is the larger of two amounts: the decoder's memory, including
/// the result as floats, and the two floats per pixel that are required to rotate the map or to fill its holes.
inline picture_header take_depth_header(std::span<const std::byte> bytes, decoding_budget& budget, const std::string& where) {
    picture_header header;
    if (is_pfm(bytes))
        header = read_pfm_header(bytes, where);
    else if (is_npy(bytes))
        header = read_npy_header(bytes, where);
    else if (is_jpeg(bytes) || is_png(bytes))
        header = read_picture_header(bytes, where);
    else
        raise(bytes.empty() ? error_code::invalid_data : error_code::unsupported, where, "a gray PNG, JPEG, PFM or NPY file",
              describe_format(bytes));
    header.memory_per_pixel = (std::max)(header.memory_per_pixel + 1, 2 * sizeof(float));
    budget.charge(header, where);
    return header;
}

inline image<float> decode_stored_depth(std::span<const std::byte> bytes, decoding_budget& budget, const std::string& where) {
    const picture_header header = take_depth_header(bytes, budget, where);
    if (header.format == picture_format::pfm) return decode_pfm(bytes, where);
    if (header.format == picture_format::npy) return decode_npy(bytes, where);
    return decode_gray(bytes, header, where);
}

}  // namespace detail

inline image<float> decode_depth_map(std::span<const std::byte> bytes, const depth_map_options& options,
                                     const std::string& where) {
    if (!(options.scale > 0) || !std::isfinite(options.scale))
        raise(error_code::invalid_option, "depth map scale", "a positive, finite number", detail::to_text(options.scale));
    detail::decoding_budget budget(options.limits, options.formats, bytes.size());
    image<float> result = detail::decode_stored_depth(bytes, budget, where);
    const std::span<float> values(result.data(), result.size());
    constexpr float invalid = std::numeric_limits<float>::quiet_NaN();
    float largest = -std::numeric_limits<float>::infinity(), smallest = -largest;
    const bool is_meters = options.kind == depth_map_kind::meters;
    for (float& v : values) {
        if (options.invalid_zero && v == 0) v = invalid;
        v *= options.scale;
        if (is_meters) v = v > 0 && std::isfinite(v) ? 1 / v : invalid;
        if (!std::isfinite(v)) v = invalid;
        largest = (std::max)(largest, v), smallest = (std::min)(smallest, v);  // NaN changes neither
    }
    if (options.kind == depth_map_kind::disparity && !options.white_is_near) {
        // The difference of two floats may overflow; the difference of their halves never does.
        const float factor = std::isfinite(largest - smallest) ? 1.0F : 0.5F;
        for (float& v : values) v = factor * largest - factor * v;
    }
    return result;
}

inline decoding_estimate estimate_depth_map(std::span<const std::byte> bytes, const depth_map_options& options,
                                            const std::string& where) {
    detail::decoding_budget budget(options.limits, options.formats, bytes.size());
    const picture_header header = detail::take_depth_header(bytes, budget, where);
    return {header.height, header.width, budget.charged()};
}

inline image<float> load_depth_map(const std::filesystem::path& path, const depth_map_options& options) {
    return decode_depth_map(read_file(path), options, path.string());
}

inline image<float> fill_invalid(image<float> depth_map, const std::string& where) {
    const std::size_t w = depth_map.width(), count = depth_map.size();
    LDI_ASSERT(count <= 0xFFFFFFFF);
    float* const values = depth_map.data();
    const auto for_each_neighbor = [&](std::size_t i, auto&& visit) {
        const std::size_t x = i % w;
        if (i >= w) visit(i - w);
        if (i + w < count) visit(i + w);
        if (x > 0) visit(i - 1);
        if (x + 1 < w) visit(i + 1);
    };
    const auto is_at_hole = [&](std::size_t i) {
        bool result = false;
        for_each_neighbor(i, [&](std::size_t neighbor) { result = result || std::isnan(values[neighbor]); });
        return result;
    };
    const auto holes = static_cast<std::size_t>(std::count_if(values, values + count, [](float v) { return std::isnan(v); }));
    if (holes == 0 && count > 0) return depth_map;
    if (holes == count) raise(error_code::invalid_data, where, "at least one valid depth", "none");
    buffer<std::uint32_t> reached;  // in breadth-first order, so that the nearest valid pixel fills each hole
    const auto for_each_source = [&](auto&& see) {
        for (std::size_t i = 0; i < count; ++i)
            if (!std::isnan(values[i]) && is_at_hole(i)) see(i);
    };
    std::size_t sources = 0;
    for_each_source([&](std::size_t) { ++sources; });
    reached.reserve(sources + holes);
    for_each_source([&](std::size_t i) { reached.push_back(static_cast<std::uint32_t>(i)); });
    for (std::size_t at = 0; at < reached.size(); ++at) {
        const std::uint32_t i = reached[at];
        for_each_neighbor(i, [&](std::size_t neighbor) {
            if (!std::isnan(values[neighbor])) return;
            values[neighbor] = values[i];
            reached.push_back(static_cast<std::uint32_t>(neighbor));
        });
    }
    return depth_map;
}

inline image<float> shrink_depth_map(image<float> depth_map, std::size_t max_pixels) {
    LDI_ASSERT(max_pixels > 0);
    const std::size_t height = depth_map.height(), width = depth_map.width();
    const auto blocks = [](std::size_t length, std::size_t side) { return (length + side - 1) / side; };
    std::size_t side = 1;
    while (blocks(height, side) > max_pixels / blocks(width, side)) ++side;
    if (side == 1) return depth_map;
    image<float> result(blocks(height, side), blocks(width, side), 1, unset);
    for (std::size_t y = 0; y < result.height(); ++y)
        for (std::size_t x = 0; x < result.width(); ++x) {
            double sum = 0, count = 0;
            for (std::size_t v = y * side; v < (std::min)((y + 1) * side, height); ++v)
                for (std::size_t u = x * side; u < (std::min)((x + 1) * side, width); ++u)
                    if (const float value = depth_map.row(v)[u]; !std::isnan(value)) sum += double{value}, ++count;
            result.row(y)[x] = count > 0 ? static_cast<float>(sum / count) : std::numeric_limits<float>::quiet_NaN();
        }
    return result;
}

}}  // namespace ldi
