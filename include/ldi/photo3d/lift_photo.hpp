// The stages of make_photo3d() (photo3d.hpp) that turn the photo and its cleaned depth into a layer: lifting, discontinuity
// curves, and unmixing of colors.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/core/single_layer.hpp>
#include <ldi/inpaint/mixed_colors.hpp>
#include <ldi/inpaint/uncertain_rims.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/lift.hpp>
#include <ldi/occlusion/spurious_discontinuities.hpp>
#include <ldi/photo3d/clean_depth.hpp>
#include <ldi/photo3d/options.hpp>

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Views of the caller's own columns for make_photo3d(), one image per column. The images must outlive this object.
///
///     struct material { using scalar = std::uint8_t; static constexpr std::size_t channels = 1; };
///     photo_columns<material>{materials}
template <payload_column... Own>
struct photo_columns {
    /// h x w x channels each, in the order of the tags. An image whose size differs from the layers' is sampled at the nearest
    /// pixel.
    std::tuple<image_view<const typename Own::scalar>...> images;

    /// Accepts image views. Also accepts images and other types that convert to views, unless they are temporaries.
    template <class... Images>
    requires(sizeof...(Images) == sizeof...(Own) &&
             (std::convertible_to<Images, image_view<const typename Own::scalar>> && ...) &&
             ((std::is_lvalue_reference_v<Images> || is_image_view<std::remove_cv_t<Images>>)&&...))
        photo_columns(Images&&... own)
        : images(std::forward<Images>(own)...) {}
};

/// The layer of a photo, and its silhouettes.
template <payload_column... Own>
struct lifted_photo {
    /// Colors beside silhouettes are unmixed, or marked as unknown.
    single_layer<color_column, disparity_column, known_column, matte_column, rim_column, Own...> layer;
    buffer<discontinuity_curve> curves;
    std::size_t dropped_sides = 0;  ///< pixel sides in dropped silhouettes; see find_discontinuity_curves()
    photo_facts facts;
    buffer<uncertain_rim> rims;  ///< input of restore_rims(), which runs after the hidden surfaces are colored
};

namespace detail {

/// Returns an image as a column of `rows` x `columns` pixels, sampled at the nearest pixel. Raises mismatch if the image has no
/// pixel or the wrong number of channels.
template <payload_column Column>
buffer<typename Column::scalar> sampled_column(image_view<const typename Column::scalar> from, std::size_t rows,
                                               std::size_t columns) {
    if (from.height() == 0 || from.width() == 0 || from.channels() != Column::channels)
        raise(error_code::mismatch, "photo_columns",
              "H x W x " + std::to_string(Column::channels) + " values, at least one pixel", shape_text(from));
    buffer<typename Column::scalar> result;
    result.reserve(rows * columns * Column::channels);
    for (std::size_t y = 0; y < rows; ++y)
        for (std::size_t x = 0; x < columns; ++x) {
            const auto* pixel = from.row((2 * y + 1) * from.height() / (2 * rows)) +
                                (2 * x + 1) * from.width() / (2 * columns) * Column::channels;
            result.append(pixel, pixel + Column::channels);
        }
    return result;
}

/// Adds the caller's columns to a layer, one by one.
template <class Layer>
Layer with_columns(Layer layer) {
    return layer;
}
template <class Column, class... Rest, class Layer, class... Images>
auto with_columns(Layer layer, const image_view<const typename Column::scalar>& first, const Images&... rest) {
    const graph& g = layer.topology();
    buffer<typename Column::scalar> column =
        sampled_column<Column>(first, static_cast<std::size_t>(g.height()), static_cast<std::size_t>(g.width()));
    auto more = std::move(layer).template with<Column>(std::move(column));
    if constexpr (sizeof...(Rest) == 0)
        return more;
    else
        return with_columns<Rest...>(std::move(more), rest...);
}

}  // namespace detail

/// Lifts `photo`, the result of clean_depth() with the same options, and prepares it for expand(). `own` are the caller's
/// columns. If `photo.estimated` is empty, lengths in `options` are not scaled. Raises the same errors for options as
/// clean_depth(), and mismatch if an image of `own` has no pixel or the wrong number of channels.
template <payload_column... Own, executor Executor = const serial_executor>
lifted_photo<Own...> lift_photo(const cleaned_photo& photo, const photo_columns<Own...>& own, const photo3d_options& options,
                                Executor&& threads = {}) {
    detail::check(options);
    const float sample = sample_size(photo.estimated, photo.photo, options);
    const auto width = static_cast<std::int32_t>(photo.photo.width()), height = static_cast<std::int32_t>(photo.photo.height());
    lifted_photo<Own...> result;
    result.facts = {
        {width, height, focal_length_from_35mm(options.focal_length_35mm, width, height)}, photo.range, options.surface};
    photo_layer layer = lift(photo.photo, photo.disparity, result.facts, threads);
    buffer<std::uint8_t> no_rims(layer.size());
    result.layer = std::apply(
        [&](const auto&... images) {
            return detail::with_columns<Own...>(std::move(layer).template with<rim_column>(std::move(no_rims)), images...);
        },
        own.images);
    // Decided silhouettes follow the photo, so shorter curves and their directions are reliable. The factor was tuned by
    // experiment: with 0.6, closed curves left walls at large steps, which opened holes in one of forty photographs.
    constexpr float decided_curve_length = 0.4F;
    const float curve_scale = photo.shares.empty() ? sample : decided_curve_length * sample;
    result.curves =
        find_discontinuity_curves(result.layer, options.surface, scaled(options.curves, curve_scale), &result.dropped_sides);
    close_spurious_discontinuities(result.layer, result.curves);
    unmix_colors(result.layer, options.mixed_colors, {photo.shares.data(), photo.shares.size()}, threads);
    result.rims = mark_uncertain_rims(result.layer, detail::rim_width(options.alignment, sample));
    return result;
}
/// Same, without the caller's own columns.
template <executor Executor = const serial_executor>
lifted_photo<> lift_photo(const cleaned_photo& photo, const photo3d_options& options = {}, Executor&& threads = {}) {
    return lift_photo(photo, photo_columns<>(), options, threads);
}

}}  // namespace ldi
