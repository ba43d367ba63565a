// A quantized network as plain data: the output of a file reader (io/caffe2.hpp) and the input of quantized_network
// (nn/dense/quantized_network.hpp), which checks it.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/kernels/requantize.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Height and width of a tensor.
struct tensor_size {
    std::size_t height = 0, width = 0;

    friend bool operator==(const tensor_size&, const tensor_size&) = default;
};

/// A convolution with `kernel / 2` pixels of padding on each side, filled with the input's zero point.
struct convolution_description {
    std::size_t input = 0;   ///< index of a tensor
    std::size_t kernel = 1;  ///< side of the window, odd
    std::size_t stride = 1;
    bool depthwise = false;        ///< each output channel reads only the input channel with its index
    buffer<std::uint8_t> weights;  ///< outputs x kernel x kernel x (depthwise ? 1 : input channels)
    quantization weight_quantization;
    buffer<std::int32_t> bias;  ///< outputs, in units of input scale * weight scale
};

/// The sum of two tensors of equal shape.
struct addition_description {
    std::array<std::size_t, 2> inputs = {};  ///< indices of tensors
};

/// Upsamples a tensor by repeating every pixel `factor` times in both directions.
struct nearest_resize_description {
    std::size_t input = 0;  ///< index of a tensor
    std::size_t factor = 1;
};

/// An operator, and the quantization of its result.
struct operator_description {
    std::string name;  ///< name of the result, for messages and observers
    quantization output;
    std::variant<convolution_description, addition_description, nearest_resize_description> kind;
};

/// Tensor 0 is the network's input, tensor i + 1 the result of operators[i]. An operator reads only earlier tensors.
struct network_description {
    std::string input_name;
    std::size_t input_channels = 0;
    quantization input;
    buffer<operator_description> operators;
    std::size_t output = 0;  ///< index of the tensor that is the network's result
    std::string where = {};  ///< source file for messages; may be empty
};

}}  // namespace ldi
