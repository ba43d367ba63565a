// Splits a GLB file into parts, and assembles one from compressed parts, for compressed_glb.hpp.
#pragma once

#include "compressed_geometry.hpp"

#include <ldi/base/error.hpp>
#include <ldi/formats/jpeg_png_header.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ldi::examples {

using glb_json = nlohmann::json;

[[noreturn]] inline void raise_other_glb(const std::string& found) {
    raise(error_code::invalid_data, "compress_glb", "a GLB file written by encode_glb()", found);
}

/// Parts of a GLB file.
class glb_reader {
public:
    explicit glb_reader(std::span<const std::byte> file) {
        const auto number = [&](std::size_t at) {
            std::uint32_t value = 0;
            if (file.size() < at + 4) raise_other_glb("a truncated file");
            for (std::size_t k = 0; k < 4; ++k) value |= std::to_integer<std::uint32_t>(file[at + k]) << (8 * k);
            return std::size_t{value};
        };
        if (file.size() < 20 || number(0) != 0x46546C67 || number(16) != 0x4E4F534A)  // "glTF" and "JSON"
            raise_other_glb(describe_format(file));
        const std::size_t json_bytes = number(12), binary = 20 + json_bytes;
        const std::size_t binary_bytes = number(binary);
        if (file.size() < binary + 8 + binary_bytes) raise_other_glb("a truncated file");
        const char* const text = reinterpret_cast<const char*>(file.data() + 20);
        content = glb_json::parse(text, text + json_bytes);
        binary_ = file.subspan(binary + 8, binary_bytes);
    }

    std::span<const std::byte> view(const glb_json& index) const {
        const glb_json& view = content.at("bufferViews").at(index.get<std::size_t>());
        const std::size_t first = view.value("byteOffset", std::size_t{0}), bytes = view.at("byteLength");
        if (first > binary_.size() || bytes > binary_.size() - first) raise_other_glb("a view beyond its buffer");
        return binary_.subspan(first, bytes);
    }

    /// Reads all numbers of an accessor. Raises invalid_data if its type in the file does not match the arguments.
    template <class Scalar>
    std::vector<Scalar> values(const glb_json& index, int component_type, std::size_t components) const {
        const glb_json& accessor = content.at("accessors").at(index.get<std::size_t>());
        const std::span<const std::byte> bytes = view(accessor.at("bufferView"));
        const std::size_t item = components * sizeof(Scalar), count = accessor.at("count");
        if (accessor.at("componentType") != component_type || bytes.size() % item != 0 || bytes.size() / item != count)
            raise_other_glb("an accessor of another type or size");
        std::vector<Scalar> result(count * components);
        std::memcpy(result.data(), bytes.data(), bytes.size());
        return result;
    }

    primitive_geometry geometry(const glb_json& primitive) const {
        primitive_geometry result;
        const glb_json& attributes = primitive.at("attributes");
        result.positions = values<float>(attributes.at("POSITION"), 5126, 3);
        result.texture_coordinates = values<std::uint16_t>(attributes.at("TEXCOORD_0"), 5123, 2);
        if (attributes.contains("COLOR_0")) result.colors = values<std::uint8_t>(attributes["COLOR_0"], 5121, 4);
        const glb_json& indices = primitive.at("indices");
        if (content.at("accessors").at(indices.get<std::size_t>()).at("componentType") == 5123) {
            const std::vector<std::uint16_t> all = values<std::uint16_t>(indices, 5123, 1);
            result.triangles.assign(all.begin(), all.end());
        } else {
            result.triangles = values<unsigned>(indices, 5125, 1);
        }
        if (!std::all_of(result.positions.begin(), result.positions.end(), [](float p) { return std::isfinite(p); }))
            raise_other_glb("a position that is not finite");
        const std::size_t count = result.vertex_count();
        if (result.texture_coordinates.size() != 2 * count || (!result.colors.empty() && result.colors.size() != 4 * count))
            raise_other_glb("columns of different lengths");
        if (result.triangles.empty() || result.triangles.size() % 3 != 0) raise_other_glb("no triangles");
        for (const unsigned i : result.triangles)
            if (i >= result.vertex_count()) raise_other_glb("an index beyond the vertices");
        const glb_json& material = content.at("materials").at(primitive.at("material").get<std::size_t>());
        result.is_ordered = material.value("alphaMode", "OPAQUE") == "BLEND";
        return result;
    }

    glb_json content;

private:
    std::span<const std::byte> binary_;
};

/// Assembles a compressed file.
class glb_packer {
public:
    /// Adds bytes and returns the index of their buffer view.
    std::size_t add(std::span<const std::byte> bytes) {
        views.push_back({{"buffer", 0}, {"byteLength", bytes.size()}, {"byteOffset", append(bytes)}});
        return views.size() - 1;
    }

    /// Adds a stream and returns the index of the buffer view of its decoded values.
    std::size_t add(const compressed_stream& stream) {
        const bool is_vertices = std::string_view(stream.mode) == "ATTRIBUTES";
        glb_json extension = {{"buffer", 0},
                              {"byteLength", stream.bytes.size()},
                              {"byteOffset", append(stream.bytes)},
                              {"byteStride", stream.stride},
                              {"count", stream.count},
                              {"mode", stream.mode}};
        if (stream.filter != nullptr) extension["filter"] = stream.filter;
        glb_json view = {{"buffer", 1},
                         {"byteLength", stream.count * stream.stride},
                         {"byteOffset", decoded_bytes},
                         {"extensions", {{"EXT_meshopt_compression", extension}}},
                         {"target", is_vertices ? 34962 : 34963}};
        if (is_vertices) view["byteStride"] = stream.stride;
        decoded_bytes += (stream.count * stream.stride + 3) / 4 * 4;
        views.push_back(view);
        return views.size() - 1;
    }

    glb_json views = glb_json::array();
    std::vector<std::byte> binary;
    std::size_t decoded_bytes = 0;

private:
    std::size_t append(std::span<const std::byte> bytes) {
        const std::size_t first = binary.size();
        binary.insert(binary.end(), bytes.begin(), bytes.end());
        binary.resize((binary.size() + 3) / 4 * 4);
        return first;
    }
};

/// Returns a GLB file.
///
/// content  the JSON chunk
/// binary   the binary chunk; its length must be a multiple of 4
inline std::vector<std::byte> put_together(const glb_json& content, const std::vector<std::byte>& binary) {
    std::string text = content.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::vector<std::byte> file;
    const auto put = [&](std::size_t number) {
        for (int shift = 0; shift < 32; shift += 8) file.push_back(static_cast<std::byte>(number >> shift & 255));
    };
    put(0x46546C67), put(2), put(28 + text.size() + binary.size());
    put(text.size()), put(0x4E4F534A);
    for (const char c : text) file.push_back(static_cast<std::byte>(c));
    put(binary.size()), put(0x004E4942);
    file.insert(file.end(), binary.begin(), binary.end());
    return file;
}

}  // namespace ldi::examples
