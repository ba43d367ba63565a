// Registers benchmarks with one kind of report: processor time, allocations, and the rate as a share of the processor's peak.
#pragma once

#include <ldi/kernels/isa.hpp>

#include <benchmark/benchmark.h>

#include <cstddef>
#include <string>
#include <type_traits>
#include <utility>

namespace ldi_bench {

/// Allocations by operator new and by ldi's buffers since the program started.
std::size_t allocation_count();
/// Bytes in ldi's buffers now, and their maximum since reset_peak_bytes().
std::size_t bytes_now();
std::size_t peak_bytes();
void reset_peak_bytes();

/// Peak rates of this processor, measured before the benchmarks run. 0 if unknown.
double peak_int8(ldi::isa set);
double peak_float32(ldi::isa set);
double peak_bandwidth();

/// Work of one iteration. The first member that is not 0 determines the rate.
struct work {
    double int8_products = 0, float_products = 0;  ///< multiplications
    /// Bytes of the inputs that the operation must read, plus bytes that it must write. Each byte counts once, even if the
    /// code passes over it twice. A column that does not affect the result does not count. A change in place counts as read
    /// and written.
    double bytes = 0;
    double pixels = 0;
    ldi::isa set = ldi::best_isa();
};

/// Sets the counters "GMAC/s" or "GB/s" with "share_of_peak", or "Mpixel/s".
void report_rate(benchmark::State& state, const work& done);

/// Counts the allocations between start() and stop(), over all iterations.
class allocation_counter {
public:
    void start() { start_ = allocation_count(), before_ = bytes_now(), reset_peak_bytes(); }
    void stop() {
        count_ += allocation_count() - start_;
        peak_ = peak_bytes() - before_ > peak_ ? peak_bytes() - before_ : peak_;
    }
    /// Sets the counters "allocations", per iteration, and "peak_bytes".
    void report(benchmark::State& state) const {
        state.counters["allocations"] = benchmark::Counter(static_cast<double>(count_), benchmark::Counter::kAvgIterations);
        state.counters["peak_bytes"] = static_cast<double>(peak_);
    }

private:
    std::size_t start_ = 0, before_ = 0, count_ = 0, peak_ = 0;
};

/// Measures function(), and keeps the compiler from optimizing its result away. The first call is untimed: it fills the caches
/// and constructs static objects.
///
/// size  text for the table's column of sizes
template <class Function>
void measure(benchmark::State& state, const std::string& size, const work& done, Function&& function) {
    const auto run = [&] {
        if constexpr (std::is_void_v<decltype(function())>)
            function();
        else
            benchmark::DoNotOptimize(function());
        benchmark::ClobberMemory();
    };
    run();
    allocation_counter allocations;
    allocations.start();
    for (auto _ : state) run();
    allocations.stop();
    allocations.report(state);
    report_rate(state, done);
    state.SetLabel(size);
}

/// Measures change(value) on a fresh copy of `original` in each iteration. Neither the copy nor its destruction is timed. The
/// first call is untimed, as in measure().
template <class Value, class Change>
void measure_change(benchmark::State& state, const std::string& size, const work& done, const Value& original, Change&& change) {
    const auto run = [&](Value& copy) {
        if constexpr (std::is_void_v<decltype(change(copy))>)
            change(copy);
        else
            benchmark::DoNotOptimize(change(copy));
        benchmark::ClobberMemory();
    };
    {
        Value copy = original;
        run(copy);
    }
    allocation_counter allocations;
    for (auto _ : state) {
        state.PauseTiming();
        Value copy = original;
        allocations.start();
        state.ResumeTiming();
        run(copy);
        state.PauseTiming();
        allocations.stop();
        copy = Value();
        state.ResumeTiming();
    }
    allocations.report(state);
    report_rate(state, done);
    state.SetLabel(size);
}

/// Registers a benchmark. `name` is FOLDER/FUNCTION, then optional variants, each after a slash. tests/headers/benchmarks.py
/// compares it with the functions of include/ldi/FOLDER.
template <class Function>
benchmark::internal::Benchmark* add(const std::string& name, Function function) {
    return benchmark::RegisterBenchmark(name.c_str(), std::move(function))->Unit(benchmark::kMicrosecond);
}

/// Concatenates names. (For operator+ of strings, g++ 12 prints a false warning.)
template <class... Parts>
std::string joined(const Parts&... parts) {
    std::string result;
    (result.append(parts), ...);
    return result;
}

inline std::string size_text(std::size_t width, std::size_t height) {
    return std::to_string(width) + " x " + std::to_string(height);
}
inline std::string pixels_text(std::size_t pixels) { return std::to_string(pixels) + " pixels"; }

}  // namespace ldi_bench
