// Stages from clean disparity to a layered image with colored hidden surfaces, measured one by one on the sample, one thread:
// include/ldi/occlusion and inpaint.

#include "bench/support/measure.hpp"
#include "bench/support/sample.hpp"

#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/inpaint/grain.hpp>
#include <ldi/inpaint/mixed_colors.hpp>
#include <ldi/inpaint/texture_transfer.hpp>
#include <ldi/inpaint/uncertain_rims.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/expand.hpp>
#include <ldi/occlusion/lift.hpp>
#include <ldi/occlusion/past_frame.hpp>
#include <ldi/occlusion/spurious_discontinuities.hpp>

#include <utility>

namespace {

using namespace ldi_bench;

template <class Layers>
work pixels_of(const Layers& layers) {
    return {.pixels = static_cast<double>(layers.size())};
}

void add_occlusion() {
    add("occlusion/lift", [](benchmark::State& state) {
        const sample_stages& s = sample();
        measure(state, size_text(s.photo.width(), s.photo.height()), pixels_of(s.lifted),
                [&] { return ldi::lift(s.photo, s.filtered).size(); });
    });
    add("occlusion/find_discontinuity_curves", [](benchmark::State& state) {
        const ldi::photo_layer& layer = sample().lifted;
        measure(state, pixels_text(layer.size()), pixels_of(layer), [&] { return ldi::find_discontinuity_curves(layer).size(); });
    });
    add("occlusion/close_spurious_discontinuities", [](benchmark::State& state) {
        const ldi::photo_layer& layer = sample().lifted;
        const auto curves = ldi::find_discontinuity_curves(layer);
        measure_change(state, pixels_text(layer.size()), pixels_of(layer), layer,
                       [&](ldi::photo_layer& l) { return ldi::close_spurious_discontinuities(l, curves); });
    });
    add("occlusion/expand", [](benchmark::State& state) {
        const auto& lifted = sample().prepared;
        measure_change(state, pixels_text(lifted.layer.size()), pixels_of(lifted.layer), lifted.layer,
                       [&](auto& layer) { return ldi::expand(std::move(layer), {}, lifted.curves).layers.size(); });
    });
    add("occlusion/grow_past_frame", [](benchmark::State& state) {
        const ldi::working_layers<>& layers = sample().colored;
        ldi::photo_facts facts = sample().facts;
        facts.margin = 0;  // the value before grow_past_frame()
        measure_change(state, pixels_text(layers.size()), pixels_of(layers), layers,
                       [&](ldi::working_layers<>& l) { return ldi::grow_past_frame(l, facts); });
    });
}

void add_inpainting() {
    add("inpaint/unmix_colors", [](benchmark::State& state) {
        ldi::photo_layer layer = sample().lifted;
        const auto curves = ldi::find_discontinuity_curves(layer);
        ldi::close_spurious_discontinuities(layer, curves);
        measure_change(state, pixels_text(layer.size()), pixels_of(layer), layer,
                       [](ldi::photo_layer& l) { ldi::unmix_colors(l); });
    });
    add("inpaint/mark_uncertain_rims", [](benchmark::State& state) {
        const auto& layer = sample().prepared.layer;
        measure_change(state, pixels_text(layer.size()), pixels_of(layer), layer,
                       [](auto& l) { return ldi::mark_uncertain_rims(l, 6).size(); });
    });
    add("inpaint/restore_rims", [](benchmark::State& state) {
        auto layer = sample().prepared.layer;
        const auto rims = ldi::mark_uncertain_rims(layer, 6);
        const auto layers = ldi::expand(std::move(layer), {}, sample().prepared.curves).layers;
        measure_change(state, pixels_text(layers.size()), pixels_of(layers), layers,
                       [&](auto& l) { ldi::restore_rims(l, rims); });
    });
    const auto add_colored = [](const std::string& name, const ldi::working_layers<> sample_stages::*from, auto stage) {
        add(name, [=](benchmark::State& state) {
            const ldi::working_layers<>& layers = sample().*from;
            measure_change(state, pixels_text(layers.size()), pixels_of(layers), layers, stage);
        });
    };
    add_colored("inpaint/diffusion_inpainter/inpaint", &sample_stages::uncolored,
                [](ldi::working_layers<>& l) { ldi::diffusion_inpainter().inpaint(l); });
    add_colored("inpaint/add_texture", &sample_stages::colored, [](ldi::working_layers<>& l) { ldi::add_texture(l); });
    add_colored("inpaint/add_grain", &sample_stages::colored, [](ldi::working_layers<>& l) { ldi::add_grain(l); });
}

const bool registered = [] {
    add_occlusion();
    add_inpainting();
    return true;
}();

}  // namespace
