// The paper's numbers, and ours where it has none, in one place. Changing one of them changes every 3D photo: change it here as
// well, deliberately.
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

TEST_CASE("defaults for which the paper has no number equal the values in this test") {
    const ldi::photo3d_options o;
    CHECK(o.long_side == 1536);
    CHECK(o.focal_length_35mm == 26.0F);
    CHECK(o.passes_before_resampling == 2);
    CHECK(o.max_sample_size == 16.0F);
    CHECK(o.normalize.max_depth_ratio == 50.0F);
    CHECK(o.resample.spatial_sigma == 1.2F);
    CHECK(o.resample.color_sigma == 20.0F);
    CHECK(o.expand.iterations == 4096);
    CHECK(o.texture.rounds == 2);
    CHECK(o.grain.rounds == 4);
    CHECK(o.frame == ldi::photo_frame::grow);  // the paper crops the frame
    CHECK(o.expand.motion == 0.08F);           // the paper grows 50 pixels, for any step and camera
    CHECK(o.level.radius == 0);
    CHECK(o.sharpen.radius == 3);
    CHECK(o.sharpen.min_change == 3.0F);
    CHECK(o.sharpen.min_share == 0.7F);
    CHECK(o.alignment.uncertainty == 3.0F);
    CHECK(o.alignment.stiffness == 1.5F);
    CHECK(o.alignment.min_length == 20);
    CHECK(ldi::step_band_options().max_step == 0.02F);  // the silhouette network is trained with these five values
    CHECK(ldi::step_band_options().min_step == 0.06F);
    CHECK(ldi::step_sides_radius == 4);
    CHECK(ldi::step_band_radius == 12);
    CHECK(ldi::step_region_radius == 16);
    CHECK(o.mixed_colors.foreground_margin == 2);
    CHECK(o.mixed_colors.background_margin == 1);
    CHECK(o.mixed_colors.reach == 4.0F / 1536.0F);
    CHECK(o.mixed_colors.contrast == 40.0F);
    CHECK(o.curves.tangent_length == 20);
    CHECK(o.curves.max_density == 0.2F);
    CHECK(o.curves.max_sides == 500'000);
    CHECK(o.curves.constraints == ldi::constrained_ends::midground);
    CHECK(o.expand.max_hidden == 1.25F);
    CHECK(o.expand.merges_curves);
    CHECK(o.texture.strength == 1.0F);
    CHECK(o.texture.crest == 4.0F);
    CHECK(o.texture.reach == 32);
    CHECK(o.texture.tolerance == 13.0F);
    CHECK(o.grain.strength == 0.6F);
    CHECK(o.grain.limit == 20.0F);
    CHECK(o.charts.max_side == 2048);
    CHECK(o.charts.filter_range == 4);
    CHECK(o.charts.max_area == 3 << 24);
    CHECK(o.atlas.max_side == 8192);
    CHECK(ldi::diffusion_inpainter().rounds == 6);
    CHECK(o.normalize.clipped_share == 0.001F);
    CHECK(o.normalize.max_step == 0.02F);
    CHECK(o.atlas.padding.filter_padding == 4);
    CHECK(o.atlas.padding.diffusion_rounds == 4);
    CHECK(o.mesh.outlines.tolerance == 1.0F);
    CHECK(o.mesh.outlines.disparity_tolerance == 0.01F);
    CHECK(o.mesh.outlines.texture_tolerance == 0.5F);
    CHECK(o.mesh.soft_edges.min_width == 1.0F);
    CHECK(o.mesh.soft_edges.max_width == 3.0F);
    CHECK(o.mesh.soft_edges.max_share == 0.08F);
    CHECK(o.mesh.studs.spacing == 24);
    CHECK(o.mesh.studs.disparity_tolerance == 0.006F);
    CHECK(o.mesh.studs.clearance == 4);
    CHECK(o.mesh.studs.texture_tolerance == 0.5F);
}
