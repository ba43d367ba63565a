// A U-Net on layered images. Its weights are set by hand instead of learned, so that its effect is easy to see: the encoder
// averages known colors, and the decoder fills unknown pixels from the coarser level. Because the network follows links, hidden
// surfaces get the colors of the surfaces that they continue, not the colors of the surfaces in front.
#include "drawing.hpp"
#include "sample.hpp"

#include <ldi/nn/ldi/convolution_layer.hpp>
#include <ldi/nn/ldi/elementwise.hpp>
#include <ldi/nn/ldi/from_column.hpp>

#include <cstdio>

struct unet {
    ldi::convolution_layer encode, decode;  // shared by all levels

    /// fine    feature map of g
    /// levels  number of coarser levels to use; 0 returns `fine`
    ldi::feature_map operator()(const ldi::graph& g, const ldi::feature_map& fine, int levels) const {
        if (levels == 0) return fine;
        const ldi::coarsened half = ldi::coarsen(g);
        const ldi::convolution_plan down = ldi::plan_convolution(g, 3, half.map), here = ldi::plan_convolution(g, 3);
        const ldi::feature_map coarse = (*this)(half.topology, encode(down, fine), levels - 1);
        return decode(here, {ldi::upsample(coarse, half.map), fine});
    }
};

unet averaging_unet() {
    // Weights are outputs x inputs x k. The inputs of `up` are c channels of the coarser level, then c of this level.
    constexpr std::size_t k = 9, c = 4;
    ldi::buffer<float> down(c * c * k), up(c * 2 * c * k), bias(c);
    for (std::size_t i = 0; i < c; ++i) {
        for (std::size_t e = 0; e < k; ++e) {
            down[(i * c + i) * k + e] = 1.0F / k;
            up[(i * 2 * c + i) * k + e] = 1e-3F / k;  // a small weight for the coarser level: matters only at unknown pixels
        }
        up[(i * 2 * c + c + i) * k + k / 2] = 1.0F;  // the full weight for this level
    }
    return {ldi::convolution_layer(down, bias, {.after = ldi::relu}), ldi::convolution_layer(up, bias, {.after = ldi::relu})};
}

int main() {
    const ldi::photo_layers layers = learn::layers_of(learn::load_crop("archway"), 30);
    const ldi::feature_map colors = ldi::from_column<ldi::color_column>(layers, 1.0F / 255.0F);
    ldi::feature_view known_colors = colors;
    known_colors.mask = layers.column<ldi::known_column>();
    // Red, green, blue, known; all 0 for unknown pixels.
    const ldi::feature_map input = ldi::concatenate({known_colors, ldi::from_column<ldi::known_column>(layers)});
    const ldi::feature_map output = averaging_unet()(layers.topology(), input, 5);

    const auto farthest = [&](const ldi::feature_map& map) {  // draws the farthest pixel at each position
        return learn::seen(layers, true, [&](std::int32_t i) {
            const auto c = map.at(i);
            return learn::rgb{learn::byte_of(c[0] / c[3]), learn::byte_of(c[1] / c[3]), learn::byte_of(c[2] / c[3])};
        });
    };
    const auto nearest = learn::seen(layers, false, [&](std::int32_t i) { return learn::color_of(layers, i); });
    std::printf("%zu values for each of %zu pixels\n", output.channels, output.pixels());
    learn::save("05_a_unet.png", learn::side_by_side({nearest, farthest(input), farthest(output)}));
}
