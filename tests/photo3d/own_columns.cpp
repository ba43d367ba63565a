// The user's own columns pass through every stage, and the user's memory is used without conversion.
#include "tests/support/lifted_scene.hpp"

#include <ldi/io/depth_map.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/ldi.hpp>

#include <catch2/catch.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <random>
#include <string_view>
#include <vector>

using namespace ldi;

namespace {

struct normal_column {
    using scalar = float;
    static constexpr std::size_t channels = 3;
};

struct material_column {
    using scalar = std::uint16_t;
    static constexpr std::size_t channels = 1;
};

using two_columns = photo_columns<normal_column, material_column>;
static_assert(std::is_constructible_v<two_columns, const image<float>&, image_view<const std::uint16_t>>);
static_assert(!std::is_constructible_v<two_columns, const image<float>&, image<std::uint16_t>>, "the view would dangle");
static_assert(!std::is_constructible_v<two_columns, const image<float>&, const image<std::uint16_t>>);
struct derived_image : image<std::uint16_t> {};
struct owner {
    image<std::uint16_t> values;
    operator image_view<const std::uint16_t>() const { return values; }
};
static_assert(std::is_constructible_v<two_columns, const image<float>&, const derived_image&>);
static_assert(!std::is_constructible_v<two_columns, const image<float>&, derived_image>);
static_assert(std::is_constructible_v<two_columns, image<float>&, const owner&>);
static_assert(!std::is_constructible_v<two_columns, image<float>&, owner>);
static_assert(!std::is_constructible_v<two_columns, const image<float>&>);
static_assert(!std::is_constructible_v<two_columns, const image<std::uint16_t>&, const image<float>&>);

/// Returns a value that depends on the position in the photo, so that tests can check it wherever it occurs.
std::uint16_t material_at(std::int32_t x, std::int32_t y) { return static_cast<std::uint16_t>(7 * x + 1000 * y); }

/// A normal per pixel that depends on the position in the photo.
image<float> normals_of(std::size_t rows, std::size_t columns) {
    image<float> normals(rows, columns, 3);
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x)
            normals(y, x, 0) = static_cast<float>(x), normals(y, x, 1) = static_cast<float>(y), normals(y, x, 2) = 1.0F;
    return normals;
}

/// The position of each vertex and its normal, sorted.
std::vector<std::array<float, 6>> sorted_vertices(const textured_mesh& mesh, const buffer<float>& normals) {
    std::vector<std::array<float, 6>> vertices(mesh.vertex_count());
    for (std::size_t v = 0; v < vertices.size(); ++v) {
        std::copy_n(mesh.positions.data() + 3 * v, 3, vertices[v].data());
        std::copy_n(normals.data() + 3 * v, 3, vertices[v].data() + 3);
    }
    std::sort(vertices.begin(), vertices.end());
    return vertices;
}

/// Overlapping discs at different depths. Their hidden surfaces end at each other, with hems.
image<float> random_discs(std::mt19937& random, std::size_t rows, std::size_t columns) {
    image<float> map(rows, columns, 1, 0.1F);
    for (int disc = 0; disc < 7; ++disc) {
        const float x0 = static_cast<float>(random() % columns), y0 = static_cast<float>(random() % rows);
        const float radius = 15.0F + static_cast<float>(random() % 35);
        for (std::size_t y = 0; y < rows; ++y)
            for (std::size_t x = 0; x < columns; ++x)
                if (std::hypot(static_cast<float>(x) - x0, static_cast<float>(y) - y0) < radius)
                    map(y, x) = 0.15F + 0.12F * static_cast<float>(disc);
    }
    return map;
}

bool contains(const buffer<std::byte>& file, const void* part, std::size_t size) {
    const auto first = static_cast<const std::byte*>(part);
    return std::search(file.begin(), file.end(), first, first + size) != file.end();
}

}  // namespace

TEST_CASE("custom columns pass through every stage from lift() to the vertices of the mesh") {
    std::mt19937 random(4);
    for (int round = 0; round < 20; ++round) {
        const std::size_t rows = 40 + random() % 40, columns = 40 + random() % 40;
        const image<float> disparity = testing::random_disparity(random, rows, columns);
        image<std::uint8_t> photo(rows, columns, 3);
        for (std::uint8_t& value : photo) value = static_cast<std::uint8_t>(random());
        buffer<float> normals;
        buffer<std::uint16_t> materials;
        for (std::int32_t y = 0; y < static_cast<std::int32_t>(rows); ++y)
            for (std::int32_t x = 0; x < static_cast<std::int32_t>(columns); ++x) {
                const float direction[] = {static_cast<float>(x), static_cast<float>(y), 1.0F};
                normals.append(direction, direction + 3);
                materials.push_back(material_at(x, y));
            }

        auto layer = lift(photo, disparity).with<normal_column>(normals).with<material_column>(materials);
        const buffer<discontinuity_curve> curves = find_discontinuity_curves(layer, {}, {.min_length = 4, .max_density = 2.0F});
        close_spurious_discontinuities(layer, curves);
        unmix_colors(layer);
        auto layers = expand(std::move(layer), {}, std::span<const discontinuity_curve>(curves),
                             {.motion = 1.0F, .iterations = 10, .max_hidden = 100.0F})
                          .layers;
        const serial_executor threads;
        diffusion_inpainter().inpaint(layers, {}, threads);
        add_texture(layers);
        const chart_set charts = make_charts(layers, {});
        const texture_atlas atlas = make_atlas(layers, charts);
        const photo_facts facts = testing::facts_of(layers.topology());
        const textured_mesh mesh = build_mesh(layers, facts, charts, atlas);

        REQUIRE_FALSE(validate(layers));
        // A hidden pixel has the payload of the photo pixel from which it grew, so normal and material still match.
        for (std::int32_t i = 0; i < static_cast<std::int32_t>(layers.size()); ++i) {
            const auto n = layers.at<normal_column>(i);
            REQUIRE(layers.at<material_column>(i)[0] ==
                    material_at(static_cast<std::int32_t>(n[0]), static_cast<std::int32_t>(n[1])));
        }
        REQUIRE(mesh.pixels.size() == mesh.vertex_count());
        for (std::size_t v = 0; v < mesh.vertex_count(); ++v) {
            const std::int32_t pixel = mesh.pixels[v];
            REQUIRE(pixel != no_pixel);
            const float* p = mesh.positions.data() + 3 * v;
            const auto [x, y] = facts.camera.project({p[0], p[1], p[2]});
            CHECK(std::abs(x - static_cast<float>(layers.topology().x()[pixel]) - 0.5F) < 0.51F);
            CHECK(std::abs(y - static_cast<float>(layers.topology().y()[pixel]) - 0.5F) < 0.51F);
        }
    }
}

