#include <ldi/nn/ldi/convolution.hpp>
#include <ldi/nn/ldi/restrict_plan.hpp>

#include "tests/support/errors.hpp"
#include "tests/support/random_bytes.hpp"
#include "tests/support/random_features.hpp"
#include "tests/support/random_graph.hpp"
#include "tests/support/sketched_graph.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

using namespace ldi;
using ldi::testing::random_floats;
using ldi::testing::random_layers;

namespace {
using floats = buffer<float>;
using indices = buffer<std::int32_t>;

/// A source and the memory that it refers to.
struct input_tensor {
    floats values;
    std::size_t channels;
    indices rows;
    buffer<std::uint8_t> mask;

    feature_view source() const { return {values, channels, rows, mask}; }
    std::int32_t row_of(std::int32_t pixel) const {
        return pixel == no_pixel || rows.empty() ? pixel : rows[static_cast<std::size_t>(pixel)];
    }
};

struct layer {
    std::int32_t kernel_size;
    std::size_t inputs, outputs;
    floats weights, bias;
    float negative_slope;
};

layer random_layer(std::mt19937& random, std::int32_t kernel_size, std::size_t inputs, std::size_t outputs) {
    const float slopes[] = {1.0F, 0.0F, 0.2F};
    const std::size_t elements = static_cast<std::size_t>(kernel_size * kernel_size);
    return {kernel_size,
            inputs,
            outputs,
            random_floats(random, outputs * inputs * elements),
            random_floats(random, outputs),
            slopes[testing::below(random, 3)]};
}

conv_f32_weights packed(const layer& l, isa target) {
    return pack_convolution(target, l.weights, l.bias, l.kernel_size, {l.negative_slope});
}

struct value_and_scale {
    double value, scale;  // scale: sum of the absolute values of all summands
};

/// Computes one output by exploration in double precision.
value_and_scale by_definition(const graph_view& g, std::int32_t pixel, const layer& l, const std::vector<input_tensor>& tensors,
                              std::size_t output, bool is_partial, bool& is_masked) {
    const std::size_t elements = static_cast<std::size_t>(l.kernel_size * l.kernel_size);
    indices window(elements);
    gather_window(g, pixel, l.kernel_size, window);
    double sum = 0, scale = 0, counted = 0;
    std::size_t first = 0;
    for (const input_tensor& t : tensors) {
        for (std::size_t e = 0; e < elements; ++e) {
            const std::int32_t row = t.row_of(window[e]);
            if (row == no_pixel) continue;
            if (!t.mask.empty() && t.mask[static_cast<std::size_t>(row)] == 0) continue;
            counted += static_cast<double>(t.channels);
            for (std::size_t c = 0; c < t.channels; ++c) {
                const double product = double{l.weights[(output * l.inputs + first + c) * elements + e]} *
                                       double{t.values[static_cast<std::size_t>(row) * t.channels + c]};
                sum += product, scale += std::abs(product);
            }
        }
        first += t.channels;
    }
    is_masked = is_partial && counted == 0;
    if (is_masked) return {0, 0};
    const double ratio = is_partial ? static_cast<double>(l.inputs * elements) / counted : 1;
    const double value = sum * ratio + double{l.bias[output]};
    return {value > 0 ? value : value * double{l.negative_slope}, scale * ratio + std::abs(double{l.bias[output]})};
}

constexpr float untouched = 12345.0F;

struct outcome {
    floats values;
    buffer<std::uint8_t> mask;
};

outcome run(const convolution_plan& plan, const conv_f32_weights& weights, const std::vector<input_tensor>& tensors,
            bool is_partial) {
    serial_executor threads;
    std::vector<feature_view> sources;
    for (const input_tensor& t : tensors) sources.push_back(t.source());
    outcome result{floats(plan.output_count() * weights->outputs, untouched), buffer<std::uint8_t>(plan.output_count(), 99)};
    if (is_partial)
        convolve_partially(plan, weights, sources, result.values, result.mask, threads);
    else
        convolve(plan, weights, sources, result.values, threads);
    return result;
}

indices random_subset(std::mt19937& random, std::size_t count) {
    indices subset;
    bool chosen = false;
    for (std::size_t i = 0; i < count; ++i) {
        if (testing::chance(random, 30)) chosen = testing::chance(random, 50);
        if (chosen) subset.push_back(static_cast<std::int32_t>(i));
    }
    return subset;
}

buffer<std::uint8_t> random_mask(std::mt19937& random, std::size_t count) {
    const std::int32_t percent = testing::below(random, 101);
    buffer<std::uint8_t> mask(count);
    for (std::uint8_t& m : mask) m = testing::chance(random, percent) ? 1 : 0;
    return mask;
}

std::size_t some_channels(std::mt19937& random, std::int32_t most) {
    return 1 + static_cast<std::size_t>(testing::below(random, most));
}

/// Checks, on every instruction set, that the result matches the definition and that a restricted plan computes the same bits.
void check_everywhere(const graph_view& g, const convolution_plan& plan, const indices& centers, const layer& l,
                      const std::vector<input_tensor>& tensors, bool is_partial, std::mt19937& random) {
    const indices subset = random_subset(random, plan.output_count());
    std::vector<bool> is_chosen(plan.output_count());
    for (const std::int32_t o : subset) is_chosen[static_cast<std::size_t>(o)] = true;
    const convolution_plan restricted = restrict_to(plan, subset);
    for (const isa target : ldi::testing::available_isas()) {
        const conv_f32_weights weights = packed(l, target);
        const outcome whole = run(plan, weights, tensors, is_partial), part = run(restricted, weights, tensors, is_partial);
        bool near = true, same = true;
        for (std::size_t o = 0; o < plan.output_count(); ++o) {
            for (std::size_t c = 0; c < l.outputs; ++c) {
                const float got = whole.values[o * l.outputs + c], in_part = part.values[o * l.outputs + c];
                same = same && in_part == (is_chosen[o] ? got : untouched);
                if (c % 5 != o % 5) continue;  // comparing a fifth of the values suffices
                bool is_masked = false;
                const value_and_scale expected = by_definition(g, centers[o], l, tensors, c, is_partial, is_masked);
                near = near && std::abs(double{got} - expected.value) <= 1e-5 * expected.scale;
                if (is_partial) same = same && whole.mask[o] == (is_masked ? 0 : 1);
            }
            if (is_partial) same = same && part.mask[o] == (is_chosen[o] ? whole.mask[o] : 99);
        }
        INFO("instruction set " << std::string(to_string(target)));
        REQUIRE(near);
        REQUIRE(same);
    }
}

indices all_pixels(const graph_view& g) {
    indices pixels(g.size());
    for (std::size_t i = 0; i < g.size(); ++i) pixels[i] = static_cast<std::int32_t>(i);
    return pixels;
}
}  // namespace

