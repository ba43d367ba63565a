// Checks of depth maps that several stages in depth/ use.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Raises mismatch for a map whose number of channels is not 1. Accepts every map without pixels.
///
/// where  name of the stage
inline void check_map(image_view<const float> map, const char* where) {
    if (map.height() > 0 && map.width() > 0 && map.channels() != 1)
        raise(error_code::mismatch, where, "a map H x W x 1", shape_text(map));
}

/// Raises invalid_data for a value that is not finite.
inline void check_finite(image_view<const float> map, const char* where) {
    for (std::size_t y = 0; y < map.height(); ++y) {
        const float* const row = map.row(y);
        bool is_finite = true;
        for (std::size_t x = 0; x < map.width() * map.channels(); ++x)
            is_finite &= std::abs(row[x]) <= (std::numeric_limits<float>::max)();
        if (!is_finite) raise(error_code::invalid_data, where, "finite values", "infinity or NaN in row " + std::to_string(y));
    }
}

/// Raises invalid_option unless the side length of a depth sample, in photo pixels, is from 1 to 16.
inline void check_sample_size(float size) {
    if (!(size >= 1 && size <= 16)) raise(error_code::invalid_option, "undecided_depth::sample_size", "1 to 16", to_text(size));
}

/// Raises too_large for a map with 2^31 pixels or more, because pixel indices are of type std::int32_t.
inline void check_pixel_count(image_view<const float> map, const char* where) {
    constexpr std::size_t limit = (std::numeric_limits<std::int32_t>::max)();
    if ((std::max)(map.height(), map.width()) > limit || (map.height() > 0 && map.width() > limit / map.height()))
        raise(error_code::too_large, where, "fewer than 2^31 pixels", shape_text(map));
}

/// Raises mismatch unless the map is H x W x 1 and the photo H x W x 3.
inline void check_map_and_photo(image_view<const float> map, image_view<const std::uint8_t> photo, const char* where) {
    if (map.height() != photo.height() || map.width() != photo.width() || map.channels() != 1 || photo.channels() != 3)
        raise(error_code::mismatch, where, "a disparity map H x W x 1 and a photo H x W x 3 of the same size",
              shape_text(map) + " and " + shape_text(photo));
}

}}}  // namespace ldi::detail
