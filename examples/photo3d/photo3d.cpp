// photo3d: converts a photo to a 3D photo, as a GLB file or as an HTML page that shows the 3D photo.

#include "arguments.hpp"
#include "batch.hpp"
#include "conversion.hpp"
#include "data_files.hpp"
#include "documents.hpp"
#include "heap.hpp"
#include "help_text.hpp"
#include "interruption.hpp"
#include "messages.hpp"
#include "options.hpp"
#include "outputs.hpp"
#include "report.hpp"
#include "spare_memory.hpp"
#include "stage_pictures.hpp"
#include "stereo_image.hpp"
#include "system.hpp"
#include "usage_error.hpp"
#include "usdz.hpp"
#include "video.hpp"

#include <ldi/io/photo_depth.hpp>
#include <ldi/photo3d.hpp>

#include <CLI/CLI.hpp>

#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <vector>

namespace {

using namespace ldi::examples;

/// Returns the path of the JavaScript module of the element <photo-3d>. With --embed, a copy of it lies beside the page.
std::filesystem::path element_beside(const std::filesystem::path& page) { return page.parent_path() / "photo-3d.js"; }

/// Reads the built module of the element <photo-3d>, photo-3d/photo-3d.js beside the viewer's page. Raises file_access.
std::vector<std::byte> read_element(const std::filesystem::path& viewer) {
    return ldi::read_file(viewer.parent_path() / "photo-3d" / "photo-3d.js");
}

/// Chooses the names of the files to which the page of --embed refers: the GLB, unless an option names it, and the poster. Raises
/// invalid_option.
void name_embedded_files(photo_files& names) {
    if (is_standard(names.html) || is_standard(names.glb))
        ldi::raise(ldi::error_code::invalid_option, "--embed", "names of files for the page and the GLB", "standard output");
    if (names.glb.empty()) names.glb = std::filesystem::path(names.html).replace_extension(".glb");
    names.poster = std::filesystem::path(names.html).replace_extension(".poster.jpg");
}

/// Determines the names of the input and output files of a run over one photo. Raises invalid_option, file_access.
photo_files names_of(const arguments& a) {
    for (const std::filesystem::path& photo : a.photos) {
        std::error_code ignored;
        if (std::filesystem::is_directory(photo, ignored))
            ldi::raise(ldi::error_code::invalid_option, photo.string(), "a photo", "a folder (use --batch for folders)");
        check_input(photo, "a photo");
    }
    if (a.photos.size() != 1)
        ldi::raise(ldi::error_code::invalid_option, "PHOTO", "one photo",
                   std::to_string(a.photos.size()) + " (use --batch for several)");
    check_input(a.depth, "a depth map");
    photo_files names{a.photos.front(), a.depth, a.output, a.html, a.report, false};
    find_map_beside(names, a);
    if (a.embed) name_embedded_files(names);
    if (!a.output.empty() || !a.html.empty() || !a.video.output.empty() || !a.video.depth_map.empty() ||
        !a.stereo_image.empty() || !a.usdz.empty())
        return names;
    if (is_standard(names.photo)) {
        names.glb = "-";
        return names;
    }
    name_outputs(names, a.viewer);
    if (names.html.empty() && !a.quiet)
        say("no page beside the GLB: the viewer is not built (examples/viewer/build.sh builds " + a.viewer.string() + ")");
    return names;
}

/// Checks the names of all inputs and outputs before the conversion starts, and creates missing folders. Raises invalid_option,
/// file_access, and the errors of output_files::create_folder_of().
void check_files(const arguments& a, const photo_files& names, output_files& files) {
    if (is_standard(names.photo) && is_standard(names.depth))
        ldi::raise(ldi::error_code::invalid_option, "-", "one input that comes from standard input", "two: PHOTO and --depth");
    for (const std::filesystem::path& output :
         {names.glb, names.html, names.report, a.usdz, a.stereo_image, a.video.output, a.video.depth_map})
        files.create_folder_of(output);
    if (camera_paths().count(a.video.path) == 0) files.read_from(a.video.path);
    check_names(names, a, files);
    if (a.embed) files.claim(element_beside(names.html));
    if (!a.stages.empty()) files.claim_folder(a.stages);
    check_stereo_image(a.stereo_image, files);
    check_usdz(a.usdz, files);
    check_compression(a.compression);
    check_video(a.video, files);
}

/// Lists the files that a run writes, and the programs that open them.
std::string list_of_files(const arguments& a, const photo_files& names) {
    std::string text;
    const auto add = [&](const std::filesystem::path& file, const char* opened_by) {
        if (file.empty() || is_standard(file)) return;
        text += (text.empty() ? "\nwrites " : "writes ") + escaped(file.string()) + opened_by + "\n";
    };
    add(names.html, "   open it in a browser");
    if (a.embed) add(names.poster, ""), add(element_beside(names.html), "   the element that shows the photo in other pages");
    add(names.glb, "   any viewer of glTF shows it: Blender, Windows' 3D Viewer, https://gltf-viewer.donmccurdy.com");
    add(a.usdz, "   Quick Look shows it on iPhones, iPads and Macs");
    add(a.stereo_image, "   a picture for each eye");
    add(a.video.output, "");
    add(a.video.depth_map, "");
    add(a.stages, "   pictures of every stage");
    add(names.report, "");
    return text;
}

/// Prints the table of a run's figures, the list of its files, and notes on the result. Raises file_access, unavailable.
void print_results(const arguments& a, const photo_files& names, const nlohmann::ordered_json& report,
                   const output_files& files) {
    if (a.quiet) return;
    const std::string text = "\n" + to_table(report) + list_of_files(a, names);
    if (files.uses_standard_output())
        std::fputs(text.c_str(), stderr);
    else
        print_text(text);
    for (const std::string note : report["notes"]) say(name_of_input(a.photos.front()) + ": " + note);
}

void run(const arguments& a, output_files& files) {
    const photo_files names = names_of(a);
    check_files(a, names, files);
    stage_clock clock(a.quiet);
    std::optional<viewer_page> viewer;  // read first, to report a missing viewer before the conversion
    if (!names.html.empty()) viewer.emplace(a.viewer);
    const std::vector<std::byte> element = a.embed ? read_element(a.viewer) : std::vector<std::byte>();
    clock.begin("reading files");
    const std::vector<std::byte> photo = read_input(names.photo);
    const map_content map = read_map(names, [](const std::filesystem::path& file) { return read_input(file); });
    const decoding_cost cost(photo, names.depth.empty() ? std::span<const std::byte>() : map.bytes, a, name_of_input(names.photo),
                             name_of_input(names.depth));  // reports invalid headers before networks are loaded
    ldi::thread_pool threads(a.threads);
    std::optional<pages_ahead> pages;
    if (threads.concurrency() > 1)  // photographs need at least 0.37 of this upper bound
        pages.emplace(memory_for(cost, photo.size() + map.bytes.size(), a) / 3);
    const networks loaded = load_networks(a, clock);
    clock.begin("reading photo");
    ldi::photo_with_depth input = decode_input(a, names, photo, map, loaded, threads);
    if (!input.depth) {
        clock.begin("reading depth network");
        loaded.depth.read();
    }
    const converted_photo made = convert(a, input, loaded, clock, threads);
    photo_texture texture = texture_of(made, input, a, threads);
    const encoded_photo3d encoded = encode(made, texture, a, names, clock, threads);

    const nlohmann::ordered_json report = report_on(made, encoded, input, a, clock);
    if (!names.report.empty()) files.write(names.report, to_text(report));
    if (!a.stages.empty()) save_stage_pictures(made, a.stages, files);
    save_video(made, texture, a.video, files, threads);
    save_stereo_image(made, texture, a.stereo_image, a.quality, a.depth_map.kind == ldi::depth_map_kind::meters, files, threads);
    if (!a.usdz.empty()) files.write(a.usdz, encode_usdz(texture.mesh(), encoded.textures.jpeg, encoded.facts));
    if (viewer) files.write(names.html, make_page(*viewer, names, made, encoded, a.embed));
    if (a.embed) {
        files.write(names.poster, encode_poster(made.photo));
        files.write(element_beside(names.html), element);
    }
    if (!names.glb.empty()) files.write(names.glb, encoded.glb);
    print_results(a, names, report, files);  // before the files appear, because a run that fails must not write any
    files.commit();
}

/// Adds --generate, which prints the manual page or a shell's completions. In these texts, paths of the program's data are
/// relative to the program.
void describe_documents(CLI::App& app) {
    app.add_option_function<std::string>(
           "--generate",
           [](const std::string& kind) {
               CLI::App described;
               arguments defaults;
               describe(described, defaults, LDI_DATA_FROM_PROGRAM);
               throw CLI::CallForVersion(document(described, program_version, kind), 0);
           },
           "print the manual page (man), or the completions for a shell (bash, zsh, fish), and exit")
        ->check(one_of({"man", "bash", "zsh", "fish"}));
}

int run_program(int count, char** values) {
    CLI::App app;
    arguments a;
    const std::filesystem::path data = data_folder(values[0]);
    app.formatter(std::make_shared<help_formatter>());
    app.get_formatter()->label("Positionals", "Input");
    try {
        describe(app, a, data);
        describe_documents(app);
        app.footer(app.get_footer() + "\n\nExit codes: " + exit_code_text);
        app.parse(count, values);
        check_effects(app, a);
        apply_preset(app, a);
    } catch (const CLI::CallForHelp&) {
        print_text(app.help());
        return exit_done;
    } catch (const CLI::CallForVersion& e) {  // --version, --generate
        print_text(e.what());
        return exit_done;
    } catch (const CLI::ParseError& e) {
        return say_usage_error(app, e, {values + 1, values + count}, "photo3d");
    }
    if (a.batch) return run_batch(a, data);
    output_files files;
    const interruption signals([&files] { files.files().discard(); });
    try {
        find_weights(a, data);
        run(a, files);
    } catch (...) {
        signals.end_if_signaled();
        return say_failure();
    }
    return exit_done;
}

}  // namespace

int main(int count, char** values) {
    prepare_heap();
    const ldi::memory_scope scope(program_memory());
    spare_memory::reserve();
    prepare_standard_streams();
    try {
        const command_line words(count, values);
        return run_program(words.count(), words.values());
    } catch (...) {
        return say_failure();
    }
}
