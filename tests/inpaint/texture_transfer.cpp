#include "tests/support/random_graph.hpp"

#include <ldi/base/executor.hpp>
#include <ldi/core/components.hpp>
#include <ldi/inpaint/texture_transfer.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <tuple>
#include <utility>
#include <vector>

using namespace ldi;

namespace {

using rgb = std::array<int, 3>;

constexpr std::int32_t columns = 120, rows = 80;

bool in_hole(std::int32_t x) { return x >= 40 && x < 80; }

void set_color(photo_layers& layers, std::int32_t pixel, const rgb& color) {
    for (std::size_t c = 0; c < 3; ++c)
        layers.at<color_column>(pixel)[c] = static_cast<std::uint8_t>(std::clamp(color[c], 0, 255));
}

/// One surface with an unknown band in the middle. Known pixels have the colors that shown() returns. Pixels in the band have the
/// colors that answer() returns, which stand for an inpainter's result.
template <class Shown, class Answer>
photo_layers around_a_band(const Shown& shown, const Answer& answer) {
    photo_layers layers(make_grid(columns, rows));
    for (std::int32_t i = 0; i < columns * rows; ++i) {
        const std::int32_t x = i % columns, y = i / columns;
        layers.at<known_column>(i)[0] = in_hole(x) ? 0 : 1;
        set_color(layers, i, in_hole(x) ? answer(x, y) : shown(x, y));
    }
    return layers;
}

const grain_options no_grain{.strength = 0.0F};

/// Mean absolute difference of green between vertical neighbors, inside or outside the band.
double vertical_gradient(const photo_layers& layers, bool inside) {
    double sum = 0, count = 0;
    for (std::int32_t i = 0; i < columns * (rows - 1); ++i)
        if (in_hole(i % columns) == inside) {
            sum += std::abs(layers.at<color_column>(i)[1] - layers.at<color_column>(i + columns)[1]);
            count += 1;
        }
    return sum / count;
}

bool same_colors(const photo_layers& a, const photo_layers& b) { return a.column<color_column>() == b.column<color_column>(); }

}  // namespace

TEST_CASE("texture transfer continues noise in the hole with at least 60 percent of its strength") {
    for (const int strength : {3, 10, 30}) {
        std::mt19937 random(static_cast<unsigned>(strength));
        photo_layers layers = around_a_band(
            [&](std::int32_t, std::int32_t) {
                const int value = 128 + testing::below(random, 2 * strength + 1) - strength;
                return rgb{value, value, value};
            },
            [](std::int32_t, std::int32_t) {
                return rgb{128, 128, 128};
            });
        add_texture(layers, {}, no_grain);
        const double share = vertical_gradient(layers, true) / vertical_gradient(layers, false);
        INFO("for noise of up to " << strength << " gray levels, gradients inside are " << share << " times those outside");
        CHECK(share > 0.6);
        CHECK(share < 1.0);
    }
}

TEST_CASE("texture transfer continues fine lines through the hole") {
    photo_layers layers = around_a_band(
        [](std::int32_t, std::int32_t y) {
            const int value = y % 2 == 0 ? 120 : 136;
            return rgb{value, value, value};
        },
        [](std::int32_t, std::int32_t) {
            return rgb{128, 128, 128};
        });
    add_texture(layers, {}, no_grain);
    int along = 0, across = 0, count = 0;
    for (std::int32_t i = 0; i < columns * (rows - 1); ++i) {
        if (!in_hole(i % columns) || !in_hole(i % columns + 1)) continue;
        const int here = layers.at<color_column>(i)[1];
        along += here == layers.at<color_column>(i + 1)[1] ? 1 : 0;
        across += (here > 128) != (layers.at<color_column>(i + columns)[1] > 128) ? 1 : 0;
        ++count;
    }
    CHECK(along > 0.9 * count);
    CHECK(across > 0.9 * count);
}

