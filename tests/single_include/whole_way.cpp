// A user's program with the single header: from pixels and weights to the bytes of a GLB file, with the standard library alone.
// whole_way.py compiles it.
//
//     whole_way DEPTH_WEIGHTS INPAINTING_WEIGHTS RESULT

#include <ldi/ldi.hpp>

#include <fstream>
#include <iterator>
#include <vector>

namespace {

std::vector<char> read(const char* path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

std::span<const std::byte> bytes_of(const std::vector<char>& text) { return std::as_bytes(std::span(text)); }

/// A bright disk in front of a dark slope.
ldi::image<std::uint8_t> draw_photo() {
    ldi::image<std::uint8_t> photo(192, 256, 3);
    for (int y = 0; y < 192; ++y)
        for (int x = 0; x < 256; ++x) {
            const bool is_disk = (x - 120) * (x - 120) + (y - 90) * (y - 90) < 50 * 50;
            photo(y, x, 0) = static_cast<std::uint8_t>(is_disk ? 230 : 20 + y / 2);
            photo(y, x, 1) = static_cast<std::uint8_t>(is_disk ? 180 : 40 + y / 3);
            photo(y, x, 2) = static_cast<std::uint8_t>(is_disk ? 60 + x / 4 : 90);
        }
    return photo;
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 4) return 2;
    const ldi::tiefenrausch estimator = ldi::decode_tiefenrausch(bytes_of(read(arguments[1])));
    const ldi::farbrausch inpainter = ldi::decode_farbrausch(bytes_of(read(arguments[2])));
    const ldi::photo3d made = ldi::make_photo3d(draw_photo(), estimator, inpainter);
    const ldi::buffer<std::byte> glb = ldi::encode_glb(made.mesh, made.atlas.color, {.camera = made.facts.camera});
    std::ofstream(arguments[3], std::ios::binary)
        .write(reinterpret_cast<const char*>(glb.data()), static_cast<std::streamsize>(glb.size()));
    return made.mesh.triangle_count() > 100 ? 0 : 1;
}
