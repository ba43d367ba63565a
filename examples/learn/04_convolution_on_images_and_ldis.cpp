// The same convolution on an image and on a layered image. Both are graphs: an image is the one whose links form a grid. A 9 x 9
// average runs on both; on the image things bleed into what lies behind them, on the layered image each surface is averaged by
// itself. What differs is computed by xtensor, which sees ldi's images without a copy.
#include "drawing.hpp"
#include "sample.hpp"

#include <ldi/adapt/xtensor.hpp>
#include <ldi/nn/ldi/convolution_layer.hpp>
#include <ldi/nn/ldi/from_column.hpp>

#include <xtensor/xmath.hpp>

#include <cstdio>

ldi::feature_map averaged(const ldi::photo_layers& layers) {
    constexpr std::size_t elements = 9 * 9;
    ldi::buffer<float> weights(3 * 3 * elements), bias(3);  // outputs x inputs x 9 x 9
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t e = 0; e < elements; ++e) weights[(c * 3 + c) * elements + e] = 1.0F / elements;
    const ldi::convolution_layer average(weights, bias, {.kernel_size = 9, .is_partial = true});

    return average(ldi::plan_convolution(layers.topology(), 9), ldi::from_column<ldi::color_column>(layers));
}

learn::picture picture_of(const ldi::photo_layers& layers, const ldi::feature_map& colors) {
    return learn::seen(layers, false, [&](std::int32_t i) {
        const auto c = colors.at(i);
        return learn::rgb{learn::byte_of(c[0] / 255), learn::byte_of(c[1] / 255), learn::byte_of(c[2] / 255)};
    });
}

int main() {
    const learn::sample photo = learn::load_sample(learn::archway, 2);
    const ldi::photo_layers layered = learn::layers_of(photo, 0);  // the photo's own pixels, linked inside surfaces only
    ldi::photo_layers grid(ldi::make_grid(layered.topology().width(), layered.topology().height()));
    grid.set_column<ldi::color_column>(layered.column<ldi::color_column>().copy());

    const learn::picture on_image = picture_of(grid, averaged(grid)), on_layers = picture_of(layered, averaged(layered));

    const auto difference = xt::abs(xt::cast<float>(ldi::as_tensor(on_image)) - xt::cast<float>(ldi::as_tensor(on_layers)));
    std::printf("the two differ by %.2f of 255 on average, by %.0f at worst\n", xt::mean(difference)(), xt::amax(difference)());
    const auto amplified = ldi::make_image<std::uint8_t>(xt::minimum(2.0F * difference, 255.0F));
    ldi::save_jpeg("04_convolution_on_images_and_ldis.jpg", learn::side_by_side({on_image, on_layers, amplified}));
}
