// Operators on layered images: plans, convolutions in float32 and bytes, pooling, elementwise functions, conversions. One thread.
// Variants named `ldi` run on the sample's layered image, `image` on a plain image with about as many pixels, and `squares` on an
// image that is cut into unconnected squares.

#include "bench/support/convolution_case.hpp"
#include "bench/support/cut_graph.hpp"
#include "bench/support/measure.hpp"
#include "bench/support/sample.hpp"

#include <ldi/core/coarsening.hpp>
#include <ldi/nn/ldi/convolution_layer.hpp>
#include <ldi/nn/ldi/elementwise.hpp>
#include <ldi/nn/ldi/from_column.hpp>
#include <ldi/nn/ldi/pixel_subset.hpp>
#include <ldi/nn/ldi/pooling.hpp>
#include <ldi/nn/ldi/region_plan.hpp>
#include <ldi/nn/ldi/restrict_plan.hpp>

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

using namespace ldi_bench;
using byte_map = ldi::basic_feature_map<std::uint8_t>;
using byte_view = ldi::basic_feature_view<std::uint8_t>;

double count(const ldi::graph_view& g) { return static_cast<double>(g.size()); }

const ldi::coarsened& coarse_sample() {
    static const ldi::coarsened made = ldi::coarsen(sample_graph(), ldi::orphan_rule::adopt_nearest);
    return made;
}
const ldi::graph& squares(std::int32_t side) {
    static std::vector<std::pair<std::int32_t, ldi::graph>> made;
    for (const auto& [known, g] : made)
        if (known == side) return g;
    made.reserve(16);
    return made.emplace_back(side, cut_graph(1152, sample_graph().count() / 1152, side)).second;
}

std::string size_of(const ldi::convolution_plan& plan) {
    const double share = 100.0 * static_cast<double>(plan.irregular().size()) / static_cast<double>(plan.output_count());
    return pixels_text(plan.output_count()) + ", " + std::to_string(share).substr(0, share < 100 ? 4 : 3) + " % irregular";
}

/// none: an ordinary convolution. partial: convolve_partially(), which excludes missing pixels. masked: like partial, with a
/// tenth of the pixels masked.
enum class masking { none, partial, masked };

template <class View>
void set_mask(View& source, const ldi::buffer<std::uint8_t>& mask, masking m) {
    if (m == masking::masked) source.mask = mask;
}

template <class Weights, class View, class Result>
void run(benchmark::State& state, const ldi::convolution_plan& plan, const Weights& packed, std::span<const View> sources,
         Result& result, masking m, const work& done) {
    measure(state, size_of(plan), done, [&] {
        if (m == masking::none)
            ldi::convolve(plan, packed, sources, result);
        else
            ldi::convolve_partially(plan, packed, sources, result);
    });
}

void convolve_floats(benchmark::State& state, const ldi::graph& g, const ldi::convolution_plan& plan, const convolution_shape& s,
                     masking m, ldi::isa set) {
    const ldi::buffer<float> values = random_floats(g.size() * s.inputs);
    ldi::buffer<std::uint8_t> mask(g.size());
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = i / 100 % 10 != 0 ? 1 : 0;
    ldi::feature_view source{values, s.inputs, {}, {}};
    set_mask(source, mask, m);
    ldi::buffer<float> result(plan.output_count() * s.outputs);
    run(state, plan, float_weights(s, set), std::span<const ldi::feature_view>(&source, 1), result, m,
        {.float_products = s.products(plan), .set = set});
}

void convolve_bytes(benchmark::State& state, const ldi::graph& g, const ldi::convolution_plan& plan, const convolution_shape& s,
                    masking m, ldi::isa set) {
    const ldi::buffer<std::uint8_t> values = random_byte_values(g.size() * s.inputs);
    ldi::buffer<std::uint8_t> mask(g.size());
    for (std::size_t i = 0; i < mask.size(); ++i) mask[i] = i / 100 % 10 != 0 ? 1 : 0;
    byte_view source{values, s.inputs, {}, {}, byte_input.zero_point};
    set_mask(source, mask, m);
    ldi::buffer<std::uint8_t> result(plan.output_count() * s.outputs);
    const ldi::quantized_source quantized{s.inputs, byte_input};
    run(state, plan, byte_weights(s, set, std::span(&quantized, 1)), std::span<const byte_view>(&source, 1), result, m,
        {.int8_products = s.products(plan), .set = set});
}

