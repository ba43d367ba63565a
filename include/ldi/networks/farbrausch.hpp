// Farbrausch, the inpainting network of the paper (section "LDI Inpainting"): a partial-convolution U-Net trained on images and
// run on the links of a layered image. examples/training/farbrausch/README.md says what it computes, step by step;
// io/farbrausch_file.hpp loads it from a file.
#pragma once

#include <ldi/core/error.hpp>
#include <ldi/core/executor.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/networks/detail/farbrausch_work.hpp>
#include <ldi/networks/detail/smooth_fills.hpp>
#include <ldi/nn/ldi_convolution.hpp>
#include <ldi/nn/weights.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace ldi {

/// What a file of weights says of its network; the defaults are the network that examples/training/farbrausch trains.
struct farbrausch_architecture {
    std::vector<std::size_t> channels{20, 40, 56, 72, 80};  ///< of each encoder stage's result
    std::vector<std::int32_t> kernels{7, 5, 5, 3, 3};       ///< of each encoder stage; the decoder's are 3
    int growth = 4;                                         ///< passes that carry colours on at the coarsest level
    float leak = 0.2F;                                      ///< of the decoder's activation, below 0
};

/// What a network computes with. Colours that were inpainted differ from those in float32 by less than can be seen:
/// bench/README.md has figures.
enum class arithmetic {
    float32,
    bfloat16,  ///< values and weights of 8 significant bits, sums in float32: faster, in half the memory, where
               ///< multiplies_bfloat16(best_isa())
};

/// The name as options of programs spell it.
constexpr std::string_view to_string(arithmetic kind) { return kind == arithmetic::bfloat16 ? "bfloat16" : "float32"; }

/// The fastest that this machine has.
inline arithmetic fastest_arithmetic(isa target = best_isa()) {
    return target != isa::scalar && multiplies_bfloat16(target) ? arithmetic::bfloat16 : arithmetic::float32;
}

/// A colour_inpainter (photo3d.hpp). All members are const and keep no state: one object serves any number of threads at once.
class farbrausch {
public:
    /// weights  for each stage `encoder.I.weight`, outputs x inputs x k x k, and `encoder.I.bias`; the same for `decoder.I`,
    /// which
    ///          reads the channels of the coarser level first, then the encoder's. Batch normalisation folded in
    /// kind     what it computes with; fastest_arithmetic() is one that is always there
    /// target   the instruction set to pack weights for; results agree to rounding
    ///
    /// Errors: mismatch, naming the tensor that is missing, of another type or shape, or one too many; invalid_data for weights
    /// that are not finite; unsupported for an architecture out of bounds, and for an arithmetic that the instruction set does
    /// not have.
    explicit farbrausch(const named_tensors& weights, farbrausch_architecture architecture = {},
                        arithmetic kind = arithmetic::float32, isa target = best_isa());

    /// layers  in canonical order; the colour of every pixel whose known_column is 0 is set
    /// watcher is told of progress as stage "colour inpainting"
    template <executor Executor>
    void inpaint(photo_layers& layers, Executor& threads, const observer& watcher = {}) const;

    /// colour  H x W x 3, red, green, blue, 0 to 255
    /// known   H x W x 1, 0 where the colour is to be inpainted
    /// Returns the image with every colour that is not known inpainted: the same network on a single, fully linked layer.
    template <executor Executor>
    image<std::uint8_t> inpaint(const image<std::uint8_t>& colour, const image<std::uint8_t>& known, Executor& threads,
                                const observer& watcher = {}) const;

    /// The network's own result, not clamped: for each pixel whose place in `wanted` is not 0, in their order, red, green and
    /// blue, in [0, 1] as it learned them.
    ///
    /// wanted  one a pixel; not 0 wherever known_column is 0
    /// The bits of a pixel's result do not depend on which others are wanted.
    template <executor Executor>
    std::vector<float> colours(const photo_layers& layers, std::span<const std::uint8_t> wanted, Executor& threads,
                               const observer& watcher = {}) const;

    const farbrausch_architecture& architecture() const { return architecture_; }

private:
    static constexpr std::size_t input_channels = 4, output_channels = 3;
    static constexpr std::size_t most_levels = 8, most_channels = 1024;
    static constexpr int most_growth = 64;
    static constexpr const char* stage_name = "colour inpainting";

    /// Rows of channels; not set to zero first.
    template <class Value>
    struct feature_map {
        std::size_t channels = 0, count = 0;
        std::unique_ptr<Value[]> values;

        feature_map() = default;
        feature_map(std::size_t rows, std::size_t channel_count)
            : channels(channel_count), count(rows * channel_count), values(new Value[count]) {}
        std::span<Value> span() { return {values.get(), count}; }
        std::span<const Value> span() const { return {values.get(), count}; }
    };

