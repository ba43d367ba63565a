// A small ray caster for ground truth. It computes a photo, its disparity, and all surfaces behind each pixel, including those
// that the photo does not show.
#pragma once

#include "shapes.hpp"

#include <ldi/base/executor.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/image.hpp>
#include <ldi/render/camera.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace ldi::scenes {

struct object {
    shape form;
    texture color;
};

/// Light of a scene. Surfaces are matte, so that they look the same from every direction. Colors are linear light.
struct lighting {
    vector3 to_sun{0, 1, 0};                            ///< length 1
    vector3 sun{0, 0, 0};                               ///< light of the sun on a surface that faces it
    double sun_radius = 0.02;                           ///< radius of the sun at distance 1; softens shadows
    vector3 up{0, 1, 0};                                ///< length 1
    vector3 sky{0.9, 0.9, 0.9}, ground{0.6, 0.6, 0.6};  ///< light from above and below on unobstructed surfaces
    bool shadows = false;  ///< true: objects cast shadows and reflect light once; false: shading uses only the normal
};

/// A scene in the space of the photo's camera (core/camera.hpp). An object's number is its index in `objects`.
struct scene {
    pinhole_camera camera;
    depth_range range;  ///< distances at disparity 1 and 0
    lighting light;
    std::vector<object> objects;

    void add(const shape& form, texture color) { objects.push_back({form, std::move(color)}); }
};

/// Computes normalized disparity: 1 at range.z_near, 0 at range.z_far. Depths outside the range have values outside [0, 1].
inline float disparity(const depth_range& range, double depth) {
    const double first = 1.0 / static_cast<double>(range.z_near), last = 1.0 / static_cast<double>(range.z_far);
    return static_cast<float>((1 / depth - last) / (first - last));
}

/// A surface on the line of sight of a pixel.
struct surface {
    double depth = 0;     ///< along the optical axis
    float disparity = 0;  ///< result of disparity()
    std::int32_t object = -1;
    bool enters = true;  ///< whether the line of sight enters the object here (rectangles: always) or leaves it
    std::array<std::uint8_t, 3> color{};
};

/// A rendered view.
struct picture {
    image<std::uint8_t> color;   ///< H x W x 3, sRGB; pixels at silhouettes mix the colors of several surfaces, as a lens does
    image<float> depth;          ///< H x W x 1, of the surface at the pixel's center; infinity without a surface
    image<float> disparity;      ///< H x W x 1, disparity() of this depth; minus infinity without a surface
    image<std::int32_t> object;  ///< H x W x 1, number of the surface's object; -1 without a surface
};

struct picture_options {
    std::int32_t samples = 4;  ///< per pixel and axis
    double blur = 1;           ///< half width, in pixels, of the tent filter that models the lens
};

/// Lists all surfaces on the line of sight through (x, y), in pixels of the photo, nearest first.
std::vector<surface> surfaces_at(const scene& s, double x, double y);

/// Renders a view of the scene. Requires options.samples > 0 and a view of at least one pixel.
template <executor Executor>
picture render(const scene& s, const view& from, const picture_options& options, Executor& threads);

inline picture render(const scene& s, const view& from, const picture_options& options = {}) {
    serial_executor serial;
    return render(s, from, options, serial);
}

/// Renders the photo: the view of the scene's camera.
inline picture render(const scene& s, const picture_options& options = {}) {
    view from;
    from.camera = s.camera;
    return render(s, from, options);
}

/// Sets the depth range so that the nearest surface at any pixel center of the photo has disparity 1 and the farthest has 0.
void fit_depth_range(scene& s);

// ---------------------------------------------------------------------------------------------------------------------------------

namespace detail {

/// Random numbers in [0, 1), the same on every machine (splitmix64).
struct random_sequence {
    std::uint64_t state;
    double next() {
        state += 0x9E3779B97F4A7C15ULL;
        std::uint64_t z = state;
        z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
        z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
        return static_cast<double>((z ^ (z >> 31U)) >> 11U) * 0x1.0p-53;
    }
};

/// Random numbers for the samples of a pixel. spread() returns the numbers for the surface that the ray hits first. They are
/// spread evenly over the samples (the R4 sequence), which removes most of the noise. The numbers of `random` are independent.
struct light_sample {
    random_sequence random;
    std::array<double, 4> start;
    double index = 0;

