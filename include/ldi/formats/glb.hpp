// Writes a 3D photo as one GLB file (binary glTF 2.0): a mesh, its textures, and the camera that took the photo. Uses only
// features that every viewer supports. The only extension, KHR_materials_unlit, is optional for viewers: the file declares it
// as used, not as required.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/base/utf8.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/image.hpp>
#include <ldi/formats/detail/glb_contents.hpp>
#include <ldi/formats/detail/glb_writer.hpp>
#include <ldi/formats/jpeg_png_header.hpp>
#include <ldi/formats/plain_png.hpp>
#include <ldi/mesh/textured_mesh.hpp>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Values that the caller attaches to each vertex of a mesh, for example the result of gather() (mesh/gather.hpp).
struct vertex_attribute {
    /// Attribute name in the form that glTF requires of custom attributes: an underscore, then capital letters, digits and
    /// underscores.
    std::string name;
    std::size_t channels = 1;  ///< 1 to 4
    buffer<float> values;      ///< V x channels, finite
};

/// Options of encode_glb(): additional data for the file, and whether viewers draw back sides.
struct glb_options {
    /// Camera that took the photo, with a positive size and a positive focal length. Viewers may start at its position. If
    /// absent, the file has no camera.
    std::optional<pinhole_camera> camera;
    /// Motion budget for viewers (render/motion.hpp), at least 0, written as `motion` in the scene's extras. If absent, the
    /// extras contain no `motion`.
    std::optional<float> motion = std::nullopt;
    /// Distances of the nearest and the farthest surface, with 0 < z_near <= z_far. If `motion` is present, they are written as
    /// `nearest` and `farthest`; otherwise they are unused. If `motion` and `camera` are present, the camera's focal length is
    /// written as `focal_length_35mm`.
    depth_range range = {};
    /// Whether surfaces continue past the photo's border (photo_facts::margin). If true and `motion` is present, `past_frame`
    /// is written to the extras. This entry tells viewers that they do not need to hide the photo's border behind a smaller
    /// frame.
    bool is_past_frame = false;
    /// Name of the photo in UTF-8, written as `source` in the scene's extras unless empty.
    std::string source = {};
    /// Additional vertex attributes with distinct names. The vertices of soft edges have no such attributes.
    buffer<vertex_attribute> attributes = {};
    /// Whether viewers draw the back sides of triangles. Back sides are visible only far from the photo's viewpoint, where they
    /// cover holes.
    bool double_sided = true;
};

/// Encodes a mesh and its textures as a GLB file with one mesh. The mesh has one primitive per texture, and one more for soft
/// edges, which viewers blend over the other primitives (COLOR_0 with alpha). Positions are float32. Texture coordinates are
/// normalized 16-bit numbers. Indices have 16 bits in primitives with fewer than 65,536 vertices, otherwise 32 bits. The file
/// keeps unused vertices, but omits parts without triangles and textures that only such parts use.
///
/// textures  one JPEG or PNG file for each part of the mesh
///
/// Raises mismatch if the number of textures is not the number of parts, or if the mesh's arrays have different numbers of
/// vertices; invalid_data if the mesh is empty, has a coordinate that is not finite, a texture coordinate outside [0, 1] or an
/// index out of range, or if a texture is not a complete JPEG or PNG file; unsupported for a JPEG or PNG variant that
/// read_picture_header() rejects; invalid_option for a camera, a motion, a range or a source that violates glb_options, and for
/// an attribute that violates vertex_attribute; too_large beyond 4 GB.
buffer<std::byte> encode_glb(const textured_mesh& mesh, std::span<const std::span<const std::byte>> textures,
                             const glb_options& options = {});

/// Encodes a mesh with one texture.
inline buffer<std::byte> encode_glb(const textured_mesh& mesh, std::span<const std::byte> texture,
                                    const glb_options& options = {}) {
    return encode_glb(mesh, std::span(&texture, 1), options);
}

