// Functions of the Python package: the whole pipeline, and each of its stages.
#pragma once

#include "arrays.hpp"
#include "callbacks.hpp"
#include "values.hpp"

#include <ldi/depth/network_decider.hpp>
#include <ldi/networks/silhouettes.hpp>
#include <ldi/photo3d.hpp>

#include <pybind11/pybind11.h>

#include <cstddef>
#include <memory>
#include <utility>

namespace ldi::python {

/// Returns a silhouette_decider, and sets the options that it needs.
///
/// silhouettes  a SilhouetteNetwork, or None for aligned_silhouettes
inline network_decider<silhouette_network> decider_of(const py::object& silhouettes, photo3d_options& options) {
    if (silhouettes.is_none()) return network_decider<silhouette_network>(nullptr, options.alignment);
    options.level = level_options();
    return network_decider(silhouettes.cast<const silhouette_network*>(), options.alignment);
}

inline std::shared_ptr<photo3d_value> convert(const py::object& photo, const py::object& depth, depth_meaning meaning,
                                              const py::object& silhouettes, const py::object& inpainter, photo3d_options options,
                                              std::size_t threads, const py::object& progress) {
    const photo_argument seen(photo, "photo");
    const depth_source estimator(depth, seen, meaning);
    const color_source colors(inpainter);
    options.normalize = estimator.normalization();
    const network_decider decider = decider_of(silhouettes, options);
    return run_unlocked(progress, threads, [&](const progress_listener& listener, thread_pool& pool) {
        options.progress = listener;
        return std::make_shared<photo3d_value>(
            parts_of(make_photo3d(seen.view(), estimator, decider, colors, options, pool), options));
    });
}

inline std::shared_ptr<depth_value> make_depth(const py::object& photo, const py::object& depth, depth_meaning meaning,
                                               const py::object& silhouettes, photo3d_options options, std::size_t threads) {
    const photo_argument seen(photo, "photo");
    const depth_source estimator(depth, seen, meaning);
    options.normalize = estimator.normalization();
    const network_decider decider = decider_of(silhouettes, options);
    return run_unlocked(py::none(), threads, [&](const progress_listener& listener, thread_pool& pool) {
        options.progress = listener;
        auto made = std::make_shared<depth_value>(depth_value{clean_depth(seen.view(), estimator, decider, options, pool)});
        made->resampled = {};
        return made;
    });
}

inline std::shared_ptr<layer_value> make_layer(const std::shared_ptr<depth_value>& depth, float focal_length,
                                               std::size_t threads) {
    photo3d_options options;
    options.focal_length_35mm = focal_length;
    return run_unlocked(py::none(), threads, [&](const progress_listener&, thread_pool& pool) {
        lifted_photo<> lifted = lift_photo(*depth, options, pool);
        auto made = std::make_shared<layer_value>();
        made->layers = std::move(lifted.layer);
        made->silhouettes = std::make_shared<silhouettes_value>(
            silhouettes_value{depth, focal_length, lifted.facts, std::move(lifted.curves), std::move(lifted.rims)});
        return made;
    });
}

inline std::shared_ptr<layers_value> make_layers(const layer_value& layer, float motion) {
    expand_options options;
    options.motion = motion;
    return run_unlocked(py::none(), 1, [&](const progress_listener& listener, thread_pool&) {
        const silhouettes_value& silhouettes = *layer.silhouettes;
        auto grown = expand(layer.layers, silhouettes.facts.surface, silhouettes.curves, options, listener);
        return std::make_shared<layers_value>(
            layers_value{std::move(grown.layers), layer.silhouettes, grown.motion, motion, 0, new_geometry_id()});
    });
}

inline std::shared_ptr<layers_value> make_inpainted(const layers_value& layers, const py::object& inpainter, float texture,
                                                    float grain, std::size_t threads) {
    const silhouettes_value& silhouettes = silhouettes_of(layers);
    const color_source colors(inpainter);
    photo3d_options options;
    options.texture.strength = texture, options.grain.strength = grain;
    return run_unlocked(py::none(), threads, [&](const progress_listener& listener, thread_pool& pool) {
        options.progress = listener;
        auto made = std::make_shared<layers_value>(layers);
        inpaint_hidden(made->layers, silhouettes.rims, colors, options, pool);
        return made;
    });
}

inline std::shared_ptr<layers_value> make_past_frame(const layers_value& layers) {
    const photo_facts facts = facts_of(layers);
    if (facts.margin > 0)
        raise(error_code::mismatch, "layers", "layers that end at the photo's border", "layers that continue past it");
    return run_unlocked(py::none(), 1, [&](const progress_listener&, thread_pool&) {
        auto made = std::make_shared<layers_value>(layers);
        made->margin = grow_past_frame(made->layers, facts);
        made->geometry = new_geometry_id();
        return made;
    });
}

inline std::shared_ptr<charts_value> make_chart_set(const layers_value& layers) {
    // The layers that a Python inpainter receives have no facts. The default rule is the right one for them, since Python has no
    // option to change it.
    const surface_rule surface = layers.silhouettes == nullptr ? surface_rule{} : layers.silhouettes->facts.surface;
    const py::gil_scoped_release unlocked;
    return std::make_shared<charts_value>(charts_value{make_charts(layers.layers, surface), layers.geometry});
}

inline std::shared_ptr<atlas_value> make_texture_atlas(const layers_value& layers, const charts_value& charts,
                                                       std::size_t threads) {
    check_same_geometry(layers, charts);
    return run_unlocked(py::none(), threads, [&](const progress_listener&, thread_pool& pool) {
        return std::make_shared<atlas_value>(atlas_value{make_atlas(layers.layers, charts, {}, pool), layers.geometry});
    });
}

inline std::shared_ptr<mesh_value> make_textured_mesh(const layers_value& layers, const charts_value& charts,
                                                      const atlas_value& atlas, std::size_t threads) {
    check_same_geometry(layers, charts, atlas);
    const photo_facts facts = facts_of(layers);
    return run_unlocked(py::none(), threads, [&](const progress_listener&, thread_pool& pool) {
        return std::make_shared<mesh_value>(
            mesh_value{build_mesh(layers.layers, facts, charts, atlas, {}, pool), layers.geometry});
    });
}

inline std::shared_ptr<photo3d_value> join_parts(std::shared_ptr<layers_value> layers, std::shared_ptr<charts_value> charts,
                                                 std::shared_ptr<atlas_value> atlas, std::shared_ptr<mesh_value> mesh) {
    silhouettes_of(*layers);
    check_same_geometry(*layers, *charts, *atlas, *mesh);
    return std::make_shared<photo3d_value>(
        photo3d_value{std::move(layers), std::move(charts), std::move(atlas), std::move(mesh)});
}

/// Returns the disparity that a depth network estimates for a photo.
inline py::array_t<float> estimate(const tiefenrausch& network, const py::object& photo, std::size_t threads) {
    const photo_argument seen(photo, "photo");
    return array_of(run_unlocked(py::none(), threads, [&](const progress_listener& listener, thread_pool& pool) {
        return network.disparity(seen.view(), listener, pool);
    }));
}

/// Returns the colors of layers, inpainted by a network.
inline py::array_t<std::uint8_t> inpaint_colors(const farbrausch& network, const layers_value& layers, std::size_t threads) {
    working_layers<> filled = run_unlocked(py::none(), threads, [&](const progress_listener& listener, thread_pool& pool) {
        working_layers<> copy = layers.layers;
        network.inpaint(copy, listener, pool);
        return copy;
    });
    const auto colors = filled.column<color_column>();
    return py::array_t<std::uint8_t>({static_cast<py::ssize_t>(filled.size()), py::ssize_t{3}}, colors.data());
}

}  // namespace ldi::python
