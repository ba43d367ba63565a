// Compresses a GLB file to a third to two thirds of its size: `photo3d --compress`. The geometry uses EXT_meshopt_compression on
// the grid of KHR_mesh_quantization. The texture uses EXT_texture_webp. Everything else in the file's JSON stays unchanged.
#pragma once

#include "compressed_geometry.hpp"
#include "glb_parts.hpp"

#include <ldi/base/error.hpp>
#include <ldi/formats/jpeg_png_header.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace ldi::examples {

struct compression_options {
    /// Maximum shift of a vertex in the photo camera's view, measured in the plane at distance 1. The default is a tenth of a
    /// pixel for a focal length of 2000 pixels.
    float precision = 5e-5F;
    /// The textures as WebP files of the same size, in order. If empty, the textures stay unchanged.
    std::span<const std::vector<std::byte>> webp;
    /// Keeps the original textures in addition to the WebP files, for viewers that don't support WebP.
    bool keeps_texture = false;
};

/// Compresses a 3D photo. Drops unused vertices; translucent triangles keep their order. Viewers must support the extensions
/// that the file requires: EXT_meshopt_compression, and, if this file uses them, KHR_mesh_quantization, KHR_texture_transform
/// and EXT_texture_webp.
///
/// glb  result of encode_glb(). Raises invalid_data for another file
std::vector<std::byte> compress_glb(std::span<const std::byte> glb, const compression_options& options = {});

/// Rounds the geometry of one mesh to common grids, adds it to the packer, and updates the accessors in the JSON.
class mesh_packer {
public:
    mesh_packer(glb_json& content, glb_packer& packer, float precision)
        : json_(content), packer_(packer), precision_(precision) {}

    /// textures  headers of the textures' pictures, for their sizes
    void pack(glb_json& mesh, std::vector<primitive_geometry>& geometries, std::span<const ldi::picture_header> textures) {
        const std::optional<position_grid> grid = find_grid(geometries, precision_);
        for (std::size_t i = 0; i < geometries.size(); ++i) {
            primitive_geometry& g = geometries[i];
            glb_json& primitive = mesh.at("primitives").at(i);
            sort_for_compression(g);
            put(primitive["attributes"]["POSITION"], position_accessor(g, grid));
            const std::size_t texture = texture_of(primitive.at("material")).at("index");
            if (texture >= textures.size()) raise_other_glb("a missing texture");
            const std::optional<texel_grid> texels =
                has_own_material(mesh, i) ? find_texel_grid(g, textures[texture].width, textures[texture].height) : std::nullopt;
            if (texels) scale_texture(primitive.at("material"), *texels);
            put(primitive["attributes"]["TEXCOORD_0"], texture_accessor(g, texels));
            if (!g.colors.empty())
                put(primitive["attributes"]["COLOR_0"],
                    accessor(compress_column(g.colors, 4), 5121, "VEC4", {{"normalized", true}}));
            const compressed_stream triangles = compress_triangles(g);
            put(primitive["indices"], accessor(triangles, triangles.stride == 2 ? 5123 : 5125, "SCALAR"));
        }
        if (!grid) return;
        uses_quantization = true;
        for (glb_json& node : json_.at("nodes")) {
            if (!node.contains("mesh")) continue;
            for (const char* other : {"matrix", "translation", "rotation", "scale"})
                if (node.contains(other)) raise_other_glb("a node that moves its mesh");
            node["translation"] = grid->lowest, node["scale"] = grid->step;
        }
    }

    bool uses_quantization = false, uses_texels = false;

private:
    static bool has_own_material(const glb_json& mesh, std::size_t primitive) {
        const glb_json& all = mesh.at("primitives");
        return std::count_if(all.begin(), all.end(), [&](const glb_json& other) {
                   return other.at("material") == all.at(primitive).at("material");
               }) == 1;
    }

    void scale_texture(const glb_json& material, const texel_grid& texels) {
        uses_texels = true;
        texture_of(material)["extensions"]["KHR_texture_transform"]["scale"] = {1.0 / double{texels.parts[0]},
                                                                                1.0 / double{texels.parts[1]}};
    }

    glb_json& texture_of(const glb_json& material) {
        return json_.at("materials").at(material.get<std::size_t>()).at("pbrMetallicRoughness").at("baseColorTexture");
    }

    /// Replaces an accessor.
    void put(const glb_json& index, const glb_json& accessor) {
        if (!replaced_.insert(index.get<std::size_t>()).second) raise_other_glb("primitives that share an accessor");
        json_.at("accessors").at(index.get<std::size_t>()) = accessor;
    }

    glb_json accessor(const compressed_stream& stream, int component_type, const char* type,
                      const glb_json& more = glb_json::object()) {
        glb_json result = more;
        result["bufferView"] = packer_.add(stream);
        result["componentType"] = component_type;
        result["count"] = stream.count;
        result["type"] = type;
        return result;
    }

