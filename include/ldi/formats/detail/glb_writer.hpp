// Writes the binary part of a GLB file: vertices, indices and textures in the order that formats/detail/glb_contents.hpp
// defines.
#pragma once

#include <ldi/base/numbers.hpp>
#include <ldi/formats/detail/glb_contents.hpp>

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail::glb {

/// Writes a file from front to back. Numbers are little-endian, as glTF requires.
class writer {
public:
    explicit writer(std::byte* to) : to_(to) {}

    template <std::unsigned_integral Integer>
    void put(Integer value) {
        for (std::size_t i = 0; i < sizeof value; ++i) *to_++ = static_cast<std::byte>(value >> (8 * i) & 255);
    }
    void put_bytes(const void* from, std::size_t count) {
        if (count > 0) std::memcpy(to_, from, count);
        to_ += count;
    }
    void put_padding(std::byte padding, std::size_t count) {
        for (; count > 0; --count) *to_++ = padding;
    }

private:
    std::byte* to_;
};

inline void put_floats(writer& to, std::span<const float> values) {
    for (const float value : values) to.put(bits_of(value));
}

inline void put_geometry(writer& to, const geometry& g) {
    put_floats(to, g.positions);
    for (const float t : g.texture_coordinates) to.put(static_cast<std::uint16_t>(std::lround(t * 65535.0F)));
    for (const std::uint8_t opacity : g.opacity) to.put((std::uint32_t{opacity} << 24) | 0xFFFFFFU);
    for (const own_attribute& a : g.own) put_floats(to, a.values);
    for (const std::uint32_t i : g.triangles) {
        if (g.has_short_indices())
            to.put(static_cast<std::uint16_t>(i - g.first_vertex));
        else
            to.put(i - g.first_vertex);
    }
}

inline void put_contents(writer& to, const contents& c) {
    for (std::size_t i = 0; i < c.parts.size(); ++i) {
        put_geometry(to, c.parts[i]);
        to.put_padding(std::byte{0}, c.padding(i));
    }
    for (const std::span<const std::byte>& texture : c.textures) to.put_bytes(texture.data(), texture.size());
}

}}}  // namespace ldi::detail::glb
