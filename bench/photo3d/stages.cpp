// Every stage on the way from photo to 3D photo at 1152 x 1536, one thread, beside the paper's times (section "Performance",
// iPhone 11 Pro). The counter `of_paper` is our time as a share of the paper's: below 1 is faster.
//
// The photo is a telephone's with the published network's depth where ../shared is present, else the shipped sample.

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/inpaint/texture_transfer.hpp>
#include <ldi/photo3d.hpp>

#include "bench/support/converted_photo.hpp"

#include <benchmark/benchmark.h>

#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

namespace {

ldi::serial_executor one_thread;
const ldi::photo3d_options options;

// The finished 3D photo: what every stage gets and gives.
const ldi::photo3d& photo() {
    static const ldi::photo3d result = ldi_bench::converted_photo(options);
    return result;
}

/// Times `stage`; paper is in milliseconds, 0 where the paper's table has no such line.
template <class Stage>
void measure(const char* name, double paper, Stage stage) {
    benchmark::RegisterBenchmark(
        name,
        [=](benchmark::State& state) {
            photo();
            for (auto _ : state) {
                auto result = stage(state);
                benchmark::DoNotOptimize(result);
            }
            if (paper > 0.0) {
                state.counters["paper_ms"] = paper;
                state.counters["of_paper"] =
                    benchmark::Counter(paper * 1e-3, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
            }
        })
        ->Unit(benchmark::kMillisecond)
        ->MinTime(0.3);
}

// Runs `prepare` outside the measured time.
template <class Prepare>
auto untimed(benchmark::State& state, Prepare prepare) {
    state.PauseTiming();
    auto result = prepare();
    state.ResumeTiming();
    return result;
}

const auto registered = [] {
    if (const auto network = ldi_bench::published_network())
        measure("depth estimation", 230,
                [network](benchmark::State&) { return network->disparity(photo().photo, {}, one_thread); });
    measure("resampling to the photo", 0,
            [](benchmark::State&) { return ldi::resample_to_photo(photo().estimated, photo().photo, {}, options.resample); });
    measure("depth filter", 51, [](benchmark::State&) { return ldi::weighted_median(photo().resampled, {}, options.median); });
    measure("connected components", 12, [](benchmark::State& state) {
        auto disparity = untimed(state, [] { return ldi::weighted_median(photo().resampled, {}, options.median); });
        ldi::merge_middle_components(disparity, {}, options.components);
        return disparity;
    });
    measure("lifting", 0, [](benchmark::State&) { return ldi::lift(photo().photo, photo().disparity); });
    measure("occluded geometry", 31, [](benchmark::State& state) {
        ldi::photo_layer layers = untimed(state, [] {
            ldi::photo_layer lifted = ldi::lift(photo().photo, photo().disparity);
            ldi::unmix_colors(lifted, options.mixed_colors);
            return lifted;
        });
        const auto curves = ldi::find_discontinuity_curves(layers, {}, options.curves);
        ldi::close_spurious_discontinuities(layers, curves);
        return ldi::expand(std::move(layers), {}, std::span<const ldi::discontinuity_curve>(curves), options.expand).layers;
    });
    measure("color inpainting (diffusion)", 540, [](benchmark::State& state) {
        ldi::photo_layers layers = untimed(state, [] { return photo().layers; });
        ldi::diffusion_inpainter().inpaint(layers, {}, one_thread);
        return layers;
    });
    measure("texture and grain", 0, [](benchmark::State& state) {
        ldi::photo_layers layers = untimed(state, [] { return photo().layers; });
        ldi::add_texture(layers, options.texture, options.grain);
        return layers;
    });
    measure("chart generation", 72, [](benchmark::State&) { return ldi::make_charts(photo().layers, {}, options.charts); });
    measure("chart padding", 151,
            [](benchmark::State&) { return ldi::make_atlas(photo().layers, photo().charts, options.atlas); });
    measure("meshing", 11, [](benchmark::State&) {
        return ldi::build_mesh(photo().layers, photo().facts, photo().charts, photo().atlas, options.mesh);
    });
    return true;
}();

}  // namespace
