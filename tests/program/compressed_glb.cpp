#include <ldi/formats/glb.hpp>
#include <ldi/io/picture.hpp>
#include <ldi/render/rasterizer.hpp>

#include <webp/decode.h>
#include <catch2/catch.hpp>
#include <examples/photo3d/compressed_glb.hpp>
#include <examples/photo3d/webp_texture.hpp>
#include <tests/program/compressed_glb.hpp>
#include <tests/support/files.hpp>
#include <tests/support/psnr.hpp>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <random>
#include <set>

using namespace ldi;
using namespace ldi::testing;

namespace {

constexpr std::size_t atlas_width = 96, atlas_height = 80;

/// A bumpy sheet whose depth runs from z_near at the right to z_far at the left, one vertex per eighth texel.
textured_mesh make_slope(float z_near, float z_far) {
    textured_mesh mesh;
    std::mt19937 random(5);
    const std::uint32_t columns = atlas_width / 8 + 1, rows = atlas_height / 8 + 1;
    for (std::uint32_t y = 0; y < rows; ++y)
        for (std::uint32_t x = 0; x < columns; ++x) {
            const float u = static_cast<float>(x) / static_cast<float>(columns - 1);
            const float v = static_cast<float>(y) / static_cast<float>(rows - 1);
            const float bump = std::uniform_real_distribution<float>(0.0F, 0.1F)(random);
            const float z = 1.0F / ((1 - 0.9F * u - bump) / z_far + (0.9F * u + bump) / z_near);
            mesh.positions.insert(mesh.positions.end(), {(u - 0.5F) * z, (0.5F - v) * z, -z});
            mesh.texture_coordinates.insert(mesh.texture_coordinates.end(), {u, v});
        }
    for (std::uint32_t y = 0; y + 1 < rows; ++y)
        for (std::uint32_t x = 0; x + 1 < columns; ++x) {
            const std::uint32_t i = y * columns + x;
            mesh.triangles.insert(mesh.triangles.end(), {i, i + columns, i + 1, i + 1, i + columns, i + columns + 1});
        }
    return mesh;
}

image<std::uint8_t> make_atlas() {
    image<std::uint8_t> atlas = smooth_picture(atlas_height, atlas_width, 3);
    for (std::size_t y = 0; y < atlas_height; ++y)
        for (std::size_t x = 0; x < atlas_width; ++x)
            for (std::size_t k = 0; k < 3 && (x / 4 + y / 4) % 2 == 0; ++k)
                atlas(y, x, k) = static_cast<std::uint8_t>(atlas(y, x, k) / 2);
    return atlas;
}

byte_string plain_glb(const textured_mesh& mesh) {
    glb_options options;
    options.camera = pinhole_camera{768, 1024, 1000};
    options.motion = 0.08F;
    options.range = {1.5F, 20.0F};
    const buffer<std::byte> file = encode_glb(mesh, encode_jpeg(make_atlas(), 85), options);
    return {file.begin(), file.end()};
}

/// Adds a second primitive: translucent triangles that use the first one's vertices, in a random order.
byte_string with_strip(const byte_string& file, std::vector<std::uint16_t>& triangles) {
    examples::glb_reader parts(file);
    nlohmann::json& json = parts.content;
    examples::glb_packer packer;
    for (std::size_t i = 0; i < 4; ++i) packer.add(parts.view(i));
    const std::size_t count = json["accessors"][0]["count"];
    std::vector<std::uint8_t> colors(4 * count, 255);
    std::mt19937 random(2);
    for (std::size_t i = 3; i < colors.size(); i += 4) colors[i] = static_cast<std::uint8_t>(random() % 256);
    triangles.resize(300);
    for (std::uint16_t& i : triangles) i = static_cast<std::uint16_t>(random() % count);
    std::vector<std::byte> coordinates(parts.view(1).begin(), parts.view(1).end());
    coordinates[0] = std::byte{1};  // between texels
    packer.add(parts.view(0)), packer.add(coordinates);
    packer.add(std::as_bytes(std::span(colors))), packer.add(std::as_bytes(std::span(triangles)));
    for (std::size_t i = 0; i < 2; ++i) {
        json["accessors"].push_back(nlohmann::json(json["accessors"][i]));
        json["accessors"].back()["bufferView"] = 4 + i;
    }
    json["accessors"].push_back(
        {{"bufferView", 6}, {"componentType", 5121}, {"count", count}, {"normalized", true}, {"type", "VEC4"}});
    json["accessors"].push_back({{"bufferView", 7}, {"componentType", 5123}, {"count", 300}, {"type", "SCALAR"}});
    json["materials"].push_back(nlohmann::json(json["materials"][0]));
    json["materials"][1]["alphaMode"] = "BLEND";
    json["meshes"][0]["primitives"].push_back(
        {{"attributes", {{"POSITION", 3}, {"TEXCOORD_0", 4}, {"COLOR_0", 5}}}, {"indices", 6}, {"material", 1}, {"mode", 4}});
    json["bufferViews"] = packer.views, json["buffers"] = {{{"byteLength", packer.binary.size()}}};
    return examples::put_together(json, packer.binary);
}

using point = std::array<float, 5>;

/// Positions and texture coordinates of all corners of all triangles, starting at each triangle's first corner in the texture.
std::vector<std::array<point, 3>> corners(const textured_mesh& mesh) {
    std::vector<std::array<point, 3>> result;
    for (std::size_t i = 0; i < mesh.triangles.size(); i += 3) {
        std::array<point, 3> triangle;
        for (std::size_t k = 0; k < 3; ++k) {
            const std::size_t v = mesh.triangles[i + k];
            const float *t = &mesh.texture_coordinates[2 * v], *p = &mesh.positions[3 * v];
            triangle[k] = {std::round(t[0] * 960), std::round(t[1] * 800), p[0], p[1], p[2]};
        }
        std::rotate(triangle.begin(), std::min_element(triangle.begin(), triangle.end()), triangle.end());
        result.push_back(triangle);
    }
    return result;
}

/// Checks that the triangles are the same except for their order, and that no corner moved by more than `precision`.
void check_same(textured_mesh found, const textured_mesh& expected, float precision) {
    std::vector<std::array<point, 3>> a = corners(found), b = corners(expected);
    std::sort(a.begin(), a.end()), std::sort(b.begin(), b.end());
    REQUIRE(a.size() == b.size());
    for (std::size_t i = 0; i < a.size(); ++i)
        for (std::size_t k = 0; k < 3; ++k) {
            REQUIRE((a[i][k][0] == b[i][k][0] && a[i][k][1] == b[i][k][1]));
            REQUIRE(examples::seen_apart(&a[i][k][2], &b[i][k][2]) <= precision);
            REQUIRE(a[i][k][4] == Approx(b[i][k][4]).epsilon(0.001));
        }
}

using words = std::set<std::string>;

}  // namespace

