#include <ldi/mesh/textured_mesh.hpp>

#include "tests/support/errors.hpp"

#include <catch2/catch.hpp>

#include <limits>
#include <optional>

using namespace ldi;

namespace {
/// Two triangles of four vertices.
textured_mesh square() {
    textured_mesh mesh;
    mesh.positions = {0, 0, -1, 1, 0, -1, 0, 1, -1, 1, 1, -1};
    mesh.texture_coordinates = {0, 1, 1, 1, 0, 0, 1, 0};
    mesh.pixels = {0, 1, 2, 3};
    mesh.triangles = {0, 1, 2, 2, 1, 3};
    return mesh;
}

template <class Change>
std::optional<error_code> code_after(Change&& change, std::size_t textures = 1) {
    textured_mesh mesh = square();
    change(mesh);
    return testing::raised([&] { check_mesh(mesh, textures); });
}
}  // namespace

TEST_CASE("a mesh without explicit parts is one part with texture 0") {
    const textured_mesh mesh = square();
    CHECK(mesh.vertex_count() == 4);
    CHECK(mesh.triangle_count() == 2);
    CHECK(mesh.part_count() == 1);
    CHECK(mesh.part(1).first_triangle == 2);
    CHECK(mesh.uses_texture(0));
    CHECK_FALSE(textured_mesh().uses_texture(0));
    CHECK_NOTHROW(check_mesh(mesh, 1));
    CHECK_NOTHROW(check_mesh(textured_mesh(), 1));
}

TEST_CASE("a mesh with inconsistent columns, indices or parts is refused") {
    using m = textured_mesh;
    CHECK(code_after([](m&) {}, 2) == error_code::mismatch);
    CHECK(code_after([](m& x) { x.positions.push_back(0); }) == error_code::mismatch);
    CHECK(code_after([](m& x) { x.texture_coordinates.pop_back(); }) == error_code::mismatch);
    CHECK(code_after([](m& x) { x.triangles.pop_back(); }) == error_code::mismatch);
    CHECK(code_after([](m& x) { x.soft_edges.opacity.push_back(0); }) == error_code::mismatch);
    CHECK(code_after([](m& x) { x.triangles[5] = 4; }) == error_code::invalid_data);
    CHECK(code_after([](m& x) { x.positions[2] = std::numeric_limits<float>::quiet_NaN(); }) == error_code::invalid_data);
    CHECK(code_after([](m& x) { x.parts = {{1, 0}}; }) == error_code::invalid_data);
    CHECK(code_after([](m& x) { x.parts = {{0, 0}, {3, 1}, {2, 1}}; }, 3) == error_code::invalid_data);
    CHECK(code_after([](m& x) { x.parts = {{0, 0}, {2, 1}}; }, 2) == error_code::invalid_data);
    const std::size_t far = std::size_t{1} << 40;
    for (const mesh_part outside : {mesh_part{5, 2}, {4, 3}, {far, far}}) {
        CHECK(code_after([&](m& x) { x.parts = {{0, 0}, outside}; }, 2) == error_code::invalid_data);
        CHECK(code_after([&](m& x) { x.parts = {{0, 0}, {0, 0}, outside}; }, 3) == error_code::invalid_data);
    }
    CHECK(code_after([](m& x) { x.hem_vertices = {{0, 4}}; }) == error_code::invalid_data);
}
