// Farbrausch, the inpainting network of the paper (section "LDI Inpainting"): a partial-convolution U-Net trained on images and
// run on the links of a layered image. examples/training/farbrausch/README.md says what it computes, step by step;
// formats/farbrausch_file.hpp loads it from a file.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/memory.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/networks/detail/farbrausch_weights.hpp>
#include <ldi/networks/detail/farbrausch_work.hpp>
#include <ldi/networks/detail/smooth_fills.hpp>
#include <ldi/networks/farbrausch_architecture.hpp>
#include <ldi/nn/ldi/convolution.hpp>
#include <ldi/nn/ldi/feature_map.hpp>
#include <ldi/nn/ldi/weights.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>

namespace ldi::inline LDI_CONFIGURATION {

/// A color_inpainter (photo3d.hpp). All members are const and keep no state: one object serves any number of threads at once.
class farbrausch {
public:
    /// weights  for each stage `encoder.I.weight`, outputs x inputs x k x k, and `encoder.I.bias`, batch normalization folded
    ///          in; the same for `decoder.I`, which reads the channels of the coarser level first, then the encoder's. For int8
    ///          also `input.range`, `encoder.I.range` and, but for the last, `decoder.I.range`: the least and the greatest value
    ///          to be told apart, which examples/training/farbrausch/export.py finds
    /// kind     what it computes with; best_arithmetic() is one that is always there
    /// target   the instruction set to pack weights for; results agree to rounding
    ///
    /// Raises mismatch, naming the tensor that is missing, of another type or shape, or one too many; invalid_data for weights
    /// that are not finite; unsupported for an architecture out of bounds, and for an arithmetic that the instruction set does
    /// not have.
    explicit farbrausch(const named_tensors& weights, farbrausch_architecture architecture = {},
                        arithmetic kind = arithmetic::float32, isa target = best_isa());

    /// layers  in canonical order; the color of every pixel whose known_column is 0 is set
    /// progress  is told of stage "color inpainting"
    template <has_columns<color_column, known_column> Layers, executor Executor = const serial_executor>
    void inpaint(Layers& layers, const progress_listener& progress = {}, Executor&& threads = {}) const;

    /// color  H x W x 3, red, green, blue, 0 to 255
    /// known  H x W x 1, 0 where the color is to be inpainted
    /// Returns the image with every color that is not known inpainted: the same network on a single, fully linked layer.
    template <executor Executor = const serial_executor>
    image<std::uint8_t> inpaint(image_view<const std::uint8_t> color, image_view<const std::uint8_t> known,
                                const progress_listener& progress = {}, Executor&& threads = {}) const;

    /// The network's own result, not clamped: for each pixel whose place in `wanted` is not 0, in their order, red, green and
    /// blue, in [0, 1] as it learned them.
    ///
    /// wanted  K, one per pixel; not 0 wherever known_column is 0
    /// The bits of a pixel's result do not depend on which others are wanted.
    template <has_columns<color_column, known_column> Layers, executor Executor = const serial_executor>
    buffer<float> colors(const Layers& layers, std::span<const std::uint8_t> wanted, const progress_listener& progress = {},
                         Executor&& threads = {}) const;

    const farbrausch_architecture& architecture() const { return architecture_; }

private:
    static constexpr std::size_t input_channels = 4, output_channels = 3;
    static constexpr const char* stage_name = "color inpainting";

    std::size_t depth() const { return architecture_.channels.size(); }

    /// The last layer's results: what is added to the fills.
    template <class Weights, executor Executor, class Report>
    buffer<float> corrections(const detail::farbrausch_convolutions<Weights>& layers, detail::masked_colors input,
                              buffer<detail::farbrausch_level>& levels, Executor& threads, Report&& report) const;

