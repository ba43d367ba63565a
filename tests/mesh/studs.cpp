#include <ldi/mesh/studs.hpp>

#include <catch2/catch.hpp>
#include <tests/mesh/random_charts.hpp>
#include <tests/support/surfaces.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <set>

namespace {

ldi::stud_options options_with(std::int32_t spacing, float disparity_tolerance, std::int32_t clearance) {
    ldi::stud_options options;
    options.spacing = spacing, options.disparity_tolerance = disparity_tolerance, options.clearance = clearance;
    return options;
}

ldi::chart_set whole(const ldi::graph_view& g) {
    ldi::chart_set charts;
    charts.chart_of.assign(g.size(), 0);
    charts.charts.push_back({0, 0, g.width(), g.height(), {}});
    for (std::size_t i = 0; i < g.size(); ++i) charts.charts[0].pixels.push_back(static_cast<std::int32_t>(i));
    return charts;
}

// Makes studs (vertical polylines of vertices inside a chart) with unlimited texture tolerance, so that only disparity decides.
ldi::stud_set studs_of(const ldi::graph_view& g, ldi::array_view<const float> disparity, const ldi::chart_set& charts,
                       ldi::stud_options options) {
    options.texture_tolerance = 1000.0F;
    return ldi::make_studs(ldi::testing::surfaces_of(g, disparity), {}, charts, ldi::trace_outlines(g, disparity, charts),
                           options);
}

}  // namespace

TEST_CASE("a plane has no stud vertices if its texture may shift without limit") {
    const ldi::graph g = ldi::make_grid(100, 80);
    ldi::buffer<float> disparity(g.size());
    for (std::size_t i = 0; i < g.size(); ++i)
        disparity[i] = 0.1F + 0.004F * static_cast<float>(g.x()[i]) + 0.005F * static_cast<float>(g.y()[i]);
    REQUIRE(studs_of(g, disparity, whole(g), {}).vertices.empty());
}

TEST_CASE("on a slanted plane, stud vertices are close enough that the texture shifts by at most the tolerance") {
    const ldi::graph g = ldi::make_grid(200, 300);
    ldi::buffer<float> disparity(g.size());
    for (std::size_t i = 0; i < g.size(); ++i) disparity[i] = 0.003F * static_cast<float>(g.y()[i]);
    const ldi::chart_set charts = whole(g);
    const ldi::depth_range range;
    const ldi::stud_set studs =
        ldi::make_studs(ldi::testing::surfaces_of(g, disparity), {}, charts, ldi::trace_outlines(g, disparity, charts));
    REQUIRE(studs.vertices.size() > 50);
    for (std::size_t s = 0; s + 1 < studs.first_vertex.size(); ++s)
        for (std::int32_t v = studs.first_vertex[s]; v + 1 < studs.first_vertex[s + 1]; ++v) {
            const ldi::outline_corner &a = studs.vertices[static_cast<std::size_t>(v)],
                                      &b = studs.vertices[static_cast<std::size_t>(v) + 1];
            REQUIRE((b.y - a.y < 8 || range.texture_shift(static_cast<float>(b.y - a.y), a.disparity, b.disparity) <= 0.5F));
        }
}

TEST_CASE("studs are closer to each other where disparity is wavy, except if the waves are as short as eight pixels") {
    const auto stud_columns = [](float amplitude, float wavelength) {
        const ldi::graph g = ldi::make_grid(200, 80);
        ldi::buffer<float> disparity(g.size());
        for (std::size_t i = 0; i < g.size(); ++i)  // each stud has a vertex where disparity bends in row 33
            disparity[i] = 0.1F + 0.002F * static_cast<float>(std::min<std::int32_t>(g.y()[i], 33)) +
                           amplitude * std::sin(6.2831853F / wavelength * static_cast<float>(g.x()[i]));
        const ldi::chart_set charts = whole(g);
        const ldi::stud_set studs = ldi::make_studs(ldi::testing::surfaces_of(g, disparity), {}, charts,
                                                    ldi::trace_outlines(g, disparity, charts), options_with(24, 0.012F, 4));
        std::set<std::int32_t> columns;
        for (const ldi::outline_corner& v : studs.vertices) columns.insert(v.x);
        return columns.size();
    };
    const std::size_t flat = stud_columns(0.0F, 8.0F);
    CHECK(flat == 7);
    CHECK(stud_columns(0.005F, 8.0F) == flat);
    CHECK(stud_columns(0.005F, 16.0F) > flat);
}

