// Measures the cost of silhouettes: runs one convolution on an image that is cut into ever smaller squares, each a separate
// surface. Pixels beside a cut have irregular windows, whose pixels are gathered link by link.
#include <ldi/nn/ldi/convolution_layer.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <utility>

/// Makes an image and removes the links between squares of `side` pixels; 0 removes none.
ldi::graph cut_image(std::int32_t width, std::int32_t height, std::int32_t side) {
    ldi::graph_builder b(ldi::make_grid(width, height));
    for (std::int32_t i = 0; side > 0 && i < width * height; ++i) {
        if (i % width != 0 && i % width % side == 0) b.unlink(i, ldi::side::left);
        if (i >= width && i / width % side == 0) b.unlink(i, ldi::side::up);
    }
    return std::move(b).build();
}

/// Returns the processor time per pixel in nanoseconds (minimum of 5 runs), and the share of irregular pixels.
std::pair<double, double> measure(const ldi::convolution_layer& layer, const ldi::graph& g, std::size_t channels) {
    const ldi::convolution_plan plan = ldi::plan_convolution(g, 3);
    ldi::feature_map input(g.size(), channels);
    std::fill(input.values.begin(), input.values.end(), 1.0F);
    double min_seconds = 1e9;
    for (int run = 0; run < 5; ++run) {
        const std::clock_t start = std::clock();
        const ldi::feature_map result = layer(plan, input);
        min_seconds = (std::min)(min_seconds, static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }
    const double pixels = static_cast<double>(g.size());
    return {1e9 * min_seconds / pixels, static_cast<double>(plan.irregular().size()) / pixels};
}

int main() {
    constexpr std::size_t channels = 16;
    const ldi::buffer<float> weights(channels * channels * 9, 0.01F), bias(channels, 0.0F);
    const ldi::convolution_layer layer(weights, bias, {.after = ldi::relu});
    const auto [image, border] = measure(layer, cut_image(640, 480, 0), channels);
    std::printf("squares   irregular   ns per pixel   an irregular pixel costs as much as\n");
    for (const std::int32_t side : {160, 80, 40, 20, 10, 5}) {
        const auto [time, share] = measure(layer, cut_image(640, 480, side), channels);
        // If an irregular pixel takes k times as long as a regular one, a share s of irregular pixels multiplies the time by
        // 1 + s (k - 1).
        std::printf("%7d %9.1f %% %12.1f %14.1f pixels of an image\n", side, 100 * share, time,
                    1 + (time / image - 1) / (std::max)(share - border, 1e-9));
    }
}
