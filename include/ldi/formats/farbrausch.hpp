// Reads the inpainting network from the bytes of a safetensors file as examples/training/farbrausch/export.py writes it: ten
// convolutions, and in the metadata what kind of network they are. formats/farbrausch_file.hpp reads it by name.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/formats/detail/json.hpp>
#include <ldi/formats/safetensors.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/networks/farbrausch.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace ldi::inline LDI_CONFIGURATION {

/// Raises those of decode_safetensors() and farbrausch; mismatch and unsupported where the metadata tells of another network.
farbrausch decode_farbrausch(std::span<const std::byte> bytes, const std::string& where = "weights",
                             arithmetic kind = arithmetic::float32, isa target = best_isa());

namespace detail {

/// The architecture that the metadata describe, which must be of the kind that farbrausch computes.
inline farbrausch_architecture parse_farbrausch_architecture(const named_tensors& file, const std::string& where) {
    const auto found = file.metadata.find("architecture");
    if (found == file.metadata.end())
        raise(error_code::mismatch, where, "an inpainting network, with its architecture in the metadata", "none");
    const std::string here = where + ", architecture";
    const json_value text = read_json_object(found->second, 3, here);

    // What would change the arithmetic and is the same in all networks of this kind, as the exporter writes it.
    constexpr std::string_view fixed[][2] = {{"name", "\"farbrausch\""},
                                             {"version", "1"},
                                             {"layout", "\"out,in,height,width\""},
                                             {"inputs", "\"red, green, blue of fill - tone, known\""},
                                             {"output", "\"red, green, blue, to be added to fill\""},
                                             {"colour_range", "1.0"},
                                             {"decoder_kernel", "3"},
                                             {"decoder_inputs", "\"upsampled, skip\""},
                                             {"encoder_activation", "\"relu\""},
                                             {"decoder_activation", "\"leaky_relu 0.2, none in the last\""}};
    for (const auto& [key, value] : fixed)
        if (const json_value is = json_member(text, key); is.text != value)
            raise(error_code::unsupported, here, std::string(key) + " " + std::string(value), printable(is.text));

    const auto number = [&](const json_value& value, const char* key) {
        const std::optional<std::uint64_t> size = whole_number(value);
        if (!size || *size > std::uint64_t{1} << 20)
            raise(error_code::unsupported, here, std::string(key) + " of whole numbers", printable(value.text));
        return static_cast<std::int32_t>(*size);
    };
    const auto each_of = [&](const char* key, auto&& visit) {
        const json_value list = json_member(text, key);
        if (list.kind != json_kind::array)
            raise(error_code::unsupported, here, std::string(key) + " of whole numbers", printable(list.text));
        for_each_element(list, [&](const json_value& value) { visit(number(value, key)); });
    };
    farbrausch_architecture result;
    result.channels.clear(), result.kernels.clear();
    each_of("channels", [&](std::int32_t channels) { result.channels.push_back(static_cast<std::size_t>(channels)); });
    each_of("kernels", [&](std::int32_t kernel) { result.kernels.push_back(kernel); });
    result.growth = number(json_member(text, "growth"), "growth");
    return result;
}

}  // namespace detail

inline farbrausch decode_farbrausch(std::span<const std::byte> bytes, const std::string& where, arithmetic kind, isa target) {
    const named_tensors file = decode_safetensors(bytes, where);
    for (const auto& [key, expected] : {std::pair{"format", "ldi"}, std::pair{"name", "farbrausch"}})
        detail::check_metadata(file, "an inpainting network", key, expected);
    farbrausch_architecture architecture = detail::parse_farbrausch_architecture(file, where);
    return farbrausch(file, std::move(architecture), kind, target);
}

}  // namespace ldi
