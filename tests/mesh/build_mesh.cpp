#include <ldi/mesh/build_mesh.hpp>

#include "tests/core/broken_view.hpp"
#include "tests/support/errors.hpp"

#include <ldi/charts/charts.hpp>
#include <ldi/core/layered_view.hpp>
#include <ldi/mesh/gather.hpp>
#include <ldi/mesh/studs.hpp>

#include <catch2/catch.hpp>
#include <tests/mesh/random_charts.hpp>
#include <tests/support/surfaces.hpp>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <optional>
#include <string>

namespace {

using ldi::testing::charted_graph;
using point = std::array<std::uint32_t, 3>;  // bits of three floats

constexpr ldi::depth_range range{2.0F, 20.0F};
constexpr std::int32_t atlas_width = 256, atlas_height = 512;

ldi::buffer<ldi::chart_placement> random_placements(const charted_graph& c, std::uint32_t seed) {
    std::mt19937 random(seed);
    ldi::buffer<ldi::chart_placement> result;
    for (const ldi::chart& chart : c.charts.charts)
        result.push_back({static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(atlas_width - chart.width)),
                          static_cast<std::int32_t>(random() % static_cast<std::uint32_t>(atlas_height - chart.height))});
    return result;
}

ldi::pinhole_camera camera_of(const charted_graph& c) { return {c.topology.width(), c.topology.height(), 30.0F}; }

ldi::testing::surfaces layers_of(const charted_graph& c) { return ldi::testing::surfaces_of(c.topology, c.disparity); }

ldi::texture_atlas atlas_of(const ldi::buffer<ldi::chart_placement>& placements) {
    ldi::texture_atlas atlas;
    atlas.color = ldi::image<std::uint8_t>(atlas_height, atlas_width, 3);
    atlas.placements = placements;
    return atlas;
}

ldi::textured_mesh mesh_of(const charted_graph& c, const ldi::buffer<ldi::chart_placement>& placements,
                           const ldi::mesh_options& options) {
    ldi::photo_facts facts{camera_of(c), range, {}};
    facts.motion = 0;  // without hems
    return ldi::build_mesh(layers_of(c), facts, c.charts, atlas_of(placements), options);
}

ldi::mesh_options small_options() {
    ldi::mesh_options options;
    options.outlines.tolerance = 1.0F;
    options.studs.spacing = 5;
    options.studs.clearance = 2;
    return options;
}

point bits(const ldi::textured_mesh& m, std::uint32_t vertex) {
    point p;
    std::memcpy(p.data(), m.positions.data() + 3 * static_cast<std::size_t>(vertex), sizeof p);
    return p;
}

}  // namespace

TEST_CASE("every vertex lies on the ray through its lattice point, at a depth between near and far") {
    for (std::uint32_t seed = 0; seed < 300; ++seed) {
        const charted_graph c = ldi::testing::random_charts(seed, 20);
        const ldi::textured_mesh m = mesh_of(c, random_placements(c, seed), small_options());
        REQUIRE(m.texture_coordinates.size() == 2 * m.vertex_count());
        for (std::size_t v = 0; v < m.vertex_count(); ++v) {
            const std::array<float, 3> p{m.positions[3 * v], m.positions[3 * v + 1], m.positions[3 * v + 2]};
            REQUIRE(-p[2] >= range.z_near * 0.9999F);
            REQUIRE(-p[2] <= range.z_far * 1.0001F);
            const std::array<float, 2> seen = camera_of(c).project(p);
            REQUIRE(std::abs(seen[0] - std::round(seen[0])) < 1e-3F);
            REQUIRE(std::abs(seen[1] - std::round(seen[1])) < 1e-3F);
        }
    }
}

