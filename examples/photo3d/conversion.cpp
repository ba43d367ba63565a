// Defines the functions of conversion.hpp. They are in a separate file, because compiling them takes longer than compiling the
// rest of a program that uses them.
#include "conversion.hpp"

#include "depth_direction.hpp"
#include "notes.hpp"

#include <ldi/depth/network_decider.hpp>
#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/io/weight_files.hpp>

#include <algorithm>
#include <system_error>
#include <utility>

namespace ldi::examples {

const tiefenrausch& depth_network::read() const {
    std::call_once(is_read_, [this] { network_.emplace(load_depth_network(path_)); });
    return *network_;
}

networks load_networks(const arguments& a, stage_clock& clock) {
    std::optional<farbrausch> inpainting;
    if (!a.inpainting_model.empty()) {
        clock.begin("reading inpainting network");
        inpainting = load_farbrausch(a.inpainting_model, a.inpainting_arithmetic());
    }
    std::optional<silhouette_network> silhouettes;
    if (!a.silhouette_model.empty()) {
        clock.begin("reading silhouette network");
        silhouettes = load_silhouettes(a.silhouette_model);
    }
    return {depth_network(a.depth_model), std::move(inpainting), std::move(silhouettes)};
}

photo_with_depth decode_input(const arguments& a, const photo_files& names, std::span<const std::byte> photo,
                              const map_content& map, const networks& loaded, thread_pool& threads) {
    const std::string name = name_of_input(names.photo), depth_name = name_of_input(map_file(names));
    photo_with_depth input;
    if (!names.depth.empty()) {
        depth_map_options options = a.depth_map;
        options.white_is_near = !a.near_is_black;
        options.formats = a.reading().formats;
        const bool is_metric = options.kind == depth_map_kind::meters;
        input.photo = decode_photo(photo, a.reading(), name);
        input.depth = photo_depth{fill_invalid(shrink_depth_map(decode_depth_map(map.bytes, options, depth_name)), depth_name),
                                  a.is_inverse || is_metric, is_metric, false, depth_name};
        check_fits(input.depth->disparity, input.photo.color, depth_name);
        return input;
    }
    if (!a.uses_depth_of_photo) {
        input.photo = decode_photo(photo, a.reading(), name);
        return input;
    }
    const bool has_map = !names.beside.empty() && map.unreadable.empty();
    input = has_map ? decode_photo_with_map(photo, map.bytes, a.reading(), name, depth_name)
                    : decode_photo_with_depth(photo, a.reading(), name);
    if (input.refused.empty()) input.refused = map.unreadable;
    if (!input.depth && !loaded.depth)
        raise(error_code::invalid_option, name,
              std::string("--depth FILE, --depth-model PATH, a photo with depth inside, or ") + depth_weights + " in " +
                  model_folders(a.data).text(),
              "none of these" + (input.refused.empty() ? "" : " (the depth map was not used: " + input.refused + ")"));
    if (!input.depth) return input;
    input.depth->disparity = fill_invalid(shrink_depth_map(std::move(input.depth->disparity)), input.depth->source);
    if (input.depth->is_white_near_a_guess && loaded.depth) invert_as_seen(input, loaded.depth.read(), threads);
    return input;
}

converted_photo convert(const arguments& a, photo_with_depth& input, const networks& loaded, stage_clock& clock,
                        thread_pool& threads) try {
    photo3d_options options = options_for(a, input);
    options.progress = clock.listener();
    image<std::uint8_t>& photo = input.photo.color;
    const network_decider silhouettes(loaded.silhouettes ? &*loaded.silhouettes : nullptr, options.alignment);
    const auto with = [&](const auto& inpainter) {
        cleaned_photo cleaned =
            input.depth ? clean_depth(photo, given_disparity{std::move(input.depth->disparity)}, silhouettes, options, threads)
                        : clean_depth(photo, loaded.depth.read(), silhouettes, options, threads);
        if (!needs_sheets(photo, a.long_side, a.geometry_side)) photo = {};  // a phone's photo needs as much memory as all layers
        const bool is_decided = !cleaned.shares.empty();
        return converted_photo{make_photo3d(std::move(cleaned), photo_columns<>(), inpainter, options, threads), is_decided};
    };
    converted_photo made = loaded.inpainting ? with(*loaded.inpainting) : with(diffusion_inpainter());
    made.facts.motion = std::min(made.facts.motion, a.motion);  // --preset paper grows surfaces independently of --motion
    return made;
} catch (const error& failed) {  // the stages do not know the name of the depth map
    const error_details details = failed.details();
    if (!input.depth || details.where != "disparity") throw;
    raise(details.code, input.depth->source, details.expected, details.found);
}

photo_texture texture_of(const photo3d& made, const photo_with_depth& input, const arguments& a, thread_pool& threads) {
    return {made, input.photo.color, a.long_side, a.geometry_side, threads};
}

encoded_photo3d encode(const photo3d& made, const photo_texture& texture, const arguments& a, const photo_files& names,
                       stage_clock& clock, thread_pool& threads) {
    clock.begin("encoding");
    encoded_photo3d result;
    texture.for_each(
        [&](std::size_t i, const image<std::uint8_t>& picture) {
            result.textures.jpeg.push_back(encode_jpeg(picture, a.quality));
            if (texture.mesh().uses_texture(i)) add_webp(result.textures, picture, a.quality, a.compression);
        },
        threads);
    result.facts.camera = made.facts.camera;
    result.facts.motion = made.facts.motion, result.facts.is_past_frame = made.facts.margin > 0;
    result.facts.range = made.facts.range;
    if (!is_standard(names.photo)) result.facts.source = as_utf8(names.photo.filename().string());
    const std::vector<std::span<const std::byte>> jpegs(result.textures.jpeg.begin(), result.textures.jpeg.end());
    written_glb written = compressed(encode_glb(texture.mesh(), jpegs, result.facts), result.textures,
                                     made.facts.camera.focal_length, a.compression);
    result.glb = std::move(written.file);
    result.shown = {texture.width(), texture.height(), texture.count(), written.texture_bytes};
    if (a.usdz.empty()) result.textures = {};  // only USDZ needs them
    clock.finish();
    return result;
}

void name_outputs(photo_files& names, const std::filesystem::path& viewer) {
    names.glb = std::filesystem::path(names.photo).replace_extension(".glb");
    std::error_code ignored;
    if (std::filesystem::exists(viewer, ignored)) names.html = std::filesystem::path(names.photo).replace_extension(".html");
    names.are_own = true;
}

void check_names(const photo_files& names, const arguments& a, output_files& files) {
    for (const std::filesystem::path& input :
         {names.photo, map_file(names), a.depth_model, a.inpainting_model, a.silhouette_model, a.viewer})
        files.read_from(input);
    if (names.are_own) {
        check_own(names.glb, R"("generator":"ldi )", "-o");
        if (!names.html.empty()) check_own(names.html, R"(<script id="photo" type="model/gltf-binary)", "--html");
    }
    if (!names.glb.empty()) {
        files.claim(names.glb);
        check_glb_name(names.glb);
    }
    if (!names.html.empty()) {
        files.claim(names.html);
        check_page_name(names.html);
    }
    if (!names.poster.empty()) files.claim(names.poster);
    if (!names.report.empty()) files.claim(names.report, true);
}

nlohmann::ordered_json report_on(const converted_photo& made, const encoded_photo3d& encoded, const photo_with_depth& input,
                                 const arguments& a, const stage_clock& clock) {
    const std::string depth = input.depth ? input.depth->source : a.depth_model.string(),
                      inpainting = a.inpainting_model.empty() ? "diffusion" : a.inpainting_model.string();
    const std::string silhouettes = made.is_decided_by_network ? a.silhouette_model.string() : "alignment";
    nlohmann::ordered_json report =
        make_report(made, clock, depth, silhouettes, inpainting, a.texture, a.grain, encoded.glb.size(), encoded.shown);
    report["notes"] = notes_on(made, report["hidden_pixels"], a, depth, input.refused);
    return report;
}

std::string make_page(const viewer_page& viewer, const photo_files& names, const photo3d& made, const encoded_photo3d& encoded,
                      bool is_for_embedding) {
    const std::string title = title_of(names);
    const bool is_whole = made.facts.margin > 0;
    const auto whole = [](const std::filesystem::path& file) { return std::filesystem::absolute(file).lexically_normal(); };
    const auto seen = [&](const std::filesystem::path& file) {
        return whole(file).lexically_proximate(whole(names.html).parent_path()).generic_string();
    };
    const std::string snippet =
        is_for_embedding ? embedding_snippet(title, seen(names.glb), seen(names.poster), made.photo, is_whole) : "";
    return viewer.with_photo(title, made.photo, encoded.glb, is_whole, snippet);
}

}  // namespace ldi::examples
