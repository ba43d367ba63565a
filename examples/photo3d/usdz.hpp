// Encodes a 3D photo as USDZ, which iPhones, iPads and Macs show without an extra app (AR Quick Look): `photo3d --usdz
// FILE`. A USDZ file is a zip file with uncompressed files, each aligned to 64 bytes ("Usdz File Format Specification", Pixar):
// a scene as text (usda), then its textures.
#pragma once

#include "outputs.hpp"

#include <ldi/base/error.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/formats/checksums.hpp>
#include <ldi/formats/glb.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/version.hpp>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace ldi::examples {

/// Checks the output's name before the conversion starts. Raises invalid_option for another type of file, and the errors of
/// output_files::claim().
inline void check_usdz(const std::filesystem::path& file, output_files& files) {
    if (file.empty()) return;
    files.claim(file);
    check_ending(file, {".usdz"}, "photo3d writes a USDZ file");
}

/// A zip file of uncompressed files, each aligned to 64 bytes.
class stored_zip {
public:
    /// Adds a file.
    ///
    /// name  ASCII, with / between folders
    void add(std::string_view name, std::span<const std::byte> content) {
        const std::size_t header = 30 + name.size() + 4;  // an empty extra field occupies 4 bytes
        const std::size_t padding = (64 - (file_.size() + header) % 64) % 64;
        const std::uint32_t checksum = ldi::crc32(content);
        ++count_;
        put_32(directory_, 0x02014B50), put_16(directory_, 20);
        put_facts(directory_, name, content, checksum, 0);
        for (int i = 0; i < 3; ++i) put_16(directory_, 0);  // no comment, first disk, no attributes
        put_32(directory_, 0), put_32(directory_, file_.size());
        put_text(directory_, name);
        put_32(file_, 0x04034B50);
        put_facts(file_, name, content, checksum, 4 + padding);
        put_text(file_, name);
        put_16(file_, 0x1986), put_16(file_, padding);  // the tag that USD's own writer uses for padding
        file_.resize(file_.size() + padding);
        file_.insert(file_.end(), content.begin(), content.end());
        if (file_.size() > 0xFFFF0000) raise(error_code::too_large, "USDZ", "less than 4 GB", "more");
    }

    std::vector<std::byte> finish() {
        const std::size_t begin = file_.size();
        file_.insert(file_.end(), directory_.begin(), directory_.end());
        put_32(file_, 0x06054B50), put_16(file_, 0), put_16(file_, 0);
        put_16(file_, count_), put_16(file_, count_);
        put_32(file_, directory_.size()), put_32(file_, begin), put_16(file_, 0);
        return std::move(file_);
    }

private:
    using bytes = std::vector<std::byte>;

    static void put_16(bytes& to, std::size_t value) {
        for (int shift = 0; shift < 16; shift += 8) to.push_back(static_cast<std::byte>(value >> shift & 255));
    }
    static void put_32(bytes& to, std::size_t value) { put_16(to, value & 0xFFFF), put_16(to, value >> 16); }
    static void put_text(bytes& to, std::string_view text) {
        for (const char c : text) to.push_back(static_cast<std::byte>(c));
    }
    /// Appends the fields that both headers of a file share: uncompressed, zip's earliest date, checksum and sizes.
    static void put_facts(bytes& to, std::string_view name, std::span<const std::byte> content, std::uint32_t checksum,
                          std::size_t extra) {
        put_16(to, 20), put_16(to, 0), put_16(to, 0);
        put_16(to, 0), put_16(to, 0x21);
        put_32(to, checksum), put_32(to, content.size()), put_32(to, content.size());
        put_16(to, name.size()), put_16(to, extra);
    }

    bytes file_, directory_;
    std::size_t count_ = 0;
};

/// Builds the text of a USD scene.
class usda_text {
public:
    void add(std::string_view part) { text_ += part; }

    void add(double number) {
        char digits[32];
        const std::to_chars_result end = std::to_chars(digits, digits + sizeof digits, number, std::chars_format::general, 7);
        text_.append(digits, end.ptr);
    }

