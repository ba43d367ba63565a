// Options of photo3d's command line.
#pragma once

#include "arguments.hpp"
#include "compression.hpp"
#include "data_files.hpp"
#include "option_checks.hpp"
#include "outputs.hpp"
#include "parts.hpp"
#include "video.hpp"

#include <ldi/io/depth_map.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/photo3d/paper_options.hpp>

#include <CLI/CLI.hpp>

#include <filesystem>
#include <initializer_list>
#include <string>

namespace ldi::examples {

inline constexpr const char* program_version = "photo3d " LDI_PROGRAM_VERSION;

inline void describe_compression(CLI::App& app, compression_choice& c) {
    CLI::Option* compress = app.add_flag("--compress", c.is_wanted,
                                         "make the GLB file and the page smaller, for viewers that support "
                                         "EXT_meshopt_compression, such as three.js and Babylon.js");
    app.add_option("--compressed-texture", c.texture,
                   "texture format of a compressed GLB: webp, a quarter smaller at the same quality, for viewers that support "
                   "EXT_texture_webp; jpeg; or both, for all of these viewers")
        ->check(one_of({"webp", "jpeg", "both"}))
        ->needs(compress)
        ->capture_default_str();
}

/// Formats the path of one of the program's data files or folders for help texts. Callers pass a relative path if the text
/// applies to every machine, as in the manual page.
inline std::string shown_place(const std::filesystem::path& place) {
    return place.string() + (place.is_relative() ? " (relative to the program)" : "");
}

/// Adds the photo, and the options of all outputs except videos.
inline void describe_files(CLI::App& app, arguments& a) {
    const CLI::Validator named = examples::named();
    app.option_defaults()->group("Input");
    app.add_option(
           "PHOTO", a.photos,
           "JPEG, PNG, GIF or BMP; HEIC, AVIF, WebP and TIFF if ldi was built with their libraries; - for standard input. "
           "With --batch, any number of photos, folders and lists")
        ->required()
        ->check(named);
    app.option_defaults()->group("Output");
    app.add_option("-o,--output", a.output,
                   "GLB file to write, - for standard output. Without any output option, photo3d writes PHOTO.glb and, if the "
                   "viewer is built, PHOTO.html, beside the photo")
        ->type_name("FILE")
        ->check(named);
    app.add_option("--html", a.html, "HTML file to write: a viewer with the 3D photo in it")->type_name("FILE")->check(named);
    app.add_option("--viewer", a.viewer, "viewer for HTML files, built by examples/viewer/build.sh")
        ->type_name("FILE")
        ->check(named)
        ->default_str(shown_place(a.viewer));
    app.add_option("--usdz", a.usdz, "USDZ file to write, which iPhones, iPads and Macs show without an app")
        ->type_name("FILE")
        ->check(named);
    app.add_option("--stereo-image", a.stereo_image,
                   "stereo picture to write: .jps, .mpo, or side by side in .jpg or .png, the left eye's picture on the left")
        ->type_name("FILE")
        ->check(named);
    app.add_option("--depth-map", a.video.depth_map, "16-bit PNG file to write: the result's depth, white near, 0 in holes")
        ->type_name("FILE")
        ->check(named);
    app.add_option("--quality", a.quality, "JPEG quality of the texture")
        ->type_name("NUMBER")
        ->check(whole_between(1, 100))
        ->capture_default_str();
    describe_compression(app, a.compression);
    app.add_option("--stages", a.stages, "folder to write pictures of every stage to")->type_name("FOLDER")->check(named);
    app.add_option("--report", a.report, "JSON file to write: figures of the run")->type_name("FILE")->check(named);
}

/// Adds the options of depth maps and of the depth network.
inline void describe_depth(CLI::App& app, arguments& a) {
    app.option_defaults()->group("Depth");
    CLI::Option* depth = app.add_option("--depth", a.depth,
                                        "depth map of the photo: PNG (8 or 16 bit), JPEG, PFM or NPY; none: let the network "
                                        "estimate depth, even if the photo contains a depth map");
    depth->type_name("FILE")->check(named());
    app.add_option_function<std::string>(
           "--depth-kind",
           [&a](const std::string& name) {
               a.depth_map.kind = name == "meters" ? depth_map_kind::meters : depth_map_kind::disparity;
           },
           "meaning of the map's values: disparity (nearness, the default) or distance in meters")
        ->check(one_of({"disparity", "meters"}))
        ->needs(depth);
    app.add_option("--depth-scale", a.depth_map.scale, "factor of the distances of --depth-kind meters, 0.001 for millimeters")
        ->type_name("NUMBER")
        ->check(positive())
        ->needs(depth);
    app.add_flag("--depth-near-is-black", a.near_is_black, "small values of a disparity map are near")->needs(depth);
    app.add_flag("--depth-zero-is-unknown", a.depth_map.invalid_zero, "0 in the map means unknown")->needs(depth);
    app.add_flag("--depth-is-inverse", a.is_inverse, "the disparity map is 1 / distance up to scale, without a shift")
        ->needs(depth);
    app.add_option("--depth-model", a.depth_model,
                   "weights of the depth network: a safetensors file, or a folder with tiefenrausch.pb and tiefenrausch_init.pb "
                   "(the published network); default: see below")
        ->type_name("PATH")
        ->check(named())
        ->excludes(depth);
}

/// Adds the options of sizes, the camera and its motion.
inline void describe_geometry(CLI::App& app, arguments& a) {
    app.option_defaults()->group("Size and camera");
    app.add_option(
           "--size", a.long_side,
           "maximum long side of the texture in pixels; larger photos are shrunk; full: no limit. Beyond --geometry-size, the "
           "texture consists of several pictures, for which viewers need more graphics memory")
        ->type_name("NUMBER")
        ->transform(full_or_between(16, 16384))
        ->capture_default_str();
    app.add_option("--geometry-size", a.geometry_side,
                   "long side at which depth, silhouettes and hidden surfaces are computed, if --size is larger")
        ->type_name("NUMBER")
        ->check(whole_between(16, 4096))
        ->capture_default_str();
    app.add_option("--fov", a.field_of_view,
                   "field of view over the long side, in degrees; default: from EXIF, otherwise that of a 26 mm lens in 35 mm "
                   "format")
        ->type_name("NUMBER")
        ->check(between(5, 150));
    app.add_option(
           "--motion", a.motion,
           "maximum parallax between the nearest and the farthest surface, as a share of the long side; surfaces grow behind "
           "silhouettes and past the photo's border accordingly")
        ->type_name("NUMBER")
        ->check(between(0, 0.3))
        ->capture_default_str();
    app.add_option_function<std::string>(
           "--frame", [&a](const std::string& name) { a.frame = name == "crop" ? photo_frame::crop : photo_frame::grow; },
           "frame of pages, videos and stereo pictures: grow (the default) shows the whole photo and continues its surfaces "
           "past the border; crop hides the border, which limits sideways motion of the view to 5.1 % of the short side")
        ->check(one_of({"crop", "grow"}));
}

/// Adds the options of silhouettes, of colors for hidden surfaces, and of the paper's settings.
inline void describe_look(CLI::App& app, arguments& a) {
    app.option_defaults()->group("Look");
    app.add_option("--inpainting-model", a.inpainting_model,
                   "weights (safetensors) of the network that colors hidden surfaces; default: see below")
        ->type_name("FILE")
        ->check(named());
    app.add_option(
           "--silhouette-model", a.silhouette_model,
           "weights (safetensors) of the network that decides which pixels beside a silhouette belong to the surface in front; "
           "default: see below; none: silhouettes are moved onto edges of the photo instead, as they are for a depth map as fine "
           "as "
           "the photo")
        ->type_name("FILE")
        ->check(named());
    app.add_option("--inpaint", a.inpaint,
                   "method that colors hidden surfaces: network (the default if its weights are found) or diffusion")
        ->check(one_of({"diffusion", "network"}));
    app.add_option("--arithmetic", a.arithmetic,
                   "number format of the inpainting network: float32, or int8 (faster; colors have a PSNR of 50 dB to those of "
                   "float32); default: int8 if the weight file also has value ranges for 8 bits, as the included file does")
        ->check(one_of({"float32", "int8"}));
    app.add_option("--texture", a.texture,
                   "strength of texture on inpainted pixels, copied from similar places of the same surface; 0 for none")
        ->type_name("NUMBER")
        ->check(between(0, 4))
        ->capture_default_str();
    app.add_option("--grain", a.grain,
                   "strength of noise on inpainted pixels without texture, relative to the fine detail around them; 0 for none")
        ->type_name("NUMBER")
        ->check(between(0, 4))
        ->capture_default_str();
    app.add_flag("--no-soft-edges", a.hard_edges,
                 "hard silhouettes; by default they fade out over a pixel or two in a translucent strip");
    app.add_option_function<std::string>(
           "--preset", [&a](const std::string& name) { a.is_paper = name == "paper"; },
           "paper: use the paper's numbers and omit the stages that ldi adds; other options still apply")
        ->check(one_of({"default", "paper"}));
}

/// Adds the options of a run over many photos, and --embed, which excludes such a run.
inline void describe_batch(CLI::App& app, arguments& a) {
    app.option_defaults()->group("Batch");
    CLI::Option* batch = app.add_flag(
        "--batch", a.batch,
        "convert many photos: each PHOTO is a photo, a folder of photos, or a list of photos. A list is a file whose name ends "
        "in .jsonl, or - for standard input, with a line of JSON per photo: \"me.jpg\", or {\"photo\": \"me.jpg\", "
        "\"output\": \"me.glb\"}. -o, --html, --report and --depth then name folders. Prints a line of JSON per photo, and "
        "continues after a photo that fails");
    app.add_flag("--skip-existing", a.skip_existing, "skip photos whose outputs all exist, to continue an interrupted run")
        ->needs(batch);
    app.add_option(
           "--gallery", a.gallery,
           "HTML file to write after the batch: a page of all its 3D photos, with a search for failures; opened from a web "
           "server, it shows the GLB files; opened by double click, it shows small pictures")
        ->type_name("FILE")
        ->check(named())
        ->needs(batch);
    app.add_option("--memory", a.memory,
                   "memory limit of a batch, such as 2GB, which limits the number of photos converted at the same time; "
                   "default: half of the machine's memory, or of a container's limit if that is smaller")
        ->transform(memory_size())
        ->type_name("SIZE")
        ->needs(batch);
    app.add_flag("--embed", a.embed,
                 "beside the HTML file, write the files that other pages need for the 3D photo: its GLB, a small JPEG and the "
                 "element photo-3d.js; the HTML file then offers the lines to copy")
        ->group("Output")
        ->needs("--html")
        ->excludes(batch);
}

/// Adds the options of the program itself.
inline void describe_program(CLI::App& app, arguments& a) {
    app.option_defaults()->group("Program");
    app.add_option("--formats", a.formats,
                   "formats that may be read: a comma-separated list from " + picture_formats().text() +
                       ". Applies to photos, depth maps, and depth inside photos. Files of other "
                       "formats are rejected before decoding. Default: all")
        ->type_name("NAME,...")
        ->check(formats_named());
    app.add_option("--threads", a.threads, "number of threads; 0: one per processor")
        ->type_name("NUMBER")
        ->check(whole_between(0, 1024))
        ->capture_default_str();
    app.add_flag("--quiet", a.quiet, "print errors only");
    app.set_version_flag("--version", program_version + parts_left_out() + "\n",
                         "print the version and the optional parts that this build lacks, and exit");
    app.set_help_flag("-h,--help", "print all options and exit");
}

inline void describe(CLI::App& app, arguments& a, const std::filesystem::path& data) {
    a.viewer = data / "viewer" / "viewer.html";
    app.set_help_flag();  // describe_program() adds it at the end
    app.description("Turns a photo into a 3D photo: a GLB file with one textured mesh, and a page that shows it.");
    app.footer(std::string("Unless an option names weights, photo3d looks for them in the folder named by ") +
               model_folders::variable + ", then in " + shown_place(data / "models") + ": " + depth_weights + ", " +
               silhouette_weights + " and " + inpainting_weights +
               ". Without the last two, it aligns silhouettes and inpaints by diffusion.");
    describe_files(app, a);
    describe_video(app, a.video);
    describe_depth(app, a);
    describe_geometry(app, a);
    describe_look(app, a);
    describe_batch(app, a);
    describe_program(app, a);
}

/// Rejects options that have no effect in combination with the other options. Raises CLI::ValidationError.
inline void check_effects(const CLI::App& app, const arguments& a) {
    const auto refuse = [&](const char* choice, std::initializer_list<const char*> ignored) {
        for (const char* const option : ignored)
            if (app.count(option) > 0)
                throw CLI::ValidationError(option, std::string("expected no ") + choice + " beside it, found both");
    };
    if (a.depth == "none" && !a.batch)  // the list of a batch may name depth maps, to which these options apply
        refuse("--depth none",
               {"--depth-kind", "--depth-scale", "--depth-near-is-black", "--depth-zero-is-unknown", "--depth-is-inverse"});
    if (a.depth_map.kind == depth_map_kind::meters)
        refuse("--depth-kind meters", {"--depth-near-is-black", "--depth-is-inverse"});
    if (a.is_paper && a.silhouette_model != "none") refuse("--preset paper", {"--silhouette-model"});  // it aligns silhouettes
    if (a.inpaint == "diffusion") refuse("--inpaint diffusion", {"--inpainting-model", "--arithmetic"});

    const auto require = [&](bool is_there, const char* expected, const char* found, std::initializer_list<const char*> useless) {
        for (const char* const option : useless)
            if (!is_there && app.count(option) > 0)
                throw CLI::ValidationError(option, std::string("expected ") + expected + " beside it, found " + found);
    };
    require(a.depth_map.kind == depth_map_kind::meters, "--depth-kind meters", "disparity", {"--depth-scale"});
    const bool has_glb = !a.output.empty() || !a.html.empty() ||
                         (a.video.output.empty() && a.video.depth_map.empty() && a.stereo_image.empty() && a.usdz.empty());
    const bool has_jpeg = has_glb || !a.usdz.empty() || (!a.stereo_image.empty() && extension_of(a.stereo_image) != ".png");
    require(has_glb, "-o or --html", "neither", {"--compress"});
    require(has_jpeg, "-o, --html, --usdz, or --stereo-image in JPEG", "none", {"--quality"});
}

/// Sets the options of --preset that the command line does not set.
inline void apply_preset(const CLI::App& app, arguments& a) {
    if (!a.is_paper) return;
    const photo3d_options paper = paper_options();
    if (app.count("--frame") == 0) a.frame = paper.frame;
    if (app.count("--texture") == 0) a.texture = paper.texture.strength;
    if (app.count("--grain") == 0) a.grain = paper.grain.strength;
    a.hard_edges = true;
}

}  // namespace ldi::examples