/// Encodes a mesh with a texture of H x W x 3 or H x W x 1 pixels. Stores the texture as PNG with encode_plain_png(), and also
/// raises the errors of that function, for example mismatch for an RGBA texture. A JPEG file from an encoder of your choice has
/// about a quarter of the size.
inline buffer<std::byte> encode_glb(const textured_mesh& mesh, image_view<const std::uint8_t> texture,
                                    const glb_options& options = {}) {
    return encode_glb(mesh, encode_plain_png(texture), options);
}

namespace detail {

inline void check_contents(const textured_mesh& mesh, std::span<const std::span<const std::byte>> textures) {
    if (mesh.triangles.empty()) raise(error_code::invalid_data, "encode_glb", "a mesh with triangles", "none");
    check_mesh(mesh, textures.size());
    for (const buffer<float>* coordinates : {&mesh.texture_coordinates, &mesh.soft_edges.texture_coordinates})
        for (const float t : *coordinates)
            if (!(t >= 0 && t <= 1)) raise(error_code::invalid_data, "encode_glb", "texture coordinates in [0, 1]", to_text(t));
    for (const std::span<const std::byte>& texture : textures) {
        if (!is_jpeg(texture) && !is_png(texture))
            raise(error_code::invalid_data, "encode_glb", "a JPEG or PNG file as a texture", describe_format(texture));
        read_picture_header(texture, "texture");
    }
}

/// Returns a camera's focal length as written to the file: in millimeters, for 35 mm film.
inline float focal_length_in_file(const pinhole_camera& camera) {
    return camera.focal_length / focal_length_from_35mm(1.0F, camera.width, camera.height);
}

inline void check_options(const glb_options& options) {
    const auto refuse = [](const char* option, const char* expected, const std::string& found) {
        raise(error_code::invalid_option, option, expected, found);
    };
    const auto is_positive = [](float value) { return value > 0 && std::isfinite(value); };
    if (const std::optional<pinhole_camera>& camera = options.camera)
        if (camera->width <= 0 || camera->height <= 0 || !is_positive(camera->focal_length) ||
            !is_positive(focal_length_in_file(*camera)))
            refuse(
                "glb_options::camera", "a positive size and a positive, finite focal length",
                std::to_string(camera->width) + " x " + std::to_string(camera->height) + " and " + to_text(camera->focal_length));
    if (options.motion) {
        if (!(*options.motion >= 0) || !std::isfinite(*options.motion))
            refuse("glb_options::motion", "a finite number of at least 0", to_text(*options.motion));
        const depth_range& range = options.range;
        if (!is_positive(range.z_near) || !is_positive(range.z_far) || range.z_near > range.z_far)
            refuse("glb_options::range", "finite distances with 0 < z_near <= z_far",
                   to_text(range.z_near) + " and " + to_text(range.z_far));
    }
    for (std::string_view rest = options.source; !rest.empty();) {
        const std::size_t length = utf8_length(rest);
        if (length == 0) refuse("glb_options::source", "UTF-8", printable(options.source));
        rest.remove_prefix(length);
    }
}

inline void check_attributes(const textured_mesh& mesh, const buffer<vertex_attribute>& attributes) {
    const auto refuse = [](const vertex_attribute& a, const std::string& expected, const std::string& found) {
        raise(error_code::invalid_option, "glb_options::attributes", expected, found + " in " + a.name);
    };
    for (std::size_t i = 0; i < attributes.size(); ++i) {
        const vertex_attribute& a = attributes[i];
        const auto is_allowed = [](char c) { return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; };
        if (a.name.size() < 2 || a.name.size() > 64 || a.name[0] != '_' || !std::all_of(a.name.begin(), a.name.end(), is_allowed))
            raise(error_code::invalid_option, "glb_options::attributes",
                  "a name with an underscore, then 1 to 63 capital letters, digits or underscores", printable(a.name));
        for (std::size_t k = 0; k < i; ++k)
            if (attributes[k].name == a.name) refuse(a, "unique attribute names", "a duplicate name");
        if (a.channels < 1 || a.channels > 4) refuse(a, "1 to 4 channels", std::to_string(a.channels));
        if (a.values.size() != mesh.vertex_count() * a.channels)
            refuse(a, std::to_string(a.channels) + " values for each of " + std::to_string(mesh.vertex_count()) + " vertices",
                   std::to_string(a.values.size()) + " values");
        for (const float value : a.values)
            if (!std::isfinite(value)) refuse(a, "finite values", detail::to_text(value));
    }
}

}  // namespace detail

