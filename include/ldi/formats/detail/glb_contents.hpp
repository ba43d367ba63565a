// Parts of a GLB file: its binary chunk, and the JSON that describes it (formats/glb.hpp).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/version.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail { namespace glb {

// Constants of glTF 2.0 and the GLB container.
inline constexpr std::uint32_t magic = 0x46546C67, version = 2, json_chunk = 0x4E4F534A, binary_chunk = 0x004E4942;
inline constexpr int vertices = 34962, indices = 34963;
inline constexpr int unsigned_byte = 5121, unsigned_short = 5123, unsigned_int = 5125, float32 = 5126;

/// Appends numbers and pieces of JSON to a text.
class json_text {
public:
    template <class... Parts>
    void add(const Parts&... parts) {
        (add_part(parts), ...);
    }
    const buffer<char>& text() const { return text_; }

private:
    void add_part(std::string_view part) { text_.append(part.begin(), part.end()); }
    /// Appends the fewest digits that read back as the same number.
    ///
    /// number  finite
    void add_part(double number) {
#if defined(__cpp_lib_to_chars)
        std::array<char, 32> digits;
        const std::string_view text(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), number).ptr);
#else  // Emscripten has no std::to_chars for double; 17 digits also read back as the same number
        std::array<char, 32> digits;
        std::snprintf(digits.data(), digits.size(), "%.17g", number);
        std::replace(digits.begin(), digits.end(), ',', '.');  // the C library's locale may have a decimal comma
        const std::string_view text(digits.data());
#endif
        add(text, text.find_first_of(".e") == text.npos ? ".0" : "");
    }
    template <std::integral Integer>
    void add_part(Integer number) {
        add_part(std::string_view(std::to_string(number)));
    }
    void add_part(const std::array<double, 3>& numbers) { add("[", numbers[0], ",", numbers[1], ",", numbers[2], "]"); }

    buffer<char> text_;
};

/// Rounds to six decimal places, but never to 0.
inline double rounded(float value) {
    const double result = std::round(1e6 * double{value}) / 1e6;
    return result == 0 ? double{value} : result;
}

/// Values that the caller attaches to the vertices of a mesh (vertex_attribute in formats/glb.hpp).
struct own_attribute {
    std::string_view name;
    std::size_t channels = 1;
    std::span<const float> values;  ///< vertices x channels
};

/// Arrays of one part of a mesh, or of its strip of soft edges (soft_edge_strip in mesh/textured_mesh.hpp). put_geometry()
/// writes the arrays in an order that aligns each array to its scalar type without padding.
struct geometry {
    std::span<const float> positions, texture_coordinates;
    std::span<const std::uint8_t> opacity;  ///< opacity of the vertices of a strip; empty for a part
    std::span<const std::uint32_t> triangles;
    std::uint32_t first_vertex = 0;  ///< mesh vertex to which index 0 in the file refers
    buffer<own_attribute> own = {};  ///< empty for a strip
    std::size_t texture = 0;
    std::array<double, 3> lowest{}, highest{};  ///< bounds of the positions

    std::size_t vertex_count() const { return positions.size() / 3; }
    bool is_strip() const { return !opacity.empty(); }
    /// Whether 16 bits suffice for indices. glTF reserves the index 65,535, so at most 65,535 vertices are possible.
    bool has_short_indices() const { return vertex_count() < 65536; }
    std::size_t position_bytes() const { return positions.size_bytes(); }
    std::size_t coordinate_bytes() const { return texture_coordinates.size() * sizeof(std::uint16_t); }
    std::size_t color_bytes() const { return opacity.size() * 4; }
    std::size_t own_bytes() const {
        std::size_t sum = 0;
        for (const own_attribute& a : own) sum += a.values.size_bytes();
        return sum;
    }
    std::size_t accessor_count() const { return 3 + (is_strip() ? 1 : 0) + own.size(); }
    std::size_t index_bytes() const {
        return triangles.size() * (has_short_indices() ? sizeof(std::uint16_t) : sizeof(std::uint32_t));
    }
    /// Number of padding bytes after the indices, so that the next geometry starts at a multiple of 4.
    std::size_t padding() const { return has_short_indices() && triangles.size() % 2 == 1 ? 2 : 0; }
    std::size_t bytes() const { return position_bytes() + coordinate_bytes() + color_bytes() + own_bytes() + index_bytes(); }

    void find_extent() {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        lowest.fill(infinity), highest.fill(-infinity);
        for (std::size_t i = 0; i < positions.size(); ++i) {
            const double p = double{positions[i]};
            lowest[i % 3] = (std::min)(lowest[i % 3], p), highest[i % 3] = (std::max)(highest[i % 3], p);
        }
    }
};

/// Contents of the binary chunk: the mesh's parts with triangles, the strip if there is one, and their textures.
struct contents {
    buffer<geometry> parts;
    buffer<std::span<const std::byte>> textures;

