// A layered depth image made by hand: a wall of 6 x 4 pixels, and a block of 2 x 2 pixels in front of it. Both surfaces have
// pixels at the block's positions, and no link connects the two surfaces. A 3 x 3 average therefore never mixes them. The
// lesson requires no library and no file.
#include <ldi/core/graph_builder.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/nn/ldi/convolution_layer.hpp>
#include <ldi/nn/ldi/from_column.hpp>

#include <cstdio>
#include <utility>

struct value {  // the payload: one number per pixel
    using scalar = float;
    static constexpr std::size_t channels = 1;
};

/// Adds a linked rectangle of pixels.
void add_rectangle(ldi::graph_builder& g, std::int32_t left, std::int32_t top, std::int32_t width, std::int32_t height) {
    for (std::int32_t y = top; y < top + height; ++y)
        for (std::int32_t x = left; x < left + width; ++x) {
            const std::int32_t pixel = g.add_pixel(x, y);
            if (x > left) g.link(pixel, ldi::side::left, pixel - 1);
            if (y > top) g.link(pixel, ldi::side::up, pixel - width);
        }
}

void print(const char* title, const ldi::layered_image<value>& layers, std::int32_t first, std::int32_t last) {
    std::printf("%s\n", title);
    const ldi::graph& g = layers.topology();
    for (std::int32_t i = first; i < last; ++i) {
        const bool ends_row = i + 1 == last || g.right()[i] == ldi::no_pixel;
        std::printf("%4.1f%s", layers.column<value>()[i], ends_row ? "\n" : " ");
    }
}

int main() {
    ldi::graph_builder builder(6, 4);
    add_rectangle(builder, 0, 0, 6, 4);
    const std::int32_t wall = builder.count();
    add_rectangle(builder, 2, 1, 2, 2);
    ldi::layered_image<value> layers(std::move(builder).build());
    for (std::int32_t i = 0; i < layers.topology().count(); ++i)
        layers.column<value>()[i] = i < wall ? static_cast<float>(layers.topology().x()[i]) : 9.0F;

    const ldi::buffer<float> ninth(9, 1.0F / 9), bias(1);
    // A partial convolution multiplies its sum by 9 / (number of pixels in the window), so windows at a border also return an
    // average.
    const ldi::convolution_layer average(ninth, bias, {.kernel_size = 3, .is_partial = true});
    const ldi::convolution_plan plan = ldi::plan_convolution(layers.topology(), 3);
    ldi::to_column<value>(average(plan, ldi::from_column<value>(layers)), layers);

    print("the wall, averaged over 3 x 3 pixels of its own:", layers, 0, wall);
    print("the block in front of it, likewise:", layers, wall, layers.topology().count());
}
