// ldi.photo3d(): from arrays to a 3D photo, with the interpreter free meanwhile.
#pragma once

#include "arrays.hpp"

#include <ldi/formats/depth_map.hpp>
#include <ldi/networks/farbrausch.hpp>
#include <ldi/networks/tiefenrausch.hpp>
#include <ldi/occlusion/diffusion_inpainter.hpp>
#include <ldi/photo3d.hpp>

#include <pybind11/pybind11.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>

namespace ldi::python {

/// Tells a Python function of progress, and ends the work where that or a signal raises.
class python_progress {
public:
    explicit python_progress(py::object function) : function_(std::move(function)) {}

    progress_listener listener() {
        progress_listener result;
        result.user = this;
        result.on_progress = [](void* self, std::string_view stage, float fraction) {
            static_cast<python_progress*>(self)->on_progress(stage, fraction);
        };
        result.is_canceled = [](void* self) { return static_cast<python_progress*>(self)->is_canceled(); };
        return result;
    }

    /// The exception that ended the work goes on its way.
    void rethrow() {
        if (raised_) throw py::error_already_set(std::move(*raised_));
    }

private:
    void on_progress(std::string_view stage, float fraction) {
        const py::gil_scoped_acquire lock;
        if (raised_ || function_.is_none()) return;
        try {
            function_(py::str(stage.data(), stage.size()), fraction);
        } catch (py::error_already_set& e) {
            raised_.emplace(std::move(e));
        }
    }
    bool is_canceled() {
        const py::gil_scoped_acquire lock;
        if (!raised_ && PyErr_CheckSignals() != 0) raised_.emplace();
        return raised_.has_value();
    }

    py::object function_;
    std::optional<py::error_already_set> raised_;
};

/// The depth that a caller gave.
struct depth_of_caller {
    std::optional<py::array_t<float>> values;  ///< h x w
    bool is_metric = false, is_inverse = false;
};

/// Disparity, with what is not known filled in. Raises mismatch, invalid_data.
inline given_disparity disparity_of(const image_view<const float>& values, const image_view<const std::uint8_t>& photo,
                                    bool is_metric) {
    image<float> map(values);
    for (float& value : std::span(map.data(), map.size())) {
        if (is_metric) value = value > 0 ? 1.0F / value : std::numeric_limits<float>::quiet_NaN();
        if (!std::isfinite(value)) value = std::numeric_limits<float>::quiet_NaN();
    }
    given_disparity result{fill_invalid(std::move(map), "depth")};
    check_fits(result.map, photo, "depth");
    return result;
}

/// depth_network, inpainting_network  null: depth is given; colors by diffusion
inline std::shared_ptr<photo3d> convert(py::array_t<std::uint8_t> photo, depth_of_caller depth, const tiefenrausch* depth_network,
                                        const farbrausch* inpainting_network, photo3d_options options, std::size_t thread_count,
                                        py::object progress) {
    const image_view<const std::uint8_t> seen = view_of(photo, 3, "photo");
    std::optional<image_view<const float>> map;
    if (depth.values) map = view_of(*depth.values, 1, "depth");
    if (!map && depth_network == nullptr) raise(error_code::invalid_option, "photo3d", "depth, or a depth network", "neither");
    python_progress reported(std::move(progress));
    options.progress = reported.listener();
    options.normalize.is_metric = map && depth.is_metric;
    options.normalize.is_inverse_depth = !map || depth.is_metric || depth.is_inverse;
    try {
        const py::gil_scoped_release free;
        thread_pool threads(thread_count);
        const auto with = [&](const auto& estimator) {
            return inpainting_network != nullptr ? make_photo3d(seen, estimator, *inpainting_network, options, threads)
                                                 : make_photo3d(seen, estimator, diffusion_inpainter(), options, threads);
        };
        return std::make_shared<photo3d>(map ? with(disparity_of(*map, seen, depth.is_metric)) : with(*depth_network));
    } catch (const error& e) {
        if (e.code() == error_code::canceled) reported.rethrow();
        throw;
    }
}

}  // namespace ldi::python
