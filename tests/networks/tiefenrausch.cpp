#include <ldi/io/caffe2.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <tests/support/caffe2_files.hpp>
#include <tests/support/npy.hpp>
#include <tests/support/random_bytes.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#ifndef LDI_SHARED_DIR
#define LDI_SHARED_DIR "../shared"
#endif

namespace {

using ldi::image;

const std::string folder = std::string(LDI_SHARED_DIR) + "/tiefenrausch/";

std::optional<ldi::tiefenrausch> load(ldi::isa set) {
    const auto operators = ldi::testing::read_bytes(folder + "model/tiefenrausch.pb");
    const auto weights = ldi::testing::read_bytes(folder + "model/tiefenrausch_init.pb");
    return operators.empty() ? std::nullopt
                             : std::optional<ldi::tiefenrausch>(std::in_place, ldi::read_caffe2(operators, weights), set);
}

/// The published network; prints a message and returns nothing if it is missing.
const ldi::tiefenrausch* published() {
    static const std::optional<ldi::tiefenrausch> network = load(ldi::best_isa());
    if (!network.has_value()) WARN("skipped: there is no " << folder);
    return network.has_value() ? &*network : nullptr;
}

ldi::tiefenrausch small() {
    const ldi::testing::caffe2_files files = ldi::testing::small_network();
    return ldi::tiefenrausch(ldi::read_caffe2(files.network, files.weights));
}

template <class Scalar>
image<Scalar> read_image(const std::string& path) {
    const ldi::testing::npy_array<Scalar> array = ldi::testing::read_npy<Scalar>(path);
    REQUIRE(array.shape.size() >= 2);
    ldi::image<Scalar> result(array.shape[0], array.shape[1], array.shape.size() > 2 ? array.shape[2] : 1);
    REQUIRE(result.size() == array.values.size());
    std::copy(array.values.begin(), array.values.end(), result.data());
    return result;
}

template <class Scalar>
std::size_t differences(const image<Scalar>& a, const image<Scalar>& b) {
    REQUIRE(same_shape(a, b));
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) count += a.data()[i] != b.data()[i];
    return count;
}

image<std::uint8_t> gradient(std::size_t height, std::size_t width) {
    ldi::image<std::uint8_t> result(height, width, 3);
    for (std::size_t i = 0; i < result.size(); ++i) result.data()[i] = static_cast<std::uint8_t>(i * 37 / 3 + i / 50);
    return result;
}

}  // namespace

TEST_CASE("for the photo `columns`, the resized photo, all 110592 levels and the disparities equal the published values") {
    const ldi::tiefenrausch* const network = published();
    if (network == nullptr) return;
    ldi::thread_pool threads;
    const image<std::uint8_t> photo = read_image<std::uint8_t>(folder + "golden/columns_1024x768_rgb.npy");
    const image<std::uint8_t> resized = ldi::tiefenrausch::resize_for_network(photo, threads);
    CHECK(differences(resized, read_image<std::uint8_t>(folder + "golden/columns_384x288_rgb.npy")) == 0);
    const image<std::uint8_t> logarithm = network->levels(resized, threads);
    CHECK(logarithm.size() == 110592);
    CHECK(differences(logarithm, read_image<std::uint8_t>(folder + "golden/columns_384x288_log_disparity_u8.npy")) == 0);
    CHECK(differences(network->disparity_of(logarithm), read_image<float>(folder + "output/columns.npy")) == 0);
}

TEST_CASE("for the photo `pumpkin`, the resized photo and all levels equal those of the exact implementation") {
    const ldi::tiefenrausch* const network = published();
    if (network == nullptr) return;
    ldi::thread_pool threads;
    const image<std::uint8_t> photo = read_image<std::uint8_t>(folder + "golden/pumpkin_1024x768_rgb.npy");
    const image<std::uint8_t> resized = ldi::tiefenrausch::resize_for_network(photo, threads);
    CHECK(differences(resized, read_image<std::uint8_t>(folder + "golden/pumpkin_384x288_rgb.npy")) == 0);
    const image<std::uint8_t> logarithm = network->levels(resized, threads);
    CHECK(differences(logarithm, read_image<std::uint8_t>(folder + "golden/pumpkin_384x288_log_disparity_u8.npy")) == 0);
}

