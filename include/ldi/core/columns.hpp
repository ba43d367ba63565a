// Payload columns: what a pixel of a layered image holds. A tag type names a column and says how its values reach pixels that
// stages add, the pixels of coarser levels, and the vertices of a mesh.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/config.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A column tag: the scalar, and the number of scalars per pixel. Up to three static functions say how values travel. They are
/// called once per channel; the defaults hold where a tag has none.
///
///     struct material {
///         using scalar = std::uint8_t;
///         static constexpr std::size_t channels = 1;
///         // Value of a hidden pixel that continues the surface of a photo pixel. Default: ldi::copied.
///         static scalar new_pixel(scalar origin) { return ldi::copied(origin); }
///         // Value of a pixel at half resolution, from the values of its pixels at full resolution. Default: ldi::averaged.
///         static scalar coarser(ldi::array_view<const scalar> values) { return ldi::first_of(values); }
///         // Value of a vertex, from the one to four pixels of its surface around it. Default: ldi::averaged.
///         static scalar at_vertex(ldi::array_view<const scalar> values) { return ldi::first_of(values); }
///     };
template <class T>
concept payload_column = requires {
    typename T::scalar;
    { T::channels } -> std::convertible_to<std::size_t>;
};

/// Rules for new pixels.
template <class Scalar>
constexpr Scalar copied(Scalar origin) {
    return origin;
}
template <class Scalar>
constexpr Scalar zeroed(Scalar) {
    return Scalar{};
}

/// Rules for coarser levels and vertices. `values` has at least one element; the first is the kept pixel's, or the nearest one's.
template <class Scalar>
Scalar first_of(array_view<const Scalar> values) {
    return values[0];
}
/// The mean, rounded half away from zero for integers.
template <class Scalar>
Scalar averaged(array_view<const Scalar> values) {
    double sum = 0;
    for (const Scalar value : values) sum += static_cast<double>(value);
    const double mean = sum / static_cast<double>(values.size());
    if constexpr (std::is_integral_v<Scalar>)
        return static_cast<Scalar>(std::round(mean));
    else
        return static_cast<Scalar>(mean);
}

namespace detail {

template <payload_column Column>
typename Column::scalar new_pixel_value(typename Column::scalar origin) {
    if constexpr (requires { Column::new_pixel(origin); })
        return Column::new_pixel(origin);
    else
        return copied(origin);
}

template <payload_column Column>
typename Column::scalar coarser_value(array_view<const typename Column::scalar> values) {
    if constexpr (requires { Column::coarser(values); })
        return Column::coarser(values);
    else
        return averaged(values);
}

template <payload_column Column>
typename Column::scalar vertex_value(array_view<const typename Column::scalar> values) {
    if constexpr (requires { Column::at_vertex(values); })
        return Column::at_vertex(values);
    else
        return averaged(values);
}

}  // namespace detail

/// Red, green, blue as in the photo (sRGB), 0 to 255. Undefined where known_column is 0.
struct color_column {
    using scalar = std::uint8_t;
    static constexpr std::size_t channels = 3;
    static constexpr scalar new_pixel(scalar origin) { return zeroed(origin); }  // until it is inpainted
};

/// Disparity in [0, 1], larger is nearer; 0 is the farthest and 1 the nearest surface of the photo.
struct disparity_column {
    using scalar = float;
    static constexpr std::size_t channels = 1;
};

/// 1 where the photo shows the color, 0 where it must be inpainted.
struct known_column {
    using scalar = std::uint8_t;
    static constexpr std::size_t channels = 1;
    static constexpr scalar new_pixel(scalar origin) { return zeroed(origin); }
    static scalar coarser(array_view<const scalar> values) { return *std::min_element(values.begin(), values.end()); }
};

/// Near a silhouette: the share of the nearer surface in the photo's color, 0 to 255. 0 elsewhere.
struct matte_column {
    using scalar = std::uint8_t;
    static constexpr std::size_t channels = 1;
    static constexpr scalar new_pixel(scalar origin) { return zeroed(origin); }
};

}}  // namespace ldi