TEST_CASE("texture is copied only between areas of similar blurred color, so that a smooth sky next to bark stays smooth") {
    const auto is_sky = [](std::int32_t y) { return y < rows / 2; };
    const auto answer = [&](std::int32_t, std::int32_t y) { return is_sky(y) ? rgb{90, 140, 220} : rgb{110, 80, 50}; };
    std::mt19937 random(5);
    photo_layers layers = around_a_band(
        [&](std::int32_t x, std::int32_t y) {
            rgb color = answer(x, y);
            for (int& value : color) value += is_sky(y) ? 0 : testing::below(random, 41) - 20;
            return color;
        },
        answer);
    const photo_layers before = layers;
    add_texture(layers, {}, no_grain);
    double bark = 0;
    for (std::int32_t i = 0; i < columns * rows; ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            const int change = std::abs(layers.at<color_column>(i)[c] - before.at<color_column>(i)[c]);
            const std::int32_t from_border = i / columns - rows / 2;
            if (from_border < -4) REQUIRE(change <= 1);
            if (from_border > 4 && in_hole(i % columns)) bark += change;
        }
    CHECK(bark / (3 * 40 * (rows / 2 - 5)) > 3);
}

TEST_CASE("`crest` limits the contrast of copied specks that are far stronger than the detail around the hole") {
    std::mt19937 random(8);
    const photo_layers before = around_a_band(
        [&](std::int32_t x, std::int32_t y) {
            const bool is_speck = (x < 35 || x >= 85) && (7 * x + 13 * y) % 31 == 0;
            const int value = 128 + testing::below(random, 5) - 2 + (is_speck ? 100 : 0);
            return rgb{value, value, value};
        },
        [](std::int32_t, std::int32_t) {
            return rgb{128, 128, 128};
        });
    const auto greatest_change = [&](float crest) {
        photo_layers layers = before;
        texture_options options;
        options.crest = crest, options.tolerance = 255.0F;
        add_texture(layers, options, no_grain);
        int greatest = 0;
        for (std::int32_t i = 0; i < columns * rows; ++i)
            greatest = std::max(greatest, std::abs(layers.at<color_column>(i)[1] - before.at<color_column>(i)[1]));
        return greatest;
    };
    CHECK(greatest_change(texture_options().crest) < 10);
    CHECK(greatest_change(1000.0F) > 40);
}

TEST_CASE("more than 90 percent of adjacent cells copy texture from adjacent sources") {
    std::mt19937 random(9);
    const photo_layers layers = around_a_band(
        [&](std::int32_t, std::int32_t) {
            return rgb{testing::below(random, 40), 20, 20};
        },
        [](std::int32_t, std::int32_t) {
            return rgb{20, 20, 20};
        });
    const graph& g = layers.topology();
    const detail::texture_cells cells = detail::find_texture_cells(g, layers.column<known_column>(), 32, 3);
    const detail::texture_looks looks = detail::look_at(cells, layers.column<color_column>());
    const buffer<std::int32_t> source = detail::texture_search(g, cells, looks.surroundings, 32).run(2);
    int pairs = 0, coherent = 0;
    for (std::int32_t cell = 0; cell < cells.count(); ++cell)
        for (const side s : {side::right, side::down}) {
            const std::int32_t n = cells.neighbor(cell, s);
            if (n == no_pixel || !cells.is_unknown(cell) || !cells.is_unknown(n)) continue;
            REQUIRE(cells.is_source(source[cell]));
            ++pairs;
            coherent += cells.neighbor(source[cell], s) == source[n] ? 1 : 0;
        }
    CHECK(coherent > 0.9 * pairs);
}

TEST_CASE(
    "two search rounds find a similar source for two thirds of the cells even if the nearest known pixels are not similar") {
    // Waves of color along columns, with a period of 32 rows. In the hole, they are shifted by half a period, so similar sources
    // are 16 rows away.
    const auto wave = [](std::int32_t x, std::int32_t y) {
        const int value = 128 + static_cast<int>(std::lround(60 * std::sin(3.14159265 / 16 * (in_hole(x) ? y + 16 : y))));
        return rgb{value, value, value};
    };
    const photo_layers layers = around_a_band(wave, wave);
    const graph& g = layers.topology();
    const detail::texture_cells cells = detail::find_texture_cells(g, layers.column<known_column>(), 32, 3);
    const detail::texture_looks looks = detail::look_at(cells, layers.column<color_column>());
    const buffer<std::int32_t> source = detail::texture_search(g, cells, looks.surroundings, 32).run(2);
    int unknown = 0, similar = 0;
    for (std::int32_t cell = 0; cell < cells.count(); ++cell) {
        if (!cells.is_unknown(cell)) continue;
        const int difference = detail::difference_of(looks.surroundings[cell], looks.surroundings[source[cell]]);
        unknown += 1, similar += difference <= 13 * detail::tap_values ? 1 : 0;
    }
    CHECK(3 * similar > 2 * unknown);
}

