// The project's sample scene: toys on a wooden table in front of a brick wall, lit by a window outside the picture.
#pragma once

#include "ray_caster.hpp"

namespace ldi::scenes {

namespace detail {

inline constexpr double table_height = 0;

/// Builds the room with y up and the table's top at 0; `room` places it in front of the camera.
struct still_life_builder {
    scene result;
    frame room;

    void box(const frame& place, double w, double h, double d, texture t) {
        result.add(make_box(room.frame_to_world(place), w, h, d), std::move(t));
    }
    void rectangle(const frame& place, double w, double h, texture t) {
        result.add(make_rectangle(room.frame_to_world(place), w, h), std::move(t));
    }
    void ball(const frame& place, double radius, texture t) {
        result.add(make_sphere(room.frame_to_world(place), radius), std::move(t));
    }
    void rod(const vector3& from, const vector3& to, double radius, texture t) {
        result.add(make_rod(room.to_world(from), room.to_world(to), radius), std::move(t));
    }
    /// Adds a box with its bottom face at y = `bottom`, rotated by `angle` about the vertical axis.
    void block(double x, double bottom, double z, double angle, double w, double h, double d, texture t) {
        box(turned({x, bottom + 0.5 * h, z}, angle), w, h, d, std::move(t));
    }

    void walls_and_table() {
        rectangle({{0, 0.6, -0.92}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, 5, 4,
                  bricks(from_srgb(214, 152, 118), from_srgb(150, 78, 58), from_srgb(205, 196, 182), 0.21, 0.072, 3));
        box({{0, -0.02, 0.2}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, 2.4, 0.04, 1.5,
            boards(from_srgb(206, 158, 104), from_srgb(128, 80, 44), 0.115, 5));
    }

    /// A wall on the left with a window of six panes. The window is outside the picture, but its light and shadows are visible.
    void window() {
        const texture white = plain({0.75, 0.75, 0.72});
        const double x = -1.35, low = 0.72, high = 1.80, back = -0.62, front = 0.83;
        box({{x, low / 2 - 0.5, 0.5}}, 0.1, low + 1, 4, white);
        box({{x, high + 1, 0.5}}, 0.1, 2, 4, white);
        box({{x, 1, back - 0.5}}, 0.1, 3, 1, white);
        box({{x, 1, front + 0.75}}, 0.1, 3, 1.5, white);
        for (int i = 1; i < 3; ++i) box({{x, 1.2, back + (front - back) * i / 3}}, 0.05, 1.2, 0.06, white);
        box({{x, (low + high) / 2, 0.1}}, 0.05, 0.06, 1.6, white);
    }

    void shelf() {
        const texture wood = solid_wood(from_srgb(150, 104, 66), from_srgb(96, 60, 36), 0.02, 4);
        box({{0.28, 0.54, -0.80}}, 0.98, 0.028, 0.22, wood);
        for (const double x : {-0.1, 0.62}) box({{x, 0.485, -0.85}}, 0.03, 0.09, 0.12, wood);
        struct book {
            double width, height, depth, lean;
            vector3 color;
        };
        const book books[] = {
            {0.040, 0.205, 0.15, 0, from_srgb(38, 82, 110)},    {0.026, 0.170, 0.13, 0, from_srgb(206, 168, 72)},
            {0.050, 0.225, 0.16, 0, from_srgb(122, 36, 40)},    {0.032, 0.185, 0.14, 0, from_srgb(226, 218, 196)},
            {0.038, 0.200, 0.15, 0, from_srgb(64, 110, 78)},    {0.022, 0.160, 0.13, 0, from_srgb(40, 40, 52)},
            {0.044, 0.215, 0.15, 0.21, from_srgb(196, 106, 52)}};
        double x = 0.0;
        for (const book& b : books) {
            // A leaning book rotates around the corner on which it stands.
            const double c = std::cos(b.lean), s = std::sin(b.lean);
            const vector3 center{x + 0.5 * (b.width * c + b.height * s), 0.555 + 0.5 * (b.height * c + b.width * s), -0.79};
            box({center, {c, s, 0}, {-s, c, 0}, {0, 0, 1}}, b.width, b.height, b.depth, stripes_along_spine(b.color, b.height));
            x += b.width * c + b.height * s + 0.003;
        }
    }

    static texture stripes_along_spine(const vector3& color, double height) {
        return [=](const surface_point& s) {
            const vector3 gold = from_srgb(222, 190, 120);
            const double at = std::abs(s.local.y) / height;
            const double band = smooth_step(0.335, 0.34, at) - smooth_step(0.355, 0.36, at);
            const double cloth = layered_noise(s.local * 400, 2, 9);
            return mix(color * (0.85 + 0.3 * cloth), gold, band);
        };
    }

    /// Balls on threads from the ceiling.
    void mobile() {
        struct pendant {
            double x, y, z, radius;
            texture surface;
        };
        const pendant pendants[] = {
            {-0.33, 0.60, -0.30, 0.075, marbled(from_srgb(70, 120, 168), from_srgb(226, 236, 240), 0.06, 21)},
            {-0.075, 0.80, -0.12, 0.042, marbled(from_srgb(206, 92, 52), from_srgb(240, 178, 104), 0.035, 22)},
            {0.17, 0.735, 0.10, 0.034, plain(from_srgb(238, 200, 80))},
            {-0.30, 0.82, 0.16, 0.026, marbled(from_srgb(120, 168, 120), from_srgb(214, 226, 180), 0.02, 23)},
        };
        for (const pendant& p : pendants) {
            ball(turned({p.x, p.y, p.z}, 0.4, 0.5), p.radius, p.surface);
            rod({p.x, p.y + p.radius - 0.004, p.z}, {p.x, 2.2, p.z}, 0.0022, plain(from_srgb(92, 84, 76)));
        }
    }

    void blocks() {
        const auto painted = [](double r, double g, double b) {
            return solid_wood(from_srgb(r, g, b), from_srgb(r * 0.8, g * 0.8, b * 0.8), 0.02, 31);
        };
        const texture bare = solid_wood(from_srgb(226, 188, 138), from_srgb(184, 138, 90), 0.016, 8);
        // A gate of two pillars and a lintel with a cube on top, open in the middle.
        block(-0.40, 0, -0.22, 0.25, 0.075, 0.20, 0.075, painted(206, 66, 52));
        block(-0.185, 0, -0.275, 0.25, 0.075, 0.20, 0.075, painted(58, 112, 170));
        block(-0.2925, 0.20, -0.2475, 0.25, 0.33, 0.06, 0.085, bare);
        block(-0.33, 0.26, -0.24, 0.62, 0.085, 0.085, 0.085, painted(236, 188, 66));
        // Loose blocks.
        block(0.085, 0, -0.02, -0.5, 0.085, 0.085, 0.085, painted(74, 150, 104));
        block(0.10, 0.085, -0.02, 0.2, 0.075, 0.075, 0.075,
              checker(from_srgb(236, 226, 204), from_srgb(64, 58, 66), 0.0375, 0.03));
        block(-0.09, 0, 0.11, 0.9, 0.16, 0.045, 0.045, painted(170, 92, 152));
    }

    void balls() {
        const frame tilted = turned({0.36, 0.135, -0.30}, 0.5, 0.55);
        ball(tilted, 0.135, segments(from_srgb(204, 50, 48), from_srgb(44, 96, 164), from_srgb(244, 206, 84), 6));
        ball(turned({-0.29, 0.042, 0.0}, 0), 0.042, marbled(from_srgb(28, 92, 88), from_srgb(178, 216, 190), 0.03, 41));
        ball(turned({0.045, 0.030, 0.34}, 0.3, 0.4), 0.030,
             segments(from_srgb(240, 150, 50), from_srgb(250, 226, 170), from_srgb(60, 60, 60), 5));
        ball(turned({0.035, 0.024, 0.19}, 0), 0.024, marbled(from_srgb(120, 40, 110), from_srgb(232, 170, 210), 0.02, 42));
    }

    /// An apple on a book.
    void book_and_apple() {
        const frame middle = turned({-0.185, 0.017, 0.30}, 0.32);
        const auto part = [&](const vector3& at, double w, double h, double d, texture t) {
            box({middle.to_world(at), middle.x, middle.y, middle.z}, w, h, d, std::move(t));
        };
        const texture cloth = [](const surface_point& s) {
            return from_srgb(46, 74, 98) * (0.85 + 0.3 * layered_noise(s.local * 350, 2, 61));
        };
        const texture pages = [](const surface_point& s) {
            return from_srgb(232, 222, 198) * (0.8 + 0.2 * value_noise({s.local.x * 8, s.local.y * 1100, s.local.z * 8}, 62));
        };
        part({0.003, 0, 0}, 0.142, 0.028, 0.192, pages);
        part({0, -0.0155, 0}, 0.154, 0.003, 0.2, cloth);
        part({0, 0.0155, 0}, 0.154, 0.003, 0.2, cloth);
        part({-0.0755, 0, 0}, 0.003, 0.028, 0.2, cloth);
        const vector3 core{-0.175, 0.034 + 0.037, 0.285};
        ball(turned(core, 0.3, 0.25), 0.037, [](const surface_point& s) {
            const vector3 red = from_srgb(188, 34, 30), yellow = from_srgb(226, 178, 70);
            const double around = std::atan2(s.local.x, s.local.z);
            const double streak = layered_noise({std::sin(around) * 3, s.local.y * 12, std::cos(around) * 3}, 4, 63);
            return mix(red, yellow, 0.9 * smooth_step(0.4, 0.95, streak + 7 * s.local.y));
        });
        rod(core + vector3{0.002, 0.032, 0}, core + vector3{0.009, 0.053, 0.002}, 0.0018, plain(from_srgb(84, 62, 40)));
    }

    /// A cup of pencils, near the camera.
    void pencils() {
        const vector3 foot{0.215, 0, 0.265};
        const texture glaze = [](const surface_point& s) {
            const vector3 blue = from_srgb(52, 82, 128), cream = from_srgb(234, 226, 208);
            const double wave = 0.006 * std::sin(s.u * 180);
            const double band = smooth_step(0.006, 0.009, std::abs(s.v - 0.012 + wave)) * smooth_step(-0.034, -0.031, s.v);
            const bool side = std::abs(s.local.y) < 0.0524;
            return mix(blue, cream, side ? band : 1.0) * (0.92 + 0.16 * layered_noise(s.local * 60, 3, 51));
        };
        rod(foot, foot + vector3{0, 0.105, 0}, 0.046, glaze);
        rod(foot + vector3{0, 0.09, 0}, foot + vector3{0, 0.1052, 0}, 0.041, plain(from_srgb(30, 28, 30)));
        struct pencil {
            double x, z, lean_x, lean_z, rise;
            vector3 color;
        };
        const pencil all[] = {{-0.018, 0.010, -0.30, -0.10, 0.120, from_srgb(228, 178, 40)},
                              {0.016, 0.014, 0.26, 0.10, 0.105, from_srgb(196, 48, 44)},
                              {0.004, -0.018, 0.05, -0.25, 0.135, from_srgb(48, 120, 88)},
                              {-0.010, -0.006, -0.10, 0.05, 0.150, from_srgb(54, 88, 160)},
                              {-0.028, -0.006, -0.50, 0.12, 0.085, from_srgb(120, 60, 120)}};
        for (const pencil& p : all) {
            const vector3 from = foot + vector3{p.x, 0.08, p.z};
            const vector3 axis = normalized({p.lean_x, 1, p.lean_z});
            const vector3 shoulder = from + axis * (0.025 + p.rise);
            rod(from, shoulder, 0.0042, plain(p.color));
            // The sharpened end is a stack of ever thinner slices.
            const int slices = 8;
            for (int i = 0; i < slices; ++i) {
                const double t = (i + 0.5) / slices;
                rod(shoulder + axis * (0.016 * i / slices), shoulder + axis * (0.016 * (i + 1) / slices),
                    0.0040 * (1 - t) + 0.0004, plain(i < 5 ? from_srgb(224, 186, 138) : p.color));
            }
        }
    }
};

}  // namespace detail

/// Builds the still life. The nearest visible surface has disparity 1, the farthest 0.
inline scene still_life(std::int32_t width = 1152, std::int32_t height = 1536) {
    detail::still_life_builder b;
    b.result.camera = {width, height, focal_length_from_field_of_view(56, width, height)};
    // The camera is in front of the table and looks slightly down, so the room is rotated in the opposite direction.
    const vector3 eye{-0.01, 0.47, 1.06};
    const double pitch = 0.16;
    const double c = std::cos(pitch), s = std::sin(pitch);
    b.room = {{}, {1, 0, 0}, {0, c, s}, {0, -s, c}};
    b.room.origin = -b.room.direction_to_world(eye);
    b.walls_and_table();
    b.window();
    b.shelf();
    b.mobile();
    b.blocks();
    b.balls();
    b.book_and_apple();
    b.pencils();
    lighting& light = b.result.light;
    light.to_sun = b.room.direction_to_world(normalized({-0.78, 0.62, 0.36}));
    light.sun = {2.6, 2.25, 1.75};
    light.sun_radius = 0.012;
    light.up = b.room.y;
    light.sky = {0.58, 0.63, 0.72};
    light.ground = {0.30, 0.26, 0.22};
    light.shadows = true;
    fit_depth_range(b.result);
    return std::move(b.result);
}

}  // namespace ldi::scenes
