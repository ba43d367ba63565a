// A stage that receives results of different photos refuses them.
#include "tests/support/lifted_scene.hpp"

#include <ldi/charts/charts.hpp>
#include <ldi/mesh/build_mesh.hpp>
#include <ldi/mesh/gather.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/expand.hpp>
#include <ldi/occlusion/spurious_discontinuities.hpp>
#include <ldi/texture/atlas.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <random>

using namespace ldi;

namespace {
photo_layer random_layer(std::size_t rows, std::size_t columns) {
    std::mt19937 random(3);
    return testing::lift_disparity(testing::random_disparity(random, rows, columns));
}
}  // namespace

TEST_CASE("expand() and close_spurious_discontinuities() refuse curves of another photo") {
    photo_layer small = random_layer(20, 20);
    for (const photo_layer& other : {random_layer(60, 50), random_layer(20, 19)}) {
        const buffer<discontinuity_curve> curves = find_discontinuity_curves(other, {}, {.min_length = 2, .max_density = 2.0F});
        REQUIRE_FALSE(curves.empty());
        CHECK_THROWS_AS(expand(small, {}, curves), error);
        CHECK_THROWS_AS(close_spurious_discontinuities(small, curves), error);
    }
}

TEST_CASE("expand() and make_atlas() refuse curves and charts of a mirrored photo") {
    std::mt19937 random(3);
    const image<float> map = testing::random_disparity(random, 40, 40);
    image<float> mirrored(40, 40);
    for (std::size_t y = 0; y < 40; ++y)
        for (std::size_t x = 0; x < 40; ++x) mirrored(y, x) = map(y, 39 - x);
    const photo_layer layer = testing::lift_disparity(map), other = testing::lift_disparity(mirrored);
    const buffer<discontinuity_curve> curves = find_discontinuity_curves(other, {}, {.min_length = 2, .max_density = 2.0F});
    REQUIRE_FALSE(curves.empty());
    CHECK_THROWS_AS(expand(layer, {}, curves), error);

    // Without hidden surfaces, charts of the mirrored photo would also be a partition of this photo's pixels.
    const photo_layers layers = expand(layer, {}, find_discontinuity_curves(layer)).layers;
    const photo_layers other_layers = expand(other, {}, find_discontinuity_curves(other)).layers;
    REQUIRE(layers.size() > 1600);
    CHECK_THROWS_AS(make_atlas(layers, make_charts(other_layers, {})), error);
    chart_set charts = make_charts(layers, {});
    REQUIRE(charts.charts.size() > 1);
    std::swap(charts.charts.front(), charts.charts.back());
    CHECK_THROWS_AS(make_atlas(layers, charts), error);
    std::swap(charts.charts.front(), charts.charts.back());
    CHECK_NOTHROW(make_atlas(layers, charts));
    chart_pixels& pixels = charts.charts.front().pixels;
    REQUIRE(pixels.size() > 1);
    const std::int32_t first = pixels.front();
    pixels = {};
    pixels.push_back(first);  // the other pixels are missing
    CHECK_THROWS_AS(make_atlas(layers, charts), error);
}

TEST_CASE("build_mesh() refuses disparities that are not finite") {
    photo_layers layers = expand(random_layer(20, 20), {}, {}).layers;
    const chart_set charts = make_charts(layers, {});
    const texture_atlas atlas = make_atlas(layers, charts);
    layers.column<disparity_column>()[7] = std::nanf("");
    CHECK_THROWS_AS(build_mesh(layers, testing::facts_of(layers.topology()), charts, atlas), error);
}

TEST_CASE("make_atlas(), build_mesh() and gather() refuse charts and meshes of another photo") {
    const photo_layers layers = expand(random_layer(40, 40), {}, {}).layers, other = expand(random_layer(30, 40), {}, {}).layers;
    const chart_set charts = make_charts(layers, {}), other_charts = make_charts(other, {});
    const texture_atlas atlas = make_atlas(layers, charts);
    const photo_facts facts = testing::facts_of(layers.topology());
    CHECK_THROWS_AS(make_atlas(layers, other_charts), error);
    texture_atlas right_count = atlas;
    right_count.placements.resize(other_charts.charts.size());
    CHECK_THROWS_AS(build_mesh(layers, facts, other_charts, right_count), error);
    textured_mesh mesh = build_mesh(layers, facts, charts, atlas);
    mesh.positions.resize(mesh.positions.size() - 3);
    CHECK_THROWS_AS(gather<disparity_column>(mesh, layers, facts.camera), error);
}
