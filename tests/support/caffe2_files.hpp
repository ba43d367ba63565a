// A small valid network as two Caffe2 files, written by hand, and edits that damage it: for tests and for the fuzzer.
#pragma once

#include <protozero/pbf_writer.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace ldi::testing {

using octets = std::vector<std::uint8_t>;

struct caffe2_files {
    octets network, weights;
};

/// Collects the operators of one NetDef.
class net_writer {
public:
    /// Writes one operator and its arguments. The field numbers are those of caffe2.proto.
    class operator_writer {
    public:
        operator_writer(const std::string& type, const std::vector<std::string>& inputs, const std::string& output) {
            protozero::pbf_writer op(data);
            for (const std::string& input : inputs) op.add_string(1, input);
            op.add_string(2, output);
            op.add_string(4, type);
        }
        operator_writer& number(const std::string& name, float value) {
            return argument(name, [&](protozero::pbf_writer& a) { a.add_float(2, value); });
        }
        operator_writer& integer(const std::string& name, std::int64_t value) {
            return argument(name, [&](protozero::pbf_writer& a) { a.add_int64(3, value); });
        }
        operator_writer& text(const std::string& name, const std::string& value) {
            return argument(name, [&](protozero::pbf_writer& a) { a.add_bytes(4, value); });
        }
        operator_writer& integers(const std::string& name, const std::vector<std::int64_t>& values) {
            return argument(name, [&](protozero::pbf_writer& a) {
                for (std::int64_t value : values) a.add_int64(6, value);
            });
        }
        operator_writer& packed_integers(const std::string& name, const std::vector<std::int64_t>& values) {
            return argument(name, [&](protozero::pbf_writer& a) { a.add_packed_int64(6, values.begin(), values.end()); });
        }
        operator_writer& quantized(float scale, int zero_point) {
            return number("Y_scale", scale).integer("Y_zero_point", zero_point);
        }

        std::string data;

    private:
        template <class Write>
        operator_writer& argument(const std::string& name, Write&& write) {
            std::string message;
            protozero::pbf_writer a(message);
            a.add_string(1, name);
            write(a);
            protozero::pbf_writer(data).add_message(5, message);
            return *this;
        }
    };

    void add(const operator_writer& op) { protozero::pbf_writer(data_).add_message(2, op.data); }
    void add_text(std::uint32_t field, const std::string& value) { protozero::pbf_writer(data_).add_string(field, value); }
    octets finish() const { return octets(data_.begin(), data_.end()); }

private:
    std::string data_;
};

/// 3 channels in, 1 out, same size; layers: a dense 3x3, a depthwise 3x3 of stride 2, a 1x1, an enlargement by 2 and an
/// addition.
inline caffe2_files small_network() {
    using op = net_writer::operator_writer;
    net_writer network, weights;
    const float input_scale = 0.0077F, scale = 0.02F, weight_scale = 0.01F;
    std::uint32_t state = 1;
    const auto convolution = [&](const std::string& input, const std::string& name, std::int64_t outputs, std::int64_t kernel,
                                 std::int64_t inputs, std::int64_t stride, std::int64_t group, float from, int zero_point) {
        std::string values;
        for (std::int64_t i = 0; i < outputs * kernel * kernel * inputs; ++i)
            values.push_back(static_cast<char>((state = state * 1664525 + 1013904223) >> 24));
        std::vector<std::int64_t> bias;
        for (std::int64_t i = 0; i < outputs; ++i) bias.push_back(i * 40 - 100);
        weights.add(op("Int8GivenTensorFill", {}, name + "_w")
                        .text("values", values)
                        .integers("shape", {outputs, kernel, kernel, inputs})
                        .quantized(weight_scale, 127));
        weights.add(op("Int8GivenIntTensorFill", {}, name + "_b")
                        .packed_integers("values", bias)
                        .integers("shape", {outputs})
                        .quantized(from * weight_scale, 0));
        const std::int64_t pad = kernel / 2;
        network.add(op("Int8Conv", {input, name + "_w", name + "_b"}, name)
                        .integers("strides", {stride, stride})
                        .integers("pads", {pad, pad, pad, pad})
                        .integers("dilations", {1, 1})
                        .integers("kernels", {kernel, kernel})
                        .integer("group", group)
                        .text("order", "NHWC")
                        .quantized(scale, zero_point));
    };
    network.add_text(1, "small");
    network.add(op("NCHW2NHWC", {"photo"}, "photo_nhwc"));
    network.add(op("Int8Quantize", {"photo_nhwc"}, "color").quantized(input_scale, 128));
    convolution("color", "first", 8, 3, 3, 1, 1, input_scale, 0);
    convolution("first", "half", 8, 3, 1, 2, 8, scale, 128);
    convolution("half", "mixed", 8, 1, 8, 1, 1, scale, 0);
    network.add(op("Int8ResizeNearest", {"mixed"}, "whole")
                    .text("order", "NHWC")
                    .number("width_scale", 2)
                    .number("height_scale", 2)
                    .quantized(scale, 0));
    network.add(op("Int8Add", {"first", "whole"}, "sum").text("order", "NHWC").quantized(2 * scale, 3));
    convolution("sum", "last", 1, 3, 8, 1, 1, 2 * scale, 128);
    network.add(op("Int8Dequantize", {"last"}, "result"));
    network.add_text(7, "photo");
    network.add_text(8, "result");
    return {network.finish(), weights.finish()};
}

/// Damages the files: every 4 bytes of `edits` are one edit (kind, position low, position high, value).
inline caffe2_files damaged(caffe2_files files, const std::uint8_t* edits, std::size_t size) {
    for (; size >= 4; edits += 4, size -= 4) {
        octets& file = (edits[0] & 1) != 0 ? files.weights : files.network;
        if (file.empty()) continue;
        const std::size_t at = (edits[1] + std::size_t{256} * edits[2]) % file.size();
        const std::ptrdiff_t offset = static_cast<std::ptrdiff_t>(at);
        switch (edits[0] >> 1 & 7) {
            case 0: file.resize(at); break;
            case 1: file.erase(file.begin() + offset); break;
            case 2: file.insert(file.begin() + offset, edits[3]); break;
            case 3: file[at] = 0xFF; break;
            case 4: std::swap(file[at], file[edits[3] % file.size()]); break;
            case 5: file[at] = static_cast<std::uint8_t>(file[at] ^ (1U << (edits[3] & 7))); break;
            default: file[at] = edits[3]; break;
        }
    }
    return files;
}

}  // namespace ldi::testing
