// The Python module ldi._ldi: classes for ldi's results, and functions whose arguments ldi/_api.py has checked.
#include "arrays.hpp"
#include "outputs.hpp"
#include "pickles.hpp"
#include "stages.hpp"
#include "values.hpp"

#include <ldi/formats/farbrausch.hpp>
#include <ldi/formats/silhouettes.hpp>
#include <ldi/formats/tiefenrausch.hpp>
#include <ldi/io/photo.hpp>
#include <ldi/io/picture.hpp>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace ldi::python {

/// Adds a property that returns a view of an object's memory: the result of show(object, its value).
template <class Class, class Show>
void add_view(Class& to, const char* name, const char* meaning, Show show) {
    using type = typename Class::type;
    to.def_property_readonly(
        name, [show](const py::object& self) { return show(self, self.cast<const type&>()); }, meaning);
}

/// Returns a read-only array of int32 with copies of integers.
template <class Integers>
py::array_t<std::int32_t> read_only_copy(const Integers& integers) {
    py::array_t<std::int32_t> copy(static_cast<py::ssize_t>(integers.size()));
    std::copy(integers.begin(), integers.end(), copy.mutable_data());
    return array_over(copy, copy.data(), {copy.size()});
}

/// Returns a list of references that keep `owner` alive.
template <class Items>
py::list references(const py::object& owner, const Items& items) {
    py::list list;
    for (const auto& item : items) list.append(py::cast(item, py::return_value_policy::reference_internal, owner));
    return list;
}

template <class Class>
void add_pickle(Class& to, std::shared_ptr<typename Class::type> (*from)(const py::tuple&)) {
    using type = typename Class::type;
    to.def(py::pickle([](const type& value) { return state_of(value); }, [from](const py::tuple& state) { return from(state); }));
}

/// Adds the properties that Layer and Layers have in common: the columns of their pixels.
template <class Class>
void add_columns(Class& to) {
    using type = typename Class::type;
    const auto add = [&](const char* name, const char* meaning, array_view<const std::int32_t> (graph::*column)() const&) {
        add_view(to, name, meaning,
                 [column](const py::object& self, const type& v) { return array_over(self, (v.layers.topology().*column)()); });
    };
    const auto add_coordinate = [&](const char* name, const char* meaning,
                                    array_view<const lattice_coordinate> (graph::*column)() const&) {
        to.def_property_readonly(
            name, [column](const type& v) { return read_only_copy((v.layers.topology().*column)()); }, meaning);
    };
    add_coordinate("x", "K int32: column of each pixel's position in the photo, or in the photo and its margin, in a new array",
                   &graph::x);
    add_coordinate("y", "K int32: row of each pixel's position in the photo, or in the photo and its margin, in a new array",
                   &graph::y);
    add("left", "K int32: index of the left neighbor, -1 for none", &graph::left);
    add("right", "K int32: index of the right neighbor, -1 for none", &graph::right);
    add("up", "K int32: index of the neighbor above, -1 for none", &graph::up);
    add("down", "K int32: index of the neighbor below, -1 for none", &graph::down);
    add_view(to, "color", "K x 3 uint8: red, green, blue; undefined where known is 0, until these pixels are inpainted",
             [](const py::object& self, const type& v) { return array_over(self, v.layers.template column<color_column>(), 3); });
    add_view(to, "disparity", "K float32, in [0, 1], larger is nearer", [](const py::object& self, const type& v) {
        return array_over(self, v.layers.template column<disparity_column>());
    });
    add_view(to, "known", "K uint8: 1 where the color is the photo's, 0 where it is inpainted",
             [](const py::object& self, const type& v) { return array_over(self, v.layers.template column<known_column>()); });
    const auto add_fact = [&](const char* name, const char* meaning, auto read) {
        to.def_property_readonly(name, read, meaning);
    };
    add_fact("width", "width of the photo in pixels",
             [](const type& v) { return v.layers.topology().width() - 2 * margin_of(v); });
    add_fact("height", "height of the photo in pixels",
             [](const type& v) { return v.layers.topology().height() - 2 * margin_of(v); });
    add_fact("focal_length", "focal length of the photo's camera in pixels",
             [](const type& v) { return facts_of(v).camera.focal_length; });
    add_fact("z_near", "distance of disparity 1", [](const type& v) { return facts_of(v).range.z_near; });
    add_fact("z_far", "distance of disparity 0", [](const type& v) { return facts_of(v).range.z_far; });
    to.def(
        "__len__", [](const type& v) { return v.layers.size(); }, "number of pixels, K");
}

