// Maps a mesh's memory as Eigen matrices without a copy: V, F and UV with one row per vertex or triangle, as in libigl.
// Converts the pose of a view to and from an Eigen isometry. Requires Eigen 3.4; no other header of ldi requires Eigen. If you
// use the single header of ldi, include the single header first.
#pragma once

#ifndef LDI_SINGLE_HEADER
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/render/camera.hpp>
#endif

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// V x 3 positions; x right, y up, the photo's camera at the origin looking along -z.
using position_map = Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, 3, Eigen::RowMajor>>;
/// F x 3 vertex indices, counter-clockwise.
using triangle_map = Eigen::Map<const Eigen::Matrix<std::uint32_t, Eigen::Dynamic, 3, Eigen::RowMajor>>;
/// V x 2 texture coordinates; (0, 0) is the top left corner of the atlas.
using texture_coordinate_map = Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, 2, Eigen::RowMajor>>;

/// Maps the mesh's own memory: the mesh must outlive the map and must not grow. This also holds for the next two functions.
inline position_map positions(const textured_mesh& mesh) {
    return {mesh.positions.data(), static_cast<Eigen::Index>(mesh.vertex_count()), 3};
}
inline triangle_map triangles(const textured_mesh& mesh) {
    return {mesh.triangles.data(), static_cast<Eigen::Index>(mesh.triangle_count()), 3};
}
inline texture_coordinate_map texture_coordinates(const textured_mesh& mesh) {
    return {mesh.texture_coordinates.data(), static_cast<Eigen::Index>(mesh.vertex_count()), 2};
}

/// Returns the transform from the camera's space to the photo's space: `pose(v) * Eigen::Vector3f::Zero()` is the camera's
/// position.
inline Eigen::Isometry3f pose(const view& v) {
    Eigen::Isometry3f result = Eigen::Isometry3f::Identity();
    result.linear() = Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(v.rotation.data());
    result.translation() = Eigen::Map<const Eigen::Vector3f>(v.position.data());
    return result;
}

/// Makes the view of a camera with a pose, as pose() returns it.
inline view view_from(const pinhole_camera& camera, const Eigen::Isometry3f& camera_to_photo) {
    view result;
    result.camera = camera;
    Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(result.rotation.data()) = camera_to_photo.linear();
    Eigen::Map<Eigen::Vector3f>(result.position.data()) = camera_to_photo.translation();
    return result;
}

}}  // namespace ldi
