// An ablation: measures the effect of each idea by leaving it out. For each row, the program makes the layered image of an
// archway and its charts without one of the paper's ideas, and prints counts.
#include "sample.hpp"

#include <ldi/charts/charts.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <utility>

struct stages {
    ldi::curve_options curves = {};
    ldi::expand_options growth{.motion = 1.0F, .iterations = 40};
    ldi::chart_options charts = {};
};

void print_row(const char* left_out, const learn::sample& photo, const stages& with) {
    ldi::photo_layer layer = ldi::lift(photo.color, photo.disparity);
    const auto curves = ldi::find_discontinuity_curves(layer, {}, with.curves);
    ldi::close_spurious_discontinuities(layer, curves);
    const std::size_t visible = layer.size();
    const ldi::photo_layers layers = ldi::expand(std::move(layer), ldi::surface_rule{}, curves, with.growth).layers;

    const ldi::graph& g = layers.topology();
    ldi::buffer<std::size_t> pixels_at(g.position_count(), 0);
    for (std::int32_t i = 0; i < g.count(); ++i) ++pixels_at[g.position_of(i)];
    std::printf("%-26s %7zu %8zu %7zu %7zu\n", left_out, curves.size(), layers.size() - visible,
                *std::max_element(pixels_at.begin(), pixels_at.end()), ldi::make_charts(layers, {}, with.charts).charts.size());
}

int main() {
    const learn::sample photo = learn::load_crop("archway");
    std::printf("left out                    curves   hidden  layers  charts\n");
    print_row("nothing", photo, {});

    stages all_curves, no_constraints, no_merging, narrow_gaps;
    all_curves.curves.min_length = 1;
    no_constraints.curves.constraints = ldi::constrained_ends::none;
    no_merging.growth.merges_curves = false;
    narrow_gaps.charts.filter_range = 1;
    print_row("dropping short curves", photo, all_curves);
    print_row("constraints at their ends", photo, no_constraints);
    print_row("merging of surfaces", photo, no_merging);
    print_row("distance inside charts", photo, narrow_gaps);
}