    /// Appends (1, 2), (3, 4), or 1, 2 for items of one number.
    template <class Number>
    void add_items(const std::vector<Number>& numbers, std::size_t in_item) {
        for (std::size_t i = 0; i < numbers.size(); ++i) {
            if (i > 0) text_ += ", ";
            if (in_item > 1 && i % in_item == 0) text_ += '(';
            add(static_cast<double>(numbers[i]));
            if (in_item > 1 && i % in_item == in_item - 1) text_ += ')';
        }
    }
    template <class Number>
    void add_list(const std::vector<Number>& numbers, std::size_t in_item) {
        text_ += '[', add_items(numbers, in_item), text_ += ']';
    }

    const std::string& text() const { return text_; }

private:
    std::string text_;
};

/// Quotes text, without its control characters.
inline std::string usda_string(std::string_view text) {
    std::string result = "\"";
    for (const char c : text) {
        if (static_cast<unsigned char>(c) < 32) continue;
        if (c == '"' || c == '\\') result += '\\';
        result += c;
    }
    return result + '"';
}

/// Bounding box of points.
struct usda_extent {
    std::array<float, 3> lowest, highest;

    explicit usda_extent(std::span<const float> positions) {
        lowest.fill(std::numeric_limits<float>::infinity()), highest.fill(-std::numeric_limits<float>::infinity());
        for (std::size_t i = 0; i < positions.size(); ++i) {
            lowest[i % 3] = std::min(lowest[i % 3], positions[i]);
            highest[i % 3] = std::max(highest[i % 3], positions[i]);
        }
    }
};

/// Appends the geometry of part t of a mesh.
inline void add_mesh(usda_text& scene, const textured_mesh& mesh, std::size_t t) {
    const mesh_part first = mesh.part(t), last = mesh.part(t + 1);
    const auto of_part = [](const auto& column, std::size_t values, std::size_t begin, std::size_t end) {
        return std::vector(column.begin() + values * begin, column.begin() + values * end);
    };
    const std::vector<float> positions = of_part(mesh.positions, 3, first.first_vertex, last.first_vertex);
    std::vector<float> coordinates = of_part(mesh.texture_coordinates, 2, first.first_vertex, last.first_vertex);
    for (std::size_t i = 1; i < coordinates.size(); i += 2) coordinates[i] = 1 - coordinates[i];  // USD's origin is at the bottom
    std::vector<std::uint32_t> triangles = of_part(mesh.triangles, 3, first.first_triangle, last.first_triangle);
    for (std::uint32_t& vertex : triangles) vertex -= static_cast<std::uint32_t>(first.first_vertex);
    const usda_extent box(positions);
    scene.add("        float3[] extent = ");
    scene.add_list(
        std::vector<float>{box.lowest[0], box.lowest[1], box.lowest[2], box.highest[0], box.highest[1], box.highest[2]}, 3);
    scene.add("\n        int[] faceVertexCounts = ");
    scene.add_list(std::vector<int>(triangles.size() / 3, 3), 1);
    scene.add("\n        int[] faceVertexIndices = ");
    scene.add_list(triangles, 1);
    scene.add("\n        point3f[] points = ");
    scene.add_list(positions, 3);
    scene.add("\n        texCoord2f[] primvars:st = ");
    scene.add_list(coordinates, 2);
    // The photo stands on the floor. Its nearest surface is in front of the position where the user places the photo, and its
    // farthest surface is behind that position.
    const usda_extent all(mesh.positions);
    scene.add(" (\n            interpolation = \"vertex\"\n        )\n        double3 xformOp:translate = ");
    scene.add_items(
        std::vector<float>{-0.5F * (all.lowest[0] + all.highest[0]), -all.lowest[1], -0.5F * (all.lowest[2] + all.highest[2])},
        3);
}

