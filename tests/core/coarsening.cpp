#include <ldi/core/coarsening.hpp>
#include <ldi/core/components.hpp>
#include <ldi/core/validate.hpp>

#include "tests/support/counted_memory.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/random_graph.hpp"
#include "tests/support/sketched_graph.hpp"

#include <catch2/catch.hpp>

#include <array>
#include <cmath>

using namespace ldi;
using ldi::testing::random_layers;

namespace {
buffer<std::int32_t> parents_of(const graph_view& g, orphan_rule orphans) {
    const coarsened coarse = coarsen(g, orphans);
    return coarse.map.parent().copy();
}

struct kept_value {  // a coarse pixel has the value of its kept pixel
    using scalar = std::uint16_t;
    static constexpr std::size_t channels = 1;
    static std::array<scalar, 1> coarser(pixel_values<scalar, 1> pixels) { return first_of(pixels); }
};

struct direction {
    using scalar = float;
    static constexpr std::size_t channels = 2;
    static std::array<float, 2> coarser(pixel_values<float, 2> pixels) {
        std::array<float, 2> mean = averaged(pixels);
        const float length = std::sqrt(mean[0] * mean[0] + mean[1] * mean[1]);
        for (float& c : mean) c /= length;
        return mean;
    }
};

bool is_kept(const graph_view& g, std::int32_t pixel) {
    return g.x()[static_cast<std::size_t>(pixel)] % 2 == 0 && g.y()[static_cast<std::size_t>(pixel)] % 2 == 0;
}

/// Returns the first pixel accepted by `wanted` in breadth-first exploration from `pixel`, through pixels accepted by `allowed`.
template <class Allowed, class Wanted>
std::int32_t explore(const graph_view& g, std::int32_t pixel, Allowed&& allowed, Wanted&& wanted) {
    std::vector<bool> seen(g.size(), false);
    buffer<std::int32_t> queue{pixel};
    seen[static_cast<std::size_t>(pixel)] = true;
    for (std::size_t next = 0; next < queue.size(); ++next) {
        if (wanted(queue[next])) return queue[next];
        for (const side s : all_sides) {
            const std::int32_t n = g.neighbor(queue[next], s);
            if (n == no_pixel || seen[static_cast<std::size_t>(n)] || !allowed(n)) continue;
            seen[static_cast<std::size_t>(n)] = true;
            queue.push_back(n);
        }
    }
    return no_pixel;
}

/// Computes the parents as documented, by one exploration per pixel.
buffer<std::int32_t> parents_by_exploration(const graph_view& g, array_view<const std::int32_t> kept) {
    buffer<std::int32_t> coarse_index(g.size(), no_pixel), in_group(g.size(), no_pixel), result(g.size(), no_pixel);
    for (std::size_t i = 0; i < kept.size(); ++i) coarse_index[static_cast<std::size_t>(kept[i])] = static_cast<std::int32_t>(i);
    const std::int32_t count = static_cast<std::int32_t>(g.size());
    for (std::int32_t i = 0; i < count; ++i) {
        const std::size_t k = static_cast<std::size_t>(i);
        const auto same_group = [&](std::int32_t n) {
            const std::size_t m = static_cast<std::size_t>(n);
            return g.x()[m] / 2 == g.x()[k] / 2 && g.y()[m] / 2 == g.y()[k] / 2;
        };
        const std::int32_t found = explore(g, i, same_group, [&](std::int32_t n) { return is_kept(g, n); });
        if (found != no_pixel) in_group[k] = coarse_index[static_cast<std::size_t>(found)];
    }
    for (std::int32_t i = 0; i < count; ++i) {
        const std::int32_t found = explore(
            g, i, [](std::int32_t) { return true; },
            [&](std::int32_t n) { return in_group[static_cast<std::size_t>(n)] != no_pixel; });
        if (found != no_pixel) result[static_cast<std::size_t>(i)] = in_group[static_cast<std::size_t>(found)];
    }
    return result;
}
}  // namespace

