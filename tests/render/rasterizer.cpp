#include <ldi/render/rasterizer.hpp>

#include <examples/scenes/scene.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <cstdint>
#include <random>
#include <vector>

using namespace ldi;

namespace {

struct generator {
    std::mt19937 engine;
    explicit generator(std::uint32_t seed) : engine(seed) {}
    double between(double low, double high) { return low + (high - low) * (static_cast<double>(engine()) * 0x1.0p-32); }
    std::int64_t integer(std::int64_t low, std::int64_t high) {
        return low + static_cast<std::int64_t>(engine() % static_cast<std::uint64_t>(high - low + 1));
    }
};

view view_of(std::int32_t width, std::int32_t height) {
    view v;
    v.camera = {width, height, focal_length_from_field_of_view(60, width, height)};
    return v;
}

image<std::uint8_t> flat_texture(std::uint8_t value) { return image<std::uint8_t>(2, 2, 3, value); }

std::uint32_t add_vertex(textured_mesh& mesh, const std::array<float, 3>& p, float u = 0, float v = 0) {
    mesh.positions.insert(mesh.positions.end(), p.begin(), p.end());
    mesh.texture_coordinates.insert(mesh.texture_coordinates.end(), {u, v});
    return static_cast<std::uint32_t>(mesh.vertex_count() - 1);
}

/// The rectangle [x0, x1] x [y0, y1] of the screen, in pixels, at one depth, counter-clockwise.
void add_rectangle(textured_mesh& mesh, const pinhole_camera& camera, float x0, float y0, float x1, float y1, float depth) {
    const std::uint32_t a = add_vertex(mesh, camera.unproject(x0, y0, depth), 0, 0);
    const std::uint32_t b = add_vertex(mesh, camera.unproject(x0, y1, depth), 0, 1);
    const std::uint32_t c = add_vertex(mesh, camera.unproject(x1, y1, depth), 1, 1);
    const std::uint32_t d = add_vertex(mesh, camera.unproject(x1, y0, depth), 1, 0);
    mesh.triangles.insert(mesh.triangles.end(), {a, b, c, a, c, d});
}

/// One vertex per pixel, at the ray caster's depth: the surface visible in the photo, with rubber sheets at silhouettes.
textured_mesh height_field(const image<float>& depth, const pinhole_camera& camera) {
    textured_mesh mesh;
    const std::uint32_t w = static_cast<std::uint32_t>(depth.width()), h = static_cast<std::uint32_t>(depth.height());
    for (std::uint32_t y = 0; y < h; ++y)
        for (std::uint32_t x = 0; x < w; ++x) {
            const float px = static_cast<float>(x) + 0.5F, py = static_cast<float>(y) + 0.5F;
            add_vertex(mesh, camera.unproject(px, py, depth.row(y)[x]), px / static_cast<float>(w), py / static_cast<float>(h));
        }
    for (std::uint32_t y = 0; y + 1 < h; ++y)
        for (std::uint32_t x = 0; x + 1 < w; ++x) {
            const std::uint32_t i = y * w + x;
            mesh.triangles.insert(mesh.triangles.end(), {i, i + w, i + w + 1, i, i + w + 1, i + 1});
        }
    return mesh;
}

}  // namespace

