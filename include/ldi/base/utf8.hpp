// Measures and validates UTF-8 characters (RFC 3629).
#pragma once

#include <ldi/base/config.hpp>

#include <cstddef>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Returns the number of bytes in the first character of a text, 1 to 4. Returns 0 if the text is empty or does not begin with
/// valid UTF-8. Overlong encodings and surrogates are invalid.
inline std::size_t utf8_length(std::string_view text) {
    if (text.empty()) return 0;
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned>(static_cast<unsigned char>(text[i])) : 0U;
    };
    const unsigned lead = byte(0);
    const std::size_t more = lead < 0x80 ? 0 : lead < 0xE0 ? 1 : lead < 0xF0 ? 2 : 3;
    bool good = more == 0 || (lead >= 0xC2 && lead <= 0xF4);
    for (std::size_t i = 1; i <= more; ++i) good = good && (byte(i) & 0xC0) == 0x80;
    if (lead == 0xE0) good = good && byte(1) >= 0xA0;
    if (lead == 0xED) good = good && byte(1) < 0xA0;
    if (lead == 0xF0) good = good && byte(1) >= 0x90;
    if (lead == 0xF4) good = good && byte(1) < 0x90;
    return good ? 1 + more : 0;
}

}}  // namespace ldi