TEST_CASE("the integer blur matches a blur in double precision on random graphs") {
    std::mt19937 random(11);
    for (int round = 0; round < 50; ++round) {
        const testing::random_layers made = testing::random_graph(random, 30);
        photo_layers layers(made.topology());
        for (std::int32_t i = 0; i < made.topology().count(); ++i) {
            layers.at<known_column>(i)[0] = testing::chance(random, 70) ? 1 : 0;
            set_color(layers, i, {testing::below(random, 256), testing::below(random, 256), 255});
        }
        const detail::texture_cells cells = detail::find_texture_cells(layers.topology(), layers.column<known_column>(), 3, 2);
        const detail::texture_looks looks = detail::look_at(cells, layers.column<color_column>());
        std::vector<std::array<double, 3>> colors(cells.pixel.size());
        for (std::int32_t cell = 0; cell < cells.count(); ++cell)
            for (std::size_t c = 0; c < 3; ++c)
                colors[static_cast<std::size_t>(cell)][c] = layers.at<color_column>(cells.pixel[cell])[c];
        const std::vector<std::array<double, 3>> original = colors;
        for (int pass = 0; pass < 4; ++pass) {
            for (const auto& [one, other] : {std::array{side::left, side::right}, std::array{side::up, side::down}}) {
                const std::vector<std::array<double, 3>> before = colors;
                for (std::int32_t cell = 0; cell < cells.count(); ++cell)
                    for (std::size_t c = 0; c < 3; ++c) {
                        const auto at = [&](side s) {
                            const std::int32_t n = cells.neighbor(cell, s);
                            return before[static_cast<std::size_t>(n == no_pixel ? cell : n)][c];
                        };
                        colors[static_cast<std::size_t>(cell)][c] =
                            before[static_cast<std::size_t>(cell)][c] / 2 + (at(one) + at(other)) / 4;
                    }
            }
            for (std::int32_t cell = 0; pass == 0 && cell < cells.count(); ++cell)
                for (std::size_t c = 0; c < 3; ++c) {
                    const std::size_t i = static_cast<std::size_t>(cell);
                    REQUIRE(looks.detail[cell][c] / 16.0 == original[i][c] - colors[i][c]);
                }
        }
        for (std::int32_t cell = 0; cell < cells.count(); ++cell) {
            std::size_t at = 0;
            const auto look = [&](std::int32_t tap) {
                for (const double value : colors[static_cast<std::size_t>(tap)])
                    REQUIRE(looks.surroundings[cell][at++] == static_cast<int>(value + 0.5));
            };
            look(cell);
            for (const side s : all_sides) {
                std::int32_t tap = cell;
                for (int step = 0; step < detail::tap_distance; ++step)
                    if (const std::int32_t n = cells.neighbor(tap, s); n != no_pixel) tap = n;
                look(tap);
            }
        }
    }
}

TEST_CASE("sources are compared by the colors up to eight pixels above, below, to the left and to the right of them") {
    // A white line, a row or a column, across a black image.
    for (const bool is_row : {false, true}) {
        photo_layers layers(make_grid(60, 60));
        for (std::int32_t i = 0; i < 60 * 60; ++i) {
            const std::int32_t x = i % 60, y = i / 60, value = (is_row ? y : x) == 30 ? 255 : 0;
            layers.at<known_column>(i)[0] = x == 0 ? 0 : 1;
            set_color(layers, i, {value, value, value});
        }
        const detail::texture_cells cells = detail::find_texture_cells(layers.topology(), layers.column<known_column>(), 100, 3);
        const detail::texture_looks looks = detail::look_at(cells, layers.column<color_column>());
        REQUIRE(cells.count() == 60 * 60);
        for (std::int32_t cell = 0; cell < cells.count(); ++cell) {
            const std::int32_t distance = std::abs((is_row ? cell / 60 : cell % 60) - 30);
            REQUIRE((looks.surroundings[cell] != detail::texture_surroundings{}) == (distance <= 8));
        }
    }
}