TEST_CASE("a compressed GLB file contains the same triangles, within the requested precision") {
    for (const float precision : {1e-3F, 5e-5F}) {
        const textured_mesh mesh = make_slope(1, 3);
        const byte_string plain = plain_glb(mesh);
        const byte_string file = examples::compress_glb(plain, {.precision = precision, .webp = {}});
        const viewed_glb seen(file);
        check_same(seen.mesh(), mesh, 1.01F * precision);
        CHECK(seen.json["extensionsRequired"].get<words>() ==
              words{"EXT_meshopt_compression", "KHR_mesh_quantization", "KHR_texture_transform"});
        CHECK(seen.json["scenes"] == viewed_glb(plain).json["scenes"]);
        CHECK(seen.json["scenes"][0]["extras"]["motion"] == 0.08);
        CHECK(seen.json["cameras"] == viewed_glb(plain).json["cameras"]);
        CHECK(seen.json["asset"] == viewed_glb(plain).json["asset"]);
        CHECK(seen.view(seen.json["images"][0]["bufferView"]) == encode_jpeg(make_atlas(), 85));
    }
}

TEST_CASE("if a scene is too deep for an integer grid, positions are stored as floats of reduced precision") {
    const textured_mesh mesh = make_slope(0.3F, 900);
    const byte_string file = examples::compress_glb(plain_glb(mesh));
    const viewed_glb seen(file);
    check_same(seen.mesh(), mesh, 5.1e-5F);
    CHECK(seen.json["nodes"][0].count("scale") == 0);
    CHECK(seen.json["accessors"][0]["componentType"] == 5126);
}

