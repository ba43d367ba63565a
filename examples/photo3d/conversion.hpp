// From one photo to the bytes of its files: the same for a run over one photo and over many, and so the same bytes.
#pragma once

#include "arguments.hpp"
#include "html_page.hpp"
#include "outputs.hpp"
#include "report.hpp"

#include <ldi/formats/depth_map.hpp>
#include <ldi/formats/farbrausch_file.hpp>
#include <ldi/formats/glb.hpp>
#include <ldi/formats/photo.hpp>
#include <ldi/formats/picture.hpp>
#include <ldi/formats/tiefenrausch_file.hpp>
#include <ldi/occlusion/diffusion_inpainter.hpp>
#include <ldi/photo3d.hpp>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <vector>

namespace ldi::examples {

/// What is read once for any number of photos.
struct networks {
    std::optional<tiefenrausch> depth;     ///< none where depth is given
    std::optional<farbrausch> inpainting;  ///< none: diffusion
};

/// Raises what reading weights raises.
inline networks load_networks(const arguments& a, stage_clock& clock) {
    networks loaded;
    if (!a.inpainting_model.empty()) {
        clock.begin("reading inpainting network");
        loaded.inpainting = load_farbrausch(a.inpainting_model, a.inpainting_arithmetic());
    }
    if (!a.depth_model.empty()) {
        clock.begin("reading depth network");
        loaded.depth = load_depth_network(a.depth_model);
    }
    return loaded;
}

/// Raises what decode_depth_map() and check_fits() raise.
inline given_disparity decode_depth(const arguments& a, std::span<const std::byte> bytes, const photo& photo,
                                    const std::string& name) {
    depth_map_options options = a.depth_map;
    options.white_is_near = !a.near_is_black;
    given_disparity depth{fill_invalid(decode_depth_map(bytes, options, name), name)};
    check_fits(depth.map, photo.color, name);
    return depth;
}

/// depth  null: by the network
template <executor Executor>
photo3d convert(const arguments& a, const photo& photo, const given_disparity* depth, const networks& by, stage_clock& clock,
                Executor& threads) {
    photo3d_options options = options_for(a, photo, depth != nullptr);
    options.progress = clock.listener();
    const auto with = [&](const auto& inpainter) {
        return depth != nullptr ? make_photo3d(photo.color, *depth, inpainter, options, threads)
                                : make_photo3d(photo.color, *by.depth, inpainter, options, threads);
    };
    return by.inpainting ? with(*by.inpainting) : with(diffusion_inpainter());
}

/// The bytes of a 3D photo.
struct encoded_photo3d {
    std::vector<std::byte> jpeg;  ///< the texture, as it lies in the GLB
    buffer<std::byte> glb;
};

inline encoded_photo3d encode(const photo3d& made, int quality, stage_clock& clock) {
    clock.begin("encoding");
    encoded_photo3d result;
    result.jpeg = encode_jpeg(made.atlas.color, quality);
    glb_options options;
    options.camera = made.layers.camera;
    options.motion = made.layers.motion;
    options.range = made.layers.range;
    result.glb = encode_glb(made.mesh, result.jpeg, options);
    clock.finish();
    return result;
}

/// The names of what one photo is made from, and becomes. Empty: not asked for.
struct photo_files {
    std::filesystem::path photo, depth, glb, html, report;
    bool are_own = false;  ///< nobody asked for these outputs: they replace only what this program has written
};

/// Names the outputs that follow from the photo's name, where none is asked for.
inline void name_outputs(photo_files& names, const std::filesystem::path& viewer) {
    names.glb = std::filesystem::path(names.photo).replace_extension(".glb");
    std::error_code ignored;
    if (std::filesystem::exists(viewer, ignored)) names.html = std::filesystem::path(names.photo).replace_extension(".html");
    names.are_own = true;
}

/// Says what stands against the names before any work. Raises invalid_option, file_access.
inline void check_names(const photo_files& names, const arguments& a, output_files& files) {
    for (const std::filesystem::path& input : {names.photo, names.depth, a.depth_model, a.inpainting_model, a.viewer})
        files.read_from(input);
    if (names.are_own) {
        check_own(names.glb, R"("generator":"ldi )", "-o");
        if (!names.html.empty()) check_own(names.html, R"(<script id="photo" type="model/gltf-binary)", "--html");
    }
    if (!names.glb.empty()) {
        files.claim(names.glb);
        check_glb_name(names.glb);
    }
    if (!names.html.empty()) files.claim(names.html);
    if (!names.report.empty()) files.claim(names.report, true);
}

/// The figures of a photo that was converted.
inline nlohmann::ordered_json report_on(const photo3d& made, const encoded_photo3d& encoded, const photo_files& names,
                                        const arguments& a, const stage_clock& clock) {
    const std::string depth = name_of_input(names.depth.empty() ? a.depth_model : names.depth),
                      inpainting = a.inpainting_model.empty() ? "diffusion" : a.inpainting_model.string();
    return make_report(made, clock, depth, inpainting, a.grain, encoded.glb.size(), encoded.jpeg.size());
}

/// The page that shows a photo.
inline std::string make_page(const viewer_page& viewer, const photo_files& names, const photo3d& made,
                             const encoded_photo3d& encoded) {
    const std::string title = is_standard(names.photo) ? "3D photo" : names.photo.stem().string();
    return viewer.with_photo(title, made.photo, encoded.glb);
}

}  // namespace ldi::examples