TEST_CASE("texture coordinates are the positions of the vertices in the atlas") {
    for (std::uint32_t seed = 0; seed < 300; ++seed) {
        const charted_graph c = ldi::testing::random_charts(seed, 20);
        const ldi::buffer<ldi::chart_placement> placements = random_placements(c, seed);
        const ldi::mesh_options options = small_options();
        const ldi::textured_mesh m = mesh_of(c, placements, options);
        ldi::serial_executor threads;
        const ldi::flat_mesh flat = ldi::build_flat_mesh(layers_of(c), range, c.charts, options, threads);
        std::size_t v = 0;
        for (std::size_t k = 0; k < flat.charts.size(); ++k) {
            const std::size_t end =
                v + flat.charts[k].outline.size() + static_cast<std::size_t>(flat.charts[k].stud_vertex_count);
            for (; v < end; ++v) {
                const std::array<float, 2> seen =
                    camera_of(c).project({m.positions[3 * v], m.positions[3 * v + 1], m.positions[3 * v + 2]});
                const float u = seen[0] - static_cast<float>(c.charts.charts[k].x - placements[k].x);
                const float w = seen[1] - static_cast<float>(c.charts.charts[k].y - placements[k].y);
                REQUIRE(std::abs(m.texture_coordinates[2 * v] * static_cast<float>(atlas_width) - u) < 1e-3F);
                REQUIRE(std::abs(m.texture_coordinates[2 * v + 1] * static_cast<float>(atlas_height) - w) < 1e-3F);
            }
        }
        REQUIRE(v == m.vertex_count());
    }
}