TEST_CASE("texture coordinates between texels are preserved") {
    textured_mesh mesh = make_slope(1, 3);
    std::mt19937 random(1);
    for (float& t : mesh.texture_coordinates) t = std::uniform_real_distribution<float>(0, 1)(random);
    const byte_string file = examples::compress_glb(plain_glb(mesh));
    const viewed_glb seen(file);
    CHECK(seen.json["extensionsRequired"].get<words>() == words{"EXT_meshopt_compression", "KHR_mesh_quantization"});
    std::vector<std::pair<float, float>> a, b;
    const textured_mesh kept = seen.mesh();
    const auto all_of = [](const textured_mesh& m) {
        std::vector<float> all;
        for (const std::uint32_t i : m.triangles)
            for (std::size_t k = 0; k < 2; ++k) all.push_back(std::round(65535 * m.texture_coordinates[2 * i + k]));
        std::sort(all.begin(), all.end());
        return all;
    };
    CHECK(all_of(kept) == all_of(mesh));
}

TEST_CASE("a compressed GLB file looks the same from the side") {
    const textured_mesh mesh = make_slope(1, 3);
    const byte_string file = examples::compress_glb(plain_glb(mesh));
    const image<std::uint8_t> atlas = make_atlas();
    view from;
    from.camera = pinhole_camera{200, 200, 190};
    from.position = {0.05F, 0.02F, 0.0F};
    serial_executor here;
    const image<std::uint8_t> picture = rasterize(mesh, atlas, from, raster_options(), here).color;
    CHECK(psnr(rasterize(viewed_glb(file).mesh(), atlas, from, raster_options(), here).color, picture) > 45);
    from.position[0] += 0.01F;  // from another position, the pictures differ
    CHECK(psnr(rasterize(mesh, atlas, from, raster_options(), here).color, picture) < 40);
}

