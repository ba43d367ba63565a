// Where the time of the depth network goes: one line for each of its steps (a block, or a layer that belongs to none), named by
// the tensor that it makes, with the share that it reaches of what the processor can multiply at most, measured in the same run.
//
// Every line is the least of many runs, each of the whole network; --benchmark_filter only chooses which lines are shown.
#include <ldi/networks/caffe2.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <tests/support/npy.hpp>

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#ifndef LDI_SHARED_DIR
#define LDI_SHARED_DIR "../shared"
#endif

namespace {

using seconds = std::chrono::duration<double>;
using std::chrono::steady_clock;

const std::string folder = std::string(LDI_SHARED_DIR) + "/tiefenrausch/";

#if LDI_HAS_X86_KERNELS
LDI_BEGIN_TARGET(LDI_AVX512VNNI_FEATURES)
void multiply_vnni(long count) {
    __m512i a = _mm512_set1_epi32(1), b = a, c = a, d = a, e = a, f = a, g = a, h = a, i = a, j = a, k = a, l = a;
    const __m512i x = a, y = a;
    for (; count > 0; --count) {
        a = _mm512_dpbusd_epi32(a, x, y), b = _mm512_dpbusd_epi32(b, x, y), c = _mm512_dpbusd_epi32(c, x, y);
        d = _mm512_dpbusd_epi32(d, x, y), e = _mm512_dpbusd_epi32(e, x, y), f = _mm512_dpbusd_epi32(f, x, y);
        g = _mm512_dpbusd_epi32(g, x, y), h = _mm512_dpbusd_epi32(h, x, y), i = _mm512_dpbusd_epi32(i, x, y);
        j = _mm512_dpbusd_epi32(j, x, y), k = _mm512_dpbusd_epi32(k, x, y), l = _mm512_dpbusd_epi32(l, x, y);
        asm volatile("" : "+v"(a), "+v"(b), "+v"(c), "+v"(d), "+v"(e), "+v"(f));
        asm volatile("" : "+v"(g), "+v"(h), "+v"(i), "+v"(j), "+v"(k), "+v"(l));
    }
}
LDI_END_TARGET
LDI_BEGIN_TARGET(LDI_AVX2_FEATURES)
__m256i multiply_add(__m256i sum, __m256i x, __m256i y) {
    asm volatile("" : "+x"(x));  // or the compiler would multiply once for all sums
    return _mm256_add_epi32(sum, _mm256_madd_epi16(x, y));
}
void multiply_avx2(long count) {
    const __m256i x = _mm256_set1_epi32(1), y = x;
    __m256i a = x, b = x, c = x, d = x, e = x, f = x, g = x, h = x;
    for (; count > 0; --count) {
        a = multiply_add(a, x, y), b = multiply_add(b, x, y), c = multiply_add(c, x, y), d = multiply_add(d, x, y);
        e = multiply_add(e, x, y), f = multiply_add(f, x, y), g = multiply_add(g, x, y), h = multiply_add(h, x, y);
        asm volatile("" : "+x"(a), "+x"(b), "+x"(c), "+x"(d), "+x"(e), "+x"(f), "+x"(g), "+x"(h));
    }
}
LDI_END_TARGET
#endif

/// Multiplications a second that the instruction at the heart of the kernels reaches with everything in registers; 0 if unknown.
double peak_of([[maybe_unused]] ldi::isa set) {
#if LDI_HAS_X86_KERNELS
    constexpr long count = 50000;  // a fraction of a millisecond, so that some rounds run undisturbed
    void (*multiply)(long) = nullptr;
    double products = 0;
    if (set == ldi::isa::avx512vnni) multiply = multiply_vnni, products = count * 12.0 * 64;
    if (set == ldi::isa::avx2) multiply = multiply_avx2, products = count * 8.0 * 16;
    double best = 0;
    for (int i = 0; multiply != nullptr && i < 200; ++i) {
        const auto start = steady_clock::now();
        multiply(count);
        best = std::max(best, products / seconds(steady_clock::now() - start).count());
    }
    return best;
#else
    return 0;
#endif
}

/// The fewest seconds that each step took in some runs on one thread.
std::vector<double> measure(const ldi::tiefenrausch& network, const ldi::image<std::uint8_t>& rgb, std::size_t steps) {
    constexpr std::size_t runs = 31;
    std::vector<double> fewest(steps, 1e9);
    std::vector<std::byte> memory(network.working_bytes({ldi::height(rgb), ldi::width(rgb)}, 1));
    ldi::serial_executor serial;
    for (std::size_t run = 0; run < runs; ++run) {
        std::size_t step = 0;
        auto start = steady_clock::now();
        const auto after_step = [&](float) {
            fewest[step] = std::min(fewest[step], seconds(steady_clock::now() - start).count());
            ++step;
            start = steady_clock::now();
        };
        network.log_disparity(rgb, serial, after_step, memory);
    }
    return fewest;
}

void report(const std::string& name, double time, double products, double peak) {
    const auto line = [time, products, peak](benchmark::State& state) {
        for (auto _ : state) state.SetIterationTime(time);
        state.counters["MMAC"] = products / 1e6;
        state.counters["GMAC/s"] = products / time / 1e9;
        if (peak > 0) state.counters["share_of_peak"] = products / time / peak;
    };
    benchmark::RegisterBenchmark(name.c_str(), line)->Iterations(1)->UseManualTime()->Unit(benchmark::kMillisecond);
}

const bool registered = [] {
    const auto operators = ldi_test::read_bytes(folder + "model/tiefenrausch.pb");
    const auto weights = ldi_test::read_bytes(folder + "model/tiefenrausch_init.pb");
    const auto photo = ldi_test::read_npy<std::uint8_t>(folder + "golden/columns_384x288_rgb.npy");
    if (operators.empty() || photo.values.empty()) return false;  // the published network is absent
    ldi::image<std::uint8_t> rgb = ldi::make_image<std::uint8_t>(384, 288, 3);
    std::copy(photo.values.begin(), photo.values.end(), rgb.data());
    const ldi::tiefenrausch network(ldi::read_caffe2(operators, weights));
    const auto steps = network.describe_steps({384, 288});
    const std::vector<double> times = measure(network, rgb, steps.size());
    const double peak = peak_of(network.target());
    const std::string prefix = "tiefenrausch/" + std::string(to_string(network.target())) + "/";
    double time = 0, products = 0;
    for (std::size_t i = 0; i < steps.size(); ++i) {
        const auto& s = steps[i];
        const double here = static_cast<double>(s.dense_products + s.depthwise_products);
        report(prefix + std::string(s.name) + " " + std::to_string(s.size.height) + "x" + std::to_string(s.size.width), times[i],
               here, peak);
        time += times[i], products += here;
    }
    report(prefix + "all steps", time, products, peak);
    return true;
}();

}  // namespace
