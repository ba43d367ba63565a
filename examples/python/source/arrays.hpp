// Converts between NumPy arrays and ldi's images and buffers without copies. For an argument of the wrong type or shape, an
// error states the expected and the actual ones.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/image.hpp>

#include <pybind11/numpy.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

namespace ldi::python {

namespace py = pybind11;

// From ldi to NumPy ----------------------------------------------------------------------------------------------------------

/// Returns a read-only array of values that `owner` keeps alive.
///
/// strides  in bytes; empty for values without gaps
template <class T>
py::array_t<T> array_over(const py::object& owner, const T* values, std::vector<py::ssize_t> shape,
                          std::vector<py::ssize_t> strides = {}) {
    py::array_t<T> array(std::move(shape), std::move(strides), values, owner);
    py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
    return array;
}

/// Returns an array of K values, or of K / columns x columns.
template <class T>
py::array_t<std::remove_const_t<T>> array_over(const py::object& owner, array_view<T> values, std::size_t columns = 1) {
    const auto rows = static_cast<py::ssize_t>(values.size() / columns);
    if (columns == 1) return array_over(owner, values.data(), {rows});
    return array_over(owner, values.data(), {rows, static_cast<py::ssize_t>(columns)});
}

template <class T>
py::array_t<T> array_over(const py::object& owner, const buffer<T>& values, std::size_t columns = 1) {
    return array_over(owner, array_view<const T>(values), columns);
}

template <class T>
std::vector<py::ssize_t> shape_of(const image<T>& picture) {
    std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(picture.height()), static_cast<py::ssize_t>(picture.width())};
    if (picture.channels() != 1) shape.push_back(static_cast<py::ssize_t>(picture.channels()));
    return shape;
}

/// Returns an array of H x W, or of H x W x C.
template <class T>
py::array_t<T> array_over(const py::object& owner, const image<T>& picture) {
    return array_over(owner, picture.data(), shape_of(picture));
}

/// Returns a writable array that owns the image.
template <class T>
py::array_t<T> array_of(image<T> picture) {
    auto* const kept = new image<T>(std::move(picture));
    const py::capsule owner(kept, [](void* owned) { delete static_cast<image<T>*>(owned); });
    return py::array_t<T>(shape_of(*kept), kept->data(), owner);
}

// From NumPy to ldi ----------------------------------------------------------------------------------------------------------

/// Returns shape and type as text, for example "96 x 128 x 3 values of uint8".
inline std::string description(const py::array& array) {
    std::string text;
    for (py::ssize_t axis = 0; axis < array.ndim(); ++axis) text += (axis == 0 ? "" : " x ") + std::to_string(array.shape(axis));
    return (array.ndim() == 0 ? "one value" : text + " values") + " of " + std::string(py::str(array.dtype()));
}

inline std::string type_name(const py::handle& object) { return py::str(py::type::of(object).attr("__name__")); }

/// Calls numpy.asarray() for an object. Raises TypeError unless the array has numbers of these kinds (numpy.dtype.kind).
inline py::array numbers_of(const py::handle& object, std::string_view kinds, const std::string& name,
                            const std::string& expected) {
    const py::array array = py::module_::import("numpy").attr("asarray")(object);
    if (kinds.find(array.dtype().kind()) != std::string_view::npos) return array;
    const std::string found = py::isinstance<py::array>(object) ? description(array) : type_name(object);
    throw py::type_error(name + ": expected " + expected + ", found " + found);
}

/// Same as numbers_of(), but the array must have the type uint8.
inline py::array_t<std::uint8_t> bytes_of(const py::handle& object, const std::string& name, const std::string& expected) {
    const py::array array = numbers_of(object, "u", name, expected);
    if (!py::isinstance<py::array_t<std::uint8_t>>(array))
        throw py::type_error(name + ": expected " + expected + ", found " + description(array));
    return array;
}