void add_depth(py::module_& module) {
    py::class_<depth_value, std::shared_ptr<depth_value>> depth(module, "Depth",
                                                                "A photo and its clean depth; clean_depth() makes it.");
    add_view(depth, "photo", "H x W x 3 uint8: the photo, no larger than long_side",
             [](const py::object& self, const depth_value& d) { return array_over(self, d.photo); });
    add_view(depth, "estimated", "h x w float32 in [0, 1]: disparity before it is cleaned",
             [](const py::object& self, const depth_value& d) { return array_over(self, d.estimated); });
    add_view(depth, "disparity", "H x W float32 in [0, 1], larger is nearer: clean disparity",
             [](const py::object& self, const depth_value& d) { return array_over(self, d.disparity); });
    depth.def_property_readonly(
        "z_near", [](const depth_value& d) { return d.range.z_near; }, "distance of disparity 1");
    depth.def_property_readonly(
        "z_far", [](const depth_value& d) { return d.range.z_far; }, "distance of disparity 0");
    add_pickle(depth, &depth_from);
}

void add_layers(py::module_& module) {
    static_assert(std::is_standard_layout_v<discontinuity> && offsetof(discontinuity, front) == sizeof(std::int32_t));
    py::class_<discontinuity_curve> curve(module, "Curve", "A curve along which depth jumps.");
    add_view(curve, "sides", "N x 2 int32: for each pixel side, the pixel behind it and the pixel in front, as y * width + x",
             [](const py::object& self, const discontinuity_curve& c) {
                 const std::int32_t* const first = c.sides.empty() ? nullptr : &c.sides.front().back;
                 return array_over(self, first, {static_cast<py::ssize_t>(c.sides.size()), 2},
                                   {sizeof(discontinuity), sizeof(std::int32_t)});
             });
    curve.def_readonly("is_closed", &discontinuity_curve::is_closed, "whether the curve ends where it begins");
    curve.def(
        "__len__", [](const discontinuity_curve& c) { return c.sides.size(); }, "number of pixel sides");

    py::class_<silhouettes_value, std::shared_ptr<silhouettes_value>>(module, "_Silhouettes");  // owns the curves
    py::class_<layer_value, std::shared_ptr<layer_value>> layer(
        module, "Layer", "The photo as a layered image of one layer, pixel (x, y) at index y * width + x; lift() makes it.");
    add_columns(layer);
    layer.def_property_readonly(
        "curves", [](const layer_value& l) { return references(py::cast(l.silhouettes), l.silhouettes->curves); },
        "the silhouettes, as a list of Curve");
    layer.def_property_readonly(
        "depth", [](const layer_value& l) { return l.silhouettes->depth; }, "the Depth that lift() turned into this Layer");
    add_pickle(layer, &layer_from);

    py::class_<layers_value, std::shared_ptr<layers_value>> layers(
        module, "Layers", "A layered depth image: the photo and the hidden surfaces behind it; expand() and inpaint() make it.");
    add_columns(layers);
    layers.def_property_readonly(
        "margin", [](const layers_value& v) { return v.margin; },
        "width in pixels of the area around the photo: (margin, margin) is the photo's top left pixel; 0 if surfaces end at its "
        "border");
    add_pickle(layers, &layers_from);
}

