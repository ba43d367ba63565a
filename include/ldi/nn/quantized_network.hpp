// Runs a network of 8-bit convolutions, additions and nearest-neighbour enlargements (paper, section "Depth Estimation",
// "Quantization"). Built once from a description, which it checks in full; running it then can only fail on the input's size.
#pragma once

#include <ldi/core/executor.hpp>
#include <ldi/core/image.hpp>
#include <ldi/kernels/depthwise_u8.hpp>
#include <ldi/kernels/elementwise_u8.hpp>
#include <ldi/kernels/gemm_u8.hpp>
#include <ldi/kernels/window_rows.hpp>
#include <ldi/nn/detail/check_network.hpp>
#include <ldi/nn/network_description.hpp>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace ldi {

/// Height and width of a tensor.
struct tensor_size {
    std::size_t height = 0, width = 0;

    friend bool operator==(const tensor_size&, const tensor_size&) = default;
};

/// An 8-bit network, ready to run. Running it changes nothing in it, so one object serves any number of threads at once.
class quantized_network {
public:
    /// No run may need more than this for the tensors that are alive at the same time.
    static constexpr std::uint64_t most_bytes = std::uint64_t{1} << 29;

    /// Raises an error that names the tensor if the description is not a network that ldi can run.
    explicit quantized_network(const network_description& description) {
        detail::check_network(description);
        input_ = {description.input_name, description.input, description.input_channels};
        for (const operator_description& op : description.operators) layers_.push_back(make_layer(op));
        output_ = description.output;
        find_last_uses();
    }

    quantization input_quantization() const { return input_.values; }
    quantization output_quantization() const { return tensor(output_).values; }
    std::size_t input_channels() const { return input_.channels; }
    std::size_t output_channels() const { return tensor(output_).channels; }
    std::size_t layer_count() const { return layers_.size(); }

    /// The size of the result for an input of this size. Raises an error if the network cannot take it.
    tensor_size output_size(tensor_size input) const { return plan(input)[output_]; }

    /// What run() calls after each layer unless told otherwise.
    struct ignore_layers {
        void operator()(std::size_t, std::string_view, const image<std::uint8_t>&) const {}
    };

    /// input    H x W x input_channels(), in input_quantization()
    /// observe  called as observe(layer, name, tensor) on the calling thread once each layer's tensor is complete; what it
    ///          throws ends the run
    /// Returns the result in output_quantization(). Tensors are freed as soon as no later layer reads them.
    template <executor Executor, class Observe = ignore_layers>
    image<std::uint8_t> run(const image<std::uint8_t>& input, Executor& threads, Observe&& observe = {}) const {
        if (channels(input) != input_.channels)
            raise(error_code::mismatch, input_.name, std::to_string(input_.channels) + " channels",
                  std::to_string(channels(input)));
        const std::vector<tensor_size> sizes = plan({height(input), width(input)});
        std::vector<image<std::uint8_t>> made(layers_.size() + 1);
        const auto read = [&](std::size_t t) -> const image<std::uint8_t>& { return t == 0 ? input : made[t]; };
        for (std::size_t i = 0; i < layers_.size(); ++i) {
            const layer& l = layers_[i];
            image<std::uint8_t>& result = made[i + 1];
            result = make_image<std::uint8_t>(sizes[i + 1].height, sizes[i + 1].width, l.result.channels);
            std::visit([&](const auto& kind) { execute(kind, read, result, threads); }, l.kind);
            observe(i, std::string_view(l.result.name), std::as_const(result));
            for (std::size_t t : l.last_uses) made[t] = {};
        }
        if (output_ == 0) return input;
        return std::move(made[output_]);
    }

private:
    struct tensor_kind {
        std::string name;
        quantization values;
        std::size_t channels = 0;
    };
    struct dense_convolution {
        std::size_t input, kernel, stride;
        std::uint8_t padding;
        gemm_u8_weights weights;
    };
    struct depthwise_convolution {
        std::size_t input, stride;
        depthwise_u8_weights weights;
    };
    struct addition {
        std::size_t a, b;
        quantized_addition arithmetic;
    };
    struct nearest_resize {
        std::size_t input, factor;
    };
    struct layer {
        tensor_kind result;
        std::variant<dense_convolution, depthwise_convolution, addition, nearest_resize> kind;
        std::vector<std::size_t> last_uses;  ///< tensors that no later layer reads
    };

