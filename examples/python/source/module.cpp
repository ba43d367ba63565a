// The Python module ldi._ldi. ldi/__init__.py makes the package of it, ldi/__init__.pyi says what it has.
#include "arrays.hpp"
#include "conversion.hpp"

#include <ldi/formats/farbrausch.hpp>
#include <ldi/formats/glb.hpp>
#include <ldi/formats/photo.hpp>
#include <ldi/formats/picture.hpp>
#include <ldi/formats/tiefenrausch.hpp>
#include <ldi/render/camera_paths.hpp>
#include <ldi/render/rasterizer.hpp>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace ldi::python {

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

arithmetic arithmetic_named(const std::string& name) {
    for (const arithmetic kind : {arithmetic::float32, arithmetic::int8})
        if (name == to_string(kind)) return kind;
    raise(error_code::invalid_option, "arithmetic", "float32 or int8", name);
}

/// A property that shows memory of an object: show(object, its value).
template <class Class, class Show>
void add_view(Class& to, const char* name, const char* meaning, Show show) {
    using type = typename Class::type;
    to.def_property_readonly(
        name, [show](const py::object& self) { return show(self, self.cast<const type&>()); }, meaning);
}

void add_layers(py::module_& module) {
    py::class_<photo_layers, std::shared_ptr<photo_layers>> layers(module, "Layers");
    const auto add = [&](const char* name, const char* meaning, buffer<std::int32_t> graph::*column) {
        add_view(layers, name, meaning,
                 [column](const py::object& self, const photo_layers& l) { return shown(self, l.topology.*column); });
    };
    add("x", "K, position on the lattice", &graph::x);
    add("y", "K", &graph::y);
    add("left", "K, index of the neighbor, -1 for none", &graph::left);
    add("right", "K", &graph::right);
    add("up", "K", &graph::up);
    add("down", "K", &graph::down);
    add_view(layers, "color", "K x 3",
             [](const py::object& self, const photo_layers& l) { return shown(self, l.column<color_column>(), 3); });
    add_view(layers, "disparity", "K, in [0, 1], larger is nearer",
             [](const py::object& self, const photo_layers& l) { return shown(self, l.column<disparity_column>()); });
    add_view(layers, "known", "K, 0 where a color was invented",
             [](const py::object& self, const photo_layers& l) { return shown(self, l.column<known_column>()); });
    layers.def("__len__", [](const photo_layers& l) { return l.size(); });
    layers.def_property_readonly("focal_length", [](const photo_layers& l) { return l.camera.focal_length; });
    layers.def_property_readonly("z_near", [](const photo_layers& l) { return l.range.z_near; });
    layers.def_property_readonly("z_far", [](const photo_layers& l) { return l.range.z_far; });
}

void add_curves_and_charts(py::module_& module) {
    static_assert(std::is_standard_layout_v<discontinuity> && offsetof(discontinuity, front) == sizeof(std::int32_t));
    py::class_<discontinuity_curve> curve(module, "Curve");
    add_view(curve, "sides", "N x 2, pixels of the front layer: the far one and the near one",
             [](const py::object& self, const discontinuity_curve& c) {
                 const std::int32_t* const first = c.sides.empty() ? nullptr : &c.sides.front().back;
                 return shown(self, first, {static_cast<py::ssize_t>(c.sides.size()), 2},
                              {sizeof(discontinuity), sizeof(std::int32_t)});
             });
    curve.def_readonly("is_closed", &discontinuity_curve::is_closed);

    py::class_<chart> one(module, "Chart");
    one.def_readonly("x", &chart::x)
        .def_readonly("y", &chart::y)
        .def_readonly("width", &chart::width)
        .def_readonly("height", &chart::height);
    add_view(one, "pixels", "indices in the layers",
             [](const py::object& self, const chart& c) { return shown(self, c.pixels); });
}

void add_mesh(py::module_& module) {
    py::class_<textured_mesh> mesh(module, "Mesh");
    add_view(mesh, "positions", "V x 3",
             [](const py::object& self, const textured_mesh& m) { return shown(self, m.positions, 3); });
    add_view(mesh, "texture_coordinates", "V x 2",
             [](const py::object& self, const textured_mesh& m) { return shown(self, m.texture_coordinates, 2); });
    add_view(mesh, "pixels", "V, a pixel of the layers",
             [](const py::object& self, const textured_mesh& m) { return shown(self, m.pixels); });
    add_view(mesh, "triangles", "F x 3",
             [](const py::object& self, const textured_mesh& m) { return shown(self, m.triangles, 3); });
}

py::bytes glb_of(const photo3d& made, int quality) {
    buffer<std::byte> glb;
    {
        const py::gil_scoped_release free;
        glb_options options;
        options.camera = made.layers.camera, options.motion = made.layers.motion, options.range = made.layers.range;
        glb = encode_glb(made.mesh, encode_jpeg(made.atlas.color, quality), options);
    }
    return {reinterpret_cast<const char*>(glb.data()), glb.size()};
}

py::array_t<std::uint8_t> render(const photo3d& made, std::array<float, 3> position, std::optional<std::array<float, 3>> target,
                                 std::optional<std::int32_t> width, std::int32_t samples) {
    rendering seen;
    {
        const py::gil_scoped_release free;
        view from;
        from.camera = made.layers.camera;
        if (width) {
            const float scale = static_cast<float>(*width) / static_cast<float>(from.camera.width);
            from.camera.height =
                std::max(1, static_cast<std::int32_t>(std::lround(scale * static_cast<float>(from.camera.height))));
            from.camera.width = *width, from.camera.focal_length *= scale;
        }
        if (target) from = look_at(from.camera, position, *target);
        from.position = position;
        raster_options options;
        options.samples = samples;
        options.z_near = 0.01F * made.layers.range.z_near;
        thread_pool threads;
        seen = rasterize(made.mesh, made.atlas.color, from, options, threads);
    }
    return given(std::move(seen.color));
}

