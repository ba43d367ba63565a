// Procedural textures of the analytic scenes. All edges in the textures are soft, and the ray caster supersamples, so pictures
// have no jagged edges. Colors are linear light, 0 to 1.
#pragma once

#include "vector.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>

namespace ldi::scenes {

/// The point at which a texture is evaluated.
struct surface_point {
    vector3 local;        ///< in the shape's own frame, for textures that fill a solid
    double u = 0, v = 0;  ///< coordinates on the surface, in scene units, for textures that cover it
};

/// Color of a surface: linear red, green, blue.
using texture = std::function<vector3(const surface_point&)>;

/// Converts a color from sRGB, 0 to 255.
inline vector3 from_srgb(double red, double green, double blue) {
    const auto linear = [](double value) {
        const double v = value / 255.0;
        return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
    };
    return {linear(red), linear(green), linear(blue)};
}

/// Returns a deterministic pseudorandom number in [0, 1).
inline double hash_unit(std::int64_t x, std::int64_t y, std::int64_t z, std::uint64_t seed = 0) {
    std::uint64_t h = seed * 0x9E3779B97F4A7C15ULL + 0x632BE59BD9B4E019ULL;
    for (const std::int64_t value : {x, y, z}) {
        h ^= static_cast<std::uint64_t>(value) + 0x9E3779B97F4A7C15ULL + (h << 6U) + (h >> 2U);
        h *= 0xFF51AFD7ED558CCDULL;
        h ^= h >> 33U;
    }
    return static_cast<double>(h >> 11U) * 0x1.0p-53;
}

/// Returns 0 below `first`, 1 above `last`, and a smooth transition between.
inline double smooth_step(double first, double last, double value) {
    const double t = std::clamp((value - first) / (last - first), 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

/// Returns smooth noise in [0, 1]. Its features have size 1.
inline double value_noise(const vector3& p, std::uint64_t seed = 0) {
    const double fx = std::floor(p.x), fy = std::floor(p.y), fz = std::floor(p.z);
    const double tx = smooth_step(0, 1, p.x - fx), ty = smooth_step(0, 1, p.y - fy), tz = smooth_step(0, 1, p.z - fz);
    const std::int64_t x = static_cast<std::int64_t>(fx), y = static_cast<std::int64_t>(fy), z = static_cast<std::int64_t>(fz);
    const auto edge = [&](std::int64_t dy, std::int64_t dz) {
        return (1 - tx) * hash_unit(x, y + dy, z + dz, seed) + tx * hash_unit(x + 1, y + dy, z + dz, seed);
    };
    return (1 - tz) * ((1 - ty) * edge(0, 0) + ty * edge(1, 0)) + tz * ((1 - ty) * edge(0, 1) + ty * edge(1, 1));
}

/// Sums noise of several sizes. Each octave has half the feature size and half the strength of the one before. The result is in
/// [0, 1].
inline double layered_noise(const vector3& p, int octaves, std::uint64_t seed = 0) {
    double sum = 0, weight = 0, scale = 1;
    for (int octave = 0; octave < octaves; ++octave, scale *= 2) {
        sum += value_noise(p * scale, seed + static_cast<std::uint64_t>(octave)) / scale;
        weight += 1 / scale;
    }
    return sum / weight;
}

inline texture plain(const vector3& color) {
    return [color](const surface_point&) { return color; };
}

/// Clouds of two colors in solid material.
inline texture marbled(const vector3& a, const vector3& b, double feature_size, std::uint64_t seed = 0) {
    return [=](const surface_point& s) {
        const double noise = layered_noise(s.local * (1 / feature_size), 5, seed);
        return mix(a, b, smooth_step(0.3, 0.7, noise));
    };
}

/// Bands of equal width across u.
inline texture stripes(const vector3& a, const vector3& b, double band, double softness = 0.05) {
    return [=](const surface_point& s) {
        const double phase = std::abs(s.u / band - 2 * std::floor(s.u / band / 2) - 1);  // 1: center of a, 0: center of b
        return mix(b, a, smooth_step(0.5 - softness, 0.5 + softness, phase));
    };
}

/// Squares of two colors.
inline texture checker(const vector3& a, const vector3& b, double square, double softness = 0.05) {
    return [=](const surface_point& s) {
        const auto wave = [&](double value) {
            const double phase = std::abs(value / square - 2 * std::floor(value / square / 2) - 1);
            return 2 * smooth_step(0.5 - softness, 0.5 + softness, phase) - 1;
        };
        return mix(a, b, 0.5 + 0.5 * wave(s.u) * wave(s.v));
    };
}

/// Texture of a ball: segments between its poles, alternately colored and white. The colored segments alternate between a and
/// b. The caps at the poles have color c.
///
/// pairs  number of colored segments
inline texture segments(const vector3& a, const vector3& b, const vector3& c, int pairs) {
    return [=](const surface_point& s) {
        const double radius = length(s.local);
        const double phase = (std::atan2(s.local.x, s.local.z) / 6.283185307179586 + 0.5) * pairs;
        const double t = phase - std::floor(phase);
        const bool odd = static_cast<std::int64_t>(std::floor(phase)) % 2 == 0;
        const vector3 white = from_srgb(240, 236, 226);
        // The soft edges between the segments have a fixed width on the surface, not a fixed angle.
        const double soft = 0.006 * pairs / std::max(0.1, std::sqrt(1 - s.local.y * s.local.y / (radius * radius)));
        const vector3 colored = mix(odd ? a : b, white, smooth_step(0.5 - soft, 0.5 + soft, t));
        const vector3 segment = mix(colored, odd ? b : a, smooth_step(1 - 2 * soft, 1, t));
        return mix(segment, c, smooth_step(0.945, 0.955, std::abs(s.local.y) / radius));
    };
}

/// Bricks in running bond with mortar between them. Each brick has its own shade. `wide` and `high` are the size of a brick
/// with its joint, in scene units.
inline texture bricks(const vector3& light, const vector3& dark, const vector3& mortar, double wide, double high,
                      std::uint64_t seed = 0) {
    return [=](const surface_point& s) {
        const vector3 at{s.u, s.v, 0};
        const double wobble_u = (layered_noise(at * (3 / high), 3, seed + 11) - 0.5) * 0.12 * high;
        const double wobble_v = (layered_noise(at * (3 / high), 3, seed + 12) - 0.5) * 0.12 * high;
        const double v = (s.v + wobble_v) / high, course = std::floor(v);
        const double u = (s.u + wobble_u) / wide + (std::fmod(std::abs(course), 2) < 0.5 ? 0.0 : 0.5);
        const std::int64_t row = static_cast<std::int64_t>(course), column = static_cast<std::int64_t>(std::floor(u));
        const double to_side = std::min(u - std::floor(u), 1 - u + std::floor(u)) * wide;
        const double to_bed = std::min(v - course, 1 - v + course) * high;
        const double inside = std::min(to_side, to_bed) / high;  // distance from the middle of the joint, in units of `high`
        const double shade = hash_unit(column, row, 0, seed), tint = hash_unit(column, row, 1, seed);
        const double grain = layered_noise(at * (9 / high), 4, seed + 20);
        vector3 brick = mix(dark, light, 0.15 + 0.7 * shade) * (0.72 + 0.56 * grain);
        brick = mix(brick, brick * vector3{0.9, 1.02, 1.12}, tint);
        brick = brick * (0.75 + 0.25 * smooth_step(0.07, 0.2, inside));  // worn, shaded edges
        const vector3 joint = mortar * (0.8 + 0.4 * layered_noise(at * (20 / high), 3, seed + 30));
        return mix(joint, brick, smooth_step(0.055, 0.085, inside));
    };
}

/// Wooden boards along v with dark joints, growth rings and pores. Each board has the width `wide` along u, in scene units.
inline texture boards(const vector3& light, const vector3& dark, double wide, std::uint64_t seed = 0) {
    return [=](const surface_point& s) {
        const double across = s.u / wide;
        const std::int64_t board = static_cast<std::int64_t>(std::floor(across));
        const double own = hash_unit(board, 0, 0, seed), shift = 40 * hash_unit(board, 1, 0, seed);
        const vector3 at{s.u / wide * 1.6, s.v / wide * 0.22 + shift, shift};
        // Growth rings along the trunk: much longer along the board than across, bent by noise.
        const double bend = layered_noise(at, 3, seed + 5);
        const double ring = 0.5 + 0.5 * std::sin(6.283185307179586 * (5 * bend + at.x * 1.3 + own));
        const double pores = layered_noise({s.u / wide * 60, s.v / wide * 3 + shift, shift}, 3, seed + 7);
        const double shade = 0.42 * ring * ring + 0.4 * pores + 0.35 * (own - 0.5);
        const vector3 wood = mix(light, dark, std::clamp(shade, 0.0, 1.0));
        const double to_joint = std::min(across - std::floor(across), 1 - across + std::floor(across));
        return wood * (0.25 + 0.75 * smooth_step(0.008, 0.02, to_joint));
    };
}

/// Solid wood with growth rings around an axis parallel to the local y axis.
inline texture solid_wood(const vector3& light, const vector3& dark, double ring_width, std::uint64_t seed = 0) {
    return [=](const surface_point& s) {
        const vector3 p = s.local * (1 / ring_width);
        const double bend = layered_noise({p.x * 0.3, p.y * 0.05, p.z * 0.3}, 3, seed);
        const double radius = std::hypot(p.x + 9, p.z + 5) + 3 * bend;
        const double ring = radius - std::floor(radius);
        const double fiber = layered_noise({p.x * 4, p.y * 0.25, p.z * 4}, 2, seed + 3);
        return mix(light, dark,
                   std::clamp(0.55 * smooth_step(0, 0.8, ring) * smooth_step(1, 0.85, ring) + 0.5 * fiber, 0.0, 1.0));
    };
}

}  // namespace ldi::scenes
