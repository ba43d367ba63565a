// photo3d: a photo in, a 3D photo out: a GLB file, or an HTML page that shows it.

#include "compression.hpp"
#include "data_files.hpp"
#include "documents.hpp"
#include "html_page.hpp"
#include "interruption.hpp"
#include "messages.hpp"
#include "option_checks.hpp"
#include "outputs.hpp"
#include "report.hpp"
#include "stage_pictures.hpp"
#include "stereo_image.hpp"
#include "usdz.hpp"
#include "video.hpp"

#include <ldi/formats/depth_map.hpp>
#include <ldi/formats/farbrausch_file.hpp>
#include <ldi/formats/glb.hpp>
#include <ldi/formats/photo_depth.hpp>
#include <ldi/formats/picture.hpp>
#include <ldi/formats/tiefenrausch_file.hpp>
#include <ldi/occlusion/diffusion_inpainter.hpp>
#include <ldi/photo3d.hpp>

#include <CLI/CLI.hpp>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <cstdio>
#include <exception>
#include <filesystem>
#include <map>
#include <new>
#include <optional>
#include <span>
#include <string>

namespace {

struct arguments {
    std::filesystem::path photo, output, html, viewer, depth, depth_model, inpainting_model, stages, report, data, stereo_image,
        usdz;
    ldi::depth_map_options depth_map;
    bool near_is_black = false, is_inverse = false, quiet = false, hard_edges = false;
    bool takes_depth_of_photo = false;  // set by find_weights()
    std::size_t long_side = ldi::photo3d_options().long_side, threads = 0;
    float field_of_view = 0.0F, texture = ldi::photo3d_options().texture.strength, grain = ldi::photo3d_options().grain.strength,
          motion = ldi::photo3d_options().expand.motion;
    int quality = 85;
    std::string inpaint;  // empty: by the network if its weights are found
    std::string arithmetic = "float32";
    ldi::examples::video_options video;
    ldi::examples::compression_choice compression;

