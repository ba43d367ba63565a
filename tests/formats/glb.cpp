#include <ldi/formats/glb.hpp>
#include <ldi/io/file.hpp>
#include <ldi/io/picture.hpp>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <tests/formats/tinygltf_glb.hpp>
#include <tests/support/counted_memory.hpp>
#include <tests/support/files.hpp>

#include <cstdlib>
#include <cstring>
#include <random>

using namespace ldi;
using namespace ldi::testing;

namespace {

/// A wavy sheet of columns x rows vertices in front of the camera.
textured_mesh make_sheet(std::uint32_t columns, std::uint32_t rows) {
    textured_mesh mesh;
    for (std::uint32_t y = 0; y < rows; ++y)
        for (std::uint32_t x = 0; x < columns; ++x) {
            const float u = static_cast<float>(x) / static_cast<float>(columns - 1);
            const float v = static_cast<float>(y) / static_cast<float>(rows - 1);
            mesh.positions.insert(mesh.positions.end(), {u - 0.5F, 0.5F - v, -2.1F - 0.3F * std::sin(9 * u + 4 * v)});
            mesh.texture_coordinates.insert(mesh.texture_coordinates.end(), {u, v});
        }
    for (std::uint32_t y = 0; y + 1 < rows; ++y)
        for (std::uint32_t x = 0; x + 1 < columns; ++x) {
            const std::uint32_t i = y * columns + x;
            mesh.triangles.insert(mesh.triangles.end(), {i, i + columns, i + 1, i + 1, i + columns, i + columns + 1});
        }
    return mesh;
}

/// Adds soft edges: a strip with the given number of triangles along its left border.
textured_mesh make_soft_sheet(std::uint32_t columns, std::uint32_t rows, std::uint32_t triangles) {
    textured_mesh mesh = make_sheet(columns, rows);
    soft_edge_strip& strip = mesh.soft_edges;
    for (std::uint32_t i = 0; i < triangles + 2; ++i) {
        const float y = static_cast<float>(i) / static_cast<float>(triangles + 2);
        strip.positions.insert(strip.positions.end(), {i % 2 == 0 ? -0.5F : -0.51F, 0.5F - y, -2.0F - y});
        strip.texture_coordinates.insert(strip.texture_coordinates.end(), {0.5F, y});
        strip.opacity.push_back(static_cast<std::uint8_t>(i % 2 == 0 ? 128 : 0));
        if (i < triangles) strip.triangles.insert(strip.triangles.end(), {i, i + 1 + i % 2, i + 2 - i % 2});
    }
    return mesh;
}

pinhole_camera some_camera() {
    pinhole_camera camera;
    camera.width = 768, camera.height = 1024, camera.focal_length = 1000;
    return camera;
}

tinygltf::Model read_back(std::span<const std::byte> file) {
    tinygltf::TinyGLTF reader;
    reader.SetImageLoader(
        [](tinygltf::Image*, const int, std::string*, std::string*, int, int, const unsigned char*, int, void*) { return true; },
        nullptr);
    tinygltf::Model model;
    std::string failure, warning;
    const bool good = reader.LoadBinaryFromMemory(&model, &failure, &warning, reinterpret_cast<const unsigned char*>(file.data()),
                                                  static_cast<unsigned>(file.size()));
    CHECK(failure == "");
    CHECK(warning == "");
    REQUIRE(good);
    return model;
}

std::vector<std::byte> view_bytes(const tinygltf::Model& model, int view) {
    const tinygltf::BufferView& v = model.bufferViews.at(static_cast<std::size_t>(view));
    const unsigned char* const first = model.buffers.at(0).data.data() + v.byteOffset;
    const std::byte* const bytes = reinterpret_cast<const std::byte*>(first);
    return std::vector<std::byte>(bytes, bytes + v.byteLength);
}

template <class Scalar>
buffer<Scalar> accessor_values(const tinygltf::Model& model, int accessor) {
    const std::vector<std::byte> bytes = view_bytes(model, model.accessors.at(static_cast<std::size_t>(accessor)).bufferView);
    buffer<Scalar> values(bytes.size() / sizeof(Scalar));
    std::memcpy(values.data(), bytes.data(), values.size() * sizeof(Scalar));
    return values;
}

struct glb_chunks {
    nlohmann::json json;  // numbers compare by value, because different decimals can represent one number
    std::string binary;
};

glb_chunks chunks_of(const std::string& file) {
    const auto number = [&](std::size_t at) {
        std::uint32_t value = 0;
        std::memcpy(&value, file.data() + at, sizeof value);
        return value;
    };
    REQUIRE(file.size() >= 28);
    CHECK(number(0) == 0x46546C67);
    CHECK(number(4) == 2);
    CHECK(number(8) == file.size());
    const std::size_t length = number(12);
    REQUIRE(20 + length + 8 <= file.size());
    CHECK(length % 4 == 0);
    CHECK(number(16) == 0x4E4F534A);
    CHECK(number(20 + length + 4) == 0x004E4942);
    return {nlohmann::json::parse(file.substr(20, length)), file.substr(20 + length)};
}

}  // namespace

