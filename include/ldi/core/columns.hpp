// Payload columns: the data of each pixel of a layered image. A tag type names a column and defines its values at pixels that
// stages add, at pixels of coarser levels, and at vertices of a mesh.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/config.hpp>
#include <ldi/base/error.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A column tag: a non-final class that states the scalar type and the number of scalars per pixel, at most 64 KiB per pixel.
/// Tags are never constructed. Up to three static functions compute the values of new pixels, coarser levels and vertices; a
/// default replaces each function that a tag lacks. A function with one of these names but the wrong signature does not compile.
///
///     struct material {
///         using scalar = std::uint8_t;
///         static constexpr std::size_t channels = 1;
///         // Value of one channel at a hidden pixel that continues the surface of a photo pixel. Default: ldi::copied.
///         static scalar new_pixel(scalar origin) { return ldi::copied(origin); }
///         // Values of a pixel at half resolution, from the values of its pixels at full resolution. Default: ldi::averaged.
///         static std::array<scalar, 1> coarser(ldi::pixel_values<scalar, 1> pixels) { return ldi::first_of(pixels); }
///         // Values of a vertex, from the one to four pixels of its surface around it. Default: ldi::averaged.
///         static std::array<scalar, 1> at_vertex(ldi::pixel_values<scalar, 1> pixels) { return ldi::first_of(pixels); }
///     };
template <class T>
concept payload_column = std::is_same_v<T, std::remove_cv_t<T>> && std::is_class_v<T> && !std::is_final_v<T> && requires {
    typename T::scalar;
    requires std::default_initializable<typename T::scalar> && std::copyable<typename T::scalar>;
    requires std::is_nothrow_move_constructible_v<typename T::scalar>;
    requires std::integral<std::remove_cv_t<decltype(T::channels)>>;
    requires(T::channels > 0 && T::channels <= 65536 && sizeof(typename T::scalar) * T::channels <= 65536);
};

/// Whether a column is one of `Columns`.
template <class Column, class... Columns>
concept one_of = (std::is_same_v<Column, Columns> || ...);

/// Rules for new pixels. copied() returns the value of the pixel whose surface the new pixel continues; zeroed() returns 0.
template <class Scalar>
constexpr Scalar copied(Scalar origin) {
    return origin;
}
template <class Scalar>
constexpr Scalar zeroed(Scalar) {
    return Scalar{};
}

/// All channels of one or more pixels. A rule receives all of them, so that it can renormalize a vector or let pixels vote. The
/// first pixel is the one that a coarser level keeps, or the vertex's own pixel (textured_mesh::pixels). All pixels have equal
/// weight.
template <class Scalar, std::size_t channels>
struct pixel_values {
    array_view<const Scalar> values;  ///< pixels x channels, row-major

    std::size_t size() const { return values.size() / channels; }
    const Scalar& operator()(std::size_t pixel, std::size_t channel = 0) const { return values[pixel * channels + channel]; }
};

/// Functions for the members `coarser` and `at_vertex` of a column. first_of() returns the values of the first pixel.
///
/// pixels  at least one
template <class Scalar, std::size_t channels>
std::array<Scalar, channels> first_of(pixel_values<Scalar, channels> pixels) {
    LDI_ASSERT(pixels.size() > 0);
    std::array<Scalar, channels> result{};
    for (std::size_t c = 0; c < channels; ++c) result[c] = pixels(0, c);
    return result;
}
/// Whether averaged() accepts the type. The mean of 64-bit identifiers, enumerators or strings has no meaning.
template <class Scalar>
concept averageable = !std::is_enum_v<Scalar> && (!std::is_integral_v<Scalar> || sizeof(Scalar) <= 4) && requires(Scalar s) {
    static_cast<double>(s);
    static_cast<Scalar>(1.0);
};