TEST_CASE("every sample of a triangulated square belongs to exactly one triangle") {
    const std::int64_t side = 40, one = detail::subsample_steps;
    for (std::uint32_t seed = 0; seed < 300; ++seed) {
        generator random(seed);
        // A fan around an inner point, over a ring of random points on the border; many coordinates coincide with sample
        // positions.
        const auto snap = [&](std::int64_t v) { return seed % 3 == 0 ? v / (one / 2) * (one / 2) : v; };
        std::vector<detail::screen_vertex> ring;
        const auto add_side = [&](std::int64_t x0, std::int64_t y0, std::int64_t x1, std::int64_t y1) {
            buffer<std::int64_t> cuts{0};
            for (std::int64_t i = random.integer(0, 6); i > 0; --i) cuts.push_back(snap(random.integer(0, side * one)));
            std::sort(cuts.begin(), cuts.end());
            for (const std::int64_t c : cuts) {
                detail::screen_vertex v;
                v.x = x0 + (x1 - x0) / (side * one) * c, v.y = y0 + (y1 - y0) / (side * one) * c;
                ring.push_back(v);
            }
        };
        const std::int64_t end = side * one;
        add_side(0, 0, end, 0), add_side(end, 0, end, end), add_side(end, end, 0, end), add_side(0, end, 0, 0);
        detail::screen_vertex center;
        center.x = snap(random.integer(1, end - 1)), center.y = snap(random.integer(1, end - 1));
        buffer<int> count(static_cast<std::size_t>(side * side), 0);
        for (std::size_t i = 0; i < ring.size(); ++i) {
            const detail::screen_triangle t{center, ring[i], ring[(i + 1) % ring.size()]};
            REQUIRE(detail::signed_area(t) >= 0);
            if (detail::signed_area(t) == 0) continue;
            detail::for_each_span(t, side, 0, side, [&](std::int64_t y, std::int64_t first, std::int64_t last) {
                for (std::int64_t x = first; x < last; ++x) ++count[static_cast<std::size_t>(y * side + x)];
            });
        }
        REQUIRE(std::all_of(count.begin(), count.end(), [](int c) { return c == 1; }));
    }
}

TEST_CASE("spans contain exactly the samples that lie inside the triangle according to its edge functions") {
    generator random(5);
    for (int trial = 0; trial < 2000; ++trial) {
        detail::screen_triangle t;
        for (detail::screen_vertex& v : t) v.x = random.integer(-2000, 6000), v.y = random.integer(-2000, 6000);
        if (detail::signed_area(t) == 0) continue;
        if (detail::signed_area(t) < 0) std::swap(t[1], t[2]);
        buffer<int> count(16 * 16, 0);
        detail::for_each_span(t, 16, 0, 16, [&](std::int64_t y, std::int64_t first, std::int64_t last) {
            REQUIRE((y >= 0 && y < 16 && first >= 0 && last <= 16));
            for (std::int64_t x = first; x < last; ++x) ++count[static_cast<std::size_t>(y * 16 + x)];
        });
        for (std::int64_t y = 0; y < 16; ++y)
            for (std::int64_t x = 0; x < 16; ++x) {
                const std::int64_t px = 256 * x + 128, py = 256 * y + 128;
                int strictly = 0, on_edge = 0;
                for (std::size_t i = 0; i < 3; ++i) {
                    const detail::screen_vertex &a = t[i], &b = t[(i + 1) % 3];
                    const std::int64_t e = (b.x - a.x) * (py - a.y) - (b.y - a.y) * (px - a.x);
                    strictly += e > 0 ? 1 : 0, on_edge += e == 0 ? 1 : 0;
                }
                const int found = count[static_cast<std::size_t>(y * 16 + x)];
                if (strictly == 3) REQUIRE(found == 1);
                if (strictly + on_edge < 3) REQUIRE(found == 0);
            }
    }
}

TEST_CASE("a mesh of random triangles that covers the frame is drawn without holes from any position") {
    for (std::uint32_t seed = 0; seed < 40; ++seed) {
        generator random(seed);
        view v = view_of(64, 48);
        // A warped net that extends far beyond the frame and, in places, behind the camera.
        textured_mesh mesh;
        const std::uint32_t n = 12;
        for (std::uint32_t j = 0; j <= n; ++j)
            for (std::uint32_t i = 0; i <= n; ++i) {
                const double x = -60 + 120.0 * i / n + random.between(-2, 2), y = -60 + 120.0 * j / n + random.between(-2, 2);
                add_vertex(mesh, {static_cast<float>(x), static_cast<float>(y), static_cast<float>(-3 + 0.25 * x)});
            }
        for (std::uint32_t j = 0; j < n; ++j)
            for (std::uint32_t i = 0; i < n; ++i) {
                const std::uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
                if (random.integer(0, 1) == 0)
                    mesh.triangles.insert(mesh.triangles.end(), {a, b, c, b, d, c});
                else
                    mesh.triangles.insert(mesh.triangles.end(), {a, b, d, a, d, c});
            }
        v.position = {static_cast<float>(random.between(-0.5, 0.5)), static_cast<float>(random.between(-0.5, 0.5)), 0};
        const rendering result = rasterize(mesh, flat_texture(200), v);
        for (const std::uint8_t c : result.coverage) REQUIRE(c == 255);
        for (const std::uint8_t c : result.color) REQUIRE(c == 200);
    }
}