/// Views an array as pixels of `channels` values each. The array must outlive the view. Rows may have gaps. If the values of a
/// row are not contiguous, replaces the array with a copy. Raises mismatch.
template <class T>
image_view<const T> view_of(py::array_t<T>& array, std::size_t channels, const std::string& name, const std::string& expected) {
    const bool is_flat = channels == 1 && array.ndim() == 2;
    if (!is_flat && (array.ndim() != 3 || static_cast<std::size_t>(array.shape(2)) != channels))
        raise(error_code::mismatch, name, expected, description(array));
    if (array.size() == 0) raise(error_code::mismatch, name, "at least one pixel", description(array));
    const auto size = static_cast<py::ssize_t>(sizeof(T)), pixel = size * static_cast<py::ssize_t>(channels);
    const bool is_aligned = reinterpret_cast<std::uintptr_t>(array.data()) % alignof(T) == 0;
    const bool has_pixels =
        (is_flat || channels == 1 || array.strides(2) == size) && (array.shape(1) == 1 || array.strides(1) == pixel);
    const bool has_rows = array.shape(0) == 1 || (array.strides(0) >= array.shape(1) * pixel && array.strides(0) % size == 0);
    if (!is_aligned || !has_pixels || !has_rows) array = array.attr("copy")();
    const std::size_t stride = array.shape(0) == 1 ? 0 : static_cast<std::size_t>(array.strides(0) / size);
    return {array.data(), static_cast<std::size_t>(array.shape(0)), static_cast<std::size_t>(array.shape(1)), channels, stride};
}

/// Views an H x W x 3 photo of uint8. Copies the photo only if the pixels of a row are not contiguous. Raises TypeError,
/// mismatch.
class photo_argument {
public:
    photo_argument(const py::handle& object, const std::string& name)
        : array_(bytes_of(object, name, expected)), view_(view_of(array_, 3, name, expected)) {}
    photo_argument(const photo_argument&) = delete;
    photo_argument& operator=(const photo_argument&) = delete;

    const py::array& array() const { return array_; }
    image_view<const std::uint8_t> view() const { return view_; }

private:
    static constexpr const char* expected = "H x W x 3 values of uint8";

    py::array_t<std::uint8_t> array_;
    image_view<const std::uint8_t> view_;
};

/// Copies an h x w map of real numbers of any type. Raises TypeError, mismatch.
inline image<float> map_of(const py::handle& object, const std::string& name) {
    static constexpr const char* expected = "h x w real numbers";
    py::array_t<float> array = numbers_of(object, "fiu", name, expected);
    return image<float>(view_of(array, 1, name, expected));
}

/// Copies a column of a pickle. Raises invalid_data unless the column has N x `columns` values of type T.
template <class T>
buffer<T> column_of(const py::handle& object, std::size_t columns, const char* name) {
    const py::array array = py::array::ensure(object);
    const bool is_flat = array && columns == 1 && array.ndim() == 1;
    if (!array || !py::isinstance<py::array_t<T>>(array) ||
        !(is_flat || (array.ndim() == 2 && static_cast<std::size_t>(array.shape(1)) == columns)))
        raise(error_code::invalid_data, name,
              "N x " + std::to_string(columns) + " values of " + std::string(py::str(py::dtype::of<T>())),
              array ? description(array) : type_name(object));
    const auto packed = py::array_t<T, py::array::c_style | py::array::forcecast>::ensure(array);
    return buffer<T>(packed.data(), packed.data() + packed.size());
}

/// Copies an image of a pickle. Raises invalid_data or mismatch unless the image has H x W x `channels` values of type T.
template <class T>
image<T> image_of(const py::handle& object, std::size_t channels, const char* name) {
    py::array any = py::array::ensure(object);
    if (!any || !py::isinstance<py::array_t<T>>(any))
        raise(error_code::invalid_data, name, "values of " + std::string(py::str(py::dtype::of<T>())),
              any ? description(any) : type_name(object));
    py::array_t<T> array = any;
    return image<T>(view_of(array, channels, name, "H x W x " + std::to_string(channels) + " values"));
}

}  // namespace ldi::python
