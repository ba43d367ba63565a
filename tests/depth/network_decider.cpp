#include <ldi/depth/network_decider.hpp>

#include "tests/support/counted_memory.hpp"
#include "tests/support/hard_maps.hpp"

#include <catch2/catch.hpp>
#include <tests/support/errors.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

using namespace ldi;

namespace {

/// Replaces the network: computes the logit of each pixel from its eight input bytes and its number.
template <class Logit>
struct network_like {
    Logit logit;

    template <class Executor>
    buffer<float> logits(const pixel_region& region, const buffer<std::uint8_t>& input, std::span<const std::uint8_t>,
                         Executor&) const {
        buffer<float> result(2 * region.size(), 0.0F);
        for (std::size_t i = 0; i < region.size(); ++i) result[2 * i] = logit(std::span(input).subspan(8 * i, 8), i);
        return result;
    }
};
template <class Logit>
network_like(Logit) -> network_like<Logit>;

/// Decides by the photo's red channel alone: bright pixels are in front.
constexpr auto by_red = [](std::span<const std::uint8_t> input, std::size_t) { return input[0] > 128 ? 20.0F : -20.0F; };
constexpr auto by_disparity = [](std::span<const std::uint8_t>, std::size_t) { return 0.0F; };
/// Decides pseudo-randomly, by the number of the pixel.
constexpr auto at_random = [](std::span<const std::uint8_t>, std::size_t i) {
    return (i * 2654435761U >> 16) % 2 == 0 ? 20.0F : -20.0F;
};

template <class Logit>
decided_depth decide(Logit logit, image_view<const std::uint8_t> photo, const image<float>& estimated, image<float> disparity) {
    const network_like network{logit};
    return network_decider(&network).decide({photo, estimated, std::move(disparity), {}, 1.2F}, serial_executor());
}

image<std::uint8_t> halves(std::size_t height, std::size_t width, std::size_t edge) {
    image<std::uint8_t> photo(height, width, 3, std::uint8_t{20});
    for (std::size_t y = 0; y < height; ++y) std::fill_n(photo.row(y), 3 * edge, std::uint8_t{220});
    return photo;
}

/// A foreground on the left, a background on the right, and a linear transition between columns `first` and `last`.
image<float> ramp(std::size_t height, std::size_t width, std::size_t first, std::size_t last, float slope = 0) {
    image<float> map(height, width);
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) {
            const float way = x <= first  ? 0.0F
                              : x >= last ? 1.0F
                                          : static_cast<float>(x - first) / static_cast<float>(last - first);
            map(y, x) = 0.8F - 0.6F * way + slope * static_cast<float>(y);
        }
    return map;
}

}  // namespace

TEST_CASE("a blurred step becomes two surfaces that meet at the edge chosen by the network") {
    for (const std::size_t edge : {std::size_t{36}, std::size_t{40}, std::size_t{44}})
        for (const std::size_t width : {std::size_t{1}, std::size_t{4}, std::size_t{8}}) {
            CAPTURE(edge, width);
            const image<float> map = ramp(30, 80, 40 - width / 2, 40 - width / 2 + width);
            const decided_depth decided = decide(by_red, halves(30, 80, edge), map, map);
            for (std::size_t y = 0; y < 30; ++y)
                for (std::size_t x = 0; x < 80; ++x) {
                    CAPTURE(x, y);
                    REQUIRE(decided.disparity(y, x) == (x < edge ? 0.8F : map(0, 79)));
                    if (decided.shares(y, x) != 0) REQUIRE((decided.shares(y, x) >= 128) == (x < edge));
                }
        }
}

TEST_CASE("the foreground share is the logistic function of the network's logit plus the prior, and 0 outside the band") {
    const image<float> map = ramp(20, 40, 19, 20);
    const auto certain = [](float logit) { return [logit](std::span<const std::uint8_t>, std::size_t) { return logit; }; };
    // The prior adds 3 to the logits of pixels in front, and subtracts 3 from those of pixels behind.
    CHECK(decide(certain(0.0F), halves(20, 40, 20), map, map).shares(10, 5) == 0);  // beyond the band
    CHECK(decide(certain(0.0F), halves(20, 40, 20), map, map).shares(10, 15) == 243);
    CHECK(decide(certain(0.0F), halves(20, 40, 20), map, map).shares(10, 25) == 13);
    CHECK(decide(certain(-3.0F), halves(20, 40, 20), map, map).shares(10, 15) == 128);
    CHECK(decide(certain(100.0F), halves(20, 40, 20), map, map).shares(10, 15) == 255);
    CHECK(decide(certain(-100.0F), halves(20, 40, 20), map, map).shares(10, 15) == 1);
}

