// Farbrausch, the inpainting network of the paper (section "LDI Inpainting"): a partial-convolution U-Net, trained on images and
// run on the links of a layered image. examples/training/farbrausch/README.md describes the network step by step;
// io/weight_files.hpp loads its weights. The same class runs PartialConv, the full-size network that the paper compares with
// (networks/inpainting_architecture.hpp).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/other_bytes.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/networks/detail/farbrausch_weights.hpp>
#include <ldi/networks/detail/farbrausch_work.hpp>
#include <ldi/networks/detail/network_input.hpp>
#include <ldi/networks/detail/smooth_fills.hpp>
#include <ldi/networks/inpainting_architecture.hpp>
#include <ldi/nn/ldi/convolution.hpp>
#include <ldi/nn/ldi/feature_map.hpp>
#include <ldi/nn/weights.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <variant>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Inpaints colors. Satisfies the concept color_inpainter (photo3d/suppliers.hpp). All members are const and stateless: any
/// number of threads may share an object.
class farbrausch {
public:
    /// Checks and packs the weights.
    ///
    /// weights  for each stage I, `encoder.I.weight` (outputs x inputs x k x k) and `encoder.I.bias`, with batch normalization
    ///          folded in; likewise `decoder.I.weight` and `decoder.I.bias`. A decoder stage reads the channels of the coarser
    ///          level, followed by the input channels of its level's encoder stage. Int8 also requires `input.range`,
    ///          `encoder.I.range` and, except for the last stage, `decoder.I.range`: the minimum and maximum of the values
    ///          before quantization, which examples/training/farbrausch/export.py measures
    /// kind     the number format of the computation
    /// target   the instruction set for which to pack the weights; changes results only by rounding errors
    ///
    /// Raises mismatch, with the name of the tensor, if a tensor is missing, unexpected, or of the wrong type or shape. Raises
    /// invalid_data for weights that are not finite or a range without 0; unsupported for an architecture outside the limits of
    /// detail::check_architecture() or weights whose quantization is not finite; and invalid_option for a target that is not
    /// available.
    explicit farbrausch(const named_tensors& weights, inpainting_architecture architecture = {},
                        arithmetic kind = arithmetic::float32, isa target = best_isa());

    /// Inpaints every pixel whose known_column is 0.
    ///
    /// layers    in canonical order
    /// progress  receives the stage "color inpainting"
    template <has_columns<color_column, known_column> Layers, executor Executor = const serial_executor>
    void inpaint(Layers& layers, const progress_listener& progress = {}, Executor&& threads = {}) const;

    /// Returns the image with every unknown color inpainted. The image counts as a single, fully linked layer.
    ///
    /// color  H x W x 3, red, green, blue, 0 to 255
    /// known  H x W x 1, 0 where the color is to be inpainted
    ///
    /// Raises mismatch for any other shape of color or known, and too_large for 2^31 pixels or more, or a side above
    /// max_lattice_side.
    template <executor Executor = const serial_executor>
    image<std::uint8_t> inpaint(image_view<const std::uint8_t> color, image_view<const std::uint8_t> known,
                                const progress_listener& progress = {}, Executor&& threads = {}) const;

    /// Returns the network's unclamped output: red, green, blue, in about [0, 1], for each pixel i with wanted[i] != 0, in
    /// ascending order of i. A surface without any known pixel gets one constant color (black for missing_colors::masked).
    ///
    /// wanted  K values, one per pixel; must be nonzero wherever known_column is 0. Raises mismatch for any other number of
    ///         values
    ///
    /// The bits of a pixel's result do not depend on which other pixels are wanted.
    template <has_columns<color_column, known_column> Layers, executor Executor = const serial_executor>
    buffer<float> colors(const Layers& layers, std::span<const std::uint8_t> wanted, const progress_listener& progress = {},
                         Executor&& threads = {}) const;

    const inpainting_architecture& architecture() const { return architecture_; }

private:
    static constexpr std::size_t output_channels = 3;
    static constexpr const char* stage_name = "color inpainting";

    std::size_t depth() const { return architecture_.channels.size(); }

    /// Runs all layers. Returns the output of the last layer, one row per pixel of `levels[0].decoded`.
    ///
    /// parents  per level except the last: result of parents_of_read()
    template <class Weights, executor Executor, class Report>
    buffer<float> run_layers(const detail::farbrausch_convolutions<Weights>& layers,
                             detail::masked_map<typename Weights::value_type> input, buffer<detail::farbrausch_level>& levels,
                             std::span<const buffer<std::int32_t>> parents, Executor& threads, Report&& report) const;

    inpainting_architecture architecture_;
    std::variant<detail::farbrausch_convolutions<conv_f32_weights>, detail::farbrausch_convolutions<conv_u8_weights>> layers_;
};

inline farbrausch::farbrausch(const named_tensors& weights, inpainting_architecture architecture, arithmetic kind, isa target)
    : architecture_(std::move(architecture)) {
    detail::check_architecture(architecture_, weights.where);
    const detail::farbrausch_packer packer(weights, architecture_, target);
    switch (kind) {
        case arithmetic::float32: layers_ = packer.float32(); break;
        case arithmetic::int8: layers_ = packer.int8(); break;
    }
}

