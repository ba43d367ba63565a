#include <ldi/mesh/detail/soft_edges.hpp>

#include <ldi/charts/charts.hpp>
#include <ldi/core/layered_view.hpp>
#include <ldi/formats/glb.hpp>
#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/inpaint/mixed_colors.hpp>
#include <ldi/mesh/build_mesh.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/expand.hpp>
#include <ldi/occlusion/spurious_discontinuities.hpp>
#include <ldi/texture/atlas.hpp>

#include <catch2/catch.hpp>
#include <tests/support/lifted_scene.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <set>
#include <utility>

namespace {

/// Random surfaces in front of each other, converted to a mesh.
struct scene {
    ldi::image<float> disparity;
    ldi::photo_layers layers;
    ldi::photo_facts facts;
    ldi::chart_set charts;
    ldi::texture_atlas atlas;

    explicit scene(std::uint32_t seed) {
        std::mt19937 random(seed);
        disparity = ldi::testing::random_disparity(random, 60 + seed % 40, 80);
        ldi::photo_layer layer = ldi::testing::lift_disparity(disparity);
        const auto curves = ldi::find_discontinuity_curves(layer, {});
        ldi::close_spurious_discontinuities(layer, curves);
        ldi::unmix_colors(layer);
        facts = ldi::testing::facts_of(layer.topology());
        layers = ldi::expand(std::move(layer), {}, curves).layers;
        ldi::diffusion_inpainter().inpaint(layers);
        charts = ldi::make_charts(layers, {});
        atlas = ldi::make_atlas(layers, charts);
    }

    ldi::layered_view<ldi::disparity_column> without_matte() const { return layers; }

    ldi::textured_mesh mesh(const ldi::mesh_options& options) const {
        return ldi::build_mesh(layers, facts, charts, atlas, options);
    }
};

ldi::mesh_options everywhere() {
    ldi::mesh_options options;
    options.soft_edges.max_share = 10;
    return options;
}

std::array<float, 3> position(const ldi::buffer<float>& of, std::uint32_t vertex) {
    return {of[3 * vertex], of[3 * vertex + 1], of[3 * vertex + 2]};
}

}  // namespace

TEST_CASE("a soft-edge strip shares vertices with the mesh, bit for bit, and fades out over farther surfaces") {
    std::size_t rims = 0;
    for (std::uint32_t seed = 1; seed <= 30; ++seed) {
        const scene s(seed);
        const ldi::textured_mesh mesh = s.mesh(everywhere());
        const ldi::soft_edge_strip& strip = mesh.soft_edges;
        REQUIRE(strip.positions.size() == 3 * strip.vertex_count());
        REQUIRE(strip.texture_coordinates.size() == 2 * strip.vertex_count());
        std::set<std::array<float, 3>> of_mesh;
        for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v) of_mesh.insert(position(mesh.positions, v));
        std::size_t behind = 0, outer = 0;
        for (std::uint32_t v = 0; v < strip.vertex_count(); ++v) {
            const std::array<float, 3> p = position(strip.positions, v);
            if (strip.opacity[v] > 0) {
                REQUIRE(of_mesh.count(p) == 1);
                REQUIRE(strip.opacity[v] == 128);
                continue;
            }
            ++outer;
            const auto [x, y] = s.facts.camera.project(p);
            const auto [inner_x, inner_y] = s.facts.camera.project(position(strip.positions, v - 1));
            REQUIRE(std::hypot(x - inner_x, y - inner_y) < 1.5F * ldi::soft_edge_options().max_width + 0.01F);
            const auto at = [](float c, std::size_t length) {
                return std::clamp<std::size_t>(static_cast<std::size_t>(std::max(c, 0.0F)), 0, length - 1);
            };
            const float seen = s.facts.range.depth(s.disparity(at(y, s.disparity.height()), at(x, s.disparity.width())));
            behind += seen > -p[2] ? 1U : 0U;
        }
        rims += outer;
        CHECK(10 * behind >= 7 * outer);  // except in notches narrower than the strip, and where the outline was simplified
    }
    CHECK(rims > 500);
}