TEST_CASE("both surfaces continue their slope up to the edge, and no value remains in the middle of the step") {
    const image<float> map = ramp(30, 80, 36, 44, 0.002F);
    const decided_depth decided = decide(by_red, halves(30, 80, 42), map, map);
    const step_band band = find_step_band(map);
    for (std::int32_t y = 0; y < 30; ++y) {
        CHECK(std::abs(decided.disparity(y, 41) - map(y, 30)) < 0.03F);
        CHECK(std::abs(decided.disparity(y, 42) - map(y, 50)) < 0.03F);
        for (std::int32_t x = 0; x < 80; ++x) {
            const std::int32_t i = band.region.number(x, y);
            if (i == no_pixel || !band.is_decided(i)) continue;
            const float share = band.share(i, decided.disparity(y, x));
            CHECK((share < 0.25F || share > 0.75F));
        }
    }
}

TEST_CASE("a mirrored coarse map gives the network a mirrored input") {
    for (const auto& [samples, pixels] : {std::pair<std::size_t, std::size_t>{1, 7}, {2, 4}, {5, 5}, {6, 40}, {40, 31}}) {
        const buffer<detail::bilinear_place> places = detail::bilinear_places(samples, pixels);
        const auto position = [&](std::size_t pixel) { return static_cast<float>(places[pixel].first) + places[pixel].share; };
        for (std::size_t i = 0; i < pixels; ++i)
            CHECK(position(i) + position(pixels - 1 - i) == Approx(static_cast<float>(samples - 1)).margin(1e-4));
    }
}

TEST_CASE(
    "in the band, a surface gets its disparity beyond the band, unless its own differs from that by more than half the step") {
    for (const float step : {0.54F, 0.31F}) {
        // The front slopes by 0.018 per pixel, so its disparity beyond the band differs by about 0.2 from that at the silhouette.
        image<float> map(30, 100);
        for (std::size_t y = 0; y < 30; ++y)
            for (std::size_t x = 0; x < 100; ++x)
                map(y, x) = x < 50 ? 0.8F - 0.018F * std::min(static_cast<float>(49 - x), 20.0F) : 0.8F - step;
        const decided_depth decided = decide(by_red, halves(30, 100, 50), map, map);
        for (std::size_t x = 38; x < 50; ++x) {
            CAPTURE(step, x, decided.disparity(15, x));
            CHECK((decided.disparity(15, x) == map(15, 36)) == (step > 0.5F));
        }
    }
}

TEST_CASE("islands of 135 pixels are merged into the surface around them, and islands of 150 pixels are kept") {
    const image<float> map = ramp(80, 80, 39, 40);
    image<std::uint8_t> photo = halves(80, 80, 40);
    for (std::size_t y = 5; y < 32; ++y)
        for (std::size_t x = 32; x < 37; ++x) photo(y, x, 0) = 20, photo(y, x + 10, 0) = 220;  // 135 pixels each
    for (std::size_t y = 40; y < 70; ++y)
        for (std::size_t x = 44; x < 49; ++x) photo(y, x, 0) = 220;  // 150 pixels
    const decided_depth decided = decide(by_red, photo, map, map);
    for (std::size_t y = 0; y < 80; ++y)
        for (std::size_t x = 0; x < 80; ++x) {
            const bool is_kept = y >= 40 && y < 70 && x >= 44 && x < 49;
            CHECK(decided.disparity(y, x) == (x < 40 || is_kept ? 0.8F : map(0, 79)));
        }
}

TEST_CASE("disparity without a sharp step is unchanged, and all its shares are 0") {
    for (const std::string_view name : {"flat", "ramp"}) {
        const image<float> map = ldi::testing::hard_map(name, 40, 60, 1);
        const decided_depth decided = decide(at_random, ldi::testing::noisy_photo(40, 60), map, map);
        CHECK(decided.disparity == map);
        CHECK(std::all_of(decided.shares.begin(), decided.shares.end(), [](std::uint8_t s) { return s == 0; }));
    }
}

TEST_CASE("without a network, the decider aligns silhouettes as aligned_silhouettes does") {
    const image<float> map = ramp(60, 80, 38, 39);
    const image<std::uint8_t> photo = halves(60, 80, 40);
    const undecided_depth depth{photo, map, map, {}, 1.0F};
    const network_like network{by_disparity};
    const network_like<decltype(by_disparity)>* const none = nullptr;
    const decided_depth by_hand = network_decider(none, alignment_options{}).decide(depth, serial_executor());
    CHECK(by_hand.disparity == aligned_silhouettes{}.decide(depth, serial_executor()).disparity);
    CHECK(by_hand.disparity(30, 39) == 0.8F);
    CHECK(by_hand.shares.empty());
    alignment_options never;
    never.min_length = std::numeric_limits<std::size_t>::max();
    CHECK(aligned_silhouettes{never}.decide(depth, serial_executor()).disparity == map);
    const undecided_depth coarse{photo, map, map, {}, 1.2F};
    CHECK(network_decider(&network).decide(coarse, serial_executor()).disparity(30, 39) == map(30, 39));
}

