// Decides at which positions a camera can see hidden surfaces past the front of a curve (occlusion/detail/expansion.hpp).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/graph.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Front surface beside one back pixel of a curve.
struct front_place {
    std::int32_t x = 0, y = 0;  ///< position of the back pixel
    float toward_x = 0.0F,
          toward_y = 0.0F;   ///< mean direction from the back to the front along this part of the curve, of length 1
    float disparity = 0.0F;  ///< of the nearest front pixel along this part
};

/// Fronts of all curves, ordered by square tiles of the photo, so that a search around a position only visits the fronts there.
class front_lookup {
public:
    front_lookup() = default;
    /// pixels_per_disparity  parallax in pixels of a disparity of 1
    /// margin                distance in pixels by which surfaces grow beyond the parallax
    /// range                 maximum number of rows and columns between a hidden pixel and the fronts that are considered
    front_lookup(std::int32_t width, std::int32_t height, float pixels_per_disparity, float margin, std::int32_t range)
        : columns_((width >> shift) + 1),
          rows_((height >> shift) + 1),
          pixels_per_disparity_(pixels_per_disparity),
          margin_(margin),
          range_(range),
          start_(tile(0, rows_) + 1, 0) {}

    /// Adds a front; sort() must follow after the last one.
    void add(const front_place& f) { fronts_.push_back(f); }

    /// Orders the fronts by tiles, in linear time.
    void sort() {
        for (const front_place& f : fronts_) ++start_[tile(f.x >> shift, f.y >> shift) + 1];
        for (std::size_t t = 1; t < start_.size(); ++t) start_[t] += start_[t - 1];
        buffer<std::int32_t> next(start_.begin(), start_.end() - 1);
        buffer<front_place> sorted(fronts_.size(), unset);
        for (const front_place& f : fronts_) sorted[next[tile(f.x >> shift, f.y >> shift)]++] = f;
        fronts_.swap(sorted);
    }

    /// Whether a camera may see a hidden pixel at (x, y) past the front of a curve. It does not see pixels beneath the back
    /// surface's side of the curve, because the front hides them from it.
    bool uncovers(std::int32_t x, std::int32_t y, float disparity) const {
        const std::int32_t left = (std::max)(x - range_, 0) >> shift, right = (std::min)((x + range_) >> shift, columns_ - 1);
        const std::int32_t top = (std::max)(y - range_, 0) >> shift, bottom = (std::min)((y + range_) >> shift, rows_ - 1);
        for (std::int32_t row = top; row <= bottom; ++row)
            for (std::int32_t i = start_[tile(left, row)]; i < start_[tile(right, row) + 1]; ++i) {
                const front_place& f = fronts_[i];
                if (std::abs(x - f.x) > range_ || std::abs(y - f.y) > range_) continue;
                const float dx = nearest_float(x - f.x), dy = nearest_float(y - f.y);
                const float uncovered = (f.disparity - disparity) * pixels_per_disparity_ + margin_;
                const bool is_near = uncovered >= 0.0F && dx * dx + dy * dy <= uncovered * uncovered;
                if (is_near && dx * f.toward_x + dy * f.toward_y >= -1.0F) return true;
            }
        return false;
    }

private:
    static constexpr int shift = 3;  // binary logarithm of a tile's side

    std::size_t tile(std::int32_t column, std::int32_t row) const {
        return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
    }

    std::int32_t columns_ = 0, rows_ = 0;
    float pixels_per_disparity_ = 0.0F, margin_ = 0.0F;
    std::int32_t range_ = 0;
    buffer<std::int32_t> start_;  // per tile: index of its first front; one more at the end
    buffer<front_place> fronts_;
};

}}}  // namespace ldi::detail
