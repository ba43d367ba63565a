#include <ldi/base/executor.hpp>
#include <ldi/core/coarsening.hpp>
#include <ldi/nn/ldi/convolution_layer.hpp>
#include <ldi/nn/ldi/elementwise.hpp>
#include <ldi/nn/ldi/pooling.hpp>
#include <ldi/nn/ldi/restrict_plan.hpp>

#include "tests/support/counted_memory.hpp"
#include "tests/support/errors.hpp"
#include "tests/support/random_features.hpp"
#include "tests/support/sketched_graph.hpp"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <new>
#include <random>
#include <span>
#include <utility>
#include <vector>

using namespace ldi;
using ldi::testing::random_features;
using ldi::testing::random_floats;

namespace {

convolution_layer random_layer(std::mt19937& random, std::size_t inputs, std::size_t outputs,
                               const convolution_options& options = {}) {
    const std::size_t k = static_cast<std::size_t>(options.kernel_size);
    return {random_floats(random, outputs * inputs * k * k), random_floats(random, outputs), options};
}

/// A U-Net of two levels, as a user would write it.
struct small_unet {
    convolution_layer encode, middle, decode, result;

    explicit small_unet(std::mt19937& random, bool is_partial = false)
        : encode(random_layer(random, 3, 5, {.after = relu, .is_partial = is_partial})),
          middle(random_layer(random, 5, 6, {.after = leaky_relu(0.2F), .is_partial = is_partial})),
          decode(random_layer(random, 11, 5, {.after = relu, .is_partial = is_partial})),
          result(random_layer(random, 5, 3, {.kernel_size = 1})) {}

    template <executor Executor = const serial_executor>
    feature_map operator()(const graph_view& g, const feature_map& input, Executor&& threads = {}) const {
        const coarsened half = coarsen(g);
        const convolution_plan fine = plan_convolution(g, 3), coarse = plan_convolution(half.topology, 3);
        const feature_map skip = encode(fine, input, threads);
        const feature_map below = middle(coarse, average_pool(skip, half.map, threads), threads);
        const feature_map up = decode(fine, {upsample(below, half.map), skip}, threads);
        return sigmoid(result(plan_convolution(g, 1), add(up, skip, threads), threads), threads);
    }
};

}  // namespace

TEST_CASE("a layer computes the same as convolve() and convolve_partially()") {
    testing::for_random_graphs(50, 100, [&](const testing::random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        const std::int32_t k = 1 + 2 * testing::below(random, 3);
        const std::size_t elements = static_cast<std::size_t>(k * k);
        const buffer<float> weights = random_floats(random, 7 * 4 * elements), bias = random_floats(random, 7);
        const feature_map input = random_features(random, g.size(), 4);
        const feature_view sources[] = {input};
        const conv_f32_weights packed = pack_convolution(best_isa(), weights, bias, k, relu);
        const coarsened half = coarsen(g);
        for (const convolution_plan& plan : {plan_convolution(g, k), plan_convolution(g, k, half.map)})
            for (const bool is_partial : {false, true}) {
                const convolution_layer layer(weights, bias, {.kernel_size = k, .after = relu, .is_partial = is_partial});
                buffer<float> expected(plan.output_count() * 7);
                if (is_partial)
                    convolve_partially(plan, packed, sources, expected);
                else
                    convolve(plan, packed, sources, expected);
                const feature_map result = layer(plan, input);
                CHECK(result.channels == 7);
                CHECK(result.values == expected);
            }
    });
}

TEST_CASE("in a plain convolution, reading several maps equals reading their concatenation, bit for bit") {
    testing::for_random_graphs(51, 100, [&](const testing::random_layers& layers, std::mt19937& random) {
        const graph& g = layers.topology();
        const coarsened half = coarsen(g);
        const feature_map coarse = random_features(random, half.map.kept().size(), 2),
                          fine = random_features(random, g.size(), 3);
        const convolution_layer layer = random_layer(random, 5, 6);
        const convolution_plan plan = plan_convolution(g, 3);
        const feature_view above = upsample(coarse, half.map);
        CHECK(layer(plan, {above, fine}).values == layer(plan, concatenate({above, fine})).values);
    });
}

