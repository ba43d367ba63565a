// Runs a network of 8-bit convolutions, additions and nearest-neighbor upsampling (paper, section "Depth Estimation",
// "Quantization"). The constructor checks the description completely, so that run() can fail only because of the input's size or
// number of channels.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/image.hpp>
#include <ldi/nn/dense/detail/schedule.hpp>
#include <ldi/nn/dense/network_description.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <variant>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// An 8-bit network, ready to run. run() is const and stateless, so any number of threads may share an object.
class quantized_network {
public:
    /// Maximum total bytes of tensors that are alive at the same time when layers run one by one.
    static constexpr std::uint64_t max_bytes = std::uint64_t{1} << 29;

    /// Checks the description and packs its weights.
    ///
    /// target  the instruction set to pack weights for; raises invalid_option if it is unavailable; does not affect results
    ///
    /// Raises invalid_data, mismatch or unsupported, with the name of the tensor, if ldi cannot run the network.
    explicit quantized_network(const network_description& description, isa target = best_isa()) : target_(target) {
        check_available("quantized_network", target);
        detail::check_network(description);
        input_name_ = description.input_name;
        values_ = {description.input};
        channels_ = {description.input_channels};
        for (const operator_description& op : description.operators) {
            layers_.push_back(detail::pack_layer(target, op, values_, channels_));
            values_.push_back(op.output);
            channels_.push_back(layers_.back().channels);
        }
        output_ = description.output;
        find_last_uses();
        fused_ = detail::fuse(layers_, output_);
        unfused_ = detail::layer_by_layer(layers_);
    }

    quantization input_quantization() const { return loaded().values_.front(); }
    quantization output_quantization() const { return loaded().values_[output_]; }
    std::size_t input_channels() const { return loaded().channels_.front(); }
    std::size_t output_channels() const { return loaded().channels_[output_]; }
    std::size_t layer_count() const { return layers_.size(); }
    isa target() const { return target_; }

    /// Returns the size of the result for an input size. Raises invalid_data for an empty input, mismatch if the network adds
    /// tensors whose sizes then differ, and too_large if the tensors need more than max_bytes.
    tensor_size output_size(tensor_size input) const { return sizes(input)[output_]; }

    /// Working memory of run() in bytes, without its input and its result, for an executor with `threads` threads.
    std::size_t working_bytes(tensor_size input, std::size_t threads) const {
        return bytes_of(plan(input, fused_, true), std::max<std::size_t>(threads, 1));
    }

    /// Cost of one step of run(), for measurements. A step computes a chain of layers.
    struct step_description {
        std::string_view name;  ///< name of the last layer's result
        tensor_size size;       ///< size of the last layer's result
        std::size_t layers = 0;
        std::uint64_t dense_products = 0, depthwise_products = 0;  ///< number of multiplications
    };

    /// Lists the steps in the order in which run() calls `progress`.
    buffer<step_description> describe_steps(tensor_size input) const {
        buffer<step_description> described;
        for (const detail::planned_step& step : plan(input, fused_, true).steps) {
            const detail::chain_stage& last = step.chain.back();
            step_description d{last.layer->name, last.output, step.chain.size()};
            for (const detail::chain_stage& stage : step.chain) {
                const std::uint64_t pixels = std::uint64_t{stage.output.height} * stage.output.width;
                if (const auto* dense = std::get_if<detail::dense_layer>(&stage.layer->kind))
                    d.dense_products += pixels * dense->weights->segments * dense->weights->inputs * dense->weights->outputs;
                if (std::holds_alternative<detail::depthwise_layer>(stage.layer->kind))
                    d.depthwise_products += pixels * depthwise_u8_data::taps * stage.layer->channels;
            }
            described.push_back(d);
        }
        return described;
    }

    /// Default progress callback of run().
    struct ignore_progress {
        void operator()(float) const {}
    };

    /// Runs the network. Returns the result in output_quantization(). Raises the errors of output_size(), and mismatch for a
    /// different number of channels or too little memory.
    ///
    /// input     H x W x input_channels(), in input_quantization()
    /// progress  called as progress(fraction) on the calling thread after each step; fraction is 1 after the last step. An
    ///           exception from the callback ends the run
    /// memory    at least working_bytes() bytes of working memory; if empty, run() allocates the memory
    template <executor Executor, class Progress = ignore_progress>
    image<std::uint8_t> run(const image<std::uint8_t>& input, Executor& threads, Progress&& progress = {},
                            std::span<std::byte> memory = {}) const {
        check_channels(input);
        const detail::schedule_plan planned = plan({input.height(), input.width()}, fused_, true);
        const auto after_step = [&](std::size_t step, const std::uint8_t*) {
            progress(static_cast<float>(step + 1) / static_cast<float>(planned.steps.size()));
        };
        return run_steps(input, threads, planned, memory, after_step);
    }