void add_charts(py::module_& module) {
    py::class_<chart> one(module, "Chart", "A part of the layers that the atlas contains as one piece.");
    one.def_readonly("x", &chart::x, "left end of its bounding box in the photo")
        .def_readonly("y", &chart::y, "top of its bounding box in the photo")
        .def_readonly("width", &chart::width, "width of its bounding box in pixels")
        .def_readonly("height", &chart::height, "height of its bounding box in pixels");
    one.def_property_readonly(
        "pixels", [](const chart& c) { return read_only_copy(c.pixels); },
        "N int32: indices of its pixels in the layers, ascending, in a new array");

    py::class_<charts_value, std::shared_ptr<charts_value>> charts(
        module, "Charts", "A partition of the layers into charts, a sequence of Chart; make_charts() makes it.");
    add_view(charts, "chart_of", "K int32: the chart that each pixel belongs to",
             [](const py::object& self, const charts_value& c) { return array_over(self, c.chart_of); });
    charts.def(
        "__len__", [](const charts_value& c) { return c.charts.size(); }, "number of charts");
    charts.def(
        "__getitem__",
        [](const charts_value& c, py::ssize_t i) -> const chart& {
            const auto count = static_cast<py::ssize_t>(c.charts.size());
            if (i < -count || i >= count) throw py::index_error("chart " + std::to_string(i) + " of " + std::to_string(count));
            return c.charts[i < 0 ? i + count : i];
        },
        py::return_value_policy::reference_internal, "one chart");
    add_pickle(charts, &charts_from);
}

void add_atlas_and_mesh(py::module_& module) {
    py::class_<atlas_value, std::shared_ptr<atlas_value>> atlas(module, "Atlas",
                                                                "All charts packed into one texture; make_atlas() makes it.");
    add_view(atlas, "color", "H x W x 3 uint8: the texture",
             [](const py::object& self, const atlas_value& a) { return array_over(self, a.color); });
    add_view(atlas, "placements", "one row per chart, int32: x and y of its bounding box in the texture",
             [](const py::object& self, const atlas_value& a) {
                 static_assert(sizeof(chart_placement) == 2 * sizeof(std::int32_t));
                 const std::int32_t* const first = a.placements.empty() ? nullptr : &a.placements.front().x;
                 return array_over(self, first, {static_cast<py::ssize_t>(a.placements.size()), 2});
             });
    atlas.def_property_readonly(
        "fill", [](const atlas_value& a) { return a.fill; }, "share of the texture that charts cover");
    add_pickle(atlas, &atlas_from);

    py::class_<mesh_value, std::shared_ptr<mesh_value>> mesh(module, "Mesh", "A textured triangle mesh; make_mesh() makes it.");
    add_view(mesh, "positions", "V x 3 float32: x right, y up, the photo's camera at the origin looking along -z",
             [](const py::object& self, const mesh_value& m) { return array_over(self, m.positions, 3); });
    add_view(mesh, "texture_coordinates", "V x 2 float32 in [0, 1]; (0, 0) is the top left corner of the atlas",
             [](const py::object& self, const mesh_value& m) { return array_over(self, m.texture_coordinates, 2); });
    add_view(mesh, "pixels", "V int32: the pixel of the layers that each vertex belongs to",
             [](const py::object& self, const mesh_value& m) { return array_over(self, m.pixels); });
    add_view(mesh, "triangles", "F x 3 uint32: vertices, counter-clockwise as seen from the photo's camera",
             [](const py::object& self, const mesh_value& m) { return array_over(self, m.triangles, 3); });
    add_pickle(mesh, &mesh_from);
}

/// Returns a part of a 3D photo. Raises TypeError for an object of another type.
template <class T>
std::shared_ptr<T> part(const py::object& object, const char* name, const char* type) {
    if (py::isinstance<T>(object)) return object.cast<std::shared_ptr<T>>();
    throw py::type_error(std::string(name) + ": expected ldi." + type + ", found " + type_name(object));
}

