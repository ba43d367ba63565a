// Arguments of photo3d, which options.hpp reads from the command line, and the settings derived from these arguments.
#pragma once

#include "compression.hpp"
#include "data_files.hpp"
#include "photo_texture.hpp"
#include "video.hpp"

#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo_depth.hpp>
#include <ldi/networks/farbrausch.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/photo3d/paper_options.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace ldi::examples {

struct arguments {
    std::vector<std::filesystem::path> photos;  // one photo; with --batch, any number of photos, folders and lists
    std::filesystem::path output, html, viewer, depth, depth_model, inpainting_model, silhouette_model, stages, report, data,
        stereo_image, usdz, gallery;
    bool batch = false, skip_existing = false, embed = false;
    std::uint64_t memory = 0;  // bytes; 0: half of available_memory()
    depth_map_options depth_map;
    bool near_is_black = false, is_inverse = false, quiet = false, hard_edges = false, is_paper = false;
    bool uses_depth_of_photo = false;  // uses depth inside or beside the photo; set by find_weights()
    std::size_t long_side = photo3d_options().long_side, geometry_side = photo3d_options().long_side, threads = 0;
    float field_of_view = 0.0F, texture = photo3d_options().texture.strength, grain = photo3d_options().grain.strength,
          motion = photo3d_options().expand.motion;
    int quality = 85;
    std::string inpaint;     // empty: network if its weights are found
    std::string arithmetic;  // empty: int8 if the weights allow it
    photo_frame frame = photo3d_options().frame;
    std::string formats;  // picture formats that may be read; empty: all
    video_options video;
    compression_choice compression;

    /// Options for reading photos and the depth inside them. The networks see photos of at least the default size.
    photo_options reading() const {
        return {{},
                formats.empty() ? picture_formats() : *picture_formats::parse(formats),
                std::max(long_side, photo3d_options().long_side)};
    }

    std::optional<ldi::arithmetic> inpainting_arithmetic() const {
        if (arithmetic.empty()) return {};
        return arithmetic == to_string(ldi::arithmetic::int8) ? ldi::arithmetic::int8 : ldi::arithmetic::float32;
    }
};

inline constexpr const char *depth_weights = "tiefenrausch_small.safetensors", *inpainting_weights = "farbrausch.safetensors",
                            *silhouette_weights = "silhouettes.safetensors";

/// Checks before the conversion that the weight files named by options exist. Raises file_access.
inline void check_weights(const arguments& a) {
    std::error_code ignored;
    const bool is_published = std::filesystem::is_directory(a.depth_model, ignored);
    for (const char* const file : {"tiefenrausch.pb", "tiefenrausch_init.pb"})
        check_input(is_published ? a.depth_model / file : a.depth_model, "weights of the depth network");
    check_input(a.inpainting_model, "weights of the inpainting network");
    check_input(a.silhouette_model, "weights of the silhouette network");
}

/// Finds the weights that no option names. Raises file_access if named weights do not exist, and invalid_option if weights that
/// the run needs are not found.
inline void find_weights(arguments& a, const std::filesystem::path& data) {
    a.uses_depth_of_photo = a.depth.empty() && a.depth_model.empty();
    if (a.depth == "none") a.depth.clear();
    a.data = data;
    const bool needs_depth = a.depth.empty() && a.depth_model.empty();
    const bool needs_inpainting = a.inpaint != "diffusion" && a.inpainting_model.empty();
    if (a.inpaint == "diffusion") a.inpainting_model.clear();
    const bool needs_silhouettes = !a.is_paper && a.silhouette_model.empty();
    if (a.silhouette_model == "none") a.silhouette_model.clear();
    check_weights(a);
    if (!needs_depth && !needs_inpainting && !needs_silhouettes) return;
    const model_folders folders(data);
    if (needs_silhouettes) a.silhouette_model = folders.find(silhouette_weights).value_or("");
    const auto missing = [&](const char* network, const char* options, const char* file) {
        raise(error_code::invalid_option, network, std::string(options) + ", or " + file + " in " + folders.text(),
              "none of these");
    };
    if (needs_depth) {
        a.depth_model = folders.find(depth_weights).value_or("");
        if (a.depth_model.empty() && !a.uses_depth_of_photo)
            missing("depth network", "--depth FILE, or --depth-model PATH", depth_weights);
    }
    if (needs_inpainting) {
        a.inpainting_model = folders.find(inpainting_weights).value_or("");
        if (a.inpainting_model.empty() && a.inpaint == "network")
            missing("inpainting network", "--inpainting-model FILE", inpainting_weights);
    }
}

inline photo3d_options options_for(const arguments& a, const photo_with_depth& input) {
    const photo& photo = input.photo;
    photo3d_options options = a.is_paper ? paper_options() : photo3d_options();
    options.long_side = std::min(a.long_side, a.geometry_side);
    options.texture.strength = a.texture;
    options.grain.strength = a.grain;
    if (!a.is_paper) {
        options.expand.max_hidden *= std::max(1.0F, a.motion / options.expand.motion);
        options.expand.motion = a.motion;
    }
    options.frame = a.frame;
    options.keeps_depth_maps = !a.stages.empty();  // only --stages shows them
    if (!a.silhouette_model.empty()) options.level = level_options();
    if (a.hard_edges) options.mesh.soft_edges.min_width = 0.0F;
    if (photo.focal_length_35mm) options.focal_length_35mm = *photo.focal_length_35mm;
    if (a.field_of_view > 0.0F) {
        // The 35 mm equivalent with the same field of view, because the options expect it.
        const std::int32_t w = static_cast<std::int32_t>(photo.color.width()),
                           h = static_cast<std::int32_t>(photo.color.height());
        options.focal_length_35mm = focal_length_from_field_of_view(a.field_of_view, w, h) / focal_length_from_35mm(1.0F, w, h);
    }
    options.normalize.is_metric = input.depth && input.depth->is_metric;
    options.normalize.is_inverse_depth = !input.depth || input.depth->is_inverse_depth;
    if (!needs_sheets(photo.color, a.long_side, a.geometry_side)) return options;
    const auto shown = [&](std::size_t length) {
        return ldi::shrunk_length(length, std::max(photo.color.height(), photo.color.width()), a.long_side);
    };
    return for_sheets(options, shown(photo.color.height()), shown(photo.color.width()));
}

}  // namespace ldi::examples
