// Row-major images, H x W x C, channels last. An image is an xtensor container, so it reads from and writes to NumPy, slices and
// prints like one; loops go through row(), because lazy views cost ten times as much.
#pragma once

#include <xtensor/xtensor.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi {

/// H x W x C, row-major. `image(y, x, c)` addresses a value.
template <class Scalar>
using image = xt::xtensor<Scalar, 3, xt::layout_type::row_major>;

/// An image of the given size. Its values are not set.
template <class Scalar>
image<Scalar> make_image(std::size_t height, std::size_t width, std::size_t channels = 1) {
    return image<Scalar>::from_shape({height, width, channels});
}

/// An image of the given size with every value set to `value`.
template <class Scalar>
image<Scalar> make_image(std::size_t height, std::size_t width, std::size_t channels, Scalar value) {
    image<Scalar> result = make_image<Scalar>(height, width, channels);
    result.fill(value);
    return result;
}

template <class Scalar>
std::size_t height(const image<Scalar>& i) {
    return i.shape(0);
}

template <class Scalar>
std::size_t width(const image<Scalar>& i) {
    return i.shape(1);
}

template <class Scalar>
std::size_t channels(const image<Scalar>& i) {
    return i.shape(2);
}

/// The W x C values of row y, contiguous.
template <class Scalar>
Scalar* row(image<Scalar>& i, std::size_t y) {
    return i.data() + y * width(i) * channels(i);
}

template <class Scalar>
const Scalar* row(const image<Scalar>& i, std::size_t y) {
    return i.data() + y * width(i) * channels(i);
}

}  // namespace ldi