TEST_CASE("coarsening an image keeps every second pixel of every second row") {
    for (const auto& [width, height] : {std::pair{0, 0}, {1, 1}, {2, 2}, {5, 4}, {4, 5}, {9, 1}, {1, 8}}) {
        const graph grid = make_grid(width, height);
        const coarsened result = coarsen(grid, orphan_rule::adopt_nearest);
        const std::int32_t coarse_width = (width + 1) / 2, coarse_height = (height + 1) / 2;
        CHECK(result.topology == make_grid(coarse_width, coarse_height));
        for (std::int32_t i = 0; i < coarse_width * coarse_height; ++i)
            CHECK(result.map.kept()[static_cast<std::size_t>(i)] == i / coarse_width * 2 * width + i % coarse_width * 2);
        for (std::int32_t i = 0; i < width * height; ++i)
            CHECK(result.map.parent()[static_cast<std::size_t>(i)] == i / width / 2 * coarse_width + i % width / 2);
    }
}

TEST_CASE("the widest lattice has a coarser level") {
    const graph widest = graph_builder(max_lattice_side, 1).build();
    const coarsened result = coarsen(widest, orphan_rule::adopt_nearest);
    CHECK((result.topology.width() == 32768 && result.topology.height() == 1 && result.topology.size() == 0));
}

TEST_CASE("inside a 2 x 2 group, a direct link to a kept pixel is preferred, then the path up and left, then left and up") {
    testing::sketched_graph g(2, 2);
    const std::int32_t first_corner = g.add_pixel(0, 0), second_corner = g.add_pixel(0, 0);
    const std::int32_t right = g.add_pixel(1, 0), below = g.add_pixel(0, 1), diagonal = g.add_pixel(1, 1);
    g.link(right, side::left, first_corner), g.link(below, side::up, second_corner);
    g.link(diagonal, side::up, right), g.link(diagonal, side::left, below);
    const level_map map = coarsen(g, orphan_rule::adopt_nearest).map;
    REQUIRE(map.kept() == buffer<std::int32_t>{first_corner, second_corner});
    CHECK(map.parent() == buffer<std::int32_t>{0, 1, 0, 1, 0});

    SECTION("if the upper path is cut, its pixels take the parent on the left path") {
        g.unlink(right, side::left);
        CHECK(parents_of(g, orphan_rule::adopt_nearest) == buffer<std::int32_t>{0, 1, 1, 1, 1});
    }
    SECTION("if the left path is cut, its pixels take the parent on the upper path") {
        g.unlink(below, side::up);
        CHECK(parents_of(g, orphan_rule::adopt_nearest) == buffer<std::int32_t>{0, 1, 0, 0, 0});
    }
    SECTION("if both paths are cut, the pixels have no parent") {
        g.unlink(below, side::up), g.unlink(right, side::left);
        CHECK(parents_of(g, orphan_rule::adopt_nearest) == buffer<std::int32_t>{0, 1, no_pixel, no_pixel, no_pixel});
    }
}

TEST_CASE(
    "a pixel without a parent in its group adopts the nearest parent, with ties resolved in the order up, down, left, right") {
    testing::sketched_graph g(4, 4);
    const std::int32_t a = g.add_pixel(0, 0), beside_a = g.add_pixel(1, 0), below_a = g.add_pixel(1, 1);
    const std::int32_t b = g.add_pixel(2, 2), between_up_and_right = g.add_pixel(1, 2), between_down_and_left = g.add_pixel(2, 1);
    const std::int32_t tail = g.add_pixel(3, 1), longer_tail = g.add_pixel(3, 0);
    g.link(a, side::right, beside_a), g.link(beside_a, side::down, below_a);
    g.link(below_a, side::down, between_up_and_right), g.link(below_a, side::right, between_down_and_left);
    g.link(b, side::left, between_up_and_right), g.link(b, side::up, between_down_and_left);
    g.link(between_down_and_left, side::right, tail), g.link(tail, side::up, longer_tail);
    const coarsened result = coarsen(g, orphan_rule::adopt_nearest);
    REQUIRE(result.map.kept() == buffer<std::int32_t>{a, b});
    CHECK(result.map.parent() == buffer<std::int32_t>{0, 0, 0, 1, 0, 1, 1, 1});
}

