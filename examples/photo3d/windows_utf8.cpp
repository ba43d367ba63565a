// Supports file names in UTF-8 on Windows. libstdc++ converts a name to UTF-16 with the C library's mbrtowc(), which does not
// support UTF-8 on Windows. In the other direction, libstdc++ converts UTF-16 to UTF-8. The mbrtowc() in this file decodes UTF-8,
// so that both directions agree. In a static program, the linker prefers it to the C library's function.
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <cwchar>

static_assert(sizeof(wchar_t) == 2);

extern "C" std::size_t mbrtowc(wchar_t* to, const char* from, std::size_t size, std::mbstate_t* state) {
    static unsigned own;
    // The second half of a surrogate pair, which the next call returns; 0 if there is none.
    unsigned pending = 0;
    void* const kept = state != nullptr ? static_cast<void*>(state) : &own;
    if (from == nullptr) return 0;
    std::memcpy(&pending, kept, sizeof pending);
    const auto give = [&](unsigned unit, unsigned next, std::size_t bytes) {
        std::memcpy(kept, &next, sizeof next);
        if (to != nullptr) *to = static_cast<wchar_t>(unit);
        return unit == 0 ? 0 : bytes;
    };
    const auto byte = [&](std::size_t i) { return static_cast<unsigned>(static_cast<unsigned char>(from[i])); };
    if (size == 0) return static_cast<std::size_t>(-2);
    if (pending != 0) return give(pending, 0, 1);  // the call for the first half consumed all bytes but one
    if (byte(0) < 0x80) return give(byte(0), 0, 1);
    const std::size_t length = byte(0) >= 0xC2 && byte(0) < 0xE0   ? 2
                               : byte(0) >= 0xE0 && byte(0) < 0xF0 ? 3
                               : byte(0) >= 0xF0 && byte(0) < 0xF5 ? 4
                                                                   : 0;
    bool is_valid = length != 0;
    for (std::size_t i = 1; i < length && i < size; ++i) is_valid = is_valid && (byte(i) & 0xC0) == 0x80;
    if (!is_valid) {
        errno = EILSEQ;
        return static_cast<std::size_t>(-1);
    }
    if (size < length) return static_cast<std::size_t>(-2);
    unsigned point = byte(0) & (0x7FU >> length);
    for (std::size_t i = 1; i < length; ++i) point = point << 6 | (byte(i) & 0x3F);
    if (length < 4) return give(point, 0, length);
    point -= 0x10000;
    return give(0xD800 + (point >> 10), 0xDC00 + (point & 0x3FF), 3);
}