/// Adds a convolution in both number formats.
///
/// where  name of the graph in the benchmark's name
/// graph  function that returns the graph
template <class Graph>
void add_convolution(const std::string& function, const std::string& where, Graph graph, const convolution_shape& s, masking m,
                     std::int32_t stride = 1, ldi::isa set = ldi::best_isa()) {
    const std::string name = joined(function, "/", where, " ", shape_text(s), stride == 2 ? " stride 2" : "");
    const std::string suffix = set == ldi::best_isa() ? std::string() : joined("/", to_string(set));
    const auto plan_of = [=](const ldi::graph& g) {
        return stride == 2 ? ldi::plan_convolution(g, s.kernel_size, ldi::coarsen(g).map)
                           : ldi::plan_convolution(g, s.kernel_size);
    };
    add(joined(name, ", float32", suffix),
        [=](benchmark::State& state) { convolve_floats(state, graph(), plan_of(graph()), s, m, set); });
    add(joined(name, ", int8", suffix),
        [=](benchmark::State& state) { convolve_bytes(state, graph(), plan_of(graph()), s, m, set); });
}

const ldi::graph& on_sample() { return sample_graph(); }
const ldi::graph& on_image() { return image_graph(); }

void add_convolutions() {
    for (const convolution_shape s : {convolution_shape{3, 16, 16}, convolution_shape{3, 32, 32}}) {
        add_convolution("nn/convolve", "ldi", on_sample, s, masking::none);
        add_convolution("nn/convolve", "image", on_image, s, masking::none);
    }
    for (const std::int32_t side : {96, 24, 8, 4})
        add_convolution(
            "nn/convolve", joined("squares of ", std::to_string(side)), [side]() -> const ldi::graph& { return squares(side); },
            {3, 16, 16}, masking::none);
    for (const ldi::instruction_set& set : ldi::instruction_sets)
        if (ldi::is_available(set.id) && set.id != ldi::best_isa() && set.id != ldi::isa::scalar)
            add_convolution("nn/convolve", "ldi", on_sample, {3, 16, 16}, masking::none, 1, set.id);
    add_convolution("nn/convolve_partially", "partial", on_sample, {3, 16, 16}, masking::partial);
    add_convolution("nn/convolve_partially", "masked", on_sample, {3, 16, 16}, masking::masked);
    add_convolution("nn/convolve_partially", "partial", on_sample, {7, 4, 20}, masking::partial, 2);
    add_convolution("nn/convolve_partially", "partial", on_sample, {5, 20, 40}, masking::partial, 2);
}

/// Adds functions with upsampled maps. The convolutions read two maps: the map of the coarser level, upsampled without a copy,
/// and the map of the finer level.
void add_upsampling() {
    const convolution_shape s{3, 60, 20};
    add("nn/upsample/convolution 3x3 40 upsampled + 20 -> 20, float32", [s](benchmark::State& state) {
        const ldi::graph& g = sample_graph();
        ldi::feature_map coarse(coarse_sample().map.kept().size(), 40), fine(g.size(), 20);
        coarse.values = random_floats(coarse.values.size()), fine.values = random_floats(fine.values.size());
        const ldi::convolution_plan plan = ldi::plan_convolution(g, 3);
        const ldi::feature_view sources[] = {ldi::upsample(coarse, coarse_sample().map), fine};
        ldi::buffer<float> result(g.size() * s.outputs);
        run(state, plan, float_weights(s, ldi::best_isa()), std::span<const ldi::feature_view>(sources), result, masking::none,
            {.float_products = s.products(plan)});
    });
    add("nn/upsample/convolution 3x3 40 upsampled + 20 -> 20, int8", [s](benchmark::State& state) {
        const ldi::graph& g = sample_graph();
        byte_map coarse(coarse_sample().map.kept().size(), 40, byte_input.zero_point), fine(g.size(), 20, byte_input.zero_point);
        coarse.values = random_byte_values(coarse.values.size()), fine.values = random_byte_values(fine.values.size());
        const ldi::convolution_plan plan = ldi::plan_convolution(g, 3);
        const byte_view sources[] = {ldi::upsample(coarse, coarse_sample().map), fine};
        const ldi::quantized_source quantized[] = {{40, byte_input}, {20, byte_input}};
        ldi::buffer<std::uint8_t> result(g.size() * s.outputs);
        run(state, plan, byte_weights(s, ldi::best_isa(), quantized), std::span<const byte_view>(sources), result, masking::none,
            {.int8_products = s.products(plan)});
    });
    add("nn/upsample/stored at full size, 16 channels", [](benchmark::State& state) {
        ldi::feature_map coarse(coarse_sample().map.kept().size(), 16);
        coarse.values = random_floats(coarse.values.size());
        const double bytes = (4.0 * 16 + 4) * count(sample_graph()) + 4.0 * 16 * static_cast<double>(coarse.pixels());
        measure(state, pixels_text(sample_graph().size()), {.bytes = bytes},
                [&] { return ldi::concatenate({ldi::upsample(coarse, coarse_sample().map)}); });
    });
    add("nn/convolution_layer/3x3 16->16", [](benchmark::State& state) {
        const convolution_shape shape{3, 16, 16};
        const ldi::convolution_layer layer(random_floats(shape.weights()), random_floats(shape.outputs), {.after = ldi::relu});
        ldi::feature_map input(sample_graph().size(), shape.inputs);
        input.values = random_floats(input.values.size());
        const ldi::convolution_plan plan = ldi::plan_convolution(sample_graph(), 3);
        measure(state, size_of(plan), {.float_products = shape.products(plan)}, [&] { return layer(plan, input); });
    });
}

