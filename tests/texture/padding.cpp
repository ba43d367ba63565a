#include "tests/support/sketched_graph.hpp"
#include "tests/texture/photo_scene.hpp"

#include <ldi/charts/charts.hpp>
#include <ldi/texture/padding.hpp>

#include <catch2/catch.hpp>
#include <tests/support/errors.hpp>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <utility>
#include <vector>

namespace {

using namespace ldi;
using namespace ldi::testing;

using rgb = std::array<std::uint8_t, 3>;

/// One chart, drawn alone in its own atlas.
struct drawing {
    image<std::uint8_t> color;
    image<texel_kind> kind;
    chart_placement placement;

    rgb at(std::int32_t x, std::int32_t y) const {
        const std::size_t u = static_cast<std::size_t>(x), v = static_cast<std::size_t>(y);
        return {color(v, u, 0), color(v, u, 1), color(v, u, 2)};
    }
    texel_kind kind_at(std::int32_t x, std::int32_t y) const {
        return kind(static_cast<std::size_t>(y), static_cast<std::size_t>(x), 0);
    }
    std::int32_t columns() const { return static_cast<std::int32_t>(kind.width()); }
    std::int32_t rows() const { return static_cast<std::int32_t>(kind.height()); }
};

rgb color_of(const photo_layers& layers, std::int32_t pixel) {
    const auto c = layers.at<color_column>(pixel);
    return {c[0], c[1], c[2]};
}

drawing draw(const photo_layers& layers, const chart& c, const padding_options& options = {}) {
    const auto blocks = [&](std::int32_t length) { return (length + 2 * options.filter_padding + 15) / 16 * 16; };
    const std::int32_t columns = blocks(c.width), rows = blocks(c.height);
    drawing d{image<std::uint8_t>(static_cast<std::size_t>(rows), static_cast<std::size_t>(columns), 3, std::uint8_t{77}),
              image<texel_kind>(static_cast<std::size_t>(rows), static_cast<std::size_t>(columns), 1, texel_kind::empty),
              {options.filter_padding, options.filter_padding}};
    const std::vector<texel_kind> kinds(layers.size(), texel_kind::photo);
    chart_padder padder(layers.topology(), layers.column<color_column>(), kinds, d.color, d.kind);
    padder.draw(c, d.placement, {0, 0, columns, rows}, options);
    return d;
}

/// Two adjacent sheets, 20 x 20 each, linked or not, the left one dark and the right one light, one chart each.
std::pair<photo_layers, chart_set> two_sheets(bool linked) {
    testing::sketched_graph g(make_grid(40, 20));
    if (!linked)
        for (std::int32_t y = 0; y < 20; ++y) g.unlink(y * 40 + 19, side::right);
    photo_layers layers(std::move(g).build());
    chart_set set;
    set.charts = {{0, 0, 20, 20, {}}, {20, 0, 20, 20, {}}};
    for (std::int32_t i = 0; i < 800; ++i) {
        const std::int32_t x = i % 40, y = i / 40, c = x < 20 ? 0 : 1;
        set.chart_of.push_back(c);
        set.charts[static_cast<std::size_t>(c)].pixels.push_back(i);
        const auto color = layers.at<color_column>(i);
        color[0] = static_cast<std::uint8_t>(c == 0 ? 10 + x : 200 + x),
        color[1] = static_cast<std::uint8_t>(c == 0 ? 10 + y : 200 + y);
        color[2] = 128;
    }
    return {std::move(layers), std::move(set)};
}

bool is_own_texel(texel_kind k) { return k == texel_kind::photo || k == texel_kind::refilled || k == texel_kind::occluded; }

}  // namespace

TEST_CASE("padding is copied from the neighboring chart if the surface continues there") {
    const auto [layers, set] = two_sheets(true);
    const drawing d = draw(layers, set.charts[0]);
    for (std::int32_t y = 0; y < 20; ++y)
        for (std::int32_t x = 20; x < 24; ++x) {
            CHECK(d.kind_at(4 + x, 4 + y) == texel_kind::copied);
            CHECK(d.at(4 + x, 4 + y) == color_of(layers, y * 40 + x));
        }
}

