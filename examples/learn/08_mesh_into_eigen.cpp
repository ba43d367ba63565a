// Maps a mesh to the Eigen matrices V, F and UV, without a copy and in libigl's convention: one row per vertex or triangle.
// Computes the mesh's area, and fits planes to the wall and the table by least squares.
#include "whole_sample.hpp"

#include <ldi/adapt/eigen.hpp>
#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/photo3d.hpp>

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>
#include <vector>

/// Fits a plane to points. Returns its unit normal, and the root mean square distance of the points from the plane.
std::pair<Eigen::Vector3f, float> plane_through(const Eigen::MatrixX3f& points) {
    const Eigen::MatrixX3f around = points.rowwise() - points.colwise().mean();
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3f> axes(around.transpose() * around);
    return {axes.eigenvectors().col(0), std::sqrt((std::max)(axes.eigenvalues()(0), 0.0F) / static_cast<float>(points.rows()))};
}

int main() {
    const learn::sample photo = learn::load_sample(learn::everything, 4);
    ldi::photo3d_options options;
    options.frame = ldi::photo_frame::crop, options.focal_length_35mm = 32.55F;  // the sample's frame and camera
    options.normalize = {.clipped_share = 0, .is_inverse_depth = false, .assumed_range = {0.687F, 2.047F}};
    const ldi::photo3d made =
        ldi::make_photo3d(photo.color, ldi::given_disparity{photo.disparity}, ldi::diffusion_inpainter{}, options);

    const ldi::position_map V = ldi::positions(made.mesh);  // no copy
    const ldi::triangle_map F = ldi::triangles(made.mesh);
    const ldi::texture_coordinate_map UV = ldi::texture_coordinates(made.mesh);
    std::printf("V %ld x 3, F %ld x 3, UV %ld x 2\n", V.rows(), F.rows(), UV.rows());
    float area = 0;
    for (Eigen::Index t = 0; t < F.rows(); ++t) {
        const Eigen::Vector3f a = V.row(F(t, 0)), b = V.row(F(t, 1)), c = V.row(F(t, 2));
        area += 0.5F * (b - a).cross(c - a).norm();
    }
    std::printf("area %.2f square meters\n", area);

    // Each vertex stores its pixel. In the photo, the wall's pixels are farthest, and the table's front edge is lowest.
    Eigen::Vector3f normals[2];
    for (const bool wall : {true, false}) {
        std::vector<Eigen::Index> chosen;
        for (Eigen::Index v = 0; v < V.rows(); ++v) {
            const std::int32_t pixel = made.mesh.pixels[v], x = made.layers.topology().x()[pixel],
                               y = made.layers.topology().y()[pixel];
            const float disparity = made.layers.column<ldi::disparity_column>()[pixel];
            const bool is_chosen = wall ? disparity < 0.05F && y < 220 : x > 115 && y > 358;
            if (is_chosen && made.layers.column<ldi::known_column>()[pixel] != 0) chosen.push_back(v);
        }
        const auto [normal, rms] = plane_through(V(chosen, Eigen::all));
        std::printf("%s: %zu vertices, %.1f mm from their plane (rms)\n", wall ? "wall " : "table", chosen.size(), 1000 * rms);
        normals[wall] = normal;
    }
    std::printf("angle between wall and table: %.1f degrees\n", 57.29578F * std::acos(std::abs(normals[0].dot(normals[1]))));
}