void add_packing() {
    const convolution_shape s{3, 60, 20};
    add("nn/pack_convolution/3x3 60->20", [s](benchmark::State& state) {
        const ldi::buffer<float> weights = random_floats(s.weights()), bias = random_floats(s.outputs);
        measure(state, std::to_string(s.weights()) + " weights", {.bytes = 8.0 * static_cast<double>(s.weights())},
                [&] { return ldi::pack_convolution(ldi::best_isa(), weights, bias, 3, ldi::relu); });
    });
    add("nn/pack_byte_convolution/3x3 60->20", [s](benchmark::State& state) {
        const ldi::buffer<float> weights = random_floats(s.weights()), bias = random_floats(s.outputs);
        const ldi::quantized_source source{s.inputs, byte_input};
        measure(state, std::to_string(s.weights()) + " weights", {.bytes = 5.0 * static_cast<double>(s.weights())}, [&] {
            return ldi::pack_byte_convolution(ldi::best_isa(), weights, bias, 3, ldi::relu, std::span(&source, 1), {0.1F, 10});
        });
    });
}

void add_plans() {
    const auto add_plan = [](const std::string& where, auto graph, std::int32_t kernel_size, bool halves) {
        const std::string k = std::to_string(kernel_size);
        add("nn/plan_convolution/" + where + " " + k + "x" + k + (halves ? " stride 2" : ""), [=](benchmark::State& state) {
            const ldi::graph& g = graph();
            const ldi::coarsened coarse = ldi::coarsen(g);
            ldi::convolution_plan plan;
            measure(state, pixels_text(g.size()), {.pixels = count(g)}, [&] {
                plan = halves ? ldi::plan_convolution(g, kernel_size, coarse.map) : ldi::plan_convolution(g, kernel_size);
            });
            state.SetLabel(size_of(plan));
            state.counters["pixels"] = count(g);
        });
    };
    for (const std::int32_t kernel_size : {3, 5, 7}) add_plan("ldi", on_sample, kernel_size, false);
    for (const std::int32_t kernel_size : {3, 7}) add_plan("ldi", on_sample, kernel_size, true);
    add_plan("image", on_image, 3, false);
    for (const std::int32_t side : {24, 4})
        add_plan(
            joined("squares of ", std::to_string(side)), [side]() -> const ldi::graph& { return squares(side); }, 3, false);
    add("nn/plan_convolution/region 3x3", [](benchmark::State& state) {
        ldi::pixel_region_builder rows(1152);
        for (std::int32_t y = 0; y < 1536; ++y) {
            for (std::int32_t x = y % 7; x + 40 < 1152; x += 120) rows.add_run(x, x + 40);
            rows.end_row();
        }
        const ldi::pixel_region region = std::move(rows).build();
        measure(state, pixels_text(region.size()), {.pixels = static_cast<double>(region.size())},
                [&] { return ldi::plan_convolution(region, 3); });
    });
}