TEST_CASE("studs are evenly spaced and have a vertex where disparity bends") {
    const ldi::graph g = ldi::make_grid(120, 80);
    ldi::buffer<float> disparity(g.size());
    for (std::size_t i = 0; i < g.size(); ++i) disparity[i] = 0.01F * static_cast<float>(std::min<std::int32_t>(g.y()[i], 33));
    const ldi::stud_set studs = studs_of(g, disparity, whole(g), options_with(24, 0.006F, 4));
    REQUIRE(studs.first_stud == ldi::buffer<std::int32_t>{0, 4});
    for (std::size_t s = 0; s < 4; ++s) {
        REQUIRE(studs.vertices[s].x == 24 * static_cast<std::int32_t>(s + 1));
        REQUIRE(std::abs(studs.vertices[s].y - 33) <= 1);
        REQUIRE(std::abs(studs.vertices[s].disparity - 0.33F) < 0.011F);
    }
}

TEST_CASE("an upright object narrower than the stud spacing has vertices at its sides") {
    const ldi::graph g = ldi::make_grid(120, 100);
    ldi::buffer<float> disparity(g.size());
    for (std::size_t i = 0; i < g.size(); ++i) disparity[i] = std::abs(g.x()[i] - 60) < 4 ? 0.5F : 0.46F;
    const ldi::stud_set studs = studs_of(g, disparity, whole(g), options_with(24, 0.006F, 4));
    REQUIRE(studs.vertices.size() >= 6);
    bool left = false, right = false;
    for (const ldi::outline_corner& v : studs.vertices) {
        left |= 54 <= v.x && v.x <= 58;
        right |= 62 <= v.x && v.x <= 66;
    }
    REQUIRE(left);
    REQUIRE(right);
}

TEST_CASE("between the vertices of a stud, the disparity profile is linear to within the tolerance") {
    std::mt19937 random(5);
    ldi::detail::bend_finder find_bends;
    for (int i = 0; i < 500; ++i) {
        ldi::buffer<float> profile(2 + random() % 60);
        float value = 0.5F;
        for (float& p : profile) p = value += 0.01F * (static_cast<float>(random() % 200) / 100.0F - 1.0F);
        ldi::buffer<std::int32_t> kept{0};
        const auto never = [](std::int32_t, std::int32_t) { return false; };
        find_bends(profile, 0.008F, 0, never, [&](std::int32_t k) { kept.push_back(k); });
        kept.push_back(profile.count() - 1);
        for (std::size_t k = 0; k + 1 < kept.size(); ++k) {
            REQUIRE(kept[k] < kept[k + 1]);
            for (std::int32_t j = kept[k]; j <= kept[k + 1]; ++j) {
                const float t = static_cast<float>(j - kept[k]) / static_cast<float>(kept[k + 1] - kept[k]);
                REQUIRE(std::abs(profile[j] - std::lerp(profile[kept[k]], profile[kept[k + 1]], t)) < 0.00801F);
            }
        }
    }
}

