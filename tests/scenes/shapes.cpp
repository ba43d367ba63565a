#include <examples/scenes/shapes.hpp>

#include <catch2/catch.hpp>

#include <random>
#include <vector>

using namespace ldi::scenes;

namespace {

struct generator {
    std::mt19937 engine;
    double between(double low, double high) { return low + (high - low) * (static_cast<double>(engine()) * 0x1.0p-32); }
    vector3 direction() {
        while (true) {
            const double x = between(-1, 1), y = between(-1, 1), z = between(-1, 1);
            const vector3 d{x, y, z};
            if (dot(d, d) > 0.01 && dot(d, d) < 1) return normalized(d);
        }
    }
    shape any_solid() {
        const double x = between(-1, 1), y = between(-1, 1), z = between(-1, 1), a = between(-3, 3), b = between(-3, 3);
        const double w = between(0.2, 2), h = between(0.2, 2), d = between(0.2, 2);
        const frame place = turned({x, y, z}, a, b);
        switch (engine() % 3) {
            case 0: return make_box(place, w, h, d);
            case 1: return make_sphere(place, 0.5 * w);
            default: return make_rod(place.to_world(vector3{0, -h, 0}), place.to_world(vector3{0, h, 0}), 0.3 * w);
        }
    }
};

/// Signed distance of a point from a solid, computed from the definition of the solid: 0 on the surface, negative inside.
double outside(const shape& s, const vector3& point) {
    const vector3 p = s.place.to_local(point);
    switch (s.what) {
        case shape::kind::box: return std::max({std::abs(p.x) - s.size.x, std::abs(p.y) - s.size.y, std::abs(p.z) - s.size.z});
        case shape::kind::sphere: return length(p) - s.size.x;
        case shape::kind::rod: return std::max(std::hypot(p.x, p.z) - s.size.x, std::abs(p.y) - s.size.y);
        case shape::kind::rectangle: break;
    }
    return std::abs(p.z);
}

}  // namespace

TEST_CASE("frames are right-handed and orthonormal, and to_local() inverts to_world()") {
    generator random{std::mt19937(1)};
    for (int trial = 0; trial < 200; ++trial) {
        const vector3 origin = random.direction(), point = random.direction();
        for (const frame& f :
             {turned(origin, random.between(-4, 4), random.between(-4, 4)), along(origin, random.direction() * 3)}) {
            CHECK(length(cross(f.x, f.y) - f.z) < 1e-12);
            CHECK(length(f.to_world(f.to_local(point)) - point) < 1e-12);
        }
    }
}

TEST_CASE("the crossings of a ray with a solid match those found by stepping along the ray") {
    generator random{std::mt19937(2)};
    int met = 0;
    for (int trial = 0; trial < 1500; ++trial) {
        const shape s = random.any_solid();
        const ray r{random.direction() * 4, random.direction() * random.between(0.5, 2)};
        const ray aimed{r.origin, (s.place.origin + random.direction() * 0.5 - r.origin) * random.between(0.2, 1)};
        for (const ray& each : {r, aimed}) {
            const crossings c = intersect(s, each);
            REQUIRE((c.count == 0 || c.count == 2));
            const double speed = length(each.direction), step = 0.02 / speed;
            if (c.count == 2) {
                ++met;
                REQUIRE(c.distance[0] < c.distance[1]);
                for (const double d : c.distance) REQUIRE(std::abs(outside(s, each.at(d))) < 1e-9);
            }
            for (double d = -6 / speed; d < 9 / speed; d += step) {
                const bool inside = c.count == 2 && d > c.distance[0] && d < c.distance[1];
                const double gap = outside(s, each.at(d));
                if (std::abs(gap) > 1e-9) REQUIRE(inside == (gap < 0));
            }
        }
    }
    REQUIRE(met > 1000);
}

TEST_CASE("a ray crosses a rectangle once, and only within its sides") {
    generator random{std::mt19937(3)};
    int met = 0;
    for (int trial = 0; trial < 1000; ++trial) {
        const frame place = along(random.direction(), random.direction());
        const shape s = make_rectangle(place, 1.6, 0.9);
        const double x = random.between(-1.2, 1.2), y = random.between(-1.2, 1.2);
        const vector3 target = place.to_world(vector3{x, y, 0}), origin = random.direction() * 5;
        const crossings c = intersect(s, {origin, target - origin});
        const bool expected = std::abs(x) < 0.8 && std::abs(y) < 0.45;
        REQUIRE(c.count == (expected ? 1 : 0));
        if (!expected) continue;
        ++met;
        REQUIRE(c.distance[0] == Approx(1));
        const surface_description d = describe(s, target);
        REQUIRE(d.where.u == Approx(x).margin(1e-9));
        REQUIRE(d.where.v == Approx(y).margin(1e-9));
        REQUIRE(length(d.normal - place.z) < 1e-12);
    }
    REQUIRE(met > 200);
}

TEST_CASE("normals have length 1 and point out of the solid") {
    generator random{std::mt19937(4)};
    for (int trial = 0; trial < 1000; ++trial) {
        const shape s = random.any_solid();
        const ray r{random.direction() * 4, s.place.origin + random.direction() * 0.05};
        const crossings c = intersect(s, {r.origin, r.direction - r.origin});
        for (int k = 0; k < c.count; ++k) {
            const vector3 p = r.origin + (r.direction - r.origin) * c.distance[static_cast<std::size_t>(k)];
            const vector3 normal = describe(s, p).normal;
            REQUIRE(length(normal) == Approx(1));
            REQUIRE(outside(s, p + normal * 1e-4) > 0.9e-4);
            REQUIRE(outside(s, p - normal * 1e-4) < 0);
        }
    }
}

TEST_CASE("textures return valid colors, and the same color for the same point") {
    generator random{std::mt19937(5)};
    const vector3 a = from_srgb(200, 100, 50), b = from_srgb(30, 60, 90), c = from_srgb(250, 250, 250);
    const std::vector<texture> all{plain(a),           marbled(a, b, 0.1),    stripes(a, b, 0.1),
                                   checker(a, b, 0.1), segments(a, b, c, 6),  bricks(a, b, c, 0.2, 0.07),
                                   boards(a, b, 0.1),  solid_wood(a, b, 0.02)};
    for (const texture& t : all) {
        double least = 1e9, most = -1e9;
        for (int trial = 0; trial < 500; ++trial) {
            surface_point p;
            p.local = random.direction(), p.u = random.between(-5, 5), p.v = random.between(-5, 5);
            const vector3 color = t(p), again = t(p);
            for (const double channel : {color.x, color.y, color.z}) REQUIRE((channel >= 0 && channel <= 1.3));
            REQUIRE(length(color - again) == 0);
            least = std::min(least, color.x), most = std::max(most, color.x);
        }
        CHECK((&t == &all[0]) == (most - least < 0.05));
    }
}
