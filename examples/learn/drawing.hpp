// Drawing functions for the lessons: a canvas, and layered images drawn as tiles in space, seen from the side.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/formats/plain_png.hpp>
#include <ldi/kernels/area_resize.hpp>
#include <ldi/mesh/textured_mesh.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <initializer_list>
#include <numeric>
#include <span>
#include <utility>

namespace learn {

using rgb = std::array<std::uint8_t, 3>;
using picture = ldi::image<std::uint8_t>;

inline constexpr rgb paper{250, 250, 247}, ink{60, 60, 60}, hidden_rim{0, 120, 255}, cut{225, 30, 60};

/// Converts 0 to 1, clamped, to a byte; NaN becomes black.
inline std::uint8_t byte_of(float value) {
    return static_cast<std::uint8_t>(255.0F * (value > 0.0F ? std::min(value, 1.0F) : 0.0F) + 0.5F);
}

struct point {
    float x, y;
};

/// Draws antialiased shapes. Coordinates are in pixels of the final picture.
class canvas {
public:
    canvas(std::size_t width, std::size_t height) : sheet_(height * fine, width * fine, 3) {
        for (std::size_t i = 0; i < sheet_.size(); ++i) sheet_.data()[i] = paper[i % 3];
    }

    /// corners  corners of a convex polygon, in either direction
    void polygon(std::span<const point> corners, rgb color) {
        const auto [left, right] = std::minmax_element(corners.begin(), corners.end(), [](auto a, auto b) { return a.x < b.x; });
        const auto [top, bottom] = std::minmax_element(corners.begin(), corners.end(), [](auto a, auto b) { return a.y < b.y; });
        const auto [y_first, y_last] = range(top->y, bottom->y, sheet_.height());
        const auto [x_first, x_last] = range(left->x, right->x, sheet_.width());
        for (std::size_t y = y_first; y < y_last; ++y)
            for (std::size_t x = x_first; x < x_last; ++x)
                if (is_inside(corners, {center(x), center(y)})) std::copy(color.begin(), color.end(), &sheet_(y, x, 0));
    }

    void line(point a, point b, float width, rgb color) {
        const float length = (std::max)(std::hypot(b.x - a.x, b.y - a.y), 1e-6F);
        const float u = 0.5F * width * (b.x - a.x) / length, v = 0.5F * width * (b.y - a.y) / length;
        polygon(std::array<point, 4>{{{a.x - v, a.y + u}, {b.x - v, b.y + u}, {b.x + v, b.y - u}, {a.x + v, a.y - u}}}, color);
    }

    picture result() const {
        ldi::serial_executor serial;
        return ldi::area_resize(sheet_, sheet_.height() / fine, sheet_.width() / fine, serial);
    }

private:
    static constexpr std::size_t fine = 4;  // samples per pixel and axis

    static float center(std::size_t i) { return (static_cast<float>(i) + 0.5F) / static_cast<float>(fine); }
    static std::pair<std::size_t, std::size_t> range(float first, float last, std::size_t end) {
        const auto inside = [&](float v) {
            return static_cast<std::size_t>(std::clamp(v * static_cast<float>(fine), 0.0F, static_cast<float>(end)));
        };
        return {inside(first), (std::min)(inside(last) + 1, end)};
    }
    static bool is_inside(std::span<const point> corners, point p) {
        bool left = false, right = false;
        for (std::size_t i = 0; i < corners.size(); ++i) {
            const point a = corners[i], b = corners[(i + 1) % corners.size()];
            const float turn = (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
            left = left || turn > 0.0F, right = right || turn < 0.0F;
        }
        return !(left && right);
    }

    picture sheet_;
};

/// A position in a layered image: column, row, and disparity.
struct spot {
    float x, y, disparity;
};

/// Returns the center of a pixel, moved by (dx, dy) pixels.
template <class Layers>
spot spot_of(const Layers& layers, std::int32_t pixel, float dx = 0.0F, float dy = 0.0F) {
    const ldi::graph& g = layers.topology();
    return {static_cast<float>(g.x()[pixel]) + 0.5F + dx, static_cast<float>(g.y()[pixel]) + 0.5F + dy,
            layers.template column<ldi::disparity_column>()[pixel]};
}

template <class Layers>
rgb color_of(const Layers& layers, std::int32_t pixel) {
    const auto c = layers.template at<ldi::color_column>(pixel);
    return {c[0], c[1], c[2]};
}

/// Fades a color toward the background, for the less important parts of a picture.
inline rgb faded(rgb color) {
    for (std::size_t c = 0; c < 3; ++c) color[c] = static_cast<std::uint8_t>((color[c] + paper[c]) / 2);
    return color;
}

/// Projects a layered image as seen from the right and from above. Pixels rise from the image plane in proportion to their
/// disparity.
class side_view {
public:
    /// middle   position of the layered image's center at disparity 0, in pixels of the picture
    /// tile     side of a pixel, in pixels of the picture
    /// stretch  height of disparity 1 in tiles
    side_view(const ldi::graph_view& g, point middle, float tile, float stretch)
        : half_width_(0.5F * static_cast<float>(g.width())),
          half_height_(0.5F * static_cast<float>(g.height())),
          middle_(middle),
          tile_(tile),
          stretch_(stretch) {}

