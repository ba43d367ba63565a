// Contents of the Python package's objects. Each result is immutable and shares the values that it was made from.
#pragma once

#include <ldi/charts/charts.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/mesh/textured_mesh.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/texture/atlas.hpp>

#include <cstdint>
#include <memory>
#include <random>
#include <utility>

namespace ldi::python {

/// Layers, charts, atlases and meshes belong together if they have the same identifier. It is a random number, which photo3d(),
/// expand() and grow_past_frame() generate.
using geometry_id = std::uint64_t;

inline geometry_id new_geometry_id() {
    std::random_device random;
    return std::uint64_t{random()} << 32 | random();
}

/// ldi.Depth
struct depth_value : cleaned_photo {};

/// The silhouettes that a Layer and the Layers grown from it share.
struct silhouettes_value {
    std::shared_ptr<depth_value> depth;
    float focal_length_35mm = 0;
    photo_facts facts;
    buffer<discontinuity_curve> curves;
    buffer<uncertain_rim> rims;
};

/// ldi.Layer
struct layer_value {
    decltype(lifted_photo<>::layer) layers;
    std::shared_ptr<silhouettes_value> silhouettes;
};

/// ldi.Layers
struct layers_value {
    working_layers<> layers;
    std::shared_ptr<silhouettes_value> silhouettes;  ///< null for the layers that a Python inpainter receives
    float motion = 0;                                ///< photo_facts::motion
    float requested_motion = 0;                      ///< expand_options::motion, which is larger if growth ended early
    std::int32_t margin = 0;                         ///< photo_facts::margin
    geometry_id geometry = 0;
};

/// ldi.Charts, ldi.Atlas, ldi.Mesh
struct charts_value : chart_set {
    geometry_id geometry = 0;
};
struct atlas_value : texture_atlas {
    geometry_id geometry = 0;
};
struct mesh_value : textured_mesh {
    geometry_id geometry = 0;
};

/// ldi.Photo3D
struct photo3d_value {
    std::shared_ptr<layers_value> layers;
    std::shared_ptr<charts_value> charts;
    std::shared_ptr<atlas_value> atlas;
    std::shared_ptr<mesh_value> mesh;
};

/// Raises mismatch if parts belong to different geometries.
template <class... Parts>
void check_same_geometry(const layers_value& layers, const Parts&... parts) {
    if (((parts.geometry != layers.geometry) || ...))
        raise(error_code::mismatch, "layers",
              "layers, charts, atlas and mesh made from one result of expand() or grow_past_frame()",
              "parts made from different results");
}

/// Raises mismatch for layers that a Python inpainter received, which have no silhouettes.
inline const silhouettes_value& silhouettes_of(const layers_value& layers) {
    if (layers.silhouettes == nullptr)
        raise(error_code::mismatch, "layers", "layers made by expand(), inpaint() or photo3d()", "layers passed to an inpainter");
    return *layers.silhouettes;
}

/// Raises mismatch for layers that a Python inpainter received, which have no facts.
inline photo_facts facts_of(const layers_value& layers) {
    photo_facts facts = silhouettes_of(layers).facts;
    facts.motion = layers.motion, facts.margin = layers.margin;
    return facts;
}
inline const photo_facts& facts_of(const layer_value& layer) { return layer.silhouettes->facts; }

inline std::int32_t margin_of(const layers_value& layers) { return layers.margin; }
inline std::int32_t margin_of(const layer_value&) { return 0; }

/// Splits a finished 3D photo into the parts that Python accesses.
inline photo3d_value parts_of(photo3d&& made, const photo3d_options& options) {
    depth_value depth;
    depth.photo = std::move(made.photo), depth.estimated = std::move(made.estimated);
    depth.disparity = std::move(made.disparity), depth.range = made.facts.range;
    silhouettes_value silhouettes{
        std::make_shared<depth_value>(std::move(depth)), options.focal_length_35mm, made.facts, std::move(made.curves), {}};
    const geometry_id id = new_geometry_id();
    return {std::make_shared<layers_value>(layers_value{working_layers<>(std::move(made.layers)),
                                                        std::make_shared<silhouettes_value>(std::move(silhouettes)),
                                                        made.facts.motion, options.expand.motion, made.facts.margin, id}),
            std::make_shared<charts_value>(charts_value{std::move(made.charts), id}),
            std::make_shared<atlas_value>(atlas_value{std::move(made.atlas), id}),
            std::make_shared<mesh_value>(mesh_value{std::move(made.mesh), id})};
}

}  // namespace ldi::python
