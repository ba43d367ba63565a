// Prints what bench/quality measures of silhouettes alone, in under a minute: for the time while they are worked on.
// bench/quality/run.sh --only silhouettes builds and runs it.
#include "silhouette_tables.hpp"
#include "subjects.hpp"

#include <ldi/io/silhouettes_file.hpp>

#include <CLI/CLI.hpp>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace {

using namespace ldi_quality;

void run(const std::filesystem::path& pictures, bool scenes_too, const degradation& how, const std::string& model) {
    ldi::thread_pool threads;
    std::optional<ldi::silhouette_network> network;
    if (!model.empty() && model != "none") network = ldi::load_silhouettes(model);
    std::filesystem::create_directories(pictures);
    std::vector<silhouette_row> all;
    const auto measure_all = [&](const char* title, const std::vector<subject>& subjects) {
        if (subjects.empty()) return;
        std::vector<silhouette_row> rows;
        for (const subject& s : subjects) measure_silhouettes(rows, s, how, network ? &*network : nullptr, pictures, threads);
        print_silhouettes(title, rows);
        all.insert(all.end(), rows.begin(), rows.end());
    };
    measure_all("stereo pairs", stereo_pairs());
    if (scenes_too) measure_all("ray-cast scenes", ray_cast_scenes(threads));
    const silhouette_quality degraded = mean_of(all, "degraded");
    std::printf("\nsilhouettes %.1f px (missed %.1f %%), halo %.1f, stretch %.2f %%, closed %.1f %%\n", degraded.distance.pixels,
                100 * degraded.distance.missed, degraded.halo, 100 * degraded.stretch, 100 * degraded.closed);
}

}  // namespace

int main(int count, char** values) {
    CLI::App app("Measures the silhouettes of 3D photos with true and with degraded depth.");
    std::filesystem::path pictures = "out/quality";
    bool scenes = true;
    degradation how;
    app.add_option("--pictures", pictures, "folder for pictures")->capture_default_str();
    app.add_flag("!--no-scenes", scenes, "no ray-cast scenes");
    app.add_option("--sigma", how.sigma, "blur of the degraded depth, in samples of 384")->capture_default_str();
    app.add_option("--shift", how.shift, "its shift to the right and down, in samples")->capture_default_str();
    std::string model;
    app.add_option("--silhouette-model", model, "weights of the network that decides silhouettes; none: aligned by hand");
    CLI11_PARSE(app, count, values);
    try {
        run(pictures, scenes, how, model);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "ldi_quality_silhouettes: %s\n", e.what());
        return 1;
    }
    return 0;
}
