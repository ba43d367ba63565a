#include <ldi/mesh/move_to_sheets.hpp>

#include "examples/scenes/scene.hpp"
#include "tests/support/psnr.hpp"

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/rasterizer.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace ldi;

/// A scene's photo at an integer multiple of the layered image's size.
struct full_size_scene {
    image<std::uint8_t> photo;
    photo3d made;
    sheet_layout layout;
    textured_mesh mesh;
    std::vector<image<std::uint8_t>> textures;
};

full_size_scene make_scene(const std::string& name, std::int32_t width, std::int32_t height, std::int32_t sheet_side) {
    const scenes::scene scene = scenes::scene_by_name(name, 4 * width, 4 * height);
    scenes::picture picture = scenes::render(scene, scenes::picture_options{1, 0.7});
    for (float& value : picture.disparity) value = std::clamp(value, 0.0F, 1.0F);
    full_size_scene s{std::move(picture.color), {}, {}, {}, {}};
    const sheet_options sheets{sheet_side};
    photo3d_options options;
    options.long_side = static_cast<std::size_t>(std::max(width, height));
    options.normalize.is_inverse_depth = false;
    options.normalize.assumed_range = scene.range;
    options.normalize.clipped_share = 0.0F;
    options = for_sheets(options, s.photo.height(), s.photo.width(), sheets);
    s.made = make_photo3d(s.photo, given_disparity{picture.disparity}, diffusion_inpainter{}, options);
    s.layout = lay_out_sheets(s.made.layers, s.made.charts, s.made.atlas, s.photo.height(), s.photo.width(),
                              {.max_side = sheet_side, .margin = s.made.facts.margin});
    s.mesh = move_to_sheets(s.made.mesh, s.made.charts, s.made.atlas, s.layout);
    s.textures.push_back(s.made.atlas.color);
    for (std::size_t i = 1; i < s.layout.sizes.size(); ++i)
        s.textures.push_back(draw_sheet(s.layout, i, s.made.charts, s.made.atlas, s.made.photo, s.photo));
    return s;
}

/// Returns a scene of 120 x 160 pixels. Makes it once for all test cases, because that takes seconds with sanitizers.
const full_size_scene& scene_of(const std::string& name, std::int32_t sheet_side) {
    static std::map<std::pair<std::string, std::int32_t>, full_size_scene> made;
    const auto [place, is_new] = made.try_emplace({name, sheet_side});
    if (is_new) place->second = make_scene(name, 120, 160, sheet_side);
    return place->second;
}

using corner = std::array<float, 3>;
corner corner_of(const textured_mesh& mesh, std::size_t vertex) {
    return {mesh.positions[3 * vertex], mesh.positions[3 * vertex + 1], mesh.positions[3 * vertex + 2]};
}

std::vector<std::array<corner, 3>> sorted_triangles(const textured_mesh& mesh) {
    std::vector<std::array<corner, 3>> triangles;
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 3)
        triangles.push_back(
            {corner_of(mesh, mesh.triangles[i]), corner_of(mesh, mesh.triangles[i + 1]), corner_of(mesh, mesh.triangles[i + 2])});
    std::sort(triangles.begin(), triangles.end());
    return triangles;
}

constexpr const char* names[] = {"t_junction", "rods", "random3"};

}  // namespace

TEST_CASE("moving a mesh to sheets preserves all positions and triangles, bit for bit, and makes one part per texture") {
    for (const char* name : names) {
        const full_size_scene& s = scene_of(name, 256);
        INFO(name);
        CHECK(s.layout.sizes.size() > 4);  // charts are divided to fit
        CHECK(s.mesh.part_count() == s.layout.sizes.size());
        CHECK_NOTHROW(check_mesh(s.mesh, s.textures.size()));
        CHECK(s.mesh.vertex_count() == s.made.mesh.vertex_count());
        CHECK(sorted_triangles(s.mesh) == sorted_triangles(s.made.mesh));
        CHECK(s.mesh.soft_edges.positions == s.made.mesh.soft_edges.positions);
    }
}

TEST_CASE("texture coordinates on a sheet follow from the vertices' positions in the photo") {
    for (const char* name : names) {
        const full_size_scene& s = scene_of(name, 512);
        const pinhole_camera& camera = s.made.facts.camera;
        for (std::size_t t = 1; t < s.mesh.part_count(); ++t)
            for (std::size_t v = s.mesh.part(t).first_vertex; v < s.mesh.part(t + 1).first_vertex; ++v) {
                const sheet_placement& place = s.layout.placements[s.made.charts.chart_of[s.mesh.pixels[v]]];
                REQUIRE(static_cast<std::size_t>(place.sheet) == t);
                const auto [x, y] = camera.project(corner_of(s.mesh, v));
                const rectangle_size size = s.layout.sizes[t];
                REQUIRE(s.mesh.texture_coordinates[2 * v] * static_cast<float>(size.width) ==
                        Approx(4 * x - static_cast<float>(place.photo_x - place.room.x)).margin(0.02));
                REQUIRE(s.mesh.texture_coordinates[2 * v + 1] * static_cast<float>(size.height) ==
                        Approx(4 * y - static_cast<float>(place.photo_y - place.room.y)).margin(0.02));
            }
    }
}