TEST_CASE("padding is diffused from the chart itself if the surface ends") {
    const auto [layers, set] = two_sheets(false);
    const drawing d = draw(layers, set.charts[0]);
    for (std::int32_t y = 0; y < d.rows(); ++y)
        for (std::int32_t x = 0; x < d.columns(); ++x) {
            CHECK(d.kind_at(x, y) != texel_kind::copied);
            CHECK(d.kind_at(x, y) != texel_kind::empty);  // 28 x 28 texels touch all four blocks
            CHECK(d.at(x, y)[0] >= 10);
            CHECK(d.at(x, y)[0] <= 29);
            CHECK(d.at(x, y)[1] >= 10);
            CHECK(d.at(x, y)[1] <= 29);
            CHECK(d.at(x, y)[2] == 128);
        }
    for (std::int32_t k = 1; k <= 4; ++k) CHECK(d.kind_at(4 + 19 + k, 10) == texel_kind::diffused);
    CHECK(d.kind_at(4 + 19 + 5, 10) == texel_kind::macroblock);
}

TEST_CASE("diffusion continues a linear ramp without a step") {
    const auto [layers, set] = two_sheets(false);
    const drawing d = draw(layers, set.charts[0]);
    int largest = 0;
    for (std::int32_t y = 0; y + 1 < d.rows(); ++y)
        for (std::int32_t x = 0; x + 1 < d.columns(); ++x)
            for (std::size_t c = 0; c < 3; ++c) {
                largest = std::max(largest, std::abs(int{d.at(x, y)[c]} - int{d.at(x + 1, y)[c]}));
                largest = std::max(largest, std::abs(int{d.at(x, y)[c]} - int{d.at(x, y + 1)[c]}));
            }
    CHECK(largest <= 1);
}

TEST_CASE("additional iterations of diffusion hardly change the padding") {
    std::mt19937 random(5);
    const photo_layers layers = random_scene(random, 90, 110);
    const chart_set set = make_charts(layers, {});
    const auto largest = std::max_element(set.charts.begin(), set.charts.end(),
                                          [](const chart& a, const chart& b) { return a.pixels.size() < b.pixels.size(); });
    padding_options thorough;
    thorough.diffusion_rounds = 400;
    const drawing quick = draw(layers, *largest), exact = draw(layers, *largest, thorough);
    double difference = 0, contrast = 0, unknown = 0;
    for (std::size_t i = 0; i < quick.kind.size(); ++i) {
        const texel_kind k = quick.kind.data()[i];
        if (k != texel_kind::diffused && k != texel_kind::macroblock) continue;
        ++unknown;
        for (std::size_t c = 0; c < 3; ++c) {
            difference += std::abs(int{quick.color.data()[3 * i + c]} - int{exact.color.data()[3 * i + c]});
            contrast += std::abs(int{exact.color.data()[3 * i + c]} - 128);
        }
    }
    REQUIRE(unknown > 0);
    CHECK(difference / unknown / 3 < 3.0);  // gray levels; the photo is noise over the whole range
    CHECK(contrast / unknown / 3 > 6.0);
}

