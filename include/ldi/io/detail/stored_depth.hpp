// Converts stored depth to disparity. Photos contain depth as an 8- or 16-bit gray picture, and metadata that states the
// meaning of its values.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/image.hpp>
#include <ldi/io/depth_map.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <string>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Conversion of a stored value v, 0 to 1, to a distance.
enum class depth_coding {
    range_inverse,  ///< 1 / distance runs from 1 / first (v = 0) to 1 / last (v = 1): GDepth, Dynamic Depth
    range_linear,   ///< distance runs from first to last
    disparity,      ///< 1 / distance runs from first to last: Apple
};

struct depth_meaning {
    depth_coding coding = depth_coding::disparity;
    double first = 0, last = 1;
    double unit = 0;  ///< meters per unit of distance; 0 if distances are known only up to a factor
};

/// Decodes a gray picture to values from 0 to 1. Raises the errors of decode_depth_map().
inline image<float> decode_gray_unit(std::span<const std::byte> bytes, decoding_budget& budget, const std::string& where) {
    const picture_header header = take_depth_header(bytes, budget, where);
    if (header.format != picture_format::jpeg && header.format != picture_format::png)
        raise(error_code::unsupported, where, "a JPEG or PNG file", describe_format(bytes));
    image<float> values = decode_gray(bytes, header, where);
    const float scale = header.bits == 16 ? 1.0F / 65535 : 1.0F / 255;
    for (float& v : values) v *= scale;
    return values;
}

/// Returns 1 / distance, in 1 / meter if the unit is known. Distances that are not positive, or more than 1000 times the
/// smallest distance, become 1000 times the smallest distance. Raises invalid_data if the range is invalid.
///
/// values  H x W x 1, from 0 to 1; NaN stays NaN
inline image<float> to_disparity(image<float> values, const depth_meaning& meaning, const std::string& where) {
    const double first = meaning.first, last = meaning.last;
    const bool is_distance = meaning.coding != depth_coding::disparity;
    if (!std::isfinite(first) || !std::isfinite(last) || first == last || (is_distance && (first <= 0 || last <= 0)))
        raise(error_code::invalid_data, where, "a valid depth range", detail::to_text(first) + " to " + detail::to_text(last));
    const double unit = meaning.unit > 0 ? meaning.unit : 1;
    double highest = 0;
    for (float& value : values) {
        const double v = value;
        double disparity = first + v * (last - first);
        if (meaning.coding == depth_coding::range_inverse) disparity = (1 - v) / first + v / last;
        if (meaning.coding == depth_coding::range_linear) disparity = 1 / disparity;
        value = static_cast<float>(disparity / unit);
        if (std::isfinite(value)) highest = (std::max)(highest, double{value});
    }
    const float lowest = (std::max)(static_cast<float>(highest / 1000), (std::numeric_limits<float>::min)());
    if (!(highest > 0)) raise(error_code::invalid_data, where, "at least one positive distance", "none");
    for (float& v : values)
        if (!std::isnan(v)) v = std::isfinite(v) ? (std::max)(v, lowest) : lowest;
    return values;
}

/// Sets pixels with confidence 0 to NaN. A confidence map may be smaller than its depth map.
inline void drop_unsure(image<float>& values, const image<float>& confidence) {
    for (std::size_t y = 0; y < values.height(); ++y)
        for (std::size_t x = 0; x < values.width(); ++x)
            if (confidence.row(y * confidence.height() / values.height())[x * confidence.width() / values.width()] == 0)
                values.row(y)[x] = std::numeric_limits<float>::quiet_NaN();
}

}}}  // namespace ldi::detail
