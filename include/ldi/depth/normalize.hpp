// Normalizes disparity from any source (network, phone, file) to [0, 1], the range that every threshold of the paper assumes.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/image.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of normalize().
struct normalize_options {
    /// Share of pixels to clamp at each end of the value range, from 0 to less than one half, so that a few outliers do not
    /// compress all other values. Tuned by experiment.
    float clipped_share = 0.001F;
    /// Relative difference between adjacent levels of a quantized source, at least 0: exp(0.0187) - 1 for Tiefenrausch, whose 8
    /// bits encode the logarithm of disparity; 0 for a source that is not quantized.
    float relative_step = 0.0F;
    /// Maximum size of a quantization step in the result, above 0 and well below the discontinuity threshold of 0.05. In a flat
    /// scene, such as a wall, one step would be a large part of the range. normalize() then extends the range, so that
    /// disparity does not reach 0.
    float max_step = 0.02F;
    /// Whether the source is 1 / depth up to scale, so that ratios of distances are known. If false, the source is 1 / depth only
    /// up to scale and shift, and `assumed_range` replaces the unknown distances.
    bool is_inverse_depth = true;
    /// Whether the source is 1 / depth in meters, so that distances are known. Has no effect if is_inverse_depth is false.
    bool is_metric = false;
    /// Distances to use if the source does not determine them, with 1e-6 <= z_near <= z_far <= 1e9.
    depth_range assumed_range = {};
    /// Maximum ratio of the farthest to the nearest distance, 1 to 1e6. Larger ratios are clamped, because disparity near the
    /// horizon is mostly noise.
    float max_depth_ratio = 50.0F;
};

/// A disparity map and its range of distances. normalize() makes it.
struct normalized_disparity {
    image<float> disparity;  ///< H x W x 1, in [0, 1]; 1 is the nearest surface
    depth_range range;       ///< distances at disparity 1 and 0; meters if the source is metric
};

namespace detail {

/// Limits on distances, in meters, that keep positions and their inverses far from the limits of float.
inline constexpr double min_distance = 1e-6, max_distance = 1e9;

inline void check(const normalize_options& options) {
    if (!(options.clipped_share >= 0.0F && options.clipped_share < 0.5F) ||
        !(options.relative_step >= 0.0F && std::isfinite(options.relative_step)) || !(options.max_step > 0.0F) ||
        !(options.max_depth_ratio >= 1.0F && options.max_depth_ratio <= 1e6F))
        raise(error_code::invalid_option, "normalize_options",
              "0 <= clipped_share < 0.5, a finite relative_step >= 0, max_step > 0, 1 <= max_depth_ratio <= 1e6",
              to_text(options.clipped_share) + ", " + to_text(options.relative_step) + ", " + to_text(options.max_step) + ", " +
                  to_text(options.max_depth_ratio));
    const depth_range& range = options.assumed_range;
    if (!(range.z_near >= min_distance && range.z_near <= range.z_far && range.z_far <= max_distance))
        raise(error_code::invalid_option, "normalize_options, assumed_range", "1e-6 <= z_near <= z_far <= 1e9",
              to_text(range.z_near) + " to " + to_text(range.z_far));
}

/// Returns the source's values in unspecified order. Raises mismatch unless the shape is h x w x 1, and invalid_data if a value
/// cannot be a disparity.
inline buffer<float> checked_values(image_view<const float> source, bool is_inverse_depth) {
    if (source.empty() || source.channels() != 1)
        raise(error_code::mismatch, "disparity", "h x w x 1 values, at least one", shape_text(source));
    buffer<float> values;
    values.reserve(source.height() * source.width());
    for (std::size_t y = 0; y < source.height(); ++y) values.append(source.row(y), source.row(y) + source.width());
    for (const float value : values)
        if (!std::isfinite(value) || (is_inverse_depth && value < 0.0F))
            raise(error_code::invalid_data, "disparity", is_inverse_depth ? "finite values of 0 or more" : "finite values",
                  to_text(value));
    return values;
}

}  // namespace detail

/// Normalizes disparity to [0, 1] and computes the range of distances.
///
/// source  H x W x 1, finite, larger is nearer. Inverse depth must be 0 or more; 0 is infinitely far and becomes the maximum
///         distance that max_depth_ratio allows. If 0 means unknown, fill these pixels first.
///
/// Disparity = 1 - (highest - value) / span, clamped. `highest` and `lowest` are the extreme values after clipped_share is
/// removed at either end; span is highest - lowest, or more if a step of the source would exceed max_step. Raises
/// mismatch unless the shape is H x W x 1; invalid_data if a value is not finite, an inverse depth is negative, all inverse
/// depths except the clipped ones are 0, or the nearest surface is not between 1e-6 and 1e9 meters away; invalid_option for an
/// option outside its range. Linear time; 8 bytes per sample.
inline normalized_disparity normalize(image_view<const float> source, const normalize_options& options = {}) {
    detail::check(options);
    buffer<float> sorted = detail::checked_values(source, options.is_inverse_depth);
    const std::size_t clipped = static_cast<std::size_t>(options.clipped_share * detail::nearest_float(sorted.size()));
    const auto at = [&](std::size_t rank) {
        const auto position = sorted.begin() + rank;
        std::nth_element(sorted.begin(), position, sorted.end());
        return *position;
    };
    // In double precision, so that differences of two floats do not overflow and every value except 0 has a reciprocal.
    const double lowest = at(clipped), highest = at(sorted.size() - 1 - clipped);
    if (options.is_inverse_depth && !(highest > 0.0))
        raise(error_code::invalid_data, "disparity", "values above 0", "no value above 0 outside the clipped_share");
    const double step = std::abs(highest) * options.relative_step;
    const double span = (std::max)(highest - lowest, step / options.max_step);

    normalized_disparity result{image<float>(source), options.assumed_range};
    const double scale = span > 0.0 ? 1.0 / span : 0.0;
    for (float& value : result.disparity) value = static_cast<float>(std::clamp(1.0 - (highest - value) * scale, 0.0, 1.0));
    if (options.is_inverse_depth) {
        // If the source has no unit, the nearest surface is placed at z_near of the assumed range. Disparity 0 corresponds to the
        // source's value highest - span.
        const double farthest = (std::max)(highest - span, highest / options.max_depth_ratio);
        const double ratio = span > 0.0 ? highest / farthest : options.max_depth_ratio;
        const double z_near = options.is_metric ? 1.0 / highest : double{options.assumed_range.z_near};
        if (!(z_near >= detail::min_distance && z_near <= detail::max_distance))
            raise(error_code::invalid_data, "disparity", "a nearest surface between 1e-6 and 1e9 meters away",
                  detail::to_text(z_near) + " meters");
        result.range.z_near = static_cast<float>(z_near);
        result.range.z_far = static_cast<float>(z_near * ratio);
    }
    return result;
}

}}  // namespace ldi
