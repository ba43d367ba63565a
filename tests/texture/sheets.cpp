#include <ldi/texture/sheets.hpp>

#include "tests/support/errors.hpp"
#include "tests/texture/photo_scene.hpp"

#include <ldi/charts/charts.hpp>
#include <ldi/kernels/area_resize.hpp>

#include <catch2/catch.hpp>
#include <tests/support/errors.hpp>

#include <algorithm>
#include <cmath>

namespace {

using namespace ldi;
using namespace ldi::testing;

/// A photo larger than its layered image, and its sheets.
struct sheet_scene {
    image<std::uint8_t> photo, worked_on;
    photo_layers layers;
    chart_set charts;
    texture_atlas atlas;
    sheet_options options;
    sheet_layout layout;
    std::vector<image<std::uint8_t>> sheets;  // sheet s has index s - 1
};

/// disparity   one value per pixel of the layered image
/// sheet_side  maximum width and height of a sheet in texels
template <class Executor>
sheet_scene make_scene(image<std::uint8_t> photo, const image<float>& disparity, std::int32_t sheet_side, Executor&& threads) {
    sheet_scene s;
    s.worked_on = area_resize(photo, disparity.height(), disparity.width());
    s.photo = std::move(photo);
    s.layers = with_hidden_surfaces(lift(s.worked_on, disparity));
    s.options.max_side = sheet_side;
    const double scale = std::max(static_cast<double>(s.photo.width()) / static_cast<double>(disparity.width()),
                                  static_cast<double>(s.photo.height()) / static_cast<double>(disparity.height()));
    chart_options cut;
    cut.max_side = std::min(cut.max_side, max_chart_side(scale, s.options));
    s.charts = make_charts(s.layers, {}, cut);
    s.atlas = make_atlas(s.layers, s.charts);
    s.layout = lay_out_sheets(s.layers, s.charts, s.atlas, s.photo.height(), s.photo.width(), s.options);
    for (std::size_t i = 1; i < s.layout.sizes.size(); ++i)
        s.sheets.push_back(draw_sheet(s.layout, i, s.charts, s.atlas, s.worked_on, s.photo, threads));
    return s;
}

image<std::uint8_t> noise(std::mt19937& random, std::size_t rows, std::size_t columns) {
    image<std::uint8_t> photo(rows, columns, 3);
    for (std::uint8_t& value : photo) value = static_cast<std::uint8_t>(random());
    return photo;
}

/// The layered image has 60 to 119 rows and columns. The photo is 1.01 to 6 times as large in each direction.
sheet_scene random_sheet_scene(std::mt19937& random, const serial_executor& threads = {}) {
    const std::size_t rows = 60 + random() % 60, columns = 60 + random() % 60;
    const double scale = 1.01 + static_cast<double>(random() % 500) / 100;
    const std::size_t photo_rows = static_cast<std::size_t>(scale * static_cast<double>(rows));
    const std::size_t photo_columns = static_cast<std::size_t>(scale * static_cast<double>(columns)) + random() % 3;
    return make_scene(noise(random, photo_rows, photo_columns), ldi::testing::random_disparity(random, rows, columns),
                      std::int32_t{256} + 16 * static_cast<std::int32_t>(random() % 16), threads);
}

/// The texel on its sheet that shows a pixel of the photo in chart c.
const std::uint8_t* texel_of(const sheet_scene& s, std::int32_t c, std::int32_t photo_x, std::int32_t photo_y) {
    const sheet_placement& place = s.layout.placements[c];
    const std::int32_t x = photo_x - place.photo_x, y = photo_y - place.photo_y;
    REQUIRE((x >= 0 && y >= 0 && x < place.room.width && y < place.room.height));
    return s.sheets[static_cast<std::size_t>(place.sheet - 1)].row(place.room.y + y) + 3 * (place.room.x + x);
}

/// For each pixel of the layered image that is on a sheet, calls visit(pixel, x, y) for all pixels (x, y) of the photo whose
/// centers lie inside that pixel.
template <class Visit>
void for_each_texel(const sheet_scene& s, Visit&& visit) {
    const graph& g = s.layers.topology();
    for (std::int32_t i = 0; i < g.count(); ++i) {
        if (s.layout.placements[s.charts.chart_of[i]].sheet == 0) continue;
        for (std::int64_t y = s.layout.down.first_at(g.y()[i]); y < s.layout.down.last_at(g.y()[i] + 1); ++y)
            for (std::int64_t x = s.layout.across.first_at(g.x()[i]); x < s.layout.across.last_at(g.x()[i] + 1); ++x)
                if (s.layout.across.pixel_of(x) == g.x()[i] && s.layout.down.pixel_of(y) == g.y()[i])
                    visit(i, static_cast<std::int32_t>(x), static_cast<std::int32_t>(y));
    }
}

/// Position of the texel of the atlas that shows a pixel.
struct atlas_place {
    std::int32_t x, y;
};
atlas_place in_atlas(const sheet_scene& s, std::int32_t pixel) {
    const std::int32_t c = s.charts.chart_of[pixel];
    return {s.layers.topology().x()[pixel] - s.charts.charts[c].x + s.atlas.placements[c].x,
            s.layers.topology().y()[pixel] - s.charts.charts[c].y + s.atlas.placements[c].y};
}

}  // namespace