TEST_CASE("on a grid, a U-Net's layers match image convolutions") {
    const std::int32_t width = 18, height = 10;
    std::mt19937 random(52);
    const graph g = make_grid(width, height);
    const buffer<float> weights = random_floats(random, 4 * 3 * 9), bias = random_floats(random, 4);
    const feature_map image = random_features(random, g.size(), 3);
    const coarsened half = coarsen(g);
    const convolution_layer plain(weights, bias, {.after = relu}), partial(weights, bias, {.after = relu, .is_partial = true});
    const feature_map same = plain(plan_convolution(g, 3), image), halved = plain(plan_convolution(g, 3, half.map), image),
                      averaged = partial(plan_convolution(g, 3), image);
    double worst = 0.0, worst_partial = 0.0;
    bool strided = true;
    for (std::int32_t y = 0; y < height; ++y)
        for (std::int32_t x = 0; x < width; ++x)
            for (std::size_t o = 0; o < 4; ++o) {
                double sum = 0.0, count = 0.0;
                for (std::int32_t v = -1; v <= 1; ++v)
                    for (std::int32_t u = -1; u <= 1; ++u) {
                        if (x + u < 0 || x + u >= width || y + v < 0 || y + v >= height) continue;
                        count += 1.0;
                        for (std::size_t c = 0; c < 3; ++c)
                            sum += double{weights[(o * 3 + c) * 9 + static_cast<std::size_t>(3 * (v + 1) + u + 1)]} *
                                   double{image.at((y + v) * width + x + u)[c]};
                    }
                const std::int32_t pixel = y * width + x;
                const auto rectified = [&](double value) { return (std::max)(value + double{bias[o]}, 0.0); };
                worst = (std::max)(worst, std::abs(double{same.at(pixel)[o]} - rectified(sum)));
                worst_partial = (std::max)(worst_partial, std::abs(double{averaged.at(pixel)[o]} - rectified(sum * 9.0 / count)));
                if (x % 2 == 0 && y % 2 == 0) strided = strided && halved.at(y / 2 * (width / 2) + x / 2)[o] == same.at(pixel)[o];
            }
    CHECK(worst < 1e-5);
    CHECK(worst_partial < 1e-5);
    CHECK(strided);
}

TEST_CASE("the example at the top of convolution_layer.hpp compiles and runs as a network with one coarser level") {
    std::mt19937 random(56);
    const graph g = make_grid(9, 6);
    const feature_map input = random_features(random, g.size(), 3);
    const convolution_layer first = random_layer(random, 3, 4), second = random_layer(random, 4, 5),
                            third = random_layer(random, 9, 2);

    const ldi::coarsened half = ldi::coarsen(g);
    const ldi::feature_map fine = first(ldi::plan_convolution(g, 3), input);
    const ldi::feature_map coarse = second(ldi::plan_convolution(g, 3, half.map), fine);  // stride 2
    const ldi::feature_map result = third(ldi::plan_convolution(g, 3), {ldi::upsample(coarse, half.map), fine});

    CHECK((coarse.pixels() == half.map.kept().size() && coarse.channels == 5));
    CHECK((result.pixels() == g.size() && result.channels == 2));
}

TEST_CASE("a U-Net processes two unlinked surfaces as if each were alone") {
    std::mt19937 random(53);
    for (const bool is_partial : {false, true}) {
        const small_unet net(random, is_partial);
        const graph one = make_grid(20, 12);
        testing::sketched_graph two(one);  // the same sheet twice, one behind the other
        const std::int32_t count = static_cast<std::int32_t>(one.size());
        for (std::int32_t i = 0; i < count; ++i) two.add_pixel(one.x()[i], one.y()[i]);
        for (const side s : {side::right, side::down})
            for (std::int32_t i = 0; i < count; ++i)
                if (one.neighbor(i, s) != no_pixel) two.link(count + i, s, count + one.neighbor(i, s));
        const feature_map front = random_features(random, one.size(), 3), back = random_features(random, one.size(), 3);
        feature_map both(two.size(), 3);
        std::copy(front.values.begin(), front.values.end(), both.values.begin());
        std::copy(back.values.begin(), back.values.end(), both.values.begin() + front.values.size());
        const buffer<float> result = net(two, both).values, in_front = net(one, front).values, behind = net(one, back).values;
        CHECK(std::equal(in_front.begin(), in_front.end(), result.begin()));
        CHECK(std::equal(behind.begin(), behind.end(), result.begin() + in_front.size()));
    }
}

TEST_CASE("a U-Net runs on any graph and returns the same bits on any number of threads") {
    thread_pool three(3);
    testing::for_random_graphs(54, 60, [&](const testing::random_layers& layers, std::mt19937& random) {
        const small_unet net(random, testing::chance(random, 50));
        const feature_map input = random_features(random, layers.topology().size(), 3);
        const feature_map result = net(layers.topology(), input);
        CHECK(result.pixels() == layers.topology().size());
        CHECK(result.values == net(layers.topology(), input, three).values);
    });
}