TEST_CASE("padding of random charts copies linked pixels or stays within the range of the chart's own and copied colors") {
    std::mt19937 random(6);
    for (int i = 0; i < 150; ++i) {
        const photo_layers layers = random_photo_layers(random, 40);
        const graph& g = layers.topology();
        padding_options options;
        options.filter_padding = 1 + below(random, 6);
        const chart_set set = make_charts(layers, {});
        for (const chart& c : set.charts) {
            const drawing d = draw(layers, c, options);
            // All colors that links of the chart reach, by texel.
            std::map<std::pair<std::int32_t, std::int32_t>, std::set<rgb>> reached;
            std::set<std::int32_t> seen(c.pixels.begin(), c.pixels.end());
            buffer<std::int32_t> wave;
            for (const std::int32_t pixel : c.pixels) wave.push_back(pixel);
            for (std::int32_t step = 0; step < options.filter_padding; ++step) {
                buffer<std::int32_t> next;
                for (std::int32_t pixel : wave)
                    for (side s : all_sides) {
                        const std::int32_t other = g.neighbor(pixel, s);
                        if (other == no_pixel || !seen.insert(other).second) continue;
                        const std::size_t o = static_cast<std::size_t>(other);
                        reached[{g.x()[o] - c.x + d.placement.x, g.y()[o] - c.y + d.placement.y}].insert(color_of(layers, other));
                        next.push_back(other);
                    }
                wave = next;
            }
            std::size_t own = 0;
            rgb lowest{255, 255, 255}, highest{0, 0, 0};
            bool copies_right = true;
            for (std::int32_t y = 0; y < d.rows(); ++y)
                for (std::int32_t x = 0; x < d.columns(); ++x) {
                    const texel_kind k = d.kind_at(x, y);
                    own += is_own_texel(k);
                    if (k == texel_kind::copied) copies_right = copies_right && reached[{x, y}].count(d.at(x, y)) == 1;
                    if (!is_own_texel(k) && k != texel_kind::copied) continue;
                    for (std::size_t channel = 0; channel < 3; ++channel) {
                        lowest[channel] = std::min(lowest[channel], d.at(x, y)[channel]);
                        highest[channel] = std::max(highest[channel], d.at(x, y)[channel]);
                    }
                }
            CHECK(own == c.pixels.size());
            CHECK(copies_right);
            bool within = true, blocks_filled = true, padded = true, empty_untouched = true;
            for (std::int32_t y = 0; y < d.rows(); ++y)
                for (std::int32_t x = 0; x < d.columns(); ++x) {
                    const texel_kind k = d.kind_at(x, y);
                    for (std::size_t channel = 0; channel < 3; ++channel)
                        if (k == texel_kind::diffused || k == texel_kind::macroblock)
                            within = within && d.at(x, y)[channel] >= lowest[channel] && d.at(x, y)[channel] <= highest[channel];
                    blocks_filled =
                        blocks_filled && (k == texel_kind::empty) == (d.kind_at(x / 16 * 16, y / 16 * 16) == texel_kind::empty);
                    if (k == texel_kind::empty) empty_untouched = empty_untouched && d.at(x, y) == rgb{77, 77, 77};
                    if (!is_own_texel(k)) continue;
                    for (side s : all_sides)
                        for (std::int32_t step = 1; step <= options.filter_padding; ++step) {
                            const texel_kind beside = d.kind_at(x + step * step_x(s), y + step * step_y(s));
                            padded = padded && beside != texel_kind::empty && beside != texel_kind::macroblock;
                        }
                }
            CHECK(within);
            CHECK(blocks_filled);
            CHECK(padded);
            CHECK(empty_untouched);
        }
    }
}

TEST_CASE(
    "a chart is drawn only if its blocks lie inside the atlas and include its padding, and its bounding box contains its "
    "pixels") {
    const auto [layers, set] = two_sheets(true);
    const std::vector<texel_kind> kinds(layers.size(), texel_kind::photo);
    image<std::uint8_t> color(64, 96, 3, std::uint8_t{77});
    image<texel_kind> kind(64, 96, 1, texel_kind::empty);
    const auto result_of = [&, &of = layers](const chart& c, chart_placement placement, atlas_rectangle room,
                                             std::int32_t padding = 4) {
        chart_padder padder(of.topology(), of.column<color_column>(), kinds, color, kind);
        return testing::raised([&] { padder.draw(c, placement, room, {padding, 0}); });
    };
    const chart sound = set.charts[0];
    CHECK_FALSE(result_of(sound, {52, 20}, {48, 16, 32, 32}));
    for (const auto& [placement, room] : {std::pair<chart_placement, atlas_rectangle>{{51, 20}, {48, 16, 32, 32}},
                                          {{52, 25}, {48, 16, 32, 32}},
                                          {{4, 4}, {0, 0, 32, 31}},
                                          {{4, 4}, {-16, 0, 48, 32}},
                                          {{4, 4}, {1, 0, 32, 32}},
                                          {{68, 4}, {64, 0, 48, 32}},
                                          {{0, 0}, {0, 0, 16, 16}}})
        CHECK(result_of(sound, placement, room) == error_code::mismatch);
    CHECK(result_of(sound, {4, 4}, {0, 0, 32, 32}, 0) == error_code::mismatch);
    for (const std::int32_t pixel : {sound.pixels.back() + 1, 799, 800, INT32_MAX - 1}) {
        chart wrong = sound;
        wrong.pixels.push_back(pixel);
        CHECK(result_of(wrong, {4, 4}, {0, 0, 32, 32}) == error_code::mismatch);
    }
    const std::vector<texel_kind> few(layers.size() - 1, texel_kind::photo);
    CHECK(testing::raised([&, &of = layers] { chart_padder(of.topology(), of.column<color_column>(), few, color, kind); }) ==
          error_code::mismatch);
}
