// Leaves out each of the paper's ideas in turn: makes the 3D photo without the idea, counts faults, and draws the place that
// differs most.
#pragma once

#include "photos.hpp"

#include <bench/quality/beside_silhouettes.hpp>
#include <bench/quality/extremes.hpp>
#include <bench/quality/holes.hpp>
#include <examples/photo3d/report.hpp>

#include <ldi/formats/glb.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/kernels/area_resize.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/photo3d/paper_options.hpp>
#include <ldi/render/rasterizer.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace ldi_paper {

using picture = ldi::image<std::uint8_t>;

/// The kind of picture in which leaving out an idea is visible.
enum class shown { side_views, layer_counts, coarse_texture };

struct ablation {
    const char *name, *idea;
    shown by;
    void (*leave_out)(ldi::photo3d_options&);
    bool has_padding = true;
};

inline const std::vector<ablation>& ablations() {
    using options = ldi::photo3d_options;
    // With the sigma below, only samples that equal the center have weight, so the median does nothing.
    static const std::vector<ablation> all{
        {"nothing", "nothing", shown::side_views, [](options&) {}},
        {"median", "weighted median", shown::side_views, [](options& o) { o.median.sigma = 1e-6F; }},
        {"components", "connected components", shown::side_views, [](options& o) { o.components.min_size = 0; }},
        {"junctions", "rule for junctions: every end is constrained", shown::layer_counts,
         [](options& o) { o.curves.constraints = ldi::constrained_ends::all; }},
        {"constraints", "constraints at the ends of curves", shown::layer_counts,
         [](options& o) { o.curves.constraints = ldi::constrained_ends::none; }},
        {"merging", "merging of curves", shown::layer_counts, [](options& o) { o.expand.merges_curves = false; }},
        {"margin", "texture margin: gray instead of padding", shown::coarse_texture, [](options&) {}, false},
        {"charts", "distance of surfaces in a chart: 1 instead of 4", shown::coarse_texture,
         [](options& o) { o.charts.filter_range = 1; }},
        {"cap", "nothing, and charts have at most 512 pixels per side", shown::coarse_texture,
         [](options& o) { o.charts.max_side = 512; }},
    };
    return all;
}

/// Fills the atlas with one gray, except for the charts and, with `keeps_filter_padding`, their filter padding.
inline void remove_padding(ldi::texture_atlas& atlas, bool keeps_filter_padding, std::uint8_t gray = 128) {
    const ldi::texel_kind last = keeps_filter_padding ? ldi::texel_kind::diffused : ldi::texel_kind::occluded;
    for (std::size_t i = 0; i < atlas.kind.size(); ++i)
        if (atlas.kind.data()[i] == ldi::texel_kind::empty || atlas.kind.data()[i] > last)
            std::fill_n(atlas.color.data() + 3 * i, 3, gray);
}

/// The texture at a quarter of its size: level 2 of its mipmap.
inline picture coarse(const picture& texture) {
    ldi::serial_executor one_thread;
    return ldi::area_resize(texture, texture.height() / 4, texture.width() / 4, one_thread);
}

inline picture seen_from(const ldi::photo3d& made, const picture& texture, const ldi::view& from) {
    ldi::raster_options raster;
    raster.z_near = 1e-3F * made.facts.range.z_near;
    return ldi::rasterize(made.mesh, texture, from, raster).color;
}

/// Figures of a 3D photo, or their sums over several.
struct figures {
    double silhouettes = 0;  ///< pixel sides on curves
    double rubber = 0;       ///< pixels whose disparity changes by more than 3 max_step over six links to the right or down
    double islands = 0, hidden = 0, layers = 0, charts = 0, triangles = 0;
    double kilobytes = 0;    ///< of the GLB
    double hole_pixels = 0;  ///< in all views of bench/quality/holes.hpp, at a long side of 500
    double mixed = 0;        ///< pixels of the photo's view where level 2 of the mipmap mixes two surfaces
};