TEST_CASE("a GLB file contains the mesh, the unchanged texture file, and the camera") {
    const textured_mesh mesh = make_sheet(7, 5);
    const byte_string texture = encode_jpeg(smooth_picture(16, 32, 3), 85);
    const buffer<std::byte> file = encode_glb(mesh, texture, {.camera = some_camera()});
    const tinygltf::Model model = read_back(file);

    const tinygltf::Primitive& primitive = model.meshes.at(0).primitives.at(0);
    CHECK(accessor_values<float>(model, primitive.attributes.at("POSITION")) == mesh.positions);
    const buffer<std::uint16_t> indices = accessor_values<std::uint16_t>(model, primitive.indices);
    CHECK(buffer<std::uint32_t>(indices.begin(), indices.end()) == mesh.triangles);
    const buffer<std::uint16_t> uv = accessor_values<std::uint16_t>(model, primitive.attributes.at("TEXCOORD_0"));
    REQUIRE(uv.size() == mesh.texture_coordinates.size());
    for (std::size_t i = 0; i < uv.size(); ++i)
        CHECK(std::abs(static_cast<double>(uv[i]) / 65535 - static_cast<double>(mesh.texture_coordinates[i])) <= 0.503 / 65535);
    CHECK(view_bytes(model, model.images.at(0).bufferView) == texture);
    CHECK(model.images.at(0).uri == "");
    CHECK(model.materials.at(0).extensions.count("KHR_materials_unlit") == 1);
    CHECK(model.extensionsUsed == std::vector<std::string>{"KHR_materials_unlit"});
    CHECK(model.extensionsRequired.empty());

    const tinygltf::PerspectiveCamera& camera = model.cameras.at(0).perspective;
    CHECK(std::tan(camera.yfov / 2) == Approx(512.0 / 1000));
    CHECK(camera.aspectRatio == Approx(0.75));
    CHECK(camera.znear > 0);
    CHECK(camera.znear < 1.8);
    CHECK(camera.zfar > 2.4);
    CHECK(model.asset.generator.substr(0, 4) == "ldi ");
    CHECK(read_back(encode_glb(mesh, texture)).cameras.empty());
}

TEST_CASE("a GLB file is less than 1800 bytes larger than its vertices, triangles and texture") {
    const textured_mesh mesh = make_sheet(100, 80);
    const byte_string texture = encode_jpeg(smooth_picture(16, 32, 3), 85);
    const std::size_t content = mesh.vertex_count() * (12 + 4) + mesh.triangles.size() * 2 + texture.size();
    CHECK(encode_glb(mesh, texture).size() < content + 1800);
}