namespace detail::glb {

/// Adds a camera at the origin that looks along -z, the default pose of glTF.
inline void add_camera(json_text& json, const pinhole_camera& photo, const contents& c) {
    double highest = -std::numeric_limits<double>::infinity(), lowest = -highest;
    for (const geometry& g : c.parts)
        if (!g.is_strip()) highest = (std::max)(highest, g.highest[2]), lowest = (std::min)(lowest, g.lowest[2]);
    const double nearest = -highest, farthest = (std::max)(0.0, -lowest);
    // This range leaves room for viewers to move forward and back.
    const double z_near = nearest > 0 ? 0.1 * nearest : 0.01, z_far = (std::max)(10 * farthest, 100 * z_near);
    json.add(R"("cameras":[{"perspective":{"aspectRatio":)", nearest_double(photo.width) / photo.height);
    json.add(R"(,"yfov":)", 2 * std::atan(0.5 * photo.height / double{photo.focal_length}));
    json.add(R"(,"zfar":)", z_far, R"(,"znear":)", z_near, R"(},"type":"perspective"}],)");
}

/// Quotes text as a JSON string.
inline std::string json_string(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
        constexpr char digits[] = "0123456789abcdef";
        const unsigned code = static_cast<unsigned char>(c);
        if (code < 32 || code == 127) {
            result += std::string("\\u00") + digits[code / 16] + digits[code % 16];
            continue;
        }
        if (c == '"' || c == '\\') result += '\\';
        result += c;
    }
    return result + '"';
}

/// Adds the scene's extras: data for which glTF has no field. Adds nothing if there is no such data.
inline void add_extras(json_text& json, const glb_options& options) {
    const char* before = R"("extras":{)";
    const auto add = [&](std::string_view name, const auto& value) {
        json.add(before, "\"", name, "\":", value);
        before = ",";
    };
    if (options.motion) add("farthest", rounded(options.range.z_far));
    if (options.motion && options.camera) add("focal_length_35mm", rounded(focal_length_in_file(*options.camera)));
    if (options.motion) add("motion", rounded(*options.motion)), add("nearest", rounded(options.range.z_near));
    if (options.motion && options.is_past_frame) add("past_frame", std::string_view("true"));
    if (!options.source.empty()) add("source", std::string_view(json_string(options.source)));
    if (before[0] == ',') json.add("},");
}