TEST_CASE("the published output is the same on every instruction set and with any number of threads") {
    if (published() == nullptr) return;
    const image<std::uint8_t> rgb = read_image<std::uint8_t>(folder + "golden/columns_384x288_rgb.npy");
    const image<std::uint8_t> expected = read_image<std::uint8_t>(folder + "golden/columns_384x288_log_disparity_u8.npy");
    for (ldi::isa set : ldi::testing::available_isas()) {
        INFO(to_string(set));
        const std::optional<ldi::tiefenrausch> network = load(set);
        for (std::size_t count : {1U, 2U, 5U}) {
            if (set == ldi::isa::scalar && count != 2) continue;  // scalar code needs seconds per run
            ldi::thread_pool threads(count);
            CHECK(differences(network->levels(rgb, threads), expected) == 0);
        }
    }
}

TEST_CASE("a run at 384 x 288 needs at most 8 MiB of working memory") {
    const ldi::tiefenrausch* const network = published();
    if (network == nullptr) return;
    for (const ldi::tensor_size size : {ldi::tensor_size{384, 288}, ldi::tensor_size{288, 384}})
        for (std::size_t threads : {1U, 2U}) CHECK(network->working_bytes(size, threads) <= std::size_t{8} << 20);
}

TEST_CASE("on a 64 x 64 crop, every layer equals the exact implementation's, with any number of threads") {
    const ldi::tiefenrausch* const network = published();
    if (network == nullptr) return;
    const std::string layers = folder + "golden/layers_64x64/";
    const image<std::uint8_t> rgb = read_image<std::uint8_t>(layers + "input_rgb.npy");
    CHECK(differences(network->quantized_color(rgb), read_image<std::uint8_t>(layers + "0_int8.npy")) == 0);
    for (std::size_t count : {1U, 2U, 5U}) {
        ldi::thread_pool threads(count);
        std::size_t compared = 0;
        network->levels_observed(rgb, threads, [&](std::size_t, std::string_view name, const image<std::uint8_t>& tensor) {
            INFO(name);
            CHECK(differences(tensor, read_image<std::uint8_t>(layers + std::string(name) + ".npy")) == 0);
            ++compared;
        });
        CHECK(compared == 190);
    }
}

TEST_CASE("several threads can use one network at the same time") {
    const ldi::tiefenrausch network = small();
    ldi::serial_executor serial;
    std::vector<image<float>> expected(4), found(4);
    for (std::size_t i = 0; i < 4; ++i) expected[i] = network.disparity(gradient(100 + 40 * i, 150), {}, serial);
    std::vector<std::thread> callers;
    for (std::size_t i = 0; i < 4; ++i)
        callers.emplace_back([&, i] {
            ldi::thread_pool threads(2);
            found[i] = network.disparity(gradient(100 + 40 * i, 150), {}, threads);
        });
    for (std::thread& caller : callers) caller.join();
    for (std::size_t i = 0; i < 4; ++i) CHECK((found[i] == expected[i]));
}

TEST_CASE("network_size() sets the long side to 384 and rounds the other down to a multiple of 32, at least 32") {
    using ldi::tensor_size;
    const auto size = [](std::size_t height, std::size_t width) { return ldi::tiefenrausch::network_size({height, width}); };
    CHECK(size(1024, 768) == tensor_size{384, 288});
    CHECK(size(768, 1024) == tensor_size{288, 384});
    CHECK(size(1536, 1152) == tensor_size{384, 288});
    CHECK(size(384, 384) == tensor_size{384, 384});
    CHECK(size(1000, 999) == tensor_size{384, 352});
    CHECK(size(1920, 1080) == tensor_size{384, 192});
    CHECK(size(1, 1) == tensor_size{384, 384});
    CHECK(size(1, 100000) == tensor_size{32, 384});
    CHECK(size(100000000, 3) == tensor_size{384, 32});
}

