// The layers of a quantized_network, packed for the kernels.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/kernels/add_u8.hpp>
#include <ldi/kernels/depthwise_u8.hpp>
#include <ldi/kernels/gemm_u8.hpp>
#include <ldi/nn/dense/detail/check_network.hpp>
#include <ldi/nn/dense/network_description.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

struct dense_layer {
    std::size_t kernel, stride;
    std::uint8_t padding;
    gemm_u8_weights weights;

    bool is_pointwise() const { return kernel == 1 && stride == 1; }
};

struct depthwise_layer {
    depthwise_u8_weights weights;
};

struct addition_layer {
    add_u8_constants sum;
};

struct resize_layer {
    std::size_t factor;
};

struct packed_layer {
    std::string name;
    quantization values;         ///< quantization of the layer's result
    std::size_t channels = 0;    ///< channels of the layer's result
    buffer<std::size_t> inputs;  ///< indices of tensors; two for an addition
    std::variant<resize_layer, dense_layer, depthwise_layer, addition_layer> kind;
};

/// Packs an operator that has passed check_network().
///
/// values, channels  quantization and number of channels of each tensor
inline packed_layer pack_layer(isa target, const operator_description& op, const buffer<quantization>& values,
                               const buffer<std::size_t>& channels) {
    packed_layer packed{op.name, op.output, 0, {}, resize_layer{1}};
    if (const auto* c = std::get_if<convolution_description>(&op.kind)) {
        const quantization from = values[c->input];
        const requantization output =
            make_requantization(requantization_scale(from, c->weight_quantization, op.output), op.output.zero_point);
        const std::uint8_t weight_zero = c->weight_quantization.zero_point;
        packed.channels = c->bias.size();
        packed.inputs = {c->input};
        if (c->depthwise)
            packed.kind =
                depthwise_layer{pack_depthwise_u8(target, c->weights, weight_zero, c->bias, c->stride, from.zero_point, output)};
        else
            packed.kind = dense_layer{c->kernel, c->stride, from.zero_point,
                                      pack_gemm_u8(target, c->weights, weight_zero, c->bias, c->kernel, from.zero_point, output)};
    } else if (const auto* s = std::get_if<addition_description>(&op.kind)) {
        const quantization a = values[s->inputs[0]], b = values[s->inputs[1]];
        packed.channels = channels[s->inputs[0]];
        packed.inputs = {s->inputs[0], s->inputs[1]};
        packed.kind = addition_layer{prepare_add_u8(target, make_quantized_addition(a, b, op.output))};
    } else if (const auto* r = std::get_if<nearest_resize_description>(&op.kind)) {
        packed.channels = channels[r->input];
        packed.inputs = {r->input};
        packed.kind = resize_layer{r->factor};
    }
    return packed;
}

inline tensor_size size_after(const packed_layer& layer, tensor_size input) {
    const auto shrunk = [input](std::size_t stride) {
        return tensor_size{(input.height - 1) / stride + 1, (input.width - 1) / stride + 1};
    };
    if (const auto* d = std::get_if<dense_layer>(&layer.kind)) return shrunk(d->stride);
    if (const auto* d = std::get_if<depthwise_layer>(&layer.kind)) return shrunk(d->weights->stride);
    if (const auto* r = std::get_if<resize_layer>(&layer.kind)) return {input.height * r->factor, input.width * r->factor};
    return input;
}

}  // namespace detail
}}  // namespace ldi