/// Counts figures::rubber.
///
/// threshold  surface_rule::max_step
inline double count_rubber(const ldi::photo_layer& layer, float threshold) {
    const auto disparity = layer.column<ldi::disparity_column>();
    const ldi::graph& g = layer.topology();
    double count = 0;
    for (std::int32_t i = 0; i < g.count(); ++i)
        for (const ldi::side s : {ldi::side::right, ldi::side::down}) {
            std::int32_t end = i;
            for (int step = 0; step < 6 && end != ldi::no_pixel; ++step) end = g.neighbor(end, s);
            if (end != ldi::no_pixel && std::abs(disparity[end] - disparity[i]) > 3 * threshold) ++count;
        }
    return count;
}

/// Colors every pixel by its disparity, and counts the pixels of the photo's view in which the coarse texture is off by more
/// than the threshold.
inline double count_mixed(const ldi::photo3d& made, const ldi::photo3d_options& options, bool has_padding) {
    ldi::photo_layers layers = made.layers;
    for (std::size_t i = 0; i < layers.size(); ++i)
        std::fill_n(
            layers.column<ldi::color_column>().data() + 3 * i, 3,
            static_cast<std::uint8_t>(std::lround(std::clamp(255 * layers.column<ldi::disparity_column>()[i], 0.0F, 255.0F))));
    ldi::texture_atlas atlas = ldi::make_atlas(layers, made.charts, options.atlas);
    const picture fine = seen_from(made, atlas.color, ldi::view{made.facts.camera});
    if (!has_padding) remove_padding(atlas, false);
    const picture mixed = seen_from(made, coarse(atlas.color), ldi::view{made.facts.camera});
    double count = 0;
    for (std::size_t i = 0; i < fine.size(); i += 3)
        count += static_cast<float>(std::abs(fine.data()[i] - mixed.data()[i])) > 255 * options.surface.max_step ? 1 : 0;
    return count;
}

template <ldi::executor Executor>
figures measure(const ldi::photo3d& made, const ldi::photo3d_options& options, bool has_padding, float motion,
                Executor& threads) {
    figures f;
    for (const ldi::discontinuity_curve& c : made.curves) f.silhouettes += static_cast<double>(c.sides.size());
    const ldi::photo_layer front = ldi_quality::detail::visible_layer(made);
    f.rubber = count_rubber(front, options.surface.max_step);
    f.islands = static_cast<double>(ldi_quality::detail::count_islands(front.topology(), made.curves));
    f.hidden = static_cast<double>(made.layers.size() - front.size());
    f.layers = static_cast<double>(ldi::examples::layer_count(made.layers.topology()));
    f.charts = static_cast<double>(made.charts.charts.size()), f.triangles = static_cast<double>(made.mesh.triangle_count());
    f.kilobytes = 1e-3 * static_cast<double>(ldi::encode_glb(made.mesh, ldi::encode_jpeg(made.atlas.color)).size());
    ldi::photo_facts facts = made.facts;
    facts.motion = motion;
    for (const ldi_quality::hole& h : ldi_quality::count_holes(made.mesh, facts, 500, threads).holes)
        f.hole_pixels += static_cast<double>(h.pixels);
    f.mixed = count_mixed(made, options, has_padding);
    return f;
}

/// Draws pictures in which the effect of an idea is visible. The picture of layer counts is the darkened photo, in which
/// positions with more hidden pixels are bluer.
inline std::vector<picture> pictures_of(const ldi::photo3d& made, shown by, float motion) {
    std::vector<picture> result;
    if (by == shown::coarse_texture) return {seen_from(made, coarse(made.atlas.color), ldi::view{made.facts.camera})};
    if (by == shown::side_views) {
        ldi::photo_facts facts = made.facts;
        facts.motion = motion;
        const auto views = ldi_quality::extreme_views(facts);
        for (const std::size_t i : {8U, 10U, 12U, 14U}) result.push_back(seen_from(made, made.atlas.color, views[i].second));
        return result;
    }
    picture counts = made.photo;
    for (std::uint8_t& value : counts) value /= 3;
    const ldi::graph& g = made.layers.topology();
    for (std::int32_t i = 0; i < g.count(); ++i)
        if (made.layers.column<ldi::disparity_column>()[i] < made.disparity.data()[g.position_of(i)])
            for (std::size_t c = 1; c < 3; ++c) {
                std::uint8_t& value = counts.data()[3 * g.position_of(i) + c];
                value = static_cast<std::uint8_t>(std::min(value + (c == 1 ? 35 : 70), 255));
            }
    return {std::move(counts)};
}

