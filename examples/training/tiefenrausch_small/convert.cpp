// Converts the published depth network to a weight file in the format of export.py (include/ldi/nn/dense/quantized_weights.hpp),
// for the Python programs beside it.
//
//   convert FOLDER_OF_THE_PUBLISHED_NETWORK FILE.safetensors

#include <ldi/io/caffe2.hpp>
#include <ldi/io/file.hpp>

#include <nlohmann/json.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <span>
#include <string>
#include <type_traits>
#include <variant>
#include <vector>

namespace {

/// Collects the tensors of a weight file, in the order of the calls of add(). Writes values in this machine's byte order. The
/// format requires little-endian, and all supported machines are little-endian.
class weight_file {
public:
    template <class Scalar>
    void add(const std::string& name, const ldi::buffer<std::size_t>& shape, const ldi::buffer<Scalar>& values) {
        const char* type = std::is_same_v<Scalar, float> ? "F32" : std::is_same_v<Scalar, std::int32_t> ? "I32" : "U8";
        const std::size_t begin = data_.size();
        data_.resize(begin + values.size() * sizeof(Scalar));
        std::memcpy(data_.data() + begin, values.data(), data_.size() - begin);
        header_[name] = {{"dtype", type}, {"shape", shape}, {"data_offsets", {begin, data_.size()}}};
    }

    std::vector<std::byte> bytes() const {
        std::string text = header_.dump();
        text.resize((text.size() + 7) / 8 * 8, ' ');
        const std::uint64_t size = text.size();
        std::vector<std::byte> result(8 + text.size());
        std::memcpy(result.data(), &size, 8);
        std::memcpy(result.data() + 8, text.data(), text.size());
        result.insert(result.end(), data_.begin(), data_.end());
        return result;
    }

private:
    nlohmann::ordered_json header_;
    std::vector<std::byte> data_;
};

/// Row of the tensor "operators": kind, first input, second input, kernel, stride or factor.
using row = std::array<std::size_t, 5>;

row row_of(const ldi::convolution_description& c) { return {c.depthwise ? 1U : 0U, c.input, 0, c.kernel, c.stride}; }
row row_of(const ldi::addition_description& a) { return {2, a.inputs[0], a.inputs[1], 0, 1}; }
row row_of(const ldi::nearest_resize_description& r) { return {3, r.input, 0, 0, r.factor}; }

weight_file file_of(const ldi::network_description& network) {
    weight_file file;
    ldi::buffer<std::int32_t> rows;
    ldi::buffer<float> scales{network.input.scale}, weight_scales;
    ldi::buffer<std::uint8_t> zero_points{network.input.zero_point}, weight_zero_points;
    for (std::size_t i = 0; i < network.operators.size(); ++i) {
        const ldi::operator_description& op = network.operators[i];
        for (const std::size_t number : std::visit([](const auto& kind) { return row_of(kind); }, op.kind))
            rows.push_back(static_cast<std::int32_t>(number));
        scales.push_back(op.output.scale);
        zero_points.push_back(op.output.zero_point);
        const auto* const c = std::get_if<ldi::convolution_description>(&op.kind);
        weight_scales.push_back(c == nullptr ? 1.0F : c->weight_quantization.scale);
        weight_zero_points.push_back(c == nullptr ? std::uint8_t{0} : c->weight_quantization.zero_point);
        if (c == nullptr) continue;
        const std::size_t outputs = c->bias.size(), inputs = c->weights.size() / (outputs * c->kernel * c->kernel);
        file.add(std::to_string(i) + ".weight", {outputs, c->kernel, c->kernel, inputs}, c->weights);
        file.add(std::to_string(i) + ".bias", {outputs}, c->bias);
    }
    const std::size_t count = network.operators.size();
    file.add("operators", {count, 5}, rows);
    file.add("scales", {count + 1}, scales);
    file.add("zero_points", {count + 1}, zero_points);
    file.add("weight_scales", {count}, weight_scales);
    file.add("weight_zero_points", {count}, weight_zero_points);
    return file;
}

ldi::buffer<std::uint8_t> read(const std::filesystem::path& path) {
    const std::vector<std::byte> bytes = ldi::read_file(path);
    const auto* const first = reinterpret_cast<const std::uint8_t*>(bytes.data());
    return {first, first + bytes.size()};
}

}  // namespace

int main(int count, char** arguments) {
    if (count != 3) {
        std::fputs("convert FOLDER_OF_THE_PUBLISHED_NETWORK FILE.safetensors\n", stderr);
        return 2;
    }
    try {
        const std::filesystem::path folder = arguments[1];
        const ldi::network_description network =
            ldi::read_caffe2(read(folder / "tiefenrausch.pb"), read(folder / "tiefenrausch_init.pb"));
        ldi::write_file(arguments[2], file_of(network).bytes());
    } catch (const std::exception& e) {
        std::fprintf(stderr, "%s\n", e.what());
        return 1;
    }
}