/// Returns the mean of each channel. For integers of up to 32 bits, rounds to the nearest integer, halves away from zero.
///
/// pixels  at least one
template <class Scalar, std::size_t channels>
std::array<Scalar, channels> averaged(pixel_values<Scalar, channels> pixels) {
    static_assert(averageable<Scalar>, "64-bit integers and enumerations need a rule of their own, such as first_of");
    LDI_ASSERT(pixels.size() > 0);
    std::array<Scalar, channels> result{};
    for (std::size_t c = 0; c < channels; ++c) {
        double sum = 0;
        for (std::size_t i = 0; i < pixels.size(); ++i) sum += static_cast<double>(pixels(i, c));
        const double mean = sum / static_cast<double>(pixels.size());
        result[c] = static_cast<Scalar>(std::is_integral_v<Scalar> ? std::round(mean) : mean);
    }
    return result;
}

namespace detail {

template <class...>
inline constexpr bool are_distinct = true;
template <class First, class... Rest>
inline constexpr bool are_distinct<First, Rest...> = !(std::is_same_v<First, Rest> || ...) && are_distinct<Rest...>;

template <payload_column Column>
using pixels_of = pixel_values<typename Column::scalar, Column::channels>;
template <payload_column Column>
using values_of = std::array<typename Column::scalar, Column::channels>;

/// Detects whether a tag has a member with the name of a rule, whatever its type. column_and_names inherits from the tag and
/// from rule_names. If the tag also has a member with this name, the name is ambiguous in column_and_names, and the concept
/// lacks_... is false.
struct rule_names {
    int new_pixel, coarser, at_vertex;
};
template <class Column>
struct column_and_names : Column, rule_names {};
template <class T>
concept lacks_new_pixel = requires {
    &T::new_pixel;
};
template <class T>
concept lacks_coarser = requires {
    &T::coarser;
};
template <class T>
concept lacks_at_vertex = requires {
    &T::at_vertex;
};

template <class Result, class Argument>
using rule = Result (*)(Argument);

/// Whether a tag has a rule with exactly the types of its column: the rule accepts the column's values, by value or const
/// reference, and returns values of the column. The ..._fits constants below are true for such a rule, and for a tag without the
/// rule. Without this check, the default would silently replace a rule with a wrong signature, and a rule for a smaller type
/// would silently truncate values.
template <class Column>
concept has_new_pixel = requires {
    static_cast<rule<typename Column::scalar, typename Column::scalar>>(&Column::new_pixel);
}
|| requires { static_cast<rule<typename Column::scalar, const typename Column::scalar&>>(&Column::new_pixel); };
template <class Column>
concept has_coarser = requires {
    static_cast<rule<values_of<Column>, pixels_of<Column>>>(&Column::coarser);
}
|| requires { static_cast<rule<values_of<Column>, const pixels_of<Column>&>>(&Column::coarser); };
template <class Column>
concept has_at_vertex = requires {
    static_cast<rule<values_of<Column>, pixels_of<Column>>>(&Column::at_vertex);
}
|| requires { static_cast<rule<values_of<Column>, const pixels_of<Column>&>>(&Column::at_vertex); };
template <class Column>
inline constexpr bool new_pixel_fits = has_new_pixel<Column> || lacks_new_pixel<column_and_names<Column>>;
template <class Column>
inline constexpr bool coarser_fits = has_coarser<Column> || lacks_coarser<column_and_names<Column>>;
template <class Column>
inline constexpr bool at_vertex_fits = has_at_vertex<Column> || lacks_at_vertex<column_and_names<Column>>;

/// Fails to compile unless all rules of a tag fit.
template <class Column>
constexpr bool check_rules() {
    static_assert(new_pixel_fits<Column>, "new_pixel() of a column tag accepts a scalar and returns a scalar");
    static_assert(coarser_fits<Column>, "coarser() of a column tag accepts pixel_values<scalar, channels> and returns an array");
    static_assert(at_vertex_fits<Column>,
                  "at_vertex() of a column tag accepts pixel_values<scalar, channels> and returns an array");
    return true;
}

template <payload_column Column>
typename Column::scalar new_pixel_value(typename Column::scalar origin) {
    static_assert(check_rules<Column>());
    if constexpr (has_new_pixel<Column>)
        return Column::new_pixel(origin);
    else
        return copied(origin);
}

template <payload_column Column>
values_of<Column> coarser_values(pixels_of<Column> pixels) {
    static_assert(check_rules<Column>());
    if constexpr (has_coarser<Column>)
        return Column::coarser(pixels);
    else
        return averaged(pixels);
}

}  // namespace detail

