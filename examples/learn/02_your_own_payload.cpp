// Pixels can hold any data: this lesson adds a column of normals. Every stage keeps the normals with their pixels, expand()
// extends them to hidden pixels, and gather() transfers them to the vertices. A virtual lamp can then light the photo.
#include "drawing.hpp"
#include "sample.hpp"

#include <ldi/charts/charts.hpp>
#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/mesh/build_mesh.hpp>
#include <ldi/mesh/gather.hpp>

#include <cmath>
#include <cstdio>

struct normal {  // a unit vector that points out of the surface
    using scalar = float;
    static constexpr std::size_t channels = 3;
};

/// Computes each pixel's normal: the cross product of the vectors from left to right neighbor and from lower to upper neighbor.
ldi::buffer<float> normals_of(const ldi::photo_layer& layer, const ldi::photo_facts& facts) {
    using enum ldi::side;
    const ldi::graph& g = layer.topology();
    const auto position_of = [&](std::int32_t i) {
        const learn::spot s = learn::spot_of(layer, i);
        return facts.camera.unproject(s.x, s.y, facts.range.depth(s.disparity));
    };
    ldi::buffer<float> normals;
    for (std::int32_t i = 0; i < g.count(); ++i) {
        const auto beside = [&](ldi::side s) { return position_of(g.neighbor(i, s) == ldi::no_pixel ? i : g.neighbor(i, s)); };
        const auto l = beside(left), r = beside(right), u = beside(up), d = beside(down);
        const float a[] = {r[0] - l[0], r[1] - l[1], r[2] - l[2]}, b[] = {u[0] - d[0], u[1] - d[1], u[2] - d[2]};
        const float n[] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
        for (const float c : n) normals.push_back(c / (std::max)(std::hypot(n[0], n[1], n[2]), 1e-20F));
    }
    return normals;
}

int main() {
    const learn::sample photo = learn::load_crop("archway");
    const ldi::photo_facts facts = learn::facts_of(photo);
    ldi::photo_layer lifted = ldi::lift(photo.color, photo.disparity);
    ldi::buffer<float> normals = normals_of(lifted, facts);
    auto layer = std::move(lifted).with<normal>(std::move(normals));
    const auto curves = ldi::find_discontinuity_curves(layer, facts.surface);
    ldi::close_spurious_discontinuities(layer, curves);
    auto layers = ldi::expand(std::move(layer), facts.surface, curves).layers;
    ldi::diffusion_inpainter{}.inpaint(layers);
    const ldi::chart_set charts = ldi::make_charts(layers, facts.surface);
    const ldi::textured_mesh mesh = ldi::build_mesh(layers, facts, charts, ldi::make_atlas(layers, charts));
    const ldi::buffer<float> at_vertices = ldi::gather<normal>(mesh, layers, facts.camera);
    const auto lit = [&](std::uint32_t vertex) {  // returns the vertex's color in the light of a warm lamp on the right
        const float* n = at_vertices.data() + 3 * std::size_t{vertex};
        const float light = (0.15F + (std::max)(0.85F * n[0] + 0.3F * n[1] + 0.4F * n[2], 0.0F)) / 255.0F;
        const auto c = layers.at<ldi::color_column>(mesh.pixels[vertex]);
        return std::array<float, 3>{1.2F * light * c[0], light * c[1], 0.7F * light * c[2]};
    };
    std::printf("%zu normals, %zu of them of hidden pixels\n", layers.size(), layers.size() - photo.color.size() / 3);
    learn::save("02_your_own_payload.png", learn::side_by_side({photo.color, learn::draw_triangles(mesh, facts.camera, lit)}));
}