TEST_CASE("indices have 16 bits for up to 65,535 vertices and 32 bits for more") {
    const byte_string texture = encode_jpeg(smooth_picture(8, 8, 3), 85);
    for (std::uint32_t rows : {255u, 256u}) {
        textured_mesh mesh = make_sheet(257, rows);  // 65,535 and 65,792 vertices
        const tinygltf::Model model = read_back(encode_glb(mesh, texture));
        const int indices = model.meshes.at(0).primitives.at(0).indices;
        if (rows == 255) {
            CHECK(model.accessors.at(static_cast<std::size_t>(indices)).componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT);
            const buffer<std::uint16_t> values = accessor_values<std::uint16_t>(model, indices);
            CHECK(std::equal(values.begin(), values.end(), mesh.triangles.begin(), mesh.triangles.end()));
        } else {
            CHECK(model.accessors.at(static_cast<std::size_t>(indices)).componentType == TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT);
            CHECK(accessor_values<std::uint32_t>(model, indices) == mesh.triangles);
        }
    }
}

TEST_CASE("soft edges are a second, blended primitive with white vertices whose alpha is the opacity") {
    const byte_string texture = encode_jpeg(smooth_picture(16, 32, 3), 85);
    for (const std::uint32_t rows : {2U, 3U}) {
        const textured_mesh mesh = make_soft_sheet(2, rows, 7);
        const tinygltf::Model model = read_back(encode_glb(mesh, texture));
        REQUIRE(model.meshes.at(0).primitives.size() == 2);
        const tinygltf::Primitive &opaque = model.meshes[0].primitives[0], &soft = model.meshes[0].primitives[1];
        CHECK(accessor_values<float>(model, opaque.attributes.at("POSITION")) == mesh.positions);
        CHECK(opaque.attributes.count("COLOR_0") == 0);
        CHECK(accessor_values<float>(model, soft.attributes.at("POSITION")) == mesh.soft_edges.positions);
        const buffer<std::uint8_t> colors = accessor_values<std::uint8_t>(model, soft.attributes.at("COLOR_0"));
        REQUIRE(colors.size() == 4 * mesh.soft_edges.vertex_count());
        for (std::size_t i = 0; i < colors.size(); ++i) CHECK(colors[i] == (i % 4 < 3 ? 255 : mesh.soft_edges.opacity[i / 4]));
        const buffer<std::uint16_t> indices = accessor_values<std::uint16_t>(model, soft.indices);
        CHECK(buffer<std::uint32_t>(indices.begin(), indices.end()) == mesh.soft_edges.triangles);
        CHECK(model.materials.at(static_cast<std::size_t>(opaque.material)).alphaMode == "OPAQUE");
        CHECK(model.materials.at(static_cast<std::size_t>(soft.material)).alphaMode == "BLEND");
        CHECK(view_bytes(model, model.images.at(0).bufferView) == texture);
    }
}

