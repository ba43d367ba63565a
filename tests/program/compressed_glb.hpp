// Reads a compressed GLB file as a viewer does: decodes streams, transforms positions by their node, and scales texture
// coordinates.
#pragma once

#include <ldi/mesh/textured_mesh.hpp>

#include <meshoptimizer.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace ldi::testing {

class viewed_glb {
public:
    explicit viewed_glb(std::span<const std::byte> file) {
        std::uint32_t json_bytes;
        std::memcpy(&json_bytes, file.data() + 12, 4);
        const char* const text = reinterpret_cast<const char*>(file.data() + 20);
        json = nlohmann::json::parse(text, text + json_bytes);
        binary = file.subspan(28 + json_bytes);
    }

    /// Returns a view's bytes, decoded if they are compressed.
    std::vector<std::byte> view(std::size_t index) const {
        const nlohmann::json& v = json.at("bufferViews").at(index);
        if (!v.contains("extensions")) {
            const std::size_t first = v.value("byteOffset", std::size_t{0}), count = v.at("byteLength");
            return {binary.data() + first, binary.data() + first + count};
        }
        const nlohmann::json& stream = v.at("extensions").at("EXT_meshopt_compression");
        const std::size_t count = stream.at("count"), stride = stream.at("byteStride"), bytes = stream.at("byteLength");
        const unsigned char* const from =
            reinterpret_cast<const unsigned char*>(binary.data()) + stream.at("byteOffset").get<std::size_t>();
        std::vector<std::byte> decoded(count * stride);
        const bool is_triangles = stream.at("mode") == "TRIANGLES";
        const int failure = is_triangles ? meshopt_decodeIndexBuffer(decoded.data(), count, stride, from, bytes)
                                         : meshopt_decodeVertexBuffer(decoded.data(), count, stride, from, bytes);
        if (failure != 0) throw std::runtime_error("expected a valid compressed stream, found one that does not decode");
        if (stream.value("filter", "NONE") == "EXPONENTIAL") meshopt_decodeFilterExp(decoded.data(), count, stride);
        return decoded;
    }

    /// Returns the numbers of an accessor, `components` per item.
    std::vector<double> values(std::size_t index, std::size_t components) const {
        const nlohmann::json& accessor = json.at("accessors").at(index);
        const std::size_t in_view = accessor.at("bufferView");
        const std::vector<std::byte> bytes = view(in_view);
        const int type = accessor.at("componentType");
        const std::size_t size = type == 5121   ? 1
                                 : type == 5123 ? 2
                                                : 4,
                          count = accessor.at("count"),
                          stride = json.at("bufferViews").at(in_view).value("byteStride", components * size);
        std::vector<double> result;
        for (std::size_t i = 0; i < count; ++i)
            for (std::size_t k = 0; k < components; ++k) {
                std::uint32_t bits = 0;
                std::memcpy(&bits, bytes.data() + i * stride + k * size, size);
                float real;
                std::memcpy(&real, &bits, 4);
                const double most = accessor.value("normalized", false) ? (size == 1 ? 255 : 65535) : 1;
                result.push_back(type == 5126 ? double{real} : bits / most);
            }
        return result;
    }

    const nlohmann::json& primitive(std::size_t index) const { return json.at("meshes").at(0).at("primitives").at(index); }

    textured_mesh mesh(std::size_t index = 0) const {
        const nlohmann::json& p = primitive(index);
        const nlohmann::json& node = json.at("nodes").at(0);
        const std::array<double, 3> scale = node.value("scale", std::array<double, 3>{1, 1, 1}),
                                    moved = node.value("translation", std::array<double, 3>{0, 0, 0});
        textured_mesh result;
        const std::vector<double> positions = values(p.at("attributes").at("POSITION"), 3);
        for (std::size_t i = 0; i < positions.size(); ++i)
            result.positions.push_back(static_cast<float>(positions[i] * scale[i % 3] + moved[i % 3]));
        const nlohmann::json& texture =
            json.at("materials").at(p.at("material").get<std::size_t>()).at("pbrMetallicRoughness").at("baseColorTexture");
        std::array<double, 2> texel{1, 1};
        if (texture.contains("extensions")) texel = texture.at("extensions").at("KHR_texture_transform").at("scale");
        const std::vector<double> coordinates = values(p.at("attributes").at("TEXCOORD_0"), 2);
        for (std::size_t i = 0; i < coordinates.size(); ++i)
            result.texture_coordinates.push_back(static_cast<float>(coordinates[i] * texel[i % 2]));
        for (const double i : values(p.at("indices"), 1)) result.triangles.push_back(static_cast<std::uint32_t>(i));
        return result;
    }

    nlohmann::json json;
    std::span<const std::byte> binary;
};

}  // namespace ldi::testing
