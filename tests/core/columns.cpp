#include <ldi/core/columns.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

using namespace ldi;

namespace {
struct no_channels {
    using scalar = float;
};
struct no_scalar {
    static constexpr std::size_t channels = 1;
};
template <class Scalar, int count>
struct tag_of {
    using scalar = Scalar;
    static constexpr int channels = count;
};
static_assert(payload_column<color_column> && payload_column<color16_column> && payload_column<matte_column>);
static_assert(no_scalar::channels == 1);  // used, so that no compiler warns
static_assert(!payload_column<no_channels> && !payload_column<no_scalar> && !payload_column<float>);
static_assert(payload_column<tag_of<float, 1>> && !payload_column<tag_of<float, 0>> && !payload_column<tag_of<float, -1>>);
static_assert(!payload_column<tag_of<const float, 1>> && !payload_column<tag_of<float&, 1>>);
static_assert(!payload_column<tag_of<std::unique_ptr<int>, 1>>, "grow() copies values");
struct final_column final : tag_of<float, 1> {};
static_assert(!payload_column<final_column>, "check_rules() cannot derive from a final class");
struct fractional_column {
    using scalar = float;
    static constexpr double channels = 2.5;
};
static_assert(!payload_column<fractional_column> && fractional_column::channels > 0);
static_assert(payload_column<tag_of<double, 8192>> && !payload_column<tag_of<double, 8193>>,
              "rules return all scalars of a pixel on the stack");
static_assert(!payload_column<const disparity_column> && !payload_column<volatile disparity_column>,
              "disparity_column and const disparity_column would be one column");

// Rules with the right name and a wrong signature. They must be refused; neither the default rule nor a conversion may replace
// them.
struct rules_of_int32 : tag_of<std::int32_t, 1> {
    static std::int32_t new_pixel(std::int32_t* origin) { return *origin; }
    static std::array<std::int32_t, 1> coarser(pixel_values<std::int32_t, 2> pixels) { return {pixels(0)}; }
    static std::array<std::int32_t, 1> at_vertex(pixel_values<std::uint32_t, 1>) { return {}; }
};
struct rules_of_wrong_results : tag_of<std::int32_t, 1> {
    static std::string new_pixel(std::int32_t) { return {}; }
    static std::array<std::int32_t, 2> coarser(pixel_values<std::int32_t, 1>) { return {}; }
    static void at_vertex(pixel_values<std::int32_t, 1>) {}
};
struct rules_of_smaller_types : tag_of<std::int32_t, 1> {
    static std::int32_t new_pixel(std::uint8_t origin) { return origin; }
    static std::array<std::int32_t, 1> coarser(pixel_values<std::int16_t, 1>) { return {}; }
    static std::array<std::int16_t, 1> at_vertex(pixel_values<std::int32_t, 1>) { return {}; }
};
struct rules_of_other_kinds : tag_of<std::int32_t, 1> {
    int new_pixel = 0;
    std::array<std::int32_t, 1> coarser(pixel_values<std::int32_t, 1> pixels) { return {pixels(0)}; }
    static int at_vertex(int);
    static int at_vertex(float);
};
struct fitting_rules : tag_of<std::int32_t, 1> {
    template <class T>
    static T new_pixel(T origin) {
        return origin;
    }
    static std::array<std::int32_t, 1> coarser(auto pixels) { return {pixels(0)}; }
    static std::array<std::int32_t, 1> at_vertex(const pixel_values<std::int32_t, 1>& pixels) { return first_of(pixels); }
};
template <class Column>
inline constexpr bool has_a_fitting_rule =
    detail::new_pixel_fits<Column> || detail::coarser_fits<Column> || detail::at_vertex_fits<Column>;
static_assert(!has_a_fitting_rule<rules_of_int32> && !has_a_fitting_rule<rules_of_wrong_results> &&
              !has_a_fitting_rule<rules_of_smaller_types> && !has_a_fitting_rule<rules_of_other_kinds>);
static_assert(detail::check_rules<fitting_rules>() && detail::has_new_pixel<fitting_rules> &&
              detail::has_coarser<fitting_rules> && detail::has_at_vertex<fitting_rules>);

enum class material : std::uint8_t { wood, stone };
static_assert(averageable<float> && averageable<std::uint8_t> && averageable<std::int32_t>);
static_assert(!averageable<std::int64_t> && !averageable<material> && !averageable<std::string>,
              "identifiers and texts have no mean");

/// Pixels with these values, `channels` each.
template <std::size_t channels, class Scalar>
pixel_values<Scalar, channels> pixels_of(const std::vector<Scalar>& values) {
    return {array_view<const Scalar>(values.data(), values.size())};
}

}  // namespace