TEST_CASE("rectangles of charts on a sheet do not overlap, and only charts with pixels of the photo have such a rectangle") {
    std::mt19937 random(11);
    for (int repeat = 0; repeat < 12; ++repeat) {
        const sheet_scene s = random_sheet_scene(random);
        REQUIRE(s.layout.sizes[0] == rectangle_size{static_cast<std::int32_t>(s.atlas.color.width()),
                                                    static_cast<std::int32_t>(s.atlas.color.height())});
        std::vector<image<std::uint8_t>> taken;
        for (std::size_t i = 1; i < s.layout.sizes.size(); ++i) {
            const rectangle_size size = s.layout.sizes[i];
            REQUIRE((size.width % 16 == 0 && size.height % 16 == 0));
            REQUIRE(std::max(size.width, size.height) <= s.options.max_side);
            taken.emplace_back(static_cast<std::size_t>(size.height), static_cast<std::size_t>(size.width));
        }
        for (std::int32_t c = 0; c < s.charts.charts.count(); ++c) {
            const chart_pixels& pixels = s.charts.charts[c].pixels;
            const bool shows_photo = std::any_of(pixels.begin(), pixels.end(),
                                                 [&](std::int32_t i) { return s.layers.column<known_column>()[i] != 0; });
            const sheet_placement& place = s.layout.placements[c];
            REQUIRE((place.sheet > 0) == shows_photo);
            if (place.sheet == 0) continue;
            const atlas_rectangle room = place.room;
            REQUIRE((room.x % 16 == 0 && room.y % 16 == 0 && room.width % 16 == 0 && room.height % 16 == 0));
            for (std::int32_t y = room.y; y < room.y + room.height; ++y)
                for (std::int32_t x = room.x; x < room.x + room.width; ++x)
                    REQUIRE(++taken[static_cast<std::size_t>(place.sheet - 1)](y, x) == 1);
        }
    }
}

TEST_CASE("away from silhouettes, sheets show the photo byte for byte") {
    std::mt19937 random(12);
    std::size_t compared = 0, all = 0;
    for (int repeat = 0; repeat < 12; ++repeat) {
        const sheet_scene s = random_sheet_scene(random);
        // Whether a pixel and all pixels up to two columns and rows away have the photo's color.
        const auto is_the_photos = [&](std::int32_t pixel) {
            const graph& g = s.layers.topology();
            const atlas_place at = in_atlas(s, pixel);
            for (std::int32_t y = -2; y <= 2; ++y)
                for (std::int32_t x = -2; x <= 2; ++x) {
                    const std::int32_t u = g.x()[pixel] + x, v = g.y()[pixel] + y;
                    if (u < 0 || v < 0 || u >= g.width() || v >= g.height()) continue;
                    const texel_kind kind = s.atlas.kind(at.y + y, at.x + x);
                    if (kind != texel_kind::photo && kind != texel_kind::copied) return false;
                    if (!std::equal(s.worked_on.row(v) + 3 * u, s.worked_on.row(v) + 3 * u + 3,
                                    s.atlas.color.row(at.y + y) + 3 * (at.x + x)))
                        return false;
                }
            return true;
        };
        std::int32_t last = -1;
        bool is_same = false;
        for_each_texel(s, [&](std::int32_t pixel, std::int32_t x, std::int32_t y) {
            if (pixel != last) is_same = is_the_photos(pixel), last = pixel;
            ++all;
            if (!is_same) return;
            ++compared;
            const std::uint8_t* const texel = texel_of(s, s.charts.chart_of[pixel], x, y);
            REQUIRE(std::equal(texel, texel + 3, s.photo.row(y) + 3 * x));
        });
    }
    CHECK(compared > all / 5);  // only a small part of such a small photo is far from silhouettes
}