TEST_CASE("a convolution sums over the explored window, on any graph, with any kernel, stride and number of channels") {
    testing::for_random_graphs(40, 600, [&](const random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        const layer l =
            random_layer(random, 1 + 2 * testing::below(random, 4), some_channels(random, 9), some_channels(random, 50));
        const std::vector<input_tensor> tensors{{random_floats(random, g.size() * l.inputs), l.inputs, {}, {}}};
        if (testing::chance(random, 50)) {
            check_everywhere(g, plan_convolution(g, l.kernel_size), all_pixels(g), l, tensors, false, random);
        } else {
            const coarsened coarse = coarsen(g, orphan_rule::adopt_nearest);
            check_everywhere(g, plan_convolution(g, l.kernel_size, coarse.map), coarse.map.kept().copy(), l, tensors, false,
                             random);
        }
    });
}

TEST_CASE("a partial convolution divides its sum by the share of existing, unmasked inputs over all sources and channels") {
    testing::for_random_graphs(41, 600, [&](const random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        const coarsened coarse = coarsen(g, orphan_rule::stay);
        std::vector<input_tensor> tensors;
        if (testing::chance(random, 60)) {  // upsampled from the coarser level
            const std::size_t channels = some_channels(random, 7), count = coarse.map.kept().size();
            tensors.push_back({random_floats(random, count * channels), channels, coarse.map.parent().copy(), {}});
            if (testing::chance(random, 50)) tensors.back().mask = random_mask(random, count);
        }
        const std::size_t channels = some_channels(random, 7);
        tensors.push_back({random_floats(random, g.size() * channels), channels, {}, {}});
        if (testing::chance(random, 50)) tensors.back().mask = random_mask(random, g.size());

        std::size_t inputs = 0;
        for (const input_tensor& t : tensors) inputs += t.channels;
        const layer l = random_layer(random, 1 + 2 * testing::below(random, 4), inputs, some_channels(random, 50));
        if (testing::chance(random, 70))
            check_everywhere(g, plan_convolution(g, l.kernel_size), all_pixels(g), l, tensors, true, random);
        else
            check_everywhere(g, plan_convolution(g, l.kernel_size, coarse.map), coarse.map.kept().copy(), l, tensors, true,
                             random);
    });
}

