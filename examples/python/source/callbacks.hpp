// Python functions as progress listener, depth estimator and inpainter. The library calls them on the thread that called it.
// Each call acquires the interpreter's lock, and an exception passes through the library unchanged.
#pragma once

#include "arrays.hpp"
#include "values.hpp"

#include <ldi/base/executor.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/inpaint/diffusion_inpainter.hpp>
#include <ldi/io/depth_map.hpp>
#include <ldi/networks/farbrausch.hpp>
#include <ldi/networks/tiefenrausch.hpp>

#include <pybind11/pybind11.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace ldi::python {

/// Reports progress to a Python function. Stops the work if the function or a signal handler raises an exception.
class python_progress {
public:
    /// function  None: no reports
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

    /// Raises the exception that stopped the work, if any.
    void rethrow() {
        if (raised_) throw py::error_already_set(std::move(*raised_));
    }

private:
    void on_progress(std::string_view stage, float fraction) {
        if (function_.is_none()) return;
        const py::gil_scoped_acquire lock;
        if (raised_) return;
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

/// Runs work(progress, threads) while other Python threads run.
///
/// function  receives the progress; None: no reports, but Ctrl-C stops the work
template <class Work>
auto run_unlocked(py::object function, std::size_t thread_count, const Work& work) {
    python_progress progress(std::move(function));
    try {
        const py::gil_scoped_release unlocked;
        thread_pool threads(thread_count);
        return work(progress.listener(), threads);
    } catch (const error& e) {
        if (e.code() == error_code::canceled) progress.rethrow();
        throw;
    }
}

/// The meaning of a depth map's values.
struct depth_meaning {
    bool is_metric = false, is_inverse = false;
};

/// A depth_estimator: a DepthNetwork, a map, or a Python function from a photo to a map.
class depth_source {
public:
    /// photo  argument for a Python function; must outlive this object
    depth_source(const py::object& depth, const photo_argument& photo, depth_meaning meaning)
        : source_(depth), photo_(photo), meaning_(meaning) {
        if (py::isinstance<tiefenrausch>(depth)) {
            network_ = depth.cast<const tiefenrausch*>();
            meaning_ = {false, true};
        } else if (PyCallable_Check(depth.ptr()) == 0) {
            map_ = map_of(depth, "depth");
        }
    }

    normalize_options normalization() const {
        normalize_options options;
        options.is_metric = meaning_.is_metric;
        options.is_inverse_depth = meaning_.is_metric || meaning_.is_inverse;
        return options;
    }

    template <executor Executor>
    image<float> disparity(image_view<const std::uint8_t> photo, const progress_listener& progress, Executor&& threads) const {
        if (network_ != nullptr) return network_->disparity(photo, progress, threads);
        image<float> map = map_ ? *map_ : ask();
        for (float& value : std::span(map.data(), map.size())) {
            if (meaning_.is_metric) value = value > 0 ? 1.0F / value : 0.0F;
            if (!std::isfinite(value) || (meaning_.is_metric && value == 0)) value = std::numeric_limits<float>::quiet_NaN();
        }
        map = fill_invalid(std::move(map), "depth");
        check_fits(map, photo, "depth");
        return map;
    }
    float quantization_step() const { return network_ != nullptr ? network_->quantization_step() : 1.0F; }

private:
    image<float> ask() const {
        const py::gil_scoped_acquire lock;
        return map_of(source_(photo_.array()), "depth(photo)");
    }

    const py::object& source_;
    const photo_argument& photo_;
    depth_meaning meaning_;
    const tiefenrausch* network_ = nullptr;
    std::optional<image<float>> map_;
};

/// A color_inpainter: an InpaintingNetwork, None for diffusion, or a Python function from Layers to their colors.
class color_source {
public:
    explicit color_source(const py::object& inpainter)
        : source_(inpainter),
          network_(py::isinstance<farbrausch>(inpainter) ? inpainter.cast<const farbrausch*>() : nullptr),
          is_diffusion_(inpainter.is_none()) {}

    template <executor Executor>
    void inpaint(working_layers<>& layers, const progress_listener& progress, Executor&& threads) const {
        if (network_ != nullptr)
            network_->inpaint(layers, progress, threads);
        else if (is_diffusion_)
            diffusion_inpainter().inpaint(layers, progress, threads);
        else
            ask(layers);
    }

private:
    void ask(working_layers<>& layers) const {
        const py::gil_scoped_acquire lock;
        const auto shown = std::make_shared<layers_value>();
        shown->layers = std::move(layers);
        const py::object result = source_(shown);
        // If the function has kept these layers, or arrays of them, the library continues with a copy.
        layers = shown.use_count() == 1 ? std::move(shown->layers) : shown->layers;
        set_colors(layers, result);
    }

    static void set_colors(working_layers<>& layers, const py::object& result) {
        const std::string name = "inpaint(layers)", expected = std::to_string(layers.size()) + " x 3 values of uint8";
        const py::array_t<std::uint8_t> array = bytes_of(result, name, expected);
        if (array.ndim() != 2 || static_cast<std::size_t>(array.shape(0)) != layers.size() || array.shape(1) != 3)
            raise(error_code::mismatch, name, expected, description(array));
        const auto colors = array.unchecked<2>();
        for (std::int32_t i = 0; i < layers.topology().count(); ++i)
            if (layers.column<known_column>()[i] == 0)
                for (std::size_t c = 0; c < 3; ++c) layers.at<color_column>(i)[c] = colors(i, static_cast<py::ssize_t>(c));
    }

    const py::object& source_;
    const farbrausch* network_;
    bool is_diffusion_;
};

}  // namespace ldi::python
