#include <bench/quality/micro_polygons.hpp>
#include <bench/quality/peel.hpp>

#include <ldi/core/components.hpp>
#include <ldi/core/validate.hpp>
#include <tests/support/lifted_scene.hpp>
#include <tests/support/random_graph.hpp>
#include <tests/support/scene_view.hpp>

#include <catch2/catch.hpp>

#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace {

using namespace ldi;
using namespace ldi_quality;
using testing::own_view, testing::scene_range;

/// A slightly rotated and moved view, with the photo still in front of it.
view random_view(const view& from, std::mt19937& random) {
    const auto any = [&] { return static_cast<float>(random()) * 0x1.0p-31F - 1; };
    view v = from;
    const float a = 0.2F * any(), c = std::cos(a), s = std::sin(a);
    v.rotation = {c, 0, s, 0, 1, 0, -s, 0, c};
    v.position = {0.2F * any(), 0.2F * any(), 0.2F * any()};
    return v;
}

photo_layers random_lifted(std::mt19937& random, std::size_t height, std::size_t width) {
    photo_layers layers = testing::lifted_layers(testing::random_disparity(random, height, width));
    for (std::uint8_t& value : layers.column<color_column>()) value = static_cast<std::uint8_t>(random());
    return layers;
}

std::size_t link_count(const graph_view& g) {
    std::size_t count = 0;
    for (std::size_t i = 0; i < g.size(); ++i)
        count += (g.right()[i] != no_pixel ? 1U : 0U) + (g.down()[i] != no_pixel ? 1U : 0U);
    return count;
}

}  // namespace

TEST_CASE("peeling a layered image from its own viewpoint returns it unchanged, for any topology") {
    testing::for_random_graphs(5, 200, [](const testing::random_layers& any, std::mt19937& random) {
        const testing::random_layers canonical = testing::in_canonical_order(any);
        photo_layers layers = photo_layers(canonical.topology());
        layers.set_column<disparity_column>(canonical.disparity);
        for (std::uint8_t& value : layers.column<color_column>()) value = static_cast<std::uint8_t>(random());
        for (std::uint8_t& value : layers.column<known_column>()) value = random() % 4 != 0 ? 1 : 0;
        const view v = own_view(layers.topology());
        const auto [peeled, peeled_range] = peel(layers, scene_range, v, v);
        REQUIRE(peeled.topology() == layers.topology());
        REQUIRE(peeled.column<color_column>() == layers.column<color_column>());
        REQUIRE(peeled.column<known_column>() == layers.column<known_column>());
        for (std::size_t i = 0; i < layers.size(); ++i)
            REQUIRE(peeled.column<disparity_column>()[i] == Approx(canonical.disparity[i]).margin(1e-5));
        REQUIRE((peeled_range.z_near == scene_range.z_near && peeled_range.z_far == scene_range.z_far));
    });
}

TEST_CASE("from any view, the result of peel() is valid, and its first layer is what the view shows") {
    std::mt19937 random(12);
    for (int trial = 0; trial < 25; ++trial) {
        const photo_layers layers = random_lifted(random, 20 + random() % 30, 20 + random() % 30);
        const view v = own_view(layers.topology()), from = random_view(v, random);
        const auto [peeled, peeled_range] = peel(layers, scene_range, v, from);
        const graph& g = peeled.topology();
        const auto disparity = peeled.column<disparity_column>();
        REQUIRE(!validate_canonical(g, disparity));
        for (const float d : disparity) REQUIRE((d >= 0 && d <= 1));

        const rendering seen = render_layers(layers, scene_range, v, from);
        buffer<std::int32_t> front(seen.depth.size(), no_pixel);
        for (std::size_t i = 0; i < g.size(); ++i) {
            std::int32_t& nearest = front[static_cast<std::size_t>(g.y()[i]) * static_cast<std::size_t>(g.width()) +
                                          static_cast<std::size_t>(g.x()[i])];
            if (nearest == no_pixel || disparity[i] > disparity[static_cast<std::size_t>(nearest)])
                nearest = static_cast<std::int32_t>(i);
        }
        std::size_t differing = 0;
        for (std::size_t p = 0; p < front.size(); ++p) {
            REQUIRE((front[p] != no_pixel) == (seen.coverage.data()[p] != 0));
            if (front[p] == no_pixel) continue;
            REQUIRE(peeled_range.depth(disparity[static_cast<std::size_t>(front[p])]) ==
                    Approx(seen.depth.data()[p]).epsilon(1e-4));
            const auto color = peeled.at<color_column>(front[p]);
            for (std::size_t c = 0; c < 3; ++c) differing += color[c] != seen.color.data()[3 * p + c] ? 1U : 0U;
        }
        // A different surface may be in front only where both have the same depth, up to rounding.
        REQUIRE(differing <= front.size() / 100);
    }
}

