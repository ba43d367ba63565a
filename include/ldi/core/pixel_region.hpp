// A set of lattice pixels that a sparse computation visits, stored row by row as runs. Pixels are numbered from top to bottom and
// from left to right.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/graph.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

class pixel_region_builder;

/// An immutable set of pixels on a lattice. pixel_region_builder makes it.
class pixel_region {
public:
    /// Columns first to last - 1 of a row. The runs of a row neither overlap nor touch.
    struct run {
        std::int32_t first, last;
        std::int32_t pixel;  ///< number of the first pixel

        std::int32_t pixel_at(std::int32_t x) const { return pixel + (x - first); }
        friend bool operator==(const run&, const run&) = default;
    };

    /// Makes a region without pixels, on a lattice of 0 x 0.
    pixel_region() = default;
    pixel_region(const pixel_region&) = default;
    pixel_region& operator=(const pixel_region& other) { return *this = pixel_region(other); }
    /// The moved-from region is empty, on a lattice of 0 x 0.
    pixel_region(pixel_region&& other) noexcept
        : width_(std::exchange(other.width_, 0)), runs_(std::move(other.runs_)), row_ends_(std::move(other.row_ends_)) {}
    pixel_region& operator=(pixel_region&& other) noexcept {
        width_ = std::exchange(other.width_, 0), runs_ = std::move(other.runs_), row_ends_ = std::move(other.row_ends_);
        return *this;
    }

    std::int32_t width() const { return width_; }
    std::int32_t height() const { return row_ends_.count(); }
    /// Number of pixels.
    std::int32_t count() const { return runs_.empty() ? 0 : runs_.back().pixel_at(runs_.back().last); }
    std::size_t size() const { return static_cast<std::size_t>(count()); }

    /// Returns the runs of a row; empty for rows outside the lattice.
    std::span<const run> row(std::int32_t) const&& = delete;  // the runs would be destroyed with the region
    std::span<const run> row(std::int32_t y) const& {
        if (y < 0 || y >= height()) return {};
        return {runs_.data() + first_run(y), static_cast<std::size_t>(row_ends_[y] - first_run(y))};
    }

    /// Writes the numbers of the pixels at (x, y), (x + 1, y), ...; no_pixel outside the region.
    void numbers(std::int32_t x, std::int32_t y, std::span<std::int32_t> result) const {
        const std::span<const run> runs = row(y);
        auto here = std::partition_point(runs.begin(), runs.end(), [&](const run& r) { return r.last <= x; });
        for (std::int32_t& number : result) {
            if (here != runs.end() && here->last == x) ++here;
            number = here != runs.end() && here->first <= x ? here->pixel_at(x) : no_pixel;
            ++x;
        }
    }
    std::int32_t number(std::int32_t x, std::int32_t y) const {
        std::int32_t result = no_pixel;
        numbers(x, y, std::span(&result, 1));
        return result;
    }

    friend bool operator==(const pixel_region&, const pixel_region&) = default;

private:
    friend pixel_region_builder;

    /// Index of the first run of a row.
    std::int32_t first_run(std::int32_t y) const { return y == 0 ? 0 : row_ends_[y - 1]; }

    std::int32_t width_ = 0;
    buffer<run> runs_;
    buffer<std::int32_t> row_ends_;  // number of runs in each row and all rows above it
};

/// Makes a pixel_region row by row: call add_run() from left to right, then end_row(), and build() after the last row.
class pixel_region_builder {
public:
    /// width  width of the lattice, 0 to 2^30; raises invalid_option for any other width
    explicit pixel_region_builder(std::int32_t width) {
        if (width < 0 || width > 1 << 30)
            raise(error_code::invalid_option, "pixel_region_builder", "a width from 0 to 2^30", std::to_string(width));
        made_.width_ = width;
    }

    /// Adds columns first to last - 1 to the current row. Raises mismatch unless 0 <= first < last <= width and the columns are
    /// to the right of all columns already in this row. Raises too_large if the region would have 2^31 pixels or more. After
    /// these errors, the builder is unchanged.
    void add_run(std::int32_t first, std::int32_t last) {
        const bool is_first = made_.runs_.count() == made_.first_run(made_.height());
        const std::int32_t free = is_first ? 0 : made_.runs_.back().last;
        if (!(free <= first && first < last && last <= made_.width_))
            raise(error_code::mismatch, "pixel_region_builder",
                  "columns from " + std::to_string(free) + " to " + std::to_string(made_.width_) + ", from left to right",
                  "columns " + std::to_string(first) + " to " + std::to_string(last));
        if (last - first > 0x7FFFFFFF - made_.count())
            raise(error_code::too_large, "pixel_region_builder", "fewer than 2^31 pixels",
                  std::to_string(std::int64_t{made_.count()} + last - first));
        if (!is_first && free == first)
            made_.runs_.back().last = last;
        else
            made_.runs_.push_back({first, last, made_.count()});
    }
    void end_row() { made_.row_ends_.push_back(made_.runs_.count()); }

    /// Returns the region. Raises mismatch unless end_row() was called after the last run. After this error, the builder is
    /// unchanged.
    [[nodiscard]] pixel_region build() && {
        if (made_.runs_.count() != made_.first_run(made_.height()))
            raise(error_code::mismatch, "pixel_region_builder", "end_row() after the last run", "none");
        return std::exchange(made_, {});
    }

private:
    pixel_region made_;
};

/// Returns the region's pixels with even x and even y, on a lattice of half the size, rounded up.
inline pixel_region halved(const pixel_region& region) {
    pixel_region_builder result(detail::half_rounded_up(region.width()));
    for (std::int32_t y = 0; y < region.height(); y += 2) {
        for (const pixel_region::run& r : region.row(y))
            if (const std::int32_t first = detail::half_rounded_up(r.first), last = detail::half_rounded_up(r.last); first < last)
                result.add_run(first, last);
        result.end_row();
    }
    return std::move(result).build();
}

/// Returns for each pixel (x, y) of `region` the number of the pixel (x / 2, y / 2) of `half`, the halved region, or no_pixel.
inline buffer<std::int32_t> parents(const pixel_region& region, const pixel_region& half) {
    buffer<std::int32_t> result(region.size(), unset);
    for (std::int32_t y = 0; y < region.height(); ++y) {
        const auto coarse = half.row(y / 2);
        auto here = coarse.begin();
        for (const pixel_region::run& r : region.row(y))
            for (std::int32_t x = r.first; x < r.last; ++x) {
                while (here != coarse.end() && here->last <= x / 2) ++here;
                result[r.pixel_at(x)] = here != coarse.end() && here->first <= x / 2 ? here->pixel_at(x / 2) : no_pixel;
            }
    }
    return result;
}

/// Returns for each pixel the number of the pixel below it, or no_pixel.
inline buffer<std::int32_t> pixels_below(const pixel_region& region) {
    buffer<std::int32_t> result(region.size(), unset);
    for (std::int32_t y = 0; y < region.height(); ++y) {
        const auto below = region.row(y + 1);
        auto here = below.begin();
        for (const pixel_region::run& r : region.row(y))
            for (std::int32_t x = r.first; x < r.last; ++x) {
                while (here != below.end() && here->last <= x) ++here;
                result[r.pixel_at(x)] = here != below.end() && here->first <= x ? here->pixel_at(x) : no_pixel;
            }
    }
    return result;
}

}}  // namespace ldi
