// Every stage of depth/ checks the shapes of its maps.
#include "tests/support/errors.hpp"

#include <ldi/depth/align_silhouettes.hpp>
#include <ldi/depth/flakes.hpp>
#include <ldi/depth/level_dips.hpp>
#include <ldi/depth/middle_components.hpp>
#include <ldi/depth/network_decider.hpp>
#include <ldi/depth/resample.hpp>
#include <ldi/depth/sharpen_edges.hpp>
#include <ldi/depth/step_band.hpp>
#include <ldi/depth/weighted_median.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>

TEST_CASE("every stage that reads a depth map refuses maps that do not have exactly 1 channel, and accepts empty maps") {
    const auto refuses = [](const char* stage, auto&& run) {
        for (const std::size_t channels : {0U, 2U, 3U}) {
            ldi::image<float> map(12, 16, channels);
            CHECK_THAT(ldi::testing::message_of([&] { run(map); }),
                       Catch::StartsWith(std::string(stage) + ": ") && Catch::Contains("mismatch"));
        }
        ldi::image<float> empty, single(12, 16);
        CHECK_NOTHROW((run(empty), run(single)));
    };
    refuses("level_dips", [](ldi::image<float>& map) { ldi::level_dips(map); });
    refuses("sharpen_edges", [](ldi::image<float>& map) { ldi::sharpen_edges(map); });
    refuses("weighted_median", [](ldi::image<float>& map) { ldi::weighted_median(map); });
    refuses("merge_middle_components", [](ldi::image<float>& map) { ldi::merge_middle_components(map); });
    refuses("merge_flakes", [](ldi::image<float>& map) {
        ldi::merge_flakes(map, ldi::image<std::uint8_t>(map.height(), map.width(), map.channels()));
    });
    refuses("find_step_band", [](ldi::image<float>& map) { ldi::find_step_band(map); });
}

TEST_CASE("stages that need finite disparities refuse infinity and NaN anywhere in the map") {
    const ldi::image<std::uint8_t> photo(24, 32, 3, std::uint8_t{90});
    for (const float wrong : {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(), std::nanf("")})
        for (const std::size_t at : {0U, 100U, 191U}) {
            ldi::image<float> map(12, 16, 1, 0.5F);
            map.data()[at] = wrong;
            const auto refuses = [&](auto&& run) {
                CHECK(ldi::testing::raised([&] { run(); }) == ldi::error_code::invalid_data);
            };
            refuses([&] { ldi::level_dips(map); });
            refuses([&] { ldi::sharpen_edges(map); });
            refuses([&] { ldi::weighted_median(map); });
            refuses([&] { ldi::find_step_band(map); });
            refuses([&] { ldi::merge_flakes(map, ldi::image<std::uint8_t>(12, 16)); });
            refuses([&] { ldi::resample_to_photo(map, photo); });
            refuses([&] { ldi::align_silhouettes(map, ldi::image<std::uint8_t>(12, 16, 3)); });
        }
    for (const ldi::step_band_options& wrong :
         {ldi::step_band_options{-1.0F, 0.1F}, {0.1F, -1.0F}, {0.1F, 0.0F}, {std::nanf(""), 0.1F}})
        CHECK(ldi::testing::raised([&] { ldi::find_step_band(ldi::image<float>(12, 16), wrong); }) ==
              ldi::error_code::invalid_option);
}

TEST_CASE("stages that number pixels with 32 bits refuse 2^31 pixels before they read one") {
    float value = 0;
    for (const std::size_t rows : {std::size_t{1} << 15, std::size_t{1} << 31}) {
        const std::size_t columns = (std::size_t{1} << 31) / rows;
        const auto refuses = [&](auto&& run) {
            CHECK(ldi::testing::raised([&] { run(ldi::image_view<float>(&value, rows, columns)); }) ==
                  ldi::error_code::too_large);
        };
        refuses([](ldi::image_view<float> map) { ldi::merge_middle_components(map); });
        refuses([](ldi::image_view<float> map) { ldi::find_step_band(map); });
        refuses([&](ldi::image_view<float> map) {
            const std::uint8_t share = 0;
            ldi::merge_flakes(map, ldi::image_view<const std::uint8_t>(&share, rows, columns, 1));
        });
        refuses([&](ldi::image_view<float> map) {
            const std::uint8_t color = 0;
            ldi::align_silhouettes(map, ldi::image_view<const std::uint8_t>(&color, rows, columns, 3));
        });
    }
}

TEST_CASE("network_decider refuses a photo or an estimate of another shape") {
    struct undecided_network {
        ldi::buffer<float> logits(const ldi::pixel_region& region, const ldi::buffer<std::uint8_t>&,
                                  std::span<const std::uint8_t>, const ldi::serial_executor&) const {
            return ldi::buffer<float>(2 * region.size(), 0.0F);
        }
    };
    const undecided_network network;
    const auto result_of = [&](const ldi::image<std::uint8_t>& photo, const ldi::image<float>& estimated, std::size_t channels) {
        ldi::image<float> map(12, 16, channels);
        std::fill_n(map.data(), map.size() / 2, 0.9F);
        return ldi::testing::raised([&] {
            ldi::network_decider(&network).decide({photo, estimated, std::move(map), {}, 2.0F}, ldi::serial_executor());
        });
    };
    const ldi::image<std::uint8_t> photo(12, 16, 3);
    const ldi::image<float> estimated(6, 8);
    CHECK_FALSE(result_of(photo, estimated, 1));
    CHECK(result_of(photo, estimated, 2) == ldi::error_code::mismatch);
    for (const ldi::image<std::uint8_t>& other : {ldi::image<std::uint8_t>(6, 8, 3), {12, 16, 1}, {}})
        CHECK(result_of(other, estimated, 1) == ldi::error_code::mismatch);
    for (const ldi::image<float>& other : {ldi::image<float>(6, 8, 3), {}})
        CHECK(result_of(photo, other, 1) == ldi::error_code::mismatch);
}