TEST_CASE("a mesh with several textures has one primitive with separate vertices per texture in use") {
    const byte_string first = encode_jpeg(smooth_picture(16, 32, 3), 85), second = encode_jpeg(smooth_picture(8, 8, 3), 85),
                      third = encode_jpeg(smooth_picture(24, 8, 3), 85);
    const std::vector<std::span<const std::byte>> textures{first, second, third};
    for (const bool has_first : {false, true}) {
        // The first texture has the strip and, if has_first, also 3 x 2 vertices. The second has no vertices, the third 7 x 5.
        textured_mesh mesh = make_soft_sheet(3, 2, 3);
        const textured_mesh strip = mesh, sheet = make_sheet(7, 5);
        if (!has_first) mesh.positions.clear(), mesh.texture_coordinates.clear(), mesh.triangles.clear();
        const mesh_part end{mesh.vertex_count(), mesh.triangle_count()};
        mesh.parts = {{}, end, end};
        mesh.positions.append(sheet.positions.begin(), sheet.positions.end());
        mesh.texture_coordinates.append(sheet.texture_coordinates.begin(), sheet.texture_coordinates.end());
        for (const std::uint32_t i : sheet.triangles) mesh.triangles.push_back(i + static_cast<std::uint32_t>(end.first_vertex));

        const tinygltf::Model model = read_back(encode_glb(mesh, textures, {.camera = some_camera()}));
        const std::vector<tinygltf::Primitive>& primitives = model.meshes.at(0).primitives;
        REQUIRE(primitives.size() == (has_first ? 3 : 2));
        const auto check_part = [&](const tinygltf::Primitive& part, const textured_mesh& expected, const byte_string& texture) {
            CHECK(accessor_values<float>(model, part.attributes.at("POSITION")) == expected.positions);
            const buffer<std::uint16_t> indices = accessor_values<std::uint16_t>(model, part.indices);
            CHECK(buffer<std::uint32_t>(indices.begin(), indices.end()) == expected.triangles);
            const tinygltf::Material& material = model.materials.at(static_cast<std::size_t>(part.material));
            CHECK(material.alphaMode == "OPAQUE");
            const int number = material.pbrMetallicRoughness.baseColorTexture.index;
            const int picture = model.textures.at(static_cast<std::size_t>(number)).source;
            CHECK(view_bytes(model, model.images.at(static_cast<std::size_t>(picture)).bufferView) == texture);
        };
        if (has_first) check_part(primitives[0], strip, first);
        check_part(primitives[has_first ? 1 : 0], sheet, third);
        const tinygltf::Primitive& soft = primitives.back();
        CHECK(accessor_values<float>(model, soft.attributes.at("POSITION")) == mesh.soft_edges.positions);
        CHECK(model.materials.at(static_cast<std::size_t>(soft.material)).alphaMode == "BLEND");
        CHECK(model.images.size() == 2);  // no triangle uses the second texture
        CHECK(model.materials.size() == primitives.size());
    }
}

TEST_CASE("the caller's vertex attributes are written to the primitive of every texture") {
    const byte_string texture = encode_jpeg(smooth_picture(8, 8, 3), 85);
    const std::vector<std::span<const std::byte>> two{texture, texture};
    textured_mesh mesh = make_soft_sheet(4, 4, 3);
    const mesh_part end{mesh.vertex_count(), mesh.triangle_count()};
    const textured_mesh more = make_sheet(3, 5);
    mesh.parts = {{}, end};
    mesh.positions.append(more.positions.begin(), more.positions.end());
    mesh.texture_coordinates.append(more.texture_coordinates.begin(), more.texture_coordinates.end());
    for (const std::uint32_t i : more.triangles) mesh.triangles.push_back(i + static_cast<std::uint32_t>(end.first_vertex));
    glb_options options{.camera = some_camera()};
    options.attributes = {{"_LABEL", 1, {}}, {"_NORMAL_2", 3, {}}};
    for (vertex_attribute& a : options.attributes)
        for (std::size_t i = 0; i < mesh.vertex_count() * a.channels; ++i) a.values.push_back(static_cast<float>(i) - 7.5F);
    const tinygltf::Model model = read_back(encode_glb(mesh, two, options));
    const std::vector<tinygltf::Primitive>& primitives = model.meshes.at(0).primitives;
    REQUIRE(primitives.size() == 3);
    for (const vertex_attribute& a : options.attributes) {
        const auto first = accessor_values<float>(model, primitives[0].attributes.at(a.name));
        const auto second = accessor_values<float>(model, primitives[1].attributes.at(a.name));
        CHECK(first == buffer<float>(a.values.begin(), a.values.begin() + end.first_vertex * a.channels));
        CHECK(second == buffer<float>(a.values.begin() + end.first_vertex * a.channels, a.values.end()));
        CHECK(primitives[2].attributes.count(a.name) == 0);
    }
    CHECK(accessor_values<float>(model, primitives[1].attributes.at("POSITION")) == more.positions);
    const buffer<std::uint16_t> indices = accessor_values<std::uint16_t>(model, primitives[1].indices);
    CHECK(buffer<std::uint32_t>(indices.begin(), indices.end()) == more.triangles);
}