    explicit light_sample(std::uint64_t seed) : random{seed} {
        random.state ^= static_cast<std::uint64_t>(random.next() * 0x1.0p53);
        for (double& s : start) s = random.next();
    }
    /// Returns a number in [0, 1).
    ///
    /// dimension  0 to 3
    double spread(std::size_t dimension) const {
        const double steps[] = {0.8566748838545029, 0.7338918566271260, 0.6287067210378087, 0.5385972572236101};
        const double value = start[dimension] + index * steps[dimension];
        return value - std::floor(value);
    }
};

struct hit {
    double distance = std::numeric_limits<double>::infinity();
    std::int32_t object = -1;
};

/// Tests whether the ray's line meets a sphere around the shape. If it does not, the ray misses the shape.
inline bool may_hit(const shape& s, const ray& r) {
    const vector3 to_center = s.place.origin - r.origin;
    const double along_ray = dot(to_center, r.direction), squared = dot(r.direction, r.direction);
    const double radius_squared = s.what == shape::kind::sphere ? s.size.x * s.size.x
                                  : s.what == shape::kind::rod  ? s.size.x * s.size.x + s.size.y * s.size.y
                                                                : dot(s.size, s.size);
    return dot(to_center, to_center) * squared - along_ray * along_ray <= radius_squared * squared * (1 + 1e-12);
}

/// Finds the first surface beyond `min_distance`, in units of the ray's direction. Without one, `object` is -1.
inline hit first_hit(const scene& s, const ray& r, double min_distance) {
    hit nearest;
    for (std::size_t i = 0; i < s.objects.size(); ++i) {
        if (!may_hit(s.objects[i].form, r)) continue;
        const crossings c = intersect(s.objects[i].form, r);
        for (int k = 0; k < c.count; ++k) {
            const double distance = c.distance[static_cast<std::size_t>(k)];
            if (distance > min_distance && distance < nearest.distance) nearest = {distance, static_cast<std::int32_t>(i)};
        }
    }
    return nearest;
}

inline constexpr double surface_gap = 1e-6;  // keeps a ray that starts on a surface from hitting the same surface

inline vector3 sky_light(const lighting& light, const vector3& direction) {
    return mix(light.ground, light.sky, 0.5 + 0.5 * dot(direction, light.up));
}

inline vector3 sun_light(const scene& s, const vector3& point, const vector3& normal, double u, double v) {
    const lighting& light = s.light;
    const double facing = dot(normal, light.to_sun);
    if (facing <= 0 || dot(light.sun, light.sun) == 0) return {};
    if (light.shadows) {
        const frame disc = along({}, light.to_sun);
        const double radius = light.sun_radius * std::sqrt(u), angle = 6.283185307179586 * v;
        const vector3 direction = light.to_sun + disc.x * (radius * std::cos(angle)) + disc.z * (radius * std::sin(angle));
        if (first_hit(s, {point, direction}, surface_gap).object >= 0) return {};
    }
    return light.sun * facing;
}

/// Computes the light that a surface reflects, equally in all directions. `from` is the direction of the ray that hit the
/// surface.
inline vector3 radiance(const scene& s, const object& o, const vector3& point, const vector3& from, light_sample& sample,
                        bool reflected = false) {
    const surface_description surface = describe(o.form, point);
    const vector3 normal = dot(surface.normal, from) > 0 ? -surface.normal : surface.normal;
    const vector3 outside = point + normal * surface_gap;
    if (!s.light.shadows) return o.color(surface.where) * (sun_light(s, outside, normal, 0, 0) + sky_light(s.light, normal));
    if (reflected) {
        const double u = sample.random.next(), v = sample.random.next();
        // A surface that reflects light onto another object is close to that object. Assume that objects hide half of the sky.
        return o.color(surface.where) * (sun_light(s, outside, normal, u, v) + 0.5 * sky_light(s.light, normal));
    }
    vector3 received = sun_light(s, outside, normal, sample.spread(0), sample.spread(1));
    const frame hemisphere = along({}, normal);
    const double square = sample.spread(2), angle = 6.283185307179586 * sample.spread(3), radius = std::sqrt(square);
    const ray to_sky{outside, hemisphere.x * (radius * std::cos(angle)) + hemisphere.z * (radius * std::sin(angle)) +
                                  normal * std::sqrt(1 - square)};
    const hit blocker = first_hit(s, to_sky, surface_gap);
    received = received + (blocker.object < 0 ? sky_light(s.light, to_sky.direction)
                                              : radiance(s, s.objects[static_cast<std::size_t>(blocker.object)],
                                                         to_sky.at(blocker.distance), to_sky.direction, sample, true));
    return o.color(surface.where) * received;
}

/// Converts linear light to a byte of the photo: compresses values above 0.7, then encodes sRGB.
inline std::uint8_t to_byte(double linear) {
    const double knee = 0.7;
    const double v = linear < knee ? std::max(linear, 0.0) : knee + (1 - knee) * (1 - std::exp((knee - linear) / (1 - knee)));
    const double encoded = v <= 0.0031308 ? 12.92 * v : 1.055 * std::pow(v, 1 / 2.4) - 0.055;
    return static_cast<std::uint8_t>(std::lround(std::clamp(encoded, 0.0, 1.0) * 255));
}

inline std::array<std::uint8_t, 3> to_bytes(const vector3& color) {
    return {to_byte(color.x), to_byte(color.y), to_byte(color.z)};
}

/// Returns the ray through pixel coordinates (x, y) of a view. Distances along the ray are depths along the view's axis.
inline ray primary_ray(const view& from, double x, double y) {
    const double f = static_cast<double>(from.camera.focal_length);
    const vector3 d{(x - from.axis_x()) / f, (from.axis_y() - y) / f, -1};
    std::array<double, 9> r{};
    for (std::size_t i = 0; i < 9; ++i) r[i] = static_cast<double>(from.rotation[i]);
    return {{static_cast<double>(from.position[0]), static_cast<double>(from.position[1]), static_cast<double>(from.position[2])},
            {r[0] * d.x + r[1] * d.y + r[2] * d.z, r[3] * d.x + r[4] * d.y + r[5] * d.z, r[6] * d.x + r[7] * d.y + r[8] * d.z}};
}

/// Maps a uniform number in [0, 1) to a position in a tent filter of half width 1.
inline double tent(double uniform) { return uniform < 0.5 ? std::sqrt(2 * uniform) - 1 : 1 - std::sqrt(2 - 2 * uniform); }

inline std::array<std::uint8_t, 3> mixed_color(const scene& s, const view& from, std::size_t x, std::size_t y,
                                               const picture_options& options) {
    light_sample sample((static_cast<std::uint64_t>(y) << 32U) + x);
    vector3 sum;
    const double share = 1.0 / options.samples;
    for (std::int32_t j = 0; j < options.samples; ++j)
        for (std::int32_t i = 0; i < options.samples; ++i) {
            const double dx = options.blur * tent((i + sample.random.next()) * share);
            const double dy = options.blur * tent((j + sample.random.next()) * share);
            const ray r = primary_ray(from, static_cast<double>(x) + 0.5 + dx, static_cast<double>(y) + 0.5 + dy);
            const hit h = first_hit(s, r, 0);
            if (h.object < 0) continue;
            sum = sum + radiance(s, s.objects[static_cast<std::size_t>(h.object)], r.at(h.distance), r.direction, sample);
            ++sample.index;
        }
    return to_bytes(sum * (share * share));
}

}  // namespace detail

