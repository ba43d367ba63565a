// Holes: pixels inside the frame that no triangle covers, seen from positions at and inside the limits of the camera's motion.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/core/image.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/camera.hpp>
#include <ldi/render/camera_paths.hpp>
#include <ldi/render/motion.hpp>
#include <ldi/render/rasterizer.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace ldi_quality {

/// The 24 photographs of ../shared/photos/eval, and every nth of train.
inline std::vector<std::filesystem::path> photographs_of_shared(std::size_t n) {
    std::vector<std::filesystem::path> result;
    for (const auto& [name, every] : {std::pair<const char*, std::size_t>{"eval", 1}, {"train", n}}) {
        const std::filesystem::path folder = std::filesystem::path(LDI_SHARED_DIR) / "photos" / name;
        if (!std::filesystem::exists(folder)) {
            std::printf("skipped: there is no %s\n", folder.c_str());
            continue;
        }
        std::vector<std::filesystem::path> all;
        for (const auto& file : std::filesystem::directory_iterator(folder)) all.push_back(file.path());
        std::sort(all.begin(), all.end());
        for (std::size_t i = 0; i < all.size(); i += every) result.push_back(all[i]);
    }
    return result;
}

/// The forty photographs of the table.
inline std::vector<std::filesystem::path> forty_photographs() { return photographs_of_shared(80); }

/// A position of the camera, with a name to print.
struct named_view {
    std::string name;
    ldi::view from;
};

/// Views from five positions along each named path.
inline std::vector<named_view> views_on_paths(const ldi::photo_facts& photo) {
    std::vector<named_view> result;
    ldi::path_options options;
    options.motion = photo.motion;
    for (const auto& [name, path] : {std::pair{"circle", ldi::camera_path::circle},
                                     {"swing", ldi::camera_path::swing},
                                     {"zoom-in", ldi::camera_path::zoom_in},
                                     {"dolly-zoom", ldi::camera_path::dolly_zoom}})
        for (const float time : {0.125F, 0.25F, 0.5F, 0.75F, 1.0F})
            result.push_back({std::string(name) + " " + std::to_string(time),
                              ldi::view_on_path(path, photo.camera, photo.range, time, options)});
    return result;
}

/// Scales a view to a long side of `long_side` pixels, and then makes its picture 15 % wider and higher, because the viewer in a
/// browser shows a window that moves across the photo, and so sees areas outside the view's own picture.
inline ldi::view widened(ldi::view from, std::int32_t long_side) {
    constexpr float margin = 1.15F;
    ldi::pinhole_camera& camera = from.camera;
    const float scale = static_cast<float>(long_side) / static_cast<float>(std::max(camera.width, camera.height));
    const auto length = [&](std::int32_t pixels) {
        return static_cast<std::int32_t>(std::ceil(margin * scale * static_cast<float>(pixels)));
    };
    camera = {length(camera.width), length(camera.height), scale * camera.focal_length};
    return from;
}

/// Views from the limits of the camera's motion and from halfway there: in eight directions at the photo's distance, closer and
/// farther; straight forward and back; and along every named path.
inline std::vector<named_view> allowed_views(const ldi::photo_facts& photo, std::int32_t long_side) {
    std::vector<named_view> result;
    const auto add = [&](const std::array<float, 3>& direction, float share) {
        const float far = 0.99F * photo.range.z_near;  // in front of the nearest surface
        std::array<float, 3> limit = ldi::within_motion({far * direction[0], far * direction[1], far * direction[2]},
                                                        photo.camera, photo.range, photo.motion);
        for (float& coordinate : limit) coordinate *= share;
        named_view v{std::to_string(limit[0]) + " " + std::to_string(limit[1]) + " " + std::to_string(limit[2]), {}};
        v.from.camera = photo.camera, v.from.position = limit;
        v.from = widened(v.from, long_side);
        result.push_back(std::move(v));
    };
    for (const float share : {1.0F, 0.5F}) {
        for (const float forward : {-1.0F, -0.3F, 0.0F, 0.3F, 1.0F})
            for (int i = 0; i < 8; ++i) {
                const float angle = 0.785398163F * static_cast<float>(i);
                add({std::cos(angle), std::sin(angle), -forward}, share);
            }
        add({0, 0, -1}, share), add({0, 0, 1}, share);
    }
    for (const named_view& v : views_on_paths(photo)) result.push_back({v.name, widened(v.from, long_side)});
    return result;
}