void add_photo3d(py::module_& module) {
    py::class_<photo3d, std::shared_ptr<photo3d>> made(module, "Photo3D");
    add_view(made, "photo", "H x W x 3, as it was worked on",
             [](const py::object& self, const photo3d& p) { return shown(self, p.photo); });
    add_view(made, "estimated", "h x w", [](const py::object& self, const photo3d& p) { return shown(self, p.estimated); });
    add_view(made, "disparity", "H x W, cleaned",
             [](const py::object& self, const photo3d& p) { return shown(self, p.disparity); });
    add_view(made, "atlas", "the texture", [](const py::object& self, const photo3d& p) { return shown(self, p.atlas.color); });
    add_view(made, "chart_of", "K, each pixel's chart",
             [](const py::object& self, const photo3d& p) { return shown(self, p.charts.chart_of); });
    made.def_readonly("layers", &photo3d::layers);
    made.def_readonly("mesh", &photo3d::mesh);
    const auto list_of = [](const py::object& self, const auto& items) {
        py::list list;
        for (const auto& item : items) list.append(py::cast(item, py::return_value_policy::reference_internal, self));
        return list;
    };
    made.def_property_readonly("curves",
                               [=](const py::object& self) { return list_of(self, self.cast<const photo3d&>().curves); });
    made.def_property_readonly("charts",
                               [=](const py::object& self) { return list_of(self, self.cast<const photo3d&>().charts.charts); });
    made.def("glb", &glb_of, py::arg("quality") = 85);
    made.def("render", &render, py::arg("position") = std::array<float, 3>{0, 0, 0}, py::arg("target") = py::none(),
             py::arg("width") = py::none(), py::arg("samples") = 2);
}

void add_networks(py::module_& module) {
    py::class_<tiefenrausch, std::shared_ptr<tiefenrausch>>(module, "DepthNetwork")
        .def(py::init([](const py::bytes& weights, const std::string& name) {
                 return std::make_shared<tiefenrausch>(decode_tiefenrausch(bytes_of(std::string_view(weights)), name));
             }),
             py::arg("weights"), py::arg("name") = "weights");
    py::class_<farbrausch, std::shared_ptr<farbrausch>>(module, "InpaintingNetwork")
        .def(py::init([](const py::bytes& weights, const std::string& name, const std::string& computes_with) {
                 return std::make_shared<farbrausch>(
                     decode_farbrausch(bytes_of(std::string_view(weights)), name, arithmetic_named(computes_with)));
             }),
             py::arg("weights"), py::arg("name") = "weights", py::arg("arithmetic") = "float32");
}

void add_errors(py::module_& module) {
    static py::object type = py::exception<error>(module, "Error");  // as long as the interpreter
    py::register_exception_translator([](std::exception_ptr raised) {
        try {
            if (raised) std::rethrow_exception(raised);
        } catch (const error& e) {
            py::object made = type(e.what());
            const error_details& details = e.details();
            made.attr("code") = std::string(to_string(details.code));
            made.attr("where") = details.where, made.attr("expected") = details.expected, made.attr("found") = details.found;
            PyErr_SetObject(type.ptr(), made.ptr());
        }
    });
}

}  // namespace ldi::python

PYBIND11_MODULE(_ldi, module) {
    using namespace ldi::python;
    add_errors(module);
    add_layers(module);
    add_curves_and_charts(module);
    add_mesh(module);
    add_networks(module);
    add_photo3d(module);
    module.def(
        "photo3d",
        [](py::array_t<std::uint8_t> photo, std::optional<py::array_t<float>> depth, const ldi::tiefenrausch* depth_network,
           const ldi::farbrausch* inpainting_network, bool is_metric, bool is_inverse, std::size_t long_side, float focal_length,
           float motion, float grain, std::size_t threads, py::object progress) {
            ldi::photo3d_options options;
            options.long_side = long_side, options.focal_length_35mm = focal_length;
            options.expand.motion = motion, options.grain.strength = grain;
            return convert(std::move(photo), {std::move(depth), is_metric, is_inverse}, depth_network, inpainting_network,
                           options, threads, std::move(progress));
        },
        py::arg("photo").noconvert(), py::arg("depth"), py::arg("depth_network"), py::arg("inpainting_network"),
        py::arg("is_metric"), py::arg("is_inverse"), py::arg("long_side"), py::arg("focal_length"), py::arg("motion"),
        py::arg("grain"), py::arg("threads"), py::arg("progress"));
    module.def(
        "read_photo", [](const std::string& path) { return given(ldi::load_photo(path).color); }, py::arg("path"));
    module.def(
        "write_png",
        [](const std::string& path, py::array_t<std::uint8_t> picture) {
            const std::size_t channels = picture.ndim() == 3 ? static_cast<std::size_t>(picture.shape(2)) : 1;
            ldi::write_file(path, ldi::encode_png(ldi::image<std::uint8_t>(view_of(picture, channels, "picture"))));
        },
        py::arg("path"), py::arg("picture").noconvert());
}