TEST_CASE("a plane seen from the side remains one fully linked surface") {
    const photo_layers layers = testing::lifted_layers(image<float>(24, 30, 1, 0.4F));
    const view v = own_view(layers.topology());
    for (const float shift : {3.0F, -7.0F, 2.4F, 0.3F}) {
        const photo_layers peeled = peel(layers, scene_range, v, moved_view(v.camera, scene_range, 0.4F, shift)).layers;
        const std::size_t width = 30 - static_cast<std::size_t>(std::floor(std::abs(shift) + 0.5F));
        CHECK(peeled.size() == 24 * width);
        CHECK(link_count(peeled.topology()) == 23 * width + 24 * (width - 1));
    }
    // A closer camera sees a part of the plane, which fills its whole picture. A more distant camera sees the plane smaller.
    view other = v;
    other.position = {0.01F, 0.02F, -0.7F};
    const auto [larger, larger_range] = peel(layers, scene_range, v, other);
    CHECK(larger.size() == 24 * 30);
    CHECK(link_count(larger.topology()) == 23 * 30 + 24 * 29);
    CHECK(larger_range.depth(larger.column<disparity_column>()[0]) == Approx(scene_range.depth(0.4F) - 0.7F));
    other.position = {0, 0, 5};
    const photo_layers smaller = peel(layers, scene_range, v, other).layers;
    CHECK(connected_components(smaller.topology()).count() == 1);
}

TEST_CASE("a near strip stays in front of the plane behind it, and the two are not linked") {
    photo_layers layers = testing::lifted_layers(image<float>(16, 40, 1, 0.0F));
    for (std::int32_t y = 0; y < 16; ++y)
        for (std::int32_t x = 15; x < 20; ++x) layers.column<disparity_column>()[static_cast<std::size_t>(y * 40 + x)] = 1;
    for (std::int32_t y = 0; y < 16; ++y)
        for (const std::int32_t x : {15, 20})
            layers.edit_links([&](link_editor& links) { links.unlink(y * 40 + x, side::left); });
    const view v = own_view(layers.topology());
    // The near strip moves 10 to the right, the far plane 2: the strip moves from columns [15, 20) to [25, 30), and
    // uncovers columns [17, 22) of the plane.
    const photo_layers peeled = peel(layers, scene_range, v, moved_view(v.camera, scene_range, 1, 10)).layers;
    const graph& g = peeled.topology();
    std::size_t near_pixels = 0;
    for (std::size_t i = 0; i < g.size(); ++i) {
        const bool is_near = peeled.column<disparity_column>()[i] > 0.5F;
        near_pixels += is_near ? 1 : 0;
        CHECK((is_near ? g.x()[i] >= 25 && g.x()[i] < 30 : g.x()[i] >= 2 && (g.x()[i] < 17 || g.x()[i] >= 22)));
        const bool at_tear = is_near ? g.x()[i] == 29 : g.x()[i] == 16 || g.x()[i] == 39;
        CHECK((g.right()[i] == no_pixel) == at_tear);
        if (g.right()[i] != no_pixel)
            CHECK((peeled.column<disparity_column>()[static_cast<std::size_t>(g.right()[i])] > 0.5F) == is_near);
    }
    CHECK(near_pixels == 16 * 5);
    CHECK(g.size() == 16 * (5 + 15 + 18));
}

TEST_CASE("a slope that folds back is linked only on either side of the fold, and disappears if back faces are excluded") {
    // In the view from the side, the ends of this steep slope change places. The view therefore shows the slope's back, with
    // nothing in front.
    photo_layers layers = testing::lifted_layers(image<float>(6, 40, 1, 0.0F));
    for (std::size_t i = 0; i < layers.size(); ++i)
        layers.column<disparity_column>()[i] = std::clamp(static_cast<float>(layers.topology().x()[i] - 10) * 0.1F, 0.0F, 1.0F);
    const view v = own_view(layers.topology());
    const view from = moved_view(v.camera, scene_range, 1, -25);  // reverses the order of the slope's pixels
    const photo_layers both = peel(layers, scene_range, v, from).layers;
    CHECK(!validate_canonical(both.topology(), both.column<disparity_column>()));
    CHECK(connected_components(both.topology()).count() == 3);
    peel_options options;
    options.both_sides = false;
    const photo_layers front = peel(layers, scene_range, v, from, options).layers;
    CHECK(connected_components(front.topology()).count() == 2);
    CHECK(front.size() < both.size());
}

TEST_CASE("peel() returns the same layers on any number of threads") {
    std::mt19937 random(2);
    const photo_layers layers = random_lifted(random, 50, 45);
    const view v = own_view(layers.topology()), from = random_view(v, random);
    thread_pool threads(3);
    const photo_layers one = peel(layers, scene_range, v, from).layers,
                       many = peel(layers, scene_range, v, from, {}, threads).layers;
    CHECK(one.topology() == many.topology());
    CHECK(one.column<color_column>() == many.column<color_column>());
    CHECK(one.column<disparity_column>() == many.column<disparity_column>());
}
