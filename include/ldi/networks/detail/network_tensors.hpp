// Reads values and quantizations from the tensors of a weight file.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/kernels/requantize.hpp>
#include <ldi/nn/weights.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Returns the values of a tensor. Raises the errors of tensor_values(), and invalid_data for values that are not finite.
///
/// name   full name of the tensor
/// shape  shape that the tensor must have
inline const buffer<float>& finite_values(const named_tensors& file, const std::string& name, const buffer<std::size_t>& shape) {
    const buffer<float>& found = tensor_values<float>(file, name, shape);
    if (!std::all_of(found.begin(), found.end(), [](float v) { return std::isfinite(v); }))
        raise(error_code::invalid_data, tensor_place(file, name), "finite values", "infinite values or NaN");
    return found;
}

/// Returns the quantization of a tensor from its range in the file, "NAME.range": the minimum and maximum of the values before
/// quantization. Raises the errors of finite_values(), and invalid_data for a range that is empty or does not contain 0.
///
/// of  NAME
inline quantization quantization_of(const named_tensors& file, const std::string& of) {
    const std::string name = of + ".range";
    const buffer<float>& ends = finite_values(file, name, {2});
    const float scale = (ends[1] - ends[0]) / 255.0F;
    if (!(ends[0] <= 0.0F && ends[1] >= 0.0F && std::isnormal(scale)))
        raise(error_code::invalid_data, tensor_place(file, name), "a range that contains 0",
              to_text(ends[0]) + " to " + to_text(ends[1]));
    return {scale, rounded_to_byte(-ends[0] / scale)};
}

}}}  // namespace ldi::detail
