// Picture file formats that ldi reads. Each format can be disabled. A service can then read only the formats it expects, and
// its untrusted files reach no other decoder.
#pragma once

#include <ldi/base/config.hpp>

#include <array>
#include <cstddef>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION {

enum class picture_format { jpeg, png, gif, bmp, heif, webp, tiff, pfm, npy };

/// Names in the order of the enumeration. heif includes HEIC and AVIF files.
inline constexpr std::array<std::string_view, 9> picture_format_names = {"jpeg", "png",  "gif", "bmp", "heif",
                                                                         "webp", "tiff", "pfm", "npy"};

constexpr std::string_view to_string(picture_format format) { return picture_format_names[static_cast<std::size_t>(format)]; }

/// A set of formats; by default all of them.
class picture_formats {
public:
    constexpr picture_formats() = default;
    constexpr picture_formats(std::initializer_list<picture_format> formats) : bits_(0) {
        for (const picture_format format : formats) bits_ |= bit(format);
    }

    constexpr bool contains(picture_format format) const { return (bits_ & bit(format)) != 0; }

    /// Parses names separated by commas, such as "jpeg,png". Returns an empty result if a name is unknown.
    static std::optional<picture_formats> parse(std::string_view names) {
        picture_formats result{};
        result.bits_ = 0;
        for (;;) {
            const std::size_t comma = names.find(',');
            const std::string_view name = names.substr(0, comma);
            std::size_t i = 0;
            while (i < picture_format_names.size() && picture_format_names[i] != name) ++i;
            if (i == picture_format_names.size()) return std::nullopt;
            result.bits_ |= bit(static_cast<picture_format>(i));
            if (comma == names.npos) return result;
            names.remove_prefix(comma + 1);
        }
    }

    /// Lists the names, such as "jpeg, png".
    std::string text() const {
        std::string result;
        for (std::size_t i = 0; i < picture_format_names.size(); ++i)
            if (contains(static_cast<picture_format>(i)))
                result += (result.empty() ? "" : ", ") + std::string(picture_format_names[i]);
        return result.empty() ? "none" : result;
    }

private:
    static constexpr unsigned bit(picture_format format) { return 1U << static_cast<unsigned>(format); }

    unsigned bits_ = (1U << picture_format_names.size()) - 1;
};

}}  // namespace ldi