    contents(const textured_mesh& mesh, std::span<const std::span<const std::byte>> all_textures,
             std::span<const own_attribute> own = {}) {
        const auto add = [&](geometry part, std::size_t texture) {
            if (part.triangles.empty()) return;
            part.texture = texture;
            part.find_extent();
            parts.push_back(std::move(part));
        };
        const std::span<const float> positions(mesh.positions), coordinates(mesh.texture_coordinates);
        const std::span<const std::uint32_t> triangles(mesh.triangles);
        for (std::size_t t = 0; t < mesh.part_count(); ++t) {
            if (!mesh.uses_texture(t)) continue;
            const mesh_part first = mesh.part(t), last = mesh.part(t + 1);
            const std::size_t vertex_count = last.first_vertex - first.first_vertex;
            geometry part{positions.subspan(3 * first.first_vertex, 3 * vertex_count),
                          coordinates.subspan(2 * first.first_vertex, 2 * vertex_count),
                          {},
                          triangles.subspan(3 * first.first_triangle, 3 * (last.first_triangle - first.first_triangle)),
                          static_cast<std::uint32_t>(first.first_vertex)};
            for (const own_attribute& a : own)
                part.own.push_back(
                    {a.name, a.channels, a.values.subspan(a.channels * first.first_vertex, a.channels * vertex_count)});
            add(std::move(part), textures.size());
            textures.push_back(all_textures[t]);
        }
        const soft_edge_strip& strip = mesh.soft_edges;
        add({strip.positions, strip.texture_coordinates, strip.opacity, strip.triangles}, 0);
    }

    std::size_t padding(std::size_t part) const { return part + 1 < parts.size() ? parts[part].padding() : 0; }
    std::size_t bytes() const {
        std::size_t sum = 0;
        for (std::size_t i = 0; i < parts.size(); ++i) sum += parts[i].bytes() + padding(i);
        for (const std::span<const std::byte>& texture : textures) sum += texture.size();
        return sum;
    }
    /// Returns the index of a texture's buffer view. The views of the geometry come first.
    std::size_t view_of_texture(std::size_t texture) const { return first_accessor(parts.size()) + texture; }
    /// Returns the index of a part's first accessor.
    std::size_t first_accessor(std::size_t part) const {
        std::size_t sum = 0;
        for (std::size_t i = 0; i < part; ++i) sum += parts[i].accessor_count();
        return sum;
    }
};

/// List of buffer views, which divide the file's only buffer into consecutive ranges.
class view_list {
public:
    int add(std::size_t bytes, int target, std::size_t padding = 0) {
        json_.add(offset_ > 0 ? "," : "", R"({"buffer":0,"byteLength":)", bytes);
        if (offset_ > 0) json_.add(R"(,"byteOffset":)", offset_);
        if (target != 0) json_.add(R"(,"target":)", target);
        json_.add("}");
        offset_ += bytes + padding;
        return count_++;
    }
    std::size_t bytes() const { return offset_; }
    std::string_view text() const { return {json_.text().data(), json_.text().size()}; }

private:
    json_text json_;
    std::size_t offset_ = 0;
    int count_ = 0;
};

/// Adds the accessors of a geometry, and one buffer view for each accessor.
inline void add_accessors(json_text& json, view_list& views, const geometry& g, std::size_t padding) {
    const std::size_t count = g.vertex_count();
    json.add(R"({"bufferView":)", views.add(g.position_bytes(), vertices), R"(,"componentType":)", float32, R"(,"count":)",
             count);
    json.add(R"(,"max":)", g.highest, R"(,"min":)", g.lowest, R"(,"type":"VEC3"},)");
    json.add(R"({"bufferView":)", views.add(g.coordinate_bytes(), vertices), R"(,"componentType":)", unsigned_short);
    json.add(R"(,"count":)", count, R"(,"normalized":true,"type":"VEC2"},)");
    if (g.is_strip()) {
        json.add(R"({"bufferView":)", views.add(g.color_bytes(), vertices), R"(,"componentType":)", unsigned_byte);
        json.add(R"(,"count":)", count, R"(,"normalized":true,"type":"VEC4"},)");
    }
    for (const own_attribute& a : g.own) {
        constexpr std::string_view types[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
        json.add(R"({"bufferView":)", views.add(a.values.size_bytes(), vertices), R"(,"componentType":)", float32, R"(,"count":)",
                 count, R"(,"type":")", types[a.channels - 1], R"("},)");
    }
    json.add(R"({"bufferView":)", views.add(g.index_bytes(), indices, padding), R"(,"componentType":)",
             g.has_short_indices() ? unsigned_short : unsigned_int);
    json.add(R"(,"count":)", g.triangles.size(), R"(,"type":"SCALAR"})");
}

inline void add_accessors_and_views(json_text& json, const contents& c) {
    view_list views;
    json.add(R"("accessors":[)");
    for (std::size_t i = 0; i < c.parts.size(); ++i) {
        if (i > 0) json.add(",");
        add_accessors(json, views, c.parts[i], c.padding(i));
    }
    for (const std::span<const std::byte>& texture : c.textures) views.add(texture.size(), 0);
    json.add(R"(],"asset":{"generator":"ldi )", LDI_VERSION_MAJOR, ".", LDI_VERSION_MINOR, ".", LDI_VERSION_PATCH);
    json.add(R"(","version":"2.0"},"bufferViews":[)", views.text(), R"(],"buffers":[{"byteLength":)", views.bytes(), "}],");
}

}}}}  // namespace ldi::detail::glb