TEST_CASE("if any allocation in a U-Net fails, all its memory is released") {
    std::mt19937 random(55);
    const small_unet net(random);
    const graph g = make_grid(40, 30);
    const feature_map input = random_features(random, g.size(), 3);
    thread_pool three(3);
    testing::counted_memory memory;
    std::size_t tried = 0;
    for (bool ran = false; !ran; ++tried) {
        memory.calls = 0, memory.most = tried;
        const memory_scope scope(memory.source);
        try {
            net(g, input, three);
            ran = true;
        } catch (const std::bad_alloc&) {
        }
        REQUIRE(memory.blocks == 0);
        REQUIRE(memory.bytes == 0);
    }
    CHECK(tried > 30);
}

TEST_CASE("a layer refuses unsupported kernel sizes and slopes, wrong numbers of weights, and plans and maps of other sizes") {
    const std::vector<float> weights(2 * 3 * 9), bias(2), nothing;
    const auto error_of = [](auto&& run) { return ldi::testing::raised(run); };
    using weights_view = std::span<const float>;
    for (const std::int32_t size : {-3, 0, 2, 4, 17})
        CHECK(error_of([&] { ldi::convolution_layer(weights, bias, {.kernel_size = size}); }) == ldi::error_code::invalid_option);
    for (const float slope : {-0.1F, 1.5F, NAN})
        CHECK(error_of([&] { ldi::convolution_layer(weights, bias, {.after = ldi::leaky_relu(slope)}); }) ==
              ldi::error_code::invalid_option);
    CHECK(error_of([&] { ldi::convolution_layer(weights_view(weights).first(53), bias); }) == ldi::error_code::mismatch);
    CHECK(error_of([&] { ldi::convolution_layer(weights, nothing); }) == ldi::error_code::mismatch);
    CHECK(error_of([&] { ldi::convolution_layer(nothing, bias); }) == ldi::error_code::mismatch);

    const ldi::convolution_layer layer(weights, bias);
    const ldi::graph g = ldi::make_grid(8, 8);
    const ldi::feature_map three(g.size(), 3), two(g.size(), 2), fewer(63, 3);
    CHECK_FALSE(error_of([&] { layer(ldi::plan_convolution(g, 3), three); }));
    CHECK(error_of([&] { layer(ldi::plan_convolution(g, 5), three); }) == ldi::error_code::mismatch);
    CHECK(error_of([&] { layer(ldi::plan_convolution(g, 3), two); }) == ldi::error_code::mismatch);
    CHECK(error_of([&] { layer(ldi::plan_convolution(g, 3), fewer); }) == ldi::error_code::mismatch);
    CHECK(error_of([&] { layer(ldi::plan_convolution(g, 3), {three, two}); }) == ldi::error_code::mismatch);
    CHECK(error_of([&] { layer(ldi::convolution_plan(), three); }) == ldi::error_code::mismatch);
}

TEST_CASE("a moved-from layer refuses to run until another layer is assigned to it") {
    std::mt19937 random(61);
    for (const std::int32_t size : {1, 3}) {
        convolution_layer first = random_layer(random, 3, 5, {.kernel_size = size});
        const graph g = make_grid(8, 8);
        const convolution_plan plan = plan_convolution(g, size);
        const feature_map x = random_features(random, 64, 3), expected = first(plan, x);
        convolution_layer second = std::move(first);
        CHECK(ldi::testing::raised([&] { first(plan, x); }) == error_code::mismatch);
        CHECK(ldi::testing::raised([&] { first(plan, std::initializer_list<feature_view>{}); }) == error_code::mismatch);
        first = std::move(second);
        CHECK(first(plan, x).values == expected.values);
    }
}

TEST_CASE("a layer sets the outputs that a restricted plan omits to zero") {
    static constexpr std::align_val_t alignment{buffer_alignment};  // Windows has no std::aligned_alloc
    struct dirty {
        static void* allocate(void*, std::size_t size, std::size_t) {
            return std::memset(::operator new(size, alignment), 0x41, size);
        }
        static void release(void*, void* block, std::size_t) { ::operator delete(block, alignment); }
    };
    const memory filled{nullptr, dirty::allocate, dirty::release};
    const memory_scope scope(filled);
    std::mt19937 random(60);
    const graph g = make_grid(8, 8);
    const feature_map x = random_features(random, 64, 2);
    const buffer<std::int32_t> some{0, 1, 18, 19, 20, 21, 22, 40};
    for (const bool is_partial : {false, true}) {
        const convolution_layer layer = random_layer(random, 2, 5, {.is_partial = is_partial});
        const convolution_plan plan = plan_convolution(g, 3);
        const feature_map all = layer(plan, x), part = layer(restrict_to(plan, some), x);
        for (std::int32_t i = 0; i < 64; ++i)
            for (std::size_t c = 0; c < 5; ++c)
                CHECK(part.at(i)[c] == (std::find(some.begin(), some.end(), i) == some.end() ? 0.0F : all.at(i)[c]));
    }
}
