// A layered image can have several pixels at one position; a texture cannot. make_charts() therefore divides the layered image
// into charts with at most one pixel per position. make_atlas() packs the charts into one texture, with padding for texture
// filters and JPEG. Left: the charts as seen in the photo. Middle: the atlas. Right: the source of each color: the photo,
// inpainting (dark blue), padding (pink, red, green).
#include "drawing.hpp"
#include "sample.hpp"

#include <examples/photo3d/stage_pictures.hpp>
#include <ldi/adapt/xtensor.hpp>
#include <ldi/charts/charts.hpp>
#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/texture/atlas.hpp>

#include <xtensor/xmath.hpp>
#include <xtensor/xtensor.hpp>

#include <cstdio>

int main() {
    ldi::photo_layers layers = learn::layers_of(learn::load_crop("archway"), 30);
    ldi::diffusion_inpainter{}.inpaint(layers);

    const ldi::chart_set charts = ldi::make_charts(layers, {});
    const ldi::texture_atlas atlas = ldi::make_atlas(layers, charts);
    std::printf("%zu pixels in %zu charts; the atlas has %zu x %zu texels, %.0f %% of them pixels\n", layers.size(),
                charts.charts.size(), atlas.color.width(), atlas.color.height(), 100.0 * double{atlas.fill});
    // xtensor reads ldi's images without a copy.
    const xt::xtensor<double, 1> mean = xt::mean(xt::cast<double>(ldi::as_tensor(atlas.color)), {0, 1});
    std::printf("mean color %.0f, %.0f, %.0f\n", mean(0), mean(1), mean(2));

    const auto by_chart = learn::seen(layers, false, [&](std::int32_t i) {
        return ldi::examples::distinct_color(static_cast<std::size_t>(charts.chart_of[i]));
    });
    learn::save("07_charts_and_atlas.png", learn::side_by_side({by_chart, atlas.color, ldi::examples::kind_picture(atlas)}));
}