/// Adds the functions that restrict a plan to unknown pixels, as the inpainting network does.
void add_subsets() {
    const auto unknown = [] {
        ldi::buffer<std::uint8_t> marks;
        for (const std::uint8_t known : sample().uncolored.column<ldi::known_column>()) marks.push_back(known == 0 ? 1 : 0);
        return marks;
    };
    const auto plan = [] { return ldi::plan_convolution(sample_graph(), 3); };
    add("nn/pixel_subset/marked", [=](benchmark::State& state) {
        const ldi::buffer<std::uint8_t> marks = unknown();
        measure(state, pixels_text(marks.size()), {.bytes = 1.25 * static_cast<double>(marks.size())},
                [&] { return ldi::pixel_subset::marked(marks); });
    });
    add("nn/restrict_to", [=](benchmark::State& state) {
        const ldi::convolution_plan whole = plan();
        const ldi::pixel_subset wanted = ldi::pixel_subset::marked(unknown());
        measure(state, pixels_text(wanted.size()), {.pixels = static_cast<double>(wanted.size())},
                [&] { return ldi::restrict_to(whole, wanted); });
    });
    add("nn/restrict_and_renumber", [=](benchmark::State& state) {
        const ldi::convolution_plan whole = plan();
        const ldi::buffer<std::int32_t> wanted = ldi::pixel_subset::marked(unknown()).pixels();
        measure(state, pixels_text(wanted.size()), {.pixels = static_cast<double>(wanted.size())},
                [&] { return ldi::restrict_and_renumber(whole, wanted); });
    });
    const auto restricted = [=] {
        const ldi::pixel_subset outputs = ldi::pixel_subset::marked(unknown());
        return ldi::restrict_to(plan(), outputs);
    };
    add("nn/mark_needed_inputs", [=](benchmark::State& state) {
        const ldi::convolution_plan some = restricted();
        ldi::buffer<std::uint8_t> marks(some.input_count(), 0);
        measure(state, pixels_text(marks.size()), {.pixels = static_cast<double>(marks.size())},
                [&] { ldi::mark_needed_inputs(some, marks); });
    });
    add("nn/needed_inputs", [=](benchmark::State& state) {
        const ldi::convolution_plan some = restricted();
        measure(state, pixels_text(some.input_count()), {.pixels = static_cast<double>(some.input_count())},
                [&] { return ldi::needed_inputs(some); });
    });
    const auto subsets = [=](const ldi::convolution_plan& some) {
        ldi::buffer<std::uint8_t> marks(some.input_count(), 0);
        ldi::mark_needed_inputs(some, marks);
        return std::pair(ldi::pixel_subset::marked(unknown()), ldi::pixel_subset::marked(marks));
    };
    add("nn/renumber_inputs", [=](benchmark::State& state) {
        const ldi::convolution_plan some = restricted();
        const auto [outputs, inputs] = subsets(some);
        const ldi::pixel_subset& read = inputs;
        measure(state, pixels_text(read.size()), {.pixels = static_cast<double>(read.size())},
                [&] { return ldi::renumber_inputs(some, read); });
    });
    add("nn/on_subsets", [=](benchmark::State& state) {
        const ldi::convolution_plan some = restricted();
        const auto [outputs, inputs] = subsets(some);
        const ldi::pixel_subset &written = outputs, &read = inputs;
        measure(state, pixels_text(written.size()), {.pixels = static_cast<double>(written.size())},
                [&] { return ldi::on_subsets(some, written, read); });
    });
}

constexpr std::size_t channels = 16;

ldi::feature_map floats(std::size_t pixels) {
    ldi::feature_map map(pixels, channels);
    map.values = random_floats(map.values.size());
    return map;
}
byte_map bytes(std::size_t pixels) {
    byte_map map(pixels, channels, byte_input.zero_point);
    map.values = random_byte_values(map.values.size());
    return map;
}

/// Adds an operator on a map with 16 channels, in float32 and in bytes.
///
/// values   number of values read and written per value of the map
/// indices  bytes of indices read per pixel
template <class Operator>
void add_both(const std::string& name, double values, double indices, Operator run_on) {
    add(name + ", float32", [=](benchmark::State& state) {
        const ldi::feature_map map = floats(sample_graph().size());
        measure(state, pixels_text(map.pixels()),
                {.bytes = (4 * values * channels + indices) * static_cast<double>(map.pixels())}, [&] { return run_on(map); });
    });
    add(name + ", int8", [=](benchmark::State& state) {
        const byte_map map = bytes(sample_graph().size());
        measure(state, pixels_text(map.pixels()), {.bytes = (values * channels + indices) * static_cast<double>(map.pixels())},
                [&] { return run_on(map); });
    });
}

