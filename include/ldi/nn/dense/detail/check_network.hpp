// Checks a network description for quantized_network. Descriptions come from files, so every number is checked before use, and
// errors name the tensor.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/nn/dense/network_description.hpp>

#include <cstdint>
#include <cstdlib>
#include <limits>
#include <string>
#include <variant>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

inline constexpr std::size_t max_operators = 1024, max_channels = 65536, max_kernel = 7, max_stride = 2, max_resize_factor = 4;
inline constexpr std::int64_t max_depthwise_bias = (std::int64_t{1} << 30) - 1;  // limit of pack_depthwise_u8()

/// Factor that converts sums in the accumulator's unit to the output's unit. The order of the operations affects the last bit.
inline float requantization_scale(quantization input, quantization weights, quantization output) {
    return input.scale * weights.scale / output.scale;
}

/// Properties of a tensor that has passed the checks.
struct checked_tensor {
    quantization values;
    std::size_t channels;
};

/// Raises invalid_data unless the scale is a positive normal number.
inline void check_tensor_scale(const std::string& name, float scale) {
    if (!(scale >= (std::numeric_limits<float>::min)() && scale <= (std::numeric_limits<float>::max)()))
        raise(error_code::invalid_data, name, "a positive scale", to_text(scale));
}

inline const checked_tensor& checked_input(const std::string& name, const buffer<checked_tensor>& tensors, std::size_t input) {
    if (input >= tensors.size())
        raise(error_code::invalid_data, name, "the network's input or the result of an earlier operator",
              "tensor " + std::to_string(input));
    return tensors[input];
}

/// Raises unsupported for a depthwise bias that the kernels do not accept. Raises unsupported unless every output's sum fits in
/// 32 bits in any order of summation, with the input's zero point folded into the bias.
inline void check_accumulators(const std::string& name, const convolution_description& c) {
    const std::size_t inputs = c.weights.size() / c.bias.size();
    for (std::size_t o = 0; o < c.bias.size(); ++o) {
        const std::int64_t bias = std::abs(std::int64_t{c.bias[o]});
        if (c.depthwise && bias > max_depthwise_bias)
            raise(error_code::unsupported, name, "depthwise biases between -2^30 and 2^30",
                  std::to_string(c.bias[o]) + " in output " + std::to_string(o));
        std::int64_t sum = 0;
        for (std::size_t i = 0; i < inputs; ++i)
            sum += std::abs(int{c.weights[o * inputs + i]} - c.weight_quantization.zero_point);
        const std::int64_t max_sum = 510 * sum + bias;
        if (max_sum > (std::numeric_limits<std::int32_t>::max)())
            raise(error_code::unsupported, name, "sums below 2^31",
                  "a sum of up to " + std::to_string(max_sum) + " in output " + std::to_string(o));
    }
}

inline std::size_t check_operator(const std::string& place, quantization output, const convolution_description& c,
                                  const buffer<checked_tensor>& tensors) {
    const checked_tensor& input = checked_input(place, tensors, c.input);
    const std::size_t outputs = c.bias.size();
    if (outputs == 0 || outputs > max_channels)
        raise(error_code::unsupported, place, "1 to " + std::to_string(max_channels) + " channels", std::to_string(outputs));
    if (c.kernel % 2 == 0 || c.kernel > max_kernel || (c.depthwise && c.kernel != 3))
        raise(error_code::unsupported, place, c.depthwise ? "a 3 x 3 depthwise kernel" : "an odd kernel, at most 7 x 7",
              std::to_string(c.kernel) + " x " + std::to_string(c.kernel));
    if (c.stride == 0 || c.stride > max_stride)
        raise(error_code::unsupported, place, "a stride of 1 or 2", std::to_string(c.stride));
    if (c.depthwise && outputs != input.channels)
        raise(error_code::mismatch, place, std::to_string(input.channels) + " channels, as in the input",
              std::to_string(outputs));
    const std::uint64_t weights = std::uint64_t{outputs} * c.kernel * c.kernel * (c.depthwise ? 1 : input.channels);
    if (c.weights.size() != weights)
        raise(error_code::mismatch, place, std::to_string(weights) + " weights", std::to_string(c.weights.size()));
    check_tensor_scale(place + " weights", c.weight_quantization.scale);
    const float scale = requantization_scale(input.values, c.weight_quantization, output);
    if (!is_requantization_scale(scale))
        raise(error_code::unsupported, place, "input scale * weight scale / output scale in [2^-32, 1)", to_text(scale));
    check_accumulators(place, c);
    return outputs;
}

inline std::size_t check_operator(const std::string& place, quantization output, const addition_description& s,
                                  const buffer<checked_tensor>& tensors) {
    const checked_tensor& a = checked_input(place, tensors, s.inputs[0]);
    const checked_tensor& b = checked_input(place, tensors, s.inputs[1]);
    if (a.channels != b.channels)
        raise(error_code::mismatch, place, "two tensors with the same number of channels",
              std::to_string(a.channels) + " and " + std::to_string(b.channels));
    const float a_ratio = a.values.scale / output.scale, b_ratio = b.values.scale / output.scale;
    if (!are_addition_ratios(a_ratio, b_ratio))
        raise(error_code::unsupported, place, "ratios of input scale to output scale, the larger in [2^-10, 2^8)",
              to_text(a_ratio) + " and " + to_text(b_ratio));
    return a.channels;
}

inline std::size_t check_operator(const std::string& place, quantization output, const nearest_resize_description& r,
                                  const buffer<checked_tensor>& tensors) {
    const checked_tensor& input = checked_input(place, tensors, r.input);
    if (r.factor == 0 || r.factor > max_resize_factor)
        raise(error_code::unsupported, place, "a factor of 1 to " + std::to_string(max_resize_factor), std::to_string(r.factor));
    if (output != input.values)
        raise(error_code::mismatch, place, "the scale and zero point of the input", "a different scale or zero point");
    return input.channels;
}

inline void check_network(const network_description& network) {
    const std::string input = place_in(network.where, network.input_name);
    if (network.operators.size() > max_operators)  // packing a layer takes much longer than reading its 20 bytes from a file
        raise(error_code::unsupported, input, "at most " + std::to_string(max_operators) + " operators",
              std::to_string(network.operators.size()));
    if (network.input_channels == 0 || network.input_channels > max_channels)
        raise(error_code::unsupported, input, "1 to " + std::to_string(max_channels) + " channels",
              std::to_string(network.input_channels));
    check_tensor_scale(input, network.input.scale);
    buffer<checked_tensor> tensors{{network.input, network.input_channels}};
    for (const operator_description& op : network.operators) {
        const std::string place = place_in(network.where, op.name);
        check_tensor_scale(place, op.output.scale);
        const std::size_t channels =
            std::visit([&](const auto& kind) { return check_operator(place, op.output, kind, tensors); }, op.kind);
        tensors.push_back({op.output, channels});
    }
    if (network.output >= tensors.size())
        raise(error_code::invalid_data, place_in(network.where, "output"), "a tensor below " + std::to_string(tensors.size()),
              "tensor " + std::to_string(network.output));
}

}}}  // namespace ldi::detail
