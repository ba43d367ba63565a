// Pictures of the finished sample and its files, one thread: include/ldi/render, formats and io, the program's compression, and
// depth peeling of bench/quality.

#include "bench/quality/micro_polygons.hpp"
#include "bench/quality/peel.hpp"
#include "bench/support/measure.hpp"
#include "bench/support/sample.hpp"

#if defined(LDI_WITH_COMPRESSION)
#include "examples/photo3d/compressed_glb.hpp"
#endif

#include <ldi/formats/checksums.hpp>
#include <ldi/formats/float_map.hpp>
#include <ldi/formats/glb.hpp>
#include <ldi/formats/plain_png.hpp>
#include <ldi/formats/safetensors.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/file.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/render/gap_colors.hpp>
#include <ldi/render/rasterizer.hpp>
#include <ldi/render/stereo.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace {

using namespace ldi_bench;

constexpr std::int32_t wide = 1152, high = 1536;
work picture() { return {.pixels = wide * high}; }

/// The photo's camera, and a camera to its left. Near surfaces shift to the right, and hidden surfaces come into view.
ldi::view from_photo() { return {.camera = sample().facts.camera}; }
ldi::view from_left() { return ldi::moved_view(sample().facts.camera, sample().facts.range, 1.0F, 40.0F); }
ldi::view taken_from() { return {.camera = sample().facts.layers_camera()}; }

void add_render() {
    for (const std::int32_t samples : {1, 2})
        add("render/rasterize/" + std::to_string(samples * samples) + " samples per pixel", [samples](benchmark::State& state) {
            ldi::raster_options options;
            options.samples = samples;
            measure(state, size_text(wide, high), picture(),
                    [&] { return ldi::rasterize(sample().mesh, sample().atlas.color, from_left(), options).coverage; });
        });
    add("render/render_layers", [](benchmark::State& state) {
        measure(state, size_text(wide, high), picture(), [] {
            return ldi_quality::render_layers(sample().layers, sample().facts.range, taken_from(), from_left()).coverage;
        });
    });
    add("render/peel", [](benchmark::State& state) {
        measure(state, size_text(wide, high), picture(),
                [] { return ldi_quality::peel(sample().layers, sample().facts.range, taken_from(), from_left()).layers.size(); });
    });
    add("render/gap_colors", [](benchmark::State& state) {
        const ldi::view far = ldi::moved_view(sample().facts.camera, sample().facts.range, 1.0F, 160.0F);
        const ldi::rendering seen = ldi::rasterize(sample().mesh, sample().atlas.color, far);
        measure_change(state, size_text(wide, high), picture(), seen,
                       [](ldi::rendering& r) { return ldi::gap_colors(std::move(r)); });
    });
    add("render/has_gaps", [](benchmark::State& state) {
        const ldi::rendering seen = ldi::rasterize(sample().mesh, sample().atlas.color, from_photo());
        measure(state, size_text(wide, high), {.bytes = wide * high}, [&] { return ldi::has_gaps(seen); });
    });
    add("render/side_by_side", [](benchmark::State& state) {
        measure(state, size_text(wide, high), {.bytes = 9.0 * wide * high},
                [] { return ldi::side_by_side(sample().photo, sample().photo); });
    });
    add("render/anaglyph", [](benchmark::State& state) {
        measure(state, size_text(wide, high), {.bytes = 6.0 * wide * high},
                [] { return ldi::anaglyph(sample().photo, sample().photo); });
    });
    add("render/disparity_map", [](benchmark::State& state) {
        const ldi::rendering seen = ldi::rasterize(sample().mesh, sample().atlas.color, from_photo());
        measure(state, size_text(wide, high), {.bytes = 6.0 * wide * high},
                [&] { return ldi::disparity_map(seen.depth, sample().facts.range); });
    });
}

const std::vector<std::byte>& jpeg() {
    static const std::vector<std::byte> made = ldi::encode_jpeg(sample().atlas.color);
    return made;
}

void add_files() {
    const auto atlas_pixels = [] { return static_cast<double>(sample().atlas.kind.size()); };
    const auto atlas_text = [] { return size_text(sample().atlas.kind.width(), sample().atlas.kind.height()); };
    add("io/encode_jpeg", [=](benchmark::State& state) {
        measure(state, atlas_text(), {.pixels = atlas_pixels()}, [] { return ldi::encode_jpeg(sample().atlas.color); });
    });
    add("io/encode_png", [=](benchmark::State& state) {
        measure(state, atlas_text(), {.pixels = atlas_pixels()}, [] { return ldi::encode_png(sample().atlas.color); });
    });
    add("io/decode_photo", [](benchmark::State& state) {
        const std::vector<std::byte> file = ldi::read_file(sample_file("sample.jpg"));
        measure(state, size_text(wide, high), picture(), [&] { return ldi::decode_photo(file).color; });
    });
    add("io/decode_depth_map", [](benchmark::State& state) {
        const std::vector<std::byte> file = ldi::read_file(sample_file("sample_depth.png"));
        measure(state, size_text(wide, high), picture(), [&] { return ldi::decode_depth_map(file); });
    });
    add("io/fill_invalid", [](benchmark::State& state) {
        measure_change(state, size_text(wide, high), picture(), sample().depth_map,
                       [](ldi::image<float>& map) { return ldi::fill_invalid(std::move(map)); });
    });
    add("formats/encode_plain_png", [=](benchmark::State& state) {
        measure(state, atlas_text(), {.pixels = atlas_pixels()}, [] { return ldi::encode_plain_png(sample().atlas.color); });
    });
    add("formats/encode_glb", [](benchmark::State& state) {
        measure(state,
                std::to_string(sample().mesh.triangle_count()) + " triangles, " + std::to_string(jpeg().size() / 1000) + " kB",
                {.bytes = 2.0 * static_cast<double>(jpeg().size())},
                [] { return ldi::encode_glb(sample().mesh, std::span<const std::byte>(jpeg())); });
    });
    add("formats/decode_safetensors", [](benchmark::State& state) {
        const std::vector<std::byte> file = ldi::read_file(model_file("farbrausch.safetensors"));
        measure(state, std::to_string(file.size() / 1000) + " kB", {.bytes = 2.0 * static_cast<double>(file.size())},
                [&] { return ldi::decode_safetensors(file).tensors.size(); });
    });
    add("formats/crc32", [](benchmark::State& state) {
        measure(state, std::to_string(jpeg().size() / 1000) + " kB", {.bytes = static_cast<double>(jpeg().size())},
                [] { return ldi::crc32(jpeg()); });
    });
    add("formats/adler32", [](benchmark::State& state) {
        measure(state, std::to_string(jpeg().size() / 1000) + " kB", {.bytes = static_cast<double>(jpeg().size())},
                [] { return ldi::adler32(jpeg()); });
    });
#if defined(LDI_WITH_COMPRESSION)
    add("photo3d/compress_glb/geometry alone", [](benchmark::State& state) {
        const auto glb = ldi::encode_glb(sample().mesh, std::span<const std::byte>(jpeg()));
        measure(state, std::to_string(sample().mesh.triangle_count()) + " triangles", {},
                [&] { return ldi::examples::compress_glb(glb).size(); });
    });
#endif
}

const bool registered = [] {
    add_render();
    add_files();
    return true;
}();

}  // namespace
