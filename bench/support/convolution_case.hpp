// A convolution layer with random weights and inputs, in float32 and in bytes, to measure on any graph.
#pragma once

#include "bench/support/measure.hpp"

#include <ldi/base/buffer.hpp>
#include <ldi/nn/ldi/convolution.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>

#include <cstddef>
#include <cstdint>
#include <random>
#include <span>
#include <string>

namespace ldi_bench {

struct convolution_shape {
    std::int32_t kernel_size;
    std::size_t inputs, outputs;

    std::size_t weights() const { return inputs * outputs * static_cast<std::size_t>(kernel_size * kernel_size); }
    double products(const ldi::convolution_plan& plan) const {
        return static_cast<double>(plan.output_count()) * static_cast<double>(weights());
    }
};

inline std::string shape_text(const convolution_shape& s) {
    const std::string k = std::to_string(s.kernel_size);
    return joined(k, "x", k, " ", std::to_string(s.inputs), "->", std::to_string(s.outputs));
}

inline ldi::buffer<float> random_floats(std::size_t count) {
    std::mt19937 random(1);
    ldi::buffer<float> values(count);
    for (float& value : values) value = static_cast<float>(random() % 2001) / 1000.0F - 1.0F;
    return values;
}

inline ldi::buffer<std::uint8_t> random_byte_values(std::size_t count) {
    std::mt19937 random(1);
    ldi::buffer<std::uint8_t> values(count);
    for (std::uint8_t& value : values) value = static_cast<std::uint8_t>(random() % 256);
    return values;
}

inline ldi::conv_f32_weights float_weights(const convolution_shape& s, ldi::isa set) {
    return ldi::pack_convolution(set, random_floats(s.weights()), random_floats(s.outputs), s.kernel_size, ldi::relu);
}

inline ldi::conv_u8_weights byte_weights(const convolution_shape& s, ldi::isa set,
                                         std::span<const ldi::quantized_source> sources) {
    return ldi::pack_byte_convolution(set, random_floats(s.weights()), random_floats(s.outputs), s.kernel_size, ldi::relu,
                                      sources, {0.1F, 10});
}

inline constexpr ldi::quantization byte_input{0.01F, 128};

}  // namespace ldi_bench
