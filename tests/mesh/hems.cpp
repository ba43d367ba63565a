#include <ldi/mesh/detail/hems.hpp>

#include <ldi/charts/charts.hpp>
#include <ldi/mesh/build_mesh.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/expand.hpp>
#include <ldi/occlusion/spurious_discontinuities.hpp>
#include <ldi/texture/atlas.hpp>

#include <catch2/catch.hpp>
#include <tests/support/lifted_scene.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <utility>

namespace {

/// Random surfaces in front of each other.
struct scene_with_hidden_surfaces {
    ldi::photo_layers layers;
    ldi::photo_facts facts;
    ldi::flat_mesh flat;

    explicit scene_with_hidden_surfaces(std::mt19937& random) {
        ldi::photo_layer layer = ldi::testing::lift_disparity(ldi::testing::random_disparity(random, 90, 120));
        const auto curves = ldi::find_discontinuity_curves(layer, {});
        ldi::close_spurious_discontinuities(layer, curves);
        facts = ldi::testing::facts_of(layer.topology());
        layers = ldi::expand(std::move(layer), {}, curves, {.motion = 0.3F, .iterations = 4096}).layers;
        facts.motion = 0.3F;
        flat = ldi::build_flat_mesh(layers, facts.range, ldi::make_charts(layers, {}));
    }

    ldi::detail::pixel_stacks stacks() const { return {layers.topology(), layers.column<ldi::disparity_column>()}; }
    ldi::buffer<ldi::detail::hem> hems(std::int32_t max_width = 4) const {
        return ldi::detail::hem_finder(flat, stacks(), facts, max_width).find();
    }
};

std::size_t count_hems(const ldi::buffer<ldi::detail::hem>& hems) {
    std::size_t count = 0;
    for (const ldi::detail::hem& h : hems) count += h.is_empty() ? 0U : 1U;
    return count;
}

}  // namespace

TEST_CASE("no surface has a hem if the camera does not move") {
    std::mt19937 random(1);
    std::size_t count = 0;
    for (int round = 0; round < 20; ++round) {
        scene_with_hidden_surfaces still(random);
        count += count_hems(still.hems());
        still.facts.motion = 0;
        REQUIRE(count_hems(still.hems()) == 0);
    }
    REQUIRE(count > 0);
}

TEST_CASE("hems are at most four pixels wide, and nearly all end behind a visible surface") {
    std::mt19937 random(2);
    std::size_t count = 0, behind = 0;
    for (int round = 0; round < 60; ++round) {
        const scene_with_hidden_surfaces s(random);
        const ldi::buffer<ldi::detail::hem> hems = s.hems();
        const ldi::detail::pixel_stacks stacks = s.stacks();
        REQUIRE(hems.size() == s.flat.open_corners.size());
        for (std::size_t i = 0; i < hems.size(); ++i) {
            const ldi::detail::hem& h = hems[i];
            if (h.is_empty()) continue;
            const ldi::outline_corner& c = s.flat.outlines.corners[s.flat.open_corners[i]];
            const float distance = std::hypot(h.x, h.y), to_last_pixel = (distance - 0.5F) / distance;
            const auto x = static_cast<std::int32_t>(std::floor(static_cast<float>(c.x) + to_last_pixel * h.x));
            const auto y = static_cast<std::int32_t>(std::floor(static_cast<float>(c.y) + to_last_pixel * h.y));
            CAPTURE(round, c.x, c.y, h.x, h.y);
            REQUIRE(distance < 4.001F);
            ++count;
            const std::int32_t visible = stacks.nearest(x, y);
            behind += visible != ldi::no_pixel && h.disparity < stacks.disparity(visible) ? 1U : 0U;
        }
    }
    CAPTURE(count, behind);
    REQUIRE(count > 100);
    REQUIRE(100 * behind > 90 * count);  // hems that share a corner end halfway between both directions
}

TEST_CASE("hems are at most four pixels wide for any motion and surface rule, even invalid ones") {
    std::mt19937 random(3);
    const scene_with_hidden_surfaces s(random);
    for (const float value :
         {0.0F, 1e30F, -1.0F, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()})
        for (const bool of_motion : {true, false}) {
            scene_with_hidden_surfaces hostile = s;
            (of_motion ? hostile.facts.motion : hostile.facts.surface.max_step) = value;
            for (const ldi::detail::hem& h : hostile.hems()) REQUIRE(std::hypot(h.x, h.y) < 4.001F);
        }
}

TEST_CASE("a hem has its texture in the padding of its own chart, however thin this padding is") {
    for (const std::int32_t padding : {1, 2, 4, 9}) {
        std::mt19937 random(2);
        std::size_t count = 0;
        for (int round = 0; round < 20; ++round) {
            const scene_with_hidden_surfaces s(random);
            const ldi::chart_set charts = ldi::make_charts(s.layers, {});
            ldi::atlas_options options;
            options.padding.filter_padding = padding;
            const ldi::texture_atlas atlas = ldi::make_atlas(s.layers, charts, options);
            const ldi::textured_mesh mesh = ldi::build_mesh(s.layers, s.facts, charts, atlas);
            count += mesh.hem_vertices.size();
            for (const ldi::hem_vertex& h : mesh.hem_vertices) {
                const std::size_t c = static_cast<std::size_t>(charts.chart_of[mesh.pixels[h.outer]]);
                const ldi::chart& shape = charts.charts[c];
                const ldi::chart_placement place = atlas.placements[c];
                const auto is_within = [&](float texels, std::int32_t first, std::int32_t length) {
                    return texels > static_cast<float>(first - padding) - 0.01F &&
                           texels < static_cast<float>(first + length + padding) + 0.01F;
                };
                const float* const uv = mesh.texture_coordinates.data() + 2 * std::size_t{h.outer};
                REQUIRE(is_within(uv[0] * static_cast<float>(atlas.color.width()), place.x, shape.width));
                REQUIRE(is_within(uv[1] * static_cast<float>(atlas.color.height()), place.y, shape.height));
            }
        }
        CHECK(count > 30);
    }
}

TEST_CASE("a mesh stores hems after the vertices of their chart, and hems do not change these vertices") {
    std::mt19937 random(4);
    std::size_t more = 0;
    for (int round = 0; round < 10; ++round) {
        const scene_with_hidden_surfaces s(random);
        ldi::photo_facts still = s.facts;
        still.motion = 0;
        const ldi::chart_set charts = ldi::make_charts(s.layers, {});
        const ldi::texture_atlas atlas = ldi::make_atlas(s.layers, charts);
        const ldi::textured_mesh with = ldi::build_mesh(s.layers, s.facts, charts, atlas);
        const ldi::textured_mesh without = ldi::build_mesh(s.layers, still, charts, atlas);
        REQUIRE(with.triangle_count() >= without.triangle_count());
        REQUIRE(with.texture_coordinates.size() == 2 * with.vertex_count());
        REQUIRE(with.pixels.size() == with.vertex_count());
        more += with.triangle_count() - without.triangle_count();
        const std::size_t first_chart = 3 * s.flat.charts[0].outline.size();  // its hems come after all of its own vertices
        REQUIRE(std::equal(without.positions.begin(), without.positions.begin() + static_cast<std::ptrdiff_t>(first_chart),
                           with.positions.begin()));
        for (const std::uint32_t vertex : with.triangles) REQUIRE(vertex < with.vertex_count());
    }
    REQUIRE(more > 0);
}
