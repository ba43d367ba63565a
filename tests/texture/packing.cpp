#include "tests/support/random_graph.hpp"

#include <ldi/texture/packing.hpp>

#include <catch2/catch.hpp>

#include <random>
#include <vector>

namespace {

using namespace ldi;
using ldi::testing::below;

std::vector<rectangle_size> random_rectangles(std::mt19937& random, std::int32_t count, std::int32_t longest) {
    std::vector<rectangle_size> sizes;
    for (std::int32_t i = 0; i < count; ++i) {
        // Mostly small rectangles and a few large ones, like charts.
        const std::int32_t bound = below(random, 4) == 0 ? longest : 1 + longest / 8;
        sizes.push_back({1 + below(random, bound), 1 + below(random, bound)});
    }
    return sizes;
}

/// Checks that all rectangles lie inside the sheet and do not overlap.
void check_packing(const std::vector<rectangle_size>& sizes, const packing& packed) {
    REQUIRE(packed.corners.size() == sizes.size());
    buffer<int> covered(static_cast<std::size_t>(packed.sheet.width) * static_cast<std::size_t>(packed.sheet.height), 0);
    for (std::size_t i = 0; i < sizes.size(); ++i) {
        const rectangle_corner c = packed.corners[i];
        REQUIRE(c.x >= 0);
        REQUIRE(c.y >= 0);
        REQUIRE(c.x + sizes[i].width <= packed.sheet.width);
        REQUIRE(c.y + sizes[i].height <= packed.sheet.height);
        for (std::int32_t y = c.y; y < c.y + sizes[i].height; ++y)
            for (std::int32_t x = c.x; x < c.x + sizes[i].width; ++x)
                ++covered[static_cast<std::size_t>(y) * static_cast<std::size_t>(packed.sheet.width) +
                          static_cast<std::size_t>(x)];
    }
    CHECK(std::count_if(covered.begin(), covered.end(), [](int n) { return n > 1; }) == 0);
}

double fill(const std::vector<rectangle_size>& sizes, const packing& packed) {
    double area = 0;
    for (const rectangle_size& s : sizes) area += static_cast<double>(s.width) * s.height;
    return area / (static_cast<double>(packed.sheet.width) * packed.sheet.height);
}

}  // namespace

TEST_CASE("packed rectangles lie in the sheet and do not overlap") {
    std::mt19937 random(1);
    for (int i = 0; i < 200; ++i) {
        const std::vector<rectangle_size> sizes = random_rectangles(random, 1 + below(random, 120), 1 + below(random, 60));
        const packing packed = pack(sizes, 512);
        check_packing(sizes, packed);
        CHECK(packed.sheet.width <= 512);
        CHECK(packed.sheet.height <= 512);
    }
}

TEST_CASE("rectangles on several sheets do not overlap, and each sheet is no larger than its content") {
    std::mt19937 random(7);
    for (int i = 0; i < 100; ++i) {
        const std::int32_t longest = 1 + below(random, 60);
        const std::vector<rectangle_size> sizes = random_rectangles(random, 1 + below(random, 120), longest);
        const sheet_packing packed = pack_on_sheets(sizes, longest + below(random, 40));
        std::size_t placed = 0;
        for (std::int32_t sheet = 0; sheet < packed.sheets.count(); ++sheet) {
            std::vector<rectangle_size> here;
            packing one;
            rectangle_size used;
            for (std::size_t k = 0; k < sizes.size(); ++k) {
                if (packed.sheet_of[k] != sheet) continue;
                here.push_back(sizes[k]), one.corners.push_back(packed.corners[k]);
                used = {std::max(used.width, packed.corners[k].x + sizes[k].width),
                        std::max(used.height, packed.corners[k].y + sizes[k].height)};
            }
            one.sheet = packed.sheets[sheet];
            CHECK(one.sheet == used);
            check_packing(here, one);
            placed += here.size();
        }
        CHECK(placed == sizes.size());
    }
    CHECK_THROWS_AS(pack_on_sheets(std::vector<rectangle_size>{{3, 9}}, 8), error);
    CHECK(pack_on_sheets({}, 8).sheets.empty());
}

TEST_CASE("many rectangles fill more than four fifths of their sheet") {
    std::mt19937 random(2);
    for (int i = 0; i < 20; ++i) {
        const std::vector<rectangle_size> sizes = random_rectangles(random, 300, 60);
        CHECK(fill(sizes, pack(sizes, 4096)) > 0.8);
    }
}

TEST_CASE("a single rectangle gets a sheet of its own size") {
    const packing packed = pack(std::vector<rectangle_size>{{73, 109}}, 512);
    CHECK(packed.sheet == rectangle_size{73, 109});
    CHECK(packed.corners[0].x == 0);
    CHECK(packed.corners[0].y == 0);
}

TEST_CASE("equal squares fill a square sheet completely") {
    const std::vector<rectangle_size> sizes(64, {5, 5});
    CHECK(fill(sizes, pack(sizes, 40)) == Approx(1.0));
}

TEST_CASE("a sheet of the maximum size is tried before packing is refused") {
    const std::vector<rectangle_size> sizes{{10, 2}, {10, 3}, {10, 5}};
    check_packing(sizes, pack(sizes, 10));
    CHECK_THROWS_AS(pack(sizes, 9), error);
    CHECK_THROWS_AS(pack(std::vector<rectangle_size>(101, {1, 1}), 10), error);
}

TEST_CASE("rectangles without area are refused") {
    for (const rectangle_size size : {rectangle_size{0, 0}, {1, 0}, {0, 1}, {-1, 1}}) {
        const std::vector<rectangle_size> sizes{{2, 2}, size};
        CHECK_THROWS_AS(pack(sizes, 16), error);
        CHECK_THROWS_AS(pack_on_sheets(sizes, 16), error);
    }
}

TEST_CASE("packing zero rectangles returns an empty sheet") {
    const packing packed = pack({}, 512);
    CHECK(packed.corners.empty());
    CHECK(packed.sheet == rectangle_size{0, 0});
}

TEST_CASE("ten thousand small rectangles are packed without deep recursion") {
    const std::vector<rectangle_size> sizes(10'000, {1, 1});
    const packing packed = pack(sizes, 512);
    check_packing(sizes, packed);
    CHECK(fill(sizes, packed) > 0.98);
}

TEST_CASE("after a rectangle is placed, the larger remaining strip keeps its full length") {
    packing_tree tree({10, 6});
    rectangle_corner corner;
    REQUIRE(tree.insert({4, 4}, corner));  // 6 remain on the right, 2 below: the right strip keeps its full height
    CHECK(corner.x == 0);
    CHECK(corner.y == 0);
    REQUIRE(tree.insert({6, 6}, corner));
    CHECK(corner.x == 4);
    CHECK(corner.y == 0);
    REQUIRE(tree.insert({4, 2}, corner));
    CHECK(corner.x == 0);
    CHECK(corner.y == 4);
    CHECK(!tree.insert({1, 1}, corner));
}

TEST_CASE("rectangles of equal size are placed in their order, so that every standard library packs them alike") {
    const std::vector<rectangle_size> sizes(30, {7, 5});
    const packing packed = pack(sizes, 512);
    for (std::size_t i = 1; i < sizes.size(); ++i) {
        const rectangle_corner &before = packed.corners[i - 1], &here = packed.corners[i];
        CHECK((before.y < here.y || before.x < here.x));
    }
    CHECK((packed.corners[0].x == 0 && packed.corners[0].y == 0));
}