TEST_CASE("vertex attributes that glTF does not allow, or that do not match the mesh, are refused") {
    const byte_string texture = encode_jpeg(smooth_picture(8, 8, 3), 85);
    const textured_mesh mesh = make_sheet(2, 2);
    const auto result_of = [&](const buffer<vertex_attribute>& attributes) {
        glb_options options;
        options.attributes = attributes;
        return raised([&] { encode_glb(mesh, texture, options); });
    };
    const buffer<float> four(4, 1.0F);
    for (const char* name : {"", "_", "LABEL", "_label", "_A\"B", "POSITION"})
        CHECK(result_of({{name, 1, four}}) == error_code::invalid_option);
    glb_options hostile;
    hostile.attributes = {{"_A\x1B[2J", 1, four}};
    CHECK_THAT(message_of([&] { encode_glb(mesh, texture, hostile); }), !Catch::Contains("\x1B"));
    CHECK(result_of({{"_A", 1, four}, {"_A", 1, four}}) == error_code::invalid_option);
    CHECK(result_of({{"_A", 0, {}}}) == error_code::invalid_option);
    CHECK(result_of({{"_A", 5, buffer<float>(20)}}) == error_code::invalid_option);
    CHECK(result_of({{"_A", 2, four}}) == error_code::invalid_option);
    CHECK(result_of({{"_A", 1, buffer<float>(4, std::nanf(""))}}) == error_code::invalid_option);
}

TEST_CASE("parts that do not match the textures, and triangles that connect two parts, are refused") {
    const byte_string texture = encode_jpeg(smooth_picture(8, 8, 3), 85);
    const std::vector<std::span<const std::byte>> two{texture, texture};
    textured_mesh mesh = make_sheet(4, 4);
    CHECK(raised([&] { encode_glb(mesh, two); }) == error_code::mismatch);
    mesh.parts = {{}, {8, 6}};
    CHECK(raised([&] { encode_glb(mesh, texture); }) == error_code::mismatch);
    // the second row of squares has vertices of both parts
    CHECK(raised([&] { encode_glb(mesh, two); }) == error_code::invalid_data);
    mesh.parts = {{}, {17, 18}};
    CHECK(raised([&] { encode_glb(mesh, two); }) == error_code::invalid_data);
    mesh.parts = {{1, 0}, {16, 18}};
    CHECK(raised([&] { encode_glb(mesh, two); }) == error_code::invalid_data);
    mesh.parts = {{}, {16, 18}};
    CHECK(read_back(encode_glb(mesh, two)).images.size() == 1);
}

TEST_CASE("invalid meshes and damaged or unsupported textures are refused") {
    const byte_string texture = encode_jpeg(smooth_picture(8, 8, 3), 85);
    const auto refused = [&](const textured_mesh& mesh, const byte_string& jpeg, const std::string& words) {
        CHECK(raised([&] { encode_glb(mesh, jpeg); }) == error_code::invalid_data);
        CHECK_THAT(message_of([&] { encode_glb(mesh, jpeg); }), Catch::Contains(words));
    };
    refused({}, texture, "triangles");
    textured_mesh mesh = make_sheet(3, 3);
    mesh.positions[4] = std::numeric_limits<float>::quiet_NaN();
    refused(mesh, texture, "finite");
    mesh = make_sheet(3, 3);
    mesh.texture_coordinates[5] = 1.01F;
    refused(mesh, texture, "[0, 1]");
    mesh = make_sheet(3, 3);
    mesh.triangles[2] = 9;
    refused(mesh, texture, "vertex indices below 9, found vertex 9");
    mesh = make_sheet(3, 3);
    refused(mesh, bytes_of("GIF89a"), "a GIF file");
    refused(mesh, byte_string(texture.begin(), texture.end() - 2), "cut off");
    const byte_string png = encode_png(smooth_picture(8, 8, 3));
    refused(mesh, byte_string(png.begin(), png.end() - 2), "cut off");
}