inline std::vector<surface> surfaces_at(const scene& s, double x, double y) {
    view photo;
    photo.camera = s.camera;
    const ray r = detail::primary_ray(photo, x, y);
    std::vector<surface> result;
    for (std::size_t i = 0; i < s.objects.size(); ++i) {
        const object& o = s.objects[i];
        const crossings c = intersect(o.form, r);
        for (int k = 0; k < c.count; ++k) {
            const double depth = c.distance[static_cast<std::size_t>(k)];
            if (depth <= 0) continue;
            detail::light_sample sample(static_cast<std::uint64_t>(i) * 2 + static_cast<std::uint64_t>(k));
            const int count = s.light.shadows ? 64 : 1;
            vector3 sum;
            for (int n = 0; n < count; ++n, ++sample.index) sum = sum + detail::radiance(s, o, r.at(depth), r.direction, sample);
            result.push_back(
                {depth, disparity(s.range, depth), static_cast<std::int32_t>(i), k == 0, detail::to_bytes(sum * (1.0 / count))});
        }
    }
    std::stable_sort(result.begin(), result.end(), [](const surface& a, const surface& b) { return a.depth < b.depth; });
    return result;
}

template <executor Executor>
picture render(const scene& s, const view& from, const picture_options& options, Executor& threads) {
    LDI_ASSERT(options.samples > 0 && from.camera.width > 0 && from.camera.height > 0);
    const std::size_t h = static_cast<std::size_t>(from.camera.height), w = static_cast<std::size_t>(from.camera.width);
    picture result{image<std::uint8_t>(h, w, 3), image<float>(h, w), image<float>(h, w), image<std::int32_t>(h, w)};
    parallel_for(threads, h, 1, [&](std::size_t first, std::size_t last) {
        for (std::size_t y = first; y < last; ++y)
            for (std::size_t x = 0; x < w; ++x) {
                const ray r = detail::primary_ray(from, static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
                const detail::hit hit = detail::first_hit(s, r, 0);
                const bool nothing = hit.object < 0;
                result.depth.row(y)[x] = static_cast<float>(hit.distance);
                result.disparity.row(y)[x] = nothing ? -std::numeric_limits<float>::infinity() : disparity(s.range, hit.distance);
                result.object.row(y)[x] = hit.object;
                const std::array<std::uint8_t, 3> color = detail::mixed_color(s, from, x, y, options);
                std::copy(color.begin(), color.end(), result.color.row(y) + 3 * x);
            }
    });
    return result;
}

inline void fit_depth_range(scene& s) {
    view photo;
    photo.camera = s.camera;
    double nearest = std::numeric_limits<double>::infinity(), farthest = 0;
    for (std::int32_t y = 0; y < s.camera.height; ++y)
        for (std::int32_t x = 0; x < s.camera.width; ++x) {
            const detail::hit hit = detail::first_hit(s, detail::primary_ray(photo, x + 0.5, y + 0.5), 0);
            if (hit.object < 0) continue;
            nearest = std::min(nearest, hit.distance);
            farthest = std::max(farthest, hit.distance);
        }
    LDI_ASSERT(nearest < farthest);
    s.range = {static_cast<float>(nearest), static_cast<float>(farthest)};
}

}  // namespace ldi::scenes
