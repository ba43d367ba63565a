// Pickles of results. The pickle of a layered image contains the photo, its depth and the colors of its pixels; loading it
// computes the geometry again. Therefore only the version of ldi that wrote a pickle can read it.
#pragma once

#include "arrays.hpp"
#include "stages.hpp"
#include "values.hpp"

#include <ldi/version.hpp>

#include <pybind11/pybind11.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <utility>

namespace ldi::python {

inline std::string version_text() {
    return std::to_string(LDI_VERSION_MAJOR) + "." + std::to_string(LDI_VERSION_MINOR) + "." + std::to_string(LDI_VERSION_PATCH);
}

/// Returns the items of a pickle after the version. Raises invalid_data for a pickle of another version.
inline py::tuple checked(const py::tuple& state, std::size_t count) {
    if (state.size() != count + 1 || std::string(py::str(state[0])) != version_text())
        raise(error_code::invalid_data, "pickle", "a pickle written by ldi " + version_text(),
              state.empty() ? "none" : "one written by " + std::string(py::str(state[0])));
    return state[py::slice(1, static_cast<py::ssize_t>(count + 1), 1)];
}

template <class T>
py::array_t<std::remove_const_t<T>> copy_of(array_view<T> values, std::size_t columns = 1) {
    return array_over(py::none(), values, columns).attr("copy")();
}
template <class T>
py::array_t<T> copy_of(const buffer<T>& values, std::size_t columns = 1) {
    return copy_of(array_view<const T>(values), columns);
}
template <class T>
py::array_t<T> copy_of(const image<T>& picture) {
    return array_over(py::none(), picture).attr("copy")();
}

inline py::tuple state_of(const depth_value& depth) {
    return py::make_tuple(version_text(), copy_of(depth.photo), copy_of(depth.estimated), copy_of(depth.disparity),
                          depth.shares.empty() ? py::object(py::none()) : copy_of(depth.shares), depth.range.z_near,
                          depth.range.z_far);
}
inline std::shared_ptr<depth_value> depth_from(const py::tuple& state) {
    const py::tuple items = checked(state, 6);
    auto depth = std::make_shared<depth_value>();
    depth->photo = image_of<std::uint8_t>(items[0], 3, "photo");
    depth->estimated = image_of<float>(items[1], 1, "estimated");
    depth->disparity = image_of<float>(items[2], 1, "disparity");
    if (!items[3].is_none()) depth->shares = image_of<std::uint8_t>(items[3], 1, "shares");
    depth->range = {items[4].cast<float>(), items[5].cast<float>()};
    return depth;
}

inline py::tuple state_of(const layer_value& layer) {
    return py::make_tuple(version_text(), layer.silhouettes->depth, layer.silhouettes->focal_length_35mm);
}
inline std::shared_ptr<layer_value> layer_from(const py::tuple& state) {
    const py::tuple items = checked(state, 2);
    return make_layer(items[0].cast<std::shared_ptr<depth_value>>(), items[1].cast<float>(), 0);
}

inline py::tuple state_of(const layers_value& layers) {
    const silhouettes_value& silhouettes = silhouettes_of(layers);
    return py::make_tuple(version_text(), silhouettes.depth, silhouettes.focal_length_35mm, layers.requested_motion,
                          layers.geometry, copy_of(layers.layers.column<color_column>(), 3),
                          copy_of(layers.layers.column<known_column>()), layers.margin > 0);
}
inline std::shared_ptr<layers_value> layers_from(const py::tuple& state) {
    const py::tuple items = checked(state, 7);
    const auto layer = make_layer(items[0].cast<std::shared_ptr<depth_value>>(), items[1].cast<float>(), 0);
    auto layers = make_layers(*layer, items[2].cast<float>());
    if (items[6].cast<bool>()) layers = make_past_frame(*layers);
    layers->geometry = items[3].cast<geometry_id>();
    buffer<std::uint8_t> color = column_of<std::uint8_t>(items[4], 3, "color"),
                         known = column_of<std::uint8_t>(items[5], 1, "known");
    const std::size_t rows = layers->layers.size();
    if (color.size() != 3 * rows || known.size() != rows)
        raise(error_code::invalid_data, "pickle", "colors of " + std::to_string(rows) + " pixels", "another number");
    layers->layers.set_column<color_column>(std::move(color));
    layers->layers.set_column<known_column>(std::move(known));
    return layers;
}

inline py::tuple state_of(const charts_value& charts) {
    buffer<std::int32_t> boxes;
    for (const chart& c : charts.charts)
        for (const std::int32_t value : {c.x, c.y, c.width, c.height}) boxes.push_back(value);
    return py::make_tuple(version_text(), charts.geometry, copy_of(charts.chart_of), copy_of(boxes, 4));
}
inline std::shared_ptr<charts_value> charts_from(const py::tuple& state) {
    const py::tuple items = checked(state, 3);
    auto charts = std::make_shared<charts_value>();
    charts->geometry = items[0].cast<geometry_id>();
    charts->chart_of = column_of<std::int32_t>(items[1], 1, "chart_of");
    const buffer<std::int32_t> boxes = column_of<std::int32_t>(items[2], 4, "boxes");
    for (std::size_t i = 0; i < boxes.size(); i += 4)
        charts->charts.push_back({boxes[i], boxes[i + 1], boxes[i + 2], boxes[i + 3], {}});
    for (std::int32_t pixel = 0; pixel < charts->chart_of.count(); ++pixel) {
        const std::int32_t c = charts->chart_of[pixel];
        if (c < 0 || c >= charts->charts.count())
            raise(error_code::invalid_data, "pickle", "the index of a chart", std::to_string(c));
        charts->charts[c].pixels.push_back(pixel);
    }
    return charts;
}

inline py::tuple state_of(const atlas_value& atlas) {
    buffer<std::int32_t> places;
    for (const chart_placement& p : atlas.placements) places.push_back(p.x), places.push_back(p.y);
    return py::make_tuple(version_text(), atlas.geometry, copy_of(atlas.color), copy_of(places, 2), atlas.fill,
                          atlas.filter_padding);
}
inline std::shared_ptr<atlas_value> atlas_from(const py::tuple& state) {
    const py::tuple items = checked(state, 5);
    auto atlas = std::make_shared<atlas_value>();
    atlas->geometry = items[0].cast<geometry_id>();
    atlas->color = image_of<std::uint8_t>(items[1], 3, "atlas");
    const buffer<std::int32_t> places = column_of<std::int32_t>(items[2], 2, "placements");
    for (std::size_t i = 0; i < places.size(); i += 2) atlas->placements.push_back({places[i], places[i + 1]});
    atlas->fill = items[3].cast<float>();
    atlas->filter_padding = items[4].cast<std::int32_t>();
    if (atlas->filter_padding < 1 || atlas->filter_padding > max_filter_padding)
        raise(error_code::invalid_data, "pickle", "a filter_padding from 1 to " + std::to_string(max_filter_padding),
              std::to_string(atlas->filter_padding));
    return atlas;
}

inline py::tuple state_of(const mesh_value& mesh) {
    const soft_edge_strip& soft = mesh.soft_edges;
    buffer<std::uint32_t> hems;
    for (const hem_vertex& h : mesh.hem_vertices) hems.push_back(h.outer), hems.push_back(h.inner);
    return py::make_tuple(version_text(), mesh.geometry, copy_of(mesh.positions, 3), copy_of(mesh.texture_coordinates, 2),
                          copy_of(mesh.pixels), copy_of(mesh.triangles, 3), copy_of(soft.positions, 3),
                          copy_of(soft.texture_coordinates, 2), copy_of(soft.opacity), copy_of(soft.triangles, 3),
                          copy_of(hems, 2));
}
inline std::shared_ptr<mesh_value> mesh_from(const py::tuple& state) {
    const py::tuple items = checked(state, 10);
    auto mesh = std::make_shared<mesh_value>();
    mesh->geometry = items[0].cast<geometry_id>();
    mesh->positions = column_of<float>(items[1], 3, "positions");
    mesh->texture_coordinates = column_of<float>(items[2], 2, "texture_coordinates");
    mesh->pixels = column_of<std::int32_t>(items[3], 1, "pixels");
    mesh->triangles = column_of<std::uint32_t>(items[4], 3, "triangles");
    mesh->soft_edges = {column_of<float>(items[5], 3, "positions of soft edges"),
                        column_of<float>(items[6], 2, "texture_coordinates of soft edges"),
                        column_of<std::uint8_t>(items[7], 1, "opacity"),
                        column_of<std::uint32_t>(items[8], 3, "triangles of soft edges")};
    const buffer<std::uint32_t> hems = column_of<std::uint32_t>(items[9], 2, "hem_vertices");
    for (std::size_t i = 0; i < hems.size(); i += 2) mesh->hem_vertices.push_back({hems[i], hems[i + 1]});
    return mesh;
}

inline py::tuple state_of(const photo3d_value& made) {
    return py::make_tuple(version_text(), made.layers, made.charts, made.atlas, made.mesh);
}
inline std::shared_ptr<photo3d_value> photo3d_from(const py::tuple& state) {
    const py::tuple items = checked(state, 4);
    return join_parts(items[0].cast<std::shared_ptr<layers_value>>(), items[1].cast<std::shared_ptr<charts_value>>(),
                      items[2].cast<std::shared_ptr<atlas_value>>(), items[3].cast<std::shared_ptr<mesh_value>>());
}

}  // namespace ldi::python
