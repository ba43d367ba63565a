// The parts of a GLB file: what stands in its binary chunk, and the JSON that describes it (formats/glb.hpp).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/formats/detail/decimal.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/version.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>

namespace ldi::inline LDI_CONFIGURATION::detail::glb {

// Numbers of glTF 2.0 and of its container.
inline constexpr std::uint32_t magic = 0x46546C67, version = 2, json_chunk = 0x4E4F534A, binary_chunk = 0x004E4942;
inline constexpr int vertices = 34962, indices = 34963;
inline constexpr int unsigned_byte = 5121, unsigned_short = 5123, unsigned_int = 5125, float32 = 5126;

/// Numbers and pieces of JSON one after another.
class json_text {
public:
    template <class... Parts>
    void add(const Parts&... parts) {
        (add_part(parts), ...);
    }
    const buffer<char>& text() const { return text_; }

private:
    void add_part(std::string_view part) { text_.append(part.begin(), part.end()); }
    void add_part(double number) { append_decimal(text_, number); }
    template <std::integral Integer>
    void add_part(Integer number) {
        add_part(std::string_view(std::to_string(number)));
    }
    void add_part(const std::array<double, 3>& numbers) { add("[", numbers[0], ",", numbers[1], ",", numbers[2], "]"); }

    buffer<char> text_;
};

/// A number of at most six digits behind the point that is this one, as far as they tell.
inline double shortest(float value) { return std::round(1e6 * double{value}) / 1e6; }

/// The columns of a mesh or strip as they stand in the file, in an order that aligns each to its scalars without padding.
template <class Mesh>
struct geometry {
    const Mesh& mesh;
    std::array<double, 3> lowest, highest;  ///< of positions

    explicit geometry(const Mesh& m) : mesh(m) {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        lowest.fill(infinity), highest.fill(-infinity);
        for (std::size_t i = 0; i < m.positions.size(); ++i) {
            const double p = double{m.positions[i]};
            lowest[i % 3] = (std::min)(lowest[i % 3], p), highest[i % 3] = (std::max)(highest[i % 3], p);
        }
    }

    static constexpr bool has_opacity = requires(const Mesh& m) { m.opacity; };
    bool has_short_indices() const {
        return mesh.vertex_count() < 65536;
    }  // the index 65,535 itself is reserved, and not reached
    std::size_t position_bytes() const { return mesh.positions.size() * sizeof(float); }
    std::size_t coordinate_bytes() const { return mesh.texture_coordinates.size() * sizeof(std::uint16_t); }
    std::size_t color_bytes() const { return has_opacity ? mesh.vertex_count() * 4 : 0; }
    std::size_t index_bytes() const {
        return mesh.triangles.size() * (has_short_indices() ? sizeof(std::uint16_t) : sizeof(std::uint32_t));
    }
    /// After which the next geometry begins at a multiple of 4.
    std::size_t padding() const { return has_short_indices() && mesh.triangles.size() % 2 == 1 ? 2 : 0; }
    std::size_t bytes() const { return position_bytes() + coordinate_bytes() + color_bytes() + index_bytes(); }
};

/// What is in the binary chunk: the mesh, the strip if there is one, and the texture.
struct contents {
    geometry<textured_mesh> mesh;
    geometry<soft_edge_strip> strip;
    std::span<const std::byte> texture;

    bool has_strip() const { return !strip.mesh.triangles.empty(); }
    std::size_t padding() const { return has_strip() ? mesh.padding() : 0; }
    std::size_t bytes() const { return mesh.bytes() + padding() + (has_strip() ? strip.bytes() : 0) + texture.size(); }
};

/// The views of the file's only buffer, one after the other.
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

/// Accessors have the numbers of their views.
template <class Mesh>
void add_accessors(json_text& json, view_list& views, const geometry<Mesh>& g, std::size_t padding) {
    const std::size_t count = g.mesh.vertex_count();
    json.add(R"({"bufferView":)", views.add(g.position_bytes(), vertices), R"(,"componentType":)", float32, R"(,"count":)",
             count);
    json.add(R"(,"max":)", g.highest, R"(,"min":)", g.lowest, R"(,"type":"VEC3"},)");
    json.add(R"({"bufferView":)", views.add(g.coordinate_bytes(), vertices), R"(,"componentType":)", unsigned_short);
    json.add(R"(,"count":)", count, R"(,"normalized":true,"type":"VEC2"},)");
    if constexpr (geometry<Mesh>::has_opacity) {
        json.add(R"({"bufferView":)", views.add(g.color_bytes(), vertices), R"(,"componentType":)", unsigned_byte);
        json.add(R"(,"count":)", count, R"(,"normalized":true,"type":"VEC4"},)");
    }
    json.add(R"({"bufferView":)", views.add(g.index_bytes(), indices, padding), R"(,"componentType":)",
             g.has_short_indices() ? unsigned_short : unsigned_int);
    json.add(R"(,"count":)", g.mesh.triangles.size(), R"(,"type":"SCALAR"})");
}

inline void add_accessors_and_views(json_text& json, const contents& c) {
    view_list views;
    json.add(R"("accessors":[)");
    add_accessors(json, views, c.mesh, c.padding());
    if (c.has_strip()) json.add(","), add_accessors(json, views, c.strip, 0);
    views.add(c.texture.size(), 0);
    json.add(R"(],"asset":{"generator":"ldi )", LDI_VERSION_MAJOR, ".", LDI_VERSION_MINOR, ".", LDI_VERSION_PATCH);
    json.add(R"(","version":"2.0"},"bufferViews":[)", views.text(), R"(],"buffers":[{"byteLength":)", views.bytes(), "}],");
}

}  // namespace ldi::detail::glb
