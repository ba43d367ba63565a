// Inpaints with the library, for evaluate.py. Reads pictures with holes from the standard input until it ends, and writes each
// filled picture to the standard output.
//
//   inpaint WEIGHTS.safetensors
//
// Input per picture: height, width (int32); height x width x 3 bytes, red first; height x width bytes with the labels of
// masks.py: 0 known, 1 hole, 2 does not exist. Output per picture: height x width x 3 bytes; pixels that do not exist are black.

#include <ldi/inpaint/texture_transfer.hpp>
#include <ldi/io/weight_files.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <vector>

namespace {

constexpr std::uint8_t label_known = 0, label_absent = 2;

bool read(void* values, std::size_t size) { return std::fread(values, 1, size, stdin) == size; }

/// Returns a layered image of one layer, without the pixels that do not exist.
ldi::photo_layers existing(ldi::array_view<const std::uint8_t> color, const ldi::buffer<std::uint8_t>& labels, std::int32_t width,
                           std::int32_t height) {
    ldi::photo_layers layers(ldi::make_grid(width, height));
    std::copy(color.begin(), color.end(), layers.column<ldi::color_column>().begin());
    ldi::buffer<std::uint8_t> exists(labels.size());
    for (std::size_t i = 0; i < labels.size(); ++i) {
        layers.column<ldi::known_column>()[i] = labels[i] == label_known ? 1 : 0;
        exists[i] = labels[i] != label_absent ? 1 : 0;
    }
    layers.keep(exists);
    return layers;
}

void serve(const ldi::farbrausch& network) {
    ldi::serial_executor threads;
    for (std::int32_t size[2]; read(size, sizeof size);) {
        const std::size_t pixels = static_cast<std::size_t>(size[0]) * static_cast<std::size_t>(size[1]);
        ldi::buffer<std::uint8_t> color(3 * pixels), labels(pixels), filled(3 * pixels);
        if (!read(color.data(), color.size()) || !read(labels.data(), labels.size()))
            throw std::runtime_error("the input ends within a picture");
        ldi::photo_layers layers = existing(color, labels, size[1], size[0]);
        network.inpaint(layers, {}, threads);
        ldi::add_texture(layers);
        for (std::size_t i = 0; i < layers.size(); ++i) {
            const std::size_t at = static_cast<std::size_t>(layers.topology().y()[i]) * static_cast<std::size_t>(size[1]) +
                                   static_cast<std::size_t>(layers.topology().x()[i]);
            for (std::size_t c = 0; c < 3; ++c) filled[3 * at + c] = layers.column<ldi::color_column>()[3 * i + c];
        }
        if (std::fwrite(filled.data(), 1, filled.size(), stdout) != filled.size())
            throw std::runtime_error("the result cannot be written");
        std::fflush(stdout);
    }
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 2) {
        std::fputs("inpaint WEIGHTS.safetensors\n", stderr);
        return 2;
    }
    try {
        serve(ldi::load_farbrausch(arguments[1]));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
