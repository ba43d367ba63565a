// The analytic scenes by name. Their hidden surfaces are known exactly, because surfaces_at() lists every surface.
#pragma once

#include "ray_caster.hpp"
#include "still_life.hpp"

#include <ldi/base/error.hpp>

#include <random>
#include <string>

namespace ldi::scenes {

/// Foreground, midground and background meet in a T. All three face the camera: disparity 1, 0.5 and 0.
///
/// object 0  foreground: everything left of x = 0.4 width, in the photo
/// object 1  midground: below y = 0.55 height, from x = 0.1 width behind the foreground to beyond the photo's right side
/// object 2  background: everywhere
inline scene t_junction(std::int32_t width = 192, std::int32_t height = 256) {
    scene s;
    s.camera = {width, height, focal_length_from_field_of_view(55, width, height)};
    s.range = {1, 4};
    const texture colors[] = {bricks(from_srgb(214, 152, 118), from_srgb(160, 88, 66), from_srgb(205, 196, 182), 0.2, 0.07),
                              boards(from_srgb(120, 160, 200), from_srgb(52, 84, 120), 0.11),
                              marbled(from_srgb(88, 128, 72), from_srgb(226, 220, 160), 0.5)};
    const double w = width, h = height;
    // Sides of the planes in pixels of the photo. Planes that leave the photo extend far beyond it.
    const struct {
        double left, top, right, bottom;
        float disparity;
    } planes[] = {{-w, -h, 0.4 * w, 2 * h, 1}, {0.1 * w, 0.55 * h, 2 * w, 2 * h, 0.5F}, {-2 * w, -2 * h, 3 * w, 3 * h, 0}};
    for (std::size_t i = 0; i < 3; ++i) {
        const auto& p = planes[i];
        const double depth = static_cast<double>(s.range.depth(p.disparity));
        const double scale = depth / static_cast<double>(s.camera.focal_length);
        const vector3 center{(0.5 * (p.left + p.right) - 0.5 * w) * scale, (0.5 * h - 0.5 * (p.top + p.bottom)) * scale, -depth};
        s.add(make_rectangle({center}, (p.right - p.left) * scale, (p.bottom - p.top) * scale), colors[i]);
    }
    return s;
}

/// Thin rods, 1 to 12 pixels wide at an image height of 256, over a slanted floor and in front of a slanted wall.
inline scene rods(std::int32_t width = 192, std::int32_t height = 256) {
    scene s;
    s.camera = {width, height, focal_length_from_field_of_view(55, width, height)};
    s.add(make_rectangle({{0, -0.6, -2}, {1, 0, 0}, {0, 0, -1}, {0, 1, 0}}, 12, 8),
          checker(from_srgb(220, 208, 186), from_srgb(120, 104, 92), 0.3));
    s.add(make_rectangle(turned({0.4, 0, -3.2}, 0.5), 14, 12),
          bricks(from_srgb(214, 190, 168), from_srgb(170, 130, 110), from_srgb(235, 230, 222), 0.42, 0.15, 2));
    const vector3 colors[] = {from_srgb(204, 60, 50), from_srgb(50, 100, 170), from_srgb(240, 190, 60), from_srgb(70, 140, 90),
                              from_srgb(60, 56, 60)};
    for (int i = 0; i < 11; ++i) {
        const double x = -0.42 + 0.085 * i, z = -1.05 - 0.09 * ((i * 7) % 11);
        const double lean = 0.16 * ((i * 5) % 7 - 3) / 3.0;
        s.add(make_rod({x, -0.6, z}, {x + lean, 0.45 + 0.05 * ((i * 3) % 4), z + 0.5 * lean}, 0.002 + 0.0022 * ((i * 4) % 9)),
              plain(colors[i % 5]));
    }
    s.add(make_rod({-0.6, 0.12, -1.0}, {0.6, -0.02, -1.9}, 0.006), plain(from_srgb(240, 236, 226)));
    s.light.to_sun = normalized({-0.5, 0.8, 0.5});
    s.light.sun = {0.8, 0.76, 0.66};
    s.light.sky = {0.5, 0.54, 0.6}, s.light.ground = {0.3, 0.28, 0.26};
    fit_depth_range(s);
    return s;
}

/// A slanted background and two to eight objects of random shape, position and texture in front of it. The same seed produces
/// the same scene on every machine.
inline scene random_scene(std::uint32_t seed, std::int32_t width = 96, std::int32_t height = 128) {
    std::mt19937 generator(seed);
    const auto between = [&generator](double low, double high) {
        return low + (high - low) * (static_cast<double>(generator()) * 0x1.0p-32);
    };
    const auto color = [&] {
        const double r = between(30, 240), g = between(30, 240), b = between(30, 240);
        return from_srgb(r, g, b);
    };
    const auto any_texture = [&](double size) -> texture {
        const vector3 a = color(), b = color();
        switch (generator() % 6) {
            case 0: return plain(a);
            case 1: return marbled(a, b, size * 0.5, seed);
            case 2: return stripes(a, b, size * 0.2);
            case 3: return checker(a, b, size * 0.25);
            case 4: return bricks(a, b, from_srgb(220, 214, 204), size * 0.4, size * 0.16, seed);
            default: return boards(a, b, size * 0.3, seed);
        }
    };
    scene s;
    s.camera = {width, height, focal_length_from_field_of_view(static_cast<float>(between(45, 70)), width, height)};
    const double slant_y = between(-0.6, 0.6), slant_x = between(-0.6, 0.6);
    s.add(make_rectangle(turned({0, 0, -4}, slant_y, slant_x), 60, 60), any_texture(1.5));
    const std::uint32_t count = 2 + static_cast<std::uint32_t>(generator() % 7);
    for (std::uint32_t i = 0; i < count; ++i) {
        const double depth = between(0.9, 2.2), size = between(0.15, 0.45) * depth;
        const double across = between(-0.4, 0.4) * depth, up = between(-0.5, 0.5) * depth;
        const double angle_y = between(-1.5, 1.5), angle_x = between(-1, 1);
        const frame place = turned({across, up, -depth}, angle_y, angle_x);
        const texture surface = any_texture(size);
        switch (generator() % 4) {
            case 0: s.add(make_sphere(place, 0.4 * size), surface); break;
            case 1: s.add(make_box(place, size, 0.8 * size, 0.6 * size), surface); break;
            case 2: s.add(make_rectangle(place, size, 1.2 * size), surface); break;
            default:
                s.add(make_rod(place.to_world({0, -size, 0}), place.to_world({0, size, 0}), between(0.01, 0.2) * size), surface);
        }
    }
    const double sun_x = between(-1, 1), sun_y = between(0.2, 1);
    s.light.to_sun = normalized({sun_x, sun_y, 0.8});
    s.light.sun = {0.6, 0.6, 0.55};
    s.light.sky = {0.5, 0.5, 0.55}, s.light.ground = {0.3, 0.3, 0.3};
    fit_depth_range(s);
    return s;
}

/// Finds a scene: "t_junction", "still_life", "rods", or "random" and a number, such as "random7". Raises invalid_option for
/// other names.
inline scene scene_by_name(const std::string& name, std::int32_t width, std::int32_t height) {
    if (name == "t_junction") return t_junction(width, height);
    if (name == "still_life") return still_life(width, height);
    if (name == "rods") return rods(width, height);
    if (name.size() > 6 && name.size() < 15 && name.compare(0, 6, "random") == 0 &&
        name.find_first_not_of("0123456789", 6) == std::string::npos)
        return random_scene(static_cast<std::uint32_t>(std::stoul(name.substr(6))), width, height);
    raise(error_code::invalid_option, "scene", "t_junction, still_life, rods, or random followed by a number", name);
}

}  // namespace ldi::scenes