/// Registers a benchmark of an operator that modifies a float32 map with 16 channels in place.
///
/// values  number of values read and written per value of the map
template <class Operator>
void add_in_place(const std::string& name, double values, Operator run_on) {
    add(name + ", float32", [=](benchmark::State& state) {
        ldi::feature_map map = floats(sample_graph().size());
        measure(state, pixels_text(map.pixels()), {.bytes = 4 * values * static_cast<double>(map.values.size())},
                [&] { map = run_on(std::move(map)); });
    });
}

void add_elementwise() {
    add_both("nn/average_pool/16 channels", 1.25, 4, [](const auto& map) { return ldi::average_pool(map, coarse_sample().map); });
    add_both("nn/max_pool/16 channels", 1.25, 4, [](const auto& map) { return ldi::max_pool(map, coarse_sample().map); });
    add_both("nn/concatenate/16 + 16 channels", 3, 0, [](const auto& map) { return ldi::concatenate({map, map}); });
    add_in_place("nn/add/16 channels", 3, [](ldi::feature_map map) {
        static const ldi::feature_map other = floats(sample_graph().size());
        return ldi::add(std::move(map), other);
    });
    add("nn/add/16 channels, int8", [](benchmark::State& state) {
        byte_map a = bytes(sample_graph().size());
        const byte_map b = a;
        // Half of these sums end in .5, which float arithmetic rounds to even, so the kernel adds in integers.
        const ldi::add_u8_constants sum =
            ldi::prepare_add_u8(ldi::best_isa(), ldi::make_quantized_addition(byte_input, byte_input, {0.02F, 128}));
        measure(state, pixels_text(a.pixels()), {.bytes = 3.0 * static_cast<double>(a.values.size())},
                [&] { a = ldi::add(std::move(a), b, sum); });
    });
    add_in_place("nn/activate/relu, 16 channels", 2,
                 [](ldi::feature_map map) { return ldi::activate(std::move(map), ldi::relu); });
    add("nn/activate/relu, 16 channels, int8", [](benchmark::State& state) {
        byte_map map = bytes(sample_graph().size());
        measure(state, pixels_text(map.pixels()), {.bytes = 2.0 * static_cast<double>(map.values.size())},
                [&] { map = ldi::activate(std::move(map), ldi::relu); });
    });
    add_in_place("nn/sigmoid/16 channels", 2, [](ldi::feature_map map) { return ldi::sigmoid(std::move(map)); });
    add_in_place("nn/tanh/16 channels", 2, [](ldi::feature_map map) { return ldi::tanh(std::move(map)); });
    add("nn/quantize/16 channels", [](benchmark::State& state) {
        const ldi::feature_map map = floats(sample_graph().size());
        measure(state, pixels_text(map.pixels()), {.bytes = 5.0 * static_cast<double>(map.values.size())},
                [&] { return ldi::quantize(map, byte_input); });
    });
    add("nn/dequantize/16 channels", [](benchmark::State& state) {
        const byte_map map = bytes(sample_graph().size());
        measure(state, pixels_text(map.pixels()), {.bytes = 5.0 * static_cast<double>(map.values.size())},
                [&] { return ldi::dequantize(map, byte_input); });
    });
    add("nn/from_column/color", [](benchmark::State& state) {
        const ldi::working_layers<>& layers = sample().uncolored;
        measure(state, pixels_text(layers.size()), {.bytes = 15.0 * static_cast<double>(layers.size())},
                [&] { return ldi::from_column<ldi::color_column>(layers, 1.0F / 255.0F); });
    });
    add("nn/to_column/color", [](benchmark::State& state) {
        ldi::working_layers<> layers = sample().uncolored;
        const ldi::feature_map map = ldi::from_column<ldi::color_column>(layers);
        measure(state, pixels_text(layers.size()), {.bytes = 15.0 * static_cast<double>(layers.size())},
                [&] { ldi::to_column<ldi::color_column>(map, layers); });
    });
}

const bool registered = [] {
    add_plans();
    add_convolutions();
    add_upsampling();
    add_packing();
    add_subsets();
    add_elementwise();
    return true;
}();

}  // namespace
