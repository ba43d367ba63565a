// Prints the quality of 3D photos as Markdown, and a last line with the main figures. Run by bench/quality/run.sh.
#include "converter.hpp"
#include "depth.hpp"
#include "estimated_views.hpp"
#include "inpainting.hpp"
#include "novel_views.hpp"
#include "photographs.hpp"
#include "silhouette_tables.hpp"
#include "sizes.hpp"
#include "subjects.hpp"

#include <ldi/io/weight_files.hpp>

#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <utility>
#include <vector>

namespace {

using namespace ldi_quality;

struct arguments {
    std::filesystem::path inpainting_model, lpips, pictures = "out/quality";
    bool views = true, depth = true, each_depth = false, sizes = true, int8 = false;
};

/// Returns a description of the network's training, from the metadata of its file.
std::string training_of(const std::filesystem::path& file) {
    const ldi::named_tensors tensors = ldi::load_safetensors(file);
    const auto found = tensors.metadata.find("provenance");
    const nlohmann::json text =
        found == tensors.metadata.end() ? nlohmann::json() : nlohmann::json::parse(found->second, nullptr, false);
    if (!text.is_object() || !text.contains("steps") || !text.contains("processor_hours")) return "of unknown training";
    return "trained for " + text["steps"].dump() + " steps, " + text["processor_hours"].dump() + " hours of one processor";
}

void run(const arguments& a, const converter& convert) {
    const ldi::farbrausch network =
        ldi::load_farbrausch(a.inpainting_model, a.int8 ? ldi::arithmetic::int8 : ldi::arithmetic::float32);
    std::printf("Farbrausch: %s, %s\n", a.inpainting_model.filename().string().c_str(), training_of(a.inpainting_model).c_str());
    if (a.sizes) print_sizes(convert, network);
    lpips_network perceived;
    if (a.lpips.empty())
        std::printf("LPIPS is not measured (nan), because --lpips names no weights\n");
    else
        perceived = lpips_network(ldi::load_safetensors(a.lpips));
    ldi::thread_pool threads;
    std::filesystem::create_directories(a.pictures);
    const std::vector<subject> pairs = stereo_pairs();
    if (a.depth) {
        const std::vector<named_network> networks = depth_networks();
        print_depth(networks, a.each_depth, threads);
        std::vector<estimated_view> views;
        std::vector<silhouette_row> silhouettes;
        for (const subject& s : pairs) {
            views.push_back(measure_estimated_view(s, networks, convert, network, perceived, a.pictures, threads));
            for (const auto& [name, depth] : networks)
                silhouettes.push_back(
                    measure_silhouettes(s, name, aligned_estimate(depth.disparity(s.photo, {}, threads), s.inverse_depth),
                                        convert, a.pictures, threads));
        }
        if (!views.empty())
            print_estimated_views(networks, views), print_silhouettes("stereo pairs, estimated depth", silhouettes);
        print_photographs(networks, convert, a.pictures, threads);
    }
    if (!a.views) return;

    const std::vector<subject> scenes = ray_cast_scenes(threads);
    std::vector<novel_view> all_views;
    std::vector<inpainting_result> all_inpainting;
    std::vector<silhouette_row> all_silhouettes;
    for (const auto& [title, subjects] : {std::pair{"stereo pairs", &pairs}, {"ray-cast scenes", &scenes}}) {
        if (subjects->empty()) continue;
        std::vector<novel_view> views;
        std::vector<inpainting_result> inpainting;
        std::vector<silhouette_row> silhouettes;
        for (const subject& s : *subjects) {
            views.push_back(measure_novel_view(s, convert, network, perceived, a.pictures, threads));
            measure_silhouettes(silhouettes, s, {}, convert, a.pictures, threads);
            const float longer = static_cast<float>(std::max(s.camera.width, s.camera.height));
            for (const float side : {1.0F, -1.0F}) {
                const inpainting_result r = measure_inpainting(s, side * 0.08F * longer, network, perceived, a.pictures, threads);
                if (r.inpainted_share > 0) inpainting.push_back(r);  // from one side of the T-junction, everything is visible
            }
        }
        print_novel_views(title, views);
        print_silhouettes(title, silhouettes);
        print_inpainting(title, inpainting);
        std::fflush(stdout);
        all_views.insert(all_views.end(), views.begin(), views.end());
        all_inpainting.insert(all_inpainting.end(), inpainting.begin(), inpainting.end());
        all_silhouettes.insert(all_silhouettes.end(), silhouettes.begin(), silhouettes.end());
    }
    double uncovered = 0;
    for (const novel_view& v : all_views)
        uncovered = std::max(uncovered, 100 * std::max(v.worst.uncovered, v.worst_degraded.uncovered));
    const novel_view average = mean_of(all_views);
    const silhouette_quality degraded = mean_of(all_silhouettes, "degraded");
    std::printf(
        "\nldi over screen space %+.2f dB, uncovered %.3f %%, lpips %.3f (diffusion %.3f), silhouettes %.1f px, halo %.1f\n",
        lead(all_inpainting), uncovered, average.inside[with_texture].lpips, average.inside[by_diffusion].lpips,
        degraded.distance.pixels, degraded.halo);
}

}  // namespace

int main(int count, char** values) {
    CLI::App app("Measures 3D photos: depth, novel views, inpainting, sizes, times.");
    arguments a;
    app.add_option("--inpainting-model", a.inpainting_model, "weights (safetensors)")->required();
    app.add_flag("--int8", a.int8, "run the inpainting network in 8 bits");
    app.add_option("--lpips", a.lpips, "weights of LPIPS (safetensors)");
    app.add_option("--pictures", a.pictures, "folder for pictures")->capture_default_str();
    app.add_flag("!--no-views", a.views, "skip novel views and inpainting");
    app.add_flag("!--no-depth", a.depth, "skip the depth networks");
    app.add_flag("--each-depth", a.each_depth, "also print the depth networks' figures for every photograph");
    app.add_flag("!--no-sizes", a.sizes, "skip sizes and times");
    const silhouette_option silhouettes(app);
    CLI11_PARSE(app, count, values);
    try {
        run(a, converter(silhouettes.load()));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "ldi_quality: %s\n", e.what());
        return 1;
    }
    return 0;
}