    farbrausch_architecture architecture_;
    std::variant<detail::farbrausch_convolutions<conv_f32_weights>, detail::farbrausch_convolutions<conv_bf16_weights>,
                 detail::farbrausch_convolutions<conv_u8_weights>>
        layers_;
};

inline farbrausch::farbrausch(const named_tensors& weights, farbrausch_architecture architecture, arithmetic kind, isa target)
    : architecture_(std::move(architecture)) {
    detail::check_farbrausch(architecture_, weights.where);
    const detail::farbrausch_packer packer(weights, architecture_, target);
    switch (kind) {
        case arithmetic::float32: layers_ = packer.float32(); break;
        case arithmetic::bfloat16: layers_ = packer.bfloat16(); break;
        case arithmetic::int8: layers_ = packer.int8(); break;
    }
}

template <has_columns<color_column, known_column> Layers, executor Executor>
buffer<float> farbrausch::colors(const Layers& layers, std::span<const std::uint8_t> wanted, const progress_listener& progress,
                                 Executor&& threads) const {
    LDI_ASSERT(wanted.size() == layers.size());
    buffer<detail::farbrausch_level> levels = detail::plan_farbrausch(layers.topology, architecture_.kernels, wanted);
    progress.report(stage_name, 0.1F);
    detail::smooth_fills fills =
        detail::smooth_filler(layers.template column<color_column>(), layers.template column<known_column>(), levels,
                              architecture_.growth, threads)
            .run();
    for (detail::farbrausch_level& level : levels) {
        level.average = level.average_coarse = {};
        level.above = {};
    }

    // Progress by multiplications, roughly: the fine levels take most of the time.
    float done = 0.2F;
    const auto report = [&] { progress.report(stage_name, done = (std::min)(done + 0.08F, 1.0F)); };
    report();
    const buffer<float> corrections = std::visit(
        [&](const auto& packed) { return this->corrections(packed, std::move(fills.input), levels, threads, report); }, layers_);
    for (std::size_t v = 0; v < fills.fill.size(); ++v) fills.fill[v] += corrections[v];
    return std::move(fills.fill);
}

template <class Weights, executor Executor, class Report>
buffer<float> farbrausch::corrections(const detail::farbrausch_convolutions<Weights>& layers, detail::masked_colors input,
                                      buffer<detail::farbrausch_level>& levels, Executor& threads, Report&& report) const {
    using value_type = typename Weights::value_type;
    using source = basic_feature_view<value_type>;
    using features = basic_feature_map<value_type>;
    buffer<features> encoded(depth() + 1);
    if constexpr (!std::is_same_v<value_type, float>) {
        encoded[0] = features(levels[0].read.size(), input_channels, layers.input.zero());
        std::transform(input.values().begin(), input.values().end(), encoded[0].values.begin(), layers.input);
        input = {};
    }
    const auto read = [&](std::size_t level) -> source {
        if constexpr (std::is_same_v<value_type, float>)
            if (level == 0) return {input.values(), input_channels, {}, {}};
        return encoded[level];
    };
    for (std::size_t i = 0; i < depth(); ++i) {
        const Weights& weights = layers.encoder[i];
        encoded[i + 1] = features(levels[i + 1].read.size(), weights.outputs, detail::zero_of_results<value_type>(weights));
        const source sources[] = {read(i)};
        convolve_partially(levels[i].encode, weights, sources, encoded[i + 1].values, {}, threads);
        levels[i].encode = {};
        report();
    }
    features coarser = std::move(encoded[depth()]);
    buffer<float> result;
    for (std::size_t i = depth(); i-- > 0;) {
        const Weights& weights = layers.decoder[i];
        const source sources[] = {upsample(coarser, levels[i].decoded_above), read(i)};
        if (i == 0) {
            result.resize(levels[0].decoded.size() * output_channels);
            convolve_partially(levels[i].decode, weights, sources, result, {}, threads);
        } else {
            features finer(levels[i].decoded.size(), weights.outputs, detail::zero_of_results<value_type>(weights));
            convolve_partially(levels[i].decode, weights, sources, finer.values, {}, threads);
            coarser = std::move(finer);
        }
        encoded[i] = {};
        levels[i].decode = {};
        report();
    }
    return result;
}

template <has_columns<color_column, known_column> Layers, executor Executor>
void farbrausch::inpaint(Layers& layers, const progress_listener& progress, Executor&& threads) const {
    const buffer<std::uint8_t>& known = layers.template column<known_column>();
    buffer<std::uint8_t> wanted(known.size());
    std::transform(known.begin(), known.end(), wanted.begin(), [](std::uint8_t k) -> std::uint8_t { return k == 0 ? 1 : 0; });
    const buffer<float> values = colors(layers, wanted, progress, threads);
    buffer<std::uint8_t>& color = layers.template column<color_column>();
    std::size_t next = 0;
    for (std::size_t i = 0; i < wanted.size(); ++i)
        for (std::size_t c = 0; wanted[i] != 0 && c < output_channels; ++c)
            color[3 * i + c] = detail::rounded_to_byte(255.0F * values[next++]);
}

template <executor Executor>
image<std::uint8_t> farbrausch::inpaint(image_view<const std::uint8_t> color, image_view<const std::uint8_t> known,
                                        const progress_listener& progress, Executor&& threads) const {
    LDI_ASSERT(color.channels() == 3 && known.channels() == 1 && color.height() == known.height() &&
               color.width() == known.width());
    photo_layers layers(make_grid(static_cast<std::int32_t>(color.width()), static_cast<std::int32_t>(color.height())));
    for (std::size_t y = 0; y < color.height(); ++y) {
        std::copy_n(color.row(y), 3 * color.width(), layers.column<color_column>().data() + 3 * y * color.width());
        std::copy_n(known.row(y), color.width(), layers.column<known_column>().data() + y * color.width());
    }
    inpaint(layers, progress, threads);
    image<std::uint8_t> result(color.height(), color.width(), 3, unset);
    std::copy(layers.column<color_column>().begin(), layers.column<color_column>().end(), result.begin());
    return result;
}

}  // namespace ldi