TEST_CASE("on a grid, a convolution equals an image convolution with zeros beyond the border") {
    const std::int32_t width = 70, height = 21;
    std::mt19937 random(42);
    const graph g = make_grid(width, height);
    for (const std::int32_t k : {3, 5, 7}) {
        const layer l = random_layer(random, k, 6, 20);
        const input_tensor t{random_floats(random, g.size() * 6), 6, {}, {}};
        for (const isa target : ldi::testing::available_isas()) {
            const floats result = run(plan_convolution(g, k), packed(l, target), {t}, false).values;
            double worst = 0;
            for (std::int32_t y = 0; y < height; ++y)
                for (std::int32_t x = 0; x < width; ++x)
                    for (std::size_t o = 0; o < l.outputs; o += 3) {
                        double sum = double{l.bias[o]};
                        for (std::int32_t r = 0; r < k; ++r)
                            for (std::int32_t c = 0; c < k; ++c) {
                                const std::int32_t sx = x + c - k / 2, sy = y + r - k / 2;
                                if (sx < 0 || sx >= width || sy < 0 || sy >= height) continue;
                                for (std::size_t i = 0; i < 6; ++i)
                                    sum += double{l.weights[(o * 6 + i) * static_cast<std::size_t>(k * k) +
                                                            static_cast<std::size_t>(r * k + c)]} *
                                           double{t.values[static_cast<std::size_t>(sy * width + sx) * 6 + i]};
                            }
                        if (sum < 0) sum *= double{l.negative_slope};
                        worst = std::max(worst, std::abs(sum - double{result[static_cast<std::size_t>(y * width + x) * 20 + o]}));
                    }
            CHECK(worst < 1e-5 * k * k);
        }
    }
}

TEST_CASE("the bits of a result depend neither on the number of threads nor on links outside its window") {
    std::mt19937 random(43);
    const graph g = make_grid(320, 48);
    testing::sketched_graph cut(g);  // silhouettes make all adjacent pixels irregular but change few windows
    for (std::int32_t i = 0; i < 320 * 48; i += 5) cut.unlink(i, side::left), cut.unlink(i + 2, side::up);
    const layer l = random_layer(random, 5, 4, 37);
    const input_tensor t{random_floats(random, g.size() * 4), 4, {}, {}};
    const feature_view source = t.source();
    for (const isa target : ldi::testing::available_isas()) {
        const conv_f32_weights weights = packed(l, target);
        const convolution_plan plan = plan_convolution(g, 5), cut_plan = plan_convolution(cut, 5);
        CHECK(cut_plan.irregular().size() == g.size());
        floats serial(g.size() * 37), parallel(g.size() * 37), gathered(g.size() * 37);
        serial_executor one;
        thread_pool three(3);
        convolve(plan, weights, std::span(&source, 1), serial, one);
        convolve(plan, weights, std::span(&source, 1), parallel, three);
        convolve(cut_plan, weights, std::span(&source, 1), gathered, one);
        CHECK(serial == parallel);
        indices a(25), b(25);
        bool same = true;
        std::size_t compared = 0;
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(g.size()); ++i) {
            gather_window(g, i, 5, a), gather_window(cut, i, 5, b);
            if (a != b) continue;
            ++compared;
            const auto at = static_cast<std::ptrdiff_t>(i) * 37;
            same = same && std::equal(serial.begin() + at, serial.begin() + at + 37, gathered.begin() + at);
        }
        CHECK(compared > 1000);
        CHECK(same);
    }
}

TEST_CASE("a mask changes only the results whose windows contain masked pixels; all others keep every bit") {
    std::mt19937 random(44);
    const graph g = make_grid(300, 40);
    const layer l = random_layer(random, 3, 9, 21);
    input_tensor t{random_floats(random, g.size() * 9), 9, {}, {}};
    for (const isa target : ldi::testing::available_isas()) {
        t.mask.clear();
        const outcome without = run(plan_convolution(g, 3), packed(l, target), {t}, true);
        t.mask.assign(g.size(), 1);
        for (const std::int32_t hole : {300 * 10 + 150, 300 * 30 + 20}) t.mask[static_cast<std::size_t>(hole)] = 0;
        const outcome with = run(plan_convolution(g, 3), packed(l, target), {t}, true);
        CHECK(with.mask == without.mask);
        std::size_t changed = 0;
        for (std::size_t o = 0; o < g.size(); ++o) {
            const auto at = static_cast<std::ptrdiff_t>(o * 21);
            changed += std::equal(with.values.begin() + at, with.values.begin() + at + 21, without.values.begin() + at) ? 0U : 1U;
        }
        CHECK(changed == 2 * 9);
    }
}