    const tensor_kind& tensor(std::size_t t) const { return t == 0 ? input_ : layers_[t - 1].result; }

    layer make_layer(const operator_description& op) const {
        layer made{{op.name, op.output, 0}, nearest_resize{}, {}};
        if (const auto* c = std::get_if<convolution_description>(&op.kind)) {
            const tensor_kind& from = tensor(c->input);
            const requantization output = make_requantization(
                detail::requantization_scale(from.values, c->weight_quantization, op.output), op.output.zero_point);
            const std::uint8_t weight_zero = c->weight_quantization.zero_point, input_zero = from.values.zero_point;
            made.result.channels = c->bias.size();
            if (c->depthwise)
                made.kind = depthwise_convolution{c->input, c->stride,
                                                  pack_depthwise_u8(c->weights, weight_zero, c->bias, input_zero, output)};
            else
                made.kind = dense_convolution{c->input, c->kernel, c->stride, input_zero,
                                              pack_gemm_u8(c->weights, weight_zero, c->bias, input_zero, output)};
        } else if (const auto* s = std::get_if<addition_description>(&op.kind)) {
            const tensor_kind &a = tensor(s->inputs[0]), &b = tensor(s->inputs[1]);
            made.result.channels = a.channels;
            made.kind = addition{s->inputs[0], s->inputs[1], make_quantized_addition(a.values, b.values, op.output)};
        } else if (const auto* r = std::get_if<nearest_resize_description>(&op.kind)) {
            made.result.channels = tensor(r->input).channels;
            made.kind = nearest_resize{r->input, r->factor};
        }
        return made;
    }

    static std::vector<std::size_t> inputs(const layer& l) {
        if (const auto* a = std::get_if<addition>(&l.kind)) return {a->a, a->b};
        if (const auto* c = std::get_if<dense_convolution>(&l.kind)) return {c->input};
        if (const auto* d = std::get_if<depthwise_convolution>(&l.kind)) return {d->input};
        if (const auto* r = std::get_if<nearest_resize>(&l.kind)) return {r->input};
        return {};
    }

    void find_last_uses() {
        std::vector<std::size_t> last(layers_.size() + 1);
        for (std::size_t i = 0; i < layers_.size(); ++i) {
            last[i + 1] = i;  // a tensor that nothing reads goes at once
            for (std::size_t t : inputs(layers_[i])) last[t] = i;
        }
        for (std::size_t t = 1; t < last.size(); ++t)
            if (t != output_) layers_[last[t]].last_uses.push_back(t);
    }

    /// The size of every tensor, found before anything is allocated.
    std::vector<tensor_size> plan(tensor_size input) const {
        if (input.height == 0 || input.width == 0)
            raise(error_code::invalid_data, input_.name, "at least one pixel",
                  std::to_string(input.width) + " x " + std::to_string(input.height) + " pixels");
        std::vector<tensor_size> sizes{input};
        std::uint64_t alive = bytes(input_, input);
        for (std::size_t i = 0; i < layers_.size(); ++i) {
            const layer& l = layers_[i];
            sizes.push_back(size_after(l, sizes));
            alive += bytes(l.result, sizes.back());
            if (alive > most_bytes)
                raise(error_code::too_large, l.result.name, "at most " + std::to_string(most_bytes) + " bytes of tensors",
                      "an input of " + std::to_string(input.width) + " x " + std::to_string(input.height) + " pixels");
            for (std::size_t t : l.last_uses) alive -= bytes(tensor(t), sizes[t]);
        }
        return sizes;
    }

    /// Bytes of a tensor, or more than most_bytes if that overflows.
    static std::uint64_t bytes(const tensor_kind& kind, tensor_size size) {
        std::uint64_t product = kind.channels;
        for (std::uint64_t factor : {std::uint64_t{size.height}, std::uint64_t{size.width}})
            product = factor > most_bytes || product * factor > most_bytes ? most_bytes + 1 : product * factor;
        return product;
    }