TEST_CASE("with default options, custom columns reach the vertices of meshes with hems and the GLB, even on sheets") {
    std::size_t hems = 0;
    for (std::uint32_t seed = 1; seed <= 8; ++seed) {
        CAPTURE(seed);
        std::mt19937 random(seed);
        const std::size_t rows = 130 + random() % 60, columns = 130 + random() % 60;
        const image<float> map = random_discs(random, rows, columns), normals = normals_of(rows, columns);
        const image<std::uint8_t> photo(rows, columns, 3, std::uint8_t{90});
        const basic_photo3d<normal_column> made =
            make_photo3d(photo, photo_columns<normal_column>(normals), given_disparity{map}, diffusion_inpainter{});
        hems += made.mesh.hem_vertices.size();
        const buffer<float> at_vertices = gather<normal_column>(made.mesh, made.layers, made.facts.camera);
        for (const hem_vertex& h : made.mesh.hem_vertices)
            REQUIRE(std::equal(&at_vertices[3 * h.outer], &at_vertices[3 * h.outer] + 3, &at_vertices[3 * h.inner]));
        glb_options options;
        options.attributes = {{"_SURFACE_NORMAL", 3, at_vertices}};
        const buffer<std::byte> glb = encode_glb(made.mesh, made.atlas.color, options);
        constexpr std::string_view name = R"("_SURFACE_NORMAL":)";
        CHECK(contains(glb, name.data(), name.size()));
        CHECK(contains(glb, at_vertices.data(), at_vertices.size() * sizeof(float)));

        const sheet_layout layout =
            lay_out_sheets(made.layers, made.charts, made.atlas, rows, columns, {.margin = made.facts.margin});
        const textured_mesh moved = move_to_sheets(made.mesh, made.charts, made.atlas, layout);
        CHECK(moved.hem_vertices.size() == made.mesh.hem_vertices.size());
        const buffer<float> at_moved = gather<normal_column>(moved, made.layers, made.facts.camera);
        CHECK(sorted_vertices(moved, at_moved) == sorted_vertices(made.mesh, at_vertices));
    }
    CHECK(hems > 100);
}

TEST_CASE("with default options, custom columns reach the vertices of the sample's mesh") {
    const std::filesystem::path folder = LDI_SOURCE_DIR "/examples/photo3d";
    const photo sample = load_photo(folder / "sample.jpg");
    const image<float> map = load_depth_map(folder / "sample_depth.png");
    const image<float> normals = normals_of(sample.color.height(), sample.color.width());
    thread_pool threads;
    const auto made = make_photo3d(sample.color, photo_columns<normal_column>(normals), given_disparity{map},
                                   diffusion_inpainter{}, {}, threads);
    CHECK(made.mesh.hem_vertices.size() > 100);
    CHECK(gather<normal_column>(made.mesh, made.layers, made.facts.camera).size() == 3 * made.mesh.vertex_count());
}

TEST_CASE("views with gaps between rows produce the same 3D photo as copies without gaps") {
    std::mt19937 random(5);
    const std::size_t rows = 60, columns = 80, photo_stride = 3 * columns + 17, map_stride = columns + 5;
    const image<float> disparity = testing::random_disparity(random, rows, columns);
    std::vector<std::uint8_t> photo_memory(rows * photo_stride, 255);
    std::vector<float> map_memory(rows * map_stride, -1.0F);
    const image_view<std::uint8_t> photo(photo_memory.data(), rows, columns, 3, photo_stride);
    const image_view<float> map(map_memory.data(), rows, columns, 1, map_stride);
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x) {
            map(y, x) = disparity(y, x);
            for (std::size_t c = 0; c < 3; ++c) photo(y, x, c) = static_cast<std::uint8_t>(random());
        }
    const image<std::uint8_t> photo_copy{image_view<const std::uint8_t>(photo)};

    CHECK(weighted_median(map) == weighted_median(disparity));
    CHECK(normalize(map).disparity == normalize(disparity).disparity);
    image<float> merged(disparity);
    merge_middle_components(merged);
    merge_middle_components(map);
    CHECK(image<float>{image_view<const float>(map)} == merged);
    const photo_layer from_views = lift(photo, map), from_copies = lift(photo_copy, merged);
    CHECK(from_views.column<color_column>() == from_copies.column<color_column>());
    CHECK(from_views.column<disparity_column>() == from_copies.column<disparity_column>());
    CHECK(from_views.topology().right() == from_copies.topology().right());
    const photo3d one = make_photo3d(photo, given_disparity{disparity}, diffusion_inpainter{});
    const photo3d other = make_photo3d(photo_copy, given_disparity{disparity}, diffusion_inpainter{});
    CHECK(one.mesh.positions == other.mesh.positions);
    CHECK(one.atlas.color == other.atlas.color);
}