TEST_CASE("a soft-edge strip is as wide as the foreground's colors extend into the background, up to a limit") {
    // A red disc in front of a gray wall; its colors fade out over `fade` pixels beyond its edge in depth.
    const auto widths = [](float fade) {
        ldi::image<float> disparity(90, 90);
        ldi::image<std::uint8_t> photo(90, 90, 3, std::uint8_t{60});
        for (std::size_t y = 0; y < 90; ++y)
            for (std::size_t x = 0; x < 90; ++x) {
                const float beyond = std::hypot(static_cast<float>(x) - 44.5F, static_cast<float>(y) - 44.5F) - 25.0F;
                disparity(y, x) = beyond < 0 ? 0.8F : 0.2F;
                photo(y, x, 0) = static_cast<std::uint8_t>(60 + 180 * std::clamp(1 - beyond / fade, 0.0F, 1.0F));
            }
        ldi::photo_layer layer = ldi::lift(photo, disparity);
        const auto curves = ldi::find_discontinuity_curves(layer, {});
        ldi::unmix_colors(layer, {.reach = 6.0F / 90.0F});
        const ldi::photo_facts facts = ldi::testing::facts_of(layer.topology());
        const ldi::photo_layers layers = ldi::expand(std::move(layer), {}, curves).layers;
        const ldi::chart_set charts = ldi::make_charts(layers, {});
        const ldi::textured_mesh mesh = ldi::build_mesh(layers, facts, charts, ldi::make_atlas(layers, charts), everywhere());
        double sum = 0, count = 0, widest = 0;
        for (std::uint32_t v = 0; v < mesh.soft_edges.vertex_count(); ++v) {
            if (mesh.soft_edges.opacity[v] > 0) continue;
            const auto [x, y] = facts.camera.project(position(mesh.soft_edges.positions, v));
            const double width = std::hypot(static_cast<double>(x) - 45, static_cast<double>(y) - 45) - 25;
            sum += width, count += 1, widest = std::max(widest, width);
        }
        return std::array<double, 3>{sum / count, widest, count};
    };
    // Widths are measured from the disc: the outline is half a pixel outside it, and the strip is 1 to 3 pixels wide.
    for (const auto& [fade, width] : {std::pair{0.01F, 1.5}, {3.0F, 2.5}, {4.0F, 3.4}, {8.0F, 3.6}}) {
        CAPTURE(fade);
        const auto [mean, widest, count] = widths(fade);
        CHECK(count > 10);
        CHECK(mean == Approx(width).margin(0.25));
        CHECK(widest < width + 0.4);
    }
}

TEST_CASE("the triangles of a soft-edge strip face the camera and are ordered from far to near") {
    for (std::uint32_t seed = 1; seed <= 30; ++seed) {
        const ldi::textured_mesh mesh = scene(seed).mesh(everywhere());
        const ldi::soft_edge_strip& strip = mesh.soft_edges;
        double before = 1e9;
        std::size_t turned = 0;
        for (std::size_t t = 0; t < strip.triangles.size(); t += 3) {
            double nearest = 1e9, area = 0;
            std::array<std::array<float, 3>, 3> p;
            for (std::size_t i = 0; i < 3; ++i) {
                p[i] = position(strip.positions, strip.triangles[t + i]);
                nearest = std::min(nearest, -static_cast<double>(p[i][2]));
            }
            const auto at = [&](std::size_t i, std::size_t axis) { return static_cast<double>(p[i][axis] / -p[i][2]); };
            area = (at(1, 0) - at(0, 0)) * (at(2, 1) - at(0, 1)) - (at(1, 1) - at(0, 1)) * (at(2, 0) - at(0, 0));
            turned += area < 0 ? 1U : 0U;
            CHECK(nearest < before * 1.3);  // triangles are ordered by edges, whose two ends differ in depth
            before = std::min(before, nearest);
        }
        CHECK(20 * turned <= strip.triangles.size() / 3);  // only at sharp inner corners
    }
}

TEST_CASE("soft-edge strips add at most 8 percent and 1000 bytes to a file, and are absent with hard edges or without a matte") {
    for (std::uint32_t seed = 1; seed <= 30; ++seed) {
        const scene s(seed);
        const auto bytes = [&](const ldi::textured_mesh& mesh) { return ldi::encode_glb(mesh, s.atlas.color).size(); };
        ldi::mesh_options options;
        options.soft_edges.min_width = 0;
        const ldi::textured_mesh hard = s.mesh(options), plain = ldi::build_mesh(s.without_matte(), s.facts, s.charts, s.atlas);
        CHECK(hard.soft_edges.triangles.empty());
        CHECK(plain.soft_edges.triangles.empty());
        const ldi::textured_mesh soft = s.mesh(ldi::mesh_options());
        CHECK(soft.positions == plain.positions);
        CHECK(soft.triangles == plain.triangles);
        CHECK(soft.soft_edges.triangles.size() <= s.mesh(everywhere()).soft_edges.triangles.size());
        // The description of a strip takes up to 1000 bytes in addition to the strip itself.
        CHECK(static_cast<double>(bytes(soft)) < 1.08 * static_cast<double>(bytes(plain)) + 1000);
    }
}

