// Repeats the paper's measurements with paper_options(), and prints them as Markdown beside the paper's figures. Run by
// bench/paper/run.sh.
#include "ablations.hpp"
#include "naive_mesh.hpp"
#include "photos.hpp"

#include <bench/quality/inpainting.hpp>
#include <examples/photo3d/compressed_glb.hpp>
#include <examples/photo3d/report.hpp>

#include <ldi/formats/glb.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/io/weight_files.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <exception>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace {

using namespace ldi_paper;

/// Milliseconds in the paper's table, section "Performance".
constexpr std::pair<const char*, int> paper_times[] = {
    {"depth estimation", 230}, {"depth filter", 51},     {"connected components", 12}, {"occluded geometry", 31},
    {"color inpainting", 540}, {"chart generation", 72}, {"chart padding", 151},       {"meshing", 11}};

double kilobytes(std::size_t bytes) { return 1e-3 * static_cast<double>(bytes); }

/// Processor time of all threads, in milliseconds.
double milliseconds() { return 1e3 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// Prints the mean over the photos of each stage's median of `runs` runs.
std::vector<ldi::photo3d> print_times(const std::vector<paper_photo>& photos, const ldi::tiefenrausch* network,
                                      const ldi::farbrausch& inpainter, int runs) {
    std::vector<ldi::photo3d> results;
    std::map<std::string, double> means;
    for (const paper_photo& p : photos) {
        std::map<std::string, std::vector<double>> times;
        ldi::photo3d made;
        for (int run = 0; run < runs; ++run) {
            ldi::examples::stage_clock clock(true);
            ldi::photo3d_options options = paper_options_for(p);
            options.progress = clock.listener();
            made = network == nullptr ? ldi::make_photo3d(p.photo, p.depth, inpainter, options)
                                      : ldi::make_photo3d(p.photo, *network, inpainter, options);
            clock.finish();
            for (const ldi::examples::stage_time& t : clock.stages()) times[t.stage].push_back(t.processor);
        }
        for (auto& [stage, values] : times) {
            std::sort(values.begin(), values.end());
            means[stage] += values[values.size() / 2] / static_cast<double>(photos.size());
        }
        results.push_back(std::move(made));
    }
    std::printf(
        "\n### Stages (the paper's table in \"Performance\": iPhone 11 Pro), processor time of one thread\n\n"
        "| stage | paper, ms | here, ms |\n|---|---|---|\n");
    double sum = 0;
    for (const auto& [stage, paper] : paper_times) {
        const bool is_known = network != nullptr || stage != paper_times[0].first;
        std::printf(is_known ? "| %s | %d | %.1f |\n" : "| %s | %d | |\n", stage, paper, means[stage]);
        sum += means[stage];
    }
    std::printf("| **total** | 1098 | %.0f |\n", sum);
    return results;
}

void print_sizes(const std::vector<paper_photo>& photos, const std::vector<ldi::photo3d>& results) {
    std::printf(
        "\n### Sizes (the paper, \"Performance\": \"typically around 300-500kb\" for the textured mesh of such a photo)\n\n"
        "| photo | GLB, kB | texture, kB | mesh, kB | with meshopt compression, kB | triangles | charts | atlas | hidden pixels "
        "|\n"
        "|---|---|---|---|---|---|---|---|---|\n");
    for (std::size_t i = 0; i < photos.size(); ++i) {
        const ldi::photo3d& made = results[i];
        const std::vector<std::byte> jpeg = ldi::encode_jpeg(made.atlas.color);
        const ldi::buffer<std::byte> glb = ldi::encode_glb(made.mesh, jpeg);
        std::printf("| %s | %.0f | %.0f | %.0f | %.0f | %zu | %zu | %zu x %zu | %.1f %% |\n", photos[i].name.c_str(),
                    kilobytes(glb.size()), kilobytes(jpeg.size()), kilobytes(glb.size() - jpeg.size()),
                    kilobytes(ldi::examples::compress_glb(glb).size()), made.mesh.triangle_count(), made.charts.charts.size(),
                    made.atlas.color.width(), made.atlas.color.height(),
                    100.0 * static_cast<double>(made.layers.size()) / static_cast<double>(made.disparity.size()) - 100);
    }
}

/// Mean absolute error, 0 to 255, that JPEG causes in the charts' texels within 8 texels of padding.
double error_beside_padding(const ldi::texture_atlas& atlas, const std::vector<std::byte>& jpeg) {
    const picture decoded = ldi::decode_photo(jpeg).color;
    const auto is_own = [&](std::size_t y, std::size_t x) {
        return atlas.kind(y, x) >= ldi::texel_kind::photo && atlas.kind(y, x) <= ldi::texel_kind::occluded;
    };
    double sum = 0, count = 0;
    for (std::size_t y = 8; y + 8 < atlas.kind.height(); ++y)
        for (std::size_t x = 8; x + 8 < atlas.kind.width(); ++x)
            if (is_own(y, x) && !(is_own(y - 8, x) && is_own(y + 8, x) && is_own(y, x - 8) && is_own(y, x + 8)))
                for (std::size_t c = 0; c < 3; ++c) sum += std::abs(decoded(y, x, c) - atlas.color(y, x, c)), ++count;
    return sum / std::max(count, 1.0);
}

void print_macroblocks(const std::vector<paper_photo>& photos, const std::vector<ldi::photo3d>& results) {
    std::printf(
        "\n### Macroblock padding (the paper, \"Macroblock padding\": the texture is \"almost 40%%\" smaller than with a solid "
        "color)\n\n| photo | padded, kB | solid gray, kB | saved | solid black, kB | saved | error beside padding: padded | gray "
        "| black |\n|---|---|---|---|---|---|---|---|---|\n");
    for (std::size_t i = 0; i < photos.size(); ++i) {
        ldi::texture_atlas atlas = results[i].atlas;
        const std::vector<std::byte> padded = ldi::encode_jpeg(atlas.color);
        std::printf("| %s | %.0f |", photos[i].name.c_str(), kilobytes(padded.size()));
        double errors[3] = {error_beside_padding(atlas, padded)};
        for (const int black : {0, 1}) {
            remove_padding(atlas, true, black != 0 ? 0 : 128);
            const std::vector<std::byte> solid = ldi::encode_jpeg(atlas.color);
            errors[black + 1] = error_beside_padding(atlas, solid);
            std::printf(" %.0f | %.0f %% |", kilobytes(solid.size()),
                        100 - 100 * kilobytes(padded.size()) / kilobytes(solid.size()));
        }
        std::printf(" %.2f | %.2f | %.2f |\n", errors[0], errors[1], errors[2]);
    }
}

void print_meshes(const std::vector<paper_photo>& photos, const std::vector<ldi::photo3d>& results) {
    std::printf(
        "\n### The flat mesher beside the mesh of all pixels, simplified with meshoptimizer (the paper, \"Meshing\": no "
        "figures)\n\n"
        "| photo | mesher | triangles | ms | GLB without texture, kB | compressed, kB | RMS of disparity | wrong surface | not "
        "covered |\n|---|---|---|---|---|---|---|---|---|\n");
    for (std::size_t i = 0; i < photos.size(); ++i) {
        const ldi::photo3d& made = results[i];
        const std::vector<std::byte> jpeg = ldi::encode_jpeg(picture(16, 16, 3));
        const auto row = [&](const char* mesher, const ldi::textured_mesh& mesh, double time) {
            const ldi::buffer<std::byte> glb = ldi::encode_glb(mesh, jpeg);
            const mesh_error e = error_of(mesh, made);
            std::printf("| %s | %s | %zu | %.0f | %.0f | %.0f | %.5f | %.3f %% | %.3f %% |\n", photos[i].name.c_str(), mesher,
                        mesh.triangle_count(), time, kilobytes(glb.size() - jpeg.size()),
                        kilobytes(ldi::examples::compress_glb(glb).size() - jpeg.size()), e.rms, 100 * e.wrong, 100 * e.outside);
        };
        double start = milliseconds();
        const ldi::textured_mesh flat =
            ldi::build_mesh(made.layers, made.facts, made.charts, made.atlas, paper_options_for(photos[i]).mesh);
        row("flat", flat, milliseconds() - start);
        start = milliseconds();
        const ldi::textured_mesh dense = mesh_of_all_pixels(made);
        const double dense_time = milliseconds() - start;
        if (i == 0) row("all pixels", dense, dense_time);
        start = milliseconds();
        const ldi::textured_mesh naive = simplified(dense, made, flat.triangle_count());
        row("simplified", naive, dense_time + milliseconds() - start);
        std::fflush(stdout);
    }
}

void print_networks(const std::filesystem::path& models) {
    std::printf("\n### Networks\n\n| network | paper | here |\n|---|---|---|\n");
    const auto count = [&](const char* file) {
        std::size_t values = 0;
        for (const auto& [name, tensor] : ldi::load_safetensors(models / file).tensors)
            values += std::visit([](const auto& all) { return all.size(); }, tensor.values);
        return 1e-6 * static_cast<double>(values);
    };
    std::printf("| Tiefenrausch: parameters (Table \"depth_eval\") | 3.5 M | tiefenrausch_small: %.2f M, %.0f kB |\n",
                count("tiefenrausch_small.safetensors"),
                kilobytes(std::filesystem::file_size(models / "tiefenrausch_small.safetensors")));
    std::printf("| Farbrausch: parameters (Table \"inpaint_eval\") | 0.37 M, 1.9 MiB | %.2f M, %.0f kB |\n",
                count("farbrausch.safetensors"), kilobytes(std::filesystem::file_size(models / "farbrausch.safetensors")));
}

struct arguments {
    std::filesystem::path pictures = "build/paper";
    std::string only;
    int runs = 5;
    std::size_t photos = 7;
};

void run(const arguments& a) {
#if defined(__GLIBC__)
    mallopt(M_MMAP_THRESHOLD, 1 << 30);  // as in photo3d: keeps freed memory, so that times do not include new pages
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
#endif
    const auto wants = [&](const char* part) { return a.only.empty() || a.only == part; };
    const std::filesystem::path models = LDI_SOURCE_DIR "/examples/models";
    const ldi::farbrausch inpainter = ldi::load_farbrausch(models / "farbrausch.safetensors", ldi::arithmetic::int8);
    std::filesystem::create_directories(a.pictures);
    ldi::thread_pool threads;
    std::vector<ldi_quality::named_network> networks = ldi_quality::depth_networks();
    std::vector<paper_photo> photos = six_photos(networks.back(), threads);
    const bool is_alone = photos.empty();
    std::printf("Instruction set: %s.\n", std::string(ldi::to_string(ldi::best_isa())).c_str());
    if (wants("stages"))
        for (const auto& [name, network] : networks) {
            std::printf("\n## Depth: %s\n", is_alone ? "the sample's" : name.c_str());
            std::vector<paper_photo> shown = photos;
            if (is_alone) shown.push_back(sample_photo());
            std::vector<ldi::photo3d> results = print_times(shown, is_alone ? nullptr : &network, inpainter, a.runs);
            if (!is_alone) {
                shown.push_back(sample_photo());
                results.push_back(
                    ldi::make_photo3d(shown.back().photo, shown.back().depth, inpainter, paper_options_for(shown.back())));
            }
            print_sizes(shown, results), print_macroblocks(shown, results), print_meshes(shown, results);
            if (is_alone) break;
        }
    photos.push_back(sample_photo());
    if (wants("ablations")) {
        photos.erase(photos.begin(), photos.end() - static_cast<std::ptrdiff_t>(std::min(photos.size(), a.photos)));
        print_ablations(photos, a.pictures, threads);
    }
    if (wants("networks")) {
        print_networks(models);
        ldi_quality::print_depth(networks, false, threads);
        std::vector<ldi_quality::inpainting_result> rows;
        for (const auto& subjects : {ldi_quality::stereo_pairs(), ldi_quality::ray_cast_scenes(threads)})
            for (const ldi_quality::subject& s : subjects)
                for (const float side : {0.08F, -0.08F}) {
                    const float shift = side * static_cast<float>(std::max(s.camera.width, s.camera.height));
                    rows.push_back(ldi_quality::measure_inpainting(s, shift, inpainter, {}, a.pictures, threads));
                    if (!(rows.back().inpainted_share > 0)) rows.pop_back();
                }
        ldi_quality::print_inpainting("pairs and scenes", rows);
    }
}

}  // namespace

int main(int count, char** values) {
    CLI::App app("Repeats the paper's measurements.");
    arguments a;
    app.add_option("--pictures", a.pictures, "folder for pictures")->capture_default_str();
    app.add_option("--only", a.only, "run only this part")->check(CLI::IsMember({"stages", "ablations", "networks"}));
    app.add_option("--runs", a.runs, "runs per photo")->check(CLI::Range(1, 1000))->capture_default_str();
    app.add_option("--photos", a.photos, "number of photos for ablations, including the sample")->check(CLI::Range(1, 7));
    CLI11_PARSE(app, count, values);
    try {
        run(a);
    } catch (const std::exception& e) {
        std::fprintf(stderr, "ldi_paper: %s\n", e.what());
        return 1;
    }
    return 0;
}