    tensor_size size_after(const layer& l, const std::vector<tensor_size>& sizes) const {
        const auto shrunk = [](tensor_size s, std::size_t stride) {
            return tensor_size{(s.height - 1) / stride + 1, (s.width - 1) / stride + 1};
        };
        if (const auto* c = std::get_if<dense_convolution>(&l.kind)) return shrunk(sizes[c->input], c->stride);
        if (const auto* d = std::get_if<depthwise_convolution>(&l.kind)) return shrunk(sizes[d->input], d->stride);
        if (const auto* r = std::get_if<nearest_resize>(&l.kind))
            return {sizes[r->input].height * r->factor, sizes[r->input].width * r->factor};
        const auto& s = *std::get_if<addition>(&l.kind);
        const tensor_size a = sizes[s.a], b = sizes[s.b];
        if (a != b)
            raise(error_code::mismatch, l.result.name, "two tensors of equal size to add",
                  std::to_string(a.width) + " x " + std::to_string(a.height) + " and " + std::to_string(b.width) + " x " +
                      std::to_string(b.height));
        return a;
    }

    template <class Read, class Executor>
    static void execute(const dense_convolution& c, const Read& read, image<std::uint8_t>& result, Executor& threads) {
        const image<std::uint8_t>& input = read(c.input);
        if (c.kernel == 1 && c.stride == 1) {
            parallel_for(threads, height(result), 1, [&](std::size_t first, std::size_t last) {
                for (std::size_t y = first; y < last; ++y) gemm_u8(c.weights, row(input, y), width(result), row(result, y));
            });
            return;
        }
        const window_geometry windows{height(input), width(input), channels(input), c.kernel, c.stride, c.padding};
        parallel_for(threads, height(result), 1, [&](std::size_t first, std::size_t last) {
            constexpr std::size_t most = 64;  // pixels whose windows are laid out at a time: they stay in the first-level cache
            std::vector<std::uint8_t> laid_out(most * c.weights.inputs);
            for (std::size_t y = first; y < last; ++y)
                for (std::size_t x = 0; x < width(result); x += most) {
                    const std::size_t count = std::min(most, width(result) - x);
                    window_rows(windows, input.data(), y, x, count, laid_out.data());
                    gemm_u8(c.weights, laid_out.data(), count, row(result, y) + x * c.weights.outputs);
                }
        });
    }

    template <class Read, class Executor>
    static void execute(const depthwise_convolution& d, const Read& read, image<std::uint8_t>& result, Executor& threads) {
        const image<std::uint8_t>& input = read(d.input);
        parallel_for(threads, height(result), 1, [&](std::size_t first, std::size_t last) {
            for (std::size_t y = first; y < last; ++y) {
                const std::size_t middle = y * d.stride;
                const std::uint8_t* const rows[3] = {middle > 0 ? row(input, middle - 1) : nullptr, row(input, middle),
                                                     middle + 1 < height(input) ? row(input, middle + 1) : nullptr};
                depthwise_u8(d.weights, rows, width(input), d.stride, row(result, y));
            }
        });
    }

    template <class Read, class Executor>
    static void execute(const addition& s, const Read& read, image<std::uint8_t>& result, Executor& threads) {
        const image<std::uint8_t>&a = read(s.a), &b = read(s.b);
        const std::size_t values_in_row = width(result) * channels(result);
        parallel_for(threads, height(result), 1, [&](std::size_t first, std::size_t last) {
            add_u8(s.arithmetic, row(a, first), row(b, first), (last - first) * values_in_row, row(result, first));
        });
    }

    template <class Read, class Executor>
    static void execute(const nearest_resize& r, const Read& read, image<std::uint8_t>& result, Executor& threads) {
        const image<std::uint8_t>& input = read(r.input);
        parallel_for(threads, height(result), 1, [&](std::size_t first, std::size_t last) {
            for (std::size_t y = first; y < last; ++y)
                repeat_pixels_u8(row(input, y / r.factor), width(input), channels(input), r.factor, row(result, y));
        });
    }

    tensor_kind input_;
    std::vector<layer> layers_;
    std::size_t output_ = 0;
};

}  // namespace ldi