TEST_CASE("a soft-edge strip goes around corners of 50 degrees, and tapers off at spikes of 35 degrees") {
    const auto strip_around = [](float degrees) {
        // A wedge in front of a wall. Its tip, (10, 40), is the middle corner of an outline, and points to the left.
        const float half = 0.5F * degrees * 3.14159265F / 180.0F;
        const std::int32_t x = 10 + static_cast<std::int32_t>(std::lround(60.0F * std::cos(half))),
                           dy = static_cast<std::int32_t>(std::lround(60.0F * std::sin(half)));
        ldi::flat_mesh flat;
        flat.outlines.corners = {{x, 40 + dy, 0.8F}, {10, 40, 0.8F}, {x, 40 - dy, 0.8F}};
        flat.outlines.pieces.push_back({0, ldi::no_chart, 0, 2, 1, 1});
        flat.open_corners = {0, 1, 2}, flat.first_open_corner = {0, 3};
        ldi::buffer<float> disparity(80 * 80, 0.2F);
        for (std::size_t v = 0; v < 80; ++v)
            for (std::size_t u = 10; u < 80; ++u) {
                const float across = std::abs(static_cast<float>(v) - 39.5F), along = static_cast<float>(u) - 9.5F;
                if (across <= along * std::tan(half)) disparity[80 * v + u] = 0.8F;
            }
        const ldi::graph g = ldi::make_grid(80, 80);
        const ldi::photo_facts facts = ldi::testing::facts_of(g);
        const ldi::soft_edge_options options;
        const ldi::buffer<std::uint8_t> matte(80 * 80, 0);
        const ldi::detail::pixel_stacks stacks(g, disparity);
        ldi::detail::soft_edge_builder builder(flat, stacks, matte, {}, facts.camera, facts.range, options);
        builder.choose(10);
        builder.add_piece(0, {0, 0}, {1.0F, 1.0F});
        return builder.finish();
    };
    CHECK(strip_around(50.0F).triangles.size() > 0);
    CHECK(strip_around(35.0F).triangles.empty());
}

TEST_CASE("a soft-edge strip has its texture in the padding of the atlas, and up to half a texel beyond") {
    for (std::int32_t padding : {1, 2, 4, 20}) {
        scene s(7);
        ldi::atlas_options atlas_options;
        atlas_options.padding.filter_padding = padding;
        s.atlas = ldi::make_atlas(s.layers, s.charts, atlas_options);
        ldi::mesh_options options = everywhere();
        options.soft_edges.min_width = options.soft_edges.max_width = 64;
        const ldi::soft_edge_strip strip = s.mesh(options).soft_edges;
        REQUIRE(strip.vertex_count() > 20);
        const auto texels = [&](std::uint32_t vertex, std::size_t axis) {
            return strip.texture_coordinates[2 * vertex + axis] *
                   static_cast<float>(axis == 0 ? s.atlas.color.width() : s.atlas.color.height());
        };
        std::size_t hems = 0;
        for (std::uint32_t v = 0; v + 1 < strip.vertex_count(); ++v) {  // each outer end is stored after its inner end
            if (strip.opacity[v] == 0 || strip.opacity[v + 1] != 0) continue;
            ++hems;
            const float width = std::hypot(texels(v, 0) - texels(v + 1, 0), texels(v, 1) - texels(v + 1, 1));
            REQUIRE(width < static_cast<float>(padding) + 0.51F);
        }
        REQUIRE(hems > 5);
    }
}

TEST_CASE("with an infinite maximum share, every silhouette has a soft-edge strip") {
    const scene s(7);
    ldi::mesh_options options = everywhere();
    const ldi::textured_mesh all = s.mesh(options);
    for (const float share : {1e18F, 1e30F, std::numeric_limits<float>::infinity()}) {
        options.soft_edges.max_share = share;
        REQUIRE(s.mesh(options).soft_edges.positions == all.soft_edges.positions);
    }
}

TEST_CASE("a flat photo has no soft-edge strip") {
    ldi::photo_layer layer = ldi::testing::lift_disparity(ldi::image<float>(40, 50, 1, 0.5F));
    ldi::unmix_colors(layer);
    const ldi::photo_layers layers = ldi::expand(std::move(layer), {}, {}).layers;
    const ldi::chart_set charts = ldi::make_charts(layers, {});
    const ldi::photo_facts facts = ldi::testing::facts_of(layers.topology());
    CHECK(ldi::build_mesh(layers, facts, charts, ldi::make_atlas(layers, charts)).soft_edges.triangles.empty());
}
