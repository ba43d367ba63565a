#include "tests/support/errors.hpp"
#include "tests/support/files.hpp"
#include "tests/texture/photo_scene.hpp"

#include <ldi/charts/charts.hpp>
#include <ldi/texture/atlas.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cstdio>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace ldi;
using namespace ldi::testing;

bool is_own(texel_kind k) { return k == texel_kind::photo || k == texel_kind::refilled || k == texel_kind::occluded; }

void check_atlas(const photo_layers& layers, const chart_set& charts, const texture_atlas& atlas, const atlas_options& options) {
    const graph& g = layers.topology();
    const std::size_t rows = atlas.kind.height(), columns = atlas.kind.width();
    REQUIRE(atlas.color.height() == rows);
    REQUIRE(atlas.color.width() == columns);
    REQUIRE(atlas.placements.size() == charts.charts.size());
    CHECK(rows % 16 == 0);
    CHECK(columns % 16 == 0);
    CHECK(rows <= static_cast<std::size_t>(options.max_side));
    CHECK(columns <= static_cast<std::size_t>(options.max_side));

    // Each block belongs to at most one chart, and each chart has room for its padding.
    const std::int32_t padding = options.padding.filter_padding;
    buffer<std::int32_t> owner(rows / 16 * (columns / 16), -1);
    bool disjoint = true;
    for (std::size_t c = 0; c < charts.charts.size(); ++c) {
        const chart& here = charts.charts[c];
        const chart_placement p = atlas.placements[c];
        REQUIRE(p.x >= padding);
        REQUIRE(p.y >= padding);
        REQUIRE(static_cast<std::size_t>(p.x + here.width + padding) <= columns);
        REQUIRE(static_cast<std::size_t>(p.y + here.height + padding) <= rows);
        for (std::int32_t y = (p.y - padding) / 16; y <= (p.y + here.height + padding - 1) / 16; ++y)
            for (std::int32_t x = (p.x - padding) / 16; x <= (p.x + here.width + padding - 1) / 16; ++x) {
                std::int32_t& block = owner[static_cast<std::size_t>(y) * (columns / 16) + static_cast<std::size_t>(x)];
                disjoint = disjoint && block == -1;
                block = static_cast<std::int32_t>(c);
            }
    }
    CHECK(disjoint);

    // Every pixel is at its texel, and no other texel is marked as a pixel.
    buffer<float> front(static_cast<std::size_t>(g.width()) * static_cast<std::size_t>(g.height()), -1.0F);
    const auto lattice = [&](std::size_t i) {
        return static_cast<std::size_t>(g.y()[i]) * static_cast<std::size_t>(g.width()) + static_cast<std::size_t>(g.x()[i]);
    };
    for (std::size_t i = 0; i < g.size(); ++i)
        front[lattice(i)] = std::max(front[lattice(i)], layers.column<disparity_column>()[i]);
    bool colors = true, kinds = true;
    for (std::size_t i = 0; i < g.size(); ++i) {
        const std::size_t c = static_cast<std::size_t>(charts.chart_of[i]);
        const std::size_t x = static_cast<std::size_t>(g.x()[i] - charts.charts[c].x + atlas.placements[c].x);
        const std::size_t y = static_cast<std::size_t>(g.y()[i] - charts.charts[c].y + atlas.placements[c].y);
        for (std::size_t k = 0; k < 3; ++k) colors = colors && atlas.color(y, x, k) == layers.column<color_column>()[3 * i + k];
        const texel_kind expected = layers.column<known_column>()[i] != 0                      ? texel_kind::photo
                                    : layers.column<disparity_column>()[i] < front[lattice(i)] ? texel_kind::occluded
                                                                                               : texel_kind::refilled;
        kinds = kinds && atlas.kind(y, x, 0) == expected;
    }
    CHECK(colors);
    CHECK(kinds);
    CHECK(std::count_if(atlas.kind.data(), atlas.kind.data() + atlas.kind.size(), is_own) ==
          static_cast<std::ptrdiff_t>(g.size()));
    if (rows * columns > 0) CHECK(atlas.fill == Approx(static_cast<double>(g.size()) / static_cast<double>(rows * columns)));

    bool gray = true;
    for (std::size_t i = 0; i < atlas.kind.size(); ++i)
        if (atlas.kind.data()[i] == texel_kind::empty)
            for (std::size_t k = 0; k < 3; ++k) gray = gray && atlas.color.data()[3 * i + k] == 128;
    CHECK(gray);
}

void check_threads(const photo_layers& layers, const chart_set& charts, const texture_atlas& serial) {
    thread_pool pool(3);
    const texture_atlas parallel = make_atlas(layers, charts, {}, pool);
    CHECK(parallel.color == serial.color);
    CHECK(parallel.kind == serial.kind);
}

}  // namespace

TEST_CASE("atlases of random charts contain every pixel once, and no block is shared by two charts") {
    std::mt19937 random(1);
    for (int i = 0; i < 200; ++i) {
        const photo_layers layers = random_photo_layers(random, 60);
        atlas_options options;
        options.padding.filter_padding = 1 + below(random, 6);
        chart_options cut;
        cut.max_side = 16 + below(random, 60);
        const chart_set charts = make_charts(layers, {}, cut);
        check_atlas(layers, charts, make_atlas(layers, charts, options), options);
    }
}

