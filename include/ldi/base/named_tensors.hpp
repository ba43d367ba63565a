// The contents of a weight file: named tensors and metadata. formats/safetensors.hpp makes `named_tensors` from a file. Networks
// look up their weights in `named_tensors` (nn/weights.hpp).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <variant>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A shape and row-major values. Half-precision numbers in a file are converted to float.
struct tensor {
    buffer<std::size_t> shape;  ///< empty for a single value
    std::variant<buffer<float>, buffer<std::int32_t>, buffer<std::int8_t>, buffer<std::uint8_t>> values;
};

/// Tensors and metadata of a weight file. Names are unique.
struct named_tensors {
    std::map<std::string, tensor, std::less<>> tensors;
    std::map<std::string, std::string, std::less<>> metadata;
    std::string where;  ///< path of the file, for messages
};

/// Returns the shape as text: "20 x 4 x 7 x 7", or "a single value".
inline std::string shape_text(const buffer<std::size_t>& shape) {
    if (shape.empty()) return "a single value";
    std::string text;
    for (std::size_t length : shape) text += (text.empty() ? "" : " x ") + std::to_string(length);
    return text;
}

}}  // namespace ldi
