#include <ldi/base/executor.hpp>
#include <ldi/core/coarsening.hpp>
#include <ldi/nn/ldi/elementwise.hpp>

#include "tests/support/errors.hpp"
#include "tests/support/random_features.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

using namespace ldi;
using ldi::testing::random_features;

TEST_CASE("add() sums maps pixel by pixel, and reads zero from an upsampled map at pixels without a parent") {
    testing::for_random_graphs(20, 100, [&](const testing::random_layers& layers, std::mt19937& random) {
        const coarsened half = coarsen(layers.topology());
        const feature_map a = random_features(random, layers.topology().size(), 3),
                          b = random_features(random, layers.topology().size(), 3),
                          coarse = random_features(random, half.map.kept().size(), 3);
        const feature_map beside = add(a, b), above = add(a, upsample(coarse, half.map));
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(a.pixels()); ++i)
            for (std::size_t c = 0; c < 3; ++c) {
                CHECK(beside.at(i)[c] == a.at(i)[c] + b.at(i)[c]);
                const std::int32_t parent = half.map.parent()[i];
                CHECK(above.at(i)[c] == a.at(i)[c] + (parent == no_pixel ? 0.0F : coarse.at(parent)[c]));
            }
    });
}

TEST_CASE("concatenate() joins the channels of maps in order, and reads zero at pixels without a parent") {
    testing::for_random_graphs(21, 100, [&](const testing::random_layers& layers, std::mt19937& random) {
        const coarsened half = coarsen(layers.topology());
        const feature_map coarse = random_features(random, half.map.kept().size(), 2),
                          fine = random_features(random, layers.topology().size(), 3);
        const feature_map both = concatenate({upsample(coarse, half.map), fine});
        REQUIRE(both.channels == 5);
        REQUIRE(both.pixels() == layers.topology().size());
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(both.pixels()); ++i) {
            const std::int32_t parent = half.map.parent()[i];
            for (std::size_t c = 0; c < 2; ++c) CHECK(both.at(i)[c] == (parent == no_pixel ? 0.0F : coarse.at(parent)[c]));
            for (std::size_t c = 0; c < 3; ++c) CHECK(both.at(i)[2 + c] == fine.at(i)[c]);
        }
    });
}

TEST_CASE("elementwise operators refuse maps of different sizes") {
    const feature_map a(6, 2), fewer(5, 2), wider(6, 3);
    const basic_feature_map<std::uint8_t> bytes(6, 2), fewer_bytes(5, 2), wider_bytes(6, 3);
    const add_u8_constants sum = prepare_add_u8(best_isa(), make_quantized_addition({1.0F, 0}, {1.0F, 0}, {1.0F, 0}));
    for (const feature_map* const other : {&fewer, &wider})
        CHECK(testing::raised([&] { add(a, *other); }) == error_code::mismatch);
    for (const basic_feature_map<std::uint8_t>* const other : {&fewer_bytes, &wider_bytes})
        CHECK(testing::raised([&] { add(bytes, *other, sum); }) == error_code::mismatch);
    CHECK(testing::raised([&] { concatenate({a, fewer}); }) == error_code::mismatch);
    CHECK(testing::raised([&] { concatenate({bytes, fewer_bytes}); }) == error_code::mismatch);
}

TEST_CASE("on a grid, upsampling repeats each pixel of the coarse image") {
    std::mt19937 random(22);
    const graph g = make_grid(13, 7);
    const coarsened half = coarsen(g);
    const feature_map coarse = random_features(random, half.map.kept().size(), 2);
    const feature_map fine = concatenate({upsample(coarse, half.map)});
    for (std::int32_t y = 0; y < 7; ++y)
        for (std::int32_t x = 0; x < 13; ++x)
            for (std::size_t c = 0; c < 2; ++c) CHECK(fine.at(y * 13 + x)[c] == coarse.at(y / 2 * 7 + x / 2)[c]);
}

TEST_CASE("activations match their definitions") {
    std::mt19937 random(23);
    const feature_map x = random_features(random, 40, 5);
    const feature_map rectified = activate(x, relu), leaky = activate(x, leaky_relu(0.2F)), squashed = sigmoid(x),
                      tangent = tanh(x);
    for (std::size_t i = 0; i < x.values.size(); ++i) {
        const float v = x.values[i];
        CHECK(rectified.values[i] == (v > 0.0F ? v : 0.0F));
        CHECK(leaky.values[i] == (v > 0.0F ? v : 0.2F * v));
        CHECK(double{squashed.values[i]} == Approx(1.0 / (1.0 + std::exp(-double{v}))).epsilon(1e-6));
        CHECK(double{tangent.values[i]} == Approx(std::tanh(double{v})).epsilon(1e-6));
    }
    CHECK(sigmoid(feature_map(x)).channels == 5);
}

TEST_CASE("ReLU of minus infinity is 0, and leaky ReLU of it is minus infinity") {
    feature_map x(1, 2);
    x.values = {-INFINITY, INFINITY};
    CHECK(activate(x, relu).values == buffer<float>{0.0F, INFINITY});
    CHECK(activate(x, leaky_relu(0.2F)).values == x.values);
}

