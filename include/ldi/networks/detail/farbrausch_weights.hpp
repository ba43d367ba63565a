// Packs the inpainting network's convolutions from the tensors of a file, in float32 or int8.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/kernels/requantize.hpp>
#include <ldi/networks/detail/network_tensors.hpp>
#include <ldi/networks/inpainting_architecture.hpp>
#include <ldi/nn/ldi/convolution.hpp>
#include <ldi/nn/weights.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Converts a float of the network's input to the type that the network's first convolution reads.
template <class Value>
struct farbrausch_input;

template <>
struct farbrausch_input<float> {
    float zero() const { return 0.0F; }
    float operator()(float value) const { return value; }
};

template <>
struct farbrausch_input<std::uint8_t> {
    farbrausch_input() = default;
    explicit farbrausch_input(const quantization& values)
        : zero_point_(values.zero_point), steps_per_unit_(1.0F / values.scale), rounded_zero_(values.zero_point + 0.5F) {}

    std::uint8_t zero() const { return zero_point_; }
    std::uint8_t operator()(float value) const {
        const float steps = value * steps_per_unit_ + rounded_zero_;
        return static_cast<std::uint8_t>(std::clamp(steps, 0.0F, 255.0F));
    }

private:
    std::uint8_t zero_point_ = 0;
    float steps_per_unit_ = 1.0F, rounded_zero_ = 0.5F;
};

/// One encoder and one decoder convolution per level.
template <class Weights>
struct farbrausch_convolutions {
    buffer<Weights> encoder, decoder;
    farbrausch_input<typename Weights::value_type> input;
};

/// Checks the tensors and packs them. Raises the errors that the constructor of farbrausch documents.
class farbrausch_packer {
public:
    farbrausch_packer(const named_tensors& file, const inpainting_architecture& architecture, isa target)
        : file_(file), architecture_(architecture), target_(target) {}

    farbrausch_convolutions<conv_f32_weights> float32() const {
        return pack_all<conv_f32_weights>([&](const layer& l, const values& weights, const values& bias) {
            return pack_convolution(target_, weights, bias, l.kernel, l.after);
        });
    }

    farbrausch_convolutions<conv_u8_weights> int8() const {
        auto result = pack_all<conv_u8_weights>([&](const layer& l, const values& weights, const values& bias) {
            buffer<quantized_source> sources;
            for (const ranged_tensor& t : l.sources) sources.push_back({t.channels, range(t.name)});
            return pack_byte_convolution(target_, weights, bias, l.kernel, l.after, sources,
                                         l.result.empty() ? quantization{} : range(l.result));
        });
        result.input = farbrausch_input<std::uint8_t>(range("input"));
        return result;
    }

private:
    std::string where() const { return place_in(file_.where, "arithmetic of the inpainting network"); }
    static constexpr std::size_t output_channels = 3;

    using values = buffer<float>;
    struct ranged_tensor {
        std::string name;
        std::size_t channels;
    };
    struct layer {
        std::string name;
        buffer<ranged_tensor> sources;
        std::size_t outputs;
        std::int32_t kernel;
        activation after;
        std::string result;  ///< name of the result's range in the file, without ".range"; empty if the results are floats

        std::size_t inputs() const {
            std::size_t sum = 0;
            for (const ranged_tensor& t : sources) sum += t.channels;
            return sum;
        }
    };

    static std::string encoder(std::size_t i) { return "encoder." + std::to_string(i); }
    static std::string decoder(std::size_t j) { return "decoder." + std::to_string(j); }

    std::size_t depth() const { return architecture_.channels.size(); }

    /// The input of a level's encoder stage. The decoder stage of the same level also reads it.
    ranged_tensor skip(std::size_t level) const {
        return {level == 0 ? "input" : encoder(level - 1), architecture_.inputs(level)};
    }

    template <class Weights, class Pack>
    farbrausch_convolutions<Weights> pack_all(Pack&& pack) const {
        farbrausch_convolutions<Weights> result;
        std::vector<std::string> names{"input.range"};
        const auto stage = [&](const layer& l) {
            names.push_back(l.name + ".weight"), names.push_back(l.name + ".bias");
            if (!l.result.empty()) names.push_back(l.result + ".range");
            const std::size_t k = static_cast<std::size_t>(l.kernel);
            const values& weights = finite(l.name + ".weight", {l.outputs, l.inputs(), k, k});
            return pack(l, weights, finite(l.name + ".bias", {l.outputs}));
        };
        for (std::size_t i = 0; i < depth(); ++i)
            result.encoder.push_back(
                stage({encoder(i), {skip(i)}, architecture_.channels[i], architecture_.kernels[i], relu, encoder(i)}));
        result.decoder.resize(depth());
        for (std::size_t i = depth(); i-- > 0;) {
            const std::size_t j = depth() - 1 - i;
            const ranged_tensor above{j == 0 ? encoder(i) : decoder(j - 1), architecture_.channels[i]};
            if (i == 0)
                result.decoder[i] = stage({decoder(j), {above, skip(i)}, output_channels, 3, no_activation, ""});
            else
                result.decoder[i] =
                    stage({decoder(j), {above, skip(i)}, skip(i).channels, 3, leaky_relu(architecture_.leak), decoder(j)});
        }
        check_no_others(file_, names);
        return result;
    }

    const values& finite(const std::string& name, const buffer<std::size_t>& shape) const {
        return finite_values(file_, name, shape);
    }

    quantization range(const std::string& of) const {
        if (!file_.tensors.contains(of + ".range"))
            raise(error_code::mismatch, where(),
                  "value ranges for int8 arithmetic, as examples/training/farbrausch/export.py writes them",
                  "no tensor " + of + ".range");
        return quantization_of(file_, of);
    }

    const named_tensors& file_;
    const inpainting_architecture& architecture_;
    isa target_;
};

}}}  // namespace ldi::detail