TEST_CASE("averaged() returns the mean of each channel, and rounds integers to the nearest, halves away from zero") {
    CHECK(averaged(pixels_of<1>(std::vector<std::uint8_t>{1, 2})) == std::array<std::uint8_t, 1>{2});
    CHECK(averaged(pixels_of<1>(std::vector<std::int32_t>{-1, -2})) == std::array<std::int32_t, 1>{-2});
    CHECK(averaged(pixels_of<1>(std::vector<std::int32_t>{INT32_MAX, INT32_MAX})) == std::array<std::int32_t, 1>{INT32_MAX});
    CHECK(averaged(pixels_of<1>(std::vector<float>{1, 2})) == std::array<float, 1>{1.5F});
    std::mt19937 random(1);
    for (int round = 0; round < 200; ++round) {
        std::vector<std::int16_t> values(3 * (1 + random() % 8));
        for (std::int16_t& value : values) value = static_cast<std::int16_t>(random());
        const pixel_values<std::int16_t, 3> pixels = pixels_of<3>(values);
        REQUIRE(pixels.size() == values.size() / 3);
        const std::array<std::int16_t, 3> mean = averaged(pixels), first = first_of(pixels);
        for (std::size_t c = 0; c < 3; ++c) {
            int sum = 0;
            for (std::size_t i = 0; i < pixels.size(); ++i) sum += pixels(i, c);
            const int count = static_cast<int>(pixels.size()), half = sum < 0 ? -count : count;
            REQUIRE(mean[c] == (2 * sum + half) / (2 * count));
            REQUIRE(first[c] == values[c]);
        }
    }
}

TEST_CASE("a new pixel has 8-bit color 0, is marked as unknown, and copies the disparity and the 16-bit color of its surface") {
    CHECK(detail::new_pixel_value<color_column>(200) == 0);
    CHECK(detail::new_pixel_value<known_column>(1) == 0);
    CHECK(detail::new_pixel_value<matte_column>(9) == 0);
    CHECK(detail::new_pixel_value<disparity_column>(0.7F) == 0.7F);
    CHECK(detail::new_pixel_value<color16_column>(50000) == 50000);
}

TEST_CASE("a coarse pixel is known only if all of its pixels are; colors and disparities are averaged") {
    const std::vector<std::uint8_t> known{1, 1, 1}, partly{1, 0, 1}, colors{10, 20, 30, 21, 40, 50};
    CHECK(detail::coarser_values<known_column>(pixels_of<1>(known)) == std::array<std::uint8_t, 1>{1});
    CHECK(detail::coarser_values<known_column>(pixels_of<1>(partly)) == std::array<std::uint8_t, 1>{0});
    CHECK(detail::coarser_values<color_column>(pixels_of<3>(colors)) == std::array<std::uint8_t, 3>{16, 30, 40});
    CHECK(vertex_values<color_column>(pixels_of<3>(colors)) == std::array<std::uint8_t, 3>{16, 30, 40});
    const std::vector<std::int32_t> values{5, 100};
    CHECK(vertex_values<fitting_rules>(pixels_of<1>(values)) == std::array<std::int32_t, 1>{5});
}

TEST_CASE("a column that would exceed the address space is refused, even if its length overflows to a small number") {
    using directions = tag_of<double, 3>;
    constexpr std::size_t channels = directions::channels;
    const std::size_t limit = static_cast<std::size_t>(PTRDIFF_MAX) / (channels * sizeof(directions::scalar));
    CHECK(detail::scalar_count<directions>(limit) == channels * limit);
    for (const std::size_t pixels : {limit + 1, static_cast<std::size_t>(-1) / channels + 1, static_cast<std::size_t>(-1)})
        CHECK(testing::raised([&] { detail::scalar_count<directions>(pixels); }) == error_code::too_large);
}