TEST_CASE("triangles face the camera, and none is degenerate") {
    for (std::uint32_t seed = 0; seed < 300; ++seed) {
        const charted_graph c = ldi::testing::random_charts(seed, 20);
        const ldi::textured_mesh m = mesh_of(c, random_placements(c, seed), small_options());
        REQUIRE(m.triangle_count() > 0);
        for (std::size_t f = 0; f < m.triangles.size(); f += 3) {
            std::array<std::array<double, 3>, 3> p;
            for (std::size_t k = 0; k < 3; ++k)
                for (std::size_t i = 0; i < 3; ++i) p[k][i] = static_cast<double>(m.positions[3 * m.triangles[f + k] + i]);
            std::array<double, 3> a, b;
            for (std::size_t i = 0; i < 3; ++i) a[i] = p[1][i] - p[0][i], b[i] = p[2][i] - p[0][i];
            const std::array<double, 3> normal{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
            REQUIRE(normal[0] * p[0][0] + normal[1] * p[0][1] + normal[2] * p[0][2] < 0);  // against the viewing direction
        }
    }
}

TEST_CASE("edges that two charts share have the same vertex positions, bit for bit") {
    std::size_t shared = 0;
    for (std::uint32_t seed = 0; seed < 500; ++seed) {
        // In a fully linked photo, each rim edge lies on the photo's border, or is also a rim edge of one other chart.
        std::mt19937 random(seed);
        charted_graph c;
        c.topology = ldi::make_grid(2 + static_cast<std::int32_t>(random() % 30), 2 + static_cast<std::int32_t>(random() % 30));
        c.charts = ldi::testing::random_partition(c.topology, random);
        c.disparity = ldi::testing::random_disparity(c.topology, random);
        const ldi::textured_mesh m = mesh_of(c, random_placements(c, seed), small_options());
        std::map<std::pair<point, point>, int> edges;
        for (std::size_t h = 0; h < m.triangles.size(); ++h)
            ++edges[{bits(m, m.triangles[h]), bits(m, m.triangles[h % 3 == 2 ? h - 2 : h + 1])}];
        const auto on_border = [&](const point& p, std::size_t axis, float limit) {
            std::array<float, 3> position;
            std::memcpy(position.data(), p.data(), sizeof position);
            return std::abs(camera_of(c).project(position)[axis] - limit) < 1e-3F;
        };
        for (const auto& [directed, count] : edges) {
            const std::pair<point, point>& edge = directed;  // clang 14 cannot capture structured bindings
            REQUIRE(count == 1);
            if (edges.count({edge.second, edge.first}) == 1) {
                ++shared;
                continue;
            }
            const auto both = [&](std::size_t axis, std::int32_t limit) {
                return on_border(edge.first, axis, static_cast<float>(limit)) &&
                       on_border(edge.second, axis, static_cast<float>(limit));
            };
            REQUIRE((both(0, 0) || both(1, 0) || both(0, c.topology.width()) || both(1, c.topology.height())));
        }
    }
    REQUIRE(shared > 10000);
}

TEST_CASE("disparities out of range are clamped") {
    charted_graph c;
    c.topology = ldi::make_grid(8, 8);
    c.charts.chart_of.assign(c.topology.size(), 0);
    c.charts.charts.push_back({0, 0, 8, 8, {}});
    for (std::int32_t i = 0; i < 64; ++i) c.charts.charts.front().pixels.push_back(i);
    for (std::size_t i = 0; i < c.topology.size(); ++i) c.disparity.push_back(c.topology.x()[i] < 4 ? -0.5F : 1.5F);
    const ldi::textured_mesh m = mesh_of(c, {{0, 0}}, small_options());
    float nearest = 100, farthest = 0;
    for (std::size_t v = 0; v < m.vertex_count(); ++v) {
        nearest = std::min(nearest, -m.positions[3 * v + 2]), farthest = std::max(farthest, -m.positions[3 * v + 2]);
    }
    REQUIRE(nearest == Approx(2.0F));
    REQUIRE(farthest == Approx(20.0F / 0.9F));
}

#if LDI_HAS_EXCEPTIONS
TEST_CASE("a camera of the wrong size and a wrong number of placements are refused") {
    const charted_graph c = ldi::testing::random_charts(3, 20);
    ldi::buffer<ldi::chart_placement> placements = random_placements(c, 3);
    ldi::pinhole_camera camera = camera_of(c);
    const auto build = [&] {
        return ldi::build_mesh(layers_of(c), {camera, range, {}}, c.charts, atlas_of(placements), small_options());
    };
    REQUIRE_NOTHROW(build());
    camera.width += 1;
    REQUIRE_THROWS_AS(build(), ldi::error);
    camera.width -= 1;
    placements.emplace_back();
    REQUIRE_THROWS_AS(build(), ldi::error);
}

TEST_CASE(
    "invalid cameras, distances, motions and thresholds are refused, and so are an atlas without pixels and a chart outside the "
    "atlas") {
    const charted_graph c = ldi::testing::random_charts(3, 20);
    const ldi::photo_facts right{camera_of(c), range, {}};
    const ldi::texture_atlas right_atlas = atlas_of(random_placements(c, 3));
    const auto result_of = [&](const ldi::photo_facts& facts, const ldi::texture_atlas& atlas) {
        return ldi::testing::raised([&] { ldi::build_mesh(layers_of(c), facts, c.charts, atlas, small_options()); });
    };
    REQUIRE_FALSE(result_of(right, right_atlas));
    const float infinite = std::numeric_limits<float>::infinity(), nan = std::nanf("");
    for (const float focal_length : {0.0F, -30.0F, infinite, nan}) {
        ldi::photo_facts facts = right;
        facts.camera.focal_length = focal_length;
        CHECK(result_of(facts, right_atlas) == ldi::error_code::invalid_option);
    }
    for (const ldi::depth_range& r :
         {ldi::depth_range{0.0F, 1.0F}, {-1.0F, 1.0F}, {2.0F, 1.0F}, {1.0F, infinite}, {nan, 1.0F}, {1.0F, nan}}) {
        ldi::photo_facts facts = right;
        facts.range = r;
        CHECK(result_of(facts, right_atlas) == ldi::error_code::invalid_option);
    }
    for (const float wrong : {-0.1F, infinite, nan}) {
        ldi::photo_facts facts = right;
        facts.motion = wrong;
        CHECK(result_of(facts, right_atlas) == ldi::error_code::invalid_option);
    }
    for (const float wrong : {-1.0F, nan}) {
        ldi::photo_facts facts = right;
        facts.surface.max_step = wrong;
        CHECK(result_of(facts, right_atlas) == ldi::error_code::invalid_option);
    }
    ldi::texture_atlas empty = right_atlas;
    empty.color = {};
    CHECK(result_of(right, empty) == ldi::error_code::mismatch);
    for (const std::int32_t padding : {-1, 1025, 1 << 25}) {
        ldi::texture_atlas thick = right_atlas;
        thick.filter_padding = padding;
        CHECK(result_of(right, thick) == ldi::error_code::mismatch);
    }
    for (const ldi::chart_placement& outside : {ldi::chart_placement{-1, 0},
                                                {0, -1},
                                                {atlas_width, 0},
                                                {0, atlas_height},
                                                {std::numeric_limits<std::int32_t>::min(), 0}}) {
        ldi::texture_atlas torn = right_atlas;
        torn.placements[0] = outside;
        CHECK(result_of(right, torn) == ldi::error_code::mismatch);
    }

    ldi::photo_facts flat = right;
    flat.range = {2.0F, 2.0F};
    CHECK_FALSE(result_of(flat, right_atlas));
}

TEST_CASE("a chart whose bounding box has a side above 8192 is refused") {
    for (const std::int32_t width : {8192, 8193}) {
        charted_graph c;
        c.topology = ldi::make_grid(width, 1);
        c.charts.chart_of.assign(c.topology.size(), 0);
        c.charts.charts.push_back({0, 0, width, 1, {}});
        for (std::int32_t i = 0; i < width; ++i) c.charts.charts.front().pixels.push_back(i);
        c.disparity.assign(c.topology.size(), 0.5F);
        ldi::texture_atlas atlas = atlas_of({{0, 0}});
        atlas.color = ldi::image<std::uint8_t>(16, static_cast<std::size_t>(width), 3);
        const std::optional<ldi::error_code> code = ldi::testing::raised([&] {
            ldi::build_mesh(layers_of(c), ldi::photo_facts{camera_of(c), range, {}}, c.charts, atlas, small_options());
        });
        CHECK(code == (width > 8192 ? std::optional(ldi::error_code::too_large) : std::nullopt));
    }
}

TEST_CASE("all stages from charts to the mesh refuse a view of an invalid graph") {
    const ldi::graph sound = ldi::make_grid(8, 8);
    const ldi::buffer<std::uint8_t> color(3 * sound.size(), 100), known(sound.size(), 1);
    const ldi::buffer<float> disparity(sound.size(), 0.5F);
    const auto layers_on = [&](const ldi::graph_view& g) {
        return ldi::layered_view<ldi::color_column, ldi::disparity_column, ldi::known_column>(g, color, disparity, known);
    };
    const ldi::chart_set charts = ldi::make_charts(layers_on(sound), {});
    const ldi::chart_outlines outlines = ldi::trace_outlines(ldi::graph_view(sound), disparity, charts);
    const ldi::texture_atlas atlas = ldi::make_atlas(layers_on(sound), charts);
    const ldi::photo_facts facts{{8, 8, 30.0F}, range, {}};
    const ldi::textured_mesh mesh = ldi::build_mesh(layers_on(sound), facts, charts, atlas);
    const ldi::buffer<ldi::texel_kind> kinds(sound.size(), ldi::texel_kind::photo);
    ldi::image<std::uint8_t> texels(32, 32, 3);
    ldi::image<ldi::texel_kind> texel_kinds(32, 32, 1);
    ldi::testing::for_broken_views([&](const ldi::graph_view& view) {
        const auto layers = layers_on(view);
        const auto refuses = [](const char* stage, auto&& call) {
            CHECK_THAT(ldi::testing::message_of(call),
                       Catch::StartsWith(std::string(stage) + ": ") && Catch::Contains("violation"));
        };
        refuses("make_charts", [&] { ldi::make_charts(layers, {}); });
        refuses("trace_outlines", [&] { ldi::trace_outlines(view, disparity, charts); });
        refuses("make_studs", [&] { ldi::make_studs(layers, range, charts, outlines); });
        refuses("make_atlas", [&] { ldi::make_atlas(layers, charts); });
        refuses("chart_padder", [&] { ldi::chart_padder(view, color, kinds, texels, texel_kinds); });
        refuses("build_mesh", [&] { ldi::build_mesh(layers, facts, charts, atlas); });
        refuses("gather", [&] { ldi::gather<ldi::disparity_column>(mesh, layers, facts.camera); });
    });
}
#endif