TEST_CASE("charts with two pixels at one position are refused, and all other charts are accepted") {
    std::mt19937 random(4);
    int refused = 0, accepted = 0;
    for (int i = 0; i < 300; ++i) {
        const photo_layers layers = random_photo_layers(random, 12);
        const graph& g = layers.topology();
        chart_set charts;
        charts.charts.resize(static_cast<std::size_t>(1 + below(random, 40)));
        for (chart& c : charts.charts) c.width = g.width(), c.height = g.height();
        buffer<std::uint8_t> taken(charts.charts.size() * g.position_count());
        bool overlaps = false;
        for (std::int32_t pixel = 0; pixel < g.count(); ++pixel) {
            const std::int32_t c = below(random, charts.charts.count());
            charts.chart_of.push_back(c);
            charts.charts[c].pixels.push_back(pixel);
            std::uint8_t& there = taken[static_cast<std::size_t>(c) * g.position_count() + g.position_of(pixel)];
            overlaps = overlaps || there != 0;
            there = 1;
        }
        const std::string message = message_of([&] { make_atlas(layers, charts); });
        REQUIRE((message == "nothing raised") != overlaps);
        REQUIRE((message.find("at most one pixel per position") != std::string::npos) == overlaps);
        ++(overlaps ? refused : accepted);
    }
    CHECK(refused > 20);
    CHECK(accepted > 20);
}

TEST_CASE("atlases of scenes with hidden surfaces are valid, and equal on any number of threads") {
    std::mt19937 random(2);
    for (int i = 0; i < 6; ++i) {
        const photo_layers layers = random_scene(random, 130, 150);
        const chart_set charts = make_charts(layers, {});
        const texture_atlas atlas = make_atlas(layers, charts);
        check_atlas(layers, charts, atlas, {});
        check_threads(layers, charts, atlas);
    }
}

TEST_CASE("atlases of real photos are valid, and equal on any number of threads") {
    for (const char* name : {"mb_reindeer", "iphone_a"}) {
        const std::optional<photo_layers> layers = shared_photo(name);
        if (!layers) {
            std::printf("skipped: no %s in %s/rgbd\n", name, LDI_SHARED_DIR);
            continue;
        }
        INFO(name);
        const chart_set charts = make_charts(*layers, {});
        const texture_atlas atlas = make_atlas(*layers, charts);
        check_atlas(*layers, charts, atlas, {});
        check_threads(*layers, charts, atlas);
        CHECK(atlas.fill > 0.25F);  // noisy depth produces many small hidden surfaces
    }
}

TEST_CASE("an inpainted pixel is occluded only if a nearer pixel is at its position, even at negative disparities") {
    for (const float disparity : {-1.0F, -0.05F, 0.0F, 0.5F}) {
        photo_layers layers(make_grid(20, 20));
        for (float& d : layers.column<disparity_column>()) d = disparity;
        for (std::int32_t i = 0; i < 400; ++i) layers.column<known_column>()[i] = i == 7 ? 0 : 1;
        const auto kind_of = [](const photo_layers& of, std::int32_t pixel) {
            const chart_set charts = make_charts(of, {});
            const texture_atlas atlas = make_atlas(of, charts);
            const chart_placement p = atlas.placements[charts.chart_of[pixel]];
            const chart& c = charts.charts[charts.chart_of[pixel]];
            return atlas.kind(p.y + of.topology().y()[pixel] - c.y, p.x + of.topology().x()[pixel] - c.x);
        };
        CHECK(kind_of(layers, 7) == texel_kind::refilled);
        CHECK(kind_of(layers, 8) == texel_kind::photo);

        graph_builder two(1, 1);
        two.add_pixel(0, 0), two.add_pixel(0, 0);
        photo_layers behind(std::move(two).build());
        behind.column<disparity_column>()[0] = disparity, behind.column<disparity_column>()[1] = disparity - 0.1F;
        CHECK(kind_of(behind, 0) == texel_kind::refilled);
        CHECK(kind_of(behind, 1) == texel_kind::occluded);
    }
}

TEST_CASE("an image without pixels has an empty atlas") {
    const texture_atlas atlas = make_atlas(photo_layers(), chart_set());
    CHECK(atlas.color.size() == 0);
    CHECK(atlas.placements.empty());
}

TEST_CASE("an atlas whose maximum size cannot hold all charts, and a padding outside its range, are refused") {
    const photo_layers layers(make_grid(100, 100));
    const chart_set charts = make_charts(layers, {});
    atlas_options options;
    options.max_side = 112;
    CHECK(make_atlas(layers, charts, options).color.height() == 112);
    options.max_side = 111;
    const std::string message = message_of([&] { make_atlas(layers, charts, options); });
    CHECK(message.find("atlas of 111 x 111 texels") != std::string::npos);
    CHECK(message.find("1 charts of 12544 texels") != std::string::npos);
    CHECK(message.find("a lower photo3d --geometry-size,") != std::string::npos);
    options = {};
    for (const std::int32_t padding : {-1, 0, 1025, 1 << 29, 1 << 30, 0x7FFFFFFF}) {
        options.padding.filter_padding = padding;
        CHECK_THROWS_AS(make_atlas(layers, charts, options), error);
    }
    options = {};
    for (const std::int32_t side : {-8192, -1, 0, 15}) {
        options.max_side = side;
        CHECK(raised([&] { make_atlas(layers, charts, options); }) == error_code::invalid_option);
    }
    options = {};
    options.padding.diffusion_rounds = -1;
    CHECK(raised([&] { make_atlas(layers, charts, options); }) == error_code::invalid_option);
    options = {};
    options.padding.filter_padding = 9;
    CHECK(make_atlas(layers, charts, options).filter_padding == 9);
}