    glb_json position_accessor(primitive_geometry& g, const std::optional<position_grid>& grid) {
        glb_json result = grid ? accessor(compress_positions(g.positions, *grid), 5123, "VEC3")
                               : accessor(compress_positions(g.positions, precision_), 5126, "VEC3");
        for (std::size_t axis = 0; axis < 3; ++axis) {
            float lowest = g.positions[axis], highest = lowest;
            for (std::size_t i = axis; i < g.positions.size(); i += 3)
                lowest = std::min(lowest, g.positions[i]), highest = std::max(highest, g.positions[i]);
            if (grid) {
                result["min"].push_back(grid->place(lowest, axis)), result["max"].push_back(grid->place(highest, axis));
            } else {
                result["min"].push_back(lowest), result["max"].push_back(highest);
            }
        }
        return result;
    }

    glb_json texture_accessor(const primitive_geometry& g, const std::optional<texel_grid>& texels) {
        if (!texels) return accessor(compress_column(g.texture_coordinates, 4), 5123, "VEC2", {{"normalized", true}});
        uses_quantization = true;
        std::vector<std::uint16_t> places(g.texture_coordinates.size());
        for (std::size_t i = 0; i < places.size(); ++i) places[i] = texels->place(g.texture_coordinates[i], i % 2);
        return accessor(compress_column(places, 4), 5123, "VEC2");
    }

    glb_json& json_;
    glb_packer& packer_;
    float precision_;
    std::set<std::size_t> replaced_;
};

/// Adds the textures to the file. With WebP textures, also adds the name of their glTF extension: to `required` if the file can't
/// be shown without the extension, otherwise to `used`.
inline void pack_textures(glb_json& content, glb_packer& packer, std::span<const std::span<const std::byte>> textures,
                          const compression_options& options, std::vector<std::string>& used,
                          std::vector<std::string>& required) {
    const bool has_webp = !options.webp.empty();
    if (has_webp && options.webp.size() != textures.size()) raise_other_glb("a different number of textures than WebP files");
    glb_json& images = content["images"];
    if (!has_webp || options.keeps_texture) {
        for (std::size_t i = 0; i < textures.size(); ++i) images[i]["bufferView"] = packer.add(textures[i]);
    } else {
        images = glb_json::array();
        for (glb_json& texture : content["textures"]) texture.erase("source");
    }
    if (!has_webp) return;
    for (std::size_t i = 0; i < textures.size(); ++i) {
        content["textures"][i]["extensions"]["EXT_texture_webp"]["source"] = images.size();
        images.push_back({{"bufferView", packer.add(options.webp[i])}, {"mimeType", "image/webp"}});
    }
    (options.keeps_texture ? used : required).push_back("EXT_texture_webp");
}

inline std::vector<std::byte> compress_glb(std::span<const std::byte> glb, const compression_options& options) try {
    glb_reader from(glb);
    glb_json& content = from.content;
    std::vector<std::span<const std::byte>> textures;
    std::vector<ldi::picture_header> pictures;
    for (const glb_json& image : content.at("images")) {
        if (content.at("textures").at(textures.size()).at("source") != textures.size())
            raise_other_glb("textures in another order");
        textures.push_back(from.view(image.at("bufferView")));
        pictures.push_back(ldi::read_picture_header(textures.back(), "texture"));
    }
    if (content.at("textures").size() != textures.size()) raise_other_glb("textures without images");
    if (content.at("meshes").size() != 1) raise_other_glb(std::to_string(content.at("meshes").size()) + " meshes");
    glb_json& mesh = content["meshes"][0];
    std::vector<primitive_geometry> geometries;
    for (const glb_json& primitive : mesh.at("primitives")) geometries.push_back(from.geometry(primitive));

    std::vector<std::string> used, required{"EXT_meshopt_compression"};
    glb_packer packer;
    mesh_packer geometry(content, packer, options.precision);
    geometry.pack(mesh, geometries, pictures);
    if (geometry.uses_quantization) required.push_back("KHR_mesh_quantization");
    if (geometry.uses_texels) required.push_back("KHR_texture_transform");
    pack_textures(content, packer, textures, options, used, required);

    content["bufferViews"] = packer.views;
    content["buffers"] = {
        {{"byteLength", packer.binary.size()}},
        {{"byteLength", packer.decoded_bytes}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}}};
    for (const std::string& name : used) content["extensionsUsed"].push_back(name);
    for (const std::string& name : required) {
        content["extensionsUsed"].push_back(name);
        content["extensionsRequired"].push_back(name);
    }
    return put_together(content, packer.binary);
} catch (const nlohmann::json::exception& failure) {
    raise_other_glb(failure.what());
}

}  // namespace ldi::examples
