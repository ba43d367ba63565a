// Reads an inpainting network from the bytes of a safetensors file. The file's metadata specifies the kind of network.
// examples/training/farbrausch/export.py writes Farbrausch, and examples/training/partial_convolution.py writes the full-size
// PartialConv. io/weight_files.hpp loads both from files.
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

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Decodes an inpainting network.
///
/// bytes   the whole file
/// where   name of the file in messages
/// kind    number format of the computation; if empty, int8 if the file contains the value ranges that int8 requires, otherwise
///         float32
/// target  instruction set for which to pack the weights; must be available (is_available()), else raises invalid_option
///
/// Raises the errors of decode_safetensors() and of farbrausch's constructor, and mismatch or unsupported if the metadata
/// describes a different kind of network.
farbrausch decode_farbrausch(std::span<const std::byte> bytes, const std::string& where = "weights",
                             std::optional<arithmetic> kind = arithmetic::float32, isa target = best_isa());

namespace detail {

/// Returns how the network treats missing colors. The network's name in the metadata determines this.
inline missing_colors parse_missing_colors(const named_tensors& file) {
    check_metadata(file, "an inpainting network", "format", "ldi");
    const auto name = file.metadata.find("name");
    if (name != file.metadata.end() && name->second == "farbrausch") return missing_colors::filled;
    if (name != file.metadata.end() && name->second == "partial_convolution") return missing_colors::masked;
    raise(error_code::mismatch, file.where, "an inpainting network (name farbrausch or partial_convolution in its metadata)",
          name == file.metadata.end() ? "no name" : printable(name->second));
}

/// Reads the architecture from the metadata. Raises mismatch for missing metadata, invalid_data for metadata that is not valid
/// JSON, and unsupported for a network that farbrausch cannot compute.
inline inpainting_architecture parse_inpainting_architecture(const named_tensors& file, const std::string& where) {
    inpainting_architecture result;
    result.missing = parse_missing_colors(file);
    const bool has_fills = result.missing == missing_colors::filled;
    const auto found = file.metadata.find("architecture");
    if (found == file.metadata.end())
        raise(error_code::mismatch, where, "an inpainting network's architecture in the metadata", "no such entry");
    const std::string here = where + ", architecture";
    const json_value text = read_json_object(found->second, 3, here);

    // Members with only one accepted value, because any other value would require different arithmetic.
    const std::string_view fixed[][2] = {
        {"name", has_fills ? "\"farbrausch\"" : "\"partial_convolution\""},
        {"version", "1"},
        {"layout", "\"out,in,height,width\""},
        {"inputs", has_fills ? "\"red, green, blue of fill - tone, known\"" : "\"red, green, blue, masked\""},
        {"output", has_fills ? "\"red, green, blue, to be added to fill\"" : "\"red, green, blue\""},
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
            raise(error_code::unsupported, here, "a whole number for " + std::string(key), printable(value.text));
        return static_cast<std::int32_t>(*size);
    };
    const auto each_of = [&](const char* key, auto&& visit) {
        const json_value list = json_member(text, key);
        if (list.kind != json_kind::array)
            raise(error_code::unsupported, here, "a list of whole numbers for " + std::string(key), printable(list.text));
        for_each_element(list, [&](const json_value& value) { visit(number(value, key)); });
    };
    result.channels.clear(), result.kernels.clear();
    each_of("channels", [&](std::int32_t channels) { result.channels.push_back(static_cast<std::size_t>(channels)); });
    each_of("kernels", [&](std::int32_t kernel) { result.kernels.push_back(kernel); });
    result.growth = has_fills ? number(json_member(text, "growth"), "growth") : 0;
    return result;
}

}  // namespace detail

inline farbrausch decode_farbrausch(std::span<const std::byte> bytes, const std::string& where, std::optional<arithmetic> kind,
                                    isa target) {
    const named_tensors file = decode_safetensors(bytes, where);
    if (!kind) kind = file.tensors.contains("input.range") ? arithmetic::int8 : arithmetic::float32;
    inpainting_architecture architecture = detail::parse_inpainting_architecture(file, where);
    return farbrausch(file, std::move(architecture), *kind, target);
}

}}  // namespace ldi
