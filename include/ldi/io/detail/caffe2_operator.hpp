// Looks up the arguments of a Caffe2 operator by name and checks them.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/io/detail/caffe2_message.hpp>
#include <ldi/nn/dense/network_description.hpp>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail { namespace caffe2 {

/// An operator. Each accessor looks up an argument by name and checks the argument's type.
class checked_operator {
public:
    /// kind  name of the file in messages
    checked_operator(const operator_message& op, std::string_view kind) : op_(op) {
        where_ = std::string(kind) + ", " + printable(op.type) + " " + (op.outputs.empty() ? "" : printable(op.outputs[0]));
    }

    const std::string& where() const { return where_; }

    void expect_inputs(std::size_t count) const {
        if (op_.inputs.size() != count || op_.outputs.size() != 1)
            raise(error_code::invalid_data, where_, std::to_string(count) + " inputs and 1 output",
                  std::to_string(op_.inputs.size()) + " and " + std::to_string(op_.outputs.size()));
    }
    std::string_view input(std::size_t i) const { return op_.inputs[i]; }
    std::string_view output() const { return op_.outputs[0]; }

    float number(std::string_view name) const { return *present(name, &argument::number, "a number"); }
    std::int64_t integer(std::string_view name) const { return *present(name, &argument::integer, "an integer"); }
    std::string_view bytes(std::string_view name) const { return *present(name, &argument::bytes, "a byte string"); }
    const buffer<std::int64_t>& integers(std::string_view name) const { return find(name).integers; }

    /// Returns an integer. Raises unsupported if the integer is outside [minimum, maximum].
    std::size_t integer(std::string_view name, std::int64_t minimum, std::int64_t maximum) const {
        const std::int64_t value = integer(name);
        if (value < minimum || value > maximum)
            fail(name, std::to_string(minimum) + " to " + std::to_string(maximum), std::to_string(value));
        return static_cast<std::size_t>(value);
    }

    quantization output_quantization() const {
        const float scale = number("Y_scale");
        if (!(scale >= (std::numeric_limits<float>::min)() && scale <= (std::numeric_limits<float>::max)()))
            fail("Y_scale", "a positive number", to_text(scale));
        return {scale, static_cast<std::uint8_t>(integer("Y_zero_point", 0, 255))};
    }

    /// Returns the common value of `count` integers. Raises unsupported unless there are `count` integers and all are equal.
    std::int64_t equal_integers(std::string_view name, std::size_t count) const {
        const buffer<std::int64_t>& values = integers(name);
        if (values.size() != count) fail(name, std::to_string(count) + " integers", std::to_string(values.size()));
        for (std::int64_t value : values)
            if (value != values[0]) fail(name, "equal integers", std::to_string(values[0]) + " and " + std::to_string(value));
        return values[0];
    }

    void expect_channels_last() const {
        if (bytes("order") != "NHWC") fail("order", "NHWC", printable(bytes("order")));
    }

    [[noreturn]] void fail(std::string_view name, std::string expected, std::string found) const {
        raise(error_code::unsupported, where_ + ", " + std::string(name), std::move(expected), std::move(found));
    }

private:
    const argument& find(std::string_view name) const {
        for (const argument& a : op_.arguments)
            if (a.name == name) return a;
        raise(error_code::invalid_data, where_, "the argument " + std::string(name), "no argument of that name");
    }
    template <class Member>
    const Member& present(std::string_view name, Member argument::*member, const char* expected) const {
        const Member& value = find(name).*member;
        if (!value.has_value()) raise(error_code::invalid_data, where_ + ", " + std::string(name), expected, "none");
        return value;
    }

    const operator_message& op_;
    std::string where_;
};

}}}}  // namespace ldi::detail::caffe2