TEST_CASE("the orphan rule affects only the parents of orphans") {
    testing::for_random_graphs(54, 500, [](const random_layers& layers, std::mt19937&) {
        const graph& g = layers.topology();
        const coarsened adopted = coarsen(g, orphan_rule::adopt_nearest), stayed = coarsen(g, orphan_rule::stay);
        REQUIRE(adopted.topology == stayed.topology);
        REQUIRE(adopted.map.kept() == stayed.map.kept());
        for (std::size_t i = 0; i < g.size(); ++i) {
            const std::int32_t corner = detail::corner_of_group(g, static_cast<std::int32_t>(i));
            REQUIRE(stayed.map.parent()[i] ==
                    (corner == no_pixel ? no_pixel : adopted.map.parent()[static_cast<std::size_t>(corner)]));
            if (stayed.map.parent()[i] == no_pixel) continue;
            REQUIRE(adopted.map.parent()[i] == stayed.map.parent()[i]);
            const std::size_t above =
                static_cast<std::size_t>(stayed.map.kept()[static_cast<std::size_t>(stayed.map.parent()[i])]);
            REQUIRE(g.x()[above] == g.x()[i] / 2 * 2);
            REQUIRE(g.y()[above] == g.y()[i] / 2 * 2);
        }
        for (const std::int32_t kept : stayed.map.kept())
            REQUIRE(stayed.map.parent()[static_cast<std::size_t>(kept)] != no_pixel);
    });
}

TEST_CASE(
    "a pixel that cannot reach its group's corner adopts an adjacent parent or has no parent, depending on the orphan rule") {
    testing::sketched_graph g(make_grid(5, 2));
    g.unlink(3, side::left), g.unlink(3, side::down);
    CHECK(parents_of(g, orphan_rule::adopt_nearest) == buffer<std::int32_t>{0, 0, 1, 2, 2, 0, 0, 1, 1, 2});
    CHECK(parents_of(g, orphan_rule::stay) == buffer<std::int32_t>{0, 0, 1, no_pixel, 2, 0, 0, 1, 1, 2});
}

TEST_CASE("all layers at an even position are kept, and linked to the kept pixels of their own surface") {
    testing::sketched_graph g(make_grid(3, 1));
    for (std::int32_t x = 0; x < 3; ++x) {
        g.add_pixel(x, 0);
        if (x > 0) g.link(2 + x, side::right, 3 + x);
    }
    const coarsened result = coarsen(g, orphan_rule::adopt_nearest);
    CHECK(result.map.kept() == buffer<std::int32_t>{0, 2, 3, 5});
    CHECK(result.topology.right() == buffer<std::int32_t>{1, no_pixel, 3, no_pixel});
    CHECK(result.map.parent() == buffer<std::int32_t>{0, 0, 1, 2, 2, 3});
}

TEST_CASE("the coarse graph is sound, and canonical if the fine graph is") {
    int layers_seen = 0;
    testing::for_random_graphs(50, 2000, [&](const random_layers& layers, std::mt19937&) {
        const coarsened result = coarsen(layers.topology(), orphan_rule::adopt_nearest);
        REQUIRE_FALSE(validate(result.topology).has_value());
        if (!validate_canonical(layers.topology()).has_value()) REQUIRE_FALSE(validate_canonical(result.topology).has_value());
        const coarsened twice = coarsen(result.topology, orphan_rule::adopt_nearest);
        REQUIRE_FALSE(validate(twice.topology).has_value());
        ++layers_seen;
    });
    CHECK(layers_seen == 2000);
}

TEST_CASE("coarsening keeps exactly the pixels at even positions, in the same order, at half their coordinates") {
    testing::for_random_graphs(51, 1000, [](const random_layers& layers, std::mt19937&) {
        const graph& g = layers.topology();
        const coarsened result = coarsen(g, orphan_rule::adopt_nearest);
        buffer<std::int32_t> expected;
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(g.size()); ++i)
            if (is_kept(g, i)) expected.push_back(i);
        REQUIRE(result.map.kept() == expected);
        REQUIRE(result.topology.size() == expected.size());
        for (std::size_t i = 0; i < expected.size(); ++i) {
            REQUIRE(2 * result.topology.x()[i] == g.x()[static_cast<std::size_t>(expected[i])]);
            REQUIRE(2 * result.topology.y()[i] == g.y()[static_cast<std::size_t>(expected[i])]);
            REQUIRE(result.map.parent()[static_cast<std::size_t>(expected[i])] == static_cast<std::int32_t>(i));
        }
    });
}

