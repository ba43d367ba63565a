// Loads the inpainting network from a safetensors file as examples/training/farbrausch/export.py writes it: ten convolutions, and
// in the metadata what kind of network they are.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/formats/file.hpp>
#include <ldi/formats/safetensors.hpp>
#include <ldi/kernels/isa.hpp>
#include <ldi/networks/farbrausch.hpp>

#include <nlohmann/json.hpp>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace ldi {

/// Errors: those of decode_safetensors() and farbrausch; mismatch and unsupported where the metadata tells of another network.
farbrausch decode_farbrausch(std::span<const std::byte> bytes, const std::string& where = "weights",
                             arithmetic kind = arithmetic::float32, isa target = best_isa());

/// Errors: file_access, and those of decode_farbrausch().
inline farbrausch load_farbrausch(const std::filesystem::path& path, arithmetic kind = arithmetic::float32) {
    return decode_farbrausch(read_file(path), path.string(), kind);
}

namespace detail {

/// The architecture that the metadata describe, which must be of the kind that farbrausch computes.
inline farbrausch_architecture parse_farbrausch_architecture(const named_tensors& file, const std::string& where) {
    const auto found = file.metadata.find("architecture");
    if (found == file.metadata.end())
        raise(error_code::mismatch, where, "an inpainting network, with its architecture in the metadata", "none");
    const nlohmann::json text = safetensors::parse_object(found->second, where + ", architecture");
    const auto member = [&](const char* key) { return text.contains(key) ? text[key] : nlohmann::json(); };

    // What would change the arithmetic and is the same in all networks of this kind.
    const nlohmann::json fixed = {{"name", "farbrausch"},
                                  {"version", 1},
                                  {"layout", "out,in,height,width"},
                                  {"inputs", "red, green, blue of fill - tone, known"},
                                  {"output", "red, green, blue, to be added to fill"},
                                  {"colour_range", 1.0},
                                  {"decoder_kernel", 3},
                                  {"decoder_inputs", "upsampled, skip"},
                                  {"encoder_activation", "relu"},
                                  {"decoder_activation", "leaky_relu 0.2, none in the last"}};
    for (const auto& [key, value] : fixed.items())
        if (member(key.c_str()) != value)
            raise(error_code::unsupported, where + ", architecture", key + " " + value.dump(),
                  printable(member(key.c_str()).dump()));

    const auto number = [&](const nlohmann::json& value, const char* key) {
        if (!value.is_number_unsigned() || value.get<std::uint64_t>() > std::uint64_t{1} << 20)
            raise(error_code::unsupported, where + ", architecture", std::string(key) + " of whole numbers",
                  printable(value.dump()));
        return value.get<std::int32_t>();
    };
    farbrausch_architecture result;
    result.channels.clear(), result.kernels.clear();
    for (const nlohmann::json& value : member("channels"))
        result.channels.push_back(static_cast<std::size_t>(number(value, "channels")));
    for (const nlohmann::json& value : member("kernels")) result.kernels.push_back(number(value, "kernels"));
    result.growth = number(member("growth"), "growth");
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
