// Runs a depth network of the library for the Python programs beside it: photos come in on the standard input, disparity goes
// out.
//
//   estimate FOLDER_OF_THE_PUBLISHED_NETWORK
//   estimate STUDENT.safetensors
//
// In, as often as one likes: height, width, whether to bring the photo to the network's sizes (int32; if not, both sides are
// multiples of 32), height x width x 3 bytes. Out, for each: height, width (int32), the network's own result (height x width
// bytes; at the larger size, where it sees the photo at two), disparity (height x width float32).

#include <ldi/io/tiefenrausch_file.hpp>

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
        if (!read(photo.data(), photo.size())) throw std::runtime_error("a photo that is cut off");
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