TEST_CASE("hidden surfaces on a sheet have colors between those of the surrounding atlas texels") {
    std::mt19937 random(13);
    std::size_t compared = 0;
    for (int repeat = 0; repeat < 6; ++repeat) {
        const sheet_scene s = random_sheet_scene(random);
        for_each_texel(s, [&](std::int32_t pixel, std::int32_t x, std::int32_t y) {
            const atlas_place at = in_atlas(s, pixel);
            if (s.atlas.kind(at.y, at.x) != texel_kind::occluded) return;
            ++compared;
            const std::uint8_t* const texel = texel_of(s, s.charts.chart_of[pixel], x, y);
            for (std::size_t c = 0; c < 3; ++c) {
                std::uint8_t least = 255, most = 0;
                for (std::int32_t v = at.y - 1; v <= at.y + 1; ++v)
                    for (std::int32_t u = at.x - 1; u <= at.x + 1; ++u)
                        least = std::min(least, s.atlas.color(v, u, c)), most = std::max(most, s.atlas.color(v, u, c));
                REQUIRE((texel[c] >= least && texel[c] <= most));
            }
        });
    }
    CHECK(compared > 1000);
}

TEST_CASE("colors of hidden surfaces on a sheet are interpolated between the centers of atlas texels") {
    std::mt19937 random(17);
    sheet_scene s = random_sheet_scene(random);
    const graph& g = s.layers.topology();
    for (std::int32_t i = 0; i < g.count(); ++i) {  // red is a ramp along rows of the layered image, and green along columns
        const atlas_place at = in_atlas(s, i);
        for (std::int32_t v = -1; v <= 1; ++v)
            for (std::int32_t u = -1; u <= 1; ++u) {
                s.atlas.color(at.y + v, at.x + u, 0) = static_cast<std::uint8_t>(2 * std::max(g.x()[i] + u, 0));
                s.atlas.color(at.y + v, at.x + u, 1) = static_cast<std::uint8_t>(2 * std::max(g.y()[i] + v, 0));
            }
    }
    double across = 0, down = 0, count = 0;
    for (std::size_t sheet = 1; sheet < s.layout.sizes.size(); ++sheet)
        s.sheets[sheet - 1] = draw_sheet(s.layout, sheet, s.charts, s.atlas, s.worked_on, s.photo);
    for_each_texel(s, [&](std::int32_t pixel, std::int32_t x, std::int32_t y) {
        const atlas_place at = in_atlas(s, pixel);
        if (s.atlas.kind(at.y, at.x) != texel_kind::occluded || g.x()[pixel] == 0 || g.y()[pixel] == 0) return;
        const std::uint8_t* const texel = texel_of(s, s.charts.chart_of[pixel], x, y);
        across += texel[0] - 2 * (s.layout.across.in_layers(x + 0.5) - 0.5);
        down += texel[1] - 2 * (s.layout.down.in_layers(y + 0.5) - 0.5);
        count += 1;
    });
    CHECK(count > 200);
    CHECK(across / count == Approx(0.0).margin(0.15));
    CHECK(down / count == Approx(0.0).margin(0.15));
}

TEST_CASE("sheets contain almost no colors that the photo mixes at silhouettes") {
    // A textured bright disc in front of a textured dark wall. The rim of the disc is blurred over six pixels of the photo.
    constexpr std::size_t scale = 4, side = 120;
    std::mt19937 random(14);
    image<std::uint8_t> photo(scale * side, scale * side, 3);
    image<float> disparity(side, side);
    const auto distance = [](double x, double y, double of) { return std::hypot(x + 0.5 - of / 2, y + 0.5 - of / 2); };
    for (std::size_t y = 0; y < scale * side; ++y)
        for (std::size_t x = 0; x < scale * side; ++x) {
            const double from_rim = distance(static_cast<double>(x), static_cast<double>(y), scale * side) - 0.3 * scale * side;
            const double share = std::clamp(0.5 - from_rim / 6, 0.0, 1.0);
            for (std::size_t c = 0; c < 3; ++c)
                photo(y, x, c) = static_cast<std::uint8_t>(share * 200 + (1 - share) * 40 + static_cast<double>(random() % 20));
        }
    for (std::size_t y = 0; y < side; ++y)
        for (std::size_t x = 0; x < side; ++x)
            disparity(y, x) = distance(static_cast<double>(x), static_cast<double>(y), side) < 0.3 * side ? 0.8F : 0.2F;
    const sheet_scene s = make_scene(std::move(photo), disparity, 1024, serial_executor());
    std::size_t mixed_in_photo = 0, mixed = 0, all = 0;
    for_each_texel(s, [&](std::int32_t pixel, std::int32_t x, std::int32_t y) {
        const atlas_place at = in_atlas(s, pixel);
        if (s.atlas.kind(at.y, at.x) == texel_kind::occluded) return;
        const bool is_disc = s.layers.column<disparity_column>()[pixel] > 0.5F;
        const auto is_mixed = [&](const std::uint8_t* color) { return is_disc ? color[1] < 180 : color[1] > 80; };
        ++all;
        mixed_in_photo += is_mixed(s.photo.row(y) + 3 * x) ? 1U : 0U;
        mixed += is_mixed(texel_of(s, s.charts.chart_of[pixel], x, y)) ? 1U : 0U;
    });
    CAPTURE(all, mixed_in_photo, mixed);
    CHECK(mixed_in_photo > 3000);
    CHECK(mixed < mixed_in_photo / 50);
}