    /// Runs the network layer by layer and passes the intermediate results to `observe`. Returns the same result as run(), but is
    /// slower.
    ///
    /// observe  called as observe(layer, name, tensor) on the calling thread with each layer's result; an exception from it ends
    ///          the run
    template <executor Executor, class Observe>
    image<std::uint8_t> run_observed(const image<std::uint8_t>& input, Executor& threads, Observe&& observe) const {
        check_channels(input);
        const buffer<tensor_size> all = sizes({input.height(), input.width()});
        const detail::schedule_plan planned = plan({input.height(), input.width()}, unfused_, false);
        const auto after_step = [&](std::size_t layer, const std::uint8_t* values) {
            const image<std::uint8_t> tensor = to_image(values, all[layer + 1], channels_[layer + 1]);
            observe(layer, std::string_view(layers_[layer].name), tensor);
        };
        return run_steps(input, threads, planned, {}, after_step);
    }

private:
    const quantized_network& loaded() const {
        if (channels_.empty()) raise(error_code::mismatch, "quantized_network", "a network", "a moved-from object");
        return *this;
    }

    void check_channels(const image<std::uint8_t>& input) const {
        if (input.channels() != input_channels())
            raise(error_code::mismatch, input_name_, std::to_string(input_channels()) + " channels",
                  std::to_string(input.channels()));
    }

    void find_last_uses() {
        buffer<std::size_t> last(layers_.size() + 1);
        for (std::size_t i = 0; i < layers_.size(); ++i) {
            last[i + 1] = i;  // if no layer reads the tensor, it is not needed after layer i
            for (std::size_t t : layers_[i].inputs) last[t] = i;
        }
        last_uses_.resize(layers_.size());
        for (std::size_t t = 1; t < last.size(); ++t)
            if (t != output_) last_uses_[last[t]].push_back(t);
    }

    /// Computes the size of every tensor before any allocation.
    buffer<tensor_size> sizes(tensor_size input) const {
        loaded();
        if (input.height == 0 || input.width == 0)
            raise(error_code::invalid_data, input_name_, "at least one pixel",
                  std::to_string(input.width) + " x " + std::to_string(input.height) + " pixels");
        buffer<tensor_size> found{input};
        std::uint64_t alive = bytes(0, input);
        for (std::size_t i = 0; i < layers_.size(); ++i) {
            const detail::packed_layer& layer = layers_[i];
            const tensor_size first = found[layer.inputs[0]];
            for (std::size_t t : layer.inputs)
                if (found[t] != first)
                    raise(error_code::mismatch, layer.name, "two tensors of equal size to add",
                          std::to_string(first.width) + " x " + std::to_string(first.height) + " and " +
                              std::to_string(found[t].width) + " x " + std::to_string(found[t].height));
            found.push_back(detail::size_after(layer, first));
            alive += bytes(i + 1, found.back());
            if (alive > max_bytes)
                raise(error_code::too_large, layer.name, "at most " + std::to_string(max_bytes) + " bytes of tensors",
                      "an input of " + std::to_string(input.width) + " x " + std::to_string(input.height) + " pixels");
            for (std::size_t t : last_uses_[i]) alive -= bytes(t, found[t]);
        }
        return found;
    }

    /// Bytes of a tensor, or max_bytes + 1 if it exceeds max_bytes.
    std::uint64_t bytes(std::size_t tensor, tensor_size size) const {
        std::uint64_t product = channels_[tensor];
        for (std::uint64_t factor : {std::uint64_t{size.height}, std::uint64_t{size.width}})
            product = factor > max_bytes || product * factor > max_bytes ? max_bytes + 1 : product * factor;
        return product;
    }

    detail::schedule_plan plan(tensor_size input, const buffer<detail::schedule_step>& schedule, bool overwrite) const {
        return detail::plan_schedule(layers_, schedule, sizes(input), channels_, output_, overwrite);
    }

    static std::size_t bytes_of(const detail::schedule_plan& planned, std::size_t strips) {
        return planned.tensor_bytes + strips * (planned.strip_bytes + planned.cut_bytes) + buffer_alignment;
    }

    static image<std::uint8_t> to_image(const std::uint8_t* values, tensor_size size, std::size_t channels) {
        image<std::uint8_t> result(size.height, size.width, channels, unset);
        std::memcpy(result.data(), values, result.size());
        return result;
    }

