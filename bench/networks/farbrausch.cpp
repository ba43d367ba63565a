// The inpainting network on layered images, on one thread, in both number formats: milliseconds of every step, the share of
// pixels computed at every level, the peak of its working memory, and the difference of the inpainted colors from float32.
//
// ldi_bench_networks_farbrausch               a real photo at 1152 x 1536, and the sample, which has more hidden surfaces
// ldi_bench_networks_farbrausch LONG_SIDE...  the photo at these sizes, one line each, for a plot
// ldi_bench_networks_farbrausch full-size     compared with the full-size PartialConv, as in the paper's table: weights,
//                                             multiplications, and times on a whole picture of 512 x 512 and on the layers
//                                             of the photo
#include <bench/support/converted_photo.hpp>
#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/weight_files.hpp>
#include <ldi/networks/farbrausch.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace {

// Bytes that buffers occupy now, and the peak of this number.
std::size_t bytes_now = 0, bytes_peak = 0;

void* counted_allocate(void* /*context*/, std::size_t bytes, std::size_t alignment) {
    void* const memory = std::aligned_alloc(alignment, (bytes + alignment - 1) / alignment * alignment);
    if (memory != nullptr) bytes_peak = std::max(bytes_peak, bytes_now += bytes);
    return memory;
}

void counted_release(void* /*context*/, void* memory, std::size_t bytes) {
    bytes_now -= bytes;
    std::free(memory);
}

const ldi::memory counted_memory{nullptr, counted_allocate, counted_release};

using clock = std::chrono::steady_clock;

double milliseconds(clock::duration d) { return std::chrono::duration<double, std::milli>(d).count(); }

ldi::farbrausch network_with(ldi::arithmetic kind) {
    return ldi::load_farbrausch(std::filesystem::path(LDI_SOURCE_DIR) / "examples/models/farbrausch.safetensors", kind);
}

/// Makes the full-size network with random weights, because no trained weights are available. Time does not depend on the
/// weights.
ldi::farbrausch full_size_network(ldi::arithmetic kind) {
    const ldi::inpainting_architecture a = ldi::partial_convolution_architecture();
    ldi::named_tensors weights;
    std::mt19937 random(1);
    const auto add = [&](const std::string& name, std::size_t k, std::size_t inputs, std::size_t outputs) {
        ldi::buffer<float> values(outputs * inputs * k * k);
        std::normal_distribution<float> normal(0.0F, std::sqrt(2.0F / static_cast<float>(inputs * k * k)));
        for (float& v : values) v = normal(random);
        weights.tensors[name + ".weight"] = {{outputs, inputs, k, k}, std::move(values)};
        weights.tensors[name + ".bias"] = {{outputs}, ldi::buffer<float>(outputs)};
    };
    const std::size_t depth = a.channels.size();
    for (std::size_t i = 0; i < depth; ++i) {
        add("encoder." + std::to_string(i), static_cast<std::size_t>(a.kernels[i]), a.inputs(i), a.channels[i]);
        add("decoder." + std::to_string(depth - 1 - i), 3, a.channels[i] + a.inputs(i), i == 0 ? 3 : a.inputs(i));
    }
    return ldi::farbrausch(weights, a, kind);
}

constexpr ldi::arithmetic arithmetics[] = {ldi::arithmetic::float32, ldi::arithmetic::int8};

struct measurement {
    ldi::buffer<ldi::buffer<double>> steps;  ///< per run
    ldi::buffer<double> whole;
    std::size_t peak_bytes = 0;
};