TEST_CASE("all pixels within the clearance of a stud's vertex belong to its chart and are linked") {
    std::size_t vertices = 0;
    for (std::uint32_t seed = 0; seed < 600; ++seed) {
        const ldi::testing::charted_graph c = ldi::testing::random_charts(seed, 40);
        const ldi::stud_options options =
            options_with(1 + static_cast<std::int32_t>(seed % 8), 0.0F, 1 + static_cast<std::int32_t>(seed % 2));
        const ldi::graph& g = c.topology;
        const ldi::stud_set studs = studs_of(g, c.disparity, c.charts, options);
        REQUIRE(studs.first_stud.size() == c.charts.charts.size() + 1);
        REQUIRE(studs.first_vertex.size() == static_cast<std::size_t>(studs.first_stud.back()) + 1);
        for (std::size_t chart = 0; chart < c.charts.charts.size(); ++chart) {
            ldi::buffer<std::int32_t> at(static_cast<std::size_t>(g.width()) * static_cast<std::size_t>(g.height()),
                                         ldi::no_pixel);
            for (std::int32_t pixel : c.charts.charts[chart].pixels) {
                const std::size_t i = static_cast<std::size_t>(pixel);
                at[static_cast<std::size_t>(g.y()[i] * g.width() + g.x()[i])] = pixel;
            }
            std::set<std::pair<std::int32_t, std::int32_t>> places;
            for (std::int32_t s = studs.first_stud[chart]; s < studs.first_stud[chart + 1]; ++s) {
                const std::int32_t first = studs.first_vertex[static_cast<std::size_t>(s)];
                const std::int32_t last = studs.first_vertex[static_cast<std::size_t>(s) + 1];
                REQUIRE(first < last);
                for (std::int32_t k = first; k < last; ++k) {
                    const ldi::outline_corner v = studs.vertices[static_cast<std::size_t>(k)];
                    ++vertices;
                    REQUIRE(places.emplace(v.x, v.y).second);
                    if (k > first) {
                        REQUIRE(v.x == studs.vertices[static_cast<std::size_t>(k) - 1].x);
                        REQUIRE(v.y > studs.vertices[static_cast<std::size_t>(k) - 1].y);
                    }
                    REQUIRE(v.x - options.clearance >= 0);
                    REQUIRE(v.x + options.clearance <= g.width());
                    REQUIRE(v.y - options.clearance >= 0);
                    REQUIRE(v.y + options.clearance <= g.height());
                    double sum = 0;
                    for (std::int32_t y = v.y - options.clearance; y < v.y + options.clearance; ++y)
                        for (std::int32_t x = v.x - options.clearance; x < v.x + options.clearance; ++x) {
                            const std::int32_t pixel = at[static_cast<std::size_t>(y * g.width() + x)];
                            REQUIRE(pixel != ldi::no_pixel);
                            const std::size_t i = static_cast<std::size_t>(pixel);
                            if (x + 1 < v.x + options.clearance)
                                REQUIRE(g.right()[i] == at[static_cast<std::size_t>(y * g.width() + x + 1)]);
                            if (y + 1 < v.y + options.clearance)
                                REQUIRE(g.down()[i] == at[static_cast<std::size_t>((y + 1) * g.width() + x)]);
                            if ((x == v.x || x == v.x - 1) && (y == v.y || y == v.y - 1))
                                sum += static_cast<double>(c.disparity[i]);
                        }
                    REQUIRE(static_cast<double>(v.disparity) == Approx(sum / 4).margin(1e-5));
                }
            }
        }
    }
    REQUIRE(vertices > 2000);
}

#if LDI_HAS_EXCEPTIONS
TEST_CASE("charts and outlines of another image or of other charts are refused") {
    const ldi::graph g = ldi::make_grid(200, 200), small = ldi::make_grid(50, 50);
    const ldi::buffer<float> disparity(g.size(), 0.5F), few(small.size(), 0.5F);
    ldi::chart_set halves;
    halves.charts = {{0, 0, 200, 100, {}}, {0, 100, 200, 100, {}}};
    for (std::int32_t i = 0; i < 40000; ++i) {
        halves.chart_of.push_back(i / 20000);
        halves.charts[static_cast<std::size_t>(i / 20000)].pixels.push_back(i);
    }
    const ldi::chart_outlines outlines = ldi::trace_outlines(g, disparity, whole(g));
    const auto make = [&](const ldi::chart_set& charts, const ldi::chart_outlines& o) {
        return ldi::make_studs(ldi::testing::surfaces_of(g, disparity), {}, charts, o);
    };
    REQUIRE_NOTHROW(make(whole(g), outlines));
    REQUIRE_THROWS_AS(make(whole(small), outlines), ldi::error);
    REQUIRE_THROWS_AS(make(halves, outlines), ldi::error);
    REQUIRE_THROWS_AS(make(whole(g), ldi::trace_outlines(small, few, whole(small))), ldi::error);
    const ldi::graph wide = ldi::make_grid(ldi::max_chart_box + 1, 2);
    const ldi::buffer<float> flat(wide.size(), 0.5F);
    REQUIRE_THROWS_WITH(
        ldi::make_studs(ldi::testing::surfaces_of(wide, flat), {}, whole(wide), ldi::trace_outlines(wide, flat, whole(wide))),
        Catch::Contains("8192"));
}

TEST_CASE("stud options outside their range are refused") {
    const ldi::graph g = ldi::make_grid(4, 4);
    const ldi::buffer<float> disparity(g.size(), 0.0F);
    REQUIRE_THROWS_AS(studs_of(g, disparity, whole(g), options_with(0, 0.006F, 4)), ldi::error);
    REQUIRE_THROWS_AS(studs_of(g, disparity, whole(g), options_with(24, -1.0F, 4)), ldi::error);
    REQUIRE_THROWS_AS(studs_of(g, disparity, whole(g), options_with(24, 0.006F, 0)), ldi::error);
    REQUIRE_THROWS_AS(studs_of(g, disparity, whole(g), options_with(24, 0.006F, 65)), ldi::error);
}
#endif