TEST_CASE("translucent triangles keep their order and colors") {
    std::vector<std::uint16_t> triangles;
    const textured_mesh mesh = make_slope(1, 3);
    const byte_string plain = with_strip(plain_glb(mesh), triangles), file = examples::compress_glb(plain);
    const viewed_glb seen(file), before(plain);
    check_same(seen.mesh(0), mesh, 5.1e-5F);
    CHECK(seen.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"].count("extensions") == 1);
    CHECK(seen.json["materials"][1]["pbrMetallicRoughness"]["baseColorTexture"].count("extensions") == 0);
    const std::vector<std::array<point, 3>> found = corners(seen.mesh(1)), expected = corners(before.mesh(1));
    REQUIRE(found.size() == 100);
    for (std::size_t i = 0; i < 100; ++i)
        for (std::size_t k = 0; k < 3; ++k) CHECK((found[i][k][0] == expected[i][k][0] && found[i][k][1] == expected[i][k][1]));
    const auto opacities = [](const viewed_glb& glb) {
        const std::vector<double> colors = glb.values(glb.primitive(1)["attributes"]["COLOR_0"], 4);
        const textured_mesh strip = glb.mesh(1);
        std::map<std::pair<float, float>, double> result;
        for (const std::uint32_t i : strip.triangles)
            result[{std::round(960 * strip.texture_coordinates[2 * i]), std::round(800 * strip.texture_coordinates[2 * i + 1])}] =
                colors[4 * i + 3];
        return result;
    };
    CHECK(opacities(seen) == opacities(before));
}

TEST_CASE("the WebP texture replaces the JPEG texture or accompanies it") {
    image<std::uint8_t> atlas(atlas_height, atlas_width, 3);
    for (std::size_t i = 0; i < atlas.size(); ++i)
        atlas.data()[i] = static_cast<std::uint8_t>(i / 3 % atlas_width + i / 3 / atlas_width + 30 * (i % 3));
    const byte_string webp = examples::encode_webp(atlas, 90), plain = plain_glb(make_slope(1, 3));
    const byte_string file = examples::compress_glb(plain, {.precision = 1e-4F, .webp = {&webp, 1}}),
                      both = examples::compress_glb(plain, {.precision = 1e-4F, .webp = {&webp, 1}, .keeps_texture = true});
    const viewed_glb alone(file), beside(both);
    CHECK(alone.json["extensionsRequired"].get<words>().count("EXT_texture_webp") == 1);
    CHECK(alone.json["textures"][0].count("source") == 0);
    CHECK(beside.json["extensionsRequired"].get<words>().count("EXT_texture_webp") == 0);
    CHECK(beside.json["extensionsUsed"].get<words>().count("EXT_texture_webp") == 1);
    CHECK(beside.json["images"][beside.json["textures"][0]["source"].get<std::size_t>()]["mimeType"] == "image/jpeg");
    for (const viewed_glb* glb : {&alone, &beside}) {
        const nlohmann::json& image_of =
            glb->json["images"][glb->json["textures"][0]["extensions"]["EXT_texture_webp"]["source"].get<std::size_t>()];
        CHECK(image_of["mimeType"] == "image/webp");
        CHECK(glb->view(image_of["bufferView"]) == webp);
    }
    int width = 0, height = 0;
    const std::unique_ptr<std::uint8_t, void (*)(void*)> decoded(
        WebPDecodeRGB(reinterpret_cast<const std::uint8_t*>(webp.data()), webp.size(), &width, &height), WebPFree);
    REQUIRE((width == atlas_width && height == atlas_height));
    image<std::uint8_t> back(atlas_height, atlas_width, 3);
    std::copy_n(decoded.get(), back.size(), back.data());
    CHECK(psnr(back, atlas) > 38);
}

TEST_CASE("with several textures, each texture stays with its part, which has its own coordinate grid") {
    const textured_mesh slope = make_slope(1, 3);
    textured_mesh mesh = slope;
    mesh.parts = {{}, {mesh.vertex_count(), mesh.triangle_count()}};
    mesh.positions.append(slope.positions.begin(), slope.positions.end());
    mesh.texture_coordinates.append(slope.texture_coordinates.begin(), slope.texture_coordinates.end());
    for (const std::uint32_t i : slope.triangles) mesh.triangles.push_back(i + static_cast<std::uint32_t>(slope.vertex_count()));
    const image<std::uint8_t> small = smooth_picture(40, 48, 3);  // one vertex per fourth texel
    const std::vector<byte_string> jpegs{encode_jpeg(make_atlas(), 90), encode_jpeg(small, 90)},
        webps{examples::encode_webp(make_atlas(), 90), examples::encode_webp(small, 90)};
    const buffer<std::byte> encoded = encode_glb(mesh, std::vector<std::span<const std::byte>>(jpegs.begin(), jpegs.end()));
    const byte_string plain(encoded.begin(), encoded.end());
    for (const bool keeps_texture : {false, true}) {
        const byte_string bytes =
            examples::compress_glb(plain, {.precision = 1e-4F, .webp = webps, .keeps_texture = keeps_texture});
        const viewed_glb file(bytes);
        CHECK(file.json["images"].size() == (keeps_texture ? 4 : 2));
        for (std::size_t t = 0; t < 2; ++t) {
            const nlohmann::json& material = file.json["materials"][file.primitive(t)["material"].get<std::size_t>()];
            const nlohmann::json& texture = material["pbrMetallicRoughness"]["baseColorTexture"];
            REQUIRE(texture["index"] == t);
            CHECK(texture["extensions"]["KHR_texture_transform"]["scale"][0].get<double>() ==
                  Approx(t == 0 ? 1.0 / 96 : 1.0 / 48));
            const nlohmann::json& pictures = file.json["textures"][t];
            const auto view_of = [&](const nlohmann::json& picture) {
                return file.view(file.json["images"][picture.get<std::size_t>()]["bufferView"]);
            };
            CHECK(view_of(pictures["extensions"]["EXT_texture_webp"]["source"]) == webps[t]);
            if (keeps_texture) CHECK(view_of(pictures["source"]) == jpegs[t]);
            CHECK(file.mesh(t).vertex_count() == slope.vertex_count());
        }
    }
    CHECK(raised([&] { examples::compress_glb(plain, {.precision = 1e-4F, .webp = std::span(webps).first(1)}); }) ==
          error_code::invalid_data);
}

TEST_CASE("files other than plain GLB files of this library are refused, and damaged ones cause no crash") {
    const byte_string plain = plain_glb(make_slope(1, 3));
    CHECK(raised([&] { examples::compress_glb(bytes_of("GIF89a")); }) == error_code::invalid_data);
    for (const std::size_t length : {0U, 11U, 19U, 100U, 2000U})
        CHECK(raised([&] { examples::compress_glb(std::span(plain).first(length)); }) == error_code::invalid_data);
    const byte_string twice = examples::compress_glb(plain);
    CHECK(raised([&] { examples::compress_glb(twice); }) == error_code::invalid_data);
    nlohmann::json shared = viewed_glb(plain).json;
    shared["meshes"][0]["primitives"].push_back(nlohmann::json(shared["meshes"][0]["primitives"][0]));
    const byte_string sharing =
        examples::put_together(shared, {viewed_glb(plain).binary.begin(), viewed_glb(plain).binary.end()});
    CHECK_THAT(message_of([&] { examples::compress_glb(sharing); }), Catch::Contains("share"));
    std::mt19937 random(4);
    for (int i = 0; i < 300; ++i) {
        byte_string damaged = plain;
        if (i % 2 == 0)
            damaged[20 + random() % 1500] = static_cast<std::byte>("0123456789[]{}\",-"[random() % 17]);
        else
            damaged[random() % damaged.size()] = static_cast<std::byte>(random() % 256);
        try {
            examples::compress_glb(damaged);
        } catch (const error&) {
        }
    }
}

TEST_CASE("the Khronos validator finds no error and no warning in compressed files") {
    const std::filesystem::path validator = std::filesystem::path(LDI_SOURCE_DIR) / "tests/gltf_validator";
    if (!std::filesystem::exists(validator / "node_modules") || std::system("node --version > /dev/null 2>&1") != 0) {
        WARN("skipped: no node, or no `npm ci` in " << validator);
        return;
    }
    const scratch_folder folder;
    std::vector<std::uint16_t> triangles;
    const byte_string webp = examples::encode_webp(make_atlas(), 90), plain = plain_glb(make_slope(1, 3));
    write_file(folder / "webp.glb", examples::compress_glb(plain, {.precision = 1e-4F, .webp = {&webp, 1}}));
    write_file(folder / "both.glb", examples::compress_glb(with_strip(plain, triangles),
                                                           {.precision = 1e-4F, .webp = {&webp, 1}, .keeps_texture = true}));
    write_file(folder / "deep.glb", examples::compress_glb(plain_glb(make_slope(0.3F, 900))));
    std::string command = "node '" + (validator / "validate.mjs").string() + "'";
    for (const char* name : {"webp.glb", "both.glb", "deep.glb"}) command += " '" + (folder / name).string() + "'";
    CHECK(std::system((command + " > /dev/null").c_str()) == 0);
}