TEST_CASE("a convolution of bytes matches the convolution of the numbers that they represent") {
    testing::for_random_graphs(46, 100, [&](const random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        const coarsened coarse = coarsen(g, orphan_rule::adopt_nearest);
        const coarsened with_orphans = coarsen(g, orphan_rule::stay);
        const auto parents = with_orphans.map.parent();
        const std::size_t above = some_channels(random, 7), beside = some_channels(random, 7);
        layer l = random_layer(random, 1 + 2 * testing::below(random, 4), above + beside, some_channels(random, 50));
        // All weights are integers, and the largest weight of every output is 63, so that quantization rounds no weight.
        for (float& w : l.weights) w = std::round(w * 63.0F);
        for (std::size_t o = 0; o < l.outputs; ++o) l.weights[o * l.weights.size() / l.outputs] = 63.0F;
        const quantized_source quantized[] = {{above, {0.5F, static_cast<std::uint8_t>(testing::below(random, 256))}},
                                              {beside, {0.5F, static_cast<std::uint8_t>(testing::below(random, 256))}}};
        const auto any_bytes = [&](std::size_t count, const quantized_source& q, floats& stand_for) {
            buffer<std::uint8_t> bytes(count);
            for (std::uint8_t& b : bytes) {
                b = static_cast<std::uint8_t>(testing::below(random, 256));
                stand_for.push_back(static_cast<float>(b - q.values.zero_point) * q.values.scale);
            }
            return bytes;
        };
        floats coarse_floats, fine_floats;
        const buffer<std::uint8_t> coarse_bytes = any_bytes(coarse.map.kept().size() * above, quantized[0], coarse_floats),
                                   fine_bytes = any_bytes(g.size() * beside, quantized[1], fine_floats);
        const convolution_plan plan =
            testing::chance(random, 50) ? plan_convolution(g, l.kernel_size) : plan_convolution(g, l.kernel_size, coarse.map);
        const feature_view exact_sources[] = {{coarse_floats, above, parents, {}}, {fine_floats, beside, {}, {}}};
        const basic_feature_view<std::uint8_t> sources[] = {{coarse_bytes, above, parents, {}, quantized[0].values.zero_point},
                                                            {fine_bytes, beside, {}, {}, quantized[1].values.zero_point}};
        serial_executor threads;
        floats expected(plan.output_count() * l.outputs), numbers(expected.size());
        buffer<std::uint8_t> bytes(expected.size()), expected_mask(plan.output_count()), mask(plan.output_count());
        convolve_partially(plan, packed(l, best_isa()), exact_sources, expected, expected_mask, threads);
        const quantization of_numbers{2.0F, 0}, of_bytes{64.0F, 100};
        for (const isa target : ldi::testing::available_isas()) {
            const auto pack = [&](quantization q) {
                return pack_byte_convolution(target, l.weights, l.bias, l.kernel_size, {l.negative_slope}, quantized, q);
            };
            convolve_partially(plan, pack(of_numbers), sources, numbers, mask, threads);
            convolve_partially(plan, pack(of_bytes), sources, bytes, {}, threads);
            bool near = true;
            for (std::size_t i = 0; i < numbers.size(); ++i) {
                near = near && std::abs(2.0F * numbers[i] - expected[i]) <= 1e-5F * (1.0F + std::abs(expected[i]));
                const float byte = std::clamp(expected[i] / 64.0F + 100.0F, 0.0F, 255.0F);
                near = near && std::abs(static_cast<float>(bytes[i]) - byte) <= 0.501F;
            }
            INFO("instruction set " << std::string(to_string(target)));
            REQUIRE(near);
            REQUIRE(mask == expected_mask);
        }
    });
}