TEST_CASE("disparity is the exponential of log disparity, and grows by the same factor from level to level") {
    const ldi::tiefenrausch network = small();
    ldi::serial_executor serial;
    const image<std::uint8_t> photo = gradient(200, 300);
    const image<std::uint8_t> logarithm = network.levels(ldi::tiefenrausch::resize_for_network(photo, serial), serial);
    const image<float> disparity = network.disparity(photo, {}, serial);
    REQUIRE(disparity.size() == logarithm.size());
    CHECK(disparity.channels() == 1);
    const ldi::quantization q = network.level_quantization();
    CHECK(static_cast<double>(network.quantization_step()) == Approx(std::exp(static_cast<double>(q.scale))).epsilon(1e-6));
    std::size_t broken = 0;
    for (std::size_t i = 0; i < disparity.size(); ++i) {
        const double expected = std::exp((logarithm.data()[i] - q.zero_point) * static_cast<double>(q.scale));
        broken += !(std::abs(static_cast<double>(disparity.data()[i]) / expected - 1) < 1e-6);
    }
    CHECK(broken == 0);
}

TEST_CASE(
    "if a network outputs disparity, positive levels become multiples of the quantization step, and all others half a step") {
    const ldi::testing::caffe2_files files = ldi::testing::small_network();
    const ldi::tiefenrausch network(ldi::read_caffe2(files.network, files.weights), ldi::isa::scalar,
                                    ldi::network_output::disparity);
    ldi::image<std::uint8_t> levels(1, 256, 1);
    for (std::size_t i = 0; i < 256; ++i) levels.data()[i] = static_cast<std::uint8_t>(i);
    const image<float> disparity = network.disparity_of(levels);
    const ldi::quantization q = network.level_quantization();
    for (std::size_t i = 0; i < 256; ++i) {
        const int steps = static_cast<int>(i) - int{q.zero_point};
        CHECK(disparity.data()[i] == Approx(steps > 0 ? static_cast<float>(steps) * q.scale : q.scale / 2));
    }
    CHECK(network.quantization_step() == disparity.data()[255] / disparity.data()[254]);
}

TEST_CASE("photos of one pixel, one row or one column have a disparity map") {
    const ldi::tiefenrausch network = small();
    ldi::serial_executor serial;
    for (const auto& [height, width] : {std::pair<std::size_t, std::size_t>{1, 1}, {1, 5000}, {20000, 1}, {3, 7}}) {
        const image<std::uint8_t> photo = gradient(height, width);
        const image<float> disparity = network.disparity(photo, {}, serial);
        const ldi::tensor_size size = ldi::tiefenrausch::network_size({height, width});
        CHECK((disparity.height() == size.height && disparity.width() == size.width));
        bool is_sound = true;
        for (float value : disparity) is_sound = is_sound && value > 0 && std::isfinite(value);
        CHECK(is_sound);
    }
    // A single pixel fills the whole image.
    const image<std::uint8_t> filled = ldi::tiefenrausch::resize_for_network(gradient(1, 1), serial);
    for (std::size_t c = 0; c < 3; ++c) CHECK(filled(383, 383, c) == gradient(1, 1)(0, 0, c));
}