    float tile() const { return tile_; }
    point operator()(const spot& s) const {
        const float u = s.x - half_width_, v = s.y - half_height_, out = stretch_ * s.disparity;
        return {middle_.x + tile_ * (u * std::cos(yaw) - out * std::sin(yaw)),
                middle_.y + tile_ * (v * std::cos(pitch) + towards_us(u, out) * std::sin(pitch))};
    }
    float nearness(const spot& s) const {
        return towards_us(s.x - half_width_, stretch_ * s.disparity) * std::cos(pitch) - (s.y - half_height_) * std::sin(pitch);
    }

private:
    static constexpr float yaw = 0.75F, pitch = 0.3F;  // radians
    static float towards_us(float u, float out) { return out * std::cos(yaw) + u * std::sin(yaw); }

    float half_width_, half_height_;
    point middle_;
    float tile_, stretch_;
};

/// Draws every pixel as a tile, and every link as a bar between tiles; tiles of hidden pixels have a blue rim.
/// color(pixel)  returns the color of the pixel's tile (rgb)
template <class Layers, class Color>
void draw_tiles(canvas& sheet, const Layers& layers, const side_view& from, Color&& color) {
    const ldi::graph& g = layers.topology();
    const auto at = [&](std::int32_t i, float dx, float dy) { return from(spot_of(layers, i, dx, dy)); };
    const auto square = [&](std::int32_t i, float half, rgb c) {
        sheet.polygon(std::array<point, 4>{{at(i, -half, -half), at(i, half, -half), at(i, half, half), at(i, -half, half)}}, c);
    };
    ldi::buffer<std::int32_t> order(g.size());
    std::iota(order.begin(), order.end(), 0);
    std::sort(order.begin(), order.end(), [&](std::int32_t a, std::int32_t b) {
        return from.nearness(spot_of(layers, a)) < from.nearness(spot_of(layers, b));
    });
    for (const std::int32_t i : order) {
        for (const ldi::side s : {ldi::side::right, ldi::side::down})
            if (const std::int32_t other = g.neighbor(i, s); other != ldi::no_pixel) {
                const float dx = 0.3F * static_cast<float>(step_x(s)), dy = 0.3F * static_cast<float>(step_y(s));
                sheet.line(at(i, dx, dy), at(other, -dx, -dy), 0.2F * from.tile(), ink);
            }
        const bool is_hidden = layers.template column<ldi::known_column>()[i] == 0;
        if (is_hidden) square(i, 0.42F, hidden_rim);
        square(i, is_hidden ? 0.3F : 0.38F, color(i));
    }
}

/// Draws a magnified picture: each pixel becomes a square of side `tile`. `corner` is the upper left corner.
inline void draw_pixels(canvas& sheet, const picture& photo, point corner, float tile) {
    for (std::size_t y = 0; y < photo.height(); ++y)
        for (std::size_t x = 0; x < photo.width(); ++x) {
            const float left = corner.x + tile * static_cast<float>(x), top = corner.y + tile * static_cast<float>(y);
            const std::uint8_t* const c = photo.row(y) + 3 * x;
            sheet.polygon(std::array<point, 4>{{{left, top}, {left + tile, top}, {left + tile, top + tile}, {left, top + tile}}},
                          {c[0], c[1], c[2]});
        }
}

/// Draws a layered image as its camera sees it. Every position must have a pixel.
/// farthest      draw the farthest pixel at every position instead of the nearest
/// color(pixel)  returns the pixel's color (rgb)
template <class Layers, class Color>
picture seen(const Layers& layers, bool farthest, Color&& color) {
    const ldi::graph& g = layers.topology();
    const auto& disparity = layers.template column<ldi::disparity_column>();
    ldi::image<std::int32_t> pixel_at(static_cast<std::size_t>(g.height()), static_cast<std::size_t>(g.width()), 1,
                                      ldi::no_pixel);
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(g.size()); ++i) {
        std::int32_t& there = pixel_at(g.y()[i], g.x()[i]);
        if (there == ldi::no_pixel || (disparity[i] < disparity[there]) == farthest) there = i;
    }
    picture result(pixel_at.height(), pixel_at.width(), 3);
    for (std::size_t y = 0; y < result.height(); ++y)
        for (std::size_t x = 0; x < result.width(); ++x) {
            const rgb c = color(pixel_at(y, x));
            std::copy(c.begin(), c.end(), result.row(y) + 3 * x);
        }
    return result;
}

/// Combines pictures side by side, with gaps in the color of the background.
inline picture side_by_side(std::span<const picture> pictures) {
    constexpr std::size_t gap = 8;
    std::size_t width = 0, height = 0;
    for (const picture& p : pictures) width += p.width() + (width > 0 ? gap : 0), height = (std::max)(height, p.height());
    picture all(height, width, 3, paper[0]);
    std::size_t left = 0;
    for (const picture& p : pictures) {
        for (std::size_t y = 0; y < p.height(); ++y) std::copy_n(p.row(y), 3 * p.width(), all.row(y) + 3 * left);
        left += p.width() + gap;
    }
    return all;
}
inline picture side_by_side(std::initializer_list<picture> pictures) {
    return side_by_side(std::span<const picture>(pictures.begin(), pictures.size()));
}

/// Draws a mesh's triangles from the photo's camera, each in the mean color of its vertices.
/// color(vertex)  returns red, green and blue, 0 to 1
template <class Color>
picture draw_triangles(const ldi::textured_mesh& mesh, const ldi::pinhole_camera& camera, Color&& color) {
    canvas sheet(static_cast<std::size_t>(camera.width), static_cast<std::size_t>(camera.height));
    const auto corner = [&](std::size_t t, std::size_t k) { return mesh.triangles[3 * t + k]; };
    const auto nearness = [&](std::size_t t) {
        return mesh.positions[3 * corner(t, 0) + 2] + mesh.positions[3 * corner(t, 1) + 2] + mesh.positions[3 * corner(t, 2) + 2];
    };
    ldi::buffer<std::size_t> order(mesh.triangle_count());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return nearness(a) < nearness(b); });
    for (const std::size_t t : order) {
        std::array<point, 3> seen{};
        std::array<float, 3> mean{};
        for (std::size_t k = 0; k < 3; ++k) {
            const float* const p = mesh.positions.data() + 3 * corner(t, k);
            const auto [x, y] = camera.project({p[0], p[1], p[2]});
            seen[k] = {x, y};
            for (std::size_t c = 0; c < 3; ++c) mean[c] += color(corner(t, k))[c] / 3.0F;
        }
        sheet.polygon(seen, {byte_of(mean[0]), byte_of(mean[1]), byte_of(mean[2])});
    }
    return sheet.result();
}

/// Writes a PNG file.
inline void save(const char* name, const picture& drawn) {
    const ldi::buffer<std::byte> png = ldi::encode_plain_png(drawn);
    std::ofstream(name, std::ios::binary)
        .write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
}

}  // namespace learn
