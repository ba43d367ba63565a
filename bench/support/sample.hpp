// The shipped sample after each stage of make_photo3d(), at 1152 x 1536, for benchmarks of single stages. Made once per program.
#pragma once

#include <ldi/charts/chart_set.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/photo3d/lift_photo.hpp>
#include <ldi/texture/atlas.hpp>

#include <cstdint>
#include <string>

namespace ldi_bench {

/// Paths, in the source tree, of a file of the sample and of a file of weights.
std::string sample_file(const std::string& name);
std::string model_file(const std::string& name);

struct sample_stages {
    ldi::image<std::uint8_t> photo;   ///< 1536 x 1152 x 3
    ldi::image<float> depth_map;      ///< 1536 x 1152: the values of the file, with holes filled
    ldi::image<float> estimate;       ///< 384 x 288: the depth map at a network's resolution
    ldi::image<float> filtered;       ///< 1536 x 1152: the estimate, sharpened, resampled and filtered
    ldi::photo_layer lifted;          ///< made from the file's depth, with all silhouettes, before colors are unmixed
    ldi::lifted_photo<> prepared;     ///< with unmixed colors
    ldi::working_layers<> uncolored;  ///< with hidden surfaces
    ldi::working_layers<> colored;    ///< inpainted by diffusion, without texture
    ldi::photo_layers layers;         ///< with texture, and grown past the frame
    ldi::photo_facts facts;
    ldi::chart_set charts;
    ldi::texture_atlas atlas;
    ldi::textured_mesh mesh;
};

const sample_stages& sample();

/// The graph of the sample with its hidden surfaces, 1152 x 1536, before it grows past the frame.
const ldi::graph& sample_graph();
/// A plain image with about as many pixels as sample_graph(), in whole rows of 1152.
const ldi::graph& image_graph();

}  // namespace ldi_bench