TEST_CASE("NaN passes through every activation") {
    feature_map x(1, 1);
    x.values = {NAN};
    for (const activation by : {relu, leaky_relu(0.2F), no_activation}) CHECK(std::isnan(activate(x, by).values[0]));
}

TEST_CASE("sigmoid and tanh reach their limits exactly for large inputs") {
    feature_map x(1, 4);
    x.values = {-1000.0F, 1000.0F, -30.0F, 30.0F};
    const feature_map squashed = sigmoid(x), tangent = tanh(x);
    CHECK(squashed.values[0] == 0.0F);
    CHECK(squashed.values[1] == 1.0F);
    CHECK(tangent.values[0] == -1.0F);
    CHECK(tangent.values[1] == 1.0F);
}

TEST_CASE("tanh has the same bits on every machine") {
    feature_map x(0, 1);
    for (std::uint32_t bits = 0; bits < 0x41300000U; bits += 997) x.values.push_back(detail::float_of(bits));  // 0 to 11
    std::uint32_t hash = 2166136261U;
    for (const float v : tanh(std::move(x)).values) hash = (hash ^ detail::bits_of(v)) * 16777619U;
    CHECK(hash == 0xEBB56D11U);
}

TEST_CASE("tanh is within two units in the last place, keeps the sign of zero, and does not depend on the number of values") {
    feature_map x(0, 1);
    for (float v = 1e-42F; v < 20.0F; v *= 1.003F) x.values.push_back(v), x.values.push_back(-v);
    for (const float v : {0.0F, -0.0F, INFINITY, -INFINITY, 0.625F, 9.5F}) x.values.push_back(v);
    const feature_map tangent = tanh(x);
    for (std::size_t i = 0; i < x.values.size(); ++i) {
        const double exact = std::tanh(double{x.values[i]});
        const float nearest = static_cast<float>(exact);
        const double unit = double{std::nextafter(std::abs(nearest), 2.0F)} - double{std::abs(nearest)};
        CHECK(std::abs(double{tangent.values[i]} - exact) <= 2 * unit);
        CHECK(std::signbit(tangent.values[i]) == std::signbit(x.values[i]));
        feature_map one(1, 1);
        one.values[0] = x.values[i];
        CHECK(tanh(one).values[0] == tangent.values[i]);
    }
    x.values = {std::nanf("")};
    CHECK(std::isnan(tanh(x).values[0]));
}

TEST_CASE("elementwise functions reuse the memory of a map that is moved in") {
    std::mt19937 random(24);
    feature_map x = random_features(random, 100, 4);
    const feature_map b = random_features(random, 100, 4);
    const float* const values = x.values.data();
    const feature_map result = tanh(activate(add(std::move(x), b), relu));
    CHECK(result.values.data() == values);
}

TEST_CASE("elementwise functions return the same bits on any number of threads") {
    std::mt19937 random(25);
    const feature_map a = random_features(random, 20000, 3), b = random_features(random, 20000, 3);
    thread_pool three(3);
    CHECK(add(a, b).values == add(a, b, three).values);
    CHECK(concatenate({a, b}).values == concatenate({a, b}, three).values);
    CHECK(sigmoid(a).values == sigmoid(a, three).values);
}

TEST_CASE("addition, concatenation and ReLU of byte maps respect the maps' zero points") {
    const quantized_addition exact = make_quantized_addition({0.02F, 10}, {0.03F, 200}, {0.04F, 90});
    const add_u8_constants sum = prepare_add_u8(best_isa(), exact);
    testing::for_random_graphs(24, 60, [&](const testing::random_layers& layers, std::mt19937& random) {
        const coarsened half = coarsen(layers.topology());
        const auto random_bytes = [&](std::size_t pixels, std::uint8_t zero) {
            basic_feature_map<std::uint8_t> map(pixels, 3, zero);
            for (std::uint8_t& value : map.values) value = static_cast<std::uint8_t>(random());
            return map;
        };
        const auto a = random_bytes(layers.topology().size(), 10), b = random_bytes(a.pixels(), 200),
                   coarse = random_bytes(half.map.kept().size(), 200), joined = random_bytes(a.pixels(), 10);
        const auto beside = add(a, b, sum), above = add(a, upsample(coarse, half.map), sum);
        const auto both = concatenate({basic_feature_view<std::uint8_t>(a), basic_feature_view<std::uint8_t>(joined)});
        const auto cut = activate(a, relu);
        REQUIRE((beside.zero == 90 && both.channels == 6));
        for (std::int32_t i = 0; i < layers.topology().count(); ++i)
            for (std::size_t c = 0; c < 3; ++c) {
                CHECK(beside.at(i)[c] == add_quantized(a.at(i)[c], b.at(i)[c], exact));
                const std::int32_t parent = half.map.parent()[i];
                CHECK(above.at(i)[c] == add_quantized(a.at(i)[c], parent == no_pixel ? 200 : coarse.at(parent)[c], exact));
                CHECK((both.at(i)[c] == a.at(i)[c] && both.at(i)[3 + c] == joined.at(i)[c]));
                CHECK(cut.at(i)[c] == (std::max)(a.at(i)[c], std::uint8_t{10}));
            }
    });
}

