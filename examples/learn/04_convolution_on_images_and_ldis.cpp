// The same convolution on an image and on a layered image. Both are graphs: an image is the graph whose links form a grid.
// A 9 x 9 average runs on both. On the image, the colors of objects bleed into the background. On the layered image, each
// surface is averaged separately.
#include "drawing.hpp"
#include "sample.hpp"

#include <ldi/nn/ldi/convolution_layer.hpp>
#include <ldi/nn/ldi/from_column.hpp>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

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
    const learn::sample photo = learn::load_crop("archway");
    const ldi::photo_layers layered = learn::layers_of(photo, 0);  // the photo's own pixels, linked only inside surfaces
    ldi::photo_layers grid(ldi::make_grid(layered.topology().width(), layered.topology().height()));
    grid.set_column<ldi::color_column>(layered.column<ldi::color_column>().copy());

    const learn::picture on_image = picture_of(grid, averaged(grid)), on_layers = picture_of(layered, averaged(layered));

    learn::picture amplified = on_image;
    int sum = 0, largest = 0;
    for (std::size_t i = 0; i < on_image.size(); ++i) {
        const int difference = std::abs(on_image.data()[i] - on_layers.data()[i]);
        sum += difference, largest = (std::max)(largest, difference);
        amplified.data()[i] = static_cast<std::uint8_t>((std::min)(2 * difference, 255));
    }
    std::printf("the two differ by %.2f of 255 on average, by %d at worst\n",
                static_cast<double>(sum) / static_cast<double>(on_image.size()), largest);
    learn::save("04_convolution_on_images_and_ldis.png", learn::side_by_side({on_image, on_layers, amplified}));
}
