// Converts between images and xtensor types. as_tensor() maps an image's memory as a tensor, and view_of() views a tensor's
// memory as an image, both without a copy. make_image() evaluates any expression or NumPy array into an image. Requires xtensor
// 0.24; no other header of ldi requires xtensor. xtensor's lazy views cost ten times as much as loops over rows, so use them
// for work done once per image. If you use the single header of ldi, include the single header first.
#pragma once

#ifndef LDI_SINGLE_HEADER
#include <ldi/base/error.hpp>
#include <ldi/core/image.hpp>
#endif

#include <xtensor/xadapt.hpp>
#include <xtensor/xarray.hpp>
#include <xtensor/xtensor.hpp>

#include <array>
#include <cstddef>
#include <string>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Maps the image's own memory as an H x W x C tensor. The image must outlive the tensor and must not be assigned to.
template <class Scalar>
auto as_tensor(image<Scalar>& picture) {
    return xt::adapt(picture.data(), picture.size(), xt::no_ownership(),
                     std::array<std::size_t, 3>{picture.height(), picture.width(), picture.channels()});
}
template <class Scalar>
auto as_tensor(const image<Scalar>& picture) {
    return xt::adapt(picture.data(), picture.size(), xt::no_ownership(),
                     std::array<std::size_t, 3>{picture.height(), picture.width(), picture.channels()});
}

namespace detail {
template <class Expression>
std::array<std::size_t, 3> image_shape(const Expression& values) {
    const std::size_t dimensions = values.dimension();
    if (dimensions != 2 && dimensions != 3)
        raise(error_code::mismatch, "tensor", "H x W or H x W x C values", std::to_string(dimensions) + " dimensions");
    return {values.shape()[0], values.shape()[1], dimensions == 3 ? values.shape()[2] : 1};
}
}  // namespace detail

/// Views a tensor's own memory without a copy. Rows may have gaps between them, but not within them.
///
/// values  H x W or H x W x C; a container, a strided view of a container (xt::view(photo, xt::range(8, 72))), or a NumPy array;
///         must outlive the returned view
///
/// Raises mismatch unless the tensor has two or three dimensions and contiguous, row-major rows. make_image() accepts a tensor
/// of any layout, and copies it.
template <class Tensor>
auto view_of(Tensor& values) {
    using scalar = std::remove_pointer_t<decltype(values.data())>;
    const auto [height, width, channels] = detail::image_shape(values);
    const auto stride = [&](std::size_t dimension) { return static_cast<std::size_t>(values.strides()[dimension]); };
    const bool has_channels = values.dimension() == 3 && channels > 1;
    if ((width > 1 && stride(1) != channels) || (has_channels && stride(2) != 1) || (height > 1 && stride(0) < width * channels))
        raise(error_code::mismatch, "tensor", "contiguous rows in ascending order",
              "gaps in a row, another order, or reversed rows");
    return image_view<scalar>(values.data() + values.data_offset(), height, width, channels, height > 1 ? stride(0) : 0);
}

/// Evaluates an expression into an image. Raises mismatch unless the expression has two or three dimensions.
///
///     ldi::image<float> distance = ldi::make_image<float>(1.0F / (ldi::as_tensor(disparity) + 0.1F));
template <class Scalar, class Expression>
image<Scalar> make_image(const Expression& values) {
    const auto [height, width, channels] = detail::image_shape(values);
    image<Scalar> result(height, width, channels, unset);
    if (values.dimension() == 3)
        as_tensor(result) = xt::cast<Scalar>(values);
    else
        xt::adapt(result.data(), result.size(), xt::no_ownership(), std::array<std::size_t, 2>{height, width}) =
            xt::cast<Scalar>(values);
    return result;
}

}}  // namespace ldi
