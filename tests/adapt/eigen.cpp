#include <ldi/adapt/eigen.hpp>
#include <ldi/ldi.hpp>

#include <catch2/catch.hpp>

#include <random>

#include "tests/support/lifted_scene.hpp"

TEST_CASE("Eigen maps the mesh's memory as vertices, triangles and texture coordinates, without a copy") {
    std::mt19937 random(3);
    const ldi::image<float> disparity = ldi::testing::random_disparity(random, 40, 60);
    const ldi::photo3d made = ldi::make_photo3d(ldi::image<std::uint8_t>(40, 60, 3, std::uint8_t{90}),
                                                ldi::given_disparity{disparity}, ldi::diffusion_inpainter{});
    const ldi::position_map v = ldi::positions(made.mesh);
    const ldi::triangle_map f = ldi::triangles(made.mesh);
    const ldi::texture_coordinate_map uv = ldi::texture_coordinates(made.mesh);
    REQUIRE(v.rows() == static_cast<Eigen::Index>(made.mesh.vertex_count()));
    REQUIRE(f.rows() == static_cast<Eigen::Index>(made.mesh.triangle_count()));
    REQUIRE(uv.rows() == v.rows());
    CHECK(v.data() == made.mesh.positions.data());
    CHECK(f.maxCoeff() < static_cast<std::uint32_t>(v.rows()));
    CHECK(uv.minCoeff() >= 0.0F);
    CHECK(uv.maxCoeff() <= 1.0F);
    // Every triangle is counter-clockwise when seen from the photo's camera. Together, the triangles cover the photo at least
    // once.
    const ldi::pinhole_camera& camera = made.facts.camera;
    double area = 0;
    for (Eigen::Index t = 0; t < f.rows(); ++t) {
        Eigen::Matrix<float, 3, 2> seen;
        for (int corner = 0; corner < 3; ++corner) {
            const Eigen::Vector3f point = v.row(f(t, corner));
            const auto [x, y] = camera.project({point.x(), point.y(), point.z()});
            seen.row(corner) << x, -y;
        }
        const Eigen::Vector2f a = seen.row(1) - seen.row(0), b = seen.row(2) - seen.row(0);
        const float twice = a.x() * b.y() - a.y() * b.x();
        CHECK(twice > -1e-2F);
        area += 0.5 * static_cast<double>(twice);
    }
    CHECK(area > 40 * 60 - 1);
}

TEST_CASE("pose() inverts view_from(), and the inverse pose transforms points as the view does") {
    std::mt19937 random(4);
    std::normal_distribution<float> normal;
    for (int round = 0; round < 100; ++round) {
        Eigen::Isometry3f expected = Eigen::Isometry3f::Identity();
        expected.linear() =
            Eigen::Quaternionf(normal(random), normal(random), normal(random), normal(random)).normalized().matrix();
        expected.translation() << normal(random), normal(random), normal(random);
        const ldi::view v = ldi::view_from({640, 480, 500.0F}, expected);
        CHECK(v.camera.width == 640);
        CHECK(ldi::pose(v).isApprox(expected));
        const Eigen::Vector3f point(normal(random), normal(random), normal(random));
        const Eigen::Vector3f seen = ldi::pose(v).inverse() * point;
        const auto ours = v.to_camera({point.x(), point.y(), point.z()});
        for (int i = 0; i < 3; ++i) CHECK(ours[static_cast<std::size_t>(i)] == Approx(seen[i]).margin(1e-5));
    }
}