    template <class Executor, class AfterStep>
    image<std::uint8_t> run_steps(const image<std::uint8_t>& input, Executor& threads, const detail::schedule_plan& planned,
                                  std::span<std::byte> memory, AfterStep&& after_step) const {
        const std::size_t strips = std::max<std::size_t>(threads.concurrency(), 1);
        buffer<std::byte> own;
        if (memory.empty()) {
            own.resize(bytes_of(planned, strips), unset);
            memory = own;
        }
        if (memory.size() < bytes_of(planned, strips))
            raise(error_code::mismatch, "quantized_network",
                  "at least " + std::to_string(bytes_of(planned, strips)) + " bytes of memory", std::to_string(memory.size()));
        const std::size_t misaligned = reinterpret_cast<std::uintptr_t>(memory.data()) % buffer_alignment;
        std::uint8_t* const base = reinterpret_cast<std::uint8_t*>(memory.data()) + (buffer_alignment - misaligned);

        buffer<std::uint8_t*> tensors;
        for (std::size_t offset : planned.offsets) tensors.push_back(base + offset);
        std::memcpy(tensors[0], input.data(), input.size());
        for (std::size_t i = 0; i < planned.steps.size(); ++i) {
            run_step(planned.steps[i], tensors, base + planned.tensor_bytes, planned, threads);
            after_step(i, tensors[planned.steps[i].output]);
        }
        if (output_ == 0) return input;
        const tensor_size size = planned.steps.empty() ? tensor_size{} : size_of_output(planned);
        return to_image(tensors[output_], size, channels_[output_]);
    }

    tensor_size size_of_output(const detail::schedule_plan& planned) const {
        for (const detail::planned_step& step : planned.steps)
            if (step.output == output_) return step.chain.back().output;
        return {};
    }

    template <class Executor>
    static void run_step(const detail::planned_step& step, const buffer<std::uint8_t*>& tensors, std::uint8_t* memory,
                         const detail::schedule_plan& planned, Executor& threads) {
        const std::size_t rows = step.chain.back().output.height;
        struct strip_task {
            const detail::planned_step& step;
            const buffer<std::uint8_t*>& tensors;
            std::uint8_t *memory, *cuts;
            const detail::schedule_plan& planned;
            std::size_t rows, strips;

            std::size_t start(std::size_t strip) const { return strip * rows / strips; }
            // copied rows around the start of the strip
            std::uint8_t* cut(std::size_t strip) const { return cuts + strip * planned.cut_bytes; }

            /// Copies the rows around each cut between two strips, because one strip overwrites rows that the other still needs.
            void save_cuts() const {
                const std::size_t row_bytes = step.chain.front().input_row_bytes();
                for (std::size_t strip = 1; strip < strips; ++strip)
                    std::memcpy(cut(strip), tensors[step.input] + (start(strip) - step.reach) * row_bytes,
                                2 * step.reach * row_bytes);
            }
            void run(std::size_t strip) const {
                const detail::row_range range{start(strip), start(strip + 1)};
                detail::row_source input;
                input.rows = tensors[step.input];
                input.row_bytes = step.chain.front().input_row_bytes();
                input.middle = {0, step.chain.front().input.height};
                if (step.overwrites_input) {
                    input.middle = range;
                    input.reach = step.reach;
                    input.before = cut(strip);
                    input.behind = cut(strip + 1);
                }
                detail::chain_runner(step.chain, input, tensors.data(), tensors[step.output],
                                     memory + strip * planned.strip_bytes)
                    .run(range);
            }
        };
        const std::size_t min_rows = std::max<std::size_t>(2 * step.reach, 1);  // so that no row is copied for two cuts
        const std::size_t strips = std::clamp<std::size_t>(rows / min_rows, 1, std::max<std::size_t>(threads.concurrency(), 1));
        const std::size_t all_strips = std::max<std::size_t>(threads.concurrency(), 1);
        strip_task task{step, tensors, memory, memory + all_strips * planned.strip_bytes, planned, rows, strips};
        if (step.overwrites_input) task.save_cuts();
        parallel_for(threads, strips, 1, [&task](std::size_t first, std::size_t end) {
            for (std::size_t strip = first; strip < end; ++strip) task.run(strip);
        });
    }

    isa target_;
    std::string input_name_;
    buffer<quantization> values_;   ///< per tensor; 0 is the input, i + 1 the result of layer i
    buffer<std::size_t> channels_;  ///< per tensor
    buffer<detail::packed_layer> layers_;
    buffer<buffer<std::size_t>> last_uses_;  ///< per layer: tensors that are no longer needed after it
    buffer<detail::schedule_step> fused_, unfused_;
    std::size_t output_ = 0;
};

}}  // namespace ldi