    /// One convolution a level: from it to the next, and back.
    template <class Weights>
    struct convolutions {
        std::vector<Weights> encoder, decoder;
    };

    std::size_t depth() const { return architecture_.channels.size(); }
    std::size_t skip_channels(std::size_t level) const { return level == 0 ? input_channels : architecture_.channels[level - 1]; }

    static void check(const farbrausch_architecture& architecture);

    /// pack  makes weights of a layer's values, biases, kernel size and activation
    template <class Weights, class Pack>
    convolutions<Weights> pack_all(const named_tensors& weights, Pack&& pack) const;

    /// The last layer's results: what is added to the fills.
    template <class Weights, executor Executor, class Report>
    std::vector<float> corrections(const convolutions<Weights>& layers, detail::masked_colours input,
                                   std::vector<detail::farbrausch_level>& levels, Executor& threads, Report&& report) const;

    farbrausch_architecture architecture_;
    std::variant<convolutions<conv_f32_weights>, convolutions<conv_bf16_weights>> layers_;
};

inline void farbrausch::check(const farbrausch_architecture& a) {
    const auto expect = [](bool holds, const char* what, const char* expected, const std::string& found) {
        if (!holds)
            raise(error_code::unsupported, std::string("architecture of the inpainting network, ") + what, expected, found);
    };
    expect(!a.channels.empty() && a.channels.size() <= most_levels, "channels", "1 to 8 stages",
           std::to_string(a.channels.size()));
    expect(a.kernels.size() == a.channels.size(), "kernels", "one for each stage", std::to_string(a.kernels.size()));
    for (const std::size_t count : a.channels)
        expect(count >= 1 && count <= most_channels, "channels", "1 to 1024 each", std::to_string(count));
    for (const std::int32_t size : a.kernels)
        expect(size >= 3 && size <= largest_kernel_size && size % 2 == 1, "kernels", "odd numbers from 3 to 15",
               std::to_string(size));
    expect(a.growth >= 0 && a.growth <= most_growth, "growth", "0 to 64", std::to_string(a.growth));
    expect(a.leak >= 0.0F && a.leak <= 1.0F, "leak", "0 to 1", std::to_string(a.leak));
}

inline farbrausch::farbrausch(const named_tensors& weights, farbrausch_architecture architecture, arithmetic kind, isa target)
    : architecture_(std::move(architecture)) {
    check(architecture_);
    if (kind == arithmetic::bfloat16 && !multiplies_bfloat16(target))
        raise(error_code::unsupported, "arithmetic of the inpainting network",
              "float32, because no instructions of this set multiply bfloat16 numbers",
              "bfloat16 with " + std::string(to_string(target)));
    if (kind == arithmetic::bfloat16)
        layers_ = pack_all<conv_bf16_weights>(weights,
                                              [&](const auto&... layer) { return pack_bfloat16_convolution(target, layer...); });
    else
        layers_ = pack_all<conv_f32_weights>(weights, [&](const auto&... layer) { return pack_convolution(target, layer...); });
}

template <class Weights, class Pack>
farbrausch::convolutions<Weights> farbrausch::pack_all(const named_tensors& weights, Pack&& pack) const {
    std::vector<std::string> names;
    const auto take = [&](const std::string& name, std::vector<std::size_t> shape) -> const std::vector<float>& {
        names.push_back(name);
        const std::vector<float>& values = tensor_values<float>(weights, name, shape);
        if (!std::all_of(values.begin(), values.end(), [](float v) { return std::isfinite(v); }))
            raise(error_code::invalid_data, detail::tensor_place(weights, name), "finite values", "others");
        return values;
    };
    const auto stage = [&](const std::string& name, std::size_t inputs, std::size_t outputs, std::int32_t kernel,
                           activation after) {
        const std::size_t k = static_cast<std::size_t>(kernel);
        const std::vector<float>& values = take(name + ".weight", {outputs, inputs, k, k});
        return pack(values, take(name + ".bias", {outputs}), kernel, after);
    };
    convolutions<Weights> result;
    for (std::size_t i = 0; i < depth(); ++i)
        result.encoder.push_back(
            stage("encoder." + std::to_string(i), skip_channels(i), architecture_.channels[i], architecture_.kernels[i], relu));
    result.decoder.resize(depth());
    for (std::size_t i = depth(); i-- > 0;)
        result.decoder[i] =
            stage("decoder." + std::to_string(depth() - 1 - i), architecture_.channels[i] + skip_channels(i),
                  i == 0 ? output_channels : skip_channels(i), 3, i == 0 ? no_activation : leaky_relu(architecture_.leak));
    check_no_others(weights, names);
    return result;
}

