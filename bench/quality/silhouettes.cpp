// Prints only the measures of silhouettes, and the faults beside silhouettes of photographs without true depth. Run by
// bench/quality/run.sh --only silhouettes.
#include "silhouette_tables.hpp"
#include "silhouettes_in_photographs.hpp"
#include "subjects.hpp"

#include <ldi/io/weight_files.hpp>

#include <CLI/CLI.hpp>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

namespace {

using namespace ldi_quality;

void run(const std::filesystem::path& pictures, bool scenes_too, const degradation& how, const converter& convert,
         ldi::thread_pool& threads) {
    std::vector<silhouette_row> all;
    const auto measure_all = [&](const char* title, const std::vector<subject>& subjects) {
        if (subjects.empty()) return;
        std::vector<silhouette_row> rows;
        for (const subject& s : subjects) measure_silhouettes(rows, s, how, convert, pictures, threads);
        print_silhouettes(title, rows);
        all.insert(all.end(), rows.begin(), rows.end());
    };
    measure_all("stereo pairs", stereo_pairs());
    if (scenes_too) measure_all("ray-cast scenes", ray_cast_scenes(threads));
    const silhouette_quality degraded = mean_of(all, "degraded");
    std::printf("\nsilhouettes %.1f px (missed %.1f %%), halo %.1f, stretch %.2f %%, closed %.1f %%\n", degraded.distance.pixels,
                100 * degraded.distance.missed, degraded.halo, 100 * degraded.stretch, 100 * degraded.closed);
    std::fflush(stdout);
}

}  // namespace

int main(int count, char** values) {
    CLI::App app("Measures the silhouettes of 3D photos with true and with degraded depth.");
    std::filesystem::path pictures = "out/quality";
    bool pairs = true, scenes = true, photographs = true;
    degradation how;
    photograph_options of_photographs;
    app.add_option("--pictures", pictures, "folder for pictures")->capture_default_str();
    app.add_flag("!--no-scenes", scenes, "skip the ray-cast scenes");
    app.add_flag("!--no-pairs", pairs, "skip the pairs and scenes with true depth");
    app.add_flag("!--no-photographs", photographs, "skip the photographs without true depth");
    app.add_flag("!--no-holes", of_photographs.counts_holes, "do not count holes in the photographs");
    app.add_option("--before", of_photographs.before, "folder of an earlier run's worst_places: writes both side by side");
    app.add_option("--sigma", how.sigma, "blur of the degraded depth, in samples of 384")->capture_default_str();
    app.add_option("--shift", how.shift, "shift of the degraded depth to the right and down, in samples")->capture_default_str();
    const silhouette_option silhouettes(app);
    CLI11_PARSE(app, count, values);
    try {
        ldi::thread_pool threads;
        const converter convert(silhouettes.load());
        std::filesystem::create_directories(pictures);
        if (pairs) run(pictures, scenes, how, convert, threads);
        const std::filesystem::path models = LDI_SOURCE_DIR "/examples/models";
        if (photographs)
            measure_photographs(ldi::load_depth_network(models / "tiefenrausch_small.safetensors"), convert,
                                ldi::load_farbrausch(models / "farbrausch.safetensors"), pictures, of_photographs, threads);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "ldi_quality_silhouettes: %s\n", e.what());
        return 1;
    }
    return 0;
}