    ldi::arithmetic inpainting_arithmetic() const {
        for (const ldi::arithmetic kind : {ldi::arithmetic::float32, ldi::arithmetic::bfloat16, ldi::arithmetic::int8})
            if (arithmetic == to_string(kind)) return kind;
        return ldi::best_arithmetic();
    }
};

constexpr const char* program_version = "photo3d " LDI_PROGRAM_VERSION;
constexpr const char *depth_weights = "tiefenrausch_small.safetensors", *inpainting_weights = "farbrausch.safetensors";

void describe(CLI::App& app, arguments& a, const std::filesystem::path& data) {
    a.viewer = data / "viewer" / "viewer.html";
    app.description("Turns a photo into a 3D photo: a GLB file with one textured mesh, and a page that shows it.");
    app.footer(std::string("Weights that no option names are looked for in the folder that ") +
               ldi::examples::model_folders::variable + " names,\nthen in " + (data / "models").string() + ":\n" + depth_weights +
               " and " + inpainting_weights + ".");
    const CLI::Validator named = ldi::examples::named();
    app.set_version_flag("--version", program_version, "print the version and exit");
    app.add_option("PHOTO", a.photo,
                   "JPEG or PNG; HEIC, AVIF, WebP and TIFF where ldi was built with their libraries; - for standard input")
        ->required()
        ->check(named);
    app.add_option(
           "-o,--output", a.output,
           "the GLB file to write, - for standard output; default, where no output is named: PHOTO.glb and, if the viewer "
           "is built, PHOTO.html, beside the photo")
        ->check(named);
    app.add_option("--html", a.html, "the HTML file to write: a viewer with the 3D photo in it")->check(named);
    app.add_option("--viewer", a.viewer, "the viewer for pages, as examples/viewer/build.sh builds it")
        ->check(named)
        ->capture_default_str();
    CLI::Option* depth = app.add_option("--depth", a.depth,
                                        "depth map of the photo: PNG (8 or 16 bit), JPEG, PFM or NPY; none: let the network "
                                        "estimate it, also where the photo brings depth of its own");
    depth->check(named);
    app.add_option("--depth-kind", a.depth_map.kind, "what the map's values are: disparity (nearness, the default) or meters")
        ->transform(CLI::CheckedTransformer(std::map<std::string, ldi::depth_map_kind>{
            {"disparity", ldi::depth_map_kind::disparity}, {"meters", ldi::depth_map_kind::meters}}))
        ->needs(depth);
    app.add_option("--depth-scale", a.depth_map.scale, "multiplies the map's values, 0.001 for millimeters")->needs(depth);
    app.add_flag("--depth-near-is-black", a.near_is_black, "small values of a disparity map are near")->needs(depth);
    app.add_flag("--depth-zero-is-unknown", a.depth_map.invalid_zero, "0 in the map means that nothing is known")->needs(depth);
    app.add_flag("--depth-is-inverse", a.is_inverse, "the disparity map is 1 / distance up to scale, without a shift")
        ->needs(depth);
    app.add_option("--depth-model", a.depth_model,
                   "weights of the depth network: a safetensors file, or a folder with tiefenrausch.pb and tiefenrausch_init.pb "
                   "(the published network); default: see below")
        ->excludes(depth);
    app.add_option("--inpainting-model", a.inpainting_model,
                   "weights (safetensors) of the network that colors hidden surfaces; default: see below");
    app.add_option("--inpaint", a.inpaint,
                   "how hidden surfaces get their colors: network (the default where its weights are found) or diffusion")
        ->check(CLI::IsMember({"diffusion", "network"}));
    app.add_option(
           "--arithmetic", a.arithmetic,
           "what the inpainting network computes with: float32, bfloat16 (faster, on processors that have it), int8 (fastest, "
           "everywhere, and the least exact), or best: bfloat16 where there is that, else float32")
        ->check(CLI::IsMember({"float32", "bfloat16", "int8", "best"}))
        ->capture_default_str();
    app.add_option(
           "--texture", a.texture,
           "how much of the photo's texture what is inpainted gets, from places of the same surface that look like it; 0 for "
           "none")
        ->check(ldi::examples::between(0, 4))
        ->capture_default_str();
    app.add_option(
           "--grain", a.grain,
           "noise over what is inpainted where it gets no texture, relative to the strength of what is fine around; 0 for none")
        ->check(ldi::examples::between(0, 4))
        ->capture_default_str();
    app.add_flag("--no-soft-edges", a.hard_edges,
                 "silhouettes end hard; else they fade out over a pixel or two, by a translucent strip");
    app.add_option("--size", a.long_side, "long side that larger photos are shrunk to, in pixels")
        ->check(ldi::examples::between(16, 16384))
        ->capture_default_str();
    app.add_option("--fov", a.field_of_view,
                   "field of view over the long side, in degrees; default: from EXIF, else 26 mm equivalent")
        ->check(ldi::examples::between(5, 150));
    app.add_option(
           "--motion", a.motion,
           "how far the camera may go, in the viewer, a headset and videos: what is nearest moves against what is farthest "
           "by this share of the long side, and surfaces grow behind silhouettes for as much")
        ->check(ldi::examples::between(0, 0.3))
        ->capture_default_str();
    app.add_option("--quality", a.quality, "JPEG quality of the texture")
        ->check(ldi::examples::between(1, 100))
        ->capture_default_str();
    ldi::examples::describe_compression(app, a.compression);
    app.add_option("--threads", a.threads, "0: as many as the machine has")
        ->check(ldi::examples::between(0, 1024))
        ->capture_default_str();
    app.add_option("--stages", a.stages, "folder for pictures of every stage")->check(named);
    app.add_option("--report", a.report, "JSON file for the figures of the run")->check(named);
    ldi::examples::describe_video(app, a.video);
    app.add_option("--stereo-image", a.stereo_image,
                   "a picture for each eye: .jps, .mpo, or both side by side in .jpg or .png, the left one on the left")
        ->check(named);
    app.add_option("--usdz", a.usdz, "USDZ file to write, which iPhones, iPads and Macs show without a program")->check(named);
    app.add_flag("--quiet", a.quiet, "print errors only");
}

/// Fills in the weights that no option names.
void find_weights(arguments& a, const std::filesystem::path& data) {
    a.takes_depth_of_photo = a.depth.empty() && a.depth_model.empty();
    if (a.depth == "none") a.depth.clear();
    const bool needs_depth = a.depth.empty() && a.depth_model.empty();
    const bool needs_inpainting = a.inpaint != "diffusion" && a.inpainting_model.empty();
    a.data = data;
    if (a.inpaint == "diffusion") a.inpainting_model.clear();
    if (!needs_depth && !needs_inpainting) return;
    const ldi::examples::model_folders folders(data);
    const auto missing = [&](const char* options, const char* file) {
        ldi::raise(ldi::error_code::invalid_option, "photo3d", std::string(options) + ", or " + file + " in " + folders.text(),
                   "none of these");
    };
    if (needs_depth) {
        a.depth_model = folders.find(depth_weights).value_or("");
        if (a.depth_model.empty() && !a.takes_depth_of_photo) missing("--depth FILE, or --depth-model PATH", depth_weights);
    }
    if (needs_inpainting) {
        a.inpainting_model = folders.find(inpainting_weights).value_or("");
        if (a.inpainting_model.empty() && a.inpaint == "network") missing("--inpainting-model FILE", inpainting_weights);
    }
}

/// The photo, and its own depth where it brings any and no option says otherwise.
ldi::photo_with_depth read_photo(const arguments& a, ldi::examples::stage_clock& clock) {
    clock.begin("reading photo");
    const std::string name = ldi::examples::name_of_input(a.photo);
    if (!a.takes_depth_of_photo) return {ldi::decode_photo(ldi::examples::read_input(a.photo), {}, name), {}, {}};
    ldi::photo_with_depth input = ldi::examples::is_standard(a.photo)
                                      ? ldi::decode_photo_with_depth(ldi::examples::read_input(a.photo), {}, name)
                                      : ldi::load_photo_with_depth(a.photo);
    if (!input.refused.empty()) ldi::examples::say("not used: " + input.refused);
    if (!input.depth && a.depth_model.empty())
        ldi::raise(ldi::error_code::invalid_option, "photo3d",
                   std::string("--depth FILE, --depth-model PATH, a photo with depth inside, or ") + depth_weights + " in " +
                       ldi::examples::model_folders(a.data).text(),
                   "none of these");
    if (!input.depth) return input;
    ldi::image<float>& map = input.depth->disparity;
    map = ldi::fill_invalid(std::move(map), input.depth->source);
    if (!input.depth->is_white_near_a_guess || a.depth_model.empty()) return input;
    // Programs disagree on whether white or black is near. The network sees which; where it sees little, it is white, as is
    // usual.
    ldi::thread_pool threads(a.threads);
    const ldi::image<float> estimate = ldi::load_depth_network(a.depth_model).disparity(input.photo.color, {}, threads);
    if (ldi::agreement(map, estimate) > -0.2F) return input;
    ldi::turn_round(map);
    input.depth->source += ", black is near";
    return input;
}

ldi::photo3d_options options_for(const arguments& a, const ldi::photo_with_depth& input) {
    const ldi::photo& photo = input.photo;
    ldi::photo3d_options options;
    options.long_side = a.long_side;
    options.texture.strength = a.texture;
    options.grain.strength = a.grain;
    options.expand.motion = a.motion;
    if (a.hard_edges) options.mesh.soft_edges.least_width = 0.0F;
    if (photo.focal_length_35mm) options.focal_length_35mm = *photo.focal_length_35mm;
    if (a.field_of_view > 0.0F) {
        // The same field of view as a 35 mm equivalent, which is what the options hold.
        const std::int32_t w = static_cast<std::int32_t>(photo.color.width()),
                           h = static_cast<std::int32_t>(photo.color.height());
        options.focal_length_35mm =
            ldi::focal_length_from_field_of_view(a.field_of_view, w, h) / ldi::focal_length_from_35mm(1.0F, w, h);
    }
    options.normalize.is_metric = a.depth_map.kind == ldi::depth_map_kind::meters;
    options.normalize.is_inverse_depth = a.depth.empty() || a.is_inverse || options.normalize.is_metric;
    if (input.depth)
        options.normalize.is_metric = input.depth->is_metric, options.normalize.is_inverse_depth = input.depth->is_inverse_depth;
    return options;
}

template <ldi::color_inpainter Inpainter>
ldi::photo3d convert(const arguments& a, const ldi::photo_with_depth& input, const Inpainter& inpainter,
                     ldi::examples::stage_clock& clock) {
    const ldi::photo& photo = input.photo;
    ldi::photo3d_options options = options_for(a, input);
    options.progress = clock.listener();
    ldi::thread_pool threads(a.threads);
    if (!a.depth.empty()) {
        clock.begin("reading depth");
        ldi::depth_map_options map_options = a.depth_map;
        map_options.white_is_near = !a.near_is_black;
        const std::string depth_name = ldi::examples::name_of_input(a.depth);
        const ldi::given_disparity estimator{
            ldi::fill_invalid(ldi::decode_depth_map(ldi::examples::read_input(a.depth), map_options, depth_name), depth_name)};
        ldi::check_fits(estimator.map, photo.color, depth_name);
        return ldi::make_photo3d(photo.color, estimator, inpainter, options, threads);
    }
    if (input.depth)
        return ldi::make_photo3d(photo.color, ldi::given_disparity{input.depth->disparity}, inpainter, options, threads);
    clock.begin("reading depth network");
    const ldi::tiefenrausch estimator = ldi::load_depth_network(a.depth_model);
    return ldi::make_photo3d(photo.color, estimator, inpainter, options, threads);
}

ldi::photo3d convert(const arguments& a, const ldi::photo_with_depth& input, ldi::examples::stage_clock& clock) {
    if (a.inpainting_model.empty()) return convert(a, input, ldi::diffusion_inpainter(), clock);
    clock.begin("reading inpainting network");
    const ldi::farbrausch inpainter = ldi::load_farbrausch(a.inpainting_model, a.inpainting_arithmetic());
    return convert(a, input, inpainter, clock);
}

/// Names the outputs that follow from the photo's name where none is given.
void name_outputs(arguments& a) {
    if (!a.output.empty() || !a.html.empty() || !a.video.output.empty() || !a.video.depth_map.empty() ||
        !a.stereo_image.empty() || !a.usdz.empty())
        return;
    if (ldi::examples::is_standard(a.photo)) {
        a.output = "-";
        return;
    }
    a.output = std::filesystem::path(a.photo).replace_extension(".glb");
    ldi::examples::check_own(a.output, R"("generator":"ldi )", "-o");
    std::error_code ignored;
    if (std::filesystem::exists(a.viewer, ignored)) {
        a.html = std::filesystem::path(a.photo).replace_extension(".html");
        ldi::examples::check_own(a.html, R"(<script id="photo" type="model/gltf-binary)", "--html");
    } else if (!a.quiet) {
        ldi::examples::say("no page beside the GLB: the viewer is not built (examples/viewer/build.sh builds " +
                           a.viewer.string() + ")");
    }
}

/// Says what stands against the names before any work.
void check_files(const arguments& a, ldi::examples::output_files& files) {
    if (ldi::examples::is_standard(a.photo) && ldi::examples::is_standard(a.depth))
        ldi::raise(ldi::error_code::invalid_option, "-", "one input that comes from standard input", "two: PHOTO and --depth");
    for (const std::filesystem::path& input : {a.photo, a.depth, a.depth_model, a.inpainting_model, a.viewer})
        files.read_from(input);
    if (a.takes_depth_of_photo) files.read_from(ldi::depth_map_beside(a.photo));
    if (ldi::examples::camera_paths().count(a.video.path) == 0) files.read_from(a.video.path);
    if (!a.output.empty()) {
        files.claim(a.output);
        ldi::examples::check_glb_name(a.output);
    }
    if (!a.html.empty()) files.claim(a.html);
    if (!a.report.empty()) files.claim(a.report, true);
    if (!a.stages.empty()) files.claim_folder(a.stages);
    ldi::examples::check_stereo_image(a.stereo_image, files);
    ldi::examples::check_usdz(a.usdz, files);
    ldi::examples::check_compression(a.compression);
    ldi::examples::check_video(a.video, files);
}

/// The table of a run's figures, and what its result leaves to be said.
void print_figures(const arguments& a, const nlohmann::ordered_json& report, const std::string& depth, bool is_stdout_taken) {
    if (a.quiet) return;
    std::fputs(("\n" + ldi::examples::to_table(report)).c_str(), is_stdout_taken ? stderr : stdout);
    if (report["hidden_pixels"] == 0)
        ldi::examples::say(ldi::examples::name_of_input(a.photo) + " became a single sheet: nowhere in its depth (" + depth +
                           ") does one thing hide another, so that there is nothing to see behind it. Another depth map or "
                           "network may see more: --depth, --depth-model.");
}

/// What all files say of the photo.
ldi::glb_options facts_of(const arguments& a, const ldi::photo3d& result) {
    ldi::glb_options facts;
    facts.camera = result.layers.camera;
    facts.motion = result.layers.motion;
    facts.range = result.layers.range;
    if (!ldi::examples::is_standard(a.photo)) facts.source = ldi::examples::as_utf8(a.photo.filename().string());
    return facts;
}

void run(arguments& a, ldi::examples::output_files& files) {
    name_outputs(a);
    check_files(a, files);
    ldi::examples::stage_clock clock(a.quiet);
    std::optional<ldi::examples::viewer_page> viewer;  // first: where it is missing, nothing needs to be computed
    if (!a.html.empty()) viewer.emplace(a.viewer);
    const ldi::photo_with_depth input = read_photo(a, clock);
    const ldi::photo3d result = convert(a, input, clock);

    clock.begin("encoding");
    const std::vector<std::byte> jpeg = ldi::encode_jpeg(result.atlas.color, a.quality);
    const ldi::glb_options facts = facts_of(a, result);
    const std::vector<std::byte> glb =
        ldi::examples::compressed(result, ldi::encode_glb(result.mesh, jpeg, facts), a.quality, a.compression);
    clock.finish();

    const std::string depth = input.depth ? input.depth->source
                                          : ldi::examples::name_of_input(a.depth.empty() ? a.depth_model : a.depth),
                      inpainting = a.inpainting_model.empty() ? "diffusion" : a.inpainting_model.string();
    const nlohmann::ordered_json report =
        ldi::examples::make_report(result, clock, depth, inpainting, a.texture, a.grain, glb.size(), jpeg.size());
    if (!a.report.empty()) files.write(a.report, ldi::examples::to_text(report));
    if (!a.stages.empty()) ldi::examples::save_stage_pictures(result, a.stages, files);
    ldi::thread_pool threads(a.threads);
    ldi::examples::save_video(result, a.video, files, threads);
    ldi::examples::save_stereo_image(result, a.stereo_image, a.quality, a.depth_map.kind == ldi::depth_map_kind::meters, files,
                                     threads);
    if (!a.usdz.empty()) files.write(a.usdz, ldi::examples::encode_usdz(result.mesh, jpeg, facts));
    if (viewer) {
        const std::string title = ldi::examples::is_standard(a.photo) ? "3D photo" : a.photo.stem().string();
        files.write(a.html, viewer->with_photo(title, result.photo, glb));
    }
    if (!a.output.empty()) files.write(a.output, glb);
    files.commit();
    print_figures(a, report, depth, files.uses_standard_output());
}

/// Adds what prints the manual page or a shell's completions and ends. These name the program's data as seen from it.
void describe_documents(CLI::App& app) {
    app.add_option_function<std::string>(
           "--generate",
           [](const std::string& kind) {
               CLI::App described;
               arguments defaults;
               describe(described, defaults, LDI_DATA_FROM_PROGRAM);
               described.set_help_flag("-h,--help", "print all options and exit");
               throw CLI::CallForVersion(ldi::examples::document(described, program_version, kind), 0);
           },
           "print the manual page (man), or what a shell completes (bash, zsh, fish), and exit")
        ->check(CLI::IsMember({"man", "bash", "zsh", "fish"}));
}

}  // namespace

int main(int count, char** values) {
#if defined(__GLIBC__)
    // Stages free and allocate the same tens of megabytes; handing them back to the system in between costs more than the stages.
    mallopt(M_MMAP_THRESHOLD, 1 << 30);
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
#endif
    CLI::App app;
    arguments a;
    const std::filesystem::path data = ldi::examples::data_folder(values[0]);
    try {
        describe(app, a, data);
        describe_documents(app);
        app.footer(app.get_footer() + "\n\nExit codes. " + ldi::examples::exit_code_text);
        app.parse(count, values);
        ldi::examples::output_files files;
        const ldi::examples::interruption signals(files.files());
        try {
            find_weights(a, data);
            run(a, files);
        } catch (...) {
            signals.end_if_signaled();
            return ldi::examples::say_failure();
        }
    } catch (const CLI::Success& e) {
        return app.exit(e);  // --help, --version, --generate
    } catch (const CLI::ParseError& e) {
        ldi::examples::say(std::string(e.what()) + " (photo3d --help lists all options)");
        return ldi::examples::exit_usage;
    } catch (...) {
        return ldi::examples::say_failure();
    }
    return ldi::examples::exit_done;
}
