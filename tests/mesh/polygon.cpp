#include <ldi/mesh/polygon.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <vector>

using ldi::lattice_point;

TEST_CASE("polygon events sort by row, column and vertex, and encode the vertex") {
    const std::vector<lattice_point> ascending{{1 << 16, -(1 << 16)}, {-(1 << 16), -1}, {-5, 0}, {0, 0}, {0, 0}, {7, 0},
                                               {-9, 1 << 16}};
    std::vector<std::uint64_t> events;
    for (std::size_t i = 0; i < ascending.size(); ++i)
        events.push_back(ldi::detail::polygon_event(ascending[i], static_cast<std::int32_t>(i)));
    for (std::size_t i = 0; i < events.size(); ++i) {
        CHECK(ldi::detail::vertex_of(events[i]) == static_cast<std::int32_t>(i));
        if (i == 0) continue;
        CHECK(events[i - 1] < events[i]);
        const bool same = ascending[i - 1] == ascending[i];
        CHECK(ldi::detail::at_same_point(events[i - 1], events[i]) == same);
        CHECK(ldi::detail::above(ascending[i - 1], ascending[i]) != same);
        CHECK_FALSE(ldi::detail::above(ascending[i], ascending[i - 1]));
    }
    constexpr std::int32_t last_vertex = (1 << 28) - 1;
    const std::uint64_t last_event = ldi::detail::polygon_event({-3, -4}, last_vertex);
    CHECK(ldi::detail::vertex_of(last_event) == last_vertex);
    CHECK(ldi::detail::at_same_point(last_event, ldi::detail::polygon_event({-3, -4}, 0)));
    CHECK(last_event < ldi::detail::polygon_event({-2, -4}, 0));
}

TEST_CASE("turn() is exact over the whole range of coordinates") {
    constexpr std::int32_t most = 1 << 16;
    CHECK(ldi::detail::turn({0, 0}, {1, 0}, {1, 1}) > 0);  // y points down
    CHECK(ldi::detail::turn({0, 0}, {1, 0}, {1, -1}) < 0);
    CHECK(ldi::detail::turn({-most, -most}, {0, 0}, {most, most}) == 0);
    CHECK(ldi::detail::turn({-most, -most}, {0, 0}, {most, most - 1}) < 0);
    CHECK(ldi::detail::turn({-most, -most}, {most, -most}, {most, most}) == std::int64_t{4} * most * most);
}