/// Combines the values of a mesh vertex's pixels with the column's rule `at_vertex`, or averages them.
template <payload_column Column>
std::array<typename Column::scalar, Column::channels> vertex_values(
    pixel_values<typename Column::scalar, Column::channels> pixels) {
    static_assert(detail::check_rules<Column>());
    if constexpr (detail::has_at_vertex<Column>)
        return Column::at_vertex(pixels);
    else
        return averaged(pixels);
}

namespace detail {

template <class Column, class Scalar, std::integral Index>
std::span<Scalar, Column::channels> pixel_scalars(array_view<Scalar> column, Index pixel) {
    LDI_ASSERT(static_cast<std::size_t>(pixel) < column.size() / Column::channels);
    return std::span<Scalar, Column::channels>(column.data() + static_cast<std::size_t>(pixel) * Column::channels,
                                               Column::channels);
}

/// Returns the number of scalars of a column. Raises too_large if they exceed the address space, which can happen on 32-bit
/// systems.
template <payload_column Column>
std::size_t scalar_count(std::size_t pixels) {
    constexpr std::size_t pixel_size = sizeof(typename Column::scalar) * Column::channels;
    if (pixels > static_cast<std::size_t>(PTRDIFF_MAX) / pixel_size) refuse_count(pixels, pixel_size);
    return pixels * Column::channels;
}

[[noreturn]] inline void refuse_column_length(std::size_t expected, std::size_t found) {
    raise(error_code::mismatch, "layered image", std::to_string(expected) + " scalars in a column", std::to_string(found));
}

}  // namespace detail

/// Red, green, blue as in the photo (sRGB), 0 to 255. The color of a pixel whose known_column is 0 is meaningless until it is
/// inpainted.
struct color_column {
    using scalar = std::uint8_t;
    static constexpr std::size_t channels = 3;
    static constexpr scalar new_pixel(scalar origin) { return zeroed(origin); }  // 0 until the pixel is inpainted
};

/// Color in 16 bits, 0 to 65535. lift(), the geometry stages, the network operators, gather() and the GLB writer accept it.
/// Inpainting, the atlas and the renderers use color_column. make_photo3d() keeps a caller's color16_column in addition to
/// color_column. Because nothing inpaints 16-bit colors, a hidden pixel keeps the color of the pixel whose surface it
/// continues.
struct color16_column {
    using scalar = std::uint16_t;
    static constexpr std::size_t channels = 3;
};

/// Disparity in [0, 1], larger is nearer; 0 is the farthest and 1 the nearest surface of the photo. Disparities of hidden
/// surfaces may be slightly below 0, because hidden surfaces continue behind other surfaces.
struct disparity_column {
    using scalar = float;
    static constexpr std::size_t channels = 1;
};

/// 1 if the photo shows the pixel's color, 0 if the color must be inpainted.
struct known_column {
    using scalar = std::uint8_t;
    static constexpr std::size_t channels = 1;
    static constexpr scalar new_pixel(scalar origin) { return zeroed(origin); }
    static std::array<scalar, 1> coarser(pixel_values<scalar, 1> pixels) {
        return {*std::min_element(pixels.values.begin(), pixels.values.end())};
    }
};

/// Alpha matte near silhouettes: the fraction of the photo's color that the nearer surface contributes, scaled to 0 to 255. 0
/// elsewhere.
struct matte_column {
    using scalar = std::uint8_t;
    static constexpr std::size_t channels = 1;
    static constexpr scalar new_pixel(scalar origin) { return zeroed(origin); }
};

/// A type with the given column: a layered_image, a layered_view or a single_layer.
template <class Layers, class Column>
concept has_column = requires {
    requires std::remove_cvref_t<Layers>::template has<Column>;
};

/// A type with all of the given columns.
template <class Layers, class... Columns>
concept has_columns = (has_column<Layers, Columns> && ...);

}}  // namespace ldi