TEST_CASE("add_texture() changes only unknown pixels, and copies texture only along links") {
    std::mt19937 random(6);
    std::size_t changed = 0;
    for (int round = 0; round < 300; ++round) {
        const testing::random_layers made = testing::random_graph(random, 30);
        const components surfaces = connected_components(made.topology());
        photo_layers layers(made.topology());
        const auto own = [&](std::int32_t pixel) { return static_cast<std::size_t>(surfaces.label[pixel] % 3); };
        for (std::int32_t i = 0; i < made.topology().count(); ++i) {
            const bool known = testing::chance(random, 70);
            layers.at<known_column>(i)[0] = known ? 1 : 0;
            rgb color{100, 100, 100};
            if (known) color[own(i)] += testing::below(random, 31) - 15;
            set_color(layers, i, color);
        }
        const photo_layers before = layers;
        texture_options options;
        options.reach = 1 + testing::below(random, 40);
        add_texture(layers, options, no_grain);
        REQUIRE((layers.column<known_column>() == before.column<known_column>()));
        for (std::int32_t i = 0; i < made.topology().count(); ++i)
            for (std::size_t c = 0; c < 3; ++c) {
                const bool differs = layers.at<color_column>(i)[c] != before.at<color_column>(i)[c];
                if (before.at<known_column>(i)[0] != 0 || c != own(i)) REQUIRE_FALSE(differs);
                changed += differs ? 1 : 0;
            }
        photo_layers again = before;
        add_texture(again, options, no_grain);
        REQUIRE(same_colors(layers, again));
    }
    CHECK(changed > 1000);
}

TEST_CASE("add_texture() returns the same colors for any number of threads") {
    constexpr std::int32_t width = 40, height = 3000;  // so large that the cells and the stretches of cells form several pieces
    std::mt19937 random(12);
    photo_layers layers(make_grid(width, height));
    for (std::int32_t i = 0; i < width * height; ++i) {
        layers.at<known_column>(i)[0] = i / width % 60 < 40 || testing::chance(random, 50) ? 1 : 0;
        set_color(layers, i, {testing::below(random, 256), testing::below(random, 256), testing::below(random, 256)});
    }
    photo_layers serial = layers;
    add_texture(serial);
    REQUIRE_FALSE(same_colors(serial, layers));
    for (const std::size_t count : {2U, 5U}) {
        thread_pool threads(count);
        photo_layers parallel = layers;
        add_texture(parallel, {}, {}, threads);
        CHECK(same_colors(parallel, serial));
    }
}

TEST_CASE("the texture search divides unknown cells into ascending parts of similar size that no link connects") {
    std::mt19937 random(13);
    std::size_t connected = 0, divided = 0;
    for (int round = 0; round < 300; ++round) {
        const testing::random_layers made = testing::random_graph(random, 30);
        buffer<std::uint8_t> known(made.topology().size());
        for (std::uint8_t& k : known) k = testing::chance(random, 50) ? 1 : 0;
        const detail::texture_cells cells = detail::find_texture_cells(made.topology(), known, 8, 3);
        for (const std::size_t threads : {1U, 2U, 5U}) {
            const buffer<buffer<std::int32_t>> parts = cells.independent_parts(threads);
            buffer<std::int32_t> part_of(cells.pixel.size(), no_pixel);
            std::size_t unknown = 0, largest = 0;
            for (std::int32_t p = 0; p < parts.count(); ++p) {
                REQUIRE(std::is_sorted(parts[p].begin(), parts[p].end()));
                for (const std::int32_t cell : parts[p]) REQUIRE(std::exchange(part_of[cell], p) == no_pixel);
                unknown += parts[p].size(), largest = std::max(largest, parts[p].size());
            }
            for (std::int32_t cell = 0; cell < cells.count(); ++cell) {
                REQUIRE((part_of[cell] != no_pixel) == cells.is_unknown(cell));
                for (const side s : all_sides) {
                    const std::int32_t n = cells.neighbor(cell, s);
                    if (n == no_pixel || !cells.is_unknown(cell) || !cells.is_unknown(n)) continue;
                    REQUIRE(part_of[n] == part_of[cell]);
                    ++connected;
                }
            }
            if (threads > 1 && 3 * largest < unknown) ++divided;
        }
    }
    CHECK(connected > 1000);
    CHECK(divided > 300);
}