TEST_CASE("quantize() rounds to the nearest byte and clamps, and dequantize() inverts it") {
    feature_map x(2, 4);
    const float values[] = {0.0F, 0.26F, -0.24F, 1000.0F, -1000.0F, std::nanf(""), INFINITY, 1.5F};
    std::copy(std::begin(values), std::end(values), x.values.begin());
    const quantization q{0.5F, 10};
    const auto bytes = quantize(x, q);
    CHECK(bytes.values == buffer<std::uint8_t>{10, 11, 10, 255, 0, 10, 255, 13});
    CHECK(bytes.zero == 10);
    CHECK(dequantize(bytes, q).values == buffer<float>{0.0F, 0.5F, 0.0F, 122.5F, -5.0F, 0.0F, 122.5F, 1.5F});
    CHECK(quantize(dequantize(bytes, q), q).values == bytes.values);
}

TEST_CASE("quantize() rounds the exact quotient, halves away from zero") {
    std::mt19937 random(25);
    const quantization q{0.1F, 128};
    const double scale = double{q.scale};
    feature_map x(0, 1);
    for (int half = -256; half <= 256; ++half)
        for (const float v : {static_cast<float>((half + 0.5) * scale), static_cast<float>(half * scale)})
            for (const float near_it : {v, std::nextafter(v, -100.0F), std::nextafter(v, 100.0F)}) x.values.push_back(near_it);
    for (const float v : random_features(random, 100, 3).values) x.values.push_back(v);
    const auto bytes = quantize(x, q);
    for (std::size_t i = 0; i < x.values.size(); ++i)
        CHECK(int{bytes.values[i]} == std::clamp(static_cast<int>(std::round(double{x.values[i]} / scale)) + 128, 0, 255));
}

TEST_CASE("elementwise operators refuse incomplete rows, short masks, empty lists of maps, and different zero points") {
    using bytes = basic_feature_map<std::uint8_t>;
    feature_map ragged(2, 4096);
    ragged.values.resize(ragged.values.size() + 4000, 1.0F);
    CHECK(testing::raised([&] { quantize(ragged, {0.1F, 0}); }) == error_code::mismatch);
    bytes ragged_bytes(2, 4096);
    ragged_bytes.values.resize(3 * 4096 - 1, std::uint8_t{1});
    CHECK(testing::raised([&] { dequantize(ragged_bytes, {0.1F, 0}); }) == error_code::mismatch);

    const feature_map a(64, 2);
    const buffer<std::uint8_t> mask(8, std::uint8_t{1});
    feature_view masked = a;
    masked.mask = mask;
    CHECK(testing::raised([&] { add(a, masked); }) == error_code::mismatch);
    CHECK(testing::raised([&] { concatenate({a, masked}); }) == error_code::mismatch);

    CHECK(testing::raised([&] { concatenate(std::initializer_list<feature_view>{}); }) == error_code::mismatch);
    const bytes low(6, 2, 10), high(6, 2, 200);
    CHECK(testing::raised([&] { concatenate({low, high}); }) == error_code::mismatch);
    const add_u8_constants sum = prepare_add_u8(best_isa(), make_quantized_addition({1.0F, 10}, {1.0F, 200}, {1.0F, 0}));
    CHECK_FALSE(testing::raised([&] { add(low, high, sum); }));
    CHECK(testing::raised([&] { add(low, low, sum); }) == error_code::mismatch);
}

TEST_CASE("conversion to and from bytes requires positive, finite scales, and byte maps refuse a leaky activation") {
    feature_map x(1, 2);
    x.values = {3.0F, INFINITY};
    const basic_feature_map<std::uint8_t> bytes(1, 2, 7);
    for (const float scale : {0.0F, -1.0F, NAN, INFINITY, 0x1p120F}) {
        CHECK(testing::raised([&] { quantize(x, {scale, 7}); }) == error_code::invalid_option);
        CHECK(testing::raised([&] { dequantize(bytes, {scale, 7}); }) == error_code::invalid_option);
    }
    CHECK(quantize(x, {0x1p119F, 7}).values[1] == 255);
    for (const activation by : {leaky_relu(0.5F), no_activation})
        CHECK(testing::raised([&] { activate(bytes, by); }) == error_code::unsupported);
}

TEST_CASE("conversion to and from bytes returns the same values on any number of threads") {
    std::mt19937 random(26);
    const feature_map x = random_features(random, 20000, 3);
    thread_pool three(3);
    const quantization q{0.01F, 100};
    CHECK(quantize(x, q).values == quantize(x, q, three).values);
    CHECK(dequantize(quantize(x, q), q).values == dequantize(quantize(x, q), q, three).values);
}
