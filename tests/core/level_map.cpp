#include <ldi/core/coarsening.hpp>
#include <ldi/core/level_map.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <type_traits>
#include <utility>

using namespace ldi;

namespace {

// Only coarsen() makes level maps with pixels, and nothing changes them.
template <class Map>
concept can_change_map = requires(Map& m) {
    m.kept()[0] = 1;
}
|| requires(Map& m) { m.parent()[0] = 1; }
|| requires(Map& m) { m.kept().push_back(1); }
|| requires(Map& m) { m.width() = 1; };
static_assert(!can_change_map<level_map>);
static_assert(!std::is_constructible_v<level_map, graph_view, buffer<std::int32_t>, buffer<std::int32_t>>);
static_assert(!std::is_aggregate_v<level_map>);

template <class Map>
constexpr bool shows_temporary_values = requires(Map (*make)()) {
    make().kept();
}
|| requires(Map (*make)()) { make().parent(); };
static_assert(!shows_temporary_values<level_map>);

}  // namespace

TEST_CASE("a level map without pixels is empty, and an assigned map has the size and pixels of the other") {
    level_map map;
    CHECK((map.width() == 0 && map.height() == 0 && map.kept().empty() && map.parent().empty()));
    const level_map other = coarsen(make_grid(5, 4)).map;
    map = other;
    CHECK((map.width() == 5 && map.height() == 4 && map.kept() == other.kept() && map.parent() == other.parent()));
    map = coarsen(make_grid(3, 1)).map;
    CHECK((map.width() == 3 && map.height() == 1 && map.kept().size() == 2 && map.parent().size() == 3));
    level_map& same = map;
    map = same;
    CHECK((map.width() == 3 && map.height() == 1 && map.kept().size() == 2 && map.parent().size() == 3));
}

TEST_CASE("a moved-from level map is empty") {
    level_map map = coarsen(make_grid(5, 4)).map;
    CHECK((map.width() == 5 && map.height() == 4 && map.kept().size() == 6 && map.parent().size() == 20));
    const level_map copy = map;
    level_map moved = std::move(map);
    CHECK((map.width() == 0 && map.height() == 0 && map.kept().empty() && map.parent().empty()));
    CHECK((moved.kept() == copy.kept() && moved.parent() == copy.parent()));
}

TEST_CASE("take_parent() moves the parents out of a level map and leaves it empty") {
    level_map map = coarsen(make_grid(5, 4)).map;
    const level_map copy = map;
    const std::int32_t* const values = map.parent().data();
    const buffer<std::int32_t> taken = std::move(map).take_parent();
    CHECK((map.width() == 0 && map.height() == 0 && map.kept().empty() && map.parent().empty()));
    CHECK((taken.data() == values && copy.parent() == taken));  // the same memory, not a copy
}
