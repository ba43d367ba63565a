// Measures kernels/conv_f32.hpp in WebAssembly on one row of 1152 pixels, with each instruction set and with portable code.
// Prints the median and the best of many calls, in 10^9 multiplications per second.
//
//     em++ -std=c++20 -O2 -msimd128 -Iinclude bench/peers/webassembly/conv_f32.cpp -o conv_f32.js
//     node --no-experimental-fetch conv_f32.js
#include <ldi/kernels/conv_f32.hpp>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

namespace {

struct shape {
    std::size_t kernel_size, channels, outputs;
};

ldi::buffer<float> noise(std::size_t count) {
    ldi::buffer<float> values(count);
    std::uint32_t state = 1;
    for (float& v : values) v = static_cast<float>((state = state * 1664525U + 1013904223U) >> 8) / 16777216.0F - 0.5F;
    return values;
}

void measure(ldi::isa set, const shape& s) {
    using clock = std::chrono::steady_clock;
    const std::size_t pixels = 1152, row = (pixels + s.kernel_size - 1) * s.channels, inputs = s.kernel_size * s.channels;
    const ldi::buffer<float> input = noise(s.kernel_size * row);
    const auto weights =
        ldi::pack_conv_f32(set, noise(s.outputs * s.kernel_size * inputs), noise(s.outputs), s.kernel_size, ldi::relu);
    std::vector<const float*> rows;
    for (std::size_t r = 0; r < s.kernel_size; ++r) rows.push_back(input.data() + r * row);
    ldi::buffer<float> result(pixels * s.outputs);
    ldi::buffer<double> seconds;
    double all = 0.0;
    while (seconds.size() < 20 || all < 0.5) {
        const auto start = clock::now();
        ldi::conv_f32(weights, rows.data(), s.channels, pixels, nullptr, result.data());
        seconds.push_back(std::chrono::duration<double>(clock::now() - start).count());
        all += seconds.back();
    }
    std::sort(seconds.begin(), seconds.end());
    const double products = 1e-9 * static_cast<double>(result.size() * s.kernel_size * inputs);
    std::printf("   %s %5.2f, best %5.2f", std::string(to_string(set)).c_str(), products / seconds[seconds.size() / 2],
                products / seconds[0]);
}

}  // namespace

int main() {
    for (const shape& s : {shape{3, 16, 16}, shape{3, 32, 32}, shape{5, 20, 40}, shape{3, 56, 72}, shape{3, 44, 20},
                           shape{3, 24, 3}, shape{7, 4, 20}}) {
        std::printf("%zux%zu, %2zu -> %2zu", s.kernel_size, s.kernel_size, s.channels, s.outputs);
        for (const ldi::instruction_set& set : ldi::instruction_sets)
            if (is_available(set.id)) measure(set.id, s);
        std::printf("\n");
    }
}