TEST_CASE("kept pixels are linked if and only if a path of two links joins them in the fine graph") {
    testing::for_random_graphs(52, 1000, [](const random_layers& layers, std::mt19937&) {
        const graph& g = layers.topology();
        const coarsened result = coarsen(g, orphan_rule::adopt_nearest);
        for (std::size_t i = 0; i < result.map.kept().size(); ++i) {
            // Tries all sixteen paths of two links, and sorts their ends by direction.
            buffer<std::int32_t> found(4, no_pixel);
            const std::int32_t from = result.map.kept()[i];
            for (const side first : all_sides)
                for (const side second : all_sides) {
                    const std::int32_t middle = g.neighbor(from, first);
                    const std::int32_t end = middle == no_pixel ? no_pixel : g.neighbor(middle, second);
                    if (end == no_pixel || !is_kept(g, end) || end == from) continue;
                    const std::size_t a = static_cast<std::size_t>(from), b = static_cast<std::size_t>(end);
                    for (std::size_t s = 0; s < 4; ++s)
                        if (g.x()[b] - g.x()[a] == 2 * step_x(all_sides[s]) && g.y()[b] - g.y()[a] == 2 * step_y(all_sides[s])) {
                            REQUIRE(found[s] == no_pixel);
                            found[s] = result.map.parent()[b];
                        }
                }
            for (std::size_t s = 0; s < 4; ++s) REQUIRE(result.topology.neighbors(all_sides[s])[i] == found[s]);
        }
    });
}

TEST_CASE("parents match a breadth-first search from each pixel, and only pixels connected to no kept pixel lack a parent") {
    int beyond_group = 0, without_parent = 0;
    testing::for_random_graphs(53, 1500, [&](const random_layers& layers, std::mt19937&) {
        const graph& g = layers.topology();
        const coarsened result = coarsen(g, orphan_rule::adopt_nearest);
        REQUIRE(result.map.parent() == parents_by_exploration(g, result.map.kept()));

        // Only components without any kept pixel have no parents.
        const components whole = connected_components(g);
        std::vector<bool> has_kept(whole.count(), false);
        for (const std::int32_t i : result.map.kept())
            has_kept[static_cast<std::size_t>(whole.label[static_cast<std::size_t>(i)])] = true;
        for (std::size_t i = 0; i < g.size(); ++i) {
            const std::int32_t parent = result.map.parent()[i];
            REQUIRE((parent != no_pixel) == has_kept[static_cast<std::size_t>(whole.label[i])]);
            if (parent == no_pixel) {
                ++without_parent;
                continue;
            }
            const std::size_t p = static_cast<std::size_t>(parent);
            REQUIRE(whole.label[static_cast<std::size_t>(result.map.kept()[p])] == whole.label[i]);
            if (result.topology.x()[p] != g.x()[i] / 2 || result.topology.y()[p] != g.y()[i] / 2) ++beyond_group;
        }
    });
    CHECK(beyond_group > 2000);
    CHECK(without_parent > 2000);
}

TEST_CASE("coarsening does not depend on the order of the pixels in memory") {
    testing::for_random_graphs(54, 500, [](const random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        const buffer<std::int32_t> order = testing::random_permutation(random, g.size());
        const graph shuffled = ldi::reordered(g, order);
        const coarsened before = coarsen(g, orphan_rule::adopt_nearest), after = coarsen(shuffled, orphan_rule::adopt_nearest);
        for (std::size_t i = 0; i < g.size(); ++i) {
            const std::int32_t a = after.map.parent()[i], b = before.map.parent()[static_cast<std::size_t>(order[i])];
            REQUIRE((a == no_pixel) == (b == no_pixel));
            if (a != no_pixel)
                REQUIRE(order[static_cast<std::size_t>(after.map.kept()[static_cast<std::size_t>(a)])] ==
                        before.map.kept()[static_cast<std::size_t>(b)]);
        }
    });
}

TEST_CASE("the search for parents needs bounded memory even if many paths reach each orphan") {
    // Every pixel at even x and y is unlinked from its neighbors, except for one in the middle. All other pixels form a grid of
    // lines one pixel wide; the pixel in the middle is the only one that they can have as a parent.
    constexpr std::int32_t size = 81;
    testing::sketched_graph g(make_grid(size, size));
    for (std::int32_t i = 0; i < g.count(); ++i)
        if (is_kept(g, i) && (g.x()[i] != 40 || g.y()[i] != 40))
            for (const side s : all_sides) g.unlink(i, s);
    testing::counted_memory own;
    own.limit = 200 * g.size();
    const memory_scope scope(own.source);
    const coarsened result = coarsen(g, orphan_rule::adopt_nearest);
    CHECK(std::count(result.map.parent().begin(), result.map.parent().end(), no_pixel) == 0);
}

