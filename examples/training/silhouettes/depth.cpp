// Runs the library's depth stages up to the alignment of silhouettes, for the Python programs beside it.
//
//   depth STUDENT.safetensors
//
// Reads from the standard input until it ends, per photo: height and width of the photo, rows and columns of a disparity map
// (int32; 0 and 0: the network estimates a map); the photo's bytes (height x width x 3); the map (rows x columns float32, in
// [0, 1], 1 is nearest). Writes to the standard output, per photo: rows and columns (int32) and values (float32) of the map,
// then three maps of height x width float32: the map sharpened and resampled; the same after the weighted median; and after
// alignment with the photo's edges and removal of middle components (make_photo3d() lifts this last map).

#include <ldi/io/weight_files.hpp>
#include <ldi/photo3d.hpp>

#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <utility>

namespace {

template <class T>
bool read(T* values, std::size_t count) {
    return std::fread(values, sizeof(T), count, stdin) == count;
}

template <class T>
void write(const T* values, std::size_t count) {
    if (std::fwrite(values, sizeof(T), count, stdout) != count) throw std::runtime_error("the result cannot be written");
}

void write(const ldi::image<float>& map) { write(map.data(), map.size()); }

ldi::image<float> estimate(const ldi::tiefenrausch& network, const ldi::image<std::uint8_t>& photo) {
    ldi::normalize_options options;
    options.relative_step = std::max(options.relative_step, static_cast<float>(network.quantization_step()) - 1.0F);
    return ldi::normalize(network.disparity(photo), options).disparity;
}

void serve(const ldi::tiefenrausch& network) {
    const ldi::photo3d_options options;
    ldi::serial_executor threads;
    for (std::int32_t size[4]; read(size, 4);) {
        ldi::image<std::uint8_t> photo(static_cast<std::size_t>(size[0]), static_cast<std::size_t>(size[1]), 3);
        ldi::image<float> map(static_cast<std::size_t>(size[2]), static_cast<std::size_t>(size[3]), 1);
        if (!read(photo.data(), photo.size()) || !read(map.data(), map.size()))
            throw std::runtime_error("the input ends within a photo");
        if (map.empty()) map = estimate(network, photo);
        const ldi::image<float> resampled = ldi::resample_estimate(map, photo, options, threads);
        ldi::image<float> cleaned = ldi::weighted_median(resampled, options.surface, options.median, threads);
        const std::int32_t sides[2] = {static_cast<std::int32_t>(map.height()), static_cast<std::int32_t>(map.width())};
        write(sides, 2), write(map), write(resampled), write(cleaned);
        const float sample = ldi::sample_size(map, photo, options);
        const ldi::aligned_silhouettes decider{options.alignment};
        cleaned = decider.decide({photo, map, std::move(cleaned), options.surface, sample}, threads).disparity;
        ldi::merge_middle_components(cleaned, options.surface, ldi::scaled(options.components, sample));
        write(cleaned);
        std::fflush(stdout);
    }
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 2) {
        std::fputs("depth STUDENT.safetensors\n", stderr);
        return 2;
    }
    try {
        serve(ldi::load_depth_network(arguments[1]));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