TEST_CASE("vertices stay inside the rectangles of their charts on sheets, even if sheets have less padding than the atlas") {
    std::size_t hems = 0;
    for (const char* name : names) {
        const full_size_scene& s = scene_of(name, 512);
        hems += s.mesh.hem_vertices.size();
        const sheet_layout thin = lay_out_sheets(s.made.layers, s.made.charts, s.made.atlas, s.photo.height(), s.photo.width(),
                                                 {.max_side = 512, .padding = 1, .margin = s.made.facts.margin});
        const textured_mesh mesh = move_to_sheets(s.made.mesh, s.made.charts, s.made.atlas, thin);
        for (std::size_t t = 1; t < mesh.part_count(); ++t)
            for (std::size_t v = mesh.part(t).first_vertex; v < mesh.part(t + 1).first_vertex; ++v) {
                const atlas_rectangle room = thin.placements[s.made.charts.chart_of[mesh.pixels[v]]].room;
                const float x = mesh.texture_coordinates[2 * v] * static_cast<float>(thin.sizes[t].width);
                const float y = mesh.texture_coordinates[2 * v + 1] * static_cast<float>(thin.sizes[t].height);
                REQUIRE(std::abs(x - static_cast<float>(room.x) - 0.5F * static_cast<float>(room.width)) <
                        0.5F * static_cast<float>(room.width) + 0.01F);
                REQUIRE(std::abs(y - static_cast<float>(room.y) - 0.5F * static_cast<float>(room.height)) <
                        0.5F * static_cast<float>(room.height) + 0.01F);
            }
    }
    CHECK(hems > 0);
}

TEST_CASE("a mesh on sheets has the same coverage and depth as on its atlas, without cracks between sheets") {
    for (const char* name : names) {
        const full_size_scene& s = scene_of(name, 256);
        for (const float shift : {-4.0F, 0.0F, 7.0F}) {
            const view from = moved_view(s.made.facts.camera, s.made.facts.range, 1.0F, shift);
            const rendering on_atlas = rasterize(s.made.mesh, s.made.atlas.color, from);
            const rendering on_sheets = rasterize(s.mesh, s.textures, from);
            INFO(name << " moved by " << shift);
            CHECK(on_sheets.coverage == on_atlas.coverage);
            CHECK(on_sheets.depth == on_atlas.depth);
            CHECK(testing::psnr(on_sheets.color, on_atlas.color, 0) > 24);
        }
    }
}

TEST_CASE(
    "rendered at full size from the photo's viewpoint, a mesh textured from sheets matches the photo better than with its "
    "atlas") {
    for (const char* name : names) {
        const full_size_scene& s = scene_of(name, 1024);
        view from;
        from.camera = s.made.facts.camera;
        from.camera.width *= 4, from.camera.height *= 4, from.camera.focal_length *= 4;
        const double on_sheets = testing::psnr(rasterize(s.mesh, s.textures, from).color, s.photo, 8);
        const double on_atlas = testing::psnr(rasterize(s.made.mesh, s.made.atlas.color, from).color, s.photo, 8);
        CAPTURE(name, on_sheets, on_atlas);
        CHECK(on_sheets > on_atlas + 1);
    }
}

TEST_CASE("a layout of different charts and a mesh that is already on sheets are refused") {
    const full_size_scene s = make_scene("rods", 60, 80, 512);
    const photo3d& made = s.made;
    sheet_layout other = s.layout;
    other.placements.pop_back();
    CHECK_THROWS_AS(move_to_sheets(made.mesh, made.charts, made.atlas, other), error);
    CHECK_THROWS_AS(move_to_sheets(made.mesh, made.charts, made.atlas, {}), error);
    CHECK_THROWS_AS(move_to_sheets(s.mesh, made.charts, made.atlas, s.layout), error);  // already on sheets
    textured_mesh wrong = made.mesh;
    for (const std::int32_t pixel : {-1, made.charts.chart_of.count()}) {
        wrong.pixels[0] = pixel;
        CHECK_THROWS_WITH(move_to_sheets(wrong, made.charts, made.atlas, s.layout), Catch::Contains("pixel indices below"));
    }
    for (const std::int32_t chart : {-1, made.charts.charts.count(), 1 << 24}) {
        chart_set charts = made.charts;
        charts.chart_of[made.mesh.pixels[0]] = chart;
        CHECK_THROWS_WITH(move_to_sheets(made.mesh, charts, made.atlas, s.layout), Catch::Contains("chart indices below"));
    }
    other = s.layout;
    other.placements[0].sheet = static_cast<decltype(other.placements[0].sheet)>(other.sizes.size());
    CHECK_THROWS_WITH(move_to_sheets(made.mesh, made.charts, made.atlas, other), Catch::Contains("sheet indices below"));
}