TEST_CASE("a column's rule receives all channels of the fine pixels, so it can normalize a direction") {
    layered_image<direction> fine(make_grid(2, 1));
    fine.at<direction>(0)[0] = 1, fine.at<direction>(1)[1] = 1;
    const auto coarse = coarsen(fine).layers;
    REQUIRE(coarse.size() == 1);
    CHECK(coarse.at<direction>(0)[0] == Approx(std::sqrt(0.5F)));
    CHECK(coarse.at<direction>(0)[1] == Approx(std::sqrt(0.5F)));
}

TEST_CASE("the rule of each column computes the value of a coarse pixel from all pixels that have it as their parent") {
    using layers_of_test = layered_image<color_column, disparity_column, known_column, kept_value>;
    std::mt19937 random(11);
    for (int round = 0; round < 200; ++round) {
        layers_of_test fine(ldi::testing::random_graph(random).topology());
        const std::int32_t count = fine.topology().count();
        for (std::int32_t i = 0; i < count; ++i) {
            for (std::uint8_t& c : fine.at<color_column>(i)) c = static_cast<std::uint8_t>(random() % 256);
            fine.at<disparity_column>(i)[0] = static_cast<float>(random() % 1000) / 1000.0F;
            fine.at<known_column>(i)[0] = static_cast<std::uint8_t>(random() % 4 != 0);
            fine.at<kept_value>(i)[0] = static_cast<std::uint16_t>(i);
        }
        const orphan_rule rule = round % 2 == 0 ? orphan_rule::stay : orphan_rule::adopt_nearest;
        const auto level = coarsen(fine, rule);
        const coarsened topology = coarsen(graph_view(fine.topology()), rule);
        REQUIRE(level.layers.topology() == topology.topology);
        REQUIRE(level.map.parent() == topology.map.parent());
        for (std::int32_t c = 0; c < level.layers.topology().count(); ++c) {
            double red = 0, disparity = 0, children = 0;
            std::uint8_t known = 1;
            for (std::int32_t i = 0; i < count; ++i) {
                if (level.map.parent()[i] != c) continue;
                red += fine.at<color_column>(i)[0], disparity += double{fine.at<disparity_column>(i)[0]}, ++children;
                known = (std::min)(known, fine.at<known_column>(i)[0]);
            }
            REQUIRE(level.layers.at<color_column>(c)[0] == std::round(red / children));
            REQUIRE(level.layers.at<disparity_column>(c)[0] == Approx(disparity / children));
            REQUIRE(level.layers.at<known_column>(c)[0] == known);
            REQUIRE(level.layers.at<kept_value>(c)[0] == level.map.kept()[c]);
        }
    }
}

TEST_CASE("coarsen() refuses a view whose positions or links violate an invariant") {
    const auto error_of = [](std::vector<lattice_coordinate> x, std::vector<std::int32_t> right, std::vector<std::int32_t> left) {
        const std::vector<lattice_coordinate> y(x.size(), 0);
        const std::vector<std::int32_t> none(x.size(), no_pixel);
        using coordinates = std::span<const lattice_coordinate>;
        using values = std::span<const std::int32_t>;
        const graph_view view(3, 1, coordinates(x), coordinates(y), values(none), values(none), values(left), values(right));
        return testing::raised([&] { coarsen(view); });
    };
    CHECK_FALSE(error_of({0, 1, 2}, {1, 2, -1}, {-1, 0, 1}));
    CHECK(error_of({0, 1, 100}, {1, -1, -1}, {-1, 0, -1}) == error_code::mismatch);
    CHECK(error_of({0, 1, 2}, {1, 50000000, -1}, {-1, 0, 1}) == error_code::mismatch);
    CHECK(error_of({0, 1, 2}, {1, 2, -1}, {-1, 0, -1}) == error_code::mismatch);
}

TEST_CASE("a view of layers is coarsened like the layers") {
    testing::for_random_graphs(20, 300, [](const random_layers& random_layers, std::mt19937&) {
        layered_image<disparity_column> layers(random_layers.topology(), random_layers.disparity);
        const auto whole = coarsen(layers), viewed = coarsen(layered_view<disparity_column>(layers));
        REQUIRE(whole.layers.topology() == viewed.layers.topology());
        REQUIRE(whole.layers.column<disparity_column>() == viewed.layers.column<disparity_column>());
        REQUIRE((whole.map.kept() == viewed.map.kept() && whole.map.parent() == viewed.map.parent()));
    });
}