/// Tests whether the ray through the middle of a pixel meets the photo, not the area beyond its border, at every depth of the
/// photo's range. Even a viewer that hides the border may show such a pixel.
class frame_test {
public:
    frame_test(const ldi::view& from, const ldi::pinhole_camera& photo, const ldi::depth_range& range)
        : from_(from), photo_(photo), range_(range) {}

    bool shows_photo(std::int32_t x, std::int32_t y) const {
        const std::array<float, 3> ray =
            from_.direction_to_photo({static_cast<float>(x) + 0.5F - from_.axis_x(),
                                      from_.axis_y() - static_cast<float>(y) - 0.5F, -from_.camera.focal_length});
        for (const float depth : {range_.z_near, range_.z_far}) {
            if (!(ray[2] < 0) || !(from_.position[2] > -depth)) return false;
            const float along = (-depth - from_.position[2]) / ray[2];
            const auto [u, v] = photo_.project({from_.position[0] + along * ray[0], from_.position[1] + along * ray[1], -depth});
            if (!(u >= border && u <= static_cast<float>(photo_.width) - border && v >= border &&
                  v <= static_cast<float>(photo_.height) - border))
                return false;
        }
        return true;
    }

private:
    static constexpr float border = 1;  // pixels of the photo

    ldi::view from_;
    ldi::pinhole_camera photo_;
    ldi::depth_range range_;
};

/// A group of uncovered pixels that touch at sides or corners.
struct hole {
    std::size_t view = 0;
    std::int32_t x = 0, y = 0;  ///< one of its pixels
    std::int64_t pixels = 0;
};

/// Finds the holes in one picture.
inline std::vector<hole> find_holes(const ldi::image<std::uint8_t>& coverage, const frame_test& frame, std::size_t view) {
    const std::int32_t w = static_cast<std::int32_t>(coverage.width()), h = static_cast<std::int32_t>(coverage.height());
    ldi::image<std::uint8_t> open(coverage.height(), coverage.width(), 1);
    std::vector<std::pair<std::int32_t, std::int32_t>> uncovered, stack;
    for (std::int32_t y = 0; y < h; ++y)
        for (std::int32_t x = 0; x < w; ++x)
            if (coverage(y, x, 0) == 0 && frame.shows_photo(x, y)) open(y, x, 0) = 1, uncovered.emplace_back(x, y);
    std::vector<hole> result;
    for (const auto& [start_x, start_y] : uncovered) {
        if (open(start_y, start_x, 0) == 0) continue;
        hole found{view, start_x, start_y, 0};
        open(start_y, start_x, 0) = 0;
        stack.assign(1, {start_x, start_y});
        while (!stack.empty()) {
            const auto [x, y] = stack.back();
            stack.pop_back();
            ++found.pixels;
            for (std::int32_t v = std::max(y - 1, 0); v <= std::min(y + 1, h - 1); ++v)
                for (std::int32_t u = std::max(x - 1, 0); u <= std::min(x + 1, w - 1); ++u)
                    if (open(v, u, 0) != 0) open(v, u, 0) = 0, stack.emplace_back(u, v);
        }
        result.push_back(found);
    }
    return result;
}

struct hole_report {
    std::size_t views = 0, views_with_holes = 0;
    std::int64_t max_pixels = 0;  ///< maximum number of uncovered pixels in a view
    std::vector<hole> holes;      ///< holes of all views, largest first
};

/// Counts the holes in a mesh from all allowed views, at a long side of `long_side` pixels.
template <ldi::executor Executor>
hole_report count_holes(const ldi::textured_mesh& mesh, const ldi::photo_facts& photo, std::int32_t long_side,
                        Executor&& threads) {
    ldi::raster_options raster;
    raster.z_near = 1e-3F * photo.range.z_near;
    const ldi::image<std::uint8_t> white(1, 1, 3);
    hole_report result;
    for (const named_view& v : allowed_views(photo, long_side)) {
        const ldi::rendering seen = ldi::rasterize(mesh, white, v.from, raster, threads);
        const std::vector<hole> found = find_holes(seen.coverage, frame_test(v.from, photo.camera, photo.range), result.views);
        std::int64_t pixels = 0;
        for (const hole& h : found) pixels += h.pixels;
        result.max_pixels = std::max(result.max_pixels, pixels);
        result.views_with_holes += found.empty() ? 0U : 1U;
        result.holes.insert(result.holes.end(), found.begin(), found.end());
        ++result.views;
    }
    std::sort(result.holes.begin(), result.holes.end(), [](const hole& a, const hole& b) { return a.pixels > b.pixels; });
    return result;
}

}  // namespace ldi_quality
