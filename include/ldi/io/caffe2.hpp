// Reads a quantized network from two Caffe2 files, the format in which the paper's authors published Tiefenrausch: NAME.pb
// contains the operators, and NAME_init.pb contains the weights. Requires exceptions and protozero, a header-only reader for
// protocol buffers.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/io/detail/caffe2_message.hpp>
#include <ldi/io/detail/caffe2_operator.hpp>
#include <ldi/nn/dense/network_description.hpp>

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Reads a network from two Caffe2 files.
///
/// network                    the bytes of NAME.pb; its operators are NCHW2NHWC (optional), Int8Quantize, then any number of
///                            Int8Conv, Int8Add and Int8ResizeNearest, then Int8Dequantize
/// weights                    the bytes of NAME_init.pb
/// network_file, weight_file  names of the files in messages
///
/// Raises invalid_data, mismatch or unsupported if a file is damaged or contains something that ldi cannot run. The message
/// names the operator or tensor. The files are untrusted, so memory is limited to a small multiple of their size. The
/// constructor of quantized_network checks the rest of the description.
inline network_description read_caffe2(std::span<const std::uint8_t> network, std::span<const std::uint8_t> weights,
                                       const std::string& network_file = "network file",
                                       const std::string& weight_file = "weight file");

namespace detail::caffe2 {

/// A tensor of NAME_init.pb.
struct constant {
    buffer<std::int64_t> shape;
    quantization values;
    std::string_view bytes;         ///< values of an Int8GivenTensorFill operator
    buffer<std::int32_t> integers;  ///< values of an Int8GivenIntTensorFill operator
    bool is_used = false;
};

class network_reader {
public:
    network_reader(const network_message& network, const network_message& weights, const std::string& network_file,
                   const std::string& weight_file)
        : network_(network), network_file_(network_file), weight_file_(weight_file) {
        result_.where = network_file;
        for (const operator_message& op : weights.operators) read_constant(op);
    }

    network_description read() {
        if (network_.external_inputs.empty() || network_.external_outputs.size() != 1)
            raise(error_code::invalid_data, network_file_, "at least 1 external input and 1 external output",
                  std::to_string(network_.external_inputs.size()) + " and " + std::to_string(network_.external_outputs.size()));
        image_ = network_.external_inputs[0];
        for (const operator_message& op : network_.operators) read_operator(checked_operator(op, network_file_), op.type);
        if (!is_complete_) raise(error_code::invalid_data, network_file_, "Int8Dequantize at the end", "no such operator");
        return std::move(result_);
    }

private:
    void read_constant(const operator_message& message) {
        const checked_operator op(message, weight_file_);
        op.expect_inputs(0);
        constant c;
        c.shape = op.integers("shape");
        c.values = op.output_quantization();
        const std::uint64_t count = element_count(op, c.shape);
        std::uint64_t found = 0;
        if (message.type == "Int8GivenTensorFill") {
            c.bytes = op.bytes("values");
            found = c.bytes.size();
        } else if (message.type == "Int8GivenIntTensorFill") {
            for (std::int64_t value : op.integers("values")) {
                if (value < (std::numeric_limits<std::int32_t>::min)() || value > (std::numeric_limits<std::int32_t>::max)())
                    op.fail("values", "32-bit integers", std::to_string(value));
                c.integers.push_back(static_cast<std::int32_t>(value));
            }
            found = c.integers.size();
        } else {
            raise(error_code::unsupported, op.where(), "Int8GivenTensorFill or Int8GivenIntTensorFill", printable(message.type));
        }
        if (found != count)
            raise(error_code::mismatch, op.where(), std::to_string(count) + " values for the shape", std::to_string(found));
        if (!constants_.emplace(op.output(), std::move(c)).second)
            raise(error_code::invalid_data, op.where(), "a unique name", "a second tensor of that name");
    }

    static std::uint64_t element_count(const checked_operator& op, const buffer<std::int64_t>& shape) {
        constexpr std::int64_t max_count = std::int64_t{1} << 31;
        std::int64_t count = 1;
        for (std::int64_t side : shape) {
            if (side < 1 || side > max_count || count * side > max_count)
                op.fail("shape", "positive dimensions and at most 2^31 values", "an invalid shape");
            count *= side;
        }
        return static_cast<std::uint64_t>(count);
    }

    void read_operator(const checked_operator& op, std::string_view type) {
        if (is_complete_) raise(error_code::unsupported, op.where(), "nothing after Int8Dequantize", "another operator");
        if (type == "NCHW2NHWC") {
            op.expect_inputs(1);
            if (op.input(0) != image_) unknown_input(op, 0);
            image_ = op.output();
        } else if (type == "Int8Quantize") {
            op.expect_inputs(1);
            if (op.input(0) != image_) unknown_input(op, 0);
            if (!tensors_.empty()) raise(error_code::unsupported, op.where(), "one Int8Quantize", "a second one");
            result_.input_name = printable(op.output());
            result_.input = op.output_quantization();
            name_tensor(op);
        } else if (type == "Int8Conv") {
            op.expect_inputs(3);
            add(op, convolution(op));
        } else if (type == "Int8Add") {
            op.expect_inputs(2);
            op.expect_channels_last();
            add(op, addition_description{{tensor(op, 0), tensor(op, 1)}});
        } else if (type == "Int8ResizeNearest") {
            op.expect_inputs(1);
            op.expect_channels_last();
            add(op, nearest_resize_description{tensor(op, 0), resize_factor(op)});
        } else if (type == "Int8Dequantize") {
            op.expect_inputs(1);
            if (op.output() != network_.external_outputs[0])
                raise(error_code::unsupported, op.where(), "the output " + printable(network_.external_outputs[0]),
                      printable(op.output()));
            result_.output = tensor(op, 0);
            is_complete_ = true;
        } else {
            raise(error_code::unsupported, op.where(), "an operator of a quantized network", printable(type));
        }
    }

