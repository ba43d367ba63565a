// Writes the GLB file of a 3D photo with tinygltf, for comparison with ldi's own writer.
#pragma once

#include <ldi/formats/glb.hpp>

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <sstream>
#include <string>
#include <vector>

namespace ldi::testing {

/// Collects the parts of a glTF file's one binary buffer.
class glb_builder {
public:
    tinygltf::Model model;

    glb_builder() { model.buffers.emplace_back(); }

    /// Appends a part, little-endian as glTF requires, and returns the index of its view.
    ///
    /// target  glTF's number for vertex attributes or indices; 0 for other data
    template <class Scalar>
    int add_view(std::span<const Scalar> values, int target) {
        std::vector<unsigned char>& data = model.buffers.front().data;
        tinygltf::BufferView view;
        view.buffer = 0;
        view.byteOffset = data.size();
        view.byteLength = values.size_bytes();
        view.target = target;
        const unsigned char* const first = reinterpret_cast<const unsigned char*>(values.data());
        data.insert(data.end(), first, first + values.size_bytes());
        model.bufferViews.push_back(view);
        return static_cast<int>(model.bufferViews.size()) - 1;
    }

    /// Appends a view and an accessor for all of it, and returns the index of the accessor.
    template <class Scalar>
    int add_accessor(std::span<const Scalar> values, int target, int component_type, int type, bool normalized = false) {
        tinygltf::Accessor accessor;
        accessor.bufferView = add_view(values, target);
        accessor.componentType = component_type;
        accessor.type = type;
        accessor.normalized = normalized;
        accessor.count =
            values.size() / static_cast<std::size_t>(tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type)));
        model.accessors.push_back(accessor);
        return static_cast<int>(model.accessors.size()) - 1;
    }
};

/// Adds the mesh's accessors, in an order that aligns every part to its scalars without padding, and returns the primitive.
inline tinygltf::Primitive add_geometry(glb_builder& glb, const textured_mesh& mesh) {
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.material = 0;

    const int position = glb.add_accessor(std::span<const float>(mesh.positions), TINYGLTF_TARGET_ARRAY_BUFFER,
                                          TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3);
    std::vector<double> lowest(3, std::numeric_limits<double>::infinity()), highest(3, -std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
        lowest[i % 3] = (std::min)(lowest[i % 3], static_cast<double>(mesh.positions[i]));
        highest[i % 3] = (std::max)(highest[i % 3], static_cast<double>(mesh.positions[i]));
    }
    glb.model.accessors.back().minValues = lowest, glb.model.accessors.back().maxValues = highest;
    primitive.attributes["POSITION"] = position;

    buffer<std::uint16_t> texture_coordinates(mesh.texture_coordinates.size());
    std::transform(mesh.texture_coordinates.begin(), mesh.texture_coordinates.end(), texture_coordinates.begin(),
                   [](float t) { return static_cast<std::uint16_t>(std::lround(t * 65535.0F)); });
    primitive.attributes["TEXCOORD_0"] =
        glb.add_accessor(std::span<const std::uint16_t>(texture_coordinates), TINYGLTF_TARGET_ARRAY_BUFFER,
                         TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_VEC2, true);

    if (mesh.vertex_count() < 65536) {  // index 65,535 is reserved; it does not occur
        const buffer<std::uint16_t> indices(mesh.triangles.begin(), mesh.triangles.end());
        primitive.indices = glb.add_accessor(std::span<const std::uint16_t>(indices), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER,
                                             TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_SCALAR);
    } else {
        primitive.indices = glb.add_accessor(std::span<const std::uint32_t>(mesh.triangles), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER,
                                             TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR);
    }
    return primitive;
}

/// Adds material 0, which shows the unchanged texture unlit. Viewers without unlit materials show it as not metallic.
inline void add_material(glb_builder& glb, std::span<const std::byte> texture, bool double_sided) {
    tinygltf::Image image;  // refers to a view, because tinygltf would otherwise encode the picture again
    image.bufferView = glb.add_view(texture, 0);
    image.mimeType = detail::is_png(texture) ? "image/png" : "image/jpeg";
    glb.model.images.push_back(image);

    tinygltf::Sampler sampler;
    sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
    sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
    sampler.wrapS = sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    glb.model.samplers.push_back(sampler);

    tinygltf::Texture atlas;
    atlas.source = 0, atlas.sampler = 0;
    glb.model.textures.push_back(atlas);

    tinygltf::Material material;
    material.pbrMetallicRoughness.baseColorTexture.index = 0;
    material.pbrMetallicRoughness.metallicFactor = 0;
    material.doubleSided = double_sided;
    material.extensions["KHR_materials_unlit"] = tinygltf::Value(tinygltf::Value::Object());
    glb.model.materials.push_back(material);
    glb.model.extensionsUsed.push_back("KHR_materials_unlit");
}

/// Adds a node at the origin that looks along -z, the default pose of glTF's cameras.
inline void add_camera(tinygltf::Model& model, const pinhole_camera& photo, const textured_mesh& mesh) {
    LDI_ASSERT(photo.width > 0 && photo.height > 0 && photo.focal_length > 0);
    double nearest = std::numeric_limits<double>::infinity(), farthest = 0;
    for (std::size_t i = 2; i < mesh.positions.size(); i += 3) {
        nearest = (std::min)(nearest, -static_cast<double>(mesh.positions[i]));
        farthest = (std::max)(farthest, -static_cast<double>(mesh.positions[i]));
    }
    tinygltf::Camera camera;
    camera.type = "perspective";
    camera.perspective.yfov = 2 * std::atan(0.5 * photo.height / static_cast<double>(photo.focal_length));
    camera.perspective.aspectRatio = static_cast<double>(photo.width) / photo.height;
    // Leaves room to move forward and back.
    camera.perspective.znear = nearest > 0 ? 0.1 * nearest : 0.01;
    camera.perspective.zfar = (std::max)(10 * farthest, 100 * camera.perspective.znear);
    model.cameras.push_back(camera);
    tinygltf::Node node;
    node.name = "photo camera";
    node.camera = 0;
    model.nodes.push_back(node);
}

inline std::string tinygltf_glb(const textured_mesh& mesh, std::span<const std::byte> texture, const glb_options& options) {
    glb_builder glb;
    tinygltf::Model& model = glb.model;
    tinygltf::Mesh part;
    part.primitives.push_back(add_geometry(glb, mesh));
    model.meshes.push_back(part);
    add_material(glb, texture, options.double_sided);
    tinygltf::Node node;
    node.name = "3D photo";
    node.mesh = 0;
    model.nodes.push_back(node);
    if (options.camera) add_camera(model, *options.camera, mesh);
    tinygltf::Scene scene;
    for (std::size_t i = 0; i < model.nodes.size(); ++i) scene.nodes.push_back(static_cast<int>(i));
    model.scenes.push_back(scene);
    model.defaultScene = 0;
    model.asset.version = "2.0";
    model.asset.generator = "ldi " + std::to_string(LDI_VERSION_MAJOR) + "." + std::to_string(LDI_VERSION_MINOR) + "." +
                            std::to_string(LDI_VERSION_PATCH);
    std::ostringstream stream(std::ios::binary);
    tinygltf::TinyGLTF writer;
    writer.WriteGltfSceneToStream(&model, stream, false, true);
    return stream.str();
}

}  // namespace ldi::testing
