// Quality of the depth networks on photographs with measured depth, none of which was used for training.
#pragma once

#include "depth_metrics.hpp"
#include "estimated_views.hpp"
#include "metrics.hpp"

#include <ldi/base/executor.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/io/file.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/io/weight_files.hpp>

#include <nlohmann/json.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ldi_quality {

struct rgbd_pair {
    std::string name;
    picture photo;
    ldi::image<float> disparity;  ///< H x W x 1, up to scale; NaN where unknown
};

/// Lists the pairs in ../shared/rgbd/manifest.json; empty if it is missing.
inline std::vector<rgbd_pair> rgbd_pairs() {
    const std::filesystem::path folder = std::filesystem::path(LDI_SHARED_DIR) / "rgbd", list = folder / "manifest.json";
    std::vector<rgbd_pair> result;
    if (!std::filesystem::exists(list)) {
        std::printf("\nDepth is not measured: there is no %s\n", list.c_str());
        return result;
    }
    const std::vector<std::byte> bytes = ldi::read_file(list);
    const char* const text = reinterpret_cast<const char*>(bytes.data());
    for (const nlohmann::json& entry : nlohmann::json::parse(text, text + bytes.size())) {
        ldi::depth_map_options options;
        options.invalid_zero = true;
        options.scale = 1.0F / entry["scale"].get<float>();
        if (entry["kind"] == "depth") options.kind = ldi::depth_map_kind::meters;
        rgbd_pair p;
        p.name = entry["name"];
        p.photo = ldi::load_photo(folder / entry["image"].get<std::string>()).color;
        p.disparity = ldi::load_depth_map(folder / entry["map"].get<std::string>(), options);
        // `note` states the offset that cropping removed: "inverse depth is proportional to disparity + 66.7".
        const std::string note = entry["note"], before = "disparity + ";
        const std::size_t found = note.find(before);
        if (options.kind == ldi::depth_map_kind::disparity && found != std::string::npos) {
            const float cropped = std::strtof(note.c_str() + found + before.size(), nullptr);  // 0 if unknown
            for (float& d : p.disparity) d += cropped;
        }
        result.push_back(std::move(p));
    }
    return result;
}

/// Mean of a measure over the pairs that have it.
template <class Measure>
double mean_of(const std::vector<depth_quality>& all, Measure measure) {
    ldi::buffer<double> values;
    for (const depth_quality& q : all)
        if (!std::isnan(q.*measure)) values.push_back(q.*measure);
    return values.empty() ? unmeasured : mean(values);
}

inline void print_row(const std::string& name, const std::vector<depth_quality>& measured) {
    std::printf("| %s |", name.c_str());
    for (double depth_quality::*const measure :
         {&depth_quality::delta, &depth_quality::abs_rel, &depth_quality::rmse, &depth_quality::edges, &depth_quality::boundaries,
          &depth_quality::silhouettes, &depth_quality::order})
        std::printf(" %.3f |", mean_of(measured, measure));
    std::printf("\n");
}

/// Loads the published network and tiefenrausch_small, if their files are present.
inline std::vector<named_network> depth_networks() {
    std::vector<named_network> result;
    for (const auto& [name, path] : {std::pair<const char*, std::filesystem::path>{
                                         "Tiefenrausch, published", std::filesystem::path(LDI_SHARED_DIR) / "tiefenrausch/model"},
                                     {"tiefenrausch_small", LDI_SOURCE_DIR "/examples/models/tiefenrausch_small.safetensors"}}) {
        if (std::filesystem::exists(path))
            result.emplace_back(name, ldi::load_depth_network(path));
        else
            std::printf("\nskipped: there is no %s\n", path.c_str());
    }
    return result;
}

/// Prints the table.
///
/// each  whether to print a line for every pair as well
template <ldi::executor Executor>
void print_depth(const std::vector<named_network>& networks, bool each, Executor& threads) {
    const std::vector<rgbd_pair> pairs = rgbd_pairs();
    if (pairs.empty()) return;
    std::printf(
        "\n### Depth, %zu photographs with measured depth\n\n"
        "| network | delta < 1.25 | AbsRel | RMSE | edges, F1 | boundaries, F1 | silhouettes found | wrong order |\n"
        "|---|---|---|---|---|---|---|---|\n",
        pairs.size());
    for (const auto& [name, network] : networks) {
        std::vector<depth_quality> measured;
        for (const rgbd_pair& p : pairs) {
            measured.push_back(measure_depth(p.photo, network.disparity(p.photo, {}, threads), network.quantization_step(),
                                             p.disparity, threads));
            if (each) print_row(p.name, {measured.back()});
        }
        print_row(name, measured);
    }
    std::fflush(stdout);
}

}  // namespace ldi_quality
