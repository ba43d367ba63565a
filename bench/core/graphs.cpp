// Graphs and layered images of the sample's size: building, changing, coarsening, windows, components, diffusion.

#include "bench/support/measure.hpp"
#include "bench/support/sample.hpp"
#include "tests/support/random_graph.hpp"
#include "tests/support/sketched_graph.hpp"

#include <ldi/core/canonical_order.hpp>
#include <ldi/core/coarsening.hpp>
#include <ldi/core/components.hpp>
#include <ldi/core/diffusion.hpp>
#include <ldi/core/layered_view.hpp>
#include <ldi/core/pixel_region.hpp>
#include <ldi/core/runs.hpp>
#include <ldi/core/single_layer.hpp>
#include <ldi/core/validate.hpp>
#include <ldi/core/window.hpp>
#include <ldi/inpaint/uncertain_rims.hpp>

#include <algorithm>
#include <cstdint>
#include <iterator>
#include <random>
#include <utility>

namespace {

using namespace ldi_bench;

constexpr std::int32_t width = 1152, height = 1536;
constexpr double graph_bytes = 20;  ///< per pixel: position and four links
/// Per pixel: reads one horizontal and one vertical link, and writes the parent. A quarter of the pixels also write a coarse
/// pixel.
constexpr double coarsening_bytes = 4 + 4 + 4 + (graph_bytes + 4) / 4;

ldi::photo_layers grid_layers() { return ldi::photo_layers(ldi::make_grid(width, height)); }
double count(const ldi::graph_view& g) { return static_cast<double>(g.size()); }

void add_graphs() {
    add("core/make_grid", [](benchmark::State& state) {
        measure(state, size_text(width, height), {.bytes = graph_bytes * width * height},
                [] { return ldi::make_grid(width, height); });
    });
    add("core/graph_builder/add and link", [](benchmark::State& state) {
        measure(state, pixels_text(1 << 20), {.bytes = graph_bytes * (1 << 20)}, [] {
            ldi::graph_builder b(1024, 1024);
            for (std::int32_t i = 0; i < 1 << 20; ++i) {
                b.add_pixel(i % 1024, i / 1024);
                if (i % 1024 != 0) b.link(i, ldi::side::left, i - 1);
                if (i >= 1024) b.link(i, ldi::side::up, i - 1024);
            }
            return std::move(b).build();
        });
    });
    add("core/validate/graph", [](benchmark::State& state) {
        const ldi::graph& g = sample_graph();
        measure(state, pixels_text(g.size()), {.bytes = graph_bytes * count(g)}, [&] { return ldi::validate(g).has_value(); });
    });
    add("core/validate/layers", [](benchmark::State& state) {
        const ldi::working_layers<>& layers = sample().uncolored;
        measure(state, pixels_text(layers.size()), {.bytes = (graph_bytes + 4) * static_cast<double>(layers.size())},
                [&] { return ldi::validate(layers).has_value(); });
    });
    add("core/validate_canonical", [](benchmark::State& state) {
        const ldi::working_layers<>& layers = sample().uncolored;
        measure(state, pixels_text(layers.size()), {.bytes = (graph_bytes + 4) * static_cast<double>(layers.size())},
                [&] { return ldi::validate_canonical(layers.topology(), layers.column<ldi::disparity_column>()).has_value(); });
    });
    add("core/canonical_order", [](benchmark::State& state) {
        const ldi::working_layers<>& layers = sample().uncolored;
        measure(state, pixels_text(layers.size()), {.pixels = static_cast<double>(layers.size())},
                [&] { return ldi::canonical_order(layers.topology(), layers.column<ldi::disparity_column>()); });
    });
    add("core/reordered/rows reversed", [](benchmark::State& state) {
        const ldi::graph g = ldi::make_grid(width, height);
        ldi::buffer<std::int32_t> order;
        for (std::int32_t y = 0; y < height; ++y)
            for (std::int32_t x = width; x-- > 0;) order.push_back(y * width + x);
        measure(state, size_text(width, height), {.bytes = (2 * graph_bytes + 4) * count(g)},
                [&] { return ldi::reordered(g, order); });
    });
    add("core/runs_of", [](benchmark::State& state) {
        const ldi::graph& g = sample_graph();
        measure(state, pixels_text(g.size()), {.bytes = 4 * count(g)}, [&] { return ldi::runs_of(g); });
    });
    add("core/for_each_run", [](benchmark::State& state) {
        const ldi::graph& g = sample_graph();
        measure(state, pixels_text(g.size()), {.bytes = 4 * count(g)}, [&] {
            std::int32_t longest = 0;
            ldi::for_each_run(g, [&](ldi::pixel_run r) { longest = std::max(longest, r.size()); });
            return longest;
        });
    });
}

/// Adds layered images with the columns of a photo. `copy` copies the bytes of the graph and of its columns, so no function
/// that returns a new layered image can be faster.
void add_layered_images() {
    constexpr double layer_bytes = (graph_bytes + 9) * width * height;
    add("core/layered_image/construct, two columns", [](benchmark::State& state) {
        const ldi::graph g = ldi::make_grid(width, height);
        using layers = ldi::layered_image<ldi::color_column, ldi::disparity_column>;
        measure(state, size_text(width, height), {.bytes = (2 * graph_bytes + 7) * width * height},
                [&] { return layers(ldi::graph(g)).size(); });
    });
    add("core/layered_image/copy", [](benchmark::State& state) {
        const ldi::photo_layers original = grid_layers();
        measure(state, size_text(width, height), {.bytes = 2 * layer_bytes}, [&] {
            const ldi::photo_layers layers = original;
            return layers.size();
        });
    });
    add("core/layered_image/grow by a tenth", [](benchmark::State& state) {
        measure_change(
            state, size_text(width, height), {.bytes = 2.1 * layer_bytes}, grid_layers(), [](ldi::photo_layers& layers) {
                const std::int32_t old = layers.topology().count(), added = old / 10;
                layers.grow([&](ldi::graph_builder b) {
                    ldi::buffer<std::int32_t> origins;
                    for (std::int32_t i = 0; i < added; ++i) {
                        b.add_pixel(i % width, i / width);
                        origins.push_back(i);
                    }
                    return ldi::grown_pixels{std::move(b).build(), {{0, old, false}, {0, added, true}}, std::move(origins)};
                });
            });
    });
    add("core/layered_image/keep nine tenths", [](benchmark::State& state) {
        ldi::buffer<std::uint8_t> kept(std::size_t{width} * height, 1);
        for (std::size_t i = 0; i < kept.size(); i += 10) kept[i] = 0;
        measure_change(state, size_text(width, height), {.bytes = 1.8 * layer_bytes + width * height}, grid_layers(),
                       [&](ldi::photo_layers& layers) { layers.keep(kept); });
    });
    add("core/layered_image/reorder", [](benchmark::State& state) {
        ldi::buffer<std::int32_t> order;
        for (std::int32_t y = 0; y < height; ++y)
            for (std::int32_t x = width; x-- > 0;) order.push_back(y * width + x);
        measure_change(state, size_text(width, height), {.bytes = 2 * layer_bytes + 4.0 * width * height}, grid_layers(),
                       [&](ldi::photo_layers& layers) { layers.reorder(order); });
    });
    add("core/link_editor/unlink a tenth", [](benchmark::State& state) {
        measure_change(state, size_text(width, height), {.pixels = 0.1 * width * height}, grid_layers(),
                       [](ldi::photo_layers& layers) {
                           layers.edit_links([](ldi::link_editor& links) {
                               for (std::int32_t i = 0; i < width * height; i += 10) links.unlink(i, ldi::side::right);
                           });
                       });
    });
    add("core/single_layer/check order and add a column", [](benchmark::State& state) {
        measure_change(state, size_text(width, height), {.bytes = (8.0 + 1) * width * height}, grid_layers(),
                       [](ldi::photo_layers& layers) {
                           ldi::single_layer one(std::move(layers));
                           ldi::buffer<std::uint8_t> rims(one.size());
                           return std::move(one).with<ldi::rim_column>(std::move(rims)).size();
                       });
    });
    add("core/layered_view/construct", [](benchmark::State& state) {
        const ldi::working_layers<>& layers = sample().uncolored;
        measure(state, pixels_text(layers.size()), {},
                [&] { return ldi::layered_view<ldi::color_column, ldi::disparity_column>(layers).size(); });
    });
}

void add_coarsening() {
    for (const auto& [rule, name] :
         {std::pair{ldi::orphan_rule::stay, "stay"}, std::pair{ldi::orphan_rule::adopt_nearest, "adopt nearest"}}) {
        const ldi::orphan_rule orphans = rule;
        add(std::string("core/coarsen/orphans ") + name, [orphans](benchmark::State& state) {
            const ldi::graph& g = sample_graph();
            measure(state, pixels_text(g.size()), {.bytes = coarsening_bytes * count(g)},
                    [&] { return ldi::coarsen(g, orphans); });
        });
        add(std::string("core/coarsen/image, orphans ") + name, [orphans](benchmark::State& state) {
            const ldi::graph& g = image_graph();
            measure(state, pixels_text(g.size()), {.bytes = coarsening_bytes * count(g)},
                    [&] { return ldi::coarsen(g, orphans); });
        });
    }
    add("core/coarsen/layers with columns", [](benchmark::State& state) {
        const ldi::photo_layers& layers = sample().layers;
        measure(state, pixels_text(layers.size()), {.pixels = static_cast<double>(layers.size())},
                [&] { return ldi::coarsen(layers); });
    });
}

/// Adds windows around the pixels at silhouettes. Elsewhere, the library finds a window without following links, as in an
/// image.
void add_windows() {
    for (const std::int32_t kernel_size : {3, 5, 7})
        add("core/gather_window/" + std::to_string(kernel_size) + "x" + std::to_string(kernel_size),
            [kernel_size](benchmark::State& state) {
                const ldi::graph& g = sample_graph();
                ldi::buffer<std::int32_t> window(static_cast<std::size_t>(kernel_size * kernel_size)), pixels;
                for (std::int32_t i = 0; i < g.count(); ++i)
                    if (std::any_of(std::begin(ldi::all_sides), std::end(ldi::all_sides),
                                    [&](ldi::side s) { return g.neighbor(i, s) == ldi::no_pixel; }))
                        pixels.push_back(i);
                measure(state, std::to_string(pixels.size()) + " windows", {.pixels = static_cast<double>(pixels.size())}, [&] {
                    for (const std::int32_t pixel : pixels) {
                        ldi::gather_window(g, pixel, kernel_size, window);
                        benchmark::DoNotOptimize(window.data());
                    }
                });
            });
}

void add_components() {
    const auto add_graph = [](const char* name, auto make) {
        add(std::string("core/connected_components/") + name, [make](benchmark::State& state) {
            const ldi::graph g = make();
            std::size_t found = 0;
            measure(state, pixels_text(g.size()), {.bytes = 12 * count(g)}, [&] {  // two links and the label
                ldi::components c = ldi::connected_components(g);
                found = c.count();
                return c;
            });
            state.counters["components"] = static_cast<double>(found);
        });
    };
    add_graph("sample", [] { return sample_graph(); });
    add_graph("image", [] { return ldi::make_grid(width, height); });
    add_graph("a tenth of the links missing", [] {
        std::mt19937 random(1);
        ldi::testing::sketched_graph g(ldi::make_grid(width, height));
        for (std::int32_t i = 0; i < width * height; ++i)
            for (const ldi::side s : {ldi::side::up, ldi::side::left})
                if (ldi::testing::chance(random, 10)) g.unlink(i, s);
        return ldi::graph(g);
    });
    add_graph("pixels shuffled", [] {
        std::mt19937 random(1);
        const ldi::graph g = ldi::make_grid(width, height);
        return ldi::reordered(g, ldi::testing::random_permutation(random, g.size()));
    });
}

/// Scattered blocks of 48 x 64 pixels that stand in for the band of a silhouette network.
ldi::pixel_region blocks() {
    ldi::pixel_region_builder region(width);
    for (std::int32_t y = 0; y < height; ++y) {
        for (std::int32_t x = 0; x < width; ++x)
            if ((x / 64 + y / 64) % 3 == 0 && (x % 64) < 48) region.add_run(x, x + 1);
        region.end_row();
    }
    return std::move(region).build();
}

void add_regions() {
    add("core/pixel_region_builder/add runs of 1 pixel", [](benchmark::State& state) {
        measure(state, pixels_text(blocks().size()), {.pixels = static_cast<double>(blocks().size())}, [] { return blocks(); });
    });
    add("core/halved", [](benchmark::State& state) {
        const ldi::pixel_region region = blocks();
        measure(state, pixels_text(region.size()), {.pixels = static_cast<double>(region.size())},
                [&] { return ldi::halved(region); });
    });
    add("core/parents", [](benchmark::State& state) {
        const ldi::pixel_region region = blocks(), half = ldi::halved(region);
        measure(state, pixels_text(region.size()), {.bytes = 4.0 * static_cast<double>(region.size())},
                [&] { return ldi::parents(region, half); });
    });
    add("core/pixels_below", [](benchmark::State& state) {
        const ldi::pixel_region region = blocks();
        measure(state, pixels_text(region.size()), {.bytes = 4.0 * static_cast<double>(region.size())},
                [&] { return ldi::pixels_below(region); });
    });
    add("core/diffusion/a square of 256 x 256", [](benchmark::State& state) {
        constexpr std::int32_t side = 256;
        measure(state, size_text(side, side), {.pixels = side * side}, [&] {
            ldi::diffusion<3> d;
            d.start();
            const std::uint8_t red[] = {200, 10, 10}, blue[] = {10, 10, 200};
            for (std::int32_t y = 0; y < side; ++y)
                for (std::int32_t x = 0; x < side; ++x) {
                    const std::int32_t cell = d.add_cell(x, y);
                    if (x > 0) d.link_left(cell, cell - 1);
                    if (y > 0) d.link_up(cell, cell - side);
                    if (x == 0 || y == 0) d.add_known_neighbor(cell, red);
                    if (x + 1 == side || y + 1 == side) d.add_known_neighbor(cell, blue);
                }
            d.solve(4);
            return d.value(side * side / 2);
        });
    });
}

const bool registered = [] {
    add_graphs();
    add_layered_images();
    add_coarsening();
    add_windows();
    add_components();
    add_regions();
    return true;
}();

}  // namespace