template <executor Executor>
std::vector<float> farbrausch::colours(const photo_layers& layers, std::span<const std::uint8_t> wanted, Executor& threads,
                                       const observer& watcher) const {
    LDI_ASSERT(wanted.size() == layers.size());
    std::vector<detail::farbrausch_level> levels = detail::plan_farbrausch(layers.topology, architecture_.kernels, wanted);
    watcher.report(stage_name, 0.1F);
    detail::smooth_fills fills = detail::smooth_filler(layers, levels, architecture_.growth, threads).run();
    for (detail::farbrausch_level& level : levels) {
        level.average = level.average_coarse = {};
        level.above = {};
    }

    // Progress by multiplications, roughly: the fine levels take most of the time.
    float done = 0.2F;
    const auto report = [&] { watcher.report(stage_name, done = std::min(done + 0.08F, 1.0F)); };
    report();
    const std::vector<float> corrections = std::visit(
        [&](const auto& packed) { return this->corrections(packed, std::move(fills.input), levels, threads, report); }, layers_);
    for (std::size_t v = 0; v < fills.fill.size(); ++v) fills.fill[v] += corrections[v];
    return std::move(fills.fill);
}

template <class Weights, executor Executor, class Report>
std::vector<float> farbrausch::corrections(const convolutions<Weights>& layers, detail::masked_colours input,
                                           std::vector<detail::farbrausch_level>& levels, Executor& threads,
                                           Report&& report) const {
    using value_type = typename Weights::value_type;
    using source = basic_convolution_source<value_type>;
    std::vector<feature_map<value_type>> encoded(depth() + 1);
    if constexpr (!std::is_same_v<value_type, float>) {
        encoded[0] = feature_map<value_type>(levels[0].read.size(), input_channels);
        std::transform(input.values().begin(), input.values().end(), encoded[0].values.get(), to_bfloat16);
        input = {};
    }
    const auto read = [&](std::size_t level) {
        if constexpr (std::is_same_v<value_type, float>)
            if (level == 0) return source{input.values(), input_channels, {}, {}};
        return source{std::as_const(encoded[level]).span(), skip_channels(level), {}, {}};
    };
    for (std::size_t i = 0; i < depth(); ++i) {
        encoded[i + 1] = feature_map<value_type>(levels[i + 1].read.size(), architecture_.channels[i]);
        const source sources[] = {read(i)};
        convolve_partially(levels[i].encode, layers.encoder[i], sources, encoded[i + 1].span(), {}, threads);
        levels[i].encode = {};
        report();
    }
    feature_map<value_type> coarser = std::move(encoded[depth()]);
    std::vector<float> result;
    for (std::size_t i = depth(); i-- > 0;) {
        const source sources[] = {{std::as_const(coarser).span(), coarser.channels, levels[i].decoded_above, {}}, read(i)};
        if (i == 0) {
            result.resize(levels[0].decoded.size() * output_channels);
            convolve_partially(levels[i].decode, layers.decoder[i], sources, result, {}, threads);
        } else {
            feature_map<value_type> finer(levels[i].decoded.size(), layers.decoder[i].outputs);
            convolve_partially(levels[i].decode, layers.decoder[i], sources, finer.span(), {}, threads);
            coarser = std::move(finer);
        }
        encoded[i] = {};
        levels[i].decode = {};
        report();
    }
    return result;
}

template <executor Executor>
void farbrausch::inpaint(photo_layers& layers, Executor& threads, const observer& watcher) const {
    const std::vector<std::uint8_t>& known = layers.column<known_column>();
    std::vector<std::uint8_t> wanted(known.size());
    std::transform(known.begin(), known.end(), wanted.begin(), [](std::uint8_t k) { return static_cast<std::uint8_t>(k == 0); });
    const std::vector<float> values = colours(layers, wanted, threads, watcher);
    std::vector<std::uint8_t>& colour = layers.column<colour_column>();
    std::size_t next = 0;
    for (std::size_t i = 0; i < wanted.size(); ++i)
        for (std::size_t c = 0; wanted[i] != 0 && c < output_channels; ++c)
            colour[3 * i + c] = static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(values[next++], 0.0F, 1.0F)));
}

template <executor Executor>
image<std::uint8_t> farbrausch::inpaint(const image<std::uint8_t>& colour, const image<std::uint8_t>& known, Executor& threads,
                                        const observer& watcher) const {
    LDI_ASSERT(channels(colour) == 3 && channels(known) == 1 && height(colour) == height(known) && width(colour) == width(known));
    photo_layers layers(make_grid(static_cast<std::int32_t>(width(colour)), static_cast<std::int32_t>(height(colour))));
    std::copy(colour.begin(), colour.end(), layers.column<colour_column>().begin());
    std::copy(known.begin(), known.end(), layers.column<known_column>().begin());
    inpaint(layers, threads, watcher);
    image<std::uint8_t> result = make_image<std::uint8_t>(height(colour), width(colour), 3);
    std::copy(layers.column<colour_column>().begin(), layers.column<colour_column>().end(), result.begin());
    return result;
}

}  // namespace ldi
