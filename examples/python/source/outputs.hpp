// The outputs of a 3D photo: the GLB file, the page, and pictures from other viewpoints.
#pragma once

#include "arrays.hpp"
#include "values.hpp"

#include <examples/photo3d/compression.hpp>
#include <examples/photo3d/html_page.hpp>

#include <ldi/base/executor.hpp>
#include <ldi/formats/glb.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/render/camera_paths.hpp>
#include <ldi/render/rasterizer.hpp>

#include <pybind11/pybind11.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace ldi::python {

inline std::vector<std::byte> encode(const photo3d_value& made, int quality, bool compress) {
    const examples::compression_choice choice{.is_wanted = compress};
    examples::check_compression(choice);
    const image<std::uint8_t>& texture = made.atlas->color;
    examples::texture_files files;
    files.jpeg.push_back(encode_jpeg(texture, quality));
    examples::add_webp(files, texture, quality, choice);
    const photo_facts& facts = facts_of(*made.layers);
    glb_options options;
    options.camera = facts.camera, options.motion = facts.motion, options.range = facts.range;
    options.is_past_frame = facts.margin > 0;
    return examples::compressed(encode_glb(*made.mesh, files.jpeg.front(), options), files, facts.camera.focal_length, choice)
        .file;
}

inline py::bytes glb_of(const photo3d_value& made, int quality, bool compress) {
    std::vector<std::byte> file;
    {
        const py::gil_scoped_release unlocked;
        file = encode(made, quality, compress);
    }
    return {reinterpret_cast<const char*>(file.data()), file.size()};
}

/// Returns the page that displays a 3D photo.
///
/// viewer  file of the page without a photo, as examples/viewer/build.sh builds it
inline py::str page_of(const photo3d_value& made, const std::filesystem::path& viewer, const std::string& title, int quality,
                       bool compress) {
    std::string page;
    {
        const py::gil_scoped_release unlocked;
        const examples::viewer_page empty(viewer);
        page = empty.with_photo(title, made.layers->silhouettes->depth->photo, encode(made, quality, compress),
                                made.layers->margin > 0);
    }
    return py::str(page);
}

inline py::array_t<std::uint8_t> render(const photo3d_value& made, std::array<float, 3> position,
                                        std::optional<std::array<float, 3>> target, std::optional<std::int32_t> width,
                                        std::int32_t samples, std::size_t thread_count) {
    rendering seen;
    {
        const py::gil_scoped_release unlocked;
        const photo_facts& facts = facts_of(*made.layers);
        view from;
        from.camera = facts.camera;
        if (width) {
            const float scale = static_cast<float>(*width) / static_cast<float>(from.camera.width);
            from.camera.height =
                std::max(1, static_cast<std::int32_t>(std::lround(scale * static_cast<float>(from.camera.height))));
            from.camera.width = *width, from.camera.focal_length *= scale;
        }
        if (target) from = look_at(from.camera, position, *target);
        from.position = position;
        raster_options options;
        options.samples = samples;
        options.z_near = 0.01F * facts.range.z_near;
        thread_pool threads(thread_count);
        seen = rasterize(*made.mesh, made.atlas->color, from, options, threads);
    }
    return array_of(std::move(seen.color));
}

}  // namespace ldi::python
