// ldi_bench: benchmarks of the library's kernels, operators and stages. All options are those of Google Benchmark. LDI_ISA
// forces an instruction set in benchmarks whose name does not contain one. bench/run.sh runs this program and writes a table.

#include "bench/support/measure.hpp"
#include "bench/support/peak_products.hpp"

#include <ldi/base/memory.hpp>

#include <benchmark/benchmark.h>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <map>
#include <new>
#include <string>
#include <string_view>
#include <vector>

namespace {

std::atomic<std::size_t> allocations{0}, bytes{0}, peak{0};

void* counted_allocate(void* context, std::size_t size, std::size_t alignment) {
    void* const memory = ldi::detail::allocate_from_system(context, size, alignment);
    if (memory != nullptr) {
        ++allocations;
        const std::size_t now = bytes += size;
        for (std::size_t before = peak; before < now && !peak.compare_exchange_weak(before, now);) {
        }
    }
    return memory;
}
void counted_release(void* context, void* memory, std::size_t size) {
    bytes -= size;
    ldi::detail::release_to_system(context, memory, size);
}
const ldi::memory counted_memory{nullptr, counted_allocate, counted_release};

struct peak_rates {
    std::map<ldi::isa, double> int8, float32;
    double bandwidth = 0;
};
peak_rates peaks;

/// Returns the bytes per second, read plus written, of the fastest of three passes over arrays of 128 MiB, larger than all
/// caches: the C library's copy, a scaling in place, and a sum added in place.
double streamed_bytes_per_second() {
    constexpr std::size_t count = std::size_t{1} << 25;
    std::vector<float> from(count, 1.0F), to(count, 2.0F);
    double best = 0;
    const auto time = [&](double passes, auto&& pass) {
        for (int i = 0; i < 5; ++i) {
            const auto start = std::chrono::steady_clock::now();
            pass();
            benchmark::ClobberMemory();
            const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
            best = std::max(best, passes * sizeof(float) * static_cast<double>(count) / seconds);
        }
    };
    time(2, [&] { std::memcpy(to.data(), from.data(), count * sizeof(float)); });
    time(2, [&] { std::transform(to.begin(), to.end(), to.begin(), [](float v) { return 0.5F * v; }); });
    time(3, [&] { std::transform(to.begin(), to.end(), from.begin(), to.begin(), [](float a, float b) { return a + b; }); });
    return best;
}

void measure_peaks() {
    peaks.bandwidth = streamed_bytes_per_second();
    benchmark::AddCustomContext("peak GB/s", std::to_string(peaks.bandwidth / 1e9));
    for (const ldi::instruction_set& set : ldi::instruction_sets) {
        if (!ldi::is_available(set.id)) continue;
        peaks.int8[set.id] = ldi_bench::peak_products(set.id);
        peaks.float32[set.id] = ldi_bench::peak_float_products(set.id);
        const std::string name(set.name);
        if (peaks.int8[set.id] > 0)
            benchmark::AddCustomContext("peak GMAC/s, int8, " + name, std::to_string(peaks.int8[set.id] / 1e9));
        if (peaks.float32[set.id] > 0)
            benchmark::AddCustomContext("peak GMAC/s, float32, " + name, std::to_string(peaks.float32[set.id] / 1e9));
    }
}

}  // namespace

// Not inlined: g++ 12 would warn that new and free() don't match.
[[gnu::noinline]] void* operator new(std::size_t size) {
    ++allocations;
    if (void* const memory = std::malloc(size > 0 ? size : 1)) return memory;
    throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace ldi_bench {

std::size_t allocation_count() { return allocations; }
std::size_t bytes_now() { return bytes; }
std::size_t peak_bytes() { return peak; }
void reset_peak_bytes() { peak = bytes.load(); }

double peak_int8(ldi::isa set) { return peaks.int8[set]; }
double peak_float32(ldi::isa set) { return peaks.float32[set]; }
double peak_bandwidth() { return peaks.bandwidth; }

void report_rate(benchmark::State& state, const work& done) {
    const auto set = [&](const char* name, double amount, double peak_rate) {
        state.counters[name] = benchmark::Counter(amount, benchmark::Counter::kIsIterationInvariantRate);
        if (peak_rate > 0)
            state.counters["share_of_peak"] =
                benchmark::Counter(1e9 * amount / peak_rate, benchmark::Counter::kIsIterationInvariantRate);
    };
    if (done.int8_products > 0)
        set("GMAC/s", done.int8_products / 1e9, peak_int8(done.set));
    else if (done.float_products > 0)
        set("GMAC/s", done.float_products / 1e9, peak_float32(done.set));
    else if (done.bytes > 0)
        set("GB/s", done.bytes / 1e9, peak_bandwidth());
    else if (done.pixels > 0)
        set("Mpixel/s", done.pixels / 1e6, 0);
}

}  // namespace ldi_bench

int main(int count, char** arguments) {
#if defined(__GLIBC__)
    // Keeps freed memory in the process. Stages free and allocate the same tens of megabytes; times do not include what the
    // system needs to provide new pages.
    mallopt(M_MMAP_THRESHOLD, 1 << 30);
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
#endif
    const ldi::memory_scope counts(counted_memory);
    measure_peaks();
    benchmark::AddCustomContext("instruction set", std::string(to_string(ldi::best_isa())));
#if defined(__clang__)
    benchmark::AddCustomContext("compiler", "clang " __clang_version__);
#else
    benchmark::AddCustomContext("compiler", "g++ " __VERSION__);
#endif
    benchmark::Initialize(&count, arguments);
    if (benchmark::ReportUnrecognizedArguments(count, arguments)) return 1;
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