void add_photo3d(py::module_& module) {
    py::class_<photo3d_value, std::shared_ptr<photo3d_value>> made(
        module, "Photo3D",
        "A 3D photo and the result of each stage; photo3d() makes it, or Photo3D(layers, charts, atlas, mesh).");
    made.def(py::init([](const py::object& layers, const py::object& charts, const py::object& atlas, const py::object& mesh) {
                 return join_parts(part<layers_value>(layers, "layers", "Layers"), part<charts_value>(charts, "charts", "Charts"),
                                   part<atlas_value>(atlas, "atlas", "Atlas"), part<mesh_value>(mesh, "mesh", "Mesh"));
             }),
             py::arg("layers"), py::arg("charts"), py::arg("atlas"), py::arg("mesh"), "Joins the results of the stages.");
    const auto add = [&](const char* name, const char* meaning, auto part) { made.def_property_readonly(name, part, meaning); };
    const auto depth_of = [](const photo3d_value& p) { return p.layers->silhouettes->depth; };
    add("depth", "the photo and its depth, a Depth", depth_of);
    add("layers", "the layered depth image, a Layers", [](const photo3d_value& p) { return p.layers; });
    add("charts", "the charts of the layers, a Charts", [](const photo3d_value& p) { return p.charts; });
    add("atlas", "the texture, an Atlas", [](const photo3d_value& p) { return p.atlas; });
    add("mesh", "the mesh, a Mesh", [](const photo3d_value& p) { return p.mesh; });
    add("curves", "the silhouettes, as a list of Curve",
        [](const photo3d_value& p) { return references(py::cast(p.layers->silhouettes), p.layers->silhouettes->curves); });
    add("photo", "H x W x 3 uint8: the photo, no larger than long_side",
        [=](const photo3d_value& p) { return array_over(py::cast(depth_of(p)), depth_of(p)->photo); });
    add("disparity", "H x W float32 in [0, 1], larger is nearer: clean disparity",
        [=](const photo3d_value& p) { return array_over(py::cast(depth_of(p)), depth_of(p)->disparity); });
    add_pickle(made, &photo3d_from);
}

std::span<const std::byte> weights_of(const py::object& weights) {
    if (!py::isinstance<py::bytes>(weights)) throw py::type_error("weights: expected bytes, found " + type_name(weights));
    return std::as_bytes(std::span(std::string_view(py::reinterpret_borrow<py::bytes>(weights))));
}

arithmetic arithmetic_named(const std::string& name) {
    for (const arithmetic kind : {arithmetic::float32, arithmetic::int8})
        if (name == to_string(kind)) return kind;
    raise(error_code::invalid_option, "arithmetic", "float32 or int8", name);
}

void add_networks(py::module_& module) {
    py::class_<tiefenrausch, std::shared_ptr<tiefenrausch>>(
        module, "DepthNetwork", "A network that estimates depth from one photo; depth_network() reads it from a file.")
        .def(py::init([](const py::object& weights, const py::object& name) {
                 const auto bytes = weights_of(weights);
                 const std::string named = py::str(name);
                 const py::gil_scoped_release unlocked;
                 return std::make_shared<tiefenrausch>(decode_tiefenrausch(bytes, named));
             }),
             py::arg("weights"), py::arg("name") = "weights",
             "Reads the bytes of a safetensors file. Error messages refer to the file as `name`.");
    py::class_<farbrausch, std::shared_ptr<farbrausch>>(
        module, "InpaintingNetwork", "A network that colors hidden surfaces; inpainting_network() reads it from a file.")
        .def(py::init([](const py::object& weights, const py::object& name, const py::object& computes_with) {
                 const auto bytes = weights_of(weights);
                 const std::string named = py::str(name);
                 const arithmetic kind = arithmetic_named(py::str(computes_with));
                 const py::gil_scoped_release unlocked;
                 return std::make_shared<farbrausch>(decode_farbrausch(bytes, named, kind));
             }),
             py::arg("weights"), py::arg("name") = "weights", py::arg("arithmetic") = "float32",
             "Reads the bytes of a safetensors file. Error messages refer to the file as `name`.");
    py::class_<silhouette_network, std::shared_ptr<silhouette_network>>(
        module, "SilhouetteNetwork",
        "A network that decides which pixels beside a silhouette belong to the surface in front; silhouette_network() reads it "
        "from a file.")
        .def(py::init([](const py::object& weights, const py::object& name) {
                 const auto bytes = weights_of(weights);
                 const std::string named = py::str(name);
                 const py::gil_scoped_release unlocked;
                 return std::make_shared<silhouette_network>(decode_silhouettes(bytes, named));
             }),
             py::arg("weights"), py::arg("name") = "weights",
             "Reads the bytes of a safetensors file. Error messages refer to the file as `name`.");
}