TEST_CASE("alignment accepts every valid uncertainty for coarse maps, and refuses every invalid one") {
    const image<float> map(64, 64, 1, 0.5F);
    const image<std::uint8_t> photo(64, 64, 3, std::uint8_t{90});
    const auto result_with = [&](float uncertainty, float sample_size) {
        undecided_depth depth{photo, map, map, {}, sample_size};
        aligned_silhouettes aligned;
        aligned.options.uncertainty = uncertainty;
        return testing::raised([&] { aligned.decide(std::move(depth), serial_executor()); });
    };
    for (const float sample_size : {1.0F, 2.0F, 16.0F}) {
        for (const float uncertainty : {0.0F, 16.1F, 20.0F, 256.0F}) CHECK_FALSE(result_with(uncertainty, sample_size));
        for (const float uncertainty : {-1.0F, 256.5F, std::nanf("")})
            CHECK(result_with(uncertainty, sample_size) == error_code::invalid_option);
    }
    for (const float sample_size : {0.0F, 0.5F, 16.5F, INFINITY, std::nanf("")})
        CHECK(result_with(16.0F, sample_size) == error_code::invalid_option);
}

TEST_CASE("if the depth map has the photo's resolution, the decider aligns silhouettes and does not run the network") {
    const image<float> map = ramp(60, 80, 38, 39);
    const image<std::uint8_t> photo = halves(60, 80, 40);
    const undecided_depth depth{photo, map, map, {}, 1.0F};
    bool is_asked = false;
    const network_like network{[&is_asked](std::span<const std::uint8_t>, std::size_t) {
        is_asked = true;
        return 0.0F;
    }};
    CHECK(network_decider(&network).decide(depth, serial_executor()).disparity ==
          aligned_silhouettes{}.decide(depth, serial_executor()).disparity);
    CHECK(!is_asked);
}

TEST_CASE("the network decides beside steps of at least 0.1") {
    for (const float step : {0.09F, 0.11F}) {
        image<float> map(30, 80, 1, 0.3F);
        for (std::size_t y = 0; y < 30; ++y) std::fill_n(map.row(y), 40, 0.3F + step);
        const decided_depth decided = decide(by_red, halves(30, 80, 44), map, map);
        CHECK((decided.disparity(15, 42) == 0.3F + step) == (step > 0.1F));
        CHECK((decided.shares(15, 42) != 0) == (step > 0.1F));
    }
}

TEST_CASE("the decider's memory is linear in the number of pixels, even for difficult maps and random decisions") {
    for (const std::string_view name : ldi::testing::hard_maps)
        for (const std::size_t unit : {std::size_t{1}, std::size_t{5}}) {
            std::array<double, 2> per_pixel{}, peak_per_pixel{};
            for (std::size_t i = 0; i < 2; ++i) {
                const std::size_t height = std::size_t{96} << i, width = std::size_t{128} << i;
                const image<float> map = ldi::testing::hard_map(name, height, width, unit);
                const image<std::uint8_t> photo = ldi::testing::noisy_photo(height, width);
                ldi::testing::counted_memory own;
                const memory_scope scope(own.source);
                const decided_depth decided = decide(at_random, photo, image<float>(3, 2, 1, 0.5F), map);
                per_pixel[i] = static_cast<double>(own.allocated) / static_cast<double>(map.size());
                peak_per_pixel[i] = static_cast<double>(own.peak) / static_cast<double>(map.size());
                for (const float d : decided.disparity) CHECK((d >= 0.0F && d <= 1.0F));
            }
            CAPTURE(name, unit);
            CHECK(per_pixel[1] < 1.25 * per_pixel[0] + 1);
            CHECK(peak_per_pixel[1] < 150);
        }
}

TEST_CASE("the decider accepts depth maps and photos of any size") {
    for (const auto& [rows, columns] :
         {std::pair<std::size_t, std::size_t>{1, 1}, {1, 2}, {2, 2}, {1, 60}, {60, 1}, {3, 5}, {17, 16}, {40, 50}})
        for (const auto& [map_rows, map_columns] : {std::pair<std::size_t, std::size_t>{1, 1}, {1, 40}, {60, 60}})
            for (const std::string_view name : {"flat", "checkerboard", "noise"}) {
                CAPTURE(name, rows, columns, map_rows, map_columns);
                const decided_depth decided = decide(at_random, ldi::testing::noisy_photo(rows, columns),
                                                     ldi::testing::hard_map(name, map_rows, map_columns, 1),
                                                     ldi::testing::hard_map(name, rows, columns, 1));
                CHECK(decided.disparity.height() == rows);
                CHECK(decided.shares.width() == columns);
            }
}