TEST_CASE("an invalid camera, motion or depth range, and a source name that is not UTF-8, are refused") {
    const byte_string texture = encode_jpeg(smooth_picture(8, 8, 3), 85);
    const textured_mesh mesh = make_sheet(3, 3);
    const auto result_of = [&](const glb_options& options) { return raised([&] { encode_glb(mesh, texture, options); }); };
    const float infinite = std::numeric_limits<float>::infinity(), nan = std::nanf("");

    for (const pinhole_camera& camera : {pinhole_camera{},
                                         {0, 9, 9.0F},
                                         {9, 0, 9.0F},
                                         {-9, 9, 9.0F},
                                         {9, -9, 9.0F},
                                         {9, 9, 0.0F},
                                         {9, 9, -9.0F},
                                         {9, 9, nan},
                                         {9, 9, infinite},
                                         {1, 1, std::numeric_limits<float>::max()}}) {
        CAPTURE(camera.width, camera.height, camera.focal_length);
        CHECK(result_of({.camera = camera}) == error_code::invalid_option);
    }
    for (const float motion : {-0.1F, nan, infinite})
        CHECK(result_of({.camera = {}, .motion = motion}) == error_code::invalid_option);
    CHECK_FALSE(result_of({.camera = {}, .motion = 0.0F}));
    for (const depth_range& range :
         {depth_range{0.0F, 1.0F}, {-1.0F, 1.0F}, {2.0F, 1.0F}, {nan, 1.0F}, {1.0F, nan}, {1.0F, infinite}}) {
        CAPTURE(range.z_near, range.z_far);
        CHECK(result_of({.camera = {}, .motion = 0.1F, .range = range}) == error_code::invalid_option);
        CHECK_FALSE(result_of({.camera = {}, .range = range}));  // without motion, the range is unused
    }
    CHECK_FALSE(result_of({.camera = {}, .motion = 0.1F, .range = {1.0F, 1.0F}}));
    for (const char* source : {"\xFF", "a\xC3", "\xC0\xAF.jpg", "\xED\xA0\x80", "\xF4\x90\x80\x80",
                               "B\xE9"
                               "b\xE9"})
        CHECK(result_of({.camera = {}, .source = source}) == error_code::invalid_option);
    CHECK_FALSE(result_of({.camera = {}, .source = "\xED\x9F\xBF \xF4\x8F\xBF\xBF"}));
}

TEST_CASE("an RGBA picture and a picture without pixels are refused as textures") {
    const textured_mesh mesh = make_sheet(3, 3);
    CHECK(raised([&] { encode_glb(mesh, smooth_picture(8, 8, 4)); }) == error_code::mismatch);
    CHECK(raised([&] { encode_glb(mesh, image<std::uint8_t>()); }) == error_code::mismatch);
}

TEST_CASE("a GLB file states the motion and the depth range in its extras") {
    const textured_mesh mesh = make_sheet(7, 5);
    const byte_string texture = encode_jpeg(smooth_picture(16, 32, 3), 85);
    glb_options options;
    options.motion = 0.08F;
    options.range = {1.5F, 20.0F};
    const tinygltf::Model model = read_back(encode_glb(mesh, texture, options));
    CHECK(model.scenes.at(0).extras.Get("motion").GetNumberAsDouble() == 0.08);
    CHECK(model.scenes.at(0).extras.Get("nearest").GetNumberAsDouble() == 1.5);
    CHECK(model.scenes.at(0).extras.Get("farthest").GetNumberAsDouble() == 20.0);
    CHECK(model.scenes.at(0).extras.Size() == 3);
    options.range.z_near = 4e-7F;  // would be 0 with six decimal places
    const tinygltf::Model near = read_back(encode_glb(mesh, texture, options));
    CHECK(static_cast<float>(near.scenes.at(0).extras.Get("nearest").GetNumberAsDouble()) == 4e-7F);
    CHECK(read_back(encode_glb(mesh, texture)).scenes.at(0).extras.Type() == tinygltf::NULL_TYPE);
}