TEST_CASE("sheets are the same on any number of threads") {
    std::mt19937 random(15);
    const image<std::uint8_t> photo = noise(random, 350, 410);
    const image<float> disparity = ldi::testing::random_disparity(random, 80, 94);
    const sheet_scene serial = make_scene(photo, disparity, 512, serial_executor());
    thread_pool threads(4);
    CHECK(make_scene(photo, disparity, 512, threads).sheets == serial.sheets);
}

TEST_CASE("invalid options, mismatched images and photos too large for the sheets are refused") {
    std::mt19937 random(16);
    const sheet_scene s = random_sheet_scene(random);
    const auto lay_out = [&](std::int32_t side, std::int32_t padding, std::size_t times) {
        lay_out_sheets(s.layers, s.charts, s.atlas, times * s.photo.height(), times * s.photo.width(), {side, padding});
    };
    CHECK(testing::raised([&] { lay_out(1000, 4, 1); }) == error_code::invalid_option);
    CHECK(testing::raised([&] { lay_out(1024, 0, 1); }) == error_code::invalid_option);
    CHECK(testing::raised([&] { lay_out(1024, 9, 1); }) == error_code::mismatch);  // the atlas has less padding
    CHECK(testing::raised([&] { lay_out(1024, 4, 30); }) == error_code::too_large);
    CHECK(testing::raised([&] { max_chart_side(200); }) == error_code::too_large);
    CHECK(max_chart_side(1.0) > 4000);
    for (const double scale : {0.0, -1.0, std::nan("")})
        CHECK(testing::raised([&] { max_chart_side(scale); }) == error_code::invalid_option);
    if constexpr (sizeof(std::size_t) > 4)
        CHECK(testing::raised([&] { lay_out_sheets(s.layers, s.charts, s.atlas, 100, std::size_t{1} << 31); }) ==
              error_code::too_large);
    chart_set other_charts = s.charts;
    other_charts.charts.front().pixels.push_back(s.layers.topology().count());
    const auto lay_out_others = [&] { lay_out_sheets(s.layers, other_charts, s.atlas, s.photo.height(), s.photo.width()); };
    CHECK(testing::raised(lay_out_others) == error_code::mismatch);
    const auto draw = [&](std::size_t sheet, image_view<const std::uint8_t> worked_on, image_view<const std::uint8_t> photo) {
        draw_sheet(s.layout, sheet, s.charts, s.atlas, worked_on, photo);
    };
    CHECK(testing::raised([&] { draw(0, s.worked_on, s.photo); }) == error_code::mismatch);
    CHECK(testing::raised([&] { draw(s.layout.sizes.size(), s.worked_on, s.photo); }) == error_code::mismatch);
    CHECK(testing::raised([&] { draw(1, s.photo, s.photo); }) == error_code::mismatch);
    CHECK(testing::raised([&] { draw(1, s.worked_on, s.worked_on); }) == error_code::mismatch);
    texture_atlas small = s.atlas;
    small.color = image<std::uint8_t>(16, 16, 3);
    CHECK(testing::raised([&] { lay_out_sheets(s.layers, s.charts, small, s.photo.height(), s.photo.width()); }) ==
          error_code::mismatch);
    CHECK(testing::raised([&] { draw_sheet(s.layout, 1, s.charts, small, s.worked_on, s.photo); }) == error_code::mismatch);
    sheet_layout outside = s.layout;
    for (sheet_placement& place : outside.placements) place.room.x += 16 * place.sheet * s.layout.sizes[1].width;
    CHECK(testing::raised([&] { draw_sheet(outside, 1, s.charts, s.atlas, s.worked_on, s.photo); }) == error_code::mismatch);
    sheet_layout moved = s.layout;
    for (sheet_placement& place : moved.placements) place.photo_y += 3;
    CHECK(testing::raised([&] { draw_sheet(moved, 1, s.charts, s.atlas, s.worked_on, s.photo); }) == error_code::mismatch);
}
