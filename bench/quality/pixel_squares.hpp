// Represents each pixel of a layered image as a square of four triangles, which connect the pixel's center with its four sides.
// Linked pixels share corners; unlinked pixels are separate. The vertices are projected once per view to the rasterizer's
// fixed-point positions.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/disjoint_sets.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/render/camera.hpp>
#include <ldi/render/detail/screen_triangles.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

namespace ldi_quality {

using ldi::detail::guard_band, ldi::detail::nearest_double, ldi::detail::rounded_mean, ldi::detail::screen_triangle,
    ldi::detail::screen_vertex, ldi::detail::signed_area, ldi::detail::subsample_steps;

/// Makes a triangle clockwise. Returns false if the triangle must not be drawn, because it has no area, or because it shows its
/// back and `both_sides` is false.
inline bool turn_clockwise(screen_triangle& t, bool both_sides) {
    const std::int64_t area = signed_area(t);
    if (area < 0) std::swap(t[1], t[2]);
    return area > 0 || (area < 0 && both_sides);
}

/// Corners of a pixel, clockwise from the top left. Side i runs from corner i to the next corner.
inline constexpr std::int32_t pixel_corners[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
inline constexpr ldi::side clockwise_sides[4] = {ldi::side::up, ldi::side::right, ldi::side::down, ldi::side::left};

constexpr int clockwise_index(ldi::side s) {
    return s == ldi::side::up ? 0 : s == ldi::side::right ? 1 : s == ldi::side::down ? 2 : 3;
}

class pixel_squares {
public:
    template <ldi::has_columns<ldi::disparity_column> Layers>
    pixel_squares(const Layers& layers, const ldi::depth_range& range, const ldi::view& taken_from, const ldi::view& from,
                  std::int32_t samples, float z_near)
        : graph_(layers.topology()) {
        if (taken_from.camera.width != graph_.width() || taken_from.camera.height != graph_.height())
            ldi::raise(ldi::error_code::mismatch, "camera of a layered image",
                       std::to_string(graph_.width()) + " x " + std::to_string(graph_.height()),
                       std::to_string(taken_from.camera.width) + " x " + std::to_string(taken_from.camera.height));
        share_corners();
        place(layers.template column<ldi::disparity_column>(), range, relative_projection(taken_from, from, samples, z_near));
    }

    /// Returns false if a vertex of the pixel is nearer than z_near, or too far outside the picture to be projected safely.
    bool is_drawn(std::int32_t pixel) const { return drawn_[pixel] != 0; }

    std::int64_t top(std::int32_t pixel) const {
        return extreme(pixel, [](std::int64_t a, std::int64_t b) { return (std::min)(a, b); });
    }
    std::int64_t bottom(std::int32_t pixel) const {
        return extreme(pixel, [](std::int64_t a, std::int64_t b) { return (std::max)(a, b); });
    }

    /// Returns the triangle of the pixel's center and the two corners of a side, clockwise as seen in the layered image.
    /// Texture coordinates run from 0 to 1 over the pixel.
    screen_triangle triangle(std::int32_t pixel, ldi::side s) const {
        const int first = clockwise_index(s), second = (first + 1) % 4;
        screen_triangle t{vertices_[pixel], vertices_[corner(pixel, first)], vertices_[corner(pixel, second)]};
        t[0].u = t[0].v = 0.5;
        t[1].u = pixel_corners[first][0], t[1].v = pixel_corners[first][1];
        t[2].u = pixel_corners[second][0], t[2].v = pixel_corners[second][1];
        return t;
    }

private:
    std::int32_t corner(std::int32_t pixel, int c) const { return corner_of_[std::int64_t{4} * pixel + c]; }

    template <class Choose>
    std::int64_t extreme(std::int32_t pixel, Choose&& choose) const {
        std::int64_t result = vertices_[pixel].y;
        for (int c = 0; c < 4; ++c) result = choose(result, vertices_[corner(pixel, c)].y);
        return result;
    }

    /// Merges the corners of linked pixels at both ends of their common side.
    void share_corners() {
        const std::int32_t count = graph_.count();
        ldi::disjoint_sets sets(4 * graph_.size());
        for (std::int32_t i = 0; i < count; ++i) {
            const std::int32_t here = 4 * i, right = graph_.right()[i], down = graph_.down()[i];
            if (right != ldi::no_pixel) {
                sets.merge(here + 1, 4 * right);
                sets.merge(here + 2, 4 * right + 3);
            }
            if (down != ldi::no_pixel) {
                sets.merge(here + 3, 4 * down);
                sets.merge(here + 2, 4 * down + 1);
            }
        }
        const std::int32_t corners = sets.number(corner_of_);
        for (std::int32_t& c : corner_of_) c += count;  // centers come first
        vertices_.resize(static_cast<std::size_t>(std::int64_t{count} + corners));
    }

    /// Places each corner at the mean disparity of the pixels that share it.
    template <class Project>
    void place(ldi::array_view<const float> disparity, const ldi::depth_range& distances, const Project& project) {
        const std::int32_t count = graph_.count();
        ldi::buffer<double> sum(vertices_.size() - graph_.size(), 0.0), members(sum.size(), 0.0);
        for (std::int32_t i = 0; i < count; ++i)
            for (int c = 0; c < 4; ++c) {
                sum[corner(i, c) - count] += disparity[i];
                members[corner(i, c) - count] += 1;
            }
        const double first = 1.0 / distances.z_near, last = 1.0 / distances.z_far;
        ldi::buffer<std::uint8_t> safe(vertices_.size(), 0);
        const auto put = [&](std::int32_t vertex, double x, double y, double d) {
            const double inverse_depth = last + d * (first - last);
            if (!(inverse_depth > 0 && std::isfinite(inverse_depth)))
                ldi::raise(ldi::error_code::invalid_data, "disparity of a layered image",
                           "a disparity with a positive, finite inverse depth", std::to_string(d));
            safe[vertex] = project(x, y, inverse_depth, vertices_[vertex]) ? 1 : 0;
        };
        ldi::buffer<std::uint8_t> is_placed(sum.size(), 0);
        drawn_.resize(graph_.size());
        for (std::int32_t i = 0; i < count; ++i) {
            put(i, graph_.x()[i] + 0.5, graph_.y()[i] + 0.5, disparity[i]);
            bool all_safe = safe[i] != 0;
            for (int c = 0; c < 4; ++c) {
                const std::int32_t vertex = corner(i, c), k = vertex - count;
                if (is_placed[k] == 0)
                    put(vertex, graph_.x()[i] + pixel_corners[c][0], graph_.y()[i] + pixel_corners[c][1], sum[k] / members[k]);
                is_placed[k] = 1;
                all_safe = all_safe && safe[vertex] != 0;
            }
            drawn_[i] = all_safe ? 1 : 0;
        }
    }

    /// Projects a pixel position with depth from one view to the screen of another.
    class relative_projection {
    public:
        relative_projection(const ldi::view& taken_from, const ldi::view& from, std::int32_t samples, float z_near)
            : z_near_(z_near),
              source_focal_(taken_from.camera.focal_length),
              source_x_(taken_from.axis_x()),
              source_y_(taken_from.axis_y()),
              focal_(double{from.camera.focal_length} * samples),
              x_(double{from.axis_x()} * samples),
              y_(double{from.axis_y()} * samples) {
            std::array<double, 3> offset{};
            for (std::size_t i = 0; i < 3; ++i) offset[i] = double{taken_from.position[i]} - from.position[i];
            for (std::size_t i = 0; i < 3; ++i)
                for (std::size_t j = 0; j < 3; ++j) {
                    offset_[i] += from.rotation[3 * j + i] * offset[j];
                    for (std::size_t k = 0; k < 3; ++k)
                        rotation_[3 * i + j] += double{from.rotation[3 * k + i]} * taken_from.rotation[3 * k + j];
                }
        }

        bool operator()(double x, double y, double inverse_depth, screen_vertex& result) const {
            const double depth = 1 / inverse_depth;
            const std::array<double, 3> p{(x - source_x_) / source_focal_ * depth, (source_y_ - y) / source_focal_ * depth,
                                          -depth};
            std::array<double, 3> seen = offset_;
            for (std::size_t i = 0; i < 3; ++i)
                for (std::size_t j = 0; j < 3; ++j) seen[i] += rotation_[3 * i + j] * p[j];
            if (!(-seen[2] >= z_near_)) return false;
            result.inverse_depth = -1 / seen[2];
            const double across = seen[0] * focal_ * result.inverse_depth, down = -seen[1] * focal_ * result.inverse_depth;
            if (!(std::abs(across) <= guard_band && std::abs(down) <= guard_band)) return false;
            result.x = std::llround((x_ + across) * nearest_double(subsample_steps));
            result.y = std::llround((y_ + down) * nearest_double(subsample_steps));
            return true;
        }

    private:
        double z_near_, source_focal_, source_x_, source_y_, focal_, x_, y_;
        std::array<double, 3> offset_{};
        std::array<double, 9> rotation_{};
    };

    ldi::graph_view graph_;
    ldi::buffer<std::int32_t> corner_of_;  // vertices of each pixel's corners, clockwise from the top left
    ldi::buffer<screen_vertex> vertices_;  // centers of the pixels, then the corners
    ldi::buffer<std::uint8_t> drawn_;      // one per pixel
};

/// Returns the color at (u, v) within a pixel; (0, 0) is its top left corner, and (1, 1) its bottom right corner. Interpolates
/// bilinearly between the centers of the pixels that are linked around the nearest corner. If `pixel` is known, only known
/// pixels count; otherwise, only unknown ones.
template <ldi::has_columns<ldi::color_column, ldi::known_column> Layers>
std::array<std::uint8_t, 3> color_within_pixel(const Layers& layers, std::int32_t pixel, double u, double v) {
    const auto& g = layers.topology();
    const auto known = layers.template column<ldi::known_column>();
    const ldi::side across = u < 0.5 ? ldi::side::left : ldi::side::right, along = v < 0.5 ? ldi::side::up : ldi::side::down;
    const float weight_x = static_cast<float>(std::abs(std::clamp(u, 0.0, 1.0) - 0.5));
    const float weight_y = static_cast<float>(std::abs(std::clamp(v, 0.0, 1.0) - 0.5));
    const auto step = [&](std::int32_t from, ldi::side s) { return from == ldi::no_pixel ? ldi::no_pixel : g.neighbor(from, s); };
    const std::int32_t beside = step(pixel, across), below = step(pixel, along);
    std::int32_t diagonal = step(beside, along);
    if (diagonal == ldi::no_pixel) diagonal = step(below, across);
    std::array<float, 3> sum{};
    float total = 0;
    const auto add = [&](std::int32_t other, float weight) {
        if (other == ldi::no_pixel || known[other] != known[pixel]) return;
        const auto color = layers.template at<ldi::color_column>(other);
        for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * color[c];
        total += weight;
    };
    add(pixel, (1 - weight_x) * (1 - weight_y));
    add(beside, weight_x * (1 - weight_y));
    add(below, (1 - weight_x) * weight_y);
    add(diagonal, weight_x * weight_y);
    std::array<std::uint8_t, 3> result{};
    for (std::size_t c = 0; c < 3; ++c) result[c] = rounded_mean(sum[c] / total);
    return result;
}

}  // namespace ldi_quality