TEST_CASE("a sample on an edge belongs to the triangle to the right of the edge, or below it if the edge is horizontal") {
    const std::int64_t one = detail::subsample_steps;
    const auto corner = [&](std::int64_t x, std::int64_t y) {
        detail::screen_vertex v;
        v.x = x * one + one / 2, v.y = y * one + one / 2;
        return v;
    };
    std::vector<std::array<std::int64_t, 3>> spans;
    const auto draw = [&](const detail::screen_triangle& t) {
        REQUIRE(detail::signed_area(t) > 0);
        detail::for_each_span(t, 8, 0, 8, [&](std::int64_t y, std::int64_t first, std::int64_t last) {
            spans.push_back({y, first, last});
        });
    };
    draw({corner(1, 1), corner(4, 1), corner(1, 4)});
    CHECK(spans == std::vector<std::array<std::int64_t, 3>>{{1, 1, 4}, {2, 1, 3}, {3, 1, 2}});
    spans.clear();
    draw({corner(4, 1), corner(4, 4), corner(1, 4)});
    CHECK(spans == std::vector<std::array<std::int64_t, 3>>{{2, 3, 4}, {3, 2, 4}});
}

TEST_CASE("a plane that extends behind the camera is clipped at the near plane and nowhere else") {
    std::size_t seen = 0, cut = 0;
    for (std::uint32_t seed = 0; seed < 60; ++seed) {
        generator random(seed);
        view v = view_of(64, 48);
        raster_options options;
        options.z_near = 0.5F;
        // A third of the nets extends far beyond the frame. These nets are level, so that rounding keeps their vertices in the
        // plane.
        const bool wide = seed % 3 == 0;
        const double reach = wide ? 1e9 : 40;
        const double height = random.between(-0.2, -0.05), turn = random.between(-1, 1), tip = random.between(-0.2, 0.2);
        const scenes::frame place = scenes::turned({0, height, 0}, turn, 1.5707963267948966 + (wide ? 0 : tip));
        const std::uint32_t n = 9;
        textured_mesh mesh;
        for (std::uint32_t j = 0; j <= n; ++j)
            for (std::uint32_t i = 0; i <= n; ++i) {
                // Cells shrink toward the middle.
                const auto at = [&](std::uint32_t k) {
                    const double t = 2.0 * k / n - 1;
                    return reach * t * t * t;
                };
                const scenes::vector3 p = place.to_world(scenes::vector3{at(i), at(j), 0});
                add_vertex(mesh, {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
            }
        for (std::uint32_t j = 0; j < n; ++j)
            for (std::uint32_t i = 0; i < n; ++i) {
                const std::uint32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
                if (random.integer(0, 1) == 0)
                    mesh.triangles.insert(mesh.triangles.end(), {a, b, c, b, d, c});
                else
                    mesh.triangles.insert(mesh.triangles.end(), {a, b, d, a, d, c});
            }
        const rendering result = rasterize(mesh, flat_texture(200), v, options);
        const scenes::shape plane = scenes::make_rectangle(place, 2 * reach, 2 * reach);
        for (std::size_t y = 0; y < 48; ++y)
            for (std::size_t x = 0; x < 64; ++x) {
                const scenes::ray r = scenes::detail::primary_ray(v, static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
                const scenes::crossings c = intersect(plane, r);
                const bool ahead = c.count == 1 && c.distance[0] > 0;
                const double depth = ahead ? c.distance[0] : 0;
                if (depth > 12 || (c.count == 1 && std::abs(depth - 0.5) < 0.02)) continue;
                if (ahead && depth >= 0.5) {
                    ++seen;
                    REQUIRE(result.coverage(y, x, 0) == 255);
                    REQUIRE(static_cast<double>(result.depth(y, x, 0)) == Approx(depth).epsilon(0.02));
                } else if (ahead) {
                    ++cut;
                    REQUIRE(result.coverage(y, x, 0) == 0);
                }
            }
    }
    REQUIRE(seen > 20000);
    REQUIRE(cut > 5000);
}

TEST_CASE("a slanted rectangle has the texture and depth of the plane that each ray meets") {
    for (std::uint32_t seed = 0; seed < 20; ++seed) {
        generator random(seed);
        const view v = view_of(96, 80);
        const scenes::frame place = scenes::turned({random.between(-0.2, 0.2), random.between(-0.2, 0.2), -1.2},
                                                   random.between(-1.1, 1.1), random.between(-1, 1));
        const scenes::shape plane = scenes::make_rectangle(place, 1.0, 1.0);
        textured_mesh mesh;
        for (const auto& corner : {std::array<float, 2>{0, 0}, {0, 1}, {1, 1}, {1, 0}}) {
            const scenes::vector3 p =
                place.to_world(scenes::vector3{static_cast<double>(corner[0]) - 0.5, 0.5 - static_cast<double>(corner[1]), 0});
            add_vertex(mesh, {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)}, corner[0], corner[1]);
        }
        mesh.triangles = {0, 1, 2, 0, 2, 3};
        // Red is 255 u, green 255 v, between the centers of the outermost texels.
        image<std::uint8_t> texture(256, 256, 3, std::uint8_t{0});
        for (std::size_t y = 0; y < 256; ++y)
            for (std::size_t x = 0; x < 256; ++x)
                texture(y, x, 0) = static_cast<std::uint8_t>(x), texture(y, x, 1) = static_cast<std::uint8_t>(y);
        const rendering result = rasterize(mesh, texture, v);
        std::size_t seen = 0;
        for (std::size_t y = 0; y < 80; ++y)
            for (std::size_t x = 0; x < 96; ++x) {
                const scenes::ray r = scenes::detail::primary_ray(v, static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5);
                const scenes::crossings c = intersect(plane, r);
                if (c.count == 0 || result.coverage(y, x, 0) == 0) continue;
                ++seen;
                const scenes::surface_point s = describe(plane, r.at(c.distance[0])).where;
                const double tilt = std::abs(scenes::dot(place.z, scenes::normalized(r.direction)));
                // Vertices are rounded to 1 / 256 pixel, which a grazing ray magnifies.
                const double slack = 0.01 / (tilt * tilt) + 0.02;
                CHECK(std::abs(result.color(y, x, 0) - std::clamp(256 * (s.u + 0.5) - 0.5, 0.0, 255.0)) <= 0.5 + slack * 4);
                CHECK(std::abs(result.color(y, x, 1) - std::clamp(256 * (0.5 - s.v) - 0.5, 0.0, 255.0)) <= 0.5 + slack * 4);
                CHECK(static_cast<double>(result.depth(y, x, 0)) == Approx(c.distance[0]).epsilon(1e-3 * slack * 10));
            }
        REQUIRE(seen > 200);
    }
}

TEST_CASE("the nearest surface is visible, regardless of the order of the triangles") {
    const view v = view_of(40, 30);
    textured_mesh mesh;
    image<std::uint8_t> texture(1, 1, 3, std::uint8_t{255});
    for (const float depth : {2.0F, 1.0F, 3.0F}) add_rectangle(mesh, v.camera, 10 / depth, 5, 30, 25, depth);
    const rendering result = rasterize(mesh, texture, v);
    for (std::size_t y = 0; y < 30; ++y)
        for (std::size_t x = 0; x < 40; ++x) {
            const bool inside = y >= 5 && y < 25 && x < 30;
            const float expected = !inside ? 0.0F : x >= 10 ? 1.0F : x >= 5 ? 2.0F : x >= 3 ? 3.0F : 0.0F;
            REQUIRE(result.coverage(y, x, 0) == (expected > 0 ? 255 : 0));
            if (expected > 0)
                REQUIRE(result.depth(y, x, 0) == Approx(expected));
            else
                REQUIRE(std::isinf(result.depth(y, x, 0)));
        }
}

TEST_CASE("back faces are culled only on request") {
    const view v = view_of(20, 20);
    textured_mesh front;
    add_rectangle(front, v.camera, 0, 0, 20, 20, 1);
    textured_mesh back = front;
    for (std::size_t i = 0; i < back.triangles.size(); i += 3) std::swap(back.triangles[i], back.triangles[i + 1]);
    raster_options one_side;
    one_side.both_sides = false;
    CHECK(rasterize(front, flat_texture(9), v, one_side).coverage(10, 10, 0) == 255);
    CHECK(rasterize(back, flat_texture(9), v, one_side).coverage(10, 10, 0) == 0);
    CHECK(rasterize(back, flat_texture(9), v).coverage(10, 10, 0) == 255);
}

TEST_CASE(
    "soft-edge triangles are blended over farther surfaces in the order of the mesh, and affect neither coverage nor depth") {
    const view v = view_of(40, 20);
    image<std::uint8_t> texture(1, 2, 3, std::uint8_t{0});
    for (std::size_t c = 0; c < 3; ++c) texture(0, 1, c) = 200;  // dark on the left, light on the right
    textured_mesh mesh;
    add_rectangle(mesh, v.camera, 0, 0, 30, 20, 3), add_rectangle(mesh, v.camera, 0, 0, 40, 5, 1);
    for (float& u : mesh.texture_coordinates) u = 0;
    const rendering hard = rasterize(mesh, texture, v);
    textured_mesh strip;
    add_rectangle(strip, v.camera, 10, 0, 40, 20, 2), add_rectangle(strip, v.camera, 10, 15, 40, 20, 1.5F);
    mesh.soft_edges.positions = strip.positions, mesh.soft_edges.triangles = strip.triangles;
    for (std::size_t i = 0; i < 8; ++i) {
        mesh.soft_edges.texture_coordinates.insert(mesh.soft_edges.texture_coordinates.end(), {i < 4 ? 1.0F : 0.0F, 0.5F});
        mesh.soft_edges.opacity.push_back(i < 4 && i % 4 >= 2 ? 0 : i < 4 ? 255 : 128);
    }
    const rendering soft = rasterize(mesh, texture, v);
    CHECK(soft.coverage == hard.coverage);
    CHECK(soft.depth == hard.depth);
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 40; ++x) {
            const float opacity = x < 10 || y < 5 ? 0.0F : 1 - (static_cast<float>(x) + 0.5F - 10) / 30;
            const float over = 200 * opacity * (y < 15 ? 1.0F : 127.0F / 255);
            REQUIRE(std::abs(static_cast<float>(soft.color(y, x, 0)) - over) < 1.6F);
        }
    mesh.soft_edges.opacity.pop_back();
    CHECK_THROWS_AS(rasterize(mesh, texture, v), ldi::error);
}

TEST_CASE("with supersampling, a pixel has the coverage and the average color of its samples") {
    const view v = view_of(8, 8);
    textured_mesh mesh;
    add_rectangle(mesh, v.camera, 2.5F, 0, 8, 8, 1);
    raster_options options;
    options.samples = 4;
    options.background = {100, 100, 100};
    const rendering result = rasterize(mesh, flat_texture(200), v, options);
    CHECK(result.coverage(3, 1, 0) == 0);
    CHECK(result.coverage(3, 2, 0) == 127);
    CHECK(result.coverage(3, 3, 0) == 255);
    CHECK(result.color(3, 1, 0) == 100);
    CHECK(result.color(3, 2, 0) == 150);
    CHECK(result.color(3, 3, 0) == 200);
}

TEST_CASE("the picture does not depend on the number of threads") {
    const scenes::scene s = scenes::random_scene(3, 60, 80);
    scenes::picture_options quick;
    quick.samples = 1;
    const scenes::picture photo = scenes::render(s, quick);
    const textured_mesh mesh = height_field(photo.depth, s.camera);
    const view v = moved_view(s.camera, s.range, 1, 7, -3);
    raster_options options;
    options.samples = 2;
    const rendering serial = rasterize(mesh, photo.color, v, options);
    for (const std::size_t threads : {2U, 3U, 5U}) {
        thread_pool pool(threads);
        const rendering parallel = rasterize(mesh, photo.color, v, options, pool);
        REQUIRE(parallel.color == serial.color);
        REQUIRE(parallel.depth == serial.depth);
        REQUIRE(parallel.coverage == serial.coverage);
    }
}

TEST_CASE("drawn from the photo's viewpoint, a height field of the photo matches the photo") {
    for (std::uint32_t seed = 0; seed < 5; ++seed) {
        const scenes::scene s = scenes::random_scene(seed, 60, 80);
        const scenes::picture photo = scenes::render(s);
        view v;
        v.camera = s.camera;
        const rendering result = rasterize(height_field(photo.depth, s.camera), photo.color, v);
        std::size_t covered = 0;
        for (std::size_t y = 0; y < 80; ++y)
            for (std::size_t x = 0; x < 60; ++x) {
                if (result.coverage(y, x, 0) == 0) continue;
                ++covered;
                for (std::size_t c = 0; c < 3; ++c) REQUIRE(std::abs(result.color(y, x, c) - photo.color(y, x, c)) <= 2);
            }
        REQUIRE(covered >= 59 * 79);
    }
}

TEST_CASE("from another viewpoint, a scene without silhouettes matches the ray caster's picture") {
    scenes::scene s = scenes::random_scene(8, 90, 120);
    s.objects.resize(1);
    s.objects[0].color = scenes::marbled(scenes::from_srgb(220, 40, 40), scenes::from_srgb(40, 90, 200), 1.2);
    scenes::fit_depth_range(s);
    const scenes::picture photo = scenes::render(s);
    const view v = moved_view(s.camera, s.range, 1, 10, 6);
    const rendering result = rasterize(height_field(photo.depth, s.camera), photo.color, v);
    const scenes::picture truth = scenes::render(s, v);
    double squared = 0;
    std::size_t count = 0;
    for (std::size_t y = 0; y < 120; ++y)
        for (std::size_t x = 0; x < 90; ++x) {
            if (result.coverage(y, x, 0) == 0) continue;
            REQUIRE(result.depth(y, x, 0) == Approx(truth.depth(y, x, 0)).epsilon(2e-3));
            for (std::size_t c = 0; c < 3; ++c, ++count) {
                const double difference = static_cast<double>(result.color(y, x, c)) - truth.color(y, x, c);
                squared += difference * difference;
            }
        }
    REQUIRE(count > 3 * 80 * 100);
    CHECK(squared / static_cast<double>(count) < 4.0);
}

TEST_CASE("parts of a mesh use their own textures, even in triangles that the near plane clips") {
    std::mt19937 random(21);
    const auto between = [&](float low, float high) { return std::uniform_real_distribution<float>(low, high)(random); };
    constexpr std::size_t parts = 5;
    const view v = view_of(40, 30);
    for (int repeat = 0; repeat < 50; ++repeat) {
        // One texture per part, each of one color, and all of them side by side.
        std::vector<image<std::uint8_t>> textures;
        image<std::uint8_t> all(1, parts, 3);
        textured_mesh mesh, whole;
        for (std::size_t t = 0; t < parts; ++t) {
            const std::uint8_t gray = static_cast<std::uint8_t>(40 + 40 * t);
            textures.emplace_back(2 + t, 3, 3, gray);
            for (std::size_t c = 0; c < 3; ++c) all(0, t, c) = gray;
            mesh.parts.push_back({mesh.vertex_count(), mesh.triangle_count()});
            for (std::uint32_t i = 0, count = 3 * static_cast<std::uint32_t>(random() % 4); i < count; ++i) {
                mesh.triangles.push_back(static_cast<std::uint32_t>(mesh.vertex_count()));
                for (const float p : {between(-2, 2), between(-2, 2), between(-4, 1)}) mesh.positions.push_back(p);
                for (const float uv : {between(0, 1), between(0, 1)}) mesh.texture_coordinates.push_back(uv);
                for (const float uv : {(static_cast<float>(t) + 0.5F) / parts, 0.5F}) whole.texture_coordinates.push_back(uv);
            }
        }
        whole.positions = mesh.positions, whole.triangles = mesh.triangles;
        const rendering in_parts = rasterize(mesh, textures, v), at_once = rasterize(whole, all, v);
        REQUIRE(in_parts.color == at_once.color);
        REQUIRE(in_parts.depth == at_once.depth);
    }
    CHECK_THROWS_AS(rasterize(textured_mesh(), std::vector(2, flat_texture(1)), v), error);  // the mesh has one part
}

TEST_CASE("malformed meshes, textures and options are refused") {
    const view v = view_of(8, 8);
    textured_mesh good;
    add_rectangle(good, v.camera, 0, 0, 8, 8, 1);
    const auto code_of = [&](const textured_mesh& mesh, const image<std::uint8_t>& texture, const view& from,
                             const raster_options& o) { return testing::raised([&] { rasterize(mesh, texture, from, o); }); };
    const image<std::uint8_t> texture = flat_texture(1);
    CHECK_FALSE(code_of(good, texture, v, {}));
    textured_mesh bad = good;
    bad.triangles[2] = 4;
    CHECK(code_of(bad, texture, v, {}) == error_code::invalid_data);
    bad = good;
    bad.positions[1] = std::numeric_limits<float>::quiet_NaN();
    CHECK(code_of(bad, texture, v, {}) == error_code::invalid_data);
    bad = good;
    bad.texture_coordinates.pop_back();
    CHECK(code_of(bad, texture, v, {}) == error_code::mismatch);
    CHECK(code_of(good, image<std::uint8_t>(2, 2, 1, std::uint8_t{0}), v, {}) == error_code::mismatch);
    CHECK(code_of(good, image<std::uint8_t>(0, 0, 3), v, {}) == error_code::mismatch);
    raster_options options;
    options.samples = 0;
    CHECK(code_of(good, texture, v, options) == error_code::invalid_option);
    options.samples = 1, options.z_near = 0;
    CHECK(code_of(good, texture, v, options) == error_code::invalid_option);
    CHECK(code_of(good, texture, view{}, {}) == error_code::invalid_option);
    options.z_near = std::numeric_limits<float>::denorm_min();
    CHECK(code_of(good, texture, v, options) == error_code::invalid_option);
    options.z_near = std::numeric_limits<float>::infinity();
    CHECK(code_of(good, texture, v, options) == error_code::invalid_option);
}

TEST_CASE("views with a number that is not finite, or with a lens shift of more than 2^20 samples, are refused") {
    const auto code_after = [](auto change) {
        view v = view_of(8, 8);
        textured_mesh mesh;
        add_rectangle(mesh, v.camera, 0, 0, 8, 8, 1);
        change(v);
        return testing::raised([&] { rasterize(mesh, flat_texture(1), v, {.samples = 2}); });
    };
    constexpr float infinite = std::numeric_limits<float>::infinity();
    for (const float value : {std::numeric_limits<float>::quiet_NaN(), infinite, -infinite}) {
        CHECK(code_after([&](view& v) { v.camera.focal_length = value; }) == error_code::invalid_option);
        for (std::size_t i = 0; i < 9; ++i) {
            CHECK(code_after([&](view& v) { v.position[i % 3] = value; }) == error_code::invalid_option);
            CHECK(code_after([&](view& v) { v.rotation[i] = value; }) == error_code::invalid_option);
            CHECK(code_after([&](view& v) { v.lens_shift[i % 2] = value; }) == error_code::invalid_option);
        }
    }
    CHECK_FALSE(code_after([](view& v) { v.lens_shift = {524288, -524288}; }));
    for (const float shift : {524289.0F, -524289.0F, 3e14F, -3e38F})
        CHECK(code_after([&](view& v) { v.lens_shift[1] = shift; }) == error_code::invalid_option);
}

TEST_CASE("coordinates over the whole range of floats are drawn without errors") {
    generator random(11);
    view v = view_of(16, 16);
    for (int trial = 0; trial < 3000; ++trial) {
        if (trial == 1500) v.rotation = {0.6F, 0, 0.8F, 0, 1, 0, -0.8F, 0, 0.6F};
        textured_mesh mesh;
        for (int i = 0; i < 9; ++i) {
            const auto any = [&] { return static_cast<float>(random.between(-1, 1) * std::pow(10.0, random.between(-38, 38))); };
            const float x = any(), y = any(), z = any(), tu = any(), tv = any();
            add_vertex(mesh, {x, y, z}, tu, tv);
            mesh.triangles.push_back(static_cast<std::uint32_t>(i));
        }
        const rendering result = rasterize(mesh, flat_texture(77), v);
        for (std::size_t i = 0; i < result.depth.size(); ++i)
            REQUIRE((result.coverage.data()[i] == 0 || result.color.data()[3 * i] == 77));
    }
}
