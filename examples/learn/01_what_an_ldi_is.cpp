// A layered depth image consists of pixels and links. Neighbors on one surface are linked; neighbors on opposite sides of a
// silhouette are not. There can be more pixels behind the front surface: here the wall continues behind a globe (pixels with a
// blue rim). The photo does not show these pixels. They grew from the wall's edge.
#include "drawing.hpp"
#include "sample.hpp"

#include <ldi/inpaint/diffusion_inpainter.hpp>

#include <cstdio>
#include <utility>
#include <vector>

int main() {
    const learn::sample photo = learn::load_crop("globe");

    // A single layer: every pixel is linked to the neighbors at nearly the same distance.
    ldi::photo_layer front = ldi::lift(photo.color, photo.disparity);
    const auto curves = ldi::find_discontinuity_curves(front);
    ldi::close_spurious_discontinuities(front, curves);
    const std::size_t pixels_of_photo = front.size();
    std::vector<std::pair<learn::spot, learn::spot>> cuts;  // neighbors in the photo without a link
    for (const ldi::discontinuity& d : curves[0].sides)
        if (d.toward_front == ldi::side::left) cuts.emplace_back(learn::spot_of(front, d.front), learn::spot_of(front, d.back));

    // At each silhouette, the farther surface grows behind the nearer one. The inpainter then colors the new pixels.
    ldi::photo_layers layers =
        ldi::expand(std::move(front), ldi::surface_rule{}, curves, {.motion = 1.0F, .iterations = 4}).layers;
    ldi::diffusion_inpainter{}.inpaint(layers);

    std::size_t links = 0;
    for (const ldi::side s : ldi::all_sides)
        for (const std::int32_t neighbor : layers.topology().neighbors(s)) links += neighbor != ldi::no_pixel ? 1 : 0;
    std::printf("%zu pixels of the photo, %zu hidden ones, %zu links\n", pixels_of_photo, layers.size() - pixels_of_photo,
                links / 2);

    learn::canvas sheet(1000, 580);
    learn::draw_pixels(sheet, photo.color, {20, 142}, 17);
    learn::side_view from(layers.topology(), {765, 272}, 27, 42);
    learn::draw_tiles(sheet, layers, from, [&](std::int32_t i) { return learn::color_of(layers, i); });
    for (const auto& [near_side, far_side] : cuts) sheet.line(from(near_side), from(far_side), 1.5F, learn::cut);
    learn::save("01_what_an_ldi_is.png", sheet.result());
}
