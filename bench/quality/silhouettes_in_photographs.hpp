// The table of beside_silhouettes.hpp for forty photographs, and the sheets of their worst places.
#pragma once

#include "beside_silhouettes.hpp"
#include "converter.hpp"
#include "holes.hpp"

#include <ldi/io/photo.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/networks/farbrausch.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <ldi/photo3d.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace ldi_quality {

/// Places with their pictures, the worst first.
struct sheet_of_places {
    static constexpr std::size_t max_places = 24;
    std::vector<std::pair<bad_place, picture>> places;

    void add(const bad_place& place, picture seen) {
        places.emplace_back(place, std::move(seen));
        std::stable_sort(places.begin(), places.end(),
                         [](const auto& a, const auto& b) { return a.first.score > b.first.score; });
        if (places.size() > max_places) places.pop_back();
    }
    bool has_room_for(std::int64_t score) const { return places.size() < max_places || places.back().first.score < score; }
};

/// Reads the places that save_sheet() listed, in its order.
inline std::vector<bad_place> read_places(const std::filesystem::path& folder) {
    std::vector<bad_place> result;
    std::ifstream file(folder / "worst_places.txt");
    for (bad_place p; file >> p.photo >> p.view >> p.x >> p.y >> p.score;) result.push_back(p);
    return result;
}

inline void save_sheet(const std::filesystem::path& folder, const sheet_of_places& sheet) {
    std::ofstream list(folder / "worst_places.txt");
    std::vector<picture> pictures;
    for (const auto& [p, seen] : sheet.places) {
        list << p.photo << ' ' << p.view << ' ' << p.x << ' ' << p.y << ' ' << p.score << '\n';
        pictures.push_back(seen);
    }
    ldi::save_png(folder / "worst_places.png", in_grid(pictures, 6));
}

/// Draws every place of an earlier sheet beside its current state.
inline void save_before_and_after(const std::filesystem::path& folder, const std::filesystem::path& before,
                                  const std::vector<picture>& now) {
    const picture sheet = ldi::load_photo(before / "worst_places.png").color;
    std::vector<picture> pairs;
    for (std::size_t i = 0; i < now.size(); ++i) {
        const std::size_t h = now[i].height(), w = now[i].width();
        picture was(h, w, 3);
        for (std::size_t y = 0; y < h; ++y) std::copy_n(sheet.row(i / 6 * h + y) + 3 * (i % 6) * w, 3 * w, was.row(y));
        pairs.push_back(std::move(was)), pairs.push_back(now[i]);
    }
    ldi::save_png(folder / "worst_places_before_and_after.png", in_grid(pairs, 6));
}

struct photograph_options {
    std::filesystem::path before;  ///< folder of an earlier run's sheet, or empty
    bool counts_holes = true;
};

/// Prints the table, and writes worst_places.png and worst_places.txt to `folder`. With `before`, also writes
/// worst_places_before_and_after.png.
template <ldi::executor Executor>
void measure_photographs(const ldi::tiefenrausch& network, const converter& convert, const ldi::farbrausch& inpainter,
                         const std::filesystem::path& folder, const photograph_options& options, Executor& threads) {
    const std::vector<std::filesystem::path> files = forty_photographs();
    if (files.empty()) return;
    const std::vector<bad_place> earlier = options.before.empty() ? std::vector<bad_place>() : read_places(options.before);
    std::vector<picture> now(earlier.size());
    sheet_of_places worst;
    ldi::buffer<double> islands, charts, layers, neither, borders, hidden;
    double band = 0, of_neither = 0;
    ldi::photo3d_options of_photos;
    of_photos.frame = ldi::photo_frame::crop;  // so that the layers have the photo's size
    std::size_t views_with_holes = 0;
    std::printf(
        "\n### Silhouettes: %zu photographs without true depth\n\n| photo | islands | charts | layers | fits neither surface "
        "| hard borders of hidden surfaces, px | hidden pixels | views with holes |\n|---|---|---|---|---|---|---|---|\n",
        files.size());
    for (const std::filesystem::path& file : files) {
        const std::string name = file.stem().string();
        const ldi::photo3d made = convert(ldi::load_photo(file).color, network, inpainter, of_photos, threads);
        const silhouette_faults f = find_faults(made, name, threads);
        const std::size_t holes = options.counts_holes ? count_holes(made.mesh, made.facts, 1000, threads).views_with_holes : 0;
        islands.push_back(static_cast<double>(f.islands)), charts.push_back(static_cast<double>(f.charts));
        layers.push_back(static_cast<double>(f.layers)), borders.push_back(static_cast<double>(f.hard_borders));
        hidden.push_back(static_cast<double>(made.layers.size()) / static_cast<double>(made.disparity.size()) - 1);
        band += f.band, of_neither += f.neither, views_with_holes += holes;
        std::printf("| %s | %zu | %zu | %zu | %.1f %% | %lld | %.1f %% | %s |\n", name.c_str(), f.islands, f.charts, f.layers,
                    100 * f.neither / std::max(f.band, 1.0), static_cast<long long>(f.hard_borders), 100 * hidden.back(),
                    options.counts_holes ? std::to_string(holes).c_str() : "not counted");
        std::fflush(stdout);
        for (const bad_place& p : f.places)
            if (worst.has_room_for(p.score)) worst.add(p, picture_of(made, p, threads));
        for (std::size_t i = 0; i < earlier.size(); ++i)
            if (earlier[i].photo == name) now[i] = picture_of(made, earlier[i], threads);
    }
    save_sheet(folder, worst);
    if (!earlier.empty()) save_before_and_after(folder, options.before, now);
    std::int64_t score = 0;
    for (const auto& [place, seen] : worst.places) score += place.score;
    std::printf(
        "\nislands %.2f per photo, charts %.0f (median), layers %.0f (median), fits neither %.2f %% of the band, hard borders "
        "%.0f px per photo, hidden %.2f %% (median), views with holes %s, worst places %lld\n",
        mean(islands), median(charts), median(layers), 100 * of_neither / std::max(band, 1.0), mean(borders),
        100 * median(hidden), options.counts_holes ? std::to_string(views_with_holes).c_str() : "not counted",
        static_cast<long long>(score));
}

}  // namespace ldi_quality
