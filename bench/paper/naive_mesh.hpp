// Builds the mesh that the paper's flat mesher avoids. Every pixel is a vertex, each pixel forms up to two triangles with its
// lower and right neighbors and with its upper and left neighbors, and meshoptimizer simplifies the result. Also measures the
// error of a mesh relative to the layered image, for both meshers.
#pragma once

#include <ldi/io/picture.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/rasterizer.hpp>

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>
#include <vector>

namespace ldi_paper {

/// Triangulates all pixels, chart by chart. A triangle that crosses to another chart's pixel uses a copy of that pixel, whose
/// texel lies in the padding that the atlas copied from the other chart.
inline ldi::textured_mesh mesh_of_all_pixels(const ldi::photo3d& made) {
    const ldi::graph& g = made.layers.topology();
    const auto disparity = made.layers.column<ldi::disparity_column>();
    const ldi::pinhole_camera camera = made.facts.layers_camera();
    const float width = static_cast<float>(made.atlas.color.width()), height = static_cast<float>(made.atlas.color.height());
    ldi::textured_mesh mesh;
    std::map<std::pair<std::int32_t, std::int32_t>, std::uint32_t> copies;  // by chart and pixel
    const auto add = [&](std::int32_t pixel, std::int32_t chart) {
        const ldi::chart& shape = made.charts.charts[chart];
        const ldi::chart_placement place = made.atlas.placements[chart];
        const float x = static_cast<float>(g.x()[pixel]) + 0.5F, y = static_cast<float>(g.y()[pixel]) + 0.5F;
        for (const float coordinate : camera.unproject(x, y, made.facts.range.depth(disparity[pixel])))
            mesh.positions.push_back(coordinate);
        mesh.texture_coordinates.push_back((x + static_cast<float>(place.x - shape.x)) / width);
        mesh.texture_coordinates.push_back((y + static_cast<float>(place.y - shape.y)) / height);
        mesh.pixels.push_back(pixel);
        return static_cast<std::uint32_t>(mesh.vertex_count() - 1);
    };
    for (std::int32_t i = 0; i < g.count(); ++i) add(i, made.charts.chart_of[i]);
    const auto vertex = [&](std::int32_t pixel, std::int32_t chart) {
        if (made.charts.chart_of[pixel] == chart) return static_cast<std::uint32_t>(pixel);
        const auto [place, is_new] = copies.try_emplace({chart, pixel}, 0U);
        if (is_new) place->second = add(pixel, chart);
        return place->second;
    };
    using ldi::side;
    for (std::int32_t i = 0; i < g.count(); ++i)
        for (const auto& [first, second] : {std::pair{side::down, side::right}, {side::up, side::left}}) {
            const std::int32_t a = g.neighbor(i, first), b = g.neighbor(i, second);
            if (a == ldi::no_pixel || b == ldi::no_pixel) continue;
            for (const std::int32_t pixel : {i, a, b}) mesh.triangles.push_back(vertex(pixel, made.charts.chart_of[i]));
        }
    return mesh;
}

/// Simplifies a mesh to a number of triangles. Measures errors in pixels of the photo, and errors of depth as parallax under
/// the default motion, so that meshoptimizer minimizes visible errors.
inline ldi::textured_mesh simplified(const ldi::textured_mesh& dense, const ldi::photo3d& made, std::size_t triangles) {
    const float parallax =
        ldi::expand_options().motion * static_cast<float>(std::max(made.facts.camera.width, made.facts.camera.height));
    std::vector<float> seen(dense.positions.size());
    for (std::size_t v = 0; v < dense.vertex_count(); ++v) {
        const float* p = dense.positions.data() + 3 * v;
        const auto [x, y] = made.facts.layers_camera().project({p[0], p[1], p[2]});
        seen[3 * v] = x, seen[3 * v + 1] = y;
        seen[3 * v + 2] = parallax * made.layers.column<ldi::disparity_column>()[dense.pixels[v]];
    }
    std::vector<unsigned int> kept(dense.triangles.size());
    kept.resize(meshopt_simplify(kept.data(), dense.triangles.data(), dense.triangles.size(), seen.data(), dense.vertex_count(),
                                 3 * sizeof(float), 3 * triangles, 1.0F, 0, nullptr));
    std::vector<unsigned int> place(dense.vertex_count());
    const std::size_t used = meshopt_optimizeVertexFetchRemap(place.data(), kept.data(), kept.size(), dense.vertex_count());
    ldi::textured_mesh result;
    result.positions.resize(3 * used), result.texture_coordinates.resize(2 * used), result.pixels.resize(used);
    meshopt_remapVertexBuffer(result.positions.data(), dense.positions.data(), dense.vertex_count(), 12, place.data());
    meshopt_remapVertexBuffer(result.texture_coordinates.data(), dense.texture_coordinates.data(), dense.vertex_count(), 8,
                              place.data());
    meshopt_remapVertexBuffer(result.pixels.data(), dense.pixels.data(), dense.vertex_count(), 4, place.data());
    for (const unsigned int v : kept) result.triangles.push_back(place[v]);
    return result;
}

/// Error of a mesh as the photo's camera sees it.
struct mesh_error {
    double rms = 0;      ///< of disparity, at pixels farther than 3 from every silhouette
    double wrong = 0;    ///< share of all pixels that show another surface: their disparity is off by more than the threshold
    double outside = 0;  ///< share of all pixels that no triangle covers
};

inline mesh_error error_of(const ldi::textured_mesh& mesh, const ldi::photo3d& made) {
    constexpr std::ptrdiff_t reach = 3;
    ldi::raster_options raster;
    raster.z_near = 1e-3F * made.facts.range.z_near;
    const ldi::image<float> depth = ldi::rasterize(mesh, made.atlas.color, ldi::view{made.facts.camera}, raster).depth;
    const ldi::image<float>& truth = made.disparity;
    const auto rows = static_cast<std::ptrdiff_t>(truth.height()), columns = static_cast<std::ptrdiff_t>(truth.width());
    ldi::image<std::uint8_t> is_close(truth.height(), truth.width());
    for (const ldi::discontinuity_curve& curve : made.curves)
        for (const ldi::discontinuity& d : curve.sides)
            for (std::ptrdiff_t y = d.back / columns - reach; y <= d.back / columns + reach; ++y)
                for (std::ptrdiff_t x = d.back % columns - reach; x <= d.back % columns + reach; ++x)
                    if (y >= 0 && x >= 0 && y < rows && x < columns)
                        is_close(static_cast<std::size_t>(y), static_cast<std::size_t>(x)) = 1;
    const float farthest = made.facts.range.inverse_depth(0), step = made.facts.range.inverse_depth(1) - farthest;
    double sum = 0, count = 0, wrong = 0, outside = 0;
    for (std::size_t i = 0; i < truth.size(); ++i) {
        if (std::isinf(depth.data()[i])) {
            ++outside;
            continue;
        }
        const float error = (1 / depth.data()[i] - farthest) / step - truth.data()[i];
        if (std::abs(error) > made.facts.surface.max_step) ++wrong;
        if (is_close.data()[i] == 0) sum += static_cast<double>(error) * static_cast<double>(error), ++count;
    }
    const double pixels = static_cast<double>(truth.size());
    return {std::sqrt(sum / std::max(count, 1.0)), wrong / pixels, outside / pixels};
}

}  // namespace ldi_paper
