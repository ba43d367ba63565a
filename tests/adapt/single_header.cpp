// Includes the single header and both adapters. The separate headers are later in the include path.
#include "single_include/ldi/ldi.hpp"

#include <ldi/adapt/eigen.hpp>
#include <ldi/adapt/xtensor.hpp>

#include <catch2/catch.hpp>

TEST_CASE("the single header works with both adapters") {
    ldi::textured_mesh mesh;
    for (const float p : {0.0F, 1.0F, -2.0F}) mesh.positions.push_back(p);
    CHECK(ldi::positions(mesh).row(0) == Eigen::RowVector3f(0, 1, -2));
    const ldi::image<float> picture(2, 3, 1, 0.5F);
    CHECK(xt::sum(ldi::as_tensor(picture))() == 3.0F);
}
