#include <ldi/mesh/detail/crossings.hpp>

#include <catch2/catch.hpp>
#include <tests/mesh/random_polygons.hpp>

#include <algorithm>
#include <set>
#include <utility>

namespace {

using pairs = std::set<std::pair<std::int32_t, std::int32_t>>;

struct collected {
    pairs collisions, overlaps;
    std::set<std::int32_t> spikes;

    void collision(std::int32_t v, std::int32_t w) { collisions.insert(std::minmax(v, w)); }
    void overlap(std::int32_t v, std::int32_t w) { overlaps.insert(std::minmax(v, w)); }
    void spike(std::int32_t v) { spikes.insert(v); }
    bool empty() const { return collisions.empty() && overlaps.empty() && spikes.empty(); }
};

collected all_of(const ldi::polygon& p) {
    ldi::detail::crossing_finder finder;
    collected result;
    finder.find_all(p, result);
    return result;
}

ldi::polygon random_chain(std::mt19937& random) {
    ldi::polygon p;
    const std::size_t count = 3 + random() % 9;
    for (std::size_t v = 0; v < count; ++v) {
        p.points.push_back({static_cast<std::int32_t>(random() % 12), static_cast<std::int32_t>(random() % 12)});
        p.next.push_back(static_cast<std::int32_t>((v + 1) % count));
    }
    p.outline_count = static_cast<std::int32_t>(count);
    return p;
}

// Whether two edges share a point that is not an end of both.
bool collide(const ldi::polygon& p, std::int32_t v, std::int32_t w) {
    const auto point = [&](std::int32_t i) { return p.points[static_cast<std::size_t>(i)]; };
    const auto next = [&](std::int32_t i) { return p.next[static_cast<std::size_t>(i)]; };
    const ldi::lattice_point a = point(v), b = point(next(v)), c = point(w), d = point(next(w));
    const auto same = [](ldi::lattice_point q, ldi::lattice_point r) { return q.x == r.x && q.y == r.y; };
    const auto inside = [&](ldi::lattice_point q, ldi::lattice_point r, ldi::lattice_point s) {
        return ldi::testing::twice_area(r, s, q) == 0 && !same(q, r) && !same(q, s) && std::min(r.x, s.x) <= q.x &&
               q.x <= std::max(r.x, s.x) && std::min(r.y, s.y) <= q.y && q.y <= std::max(r.y, s.y);
    };
    if (inside(a, c, d) || inside(b, c, d) || inside(c, a, b) || inside(d, a, b)) return true;
    const auto between = [](std::int64_t s, std::int64_t t) { return (s < 0 && t > 0) || (s > 0 && t < 0); };
    return between(ldi::testing::twice_area(a, b, c), ldi::testing::twice_area(a, b, d)) &&
           between(ldi::testing::twice_area(c, d, a), ldi::testing::twice_area(c, d, b));
}

}  // namespace

TEST_CASE("find_all() finds exactly the pairs of edges that cross or touch other than at a common vertex") {
    std::mt19937 random(11);
    std::size_t found = 0;
    for (int i = 0; i < 20000; ++i) {
        const ldi::polygon p = random_chain(random);
        pairs expected;
        for (std::int32_t v = 0; v < p.outline_count; ++v)
            for (std::int32_t w = v + 1; w < p.outline_count; ++w)
                if (collide(p, v, w)) expected.insert({v, w});
        REQUIRE(all_of(p).collisions == expected);
        found += expected.size();
    }
    REQUIRE(found > 10000);
}

TEST_CASE("find_fresh() finds all collisions that involve a fresh edge, and reports nothing that find_all() does not") {
    std::mt19937 random(12);
    ldi::detail::crossing_finder finder;
    for (int i = 0; i < 10000; ++i) {
        const ldi::polygon p = random_chain(random);
        ldi::buffer<std::uint8_t> fresh;
        for (std::int32_t v = 0; v < p.outline_count; ++v) fresh.push_back(random() % 2 == 0 ? 1 : 0);
        collected some;
        finder.find_fresh(p, fresh, some);
        const collected all = all_of(p);
        pairs expected;
        for (const auto& [v, w] : all.collisions)
            if (fresh[static_cast<std::size_t>(v)] != 0 || fresh[static_cast<std::size_t>(w)] != 0) expected.insert({v, w});
        REQUIRE(some.collisions == expected);
        REQUIRE(std::includes(all.overlaps.begin(), all.overlaps.end(), some.overlaps.begin(), some.overlaps.end()));
        REQUIRE(std::includes(all.spikes.begin(), all.spikes.end(), some.spikes.begin(), some.spikes.end()));
        std::fill(fresh.begin(), fresh.end(), std::uint8_t{1});
        collected again;
        finder.find_fresh(p, fresh, again);
        REQUIRE(again.collisions == all.collisions);
        REQUIRE(again.overlaps == all.overlaps);
        REQUIRE(again.spikes == all.spikes);
    }
}

TEST_CASE("the detailed outlines of charts have no collisions and no overlaps") {
    for (std::uint32_t seed = 0; seed < 1000; ++seed) {
        const ldi::testing::charted_graph c = ldi::testing::random_charts(seed, 10);
        const ldi::chart_outlines outlines = ldi::trace_outlines(c.topology, c.disparity, c.charts);
        std::mt19937 random(seed);
        for (std::size_t chart = 0; chart < c.charts.charts.size(); ++chart) {
            const collected found = all_of(ldi::testing::chart_polygon(outlines, chart, 10, seed % 2 == 0 ? 0 : 2, random));
            REQUIRE(found.collisions.empty());
            REQUIRE(found.overlaps.empty());
        }
    }
}

TEST_CASE("two loops that touch at a point overlap only if one extends into the other") {
    // Two squares that touch at a corner, as two loops: valid. With the second one inside the first: invalid.
    ldi::polygon apart;
    apart.points = {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {4, 4}, {8, 4}, {8, 8}, {4, 8}};
    apart.next = {1, 2, 3, 0, 5, 6, 7, 4};
    apart.outline_count = 8;
    REQUIRE(all_of(apart).empty());
    ldi::polygon over = apart;
    over.points = {{0, 0}, {4, 0}, {4, 4}, {0, 4}, {4, 4}, {1, 3}, {2, 1}, {3, 1}};
    REQUIRE(all_of(over).overlaps == pairs{{2, 4}});
}