TEST_CASE("byte convolutions accept weights of any magnitude, and refuse scales that exceed the range of float") {
    const auto pack = [](float weight, float other, float scale, float result_scale) {
        const quantized_source source[] = {{2, {scale, 7}}};
        return pack_byte_convolution(isa::scalar, std::array{weight, other}, std::array{1.0F}, 1, no_activation, source,
                                     {result_scale, 0});
    };
    for (float largest = 1e30F; largest > 0; largest *= 0.37F) {  // down to the smallest subnormal float
        CAPTURE(largest);
        const conv_u8_weights packed = pack(largest, -0.3F * largest, 1.0F, 1.0F);
        const float expected = largest < 64 * std::numeric_limits<float>::min() ? 0.0F : largest;
        const auto scaled = [&](std::int8_t w) { return static_cast<float>(w) * packed->scales[0]; };
        float most = 0;
        for (const std::int8_t w : packed->values) {
            REQUIRE(std::abs(int{w}) <= max_conv_u8_weight);
            most = std::max(most, scaled(w));
        }
        if (expected > 0) CHECK(most == Approx(expected));
    }
    CHECK(testing::raised([&] { pack(1e30F, 0, 1e30F, 1.0F); }) == error_code::unsupported);
    CHECK(testing::raised([&] { pack(1e30F, 0, 1.0F, 1e-30F); }) == error_code::unsupported);
    CHECK(testing::raised([&] { pack(1.0F, 0, 1.0F, 0.0F); }) == error_code::unsupported);
    CHECK(testing::raised([&] { pack(1.0F, NAN, 1.0F, 1.0F); }) == error_code::invalid_data);
    CHECK(testing::raised([&] { pack(NAN, 1.0F, 1.0F, 1.0F); }) == error_code::invalid_data);
    CHECK(testing::raised([&] { pack(1.0F, 1.0F, NAN, 1.0F); }) == error_code::invalid_data);
}

TEST_CASE("byte convolutions refuse more inputs than their sums can hold, and are exact up to this limit") {
    const auto sum_of_ones = [](std::size_t channels) {
        const quantized_source source[] = {{channels, {1.0F, 0}}};
        const conv_u8_weights packed =
            pack_byte_convolution(best_isa(), floats(channels, 1.0F), std::array{0.0F}, 1, no_activation, source, {1.0F, 0});
        const buffer<std::uint8_t> bytes(channels, std::uint8_t{255});
        const basic_feature_view<std::uint8_t> sources[] = {{bytes, channels, {}, {}, 0}};
        floats result(1, 0.0F);
        convolve(plan_convolution(make_grid(1, 1), 1), packed, sources, result);
        return result[0];
    };
    CHECK(sum_of_ones(max_conv_u8_inputs) == Approx(255.0 * max_conv_u8_inputs));
    CHECK(testing::raised([&] { sum_of_ones(max_conv_u8_inputs + 1); }) == error_code::unsupported);
    CHECK(testing::raised([&] { sum_of_ones(140000); }) == error_code::unsupported);
}

TEST_CASE("convolutions refuse masks with too few rows, and values that do not form whole rows") {
    const graph g = make_grid(64, 64);
    const conv_f32_weights packed = pack_convolution(best_isa(), floats(18, 1.0F), std::array{0.0F}, 3, no_activation);
    const floats values(2 * 64 * 64, 1.0F), ragged(2 * 64 * 64 + 1, 1.0F);
    const buffer<std::uint8_t> row_mask(64, std::uint8_t{1});
    floats result(64 * 64, 0.0F);
    for (const feature_view& source : {feature_view{values, 2, {}, row_mask}, feature_view{ragged, 2, {}, {}}}) {
        const feature_view sources[] = {source};
        CHECK(testing::raised([&] { convolve_partially(plan_convolution(g, 3), packed, sources, result); }) ==
              error_code::mismatch);
    }
}

TEST_CASE("a partial convolution without unmasked inputs returns zero, regardless of the bias") {
    const graph g = make_grid(9, 9);
    const layer l{3, 1, 2, floats(18, 1.0F), {5.0F, -5.0F}, 1.0F};
    input_tensor t{floats(81, 3.0F), 1, {}, buffer<std::uint8_t>(81, 0)};
    t.mask[40] = 1;
    const outcome result = run(plan_convolution(g, 3), packed(l, best_isa()), {t}, true);
    CHECK(result.values[0] == 0.0F);
    CHECK(result.values[1] == 0.0F);
    CHECK(result.mask[0] == 0);
    CHECK(result.values[2 * 40] == 3.0F * 9.0F + 5.0F);
    CHECK(result.mask[30] == 1);
    CHECK(std::count(result.mask.begin(), result.mask.end(), 1) == 9);
}
