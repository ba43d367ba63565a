// Looks up the weights of a network by name, and checks their types and shapes.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/named_tensors.hpp>
#include <ldi/base/printable.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <iterator>
#include <numeric>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION {

namespace detail {
template <class Scalar>
constexpr std::string_view scalar_name() {
    if constexpr (std::is_same_v<Scalar, float>) return "float";
    if constexpr (std::is_same_v<Scalar, std::int32_t>) return "int32";
    if constexpr (std::is_same_v<Scalar, std::int8_t>) return "int8";
    if constexpr (std::is_same_v<Scalar, std::uint8_t>) return "uint8";
}
}  // namespace detail

/// Returns the text that identifies a tensor in error messages.
inline std::string tensor_place(const named_tensors& from, std::string_view name) {
    return detail::place_in(from.where, "tensor " + detail::printable(name));
}

/// Returns the values of the tensor `name`, which must have this type and shape.
///
/// Raises mismatch, with the name of the tensor, if it is missing, has a different type or shape, or has a number of values that
/// does not match its shape.
template <class Scalar>
const buffer<Scalar>& tensor_values(const named_tensors& from, std::string_view name, const buffer<std::size_t>& shape) {
    const std::string expected = std::string(detail::scalar_name<Scalar>()) + ", " + shape_text(shape);
    const auto found = from.tensors.find(name);
    if (found == from.tensors.end()) raise(error_code::mismatch, tensor_place(from, name), expected, "no such tensor");
    const auto* const values = std::get_if<buffer<Scalar>>(&found->second.values);
    if (values == nullptr || found->second.shape != shape) {
        const std::string_view type =
            std::visit([](const auto& v) { return detail::scalar_name<typename std::decay_t<decltype(v)>::value_type>(); },
                       found->second.values);
        raise(error_code::mismatch, tensor_place(from, name), expected,
              std::string(type) + ", " + shape_text(found->second.shape));
    }
    const std::size_t count = std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
    if (values->size() != count)
        raise(error_code::mismatch, tensor_place(from, name), std::to_string(count) + " values", std::to_string(values->size()));
    return *values;
}

/// Raises mismatch for the first tensor that is not among `names`.
template <class Names>
void check_no_others(const named_tensors& from, const Names& names) {
    std::vector<std::string_view> sorted(std::begin(names), std::end(names));
    std::sort(sorted.begin(), sorted.end());
    for (const auto& [name, values] : from.tensors)
        if (!std::binary_search(sorted.begin(), sorted.end(), std::string_view(name)))
            raise(error_code::mismatch, tensor_place(from, name), "only tensors of the network", "an unexpected tensor");
}

}}  // namespace ldi
