// Traces the discontinuities of a depth map along the sides of pixels. Curves lead from corner to corner of the lattice.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/discontinuity.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/surface.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Corners of the lattice, numbered y * (width + 1) + x, with one bit for each direction in which a discontinuity leaves the
/// corner.
class corner_map {
public:
    /// width, height  size of the lattice in pixels, 0 or more; raises invalid_option if negative
    ///
    /// Raises too_large for 2^31 corners or more.
    corner_map(std::int32_t width, std::int32_t height) : width_(width), height_(height) {
        if (width < 0 || height < 0)
            raise(error_code::invalid_option, "corner_map", "a lattice with a width and a height of 0 or more",
                  std::to_string(width) + " x " + std::to_string(height));
        const std::int64_t corners = (std::int64_t{width} + 1) * (std::int64_t{height} + 1);
        if (corners > 0x7FFFFFFF)
            raise(error_code::too_large, "corner_map", "fewer than 2^31 pixel corners", std::to_string(corners));
        stride_ = width + 1;
        present_.assign(static_cast<std::size_t>(corners), 0);
    }
    corner_map(const corner_map&) = default;
    corner_map& operator=(const corner_map& other) { return *this = corner_map(other); }
    /// The moved-from map has no corners.
    corner_map(corner_map&& other) noexcept
        : stride_(std::exchange(other.stride_, 0)),
          width_(std::exchange(other.width_, -1)),
          height_(std::exchange(other.height_, -1)),
          present_(std::move(other.present_)),
          used_(std::move(other.used_)),
          side_count_(std::exchange(other.side_count_, 0)) {}
    corner_map& operator=(corner_map&& other) noexcept {
        stride_ = std::exchange(other.stride_, 0), width_ = std::exchange(other.width_, -1);
        height_ = std::exchange(other.height_, -1), side_count_ = std::exchange(other.side_count_, 0);
        present_ = std::move(other.present_), used_ = std::move(other.used_);
        return *this;
    }

    /// Adds the pixel side from a corner to the adjacent corner in direction `toward`. Both corners must be on the lattice, and
    /// the side must not be present.
    void add(std::int32_t corner, side toward) {
        LDI_ASSERT((present_[corner] & bit(toward)) == 0);
        if (present_[corner] == 0) used_.push_back(corner);
        present_[corner] |= bit(toward);
        const std::int32_t other = next(corner, toward);
        if (present_[other] == 0) used_.push_back(other);
        present_[other] |= bit(opposite(toward));
        ++side_count_;
    }

    /// Size of the lattice in pixels; -1 for a moved-from map.
    std::int32_t width() const { return width_; }
    std::int32_t height() const { return height_; }
    /// The corners that have sides, or had sides before remove(), in the order in which add() reached them. Lists a corner
    /// twice if all its sides were removed and add() then added another side.
    const buffer<std::int32_t>& used() const { return used_; }
    /// Number of sides that are present.
    std::size_t side_count() const { return side_count_; }
    /// Number of the corner at the lattice point (x, y), the top left corner of pixel (x, y).
    std::int32_t corner(std::int32_t x, std::int32_t y) const { return y * stride_ + x; }
    /// Lattice point of a corner.
    std::int32_t x(std::int32_t c) const { return c % stride_; }
    std::int32_t y(std::int32_t c) const { return c / stride_; }
    /// Returns the adjacent corner in direction `toward`, which must be on the lattice.
    std::int32_t next(std::int32_t c, side toward) const { return c + step_x(toward) + step_y(toward) * stride_; }
    /// Whether the side that leaves the corner in this direction is present.
    bool has(std::int32_t c, side toward) const { return (present_[c] & bit(toward)) != 0; }
    /// Whether the corner lies on the left or the right border of the lattice.
    bool on_border_column(std::int32_t c) const { return x(c) == 0 || x(c) == width_; }
    /// Whether the corner lies on any border of the lattice.
    bool on_border(std::int32_t c) const { return on_border_column(c) || y(c) == 0 || y(c) == height_; }
    /// Number of sides present at a corner, 0 to 4.
    int degree(std::int32_t c) const {
        int count = 0;
        for (side s : all_sides) count += has(c, s) ? 1 : 0;
        return count;
    }
    /// Removes a side that is present.
    void remove(std::int32_t c, side toward) {
        LDI_ASSERT(has(c, toward));
        present_[c] ^= bit(toward);
        present_[next(c, toward)] ^= bit(opposite(toward));
        --side_count_;
    }

private:
    static std::uint8_t bit(side s) { return static_cast<std::uint8_t>(1U << static_cast<unsigned>(s)); }

    std::int32_t stride_, width_, height_;
    buffer<std::uint8_t> present_;
    buffer<std::int32_t> used_;
    std::size_t side_count_ = 0;
};

/// A traced curve: its sides, and its corners in the same order. A curve of n sides has n + 1 corners.
struct traced_curve {
    buffer<std::int32_t> corners;  ///< as corner_map numbers them
    buffer<discontinuity> sides;
    bool is_closed = false;  ///< whether the last corner is the first one
};