/// Crops the place that differs most, with the idea on the left and without it on the right.
inline picture worst_place(const std::vector<picture>& with, const std::vector<picture>& without) {
    constexpr std::size_t side = 200, step = 20, gap = 8;
    std::size_t best_view = 0, best_x = 0, best_y = 0;
    double max_sum = -1;
    for (std::size_t view = 0; view < with.size(); ++view)
        for (std::size_t y = 0; y + side <= with[view].height(); y += step)
            for (std::size_t x = 0; x + side <= with[view].width(); x += step) {
                double sum = 0;
                for (std::size_t v = y; v < y + side; ++v)
                    for (std::size_t i = 3 * x; i < 3 * (x + side); ++i)
                        sum += std::abs(with[view].row(v)[i] - without[view].row(v)[i]);
                if (sum > max_sum) max_sum = sum, best_view = view, best_x = x, best_y = y;
            }
    picture pair(side, 2 * side + gap, 3, std::uint8_t{255});
    for (std::size_t v = 0; v < side; ++v) {
        std::copy_n(with[best_view].row(best_y + v) + 3 * best_x, 3 * side, pair.row(v));
        std::copy_n(without[best_view].row(best_y + v) + 3 * best_x, 3 * side, pair.row(v) + 3 * (side + gap));
    }
    return pair;
}

/// Prints the table over all photos. For each idea, also writes NAME.jpg, a picture of the sample, which is the last photo.
template <ldi::executor Executor>
void print_ablations(const std::vector<paper_photo>& photos, const std::filesystem::path& folder, Executor& threads) {
    std::printf(
        "\n### Each idea left out in turn, sums over %zu photos\n\n| left out | silhouettes, px | rubber, px | islands | hidden, "
        "px | "
        "layers | charts | triangles | GLB, kB | holes, px | mixed texture, px "
        "|\n|---|---|---|---|---|---|---|---|---|---|---|\n",
        photos.size());
    const ldi::diffusion_inpainter inpainter;
    std::vector<float> motions;
    std::vector<std::vector<picture>> complete(3);
    for (const ablation& a : ablations()) {
        figures sum;
        for (std::size_t p = 0; p < photos.size(); ++p) {
            ldi::photo3d_options options = paper_options_for(photos[p]);
            a.leave_out(options);
            ldi::photo3d made = ldi::make_photo3d(photos[p].photo, photos[p].depth, inpainter, options, threads);
            if (!a.has_padding) remove_padding(made.atlas, false);
            if (motions.size() == p) motions.push_back(made.facts.motion);
            const figures f = measure(made, options, a.has_padding, motions[p], threads);
            for (double figures::*const value :
                 {&figures::silhouettes, &figures::rubber, &figures::islands, &figures::hidden, &figures::charts,
                  &figures::triangles, &figures::kilobytes, &figures::hole_pixels, &figures::mixed})
                sum.*value += f.*value;
            sum.layers = std::max(sum.layers, f.layers);
            if (p + 1 < photos.size()) continue;
            if (&a == ablations().data())
                for (const shown by : {shown::side_views, shown::layer_counts, shown::coarse_texture})
                    complete[static_cast<std::size_t>(by)] = pictures_of(made, by, motions[p]);
            else
                ldi::save_jpeg(folder / (std::string(a.name) + ".jpg"),
                               worst_place(complete[static_cast<std::size_t>(a.by)], pictures_of(made, a.by, motions[p])));
        }
        std::printf("| %s | %.0f | %.0f | %.0f | %.0f | %.0f | %.0f | %.0f | %.0f | %.0f | %.0f |\n", a.idea, sum.silhouettes,
                    sum.rubber, sum.islands, sum.hidden, sum.layers, sum.charts, sum.triangles, sum.kilobytes, sum.hole_pixels,
                    sum.mixed);
        std::fflush(stdout);
    }
}

}  // namespace ldi_paper
