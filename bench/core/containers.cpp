// Graphs and layered images of 1152 x 1536 pixels with the columns of a photo: make_grid, lift, grow, keep, reorder, edit_links,
// validate. "copy" copies the bytes of the graph and its columns: no function that returns new ones can be faster.

#include <ldi/core/layered_image.hpp>
#include <ldi/occlusion/lift.hpp>

#include "bench/core/photo_graph.hpp"

#include <benchmark/benchmark.h>

#include <cstdint>
#include <utility>

namespace {

using ldi::benchmarks::photo_height;
using ldi::benchmarks::photo_width;

ldi::photo_layers grid_layers() { return ldi::photo_layers(ldi::make_grid(photo_width, photo_height)); }

/// Measures change(layers) on a fresh copy in each iteration.
template <class Change>
void measure_change(benchmark::State& state, Change&& change) {
    const ldi::photo_layers original = grid_layers();
    for (auto _ : state) {
        state.PauseTiming();
        ldi::photo_layers layers = original;
        state.ResumeTiming();
        change(layers);
        benchmark::DoNotOptimize(layers.column<ldi::disparity_column>().data());
        state.PauseTiming();
        layers = {};
        state.ResumeTiming();
    }
}

void copy(benchmark::State& state) {
    const ldi::photo_layers original = grid_layers();
    for (auto _ : state) {
        const ldi::photo_layers layers = original;
        benchmark::DoNotOptimize(layers.column<ldi::disparity_column>().data());
    }
}
BENCHMARK(copy)->Unit(benchmark::kMillisecond);

void make_grid(benchmark::State& state) {
    for (auto _ : state) benchmark::DoNotOptimize(ldi::make_grid(photo_width, photo_height).count());
}
BENCHMARK(make_grid)->Unit(benchmark::kMillisecond);

void lift(benchmark::State& state) {
    const ldi::image<std::uint8_t> photo(photo_height, photo_width, 3);
    ldi::image<float> disparity(photo_height, photo_width);
    for (std::size_t y = 0; y < disparity.height(); ++y)
        for (std::size_t x = 0; x < disparity.width(); ++x) disparity(y, x) = (x / 64 + y / 64) % 2 == 0 ? 0.2F : 0.8F;
    for (auto _ : state) benchmark::DoNotOptimize(ldi::lift(photo, disparity).size());
}
BENCHMARK(lift)->Unit(benchmark::kMillisecond);

/// Adds a tenth of the pixels in one piece. The time includes the builder's work.
void grow(benchmark::State& state) {
    measure_change(state, [](ldi::photo_layers& layers) {
        const std::int32_t old = layers.topology().count(), added = old / 10;
        layers.grow([&](ldi::graph_builder b) {
            ldi::buffer<std::int32_t> origins;
            for (std::int32_t i = 0; i < added; ++i) {
                b.add_pixel(i % photo_width, i / photo_width);
                origins.push_back(i);
            }
            return ldi::grown_pixels{std::move(b).build(), {{0, old, false}, {0, added, true}}, std::move(origins)};
        });
    });
}
BENCHMARK(grow)->Unit(benchmark::kMillisecond);

/// Removes every tenth pixel.
void keep(benchmark::State& state) {
    ldi::buffer<std::uint8_t> kept(std::size_t{photo_width} * photo_height, 1);
    for (std::size_t i = 0; i < kept.size(); i += 10) kept[i] = 0;
    measure_change(state, [&](ldi::photo_layers& layers) { layers.keep(kept); });
}
BENCHMARK(keep)->Unit(benchmark::kMillisecond);

/// Reverses each row.
void reorder(benchmark::State& state) {
    ldi::buffer<std::int32_t> order;
    for (std::int32_t y = 0; y < photo_height; ++y)
        for (std::int32_t x = photo_width; x-- > 0;) order.push_back(y * photo_width + x);
    measure_change(state, [&](ldi::photo_layers& layers) { layers.reorder(order); });
}
BENCHMARK(reorder)->Unit(benchmark::kMillisecond);

/// Unlinks every tenth pixel from its right neighbor.
void edit_links(benchmark::State& state) {
    measure_change(state, [](ldi::photo_layers& layers) {
        layers.edit_links([](ldi::link_editor& links) {
            for (std::int32_t i = 0; i < photo_width * photo_height; i += 10) links.unlink(i, ldi::side::right);
        });
    });
}
BENCHMARK(edit_links)->Unit(benchmark::kMillisecond);

void validate(benchmark::State& state) {
    const ldi::photo_layers layers = grid_layers();
    for (auto _ : state) benchmark::DoNotOptimize(ldi::validate(layers).has_value());
}
BENCHMARK(validate)->Unit(benchmark::kMillisecond);

}  // namespace
