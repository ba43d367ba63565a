// A 3D photo as one GLB file (binary glTF 2.0): a mesh, its JPEG texture, and the camera that took the photo. Only features that
// every viewer reads; KHR_materials_unlit is declared as used, not as required.
#pragma once

#include <ldi/base/error.hpp>
#include <ldi/base/memory.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/formats/detail/picture_format.hpp>
#include <ldi/formats/file.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/version.hpp>

#include <tiny_gltf.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

namespace ldi {

struct glb_options {
    /// The camera that took the photo, for viewers that start there. Absent: the file has none.
    std::optional<pinhole_camera> camera;
    /// Backs of triangles are drawn too. They are seen only from far off the photo's viewpoint, where the alternative is a hole.
    bool double_sided = true;
};

/// A GLB file of a mesh and its texture: one node, mesh and primitive. Positions are float32, texture coordinates normalized
/// 16-bit, indices 16-bit below 65,536 vertices and 32-bit from there. Every vertex that no triangle uses is kept.
///
/// texture  a JPEG file
/// Errors: invalid_data if the mesh is empty, has a coordinate that is not finite, a texture coordinate outside [0, 1] or an
/// index out of range, or if the texture is no complete JPEG file; too_large beyond 4 GB.
std::vector<std::byte> encode_glb(const textured_mesh& mesh, std::span<const std::byte> texture, const glb_options& options = {});

/// encode_glb() to a file; also raises file_access.
inline void save_glb(const std::filesystem::path& path, const textured_mesh& mesh, std::span<const std::byte> texture,
                     const glb_options& options = {}) {
    write_file(path, encode_glb(mesh, texture, options));
}

namespace detail {

inline void check_mesh(const textured_mesh& mesh) {
    LDI_ASSERT(mesh.positions.size() % 3 == 0 && mesh.triangles.size() % 3 == 0);
    LDI_ASSERT(mesh.texture_coordinates.size() / 2 == mesh.vertex_count() && mesh.texture_coordinates.size() % 2 == 0);
    const auto broken = [](const char* expected, const std::string& found) {
        raise(error_code::invalid_data, "encode_glb", expected, found);
    };
    if (mesh.triangles.empty()) broken("a mesh with triangles", "none");
    for (float p : mesh.positions)
        if (!std::isfinite(p)) broken("finite positions", std::to_string(p));
    for (float t : mesh.texture_coordinates)
        if (!(t >= 0 && t <= 1)) broken("texture coordinates in [0, 1]", std::to_string(t));
    for (std::uint32_t i : mesh.triangles)
        if (i >= mesh.vertex_count())
            broken("indices of vertices", std::to_string(i) + " of " + std::to_string(mesh.vertex_count()) + " vertices");
}

/// Collects the parts of a glTF file's one binary buffer.
class glb_builder {
public:
    tinygltf::Model model;

    glb_builder() { model.buffers.emplace_back(); }

    /// Appends a part, little-endian as glTF demands, and returns its view. target  as glTF numbers them, 0 for none
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

    /// Appends an accessor over the whole of a new view and returns it.
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

/// The primitive's accessors, in an order that aligns every part to its scalars without padding.
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

    if (mesh.vertex_count() < 65536) {  // the index 65,535 itself is reserved, and not reached
        const buffer<std::uint16_t> indices(mesh.triangles.begin(), mesh.triangles.end());
        primitive.indices = glb.add_accessor(std::span<const std::uint16_t>(indices), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER,
                                             TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_SCALAR);
    } else {
        primitive.indices = glb.add_accessor(std::span<const std::uint32_t>(mesh.triangles), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER,
                                             TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR);
    }
    return primitive;
}

/// Material 0: the texture as it is, unlit; not metal where a viewer knows no unlit materials.
inline void add_material(glb_builder& glb, std::span<const std::byte> texture, bool double_sided) {
    tinygltf::Image jpeg;  // with a view and no uri; without the view tinygltf would encode anew, as a data URI
    jpeg.bufferView = glb.add_view(texture, 0);
    jpeg.mimeType = "image/jpeg";
    glb.model.images.push_back(jpeg);

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

/// A node at the origin, looking along -z as glTF's cameras do by themselves.
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
    // Room to move forward and back. An infinite zfar is legal, but tinygltf would write it as 0, which is not.
    camera.perspective.znear = nearest > 0 ? 0.1 * nearest : 0.01;
    camera.perspective.zfar = (std::max)(10 * farthest, 100 * camera.perspective.znear);
    model.cameras.push_back(camera);
    tinygltf::Node node;
    node.name = "photo camera";
    node.camera = 0;
    model.nodes.push_back(node);
}

}  // namespace detail

inline std::vector<std::byte> encode_glb(const textured_mesh& mesh, std::span<const std::byte> texture,
                                         const glb_options& options) {
    detail::check_mesh(mesh);
    if (!detail::is_jpeg(texture))
        raise(error_code::invalid_data, "encode_glb", "a JPEG file as texture", detail::describe_format(texture));
    detail::read_jpeg_header(texture, "texture");

    detail::glb_builder glb;
    tinygltf::Model& model = glb.model;
    tinygltf::Mesh part;
    part.primitives.push_back(detail::add_geometry(glb, mesh));
    model.meshes.push_back(part);
    detail::add_material(glb, texture, options.double_sided);
    if (model.buffers.front().data.size() > 0xFFFF0000)
        raise(error_code::too_large, "encode_glb", "less than 4 GB",
              std::to_string(model.buffers.front().data.size()) + " bytes");

    tinygltf::Node node;
    node.name = "3D photo";
    node.mesh = 0;
    model.nodes.push_back(node);
    if (options.camera) detail::add_camera(model, *options.camera, mesh);
    tinygltf::Scene scene;
    for (std::size_t i = 0; i < model.nodes.size(); ++i) scene.nodes.push_back(static_cast<int>(i));
    model.scenes.push_back(scene);
    model.defaultScene = 0;
    model.asset.version = "2.0";
    model.asset.generator = "ldi " + std::to_string(LDI_VERSION_MAJOR) + "." + std::to_string(LDI_VERSION_MINOR) + "." +
                            std::to_string(LDI_VERSION_PATCH);

    std::ostringstream stream(std::ios::binary);
    tinygltf::TinyGLTF writer;
    // A stream keeps to itself what goes wrong, such as a lack of memory; the writer does not ask it.
    if (!writer.WriteGltfSceneToStream(&model, stream, false, true) || !stream)
        raise(error_code::too_large, "encode_glb", "a file that fits in memory",
              std::to_string(model.buffers.front().data.size()) + " bytes of mesh and texture");
    const std::string file = stream.str();
    std::vector<std::byte> bytes(file.size());
    std::memcpy(bytes.data(), file.data(), file.size());
    return bytes;
}

}  // namespace ldi
