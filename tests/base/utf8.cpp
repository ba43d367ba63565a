#include <ldi/base/utf8.hpp>

#include <catch2/catch.hpp>

#include <cstdint>
#include <string>

using ldi::utf8_length;

namespace {
/// Encodes a number below 2^21 in `length` bytes, even if fewer suffice.
std::string encoded(std::uint32_t code, std::size_t length) {
    if (length == 1) return {static_cast<char>(code)};
    std::string bytes(length, '\0');
    for (std::size_t i = length - 1; i > 0; --i, code >>= 6) bytes[i] = static_cast<char>(0x80 | (code & 0x3F));
    bytes[0] = static_cast<char>((0xF00 >> length & 0xFF) | code);
    return bytes;
}
std::size_t shortest(std::uint32_t code) { return code < 0x80 ? 1 : code < 0x800 ? 2 : code < 0x10000 ? 3 : 4; }
}  // namespace

TEST_CASE("only the shortest encoding of a character is accepted; surrogates and code points above 10FFFF are refused") {
    for (std::uint32_t code = 0; code < 0x200000; code += code < 0x11000 ? 1 : 7) {
        const bool is_character = code < 0x110000 && (code < 0xD800 || code > 0xDFFF);
        for (std::size_t length = shortest(code); length <= 4; ++length) {
            const bool is_utf8 = is_character && length == shortest(code);
            if (utf8_length(encoded(code, length) + "x") != (is_utf8 ? length : 0)) FAIL(code << " in " << length << " bytes");
        }
    }
}

TEST_CASE("a text that is empty, truncated, or begins with a continuation byte does not begin with a character") {
    CHECK(utf8_length("") == 0);
    CHECK(utf8_length("\x80") == 0);
    CHECK(utf8_length("\xFF") == 0);
    for (const std::uint32_t code : {0xE9U, 0x20ACU, 0x1F600U})
        for (std::size_t size = 1; size < shortest(code); ++size)
            CHECK(utf8_length(encoded(code, shortest(code)).substr(0, size)) == 0);
}
