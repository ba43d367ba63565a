// Prints the holes in 3D photos of ordinary photographs, from 104 positions at and inside the limits of the camera's motion. Run
// by bench/quality/run.sh --only holes.
#include "holes.hpp"
#include "converter.hpp"

#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/io/weight_files.hpp>

#include <CLI/CLI.hpp>

#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

namespace {

using namespace ldi_quality;
using picture = ldi::image<std::uint8_t>;

struct arguments {
    std::vector<std::filesystem::path> photos;
    std::filesystem::path crops, models = LDI_SOURCE_DIR "/examples/models";
    std::int32_t picture_side = 1000;
    std::size_t geometry_size = ldi::photo3d_options().long_side, max_crops = 3;
    float motion = ldi::expand_options().motion;
    bool soft_edges = true, crops_frame = false, prints_holes = false;
};

/// Crops the pixels around a hole, enlarged fourfold, over magenta.
picture crop_of(const ldi::photo3d& made, const ldi::view& from, const hole& h) {
    ldi::raster_options raster;
    raster.z_near = 1e-3F * made.facts.range.z_near;
    raster.background = {255, 0, 255};
    const picture seen = ldi::rasterize(made.mesh, made.atlas.color, from, raster).color;
    constexpr std::int32_t side = 120, times = 4;
    picture result(side * times, side * times, 3);
    for (std::int32_t y = 0; y < side * times; ++y)
        for (std::int32_t x = 0; x < side * times; ++x) {
            const std::int32_t u = std::clamp(h.x + (x / times) - side / 2, 0, from.camera.width - 1);
            const std::int32_t v = std::clamp(h.y + (y / times) - side / 2, 0, from.camera.height - 1);
            std::copy_n(seen.row(static_cast<std::size_t>(v)) + 3 * u, 3, result.row(static_cast<std::size_t>(y)) + 3 * x);
        }
    return result;
}

/// Converts a photo with the depth map beside it, such as NAME_depth.png, or with the network's depth.
ldi::photo3d make(const std::filesystem::path& file, const ldi::tiefenrausch& network, const converter& convert,
                  const ldi::farbrausch& inpainter, const ldi::photo3d_options& options, ldi::thread_pool& threads) {
    const picture photo = ldi::load_photo(file).color;
    for (const char* const ending : {"_depth.png", "_depth.npy", "_depth.pfm"}) {
        const std::filesystem::path depth = file.parent_path() / (file.stem().string() + ending);
        if (!std::filesystem::exists(depth)) continue;
        ldi::photo3d_options without_unit = options;
        without_unit.normalize.is_inverse_depth = false;
        return convert(photo, ldi::given_disparity{ldi::load_depth_map(depth)}, inpainter, without_unit, threads);
    }
    return convert(photo, network, inpainter, options, threads);
}

void run(const arguments& a, const converter& convert) {
    const ldi::tiefenrausch network = ldi::load_depth_network(a.models / "tiefenrausch_small.safetensors");
    const ldi::farbrausch inpainter = ldi::load_farbrausch(a.models / "farbrausch.safetensors");
    ldi::thread_pool threads;
    ldi::photo3d_options options;
    options.long_side = a.geometry_size;
    options.expand.motion = a.motion;
    if (a.crops_frame) options.frame = ldi::photo_frame::crop;
    if (!a.soft_edges) options.mesh.soft_edges.min_width = 0;
    std::printf(
        "| photo | views with holes | uncovered pixels, worst view | largest hole | holes | triangles | hidden pixels | ms |\n"
        "|---|---|---|---|---|---|---|---|\n");
    const std::vector<std::filesystem::path> photos = a.photos.empty() ? forty_photographs() : a.photos;
    std::size_t photos_with_holes = 0, views_with_holes = 0, views = 0, triangles = 0;
    std::int64_t largest = 0, most = 0;
    for (const std::filesystem::path& file : photos) {
        const auto start = std::chrono::steady_clock::now();
        const ldi::photo3d made = make(file, network, convert, inpainter, options, threads);
        const double ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
        const hole_report r = count_holes(made.mesh, made.facts, a.picture_side, threads);
        const std::int64_t largest_here = r.holes.empty() ? 0 : r.holes.front().pixels;
        std::printf("| %s | %zu of %zu | %lld | %lld | %zu | %zu | %zu | %.0f |\n", file.filename().c_str(), r.views_with_holes,
                    r.views, static_cast<long long>(r.max_pixels), static_cast<long long>(largest_here), r.holes.size(),
                    made.mesh.triangle_count(), made.layers.size() - made.photo.size() / 3, ms);
        const std::vector<named_view> from = allowed_views(made.facts, a.picture_side);
        for (std::size_t i = 0; i < r.holes.size() && (a.prints_holes || i < a.max_crops); ++i) {
            const hole& h = r.holes[i];
            if (a.prints_holes)
                std::printf("    %lld pixels at (%d, %d), camera at %s\n", static_cast<long long>(h.pixels), h.x, h.y,
                            from[h.view].name.c_str());
            if (!a.crops.empty() && i < a.max_crops)
                ldi::save_png(a.crops / (file.stem().string() + "_" + std::to_string(i) + ".png"),
                              crop_of(made, from[h.view].from, h));
        }
        std::fflush(stdout);
        photos_with_holes += r.holes.empty() ? 0U : 1U, views_with_holes += r.views_with_holes, views += r.views;
        largest = std::max(largest, largest_here), most = std::max(most, r.max_pixels), triangles += made.mesh.triangle_count();
    }
    std::printf("\nholes in %zu of %zu photographs (%zu of %zu views), largest %lld px, worst view %lld px, %zu triangles\n",
                photos_with_holes, photos.size(), views_with_holes, views, static_cast<long long>(largest),
                static_cast<long long>(most), triangles);
}

}  // namespace

int main(int count, char** values) {
    CLI::App app("Counts the holes of 3D photos from positions at and inside the limits of the camera's motion.");
    arguments a;
    app.add_option("photos", a.photos, "photographs; default: forty of ../shared/photos");
    const silhouette_option silhouettes(app);
    app.add_option("--crops", a.crops, "folder for pictures of the largest holes, enlarged four times");
    app.add_option("--most-crops", a.max_crops, "maximum number of crops per photo")->capture_default_str();
    app.add_option("--side", a.picture_side, "long side of the pictures that are counted, in pixels")->capture_default_str();
    app.add_option("--geometry-size", a.geometry_size, "long side of the layered image in pixels, as in photo3d")
        ->capture_default_str();
    app.add_option("--motion", a.motion, "maximum motion of the camera, as in photo3d")->capture_default_str();
    app.add_flag("!--no-soft-edges", a.soft_edges, "draw hard silhouettes, as in photo3d");
    app.add_flag("--crop-frame", a.crops_frame, "surfaces end at the photo's border (photo3d --frame crop)");
    app.add_flag("--each", a.prints_holes, "also prints every hole");
    CLI11_PARSE(app, count, values);
    try {
        if (!a.crops.empty()) std::filesystem::create_directories(a.crops);
        run(a, converter(silhouettes.load()));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "ldi_quality_holes: %s\n", e.what());
        return 1;
    }
    return 0;
}