TEST_CASE("empty images, images without three channels, and sizes that the network does not accept are refused") {
    const ldi::tiefenrausch network = small();
    ldi::serial_executor serial;
    const auto empty = ldi::image<std::uint8_t>(0, 5, 3);
    CHECK_THROWS_AS(network.disparity(empty, {}, serial), ldi::error);
    CHECK_THROWS_AS(network.disparity(ldi::image<std::uint8_t>(5, 5, 4, 0), {}, serial), ldi::error);
    CHECK_THROWS_AS(network.levels(empty, serial), ldi::error);
    CHECK_THROWS_AS(network.levels(ldi::image<std::uint8_t>(64, 48, 3, 0), serial), ldi::error);
    CHECK_THROWS_AS(network.levels(ldi::image<std::uint8_t>(64, 64, 1, 0), serial), ldi::error);
}

TEST_CASE("networks whose output has the wrong shape or too coarse a quantization step are refused") {
    const ldi::testing::caffe2_files files = ldi::testing::small_network();
    const ldi::network_description sound = ldi::read_caffe2(files.network, files.weights);
    ldi::network_description wide = sound, half = sound, steep = sound;
    wide.output = 5;
    half.output = 2;
    steep.operators.back().output.scale = 1;
    CHECK_THROWS_AS(ldi::tiefenrausch(wide), ldi::error);
    CHECK_THROWS_AS(ldi::tiefenrausch(half), ldi::error);
    CHECK_THROWS_AS(ldi::tiefenrausch(steep), ldi::error);
}

TEST_CASE("a network whose output has the input's size only for the smallest input is refused at other sizes") {
    ldi::network_description odd;
    odd.input_name = "input", odd.input_channels = 3, odd.input = {1.0F / 255, 0};
    const auto halve = [&](std::size_t times) {
        for (; times > 0; --times) {
            ldi::convolution_description c;
            c.input = odd.operators.size(), c.kernel = 1, c.stride = 2;
            c.weights = ldi::buffer<std::uint8_t>(c.input == 0 ? 3 : 1, std::uint8_t{1});
            c.weight_quantization = {0.5F, 0};
            c.bias = ldi::buffer<std::int32_t>(1);
            odd.operators.push_back({"convolution", {1.0F / 255, 0}, c});
        }
    };
    const auto triple = [&](std::size_t times) {
        for (; times > 0; --times)
            odd.operators.push_back({"resize", {1.0F / 255, 0}, ldi::nearest_resize_description{odd.operators.size(), 3}});
    };
    halve(5), triple(4), halve(2), triple(1), halve(1);  // 32 -> 1 -> 81 -> 21 -> 63 -> 32, but 64 -> 2 -> 162 -> 41 -> 123 -> 62
    odd.output = odd.operators.size();
    const ldi::tiefenrausch network(odd, ldi::best_isa(), ldi::network_output::disparity, {64, 32});
    CHECK_THROWS_WITH(network.disparity(image<std::uint8_t>(5, 5, 3)), Catch::Contains("62 x 62"));
}

namespace {

ldi::tiefenrausch small_at(ldi::depth_network_sizes sizes) {
    const ldi::testing::caffe2_files files = ldi::testing::small_network();
    return ldi::tiefenrausch(ldi::read_caffe2(files.network, files.weights), ldi::best_isa(), ldi::network_output::log_disparity,
                             sizes);
}

double mean_of(const image<float>& map) { return std::accumulate(map.begin(), map.end(), 0.0) / static_cast<double>(map.size()); }

image<float> random_map(std::size_t height, std::size_t width, unsigned seed) {
    std::mt19937 random(seed);
    image<float> result(height, width);
    for (float& v : result) v = std::uniform_real_distribution<float>(1, 2)(random);
    return result;
}

}  // namespace

TEST_CASE("progress rises to 1, and a request to stop ends the run") {
    const ldi::tiefenrausch network = small();
    ldi::serial_executor serial;
    struct record {
        ldi::buffer<float> fractions;
        bool stop = false;
    } seen;
    ldi::progress_listener follow;
    follow.user = &seen;
    follow.on_progress = [](void* user, std::string_view, float fraction) {
        static_cast<record*>(user)->fractions.push_back(fraction);
    };
    follow.is_canceled = [](void* user) { return static_cast<record*>(user)->stop; };
    for (const ldi::tiefenrausch& n : {network, small_at({96, 64})}) {
        seen = {};
        n.disparity(gradient(40, 40), follow, serial);
        CHECK(seen.fractions.size() >= 2);
        CHECK(std::is_sorted(seen.fractions.begin(), seen.fractions.end()));
        CHECK(seen.fractions.back() == Approx(1.0F));
        seen.stop = true;
        CHECK_THROWS_AS(n.disparity(gradient(40, 40), follow, serial), ldi::error);
    }
}

