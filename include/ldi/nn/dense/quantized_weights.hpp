// Builds the description of an 8-bit network from the tensors of a weight file that also stores the operators.
// examples/training/tiefenrausch_small writes such files, and formats/safetensors.hpp reads them.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/nn/dense/network_description.hpp>
#include <ldi/nn/weights.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Builds the description of a network with n operators from the tensors of a file. Tensor 0 of the network is its input,
/// tensor i + 1 the result of operator i. The file has these tensors:
///
///     operators                            int32  n x 5   kind, first input, second input, kernel, stride or factor
///     scales, zero_points                  float, uint8   n + 1, one per tensor
///     weight_scales, weight_zero_points    float, uint8   n, used only for convolutions
///     i.weight                             uint8  outputs x kernel x kernel x (inputs; 1 if depthwise)
///     i.bias                               int32  outputs
///
/// Kinds: 0 convolution, 1 depthwise convolution, 2 addition, 3 upsampling by repeating pixels. The last operator computes the
/// result of the network. The metadata entry "operator_names" may list the operators' names for messages, separated by spaces.
///
/// Raises mismatch or invalid_data, with the name of the tensor, if the file has a different layout. The constructor of
/// quantized_network checks the rest of the description.
inline network_description read_quantized_network(const named_tensors& file);

namespace detail {

class quantized_weights_reader {
public:
    explicit quantized_weights_reader(const named_tensors& file)
        : file_(file),
          rows_(tensor_values<std::int32_t>(file, "operators", {operator_count(), columns})),
          scales_(tensor_values<float>(file, "scales", {operator_count() + 1})),
          weight_scales_(tensor_values<float>(file, "weight_scales", {operator_count()})),
          zero_points_(tensor_values<std::uint8_t>(file, "zero_points", {operator_count() + 1})),
          weight_zero_points_(tensor_values<std::uint8_t>(file, "weight_zero_points", {operator_count()})) {}

    network_description read() {
        const std::vector<std::string> names = operator_names();
        result_.where = file_.where;
        result_.input_name = "input";
        result_.input = {scales_[0], zero_points_[0]};
        channels_ = {0};  // unknown until a convolution reads the input
        for (std::size_t i = 0; i < names.size(); ++i) {
            decltype(operator_description::kind) kind;
            switch (row(i, 0, 0, 3)) {
                case 2: kind = addition_description{{input(i, 1), input(i, 2)}}; break;
                case 3: kind = nearest_resize_description{input(i, 1), row(i, 4, 1, max_number)}; break;
                default: kind = convolution(i);
            }
            if (channels_.size() == i + 1) channels_.push_back(channels_[input(i, 1)]);
            result_.operators.push_back({names[i], {scales_[i + 1], zero_points_[i + 1]}, std::move(kind)});
        }
        result_.input_channels = channels_[0];
        result_.output = names.size();
        check_no_others(file_, used_);
        return std::move(result_);
    }

private:
    static constexpr std::size_t columns = 5, max_number = 65536;

    std::size_t operator_count() const {
        const auto found = file_.tensors.find("operators");
        if (found == file_.tensors.end() || found->second.shape.size() != 2 || found->second.shape[0] > max_number)
            raise(error_code::mismatch, tensor_place(file_, "operators"), "a table of the network's operators",
                  found == file_.tensors.end() ? "no such tensor" : shape_text(found->second.shape));
        return found->second.shape[0];
    }

    std::vector<std::string> operator_names() const {
        std::vector<std::string> names;
        const auto listed = file_.metadata.find("operator_names");
        if (listed != file_.metadata.end()) {
            const std::string& text = listed->second;
            for (std::size_t begin = 0, end = 0; end < text.size(); begin = end + 1) {
                end = (std::min)(text.find(' ', begin), text.size());
                names.push_back(printable(std::string_view(text).substr(begin, end - begin)));
            }
        }
        for (std::size_t i = names.size(); i < operator_count(); ++i) names.push_back("operator " + std::to_string(i));
        names.resize(operator_count());
        return names;
    }

    /// Returns an entry of the operator table. Raises invalid_data unless the entry lies in [min, max].
    std::size_t row(std::size_t i, std::size_t column, std::size_t min, std::size_t max) const {
        const std::int32_t value = rows_[i * columns + column];
        if (value < 0 || static_cast<std::size_t>(value) < min || static_cast<std::size_t>(value) > max)
            raise(error_code::invalid_data,
                  tensor_place(file_, "operators") + ", row " + std::to_string(i) + ", column " + std::to_string(column),
                  std::to_string(min) + " to " + std::to_string(max), std::to_string(value));
        return static_cast<std::size_t>(value);
    }
    std::size_t input(std::size_t i, std::size_t column) const { return row(i, column, 0, i); }

    const buffer<std::size_t>& shape_of(const std::string& name) const {
        const auto found = file_.tensors.find(name);
        if (found == file_.tensors.end())
            raise(error_code::mismatch, tensor_place(file_, name), "the weights of a convolution", "no such tensor");
        return found->second.shape;
    }

    convolution_description convolution(std::size_t i) {
        convolution_description c;
        c.depthwise = row(i, 0, 0, 1) == 1;
        c.input = input(i, 1);
        c.kernel = row(i, 3, 1, max_number);
        c.stride = row(i, 4, 1, max_number);
        c.weight_quantization = {weight_scales_[i], weight_zero_points_[i]};
        used_.push_back(std::to_string(i) + ".weight");
        used_.push_back(std::to_string(i) + ".bias");
        const std::string &weight = used_[used_.size() - 2], &bias = used_.back();
        const buffer<std::size_t>& shape = shape_of(weight);
        if (shape.size() != 4) raise(error_code::mismatch, tensor_place(file_, weight), "four dimensions", shape_text(shape));
        // The file does not store the number of input channels; the weights of the operators that read the input determine it.
        if (channels_[c.input] == 0 && c.input == 0) channels_[0] = c.depthwise ? shape[0] : shape[3];
        c.weights =
            tensor_values<std::uint8_t>(file_, weight, {shape[0], c.kernel, c.kernel, c.depthwise ? 1 : channels_[c.input]});
        c.bias = tensor_values<std::int32_t>(file_, bias, {shape[0]});
        channels_.push_back(shape[0]);
        return c;
    }

    const named_tensors& file_;
    const buffer<std::int32_t>& rows_;
    const buffer<float>&scales_, &weight_scales_;
    const buffer<std::uint8_t>&zero_points_, &weight_zero_points_;
    std::vector<std::string> used_{"operators", "scales", "zero_points", "weight_scales", "weight_zero_points"};
    buffer<std::size_t> channels_;  ///< per tensor
    network_description result_;
};

}  // namespace detail

inline network_description read_quantized_network(const named_tensors& file) {
    return detail::quantized_weights_reader(file).read();
}

}}  // namespace ldi