double median(ldi::buffer<double> values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

measurement measure(const ldi::farbrausch& network, const ldi::photo_layers& layers, const ldi::buffer<std::uint8_t>& wanted,
                    int runs) {
    measurement result;
    ldi::serial_executor serial;
    const ldi::memory_scope counts(counted_memory);
    for (int run = 0; run < runs; ++run) {
        struct timer {
            clock::time_point last;
            ldi::buffer<double> steps;
        } t{clock::now(), {}};
        ldi::progress_listener watcher;
        watcher.user = &t;
        watcher.on_progress = [](void* user, std::string_view, float) {
            timer& self = *static_cast<timer*>(user);
            const clock::time_point now = clock::now();
            self.steps.push_back(milliseconds(now - self.last));
            self.last = now;
        };
        bytes_peak = bytes_now;
        const std::size_t before = bytes_now;
        const clock::time_point start = clock::now();
        network.colors(layers, wanted, watcher, serial);
        result.whole.push_back(milliseconds(clock::now() - start));
        result.steps.push_back(t.steps);
        result.peak_bytes = bytes_peak - before;
    }
    return result;
}

ldi::buffer<std::uint8_t> unknown_of(const ldi::photo_layers& layers) {
    ldi::buffer<std::uint8_t> unknown;
    for (const std::uint8_t known : layers.column<ldi::known_column>()) unknown.push_back(known == 0 ? 1 : 0);
    return unknown;
}

struct layer_cost {
    std::string name;
    std::size_t weights, products;
};

/// Lists the network's layers in order of execution.
std::vector<layer_cost> layer_costs(const ldi::inpainting_architecture& a,
                                    const ldi::buffer<ldi::detail::farbrausch_level>& levels) {
    std::vector<layer_cost> result;
    const auto add = [&](const std::string& name, std::size_t pixels, std::size_t weights) {
        result.push_back({name, weights, pixels * weights});
    };
    const std::size_t depth = a.channels.size();
    for (std::size_t i = 0; i < depth; ++i) {
        const std::size_t k = static_cast<std::size_t>(a.kernels[i]);
        add("encoder." + std::to_string(i), levels[i].encode.output_count(), k * k * a.inputs(i) * a.channels[i]);
    }
    for (std::size_t i = depth; i-- > 0;)
        add("decoder." + std::to_string(depth - 1 - i), levels[i].decode.output_count(),
            9 * (a.channels[i] + a.inputs(i)) * (i == 0 ? 3 : a.inputs(i)));
    return result;
}

void print_steps(const ldi::farbrausch& network, const ldi::photo_layers& layers, const measurement& m) {
    const ldi::inpainting_architecture& a = network.architecture();
    const std::size_t depth = a.channels.size();
    const auto levels = ldi::detail::plan_farbrausch(layers.topology(), a.kernels, unknown_of(layers));
    std::printf("%-12s %10s %8s %8s\n", "step", "median ms", "minimum", "GMAC/s");
    double products_in_all = 0;
    const std::vector<layer_cost> costs = layer_costs(a, levels);
    for (std::size_t s = 0; s < m.steps[0].size(); ++s) {
        ldi::buffer<double> times;
        for (const auto& run : m.steps) times.push_back(run[s]);
        const layer_cost cost = s == 0 ? layer_cost{"plans", 0, 0} : s == 1 ? layer_cost{"smooth fills", 0, 0} : costs[s - 2];
        products_in_all += static_cast<double>(cost.products);
        const double fewest = *std::min_element(times.begin(), times.end());
        std::printf("%-12s %10.2f %8.2f", cost.name.c_str(), median(times), fewest);
        std::printf(cost.products == 0 ? "\n" : " %8.1f\n", static_cast<double>(cost.products) / fewest / 1e6);
    }
    std::printf("\n%-6s %10s %18s %18s\n", "level", "pixels", "encoder computes", "decoder computes");
    for (std::size_t i = 0; i <= depth; ++i) {
        const double all = static_cast<double>(levels[i].pixel_count);
        std::printf("%-6zu %10zu", i, levels[i].pixel_count);
        const std::size_t read = i < depth ? levels[i].encode.input_count() : levels[i - 1].encode.output_count();
        std::printf(i == 0 ? " %10.1f %% (read)" : " %16.1f %%", 100.0 * static_cast<double>(read) / all);
        if (i < depth) std::printf(" %16.1f %%", 100.0 * static_cast<double>(levels[i].decode.output_count()) / all);
        std::printf("\n");
    }
    std::printf("\n%.2f GMAC\n", products_in_all / 1e9);
}

/// PSNR of inpainted colors relative to float32, in dB.
double peak_signal_to_noise(const ldi::farbrausch& network, const ldi::farbrausch& exact, const ldi::photo_layers& layers) {
    ldi::serial_executor serial;
    const ldi::buffer<std::uint8_t> unknown = unknown_of(layers);
    const ldi::buffer<float> a = network.colors(layers, unknown, {}, serial), b = exact.colors(layers, unknown, {}, serial);
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
        sum += std::pow(double{std::clamp(a[i], 0.0F, 1.0F)} - double{std::clamp(b[i], 0.0F, 1.0F)}, 2.0);
    return -10.0 * std::log10(sum / static_cast<double>(a.size()));
}

void run(const char* name, const ldi::photo_layers& layers, int runs, bool in_detail) {
    const ldi::buffer<std::uint8_t> unknown = unknown_of(layers);
    const ldi::farbrausch exact = network_with(ldi::arithmetic::float32);
    for (const ldi::arithmetic kind : std::span(arithmetics).first(in_detail ? 2 : 1)) {
        const ldi::farbrausch network = network_with(kind);
        const measurement m = measure(network, layers, unknown, runs);
        if (in_detail) print_steps(network, layers, m);
        std::printf("%s, %d x %d, %zu pixels, %zu unknown, %s: median %.1f ms, minimum %.1f; peak %.1f MB", name,
                    layers.topology().width(), layers.topology().height(), layers.size(),
                    static_cast<std::size_t>(std::count(unknown.begin(), unknown.end(), std::uint8_t{1})),
                    std::string(to_string(kind)).c_str(), median(m.whole), *std::min_element(m.whole.begin(), m.whole.end()),
                    static_cast<double>(m.peak_bytes) / 1e6);
        if (kind == ldi::arithmetic::float32)
            std::printf("\n");
        else
            std::printf("; %.1f dB from float32\n", peak_signal_to_noise(network, exact, layers));
        if (in_detail) std::printf("\n");
        std::fflush(stdout);
    }
}

ldi::photo_layers photo_at(std::size_t long_side) {
    ldi::photo3d_options options;
    options.long_side = long_side;
    options.frame = ldi::photo_frame::crop;
    return ldi_bench::converted_photo(options).layers;
}

ldi::photo_layers sample() {
    const std::filesystem::path folder = std::filesystem::path(LDI_SOURCE_DIR) / "examples/photo3d";
    ldi::photo3d_options options;
    options.normalize.is_inverse_depth = false;
    options.frame = ldi::photo_frame::crop;  // the network does not color pixels past the frame
    const ldi::given_disparity depth{ldi::fill_invalid(ldi::load_depth_map(folder / "sample_depth.png"))};
    return ldi::make_photo3d(ldi::load_photo(folder / "sample.jpg").color, depth, ldi::diffusion_inpainter(), options).layers;
}

/// Makes a picture with a hole in the middle.
ldi::photo_layers whole_picture(std::int32_t side) {
    ldi::photo_layers layers(ldi::make_grid(side, side));
    std::mt19937 random(2);
    for (std::uint8_t& c : layers.column<ldi::color_column>()) c = static_cast<std::uint8_t>(random());
    for (std::int32_t y = 0; y < side; ++y)
        for (std::int32_t x = 0; x < side; ++x)
            layers.column<ldi::known_column>()[side * y + x] =
                std::max(std::abs(x - side / 2), std::abs(y - side / 2)) < side / 8 ? 0 : 1;
    return layers;
}

void compare_with_full_size() {
    const ldi::photo_layers picture = whole_picture(512), photo = photo_at(1536);
    std::printf("%-11s %-9s %9s %9s %14s %9s %12s %9s %8s\n", "network", "computes", "weights", "MiB", "GMAC, picture", "ms",
                "GMAC, photo", "ms", "peak MB");
    for (const auto& [name, make] : {std::pair{"Farbrausch", &network_with}, std::pair{"PartialConv", &full_size_network}})
        for (const ldi::arithmetic kind : arithmetics) {
            // int8 requires measured ranges of values, which random weights lack.
            if (make == &full_size_network && kind == ldi::arithmetic::int8) continue;
            const ldi::farbrausch network = make(kind);
            double giga[2] = {}, fewest[2] = {};
            std::size_t weights = 0, peak = 0, which = 0;
            for (const ldi::photo_layers* layers : {&picture, &photo}) {
                weights = 0;
                const ldi::inpainting_architecture& a = network.architecture();
                // Computes all pixels of the picture, as published counts of multiplications do.
                const ldi::buffer<std::uint8_t> wanted =
                    layers == &picture ? ldi::buffer<std::uint8_t>(picture.size(), 1) : unknown_of(photo);
                for (const layer_cost& cost :
                     layer_costs(a, ldi::detail::plan_farbrausch(layers->topology(), a.kernels, wanted))) {
                    giga[which] += static_cast<double>(cost.products) / 1e9;
                    weights += cost.weights;
                }
                const measurement m = measure(network, *layers, wanted, 3);
                fewest[which++] = *std::min_element(m.whole.begin(), m.whole.end());
                peak = m.peak_bytes;
            }
            std::printf("%-11s %-9s %9zu %9.1f %14.2f %9.1f %12.2f %9.1f %8.1f\n", name, std::string(to_string(kind)).c_str(),
                        weights, static_cast<double>(4 * weights) / (1 << 20), giga[0], fewest[0], giga[1], fewest[1],
                        static_cast<double>(peak) / 1e6);
            std::fflush(stdout);
        }
}

}  // namespace

int main(int count, char** values) {
    if (count == 2 && std::string(values[1]) == "full-size") {
        compare_with_full_size();
        return 0;
    }
    for (int i = 1; i < count; ++i) run("photo", photo_at(std::strtoul(values[i], nullptr, 10)), 5, false);
    if (count > 1) return 0;
    run("photo", photo_at(1536), 15, true);
    run("sample", sample(), 9, true);
    return 0;
}
