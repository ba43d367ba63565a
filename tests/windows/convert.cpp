// Makes a GLB file from a crop of the sample photograph in examples/learn, with its depth map or with the depth network. Uses
// only the standard library. The bytes are the same for any compiler and any LDI_ISA.
//
//     convert NAME DEPTH RESULT   DEPTH: "map" or "network"; runs in the root of the repository
//     convert sets - -            prints the values of LDI_ISA that this machine supports
#include <ldi/ldi.hpp>

#include <examples/learn/sample.hpp>

#include <cstdio>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

namespace {

std::vector<char> read(const char* path) {
    std::ifstream file(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
}

std::span<const std::byte> bytes_of(const std::vector<char>& text) { return std::as_bytes(std::span(text)); }

}  // namespace

int main(int count, char** arguments) {
    if (count != 4) return 2;
    if (arguments[1] == std::string("sets")) {
        for (const ldi::instruction_set& set : ldi::instruction_sets)
            if (ldi::is_available(set.id)) std::printf("%s\n", std::string(set.name).c_str());
        return 0;
    }
    const learn::sample from = learn::load_crop(arguments[1]);
    const ldi::farbrausch inpainter = ldi::decode_farbrausch(bytes_of(read("examples/models/farbrausch.safetensors")));
    ldi::photo3d made;
    if (arguments[2] == std::string("map")) {
        made = ldi::make_photo3d(from.color, ldi::given_disparity{from.disparity}, inpainter);
    } else {
        const ldi::tiefenrausch estimator =
            ldi::decode_tiefenrausch(bytes_of(read("examples/models/tiefenrausch_small.safetensors")));
        made = ldi::make_photo3d(from.color, estimator, inpainter);
    }
    const ldi::buffer<std::byte> glb = ldi::encode_glb(made.mesh, made.atlas.color, {.camera = made.facts.camera});
    std::ofstream result(arguments[3], std::ios::binary);
    result.write(reinterpret_cast<const char*>(glb.data()), static_cast<std::streamsize>(glb.size()));
    std::printf("%zu triangles, %zu bytes\n", static_cast<std::size_t>(made.mesh.triangle_count()),
                static_cast<std::size_t>(glb.size()));
    return result.good() ? 0 : 1;
}
