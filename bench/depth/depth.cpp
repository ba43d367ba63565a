// Stages from an estimated depth map to clean disparity, measured one by one on the sample at 1152 x 1536, one thread. The
// estimate has a quarter of the photo's resolution, like that of a network.

#include "bench/support/measure.hpp"
#include "bench/support/sample.hpp"

#include <ldi/depth/align_silhouettes.hpp>
#include <ldi/depth/flakes.hpp>
#include <ldi/depth/level_dips.hpp>
#include <ldi/depth/middle_components.hpp>
#include <ldi/depth/normalize.hpp>
#include <ldi/depth/resample.hpp>
#include <ldi/depth/sharpen_edges.hpp>
#include <ldi/depth/step_band.hpp>
#include <ldi/depth/weighted_median.hpp>
#include <ldi/photo3d/clean_depth.hpp>

namespace {

using namespace ldi_bench;

/// Adds a stage that computes its result from one map of the sample.
///
/// source  member of sample_stages: the estimate (288 x 384), the filtered map or the file's map (1152 x 1536)
template <class Stage>
void add_stage(const std::string& name, const ldi::image<float> sample_stages::*source, Stage stage) {
    add(name, [=](benchmark::State& state) {
        const ldi::image<float>& from = sample().*source;
        measure(state, size_text(from.width(), from.height()), {.pixels = static_cast<double>(from.size())},
                [&] { return stage(from); });
    });
}

/// Adds a benchmark of a stage that changes the filtered map.
template <class Stage>
void add_change(const std::string& name, Stage stage) {
    add(name, [=](benchmark::State& state) {
        const ldi::image<float>& from = sample().filtered;
        measure_change(state, size_text(from.width(), from.height()), {.pixels = static_cast<double>(from.size())}, from,
                       [&](ldi::image<float>& map) { return stage(map); });
    });
}

const bool registered = [] {
    constexpr auto estimate = &sample_stages::estimate, filtered = &sample_stages::filtered, file = &sample_stages::depth_map;
    add_stage("depth/normalize", file,
              [](const ldi::image<float>& map) { return ldi::normalize(map, {.is_inverse_depth = false}).disparity; });
    add_stage("depth/level_dips", estimate, [](const ldi::image<float>& map) { return ldi::level_dips(map); });
    add_stage("depth/sharpen_edges", estimate, [](const ldi::image<float>& map) { return ldi::sharpen_edges(map); });
    add_stage("depth/weighted_median/estimate", estimate, [](const ldi::image<float>& map) { return ldi::weighted_median(map); });
    add_stage("depth/weighted_median/photo's size", filtered,
              [](const ldi::image<float>& map) { return ldi::weighted_median(map); });
    add("depth/resample_to_photo", [](benchmark::State& state) {
        const sample_stages& s = sample();
        measure(state, size_text(s.photo.width(), s.photo.height()), {.pixels = static_cast<double>(s.filtered.size())},
                [&] { return ldi::resample_to_photo(s.estimate, s.photo); });
    });
    add_stage("depth/find_step_band", filtered,
              [](const ldi::image<float>& map) { return ldi::find_step_band(map).region.count(); });
    add_change("depth/merge_middle_components", [](ldi::image<float>& map) { return ldi::merge_middle_components(map); });
    add_change("depth/merge_flakes", [](ldi::image<float>& map) {
        static const ldi::image<std::uint8_t> undecided(map.height(), map.width(), 1, std::uint8_t{0});
        return ldi::merge_flakes(map, undecided);
    });
    add_change("depth/align_silhouettes", [](ldi::image<float>& map) {
        ldi::alignment_options options;  // lengths for an estimate at a quarter of the photo's resolution
        options.uncertainty *= 4, options.min_length *= 4;
        ldi::align_silhouettes(map, sample().photo, {}, options);
    });
    add("photo3d/clean_depth", [](benchmark::State& state) {
        const sample_stages& s = sample();
        const ldi::given_disparity given{s.estimate};
        measure(state, size_text(s.photo.width(), s.photo.height()), {.pixels = static_cast<double>(s.filtered.size())},
                [&] { return ldi::clean_depth(s.photo, given).disparity; });
    });
    return true;
}();

}  // namespace
