// Defaults that are given by the paper or by the training of the silhouette network.
#include <ldi/ldi.hpp>

#include <catch2/catch.hpp>

TEST_CASE("the paper's numbers are the defaults") {
    const ldi::photo3d_options o;
    CHECK(o.surface.max_step == 0.05F);          // tau_disp
    CHECK(o.median.sigma == 0.2F);               // depth filter
    CHECK(o.components.min_size == 20);          // connected components, in pixels
    CHECK(o.curves.min_length == 20);            // spurious groups, in pixels
    CHECK(ldi::tiefenrausch::long_side == 384);  // input size of the network
    CHECK(ldi::macroblock_side == 16);           // alignment in the atlas
}

// The values of examples/training/silhouettes/band.py.
TEST_CASE("the silhouette network decides in the same bands as in its training") {
    CHECK(ldi::step_band_options().max_step == 0.02F);
    CHECK(ldi::step_band_options().min_step == 0.06F);
    CHECK(ldi::step_sides_radius == 4);
    CHECK(ldi::step_band_radius == 12);
    CHECK(ldi::step_region_radius == 16);
}