    convolution_description convolution(const checked_operator& op) {
        op.expect_channels_last();
        convolution_description c;
        c.input = tensor(op, 0);
        constant& weights = take_constant(op, 1);
        constant& bias = take_constant(op, 2);
        if (weights.bytes.empty() || weights.shape.size() != 4)
            raise(error_code::invalid_data, op.where(), "8-bit weights with 4 dimensions",
                  std::to_string(weights.bytes.size()) + " values with " + std::to_string(weights.shape.size()) + " dimensions");
        const std::int64_t outputs = weights.shape[0], kernel = weights.shape[1], inputs = weights.shape[3];
        const std::int64_t group = op.integer("group"), pad = op.equal_integers("pads", 4),
                           dilation = op.equal_integers("dilations", 2);
        const std::int64_t stated = op.equal_integers("kernels", 2);
        if (weights.shape[2] != kernel || stated != kernel)
            op.fail("kernels", "a square kernel with the size of the weights", std::to_string(stated));
        if (pad != kernel / 2) op.fail("pads", std::to_string(kernel / 2), std::to_string(pad));
        if (dilation != 1) op.fail("dilations", "1", std::to_string(dilation));
        if (group != 1 && (group != outputs || inputs != 1))
            op.fail("group", "1, or as many groups as channels", std::to_string(group));
        const std::int64_t stride = op.equal_integers("strides", 2);
        if (stride < 1 || stride > 2) op.fail("strides", "1 or 2", std::to_string(stride));
        c.kernel = static_cast<std::size_t>(kernel);
        c.stride = static_cast<std::size_t>(stride);
        c.depthwise = group != 1;
        c.weights.assign(weights.bytes.begin(), weights.bytes.end());
        c.weight_quantization = weights.values;
        check_bias(op, c, bias, outputs);
        c.bias = std::move(bias.integers);
        // Only the weights of the first layer state the photo's number of channels.
        if (c.input == 0) result_.input_channels = static_cast<std::size_t>(c.depthwise ? outputs : inputs);
        return c;
    }

    void check_bias(const checked_operator& op, const convolution_description& c, const constant& bias,
                    std::int64_t outputs) const {
        if (bias.integers.count() != outputs)
            raise(error_code::mismatch, op.where(), std::to_string(outputs) + " biases", std::to_string(bias.integers.size()));
        const quantization& input = c.input == 0 ? result_.input : result_.operators[c.input - 1].output;
        const double expected = double{input.scale} * c.weight_quantization.scale;
        if (bias.values.zero_point != 0 || !(std::abs(bias.values.scale - expected) <= 1e-5 * expected))
            raise(error_code::mismatch, op.where(), "biases with zero point 0 and scale " + detail::to_text(expected),
                  "zero point " + std::to_string(bias.values.zero_point) + " and scale " + detail::to_text(bias.values.scale));
    }

    static std::size_t resize_factor(const checked_operator& op) {
        const float factor = op.number("width_scale");
        if (factor != op.number("height_scale") || !(factor >= 1 && factor <= 16) || factor != std::floor(factor))
            op.fail("width_scale", "a whole number, equal to height_scale", detail::to_text(factor));
        return static_cast<std::size_t>(factor);
    }

    void add(const checked_operator& op, decltype(operator_description::kind) kind) {
        result_.operators.push_back({printable(op.output()), op.output_quantization(), std::move(kind)});
        name_tensor(op);
    }

    void name_tensor(const checked_operator& op) {
        if (!tensors_.emplace(op.output(), tensors_.size()).second)
            raise(error_code::unsupported, op.where(), "a unique name", "a second tensor of that name");
    }

    std::size_t tensor(const checked_operator& op, std::size_t input) const {
        const auto found = tensors_.find(op.input(input));
        if (found == tensors_.end()) unknown_input(op, input);
        return found->second;
    }

    /// Finds a tensor of the weight file. Each tensor may be used only once, so that a small file cannot describe a large
    /// network.
    constant& take_constant(const checked_operator& op, std::size_t input) {
        const auto found = constants_.find(op.input(input));
        if (found == constants_.end())
            raise(error_code::mismatch, op.where(), "a tensor of the weight file", printable(op.input(input)));
        if (std::exchange(found->second.is_used, true))
            raise(error_code::unsupported, op.where(), "weights that only one operator uses",
                  printable(op.input(input)) + " again");
        return found->second;
    }

    [[noreturn]] static void unknown_input(const checked_operator& op, std::size_t input) {
        raise(error_code::invalid_data, op.where(), "the name of an earlier tensor", printable(op.input(input)));
    }

    const network_message& network_;
    const std::string &network_file_, &weight_file_;
    std::string_view image_;                           ///< name of the tensor that contains the photo
    std::map<std::string_view, std::size_t> tensors_;  ///< index of each tensor by name
    std::map<std::string_view, constant> constants_;
    network_description result_;
    bool is_complete_ = false;
};

}  // namespace detail::caffe2

inline network_description read_caffe2(std::span<const std::uint8_t> network, std::span<const std::uint8_t> weights,
                                       const std::string& network_file, const std::string& weight_file) {
    const detail::caffe2::network_message operators = detail::caffe2::read_network(network, network_file);
    const detail::caffe2::network_message constants = detail::caffe2::read_network(weights, weight_file);
    return detail::caffe2::network_reader(operators, constants, network_file, weight_file).read();
}

}}  // namespace ldi
