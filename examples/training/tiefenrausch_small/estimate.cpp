// Runs a depth network with the library, for the Python programs in this folder. Reads photos from the standard input until it
// ends, and writes their disparity to the standard output.
//
//   estimate FOLDER_OF_THE_PUBLISHED_NETWORK
//   estimate STUDENT.safetensors
//
// Input per photo: height, width, whether to resize the photo for the network (int32; if 0, both sides are multiples of 32);
// height x width x 3 bytes. Output per photo: height, width (int32); the network's raw output (height x width bytes; if the
// library runs the network at two sizes, at the larger one); disparity (height x width float32).

#include <ldi/io/weight_files.hpp>

#include <cstdint>
#include <cstdio>
#include <exception>
#include <stdexcept>

namespace {

template <class T>
bool read(T* values, std::size_t count) {
    return std::fread(values, sizeof(T), count, stdin) == count;
}

template <class T>
void write(const T* values, std::size_t count) {
    if (std::fwrite(values, sizeof(T), count, stdout) != count) throw std::runtime_error("the result cannot be written");
}

void serve(const ldi::tiefenrausch& network) {
    ldi::serial_executor threads;
    for (std::int32_t size[3]; read(size, 3);) {
        ldi::image<std::uint8_t> photo =
            ldi::image<std::uint8_t>(static_cast<std::size_t>(size[0]), static_cast<std::size_t>(size[1]), 3);
        if (!read(photo.data(), photo.size())) throw std::runtime_error("the input ends within a photo");
        const bool as_it_is = size[2] == 0;
        const ldi::image<std::uint8_t> levels =
            network.levels(as_it_is ? photo : network.resize_for_network(photo, threads, network.sizes().details), threads);
        const ldi::image<float> disparity = as_it_is ? network.disparity_of(levels) : network.disparity(photo);
        const std::int32_t sides[2] = {static_cast<std::int32_t>(levels.height()), static_cast<std::int32_t>(levels.width())};
        write(sides, 2);
        write(levels.data(), levels.size());
        write(disparity.data(), disparity.size());
        std::fflush(stdout);
    }
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 2) {
        std::fputs("estimate FOLDER_OF_THE_PUBLISHED_NETWORK | STUDENT.safetensors\n", stderr);
        return 2;
    }
    try {
        serve(ldi::load_depth_network(arguments[1]));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
