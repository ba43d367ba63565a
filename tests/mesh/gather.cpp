#include <ldi/charts/charts.hpp>
#include <ldi/core/graph_builder.hpp>
#include <ldi/mesh/build_mesh.hpp>
#include <ldi/mesh/gather.hpp>
#include <ldi/texture/atlas.hpp>

#include <catch2/catch.hpp>
#include <tests/mesh/random_charts.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>

using namespace ldi;

namespace {
struct weight_column {
    using scalar = float;
    static constexpr std::size_t channels = 1;
};
struct label_column {  // two numbers per pixel; the pixels at a vertex vote for one pair
    using scalar = std::uint8_t;
    static constexpr std::size_t channels = 2;
    static std::array<std::uint8_t, 2> at_vertex(pixel_values<std::uint8_t, 2> pixels) {
        std::size_t best = 0, max_votes = 0;
        for (std::size_t i = 0; i < pixels.size(); ++i) {
            std::size_t votes = 0;
            for (std::size_t k = 0; k < pixels.size(); ++k) votes += pixels(i, 0) == pixels(k, 0) && pixels(i, 1) == pixels(k, 1);
            if (votes > max_votes) best = i, max_votes = votes;
        }
        return {pixels(best, 0), pixels(best, 1)};
    }
};
using layers_of_test = layered_image<weight_column, label_column>;

/// A mesh with a single vertex, at lattice position (x, y), that belongs to a pixel.
textured_mesh vertex_at(const pinhole_camera& camera, float x, float y, std::int32_t pixel) {
    textured_mesh mesh;
    const auto p = camera.unproject(x, y, 2.0F);
    mesh.positions.append(p.begin(), p.end());
    mesh.texture_coordinates.resize(2);
    mesh.pixels.push_back(pixel);
    return mesh;
}
}  // namespace

TEST_CASE("a vertex receives the mean of the adjacent pixels of its own surface") {
    graph_builder b(make_grid(3, 3));
    b.unlink(1, side::left), b.unlink(4, side::left), b.unlink(7, side::left);  // the first column is another surface
    layers_of_test layers(std::move(b).build());
    for (std::int32_t i = 0; i < 9; ++i) layers.at<weight_column>(i)[0] = static_cast<float>(i * i);
    const pinhole_camera camera{3, 3, 4.0F};
    const auto at = [&](float x, float y, std::int32_t pixel) {
        return gather<weight_column>(vertex_at(camera, x, y, pixel), layers, camera)[0];
    };
    CHECK(at(2, 2, 4) == Approx((16 + 25 + 49 + 64) / 4.0));
    CHECK(at(1, 1, 4) == Approx((1 + 16) / 2.0));
    CHECK(at(1, 1, 3) == Approx((0 + 9) / 2.0));
    CHECK(at(0, 0, 0) == Approx(0));
    CHECK(at(3, 3, 8) == Approx(64));
}

TEST_CASE("a column can define its own rule, such as a vote of the pixels") {
    layers_of_test layers(make_grid(2, 2));
    const std::uint8_t labels[][2] = {{1, 9}, {2, 8}, {2, 8}, {1, 8}};
    for (std::int32_t i = 0; i < 4; ++i) std::copy_n(labels[i], 2, layers.at<label_column>(i).begin());
    const pinhole_camera camera{2, 2, 3.0F};
    CHECK(gather<label_column>(vertex_at(camera, 1, 1, 0), layers, camera) == buffer<std::uint8_t>{2, 8});
}

TEST_CASE("gather() refuses vertices that are not at a corner of their pixel") {
    const layers_of_test layers(make_grid(2, 2));
    const pinhole_camera camera{2, 2, 3.0F};
    for (const float x : {std::nanf(""), 1e30F, -HUGE_VALF}) {
        textured_mesh mesh = vertex_at(camera, 1, 1, 3);
        mesh.positions[0] = x;
        CHECK_THROWS_AS(gather<weight_column>(mesh, layers, camera), error);
    }
    CHECK_THROWS_AS(gather<weight_column>(vertex_at(camera, 0, 0, 3), layers, camera), error);
    CHECK_THROWS_AS(gather<weight_column>(vertex_at(camera, 1.4F, 1, 3), layers, camera), error);
    CHECK_THROWS_AS(gather<weight_column>(vertex_at(camera, 1, 1.6F, 3), layers, camera), error);
    CHECK_NOTHROW(gather<weight_column>(vertex_at(camera, 2, 1, 3), layers, camera));
}

TEST_CASE("gather() refuses the camera of another photo") {
    const layers_of_test layers(make_grid(6, 6));
    const pinhole_camera camera{6, 6, 4.0F};
    const textured_mesh mesh = vertex_at(camera, 2, 1, 7);
    CHECK_NOTHROW(gather<weight_column>(mesh, layers, camera));
    CHECK_THROWS_AS(gather<weight_column>(mesh, layers, pinhole_camera{}), error);
    CHECK_THROWS_AS(gather<weight_column>(mesh, layers, pinhole_camera{6, 6, 6.0F}), error);
}

TEST_CASE("gather() refuses vertices whose pixels are not in the layers") {
    const layers_of_test layers(make_grid(2, 2));
    const pinhole_camera camera{2, 2, 3.0F};
    for (const std::int32_t pixel : {-1, 4})
        CHECK_THROWS_AS(gather<weight_column>(vertex_at(camera, 1, 1, pixel), layers, camera), error);
    textured_mesh mesh = vertex_at(camera, 1, 1, 0);
    mesh.pixels.push_back(0);
    CHECK_THROWS_AS(gather<weight_column>(mesh, layers, camera), error);
    mesh.pixels.pop_back();
    mesh.hem_vertices.push_back({0, 1});
    CHECK_THROWS_AS(gather<weight_column>(mesh, layers, camera), error);
}

TEST_CASE("on meshes of random layers, gather() gives the outer end of a hem the values of its inner end") {
    std::size_t hems = 0;
    for (std::uint32_t seed = 1; seed <= 200; ++seed) {
        CAPTURE(seed);
        std::mt19937 random(seed);
        photo_layers layers(testing::random_linked_layers(random, 40));
        for (std::size_t i = 0; i < layers.size(); ++i) {
            layers.at<disparity_column>(i)[0] = static_cast<float>(random() % 1000) / 1000.0F;
            layers.at<color_column>(i)[0] = static_cast<std::uint8_t>(random());
        }
        const graph_view g = layers.topology();
        photo_facts facts;
        facts.camera = {g.width(), g.height(), 50.0F};
        facts.motion = 0.1F;
        const chart_set charts = make_charts(layers, facts.surface);
        const textured_mesh mesh = build_mesh(layers, facts, charts, make_atlas(layers, charts));
        hems += mesh.hem_vertices.size();
        buffer<std::uint8_t> colors;
        REQUIRE_NOTHROW(colors = gather<color_column>(mesh, layers, facts.camera));
        for (const hem_vertex& h : mesh.hem_vertices) {
            REQUIRE(mesh.pixels[h.outer] == mesh.pixels[h.inner]);
            REQUIRE(colors[3 * h.outer] == colors[3 * h.inner]);
        }
        // With twice the focal length, most vertices project to other positions.
        if (mesh.vertex_count() > 8 && g.width() > 4)
            CHECK_THROWS_AS(gather<color_column>(mesh, layers, {g.width(), g.height(), 100.0F}), error);
    }
    CHECK(hems > 1000);
}