TEST_CASE("with two input sizes, the result is the disparity map of the larger size, moved to the mean layout of both runs") {
    const image<std::uint8_t> photo = gradient(200, 300);
    const image<float> details = small_at({192, 0}).disparity(photo);
    ldi::serial_executor serial;
    const image<std::uint8_t> seen = ldi::detail::mirrored(ldi::tiefenrausch::resize_for_network(photo, serial, 96));
    const ldi::tiefenrausch network = small_at({});
    const image<float> layout = ldi::detail::mirrored(network.disparity_of(network.levels(seen, serial)));
    const image<float> both = small_at({192, 96}).disparity(photo);
    CHECK((both.height() == 128 && both.width() == 192));
    const float least = network.disparity_of(image<std::uint8_t>(1, 1))(0, 0);
    image<float> expected = ldi::detail::with_layout(details, layout);
    for (float& v : expected) v = std::max(v, least);
    CHECK((both == expected));
    CHECK((both != details));
    CHECK(mean_of(both) == Approx((mean_of(details) + mean_of(layout)) / 2).epsilon(0.01));
}

TEST_CASE("with_layout() leaves a map with its own layout unchanged, and moves it halfway to a uniformly nearer layout") {
    for (unsigned seed = 0; seed < 20; ++seed) {
        const image<float> map = random_map(64 + 32 * (seed % 3), 96, seed);
        image<float> nearer = map;
        for (float& v : nearer) v += 0.5F;
        const image<float> same = ldi::detail::with_layout(map, map), moved = ldi::detail::with_layout(map, nearer);
        std::size_t broken = 0;
        for (std::size_t i = 0; i < map.size(); ++i) {
            broken += same.data()[i] != map.data()[i];
            broken += !(std::abs(moved.data()[i] - map.data()[i] - 0.25F) < 1e-5F);
        }
        CHECK(broken == 0);
    }
}

TEST_CASE("with_layout() nearly preserves the differences between neighboring samples") {
    for (unsigned seed = 0; seed < 20; ++seed) {
        const image<float> map = random_map(64, 96, seed), other = random_map(32, 64, seed + 100);
        const image<float> both = ldi::detail::with_layout(map, other);
        float most = 0;
        for (std::size_t y = 0; y < map.height(); ++y)
            for (std::size_t x = 1; x < map.width(); ++x)
                most = std::max(most, std::abs((both(y, x, 0) - both(y, x - 1, 0)) - (map(y, x, 0) - map(y, x - 1, 0))));
        CHECK(most < 1.0F / 16);  // 1 / 16 bounds how fast the added amount changes from sample to sample
    }
}

TEST_CASE("mirroring an image twice restores it") {
    const image<std::uint8_t> photo = gradient(7, 10);
    CHECK((ldi::detail::mirrored(photo) != photo));
    CHECK((ldi::detail::mirrored(ldi::detail::mirrored(photo)) == photo));
}

TEST_CASE("network sizes that are zero, too large, or not multiples of 32 are refused") {
    CHECK_THROWS_AS(small_at({400, 0}), ldi::error);
    CHECK_THROWS_AS(small_at({384, 100}), ldi::error);
    CHECK_THROWS_AS(small_at({0, 384}), ldi::error);
    CHECK_THROWS_AS(small_at({8192, 0}), ldi::error);
    CHECK(small_at({64, 32}).sizes().layout == 32);
}
