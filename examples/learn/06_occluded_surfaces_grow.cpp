// Behind each silhouette the farther surface grows by one pixel per iteration, here for 40 iterations. The frames show the
// hidden pixels over the darkened photo after 1, 8, 20 and 40 iterations. Newer pixels are brighter.
#include "drawing.hpp"
#include "sample.hpp"

#include <cstdio>
#include <span>
#include <utility>
#include <vector>

int main() {
    const learn::sample photo = learn::load_crop("archway");
    ldi::photo_layer layer = ldi::lift(photo.color, photo.disparity);
    const auto curves = ldi::find_discontinuity_curves(layer);
    ldi::close_spurious_discontinuities(layer, curves);

    std::vector<learn::picture> frames;
    ldi::buffer<int> born;  // iteration that added each pixel
    int iteration = 0;
    const auto watch = [&](const ldi::graph_view& g, std::span<const float>, std::size_t first_hidden) {
        born.resize(g.size(), ++iteration);
        if (iteration != 1 && iteration != 8 && iteration != 20 && iteration != 40) return;
        learn::picture frame = photo.color;
        for (std::uint8_t& value : frame) value = static_cast<std::uint8_t>(value / 3);
        for (std::size_t i = first_hidden; i < g.size(); ++i) {
            const float youth = 1.0F - static_cast<float>(iteration - born[i]) / 40.0F;
            frame(g.y()[i], g.x()[i], 0) = 30;
            frame(g.y()[i], g.x()[i], 1) = learn::byte_of(0.65F * youth);
            frame(g.y()[i], g.x()[i], 2) = learn::byte_of(youth);
        }
        std::printf("iteration %2d: %zu hidden pixels behind %zu curves\n", iteration, g.size() - first_hidden, curves.size());
        frames.push_back(std::move(frame));
    };
    ldi::expand(std::move(layer), ldi::surface_rule{}, curves, {.motion = 1.0F, .iterations = 40}, {}, watch);
    learn::save("06_occluded_surfaces_grow.png", learn::side_by_side(frames));
}