TEST_CASE("a GLB file states the name of its photo and the focal length in its extras") {
    glb_options options;
    options.source = "a \"photo\" \\ of\nB\u00E9b\u00E9.jpg";
    options.motion = 0.08F;
    options.camera = some_camera();
    const tinygltf::Model model = read_back(encode_glb(make_sheet(3, 3), encode_jpeg(smooth_picture(8, 8, 3), 85), options));
    const tinygltf::Value& extras = model.scenes.at(0).extras;
    CHECK(extras.Get("source").Get<std::string>() == options.source);
    const double diagonal = std::hypot(some_camera().width, some_camera().height);
    CHECK(extras.Get("focal_length_35mm").GetNumberAsDouble() == Approx(1000 * std::hypot(36, 24) / diagonal));
}

TEST_CASE("a GLB file has the same JSON values and binary data as a file that tinygltf writes for the same mesh") {
    std::mt19937 random(3);
    const auto between = [&](float low, float high) { return std::uniform_real_distribution<float>(low, high)(random); };
    const byte_string jpeg = encode_jpeg(smooth_picture(16, 32, 3), 85), png = encode_png(smooth_picture(5, 7, 1));
    const auto same = [&](const textured_mesh& mesh, const byte_string& texture, const glb_options& options) {
        const buffer<std::byte> file = encode_glb(mesh, texture, options);
        const glb_chunks ours = chunks_of(std::string(reinterpret_cast<const char*>(file.data()), file.size())),
                         theirs = chunks_of(tinygltf_glb(mesh, texture, options));
        REQUIRE(ours.json == theirs.json);
        REQUIRE(ours.binary == theirs.binary);
    };
    for (int i = 0; i < 300; ++i) {
        const auto lines = [&] { return static_cast<std::uint32_t>(2 + random() % 5); };
        textured_mesh mesh = make_sheet(lines(), lines());
        const float scale = std::pow(10.0F, between(-9, 9));
        for (float& p : mesh.positions) p = i % 5 == 0 ? std::round(4 * between(-2, 2)) / 4 : p + scale * between(-1, 1);
        glb_options options;
        options.double_sided = i % 2 == 0;
        if (i % 3 != 0) {
            const auto length = [&] { return static_cast<std::int32_t>(1 + random() % 5000); };
            options.camera = pinhole_camera{length(), length(), between(1, 5000)};
        }
        same(mesh, i % 4 == 0 ? png : jpeg, options);
    }
    same(make_sheet(257, 256), jpeg, {.camera = some_camera()});
}

TEST_CASE("encode_glb() allocates its result from the current memory, and releases everything if memory runs out") {
    const image<std::uint8_t> atlas = smooth_picture(40, 30, 3);
    const textured_mesh mesh = make_sheet(4, 4);
    ldi::testing::counted_memory own;
    {
        const memory_scope scope(own.source);
        const buffer<std::byte> file = encode_glb(mesh, atlas);
        CHECK(own.blocks == 1);
        CHECK(own.bytes == file.capacity());
    }
    for (std::size_t calls = own.calls; calls-- > 0;) {
        own.calls = 0, own.most = calls;
        const memory_scope scope(own.source);
        CHECK_THROWS_AS(encode_glb(mesh, atlas), std::bad_alloc);
        CHECK(own.blocks == 0);
    }
}

