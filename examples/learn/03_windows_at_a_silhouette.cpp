// A convolution reads the pixels around a pixel. In a layered image these are the pixels that a breadth-first search along links
// finds inside the k x k window. The search follows a surface behind another one, and never crosses a silhouette. Left: the
// window of a wall pixel beside the globe continues on hidden pixels. Right: the window of a pixel on the globe's rim ends at
// the globe's edge.
#include "drawing.hpp"
#include "sample.hpp"

#include <ldi/core/window.hpp>
#include <ldi/inpaint/diffusion_inpainter.hpp>

#include <algorithm>
#include <cstdio>
#include <utility>
#include <vector>

constexpr std::int32_t size = 5;

int main() {
    const learn::sample photo = learn::load_crop("globe");
    ldi::photo_layer front = ldi::lift(photo.color, photo.disparity);
    const auto curves = ldi::find_discontinuity_curves(front);
    ldi::close_spurious_discontinuities(front, curves);
    ldi::photo_layers layers =
        ldi::expand(std::move(front), ldi::surface_rule{}, curves, {.motion = 1.0F, .iterations = 4}).layers;
    ldi::diffusion_inpainter{}.inpaint(layers);
    const ldi::graph& g = layers.topology();
    std::vector<learn::picture> panels;
    for (const bool on_globe : {false, true}) {
        // In the middle row of the photo, the globe ends at x = 14, and the wall starts at x = 15.
        std::int32_t center = 0;
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(g.size()); ++i)
            if (g.y()[i] == g.height() / 2 && layers.column<ldi::known_column>()[i] != 0 && g.x()[i] == (on_globe ? 14 : 15))
                center = i;

        std::int32_t window[size * size];
        ldi::gather_window(g, center, size, window);

        std::printf("the window on the %s\n", on_globe ? "globe" : "wall");
        for (std::int32_t e = 0; e < size * size; ++e) {
            const char* const kind = window[e] == ldi::no_pixel                           ? "none  "
                                     : layers.column<ldi::known_column>()[window[e]] == 0 ? "hidden"
                                                                                          : "photo ";
            std::printf("%s%s", kind, e % size == size - 1 ? "\n" : " ");
        }
        learn::canvas sheet(400, 480);
        learn::draw_tiles(sheet, layers, learn::side_view(g, {245, 225}, 22, 30), [&](std::int32_t i) -> learn::rgb {
            if (i == center) return {200, 0, 0};
            const bool inside = std::find(std::begin(window), std::end(window), i) != std::end(window);
            return inside ? learn::rgb{255, 140, 0} : learn::faded(learn::color_of(layers, i));
        });
        panels.push_back(sheet.result());
    }
    learn::save("03_windows_at_a_silhouette.png", learn::side_by_side(panels));
}