TEST_CASE("unknown pixels without similar known colors receive grain, and so do all pixels if the texture's strength is 0") {
    std::mt19937 random(7);
    photo_layers layers = around_a_band(
        [&](std::int32_t, std::int32_t) {
            return rgb{60 + testing::below(random, 21), 60, 60};
        },
        [](std::int32_t x, std::int32_t) {
            return x < 48 || x >= 72 ? rgb{65, 60, 60} : rgb{200, 200, 200};
        });
    photo_layers grain = layers, strength_0 = layers;
    add_texture(layers);
    add_grain(grain);
    texture_options none;
    none.strength = 0.0F;
    add_texture(strength_0, none);
    CHECK(same_colors(strength_0, grain));
    bool all_differ = false;
    for (std::int32_t i = 0; i < columns * rows; ++i) {
        const bool equal = std::ranges::equal(layers.at<color_column>(i), grain.at<color_column>(i));
        if (const std::int32_t x = i % columns; x >= 56 && x < 64) REQUIRE(equal);
        all_differ = all_differ || !equal;
    }
    CHECK(all_differ);
}

TEST_CASE("the less the known colors resemble those in a hole, the more grain replaces texture") {
    const auto filled = [](int difference, const texture_options& texture, const grain_options& grain) {
        std::mt19937 random(13);
        photo_layers layers = around_a_band(
            [&](std::int32_t, std::int32_t) {
                const int value = 100 + testing::below(random, 13) - 6;
                return rgb{value, value, value};
            },
            [&](std::int32_t, std::int32_t) {
                return rgb{100 + difference, 100 + difference, 100 + difference};
            });
        add_texture(layers, texture, grain);
        return layers;
    };
    const auto change = [](const photo_layers& a, const photo_layers& b) {
        double sum = 0;
        for (std::int32_t i = 0; i < columns * rows; ++i) sum += std::abs(a.at<color_column>(i)[1] - b.at<color_column>(i)[1]);
        return sum;
    };
    const texture_options similar{.tolerance = 20.0F}, any{.tolerance = 255.0F}, none{.strength = 0.0F};
    const auto shares = [&](int difference) {
        const photo_layers smooth = filled(difference, none, no_grain), texture = filled(difference, similar, no_grain);
        return std::pair{change(texture, smooth) / change(filled(difference, any, no_grain), smooth),
                         change(filled(difference, similar, {}), texture) / change(filled(difference, none, {}), smooth)};
    };
    for (const auto& [difference, min_grain, max_grain] :
         {std::tuple{0, 0.0, 0.0}, {10, 0.0, 0.0}, {40, 0.3, 0.7}, {45, 0.4, 0.8}, {100, 0.9, 1.0}}) {
        const auto [texture, grain] = shares(difference);
        CAPTURE(difference, texture, grain);
        CHECK((texture >= 0.95 - max_grain && texture <= 1.05 - min_grain));
        CHECK((grain >= min_grain && grain <= max_grain));
    }
}

TEST_CASE("add_texture() does not change images that are empty, entirely known or entirely unknown") {
    for (const std::int32_t side : {0, 1, 20})
        for (const int known : {0, 1}) {
            photo_layers layers(make_grid(side, side));
            for (std::int32_t i = 0; i < side * side; ++i) {
                layers.at<known_column>(i)[0] = static_cast<std::uint8_t>(known);
                set_color(layers, i, {i % 50, 2 * i % 90, 7});
            }
            const photo_layers before = layers;
            add_texture(layers);
            CHECK(same_colors(layers, before));
        }
}

TEST_CASE("errors for texture options outside their range name the option") {
    photo_layers layers(make_grid(2, 2));
    const auto is_refused = [&](const char* name, auto change) {
        texture_options options;
        change(options);
        CHECK_THROWS_WITH(add_texture(layers, options), Catch::Contains(std::string("texture_options, ") + name));
    };
    for (const float wrong : {-1.0F, std::nanf(""), 1e9F}) {
        is_refused("strength", [&](texture_options& o) { o.strength = wrong; });
        is_refused("crest", [&](texture_options& o) { o.crest = wrong; });
        is_refused("tolerance", [&](texture_options& o) { o.tolerance = wrong; });
    }
    for (const int wrong : {-1, 0, 201}) {
        is_refused("reach", [&](texture_options& o) { o.reach = wrong; });
        is_refused("rounds", [&](texture_options& o) { o.rounds = wrong; });
    }
}
