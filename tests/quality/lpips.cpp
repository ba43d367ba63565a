// Tests LPIPS of bench/quality. With the published weights, results equal those of ../shared/lpips/lpips.py. With random weights,
// LPIPS has the properties of a distance.
#include <bench/quality/lpips.hpp>

#include <catch2/catch.hpp>
#include <tests/support/files.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <utility>

namespace {

using namespace ldi_quality;

/// A picture from integer arithmetic, so that lpips.py gets the same picture from the same formula.
picture pattern(std::size_t height, std::size_t width, std::size_t seed) {
    picture result(height, width, 3);
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x)
            for (std::size_t c = 0; c < 3; ++c)
                result(y, x, c) = static_cast<std::uint8_t>((x * (c + seed) + y * y / (seed + 2) + 40 * c) % 256);
    return result;
}

/// The network with random weights of realistic magnitude.
lpips_network random_network() {
    std::mt19937 random(9);
    ldi::named_tensors tensors;
    const auto add = [&](const std::string& name, const ldi::buffer<std::size_t>& shape, float from, float to) {
        ldi::tensor t;
        t.shape = shape;
        std::size_t count = 1;
        for (const std::size_t length : shape) count *= length;
        ldi::buffer<float> values(count);
        for (float& value : values) value = std::uniform_real_distribution<float>(from, to)(random);
        t.values = std::move(values);
        tensors.tensors.emplace(name, std::move(t));
    };
    const auto convolution = [&](const std::string& name, std::size_t inputs, std::size_t outputs, std::size_t kernel) {
        const float most = 1.7F / std::sqrt(static_cast<float>(inputs * kernel * kernel));
        add(name + ".weight", {outputs, inputs, kernel, kernel}, -most, most);
        add(name + ".bias", {outputs}, 0, 0.1F);
    };
    convolution("slice1.conv", 3, 64, 3), add("slice1.lin", {64}, 0, 1);
    const std::size_t sizes[][3] = {{64, 16, 128},  {128, 32, 256}, {256, 48, 384},
                                    {384, 48, 384}, {384, 64, 512}, {512, 64, 512}};
    for (std::size_t level = 2; level < 8; ++level) {
        const auto [inputs, squeezed, outputs] = sizes[level - 2];
        const std::string slice = "slice" + std::to_string(level);
        for (std::size_t fire = 1; fire <= (level < 4 ? 2U : 1U); ++fire) {
            const std::string name = slice + ".fire" + std::to_string(fire) + "/";
            convolution(name + "conv", fire == 1 ? inputs : outputs, squeezed, 1);
            convolution(name + "expand1x1", squeezed, outputs / 2, 1);
            convolution(name + "expand3x3", squeezed, outputs / 2, 3);
        }
        add(slice + ".lin", {outputs}, 0, 1);
    }
    return lpips_network(tensors);
}

}  // namespace

TEST_CASE("LPIPS equals the result of lpips.py") {
    const std::filesystem::path archive = std::filesystem::path(LDI_SHARED_DIR) / "lpips" / "lpips_squeeze_oihw.npz";
    if (!std::filesystem::exists(archive)) {
        std::printf("skipped: there is no %s\n", archive.c_str());
        return;
    }
    const ldi::testing::scratch_folder folder;
    const std::filesystem::path weights = folder / "lpips.safetensors";
    const std::string program = std::string(LDI_SOURCE_DIR) + "/bench/quality/lpips_weights.py";
    REQUIRE(std::system(("python3 '" + program + "' '" + archive.string() + "' '" + weights.string() + "'").c_str()) == 0);
    const lpips_network network(ldi::load_safetensors(weights));
    const picture a = pattern(65, 90, 1), b = pattern(65, 90, 3);
    CHECK(network(a, b, mask(65, 90, 1, std::uint8_t{1})) == Approx(0.3162396).epsilon(1e-5));
    mask left(65, 90);
    for (std::size_t y = 0; y < 65; ++y)
        for (std::size_t x = 0; x < 30; ++x) left(y, x) = 1;
    CHECK(network(a, b, left) == Approx(0.2672409).epsilon(1e-5));
}

TEST_CASE("LPIPS is 0 for equal pictures, symmetric, and grows with noise") {
    const lpips_network network = random_network();
    const mask all(40, 50, 1, std::uint8_t{1});
    const picture a = pattern(40, 50, 2);
    CHECK(network(a, a, all) == 0);
    std::mt19937 random(4);
    double last = 0;
    for (const unsigned noise : {8U, 32U, 128U}) {
        picture b = a;
        for (std::uint8_t& value : b)
            value = static_cast<std::uint8_t>(std::min(255U, value + static_cast<unsigned>(random() % noise)));
        const double different = network(a, b, all);
        CHECK(different > last);
        CHECK(different == Approx(network(b, a, all)));
        last = different;
    }
    CHECK(network(a, pattern(40, 50, 7), mask(40, 50)) == 0);
}

TEST_CASE("LPIPS differences appear near a changed area and not in the opposite corner") {
    const lpips_network network = random_network();
    const picture a = pattern(300, 300, 2);
    picture b = a;
    for (std::size_t y = 0; y < 10; ++y)
        for (std::size_t x = 0; x < 30; ++x) b(y, x) = static_cast<std::uint8_t>(255 - b(y, x));
    const map different = network.differences(a, b);
    CHECK(different(5, 5) > 0);
    CHECK(different(299, 299) == 0);
}

TEST_CASE("LPIPS without weights is NaN") {
    const picture a = pattern(40, 50, 2);
    CHECK(std::isnan(lpips_network()(a, a, mask(40, 50, 1, std::uint8_t{1}))));
}
