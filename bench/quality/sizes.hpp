// Cost of a 3D photo: bytes and triangles of the result, time and memory of the conversion.
#pragma once

#include "converter.hpp"

#include <examples/photo3d/report.hpp>

#include <ldi/formats/glb.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/io/weight_files.hpp>
#include <ldi/networks/farbrausch.hpp>
#include <ldi/photo3d.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

namespace ldi_quality {

/// Peak memory of the process in each stage, in MiB. Empty if Linux does not let the process reset its peak.
class stage_memory {
public:
    ldi::progress_listener listener() {
        ldi::progress_listener o;
        o.user = this;
        o.on_progress = [](void* self, std::string_view stage, float fraction) {
            static_cast<stage_memory*>(self)->on_progress(std::string(stage), fraction);
        };
        return o;
    }
    const std::map<std::string, std::size_t>& megabytes() const { return peaks_; }

private:
    void on_progress(const std::string& stage, float fraction) {
        if (stage != stage_) {
            stage_ = stage;
            std::ofstream reset("/proc/self/clear_refs");
            can_reset_ = static_cast<bool>(reset << "5" << std::flush);
        }
        if (fraction == 1.0F && can_reset_) peaks_[stage] = std::max(peaks_[stage], peak());
    }

    static std::size_t peak() {
        std::ifstream status("/proc/self/status");
        for (std::string line; std::getline(status, line);)
            if (line.compare(0, 6, "VmHWM:") == 0) return std::stoul(line.substr(6)) / 1024;
        return 0;
    }

    std::string stage_;
    bool can_reset_ = false;
    std::map<std::string, std::size_t> peaks_;
};

struct sized_photo {
    std::filesystem::path photo, depth;  ///< depth: empty for the published network's depth
};

/// The sample, and phone photos with the published network's depth if ../shared is present.
inline std::vector<sized_photo> sized_photos() {
    const std::filesystem::path sample = std::filesystem::path(LDI_SOURCE_DIR) / "examples/photo3d";
    const std::filesystem::path shared = LDI_SHARED_DIR;
    std::vector<sized_photo> result{{sample / "sample.jpg", sample / "sample_depth.png"}};
    if (std::filesystem::exists(shared / "tiefenrausch/model"))
        for (const char* name : {"iphone_mpo_a.jpg", "pair_flowers.jpg", "pair_mango.jpg", "pair_shelf.jpg"})
            if (std::filesystem::exists(shared / "depth_companions" / name))
                result.push_back({shared / "depth_companions" / name, {}});
    return result;
}

template <ldi::color_inpainter Inpainter>
ldi::photo3d convert(const sized_photo& p, const converter& convert_photo, const Inpainter& inpainter,
                     const ldi::progress_listener& progress) {
    const ldi::serial_executor one_thread;
    const ldi::image<std::uint8_t> photo = ldi::load_photo(p.photo).color;
    ldi::photo3d_options options;
    options.progress = progress;
    if (p.depth.empty()) {
        const ldi::tiefenrausch network = ldi::load_tiefenrausch(std::filesystem::path(LDI_SHARED_DIR) / "tiefenrausch/model");
        return convert_photo(photo, network, inpainter, options, one_thread);
    }
    options.normalize.is_inverse_depth = false;
    const ldi::given_disparity depth{ldi::fill_invalid(ldi::load_depth_map(p.depth))};
    return convert_photo(photo, depth, inpainter, options, one_thread);
}

/// Requires a fresh process: memory is measured only while freed memory returns to the system.
template <ldi::color_inpainter Inpainter>
void print_sizes(const converter& convert_photo, const Inpainter& inpainter) {
    const std::vector<sized_photo> photos = sized_photos();
    std::printf(
        "\n### Size\n\n| photo | size | GLB, kB | texture, kB | triangles | charts | atlas | filled |\n"
        "|---|---|---|---|---|---|---|---|\n");
    stage_memory memory, not_asked_for;
    // Measures time and memory of one photo at 1152 x 1536: the first phone photo, else the sample.
    const sized_photo& measured = photos[std::min<std::size_t>(1, photos.size() - 1)];
    for (const sized_photo& p : photos) {
        const ldi::photo3d made = convert(p, convert_photo, inpainter, (&p == &measured ? memory : not_asked_for).listener());
        const std::vector<std::byte> jpeg = ldi::encode_jpeg(made.atlas.color, 85);
        ldi::glb_options options;
        options.camera = made.facts.camera;
        std::printf("| %s | %d x %d | %zu | %zu | %zu | %zu | %zu x %zu | %.0f %% |\n", p.photo.filename().c_str(),
                    made.facts.camera.width, made.facts.camera.height, ldi::encode_glb(made.mesh, jpeg, options).size() / 1000,
                    jpeg.size() / 1000, made.mesh.triangle_count(), made.charts.charts.size(), made.atlas.color.width(),
                    made.atlas.color.height(), 100.0 * static_cast<double>(made.atlas.fill));
    }
#if defined(__GLIBC__)
    // Same settings as in the program: keeps freed memory, so that times do not include what the system needs for new pages.
    mallopt(M_MMAP_THRESHOLD, 1 << 30);
    mallopt(M_TRIM_THRESHOLD, 1 << 30);
#endif
    std::map<std::string, ldi::buffer<double>> times;
    std::vector<std::string> order;
    for (int round = 0; round < 9; ++round) {
        ldi::examples::stage_clock clock(true);
        convert(measured, convert_photo, inpainter, clock.listener());
        clock.finish();
        for (const ldi::examples::stage_time& time : clock.stages()) {
            if (times.count(time.stage) == 0) order.push_back(time.stage);
            times[time.stage].push_back(time.elapsed);
        }
    }
    std::printf(
        "\n### Time and memory of %s, one thread\n\n| stage | median, ms | minimum, ms | peak of the process, MiB |\n"
        "|---|---|---|---|\n",
        measured.photo.filename().c_str());
    for (const std::string& stage : order) {
        ldi::buffer<double>& t = times[stage];
        std::sort(t.begin(), t.end());
        const auto peak = memory.megabytes().find(stage);
        const std::string most = peak == memory.megabytes().end() ? "unknown" : std::to_string(peak->second);
        std::printf("| %s | %.1f | %.1f | %s |\n", stage.c_str(), t[t.size() / 2], t[0], most.c_str());
    }
}

}  // namespace ldi_quality