/// Writes the JSON of the file. Members are in alphabetical order, as in most glTF writers.
inline buffer<char> describe(const contents& c, const glb_options& options) {
    json_text json;
    json.add("{");
    add_accessors_and_views(json, c);
    if (options.camera) add_camera(json, *options.camera, c);
    json.add(R"("extensionsUsed":["KHR_materials_unlit"],"images":[)");
    const auto add_list = [&](std::size_t count, auto&& add_item) {
        for (std::size_t i = 0; i < count; ++i) {
            if (i > 0) json.add(",");
            add_item(i);
        }
    };
    add_list(c.textures.size(), [&](std::size_t t) {
        json.add(R"({"bufferView":)", c.view_of_texture(t), R"(,"mimeType":")",
                 is_png(c.textures[t]) ? "image/png" : "image/jpeg", R"("})");
    });
    // Unlit materials show the texture unchanged. Viewers without support for unlit materials show a non-metallic surface.
    json.add(R"(],"materials":[)");
    add_list(c.parts.size(), [&](std::size_t p) {
        json.add("{", c.parts[p].is_strip() ? R"("alphaMode":"BLEND",)" : "",
                 options.double_sided ? R"("doubleSided":true,)" : "",
                 R"("extensions":{"KHR_materials_unlit":{}},"pbrMetallicRoughness":{"baseColorTexture":{"index":)",
                 c.parts[p].texture, R"(},"metallicFactor":0.0}})");
    });
    json.add(R"(],"meshes":[{"primitives":[)");
    add_list(c.parts.size(), [&](std::size_t p) {
        const geometry& g = c.parts[p];
        const std::size_t first = c.first_accessor(p);
        json.add(R"({"attributes":{)");
        if (g.is_strip()) json.add(R"("COLOR_0":)", first + 2, ",");
        json.add(R"("POSITION":)", first, R"(,"TEXCOORD_0":)", first + 1);
        for (std::size_t a = 0; a < g.own.size(); ++a) json.add(",\"", g.own[a].name, "\":", first + 2 + a);
        json.add(R"(},"indices":)", first + g.accessor_count() - 1, R"(,"material":)", p, R"(,"mode":4})");
    });
    json.add(R"(]}],"nodes":[{"mesh":0,"name":"3D photo"})");
    if (options.camera) json.add(R"(,{"camera":0,"name":"photo camera"})");
    // Linear filtering with mipmaps; texture coordinates are clamped to the edges.
    json.add(R"(],"samplers":[{"magFilter":9729,"minFilter":9987,"wrapS":33071,"wrapT":33071}],"scene":0,"scenes":[{)");
    add_extras(json, options);
    json.add(R"("nodes":)", options.camera ? "[0,1]" : "[0]", R"(}],"textures":[)");
    add_list(c.textures.size(), [&](std::size_t t) { json.add(R"({"sampler":0,"source":)", t, "}"); });
    json.add("]}");
    return json.text();
}

}  // namespace detail::glb

inline buffer<std::byte> encode_glb(const textured_mesh& mesh, std::span<const std::span<const std::byte>> textures,
                                    const glb_options& options) {
    using namespace detail::glb;
    detail::check_options(options);
    detail::check_contents(mesh, textures);
    detail::check_attributes(mesh, options.attributes);
    buffer<own_attribute> own;
    for (const vertex_attribute& a : options.attributes) own.push_back({a.name, a.channels, a.values});
    const contents parts(mesh, textures, own);
    const auto limit_size = [](std::uint64_t bytes) {
        if (bytes > 0xFFFFFFFF) raise(error_code::too_large, "encode_glb", "less than 4 GB", std::to_string(bytes) + " bytes");
    };
    limit_size(parts.bytes());
    const buffer<char> json = describe(parts, options);
    limit_size(std::uint64_t{parts.bytes()} + json.size() + 12 + 8 + 8 + 3 + 3);  // with headers and padding
    const auto up_to_four = [](std::size_t bytes) { return (bytes + 3) / 4 * 4; };
    const std::size_t json_bytes = up_to_four(json.size()), binary_bytes = up_to_four(parts.bytes());
    buffer<std::byte> file(12 + 8 + json_bytes + 8 + binary_bytes, unset);
    writer to(file.data());
    const auto put_size = [&to](std::size_t bytes) { to.put(static_cast<std::uint32_t>(bytes)); };
    to.put(magic), to.put(version), put_size(file.size());
    put_size(json_bytes), to.put(json_chunk);
    to.put_bytes(json.data(), json.size()), to.put_padding(std::byte{' '}, json_bytes - json.size());
    put_size(binary_bytes), to.put(binary_chunk);
    put_contents(to, parts);
    to.put_padding(std::byte{0}, binary_bytes - parts.bytes());
    return file;
}

}}  // namespace ldi
