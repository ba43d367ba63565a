// Memory of ldi as NumPy sees it, and NumPy's as ldi does, without copies.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/image.hpp>

#include <pybind11/numpy.h>

#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace ldi::python {

namespace py = pybind11;

/// Values that `owner` keeps alive, read-only. strides in bytes; empty: values without gaps
template <class T>
py::array_t<T> shown(const py::object& owner, const T* values, std::vector<py::ssize_t> shape,
                     std::vector<py::ssize_t> strides = {}) {
    py::array_t<T> array(std::move(shape), std::move(strides), values, owner);
    py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
    return array;
}

/// K values, or K / columns x columns.
template <class T>
py::array_t<T> shown(const py::object& owner, const buffer<T>& values, std::size_t columns = 1) {
    const auto rows = static_cast<py::ssize_t>(values.size() / columns);
    if (columns == 1) return shown(owner, values.data(), {rows});
    return shown(owner, values.data(), {rows, static_cast<py::ssize_t>(columns)});
}

/// H x W, or H x W x C.
template <class T>
py::array_t<T> shown(const py::object& owner, const image<T>& picture) {
    const auto h = static_cast<py::ssize_t>(picture.height()), w = static_cast<py::ssize_t>(picture.width());
    if (picture.channels() == 1) return shown(owner, picture.data(), {h, w});
    return shown(owner, picture.data(), {h, w, static_cast<py::ssize_t>(picture.channels())});
}

/// An array that takes an image over.
template <class T>
py::array_t<T> given(image<T> picture) {
    auto* const kept = new image<T>(std::move(picture));
    const py::capsule owner(kept, [](void* image_of_array) { delete static_cast<image<T>*>(image_of_array); });
    const auto h = static_cast<py::ssize_t>(kept->height()), w = static_cast<py::ssize_t>(kept->width());
    std::vector<py::ssize_t> shape{h, w};
    if (kept->channels() > 1) shape.push_back(static_cast<py::ssize_t>(kept->channels()));
    return py::array_t<T>(shape, kept->data(), owner);
}

/// H x W x channels values of an array, which must outlive the view. Rows may have gaps; where a row has, the array is replaced
/// by a copy. Raises mismatch.
template <class T>
image_view<const T> view_of(py::array_t<T>& array, std::size_t channels, const char* name) {
    const bool is_flat = channels == 1 && array.ndim() == 2;
    if (!is_flat && (array.ndim() != 3 || static_cast<std::size_t>(array.shape(2)) != channels))
        raise(error_code::mismatch, name, channels == 1 ? "H x W values" : "H x W x 3 values",
              std::to_string(array.ndim()) + " dimensions" +
                  (array.ndim() == 3 ? ", the last of " + std::to_string(array.shape(2)) : std::string()));
    if (array.size() == 0) raise(error_code::mismatch, name, "at least one pixel", "none");
    const auto size = static_cast<py::ssize_t>(sizeof(T)), of_pixel = size * static_cast<py::ssize_t>(channels);
    const bool is_whole =
        (is_flat || channels == 1 || array.strides(2) == size) && (array.shape(1) == 1 || array.strides(1) == of_pixel);
    const bool has_rows = array.shape(0) == 1 || (array.strides(0) >= array.shape(1) * of_pixel && array.strides(0) % size == 0);
    if (!is_whole || !has_rows) array = py::array_t<T, py::array::c_style | py::array::forcecast>(array);
    const std::size_t stride = array.shape(0) == 1 ? 0 : static_cast<std::size_t>(array.strides(0) / size);
    return {array.data(), static_cast<std::size_t>(array.shape(0)), static_cast<std::size_t>(array.shape(1)), channels, stride};
}

}  // namespace ldi::python