/// Finds the discontinuities of a disparity map, and traces them as curves. A curve is closed, or ends at free ends or junctions.
class curve_tracer {
public:
    /// width, height     size of the map; raises the errors of corner_map
    /// disparity         width * height values, row by row; must outlive the tracer. Raises mismatch for any other number
    /// surface           decides whether two pixels that meet diagonally at a corner belong to one surface
    /// is_cut(pixel, s)  whether side `s` of a pixel, right or down, is a discontinuity; called only for sides inside the photo
    template <class IsCut>
    curve_tracer(std::int32_t width, std::int32_t height, std::span<const float> disparity, surface_rule surface, IsCut&& is_cut)
        : width_(width), disparity_(disparity.data()), surface_(surface), all_(width, height) {
        const std::int64_t pixels = std::int64_t{width} * height;
        if (static_cast<std::int64_t>(disparity.size()) != pixels)
            raise(error_code::mismatch, "curve_tracer", std::to_string(pixels) + " disparities",
                  std::to_string(disparity.size()));
        for (std::int32_t y = 0; y < height; ++y) {
            const std::int32_t start = y * width;
            for (std::int32_t x = 0; x + 1 < width; ++x)
                if (is_cut(start + x, side::right)) all_.add(all_.corner(x + 1, y), side::down);
            if (y + 1 == height) break;
            for (std::int32_t x = 0; x < width; ++x)
                if (is_cut(start + x, side::down)) all_.add(all_.corner(x, y + 1), side::right);
        }
    }

    /// Removes branches of fewer than `min_length` sides that lead from a junction to a free end inside the photo, so that the
    /// curve continues through the junction.
    void prune_spurs(std::size_t min_length) {
        buffer<std::pair<std::int32_t, side>> spur;
        for (std::int32_t end : all_.used()) {
            if (all_.degree(end) != 1 || all_.on_border(end)) continue;
            spur.clear();
            std::int32_t corner = end;
            side toward = side::left;
            for (side s : all_sides)
                if (all_.has(corner, s)) toward = s;
            bool runs_on = true;
            while (runs_on && spur.size() < min_length) {
                spur.emplace_back(corner, toward);
                corner = all_.next(corner, toward);
                runs_on = !ends_curves(corner);
                if (runs_on) toward = onward(corner, opposite(toward));
            }
            if (spur.size() < min_length && all_.degree(corner) > 2)
                for (const auto& [from, s] : spur) all_.remove(from, s);
        }
    }

    /// Calls visit(traced_curve) for every curve: first those that start at an end or a junction, then the closed curves.
    template <class Visit>
    void for_each_curve(Visit&& visit) const {
        corner_map left = all_;
        for (std::int32_t corner : all_.used())
            if (ends_curves(corner))
                for (side s : all_sides)
                    if (left.has(corner, s)) visit(follow(left, corner, s));
        for (std::int32_t corner : all_.used())
            for (side s : all_sides)
                if (left.has(corner, s)) visit(follow(left, corner, s));
    }

    /// Returns a map with the sides of all curves.
    const corner_map& corners() const { return all_; }

    /// Returns the four pixels around a corner that lies inside the photo: two above, then two below, each from left to right.
    std::array<std::int32_t, 4> pixels_around(std::int32_t corner) const {
        const std::int32_t below_right = all_.y(corner) * width_ + all_.x(corner);
        return {below_right - width_ - 1, below_right - width_, below_right - 1, below_right};
    }

private:
    /// Whether a corner is the end of a curve or a junction. If two front pixels and two back pixels meet diagonally at a corner,
    /// two curves pass each other there, without a junction.
    bool ends_curves(std::int32_t corner) const {
        const int degree = all_.degree(corner);
        return degree != 2 && !(degree == 4 && is_checkered(corner));
    }
    bool is_checkered(std::int32_t corner) const {
        const std::array<std::int32_t, 4> around = pixels_around(corner);
        return surface_.same_surface(disparity_[around[0]], disparity_[around[3]]) &&
               surface_.same_surface(disparity_[around[1]], disparity_[around[2]]);
    }
    /// Returns the direction in which a curve leaves a corner that it reaches from direction `from`. If two curves pass each
    /// other at the corner, each curve turns around a pixel of the back surface, so that the pixels of the front surface stay
    /// connected.
    side onward(std::int32_t corner, side from) const {
        if (all_.degree(corner) == 2) {
            for (side s : all_sides)
                if (s != from && all_.has(corner, s)) return s;
        }
        const std::array<std::int32_t, 4> around = pixels_around(corner);
        const bool falling =
            disparity_[around[0]] > disparity_[around[1]];  // the front's pixels are at the upper left and lower right
        switch (from) {
            case side::left: return falling ? side::down : side::up;
            case side::down: return falling ? side::left : side::right;
            case side::right: return falling ? side::up : side::down;
            case side::up: break;
        }
        return falling ? side::right : side::left;
    }

    traced_curve follow(corner_map& left, std::int32_t corner, side toward) const {
        traced_curve t;
        t.corners.push_back(corner);
        while (true) {
            t.sides.push_back(discontinuity_between(corner, toward));
            left.remove(corner, toward);
            corner = all_.next(corner, toward);
            t.corners.push_back(corner);
            if (ends_curves(corner)) return t;
            toward = onward(corner, opposite(toward));
            if (!left.has(corner, toward)) {  // back at the start of a closed curve
                t.is_closed = true;
                return t;
            }
        }
    }

    /// Returns the two pixels that share the pixel side from `corner` to the next corner in direction `toward`.
    discontinuity discontinuity_between(std::int32_t corner, side toward) const {
        const bool vertical = toward == side::up || toward == side::down;
        const std::int32_t x = all_.x(corner) - (toward == side::left ? 1 : 0), y = all_.y(corner) - (toward == side::up ? 1 : 0);
        const std::int32_t second = y * width_ + x, first = second - (vertical ? 1 : width_);
        const side first_to_second = vertical ? side::right : side::down;
        if (disparity_[first] > disparity_[second]) return {second, first, opposite(first_to_second)};
        return {first, second, first_to_second};
    }

    std::int32_t width_;
    const float* disparity_;
    surface_rule surface_;
    corner_map all_;
};

}}  // namespace ldi