template <has_columns<color_column, known_column> Layers, executor Executor>
buffer<float> farbrausch::colors(const Layers& layers, std::span<const std::uint8_t> wanted, const progress_listener& progress,
                                 Executor&& threads) const {
    if (wanted.size() != layers.size())
        raise(error_code::mismatch, stage_name, std::to_string(layers.size()) + " entries in `wanted`, one per pixel",
              std::to_string(wanted.size()) + " entries");
    if (depth() == 0) raise(error_code::mismatch, stage_name, "a network with weights", "a moved-from network");
    buffer<detail::farbrausch_level> levels = detail::plan_farbrausch(layers.topology(), architecture_.kernels, wanted, threads);
    progress.report(stage_name, 0.1F);
    const array_view<const std::uint8_t> color = layers.template column<color_column>();
    const array_view<const std::uint8_t> known = layers.template column<known_column>();
    buffer<float> fill;  // colors to which the network's output is added
    const auto run = [&]<class Weights>(const detail::farbrausch_convolutions<Weights>& packed) {
        detail::masked_map<typename Weights::value_type> input;
        if (architecture_.missing == missing_colors::masked) {
            input = detail::masked_input(color, known, levels[0].read, packed.input);
        } else {
            detail::smooth_filler filler(layers.topology(), color, known, levels, architecture_.growth, threads);
            auto fills = filler.run(packed.input);
            input.map.channels = architecture_.inputs(0), input.map.zero = packed.input.zero();
            input.map.values = std::move(fills.input);
            fill = std::move(fills.fill);
        }
        buffer<buffer<std::int32_t>> parents(this->depth());  // per level: see parents_of_read()
        for (std::size_t i = 0; i <= this->depth(); ++i) {
            levels[i].average = levels[i].average_coarse = {};
            if (i < this->depth()) parents[i] = detail::parents_of_read(levels[i], levels[i + 1].decoded);
            levels[i].above = {};
        }
        // Progress advances by the same step for each layer, although the fine levels take most of the time.
        float done = 0.2F;
        const float step = (1.0F - done) / detail::nearest_float(2 * this->depth());
        const auto report = [&] { progress.report(stage_name, done = (std::min)(done + step, 1.0F)); };
        report();
        return this->run_layers(packed, std::move(input), levels, parents, threads, report);
    };
    buffer<float> result = std::visit(run, layers_);
    for (std::size_t v = 0; v < fill.size(); ++v) result[v] += fill[v];
    return result;
}

template <class Weights, executor Executor, class Report>
buffer<float> farbrausch::run_layers(const detail::farbrausch_convolutions<Weights>& layers,
                                     detail::masked_map<typename Weights::value_type> input,
                                     buffer<detail::farbrausch_level>& levels, std::span<const buffer<std::int32_t>> parents,
                                     Executor& threads, Report&& report) const {
    using value_type = typename Weights::value_type;
    using source = basic_feature_view<value_type>;
    using features = detail::masked_map<value_type>;
    const bool has_masks = architecture_.missing == missing_colors::masked;
    const auto layer = [&](const convolution_plan& plan, const Weights& weights, std::span<const source> sources) {
        features result;
        result.map = {plan.output_count(), weights->outputs, weights->result_zero_point};
        if (has_masks) result.mask.resize(plan.output_count());
        convolve_partially(plan, weights, sources, result.map.values, result.mask, threads);
        return result;
    };
    buffer<features> encoded(depth() + 1);
    encoded[0] = std::move(input);
    for (std::size_t i = 0; i < depth(); ++i) {
        const source sources[] = {encoded[i].view()};
        encoded[i + 1] = layer(levels[i].encode, layers.encoder[i], sources);
        levels[i].encode = {};
        report();
    }
    features coarser = std::move(encoded[depth()]);
    buffer<float> result(levels[0].decoded.size() * output_channels);
    for (std::size_t i = depth(); i-- > 0;) {
        const source sources[] = {coarser.upsampled(parents[i]), encoded[i].view()};
        if (i == 0)
            convolve_partially(levels[i].decode, layers.decoder[i], sources, result, {}, threads);
        else
            coarser = layer(levels[i].decode, layers.decoder[i], sources);
        encoded[i] = {};
        levels[i].decode = {};
        report();
    }
    return result;
}

template <has_columns<color_column, known_column> Layers, executor Executor>
void farbrausch::inpaint(Layers& layers, const progress_listener& progress, Executor&& threads) const {
    const auto known = layers.template column<known_column>();
    buffer<std::uint8_t> wanted(known.size());
    std::transform(known.begin(), known.end(), wanted.begin(), [](std::uint8_t k) -> std::uint8_t { return k == 0 ? 1 : 0; });
    const buffer<float> values = colors(layers, wanted, progress, threads);
    const auto color = layers.template column<color_column>();
    std::size_t next = 0;
    for_each_unknown(known, [&](std::int32_t i) {
        for (std::size_t c = 0; c < output_channels; ++c)
            color[3 * static_cast<std::size_t>(i) + c] = detail::rounded_to_byte(255.0F * values[next++]);
    });
}

template <executor Executor>
image<std::uint8_t> farbrausch::inpaint(image_view<const std::uint8_t> color, image_view<const std::uint8_t> known,
                                        const progress_listener& progress, Executor&& threads) const {
    if (color.channels() != 3 || known.channels() != 1 || color.height() != known.height() || color.width() != known.width())
        raise(error_code::mismatch, stage_name, "H x W x 3 colors and an H x W x 1 mask of known pixels",
              detail::shape_text(color) + " and " + detail::shape_text(known));
    if (color.width() * color.height() > std::size_t{(std::numeric_limits<std::int32_t>::max)()} ||
        (std::max)(color.width(), color.height()) > max_lattice_side)
        raise(error_code::too_large, stage_name,
              "fewer than 2^31 pixels, at most " + std::to_string(max_lattice_side) + " per side", detail::shape_text(color));
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

}}  // namespace ldi