TEST_CASE("a texture given as pixels is stored as a PNG file") {
    const image<std::uint8_t> atlas = smooth_picture(40, 30, 3);
    const textured_mesh mesh = make_sheet(4, 4);
    const tinygltf::Model model = read_back(encode_glb(mesh, atlas, {.camera = some_camera()}));
    CHECK(model.images.at(0).mimeType == "image/png");
    const buffer<std::byte> png = encode_plain_png(atlas);
    CHECK(view_bytes(model, model.images.at(0).bufferView) == byte_string(png.begin(), png.end()));
}

TEST_CASE("the Khronos validator finds neither errors nor warnings in GLB files, and detects a broken one") {
    const std::filesystem::path validator = std::filesystem::path(LDI_SOURCE_DIR) / "tests/gltf_validator";
    if (!std::filesystem::exists(validator / "node_modules") || std::system("node --version > /dev/null 2>&1") != 0) {
        WARN("skipped: no node, or no `npm ci` in " << validator);
        return;
    }
    const scratch_folder folder;
    const byte_string texture = encode_jpeg(smooth_picture(48, 80, 3), 85);
    std::string paths;
    const auto add = [&](const std::string& name, const textured_mesh& mesh, const byte_string& jpeg,
                         const glb_options& options) {
        write_file(folder / name, encode_glb(mesh, jpeg, options));
        paths += " '" + (folder / name).string() + "'";
    };
    add("camera.glb", make_sheet(20, 30), texture, {.camera = some_camera()});
    add("single_sided.glb", make_sheet(21, 31), texture, {.camera = std::nullopt, .double_sided = false});
    const buffer<std::byte> png = encode_plain_png(smooth_picture(33, 31, 3));
    add("png.glb", make_sheet(9, 8), byte_string(png.begin(), png.end()), {.camera = some_camera()});
    add("one_triangle.glb", {{0, 0, -1, 0, -1, -1, 1, 0, -1.1F}, {0, 0, 0, 1, 1, 0}, {}, {0, 1, 2}}, texture, {});
    add("soft.glb", make_soft_sheet(20, 30, 9), texture, {.camera = some_camera()});
    add("many.glb", make_sheet(300, 300), encode_jpeg(smooth_picture(16, 16, 3), 100), {.camera = some_camera()});
    textured_mesh parts = make_soft_sheet(4, 4, 5);
    const textured_mesh more = make_sheet(3, 3);
    parts.parts = {{}, {parts.vertex_count(), parts.triangle_count()}};
    parts.positions.append(more.positions.begin(), more.positions.end());
    parts.texture_coordinates.append(more.texture_coordinates.begin(), more.texture_coordinates.end());
    for (const std::uint32_t i : more.triangles) parts.triangles.push_back(i + 16);
    write_file(folder / "parts.glb", encode_glb(parts, std::vector<std::span<const std::byte>>{texture, texture}));
    paths += " '" + (folder / "parts.glb").string() + "'";
    glb_options with_attributes{.camera = some_camera()};
    with_attributes.attributes = {{"_LABEL", 1, buffer<float>(72, 2.5F)}, {"_DIRECTION", 3, buffer<float>(3 * 72, -1.0F)}};
    add("attributes.glb", make_sheet(9, 8), texture, with_attributes);
    const std::string validate = "node '" + (validator / "validate.mjs").string() + "'";
    CHECK(std::system((validate + paths + " > /dev/null").c_str()) == 0);

    byte_string broken = read_file(folder / "camera.glb");
    const byte_string count = bytes_of("\"count\":600");
    const auto at = std::search(broken.begin(), broken.end(), count.begin(), count.end());
    REQUIRE(at != broken.end());
    *(at + 8) = std::byte{'5'};
    write_file(folder / "broken.glb", broken);
    CHECK(std::system((validate + " '" + (folder / "broken.glb").string() + "' > /dev/null").c_str()) != 0);
}
