// Windows of every kernel size of the inpainting network (3, 5, 7), around the pixels at a photo's silhouettes: elsewhere an LDI
// is an image and needs no exploration.

#include <ldi/core/window.hpp>

#include "bench/core/photo_graph.hpp"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <iterator>
#include <vector>

namespace {

void windows_of_photo(benchmark::State& state) {
    const ldi::graph g = ldi::benchmarks::photo_graph();
    const std::int32_t kernel_size = static_cast<std::int32_t>(state.range(0));
    ldi::buffer<std::int32_t> window(static_cast<std::size_t>(kernel_size * kernel_size));
    ldi::buffer<std::int32_t> pixels;
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(g.size()); ++i)
        if (std::any_of(std::begin(ldi::all_sides), std::end(ldi::all_sides),
                        [&](ldi::side s) { return g.neighbor(i, s) == ldi::no_pixel; }))
            pixels.push_back(i);
    for (auto _ : state)
        for (const std::int32_t pixel : pixels) {
            ldi::gather_window(g, pixel, kernel_size, window);
            benchmark::DoNotOptimize(window.data());
            benchmark::ClobberMemory();
        }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(pixels.size()));
}
BENCHMARK(windows_of_photo)->Arg(3)->Arg(5)->Arg(7);

}  // namespace