void add_functions(py::module_& module) {
    module.attr("version") = version_text();
    module.def("photo3d",
               [](const py::object& photo, const py::object& depth, bool is_metric, bool is_inverse,
                  const py::object& silhouettes, const py::object& inpainter, std::size_t long_side, float focal_length,
                  float motion, bool grows, float texture, float grain, std::size_t threads, const py::object& progress) {
                   photo3d_options options;
                   options.long_side = long_side, options.focal_length_35mm = focal_length, options.expand.motion = motion;
                   options.frame = grows ? photo_frame::grow : photo_frame::crop;
                   options.texture.strength = texture, options.grain.strength = grain;
                   return convert(photo, depth, {is_metric, is_inverse}, silhouettes, inpainter, options, threads, progress);
               });
    module.def("clean_depth", [](const py::object& photo, const py::object& depth, bool is_metric, bool is_inverse,
                                 const py::object& silhouettes, std::size_t long_side, std::size_t threads) {
        photo3d_options options;
        options.long_side = long_side;
        return make_depth(photo, depth, {is_metric, is_inverse}, silhouettes, options, threads);
    });
    module.def("lift", &make_layer);
    module.def("expand", &make_layers);
    module.def("inpaint", &make_inpainted);
    module.def("grow_past_frame", &make_past_frame);
    module.def("make_charts", &make_chart_set);
    module.def("make_atlas", &make_texture_atlas);
    module.def("make_mesh", &make_textured_mesh);
    module.def("estimate", &estimate);
    module.def("inpaint_colors", &inpaint_colors);
    module.def("glb", &glb_of);
    module.def("html", &page_of);
    module.def("render", &render);
    module.def("read_photo", [](const std::filesystem::path& path) {
        ldi::photo photo;
        {
            const py::gil_scoped_release unlocked;
            photo = load_photo(path);
        }
        return array_of(std::move(photo.color));
    });
    module.def("write_png", [](const std::filesystem::path& path, const py::object& object) {
        const std::string expected = "H x W or H x W x 3 values of uint8";
        py::array_t<std::uint8_t> array = bytes_of(object, "picture", expected);
        const image<std::uint8_t> picture(view_of(array, array.ndim() == 3 && array.shape(2) == 3 ? 3 : 1, "picture", expected));
        const py::gil_scoped_release unlocked;
        save_png(path, picture);
    });
}

/// Decodes the text of a message, which may contain a path that is not UTF-8.
py::str text(const std::string& bytes) {
    return py::reinterpret_steal<py::str>(
        PyUnicode_DecodeUTF8(bytes.data(), static_cast<py::ssize_t>(bytes.size()), "backslashreplace"));
}

/// Translates ldi::error to ldi.InputError or ldi.FileError, which ldi/_errors.py defines.
void add_errors() {
    py::register_exception_translator([](std::exception_ptr raised) {
        try {
            if (raised) std::rethrow_exception(raised);
        } catch (const error& e) {
            const error_details& d = e.details();
            if (d.code == error_code::out_of_memory) {
                PyErr_NoMemory();
                return;
            }
            const bool is_file = d.code == error_code::file_access || d.code == error_code::unavailable;
            const py::object type = py::module_::import("ldi._errors").attr(is_file ? "FileError" : "InputError");
            PyErr_SetObject(type.ptr(),
                            type(std::string(to_string(d.code)), text(d.where), text(d.expected), text(d.found)).ptr());
        }
    });
}

}  // namespace ldi::python

PYBIND11_MODULE(_ldi, module) {
    using namespace ldi::python;
    py::options options;
    options.disable_function_signatures();
    add_errors();
    add_depth(module);
    add_layers(module);
    add_charts(module);
    add_atlas_and_mesh(module);
    add_photo3d(module);
    add_networks(module);
    add_functions(module);
}