/// The texture emits light and reflects none, so that it looks the same in any light. $ is replaced by the part's suffix.
inline constexpr std::string_view usda_material = R"(
    def Material "Material$"
    {
        token outputs:surface.connect = </Photo/Material$/Surface.outputs:surface>

        def Shader "Surface"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0, 0, 0)
            color3f inputs:emissiveColor.connect = </Photo/Material$/Texture.outputs:rgb>
            float inputs:ior = 1
            float inputs:metallic = 0
            float inputs:roughness = 1
            token outputs:surface
        }

        def Shader "Coordinates"
        {
            uniform token info:id = "UsdPrimvarReader_float2"
            string inputs:varname = "st"
            float2 outputs:result
        }

        def Shader "Texture"
        {
            uniform token info:id = "UsdUVTexture"
            asset inputs:file = @textures/photo$.jpg@
            token inputs:sourceColorSpace = "sRGB"
            float2 inputs:st.connect = </Photo/Material$/Coordinates.outputs:result>
            token inputs:wrapS = "clamp"
            token inputs:wrapT = "clamp"
            float3 outputs:rgb
        }
    }
)";

/// Returns a suffix for the names of part t; empty if there is only one part.
inline std::string usda_suffix(const textured_mesh& mesh, std::size_t t) {
    return mesh.part_count() > 1 ? "_" + std::to_string(t) : "";
}

/// Describes part t of a mesh and its material.
inline std::string describe_part(const textured_mesh& mesh, std::size_t t) {
    usda_text placed;
    add_mesh(placed, mesh, t);
    const std::string suffix = usda_suffix(mesh, t);
    std::string material;
    for (const char c : usda_material) material += c == '$' ? suffix : std::string(1, c);
    return "    def Mesh \"Mesh" + suffix + R"(" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        uniform bool doubleSided = 1
)" + placed.text() +
           R"(
        uniform token[] xformOpOrder = ["xformOp:translate"]
        rel material:binding = </Photo/Material)" +
           suffix + R"(>
        uniform token subdivisionScheme = "none"
    }
)" + material;
}

/// Lists the parts that have triangles.
inline std::vector<std::size_t> usda_parts(const textured_mesh& mesh) {
    std::vector<std::size_t> parts;
    for (std::size_t t = 0; t < mesh.part_count(); ++t)
        if (mesh.part(t).first_triangle < mesh.part(t + 1).first_triangle) parts.push_back(t);
    return parts;
}

/// Writes the scene as text.
inline std::string describe_usda(const textured_mesh& mesh, const glb_options& facts) {
    usda_text numbers;
    const auto add = [&](const char* name, float value) {
        numbers.add("        double "), numbers.add(name), numbers.add(" = "), numbers.add(double{value}), numbers.add("\n");
    };
    add("farthest", facts.range.z_far);
    if (facts.camera)
        add("focal_length_35mm",
            facts.camera->focal_length / focal_length_from_35mm(1.0F, facts.camera->width, facts.camera->height));
    if (facts.motion) add("motion", *facts.motion);
    add("nearest", facts.range.z_near);
    std::string parts;
    for (const std::size_t t : usda_parts(mesh)) parts += (parts.empty() ? "" : "\n") + describe_part(mesh, t);
    const std::string version =
        std::to_string(LDI_VERSION_MAJOR) + "." + std::to_string(LDI_VERSION_MINOR) + "." + std::to_string(LDI_VERSION_PATCH);
    return "#usda 1.0\n(\n    customLayerData = {\n        string creator = \"ldi " + version + "\"\n" + numbers.text() +
           "        string source = " + usda_string(facts.source) +
           "\n    }\n    defaultPrim = \"Photo\"\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\n\n" +
           R"(def Xform "Photo" (
    kind = "component"
)
{
)" + parts +
           "}\n";
}

/// Encodes a mesh and its textures as USDZ. Raises too_large for a file of 4 GB or more.
///
/// textures  JPEG files, one for each part of the mesh
/// facts     as for a GLB file; stored in customLayerData
inline std::vector<std::byte> encode_usdz(const textured_mesh& mesh, std::span<const std::vector<std::byte>> textures,
                                          const glb_options& facts) {
    stored_zip zip;
    const std::string scene = describe_usda(mesh, facts);
    zip.add("photo.usda", std::as_bytes(std::span(scene)));
    for (const std::size_t t : usda_parts(mesh)) zip.add("textures/photo" + usda_suffix(mesh, t) + ".jpg", textures[t]);
    return zip.finish();
}

}  // namespace ldi::examples
