// libFuzzer: any depth map becomes a valid 3D photo, or raises an error. Diffusion fills hidden pixels. Compile with
// clang++ -fsanitize=fuzzer,address,undefined.
//
// The input starts with four bytes: width, height, kind and motion. Bit 0 of kind states that values are float32 instead of
// bytes, bit 1 that they are inverse depth. The other bytes are the values, which are repeated to fill the map.
#include <ldi/core/validate.hpp>
#include <ldi/formats/glb.hpp>
#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/photo3d.hpp>

#include <cstdint>
#include <cstdlib>
#include <cstring>

namespace {

constexpr std::size_t longest_side = 24;

ldi::image<float> read_map(const std::uint8_t* data, std::size_t size, std::size_t height, std::size_t width, bool is_float) {
    ldi::image<float> map(height, width);
    for (std::size_t i = 0; i < map.size(); ++i) {
        if (is_float && size >= 4)
            std::memcpy(map.data() + i, data + i % (size / 4) * 4, 4);
        else
            map.data()[i] = data[i % size];
    }
    return map;
}

void run(const ldi::image<std::uint8_t>& photo, const ldi::given_disparity& depth, const ldi::photo3d_options& options) {
    const ldi::photo3d made = ldi::make_photo3d(photo, depth, ldi::diffusion_inpainter(), options);
    if (ldi::validate(made.layers.topology())) std::abort();
    ldi::glb_options glb;
    glb.camera = made.facts.camera, glb.motion = made.facts.motion, glb.range = made.facts.range;
    if (ldi::encode_glb(made.mesh, made.atlas.color, glb).empty()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    if (size < 5) return 0;
    const std::size_t width = 1 + data[0] % longest_side, height = 1 + data[1] % longest_side;
    const unsigned kind = data[2];
    ldi::photo3d_options options;
    options.expand.motion = 0.3F * static_cast<float>(data[3]) / 255;
    options.normalize.is_inverse_depth = (kind & 2) != 0;
    ldi::image<std::uint8_t> photo(height, width, 3);
    for (std::size_t i = 0; i < photo.size(); ++i) photo.data()[i] = data[i % size];
    try {
        const ldi::given_disparity depth{ldi::fill_invalid(read_map(data + 4, size - 4, height, width, (kind & 1) != 0))};
        run(photo, depth, options);
    } catch (const ldi::error&) {
    }
    return 0;
}
