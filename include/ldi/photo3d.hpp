// Converts a photo to a 3D photo: calls every stage in the paper's order with the paper's defaults. Stages beyond the paper
// sharpen depth edges (depth/sharpen_edges.hpp), align silhouettes with the photo's edges, unmix the colors beside them, add
// texture to hidden surfaces (inpaint/), and soften silhouettes (mesh/soft_edges.hpp). Each stage is a separate function in the
// headers below. Call these functions to run some stages only, or to insert your own.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/core/camera.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/photo_facts.hpp>
#include <ldi/depth/decided_depth.hpp>
#include <ldi/depth/middle_components.hpp>
#include <ldi/depth/normalize.hpp>
#include <ldi/depth/resample.hpp>
#include <ldi/depth/sharpen_edges.hpp>
#include <ldi/depth/weighted_median.hpp>
#include <ldi/inpaint/grain.hpp>
#include <ldi/inpaint/mixed_colors.hpp>
#include <ldi/inpaint/texture_transfer.hpp>
#include <ldi/inpaint/uncertain_rims.hpp>
#include <ldi/kernels/area_resize.hpp>
#include <ldi/mesh/build_mesh.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>
#include <ldi/occlusion/expand.hpp>
#include <ldi/occlusion/lift.hpp>
#include <ldi/occlusion/past_frame.hpp>
#include <ldi/occlusion/spurious_discontinuities.hpp>
#include <ldi/texture/atlas.hpp>
#include <ldi/texture/sheets.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <tuple>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// A source of depth. `disparity(photo, progress, threads)` accepts the photo, H x W x 3, and returns a map h x w x 1 of any
/// size, larger is nearer. `quantization_step()` returns the ratio of two adjacent quantization levels of that map, or 1 if the
/// map is not quantized. Examples: `tiefenrausch`, `given_disparity`.
template <class T>
concept depth_estimator = requires(const T& t, image_view<const std::uint8_t> photo, const progress_listener& progress,
                                   const serial_executor& threads) {
    { t.disparity(photo, progress, threads) } -> std::same_as<image<float>>;
    { t.quantization_step() } -> std::convertible_to<float>;
};

/// Layered image of a photo inside make_photo3d(), with the caller's columns.
template <payload_column... Own>
using working_layers = layered_image<color_column, disparity_column, known_column, matte_column, rim_column, Own...>;

/// A source of colors. `inpaint(layers, progress, threads)`, a template over layers with at least color_column, disparity_column
/// and known_column, sets the color of every pixel whose known_column is 0 and changes nothing else. Example:
/// `diffusion_inpainter`.
template <class T>
concept color_inpainter = requires(const T& t, working_layers<>& layers, const progress_listener& progress,
                                   serial_executor& threads) {
    t.inpaint(layers, progress, threads);
};

/// Decides where silhouettes lie. `decide(depth, threads)` accepts an undecided_depth (depth/decided_depth.hpp) and returns a
/// decided_depth of the same size. Examples: `network_decider` (depth/network_decider.hpp), `aligned_silhouettes`.
template <class T>
concept silhouette_decider = requires(const T& t, undecided_depth depth, const serial_executor& threads) {
    { t.decide(std::move(depth), threads) } -> std::same_as<decided_depth>;
};

/// An existing disparity map, for example from a phone or a file.
struct given_disparity {
    /// h x w x 1, finite, larger is nearer. With normalize_options::is_inverse_depth, the default, values are 0 or more, and 0
    /// is infinitely far, such as the sky. If 0 means unknown, fill these pixels first, for example with fill_invalid() of
    /// io/depth_map.hpp.
    image<float> map;

    template <executor Executor>
    image<float> disparity(image_view<const std::uint8_t>, const progress_listener&, Executor&&) const {
        return map;
    }
    float quantization_step() const { return 1.0F; }
};

/// Options of make_photo3d() and its stages. Lengths and sizes in `alignment`, `components` and `curves` are in pixels, for a
/// depth map at the photo's resolution. If one depth sample covers several pixels, make_photo3d() multiplies lengths by the
/// sample's side and sizes by its area.
struct photo3d_options {
    /// Maximum long side in pixels; a larger photo is shrunk to it.
    std::size_t long_side = 1536;
    /// 35 mm equivalent focal length of the photo. The default is a phone's main camera.
    float focal_length_35mm = 26.0F;
    /// Number of weighted median passes at the estimator's own resolution, where a blurred edge is only a few samples wide,
    /// before the pass at the photo's resolution.
    int passes_before_resampling = 2;
    surface_rule surface;
    normalize_options normalize;
    sharpen_options sharpen;
    resample_options resample;
    weighted_median_options median;
    alignment_options alignment;
    middle_component_options components;
    mixed_color_options mixed_colors;
    curve_options curves;
    expand_options expand;
    /// Whether surfaces continue past the photo's border, as far as `expand.motion` uncovers them.
    photo_frame frame = photo_frame::grow;
    texture_options texture;
    grain_options grain;
    chart_options charts;
    atlas_options atlas;
    mesh_options mesh;
    /// Whether the result contains `resampled` and `disparity`. Without them, converting needs 8 bytes less per pixel.
    bool keeps_depth_maps = true;
    /// Receives the progress of each stage under its name in the paper's table: "depth estimation", "depth filter", "connected
    /// components", "occluded geometry", "color inpainting", "chart generation", "chart padding", "meshing". Each stage begins
    /// with fraction 0 and ends with 1.
    progress_listener progress;
};

/// The caller's own columns for make_photo3d(), one image per column.
///
///     struct material { using scalar = std::uint8_t; static constexpr std::size_t channels = 1; };
///     photo_columns<material>{materials}
template <payload_column... Own>
struct photo_columns {
    /// h x w x channels each, in the order of the tags. An image whose size differs from the layers' is sampled at the nearest
    /// pixel.
    std::tuple<image_view<const typename Own::scalar>...> images;

    photo_columns(image_view<const typename Own::scalar>... own) : images(own...) {}
};

/// A 3D photo, and the results of all stages. `Own` are the caller's columns.
template <payload_column... Own>
struct basic_photo3d {
    image<std::uint8_t> photo;  ///< H x W x 3, at the size of the layered image
    image<float> estimated;     ///< h x w x 1, disparity in [0, 1] at the estimator's resolution
    image<float> resampled;     ///< H x W x 1, the estimate at the photo's resolution, before cleaning
    image<float> disparity;     ///< H x W x 1, cleaned disparity
    buffer<discontinuity_curve> curves;
    photo_facts facts;
    layered_image<color_column, disparity_column, known_column, matte_column, Own...> layers;
    chart_set charts;
    texture_atlas atlas;
    textured_mesh mesh;
};
using photo3d = basic_photo3d<>;

namespace detail {

/// Returns the length of a side after the photo's longer side is shrunk to at most `long_side` pixels.
inline std::size_t shrunk_length(std::size_t length, std::size_t longer, std::size_t long_side) {
    return std::max<std::size_t>((length * (std::min)(longer, long_side) + longer / 2) / longer, 1);
}

/// Shrinks the photo to a long side of at most `long_side` pixels.
template <executor Executor>
image<std::uint8_t> shrink_photo(image_view<const std::uint8_t> photo, std::size_t long_side, Executor& threads) {
    const std::size_t longer = (std::max)(photo.height(), photo.width());
    return area_resize(photo, shrunk_length(photo.height(), longer, long_side), shrunk_length(photo.width(), longer, long_side),
                       threads);
}

/// Returns the side of a sample of the estimate, in pixels, clamped to [1, 16]: coarser maps cannot locate silhouettes.
inline float sample_size(const image<float>& estimated, const image<std::uint8_t>& photo) {
    return std::clamp(nearest_float(photo.width()) / nearest_float(estimated.width()), 1.0F, 16.0F);
}

/// Scales lengths and numbers of pixels from a depth map at the photo's resolution to a map with larger samples.
template <std::integral Count>
Count scaled(Count count, float by) {
    return static_cast<Count>(std::lround(nearest_float(count) * by));
}
inline middle_component_options scaled(middle_component_options options, float sample_size) {
    options.min_size = scaled(options.min_size, sample_size * sample_size);
    return options;
}
inline curve_options scaled(curve_options options, float sample_size) {
    options.min_length = scaled(options.min_length, sample_size);
    options.tangent_length = scaled(options.tangent_length, sample_size);
    return options;
}
/// Returns the maximum error of silhouettes that remains after alignment, in pixels; 0 for a depth map at the photo's resolution.
inline int rim_width(const alignment_options& options, float sample_size) {
    return sample_size > 1.0F ? static_cast<int>(std::lround(options.uncertainty * sample_size)) : 0;
}

inline void check(const photo3d_options& options) {
    if (options.long_side == 0 || !(options.focal_length_35mm >= 1.0F && options.focal_length_35mm <= 1e5F))
        raise(error_code::invalid_option, "photo3d_options", "a long side of at least 1 and a focal length from 1 to 1e5",
              std::to_string(options.long_side) + " and " + to_text(options.focal_length_35mm));
    if (!(options.surface.max_step >= 0.001F && options.surface.max_step <= 1.0F))
        raise(error_code::invalid_option, "photo3d_options, surface", "a largest step from 0.001 to 1",
              to_text(options.surface.max_step));
}

inline void check_photo(image_view<const std::uint8_t> photo) {
    if (photo.empty() || photo.channels() != 3)
        raise(error_code::invalid_data, "photo", "H x W x 3 values, at least one pixel", shape_text(photo));
}

/// Resamples the estimate to the photo's resolution. Sharpens its edges first if its resolution is lower.
template <executor Executor>
image<float> resample_estimate(const image<float>& estimated, const image<std::uint8_t>& photo, const photo3d_options& options,
                               Executor& threads) {
    if (estimated.height() >= photo.height())
        return resample_to_photo(estimated, photo, options.surface, options.resample, threads);
    image<float> sharpened = sharpen_edges(estimated, options.surface, options.sharpen, threads);
    for (int pass = 0; pass < options.passes_before_resampling; ++pass)
        sharpened = weighted_median(sharpened, options.surface, options.median, threads);
    return resample_to_photo(sharpened, photo, options.surface, options.resample, threads);
}

}  // namespace detail

/// Limits the size of charts, so that they fit on sheets of a photo with `photo_height` x `photo_width` pixels
/// (texture/sheets.hpp). Raises too_large if the photo is too large for sheets, mismatch if it has no pixel or long_side is 0.
inline photo3d_options for_sheets(photo3d_options options, std::size_t photo_height, std::size_t photo_width,
                                  const sheet_options& sheets = {}) {
    if (photo_height == 0 || photo_width == 0 || options.long_side == 0)
        raise(error_code::mismatch, "for_sheets", "a photo with at least one pixel, a long side of at least 1",
              std::to_string(photo_height) + " x " + std::to_string(photo_width) + ", " + std::to_string(options.long_side));
    const std::size_t longer = (std::max)(photo_height, photo_width);
    double scale = 1;
    for (const std::size_t length : {photo_height, photo_width})
        scale = (std::max)(scale, detail::nearest_double(length) /
                                      detail::nearest_double(detail::shrunk_length(length, longer, options.long_side)));
    options.charts.max_side = (std::min)(options.charts.max_side, max_chart_side(scale, sheets));
    return options;
}

/// A photo at the size of its layered image, and its depth.
struct cleaned_photo {
    image<std::uint8_t> photo;   ///< H x W x 3, no larger than options.long_side
    image<float> estimated;      ///< h x w x 1, disparity in [0, 1] at the estimator's resolution
    image<float> resampled;      ///< H x W x 1, the estimate at the photo's resolution, before cleaning
    image<float> disparity;      ///< H x W x 1, cleaned disparity
    image<std::uint8_t> shares;  ///< share of the front surface; see decided_depth
    depth_range range;           ///< distances at disparity 1 and 0
};

/// Estimates and cleans the depth of a photo: the stages "depth estimation", "depth filter" and "connected components".
///
/// photo  H x W x 3, at least one pixel
///
/// Raises the errors of the stages. Before it estimates depth, raises error_code::invalid_data for a photo of another shape, and
/// error_code::invalid_option if long_side is 0, the focal length is not in [1, 1e5], or the surface rule's step is not in
/// [0.001, 1].
template <depth_estimator Estimator, silhouette_decider Decider, executor Executor = const serial_executor>
cleaned_photo clean_depth(image_view<const std::uint8_t> photo, const Estimator& estimator, const Decider& decider,
                          const photo3d_options& options = {}, Executor&& threads = {}) {
    const progress_listener& progress = options.progress;
    detail::check_photo(photo);
    detail::check(options);
    cleaned_photo result;
    progress.report("depth estimation", 0.0F);
    normalize_options normalize_with = options.normalize;
    normalize_with.relative_step =
        (std::max)(normalize_with.relative_step, static_cast<float>(estimator.quantization_step()) - 1.0F);
    normalized_disparity normalized = normalize(estimator.disparity(photo, progress, threads), normalize_with);
    result.estimated = std::move(normalized.disparity);
    result.range = normalized.range;
    result.photo = detail::shrink_photo(photo, options.long_side, threads);
    progress.report("depth estimation", 1.0F);

    progress.report("depth filter", 0.0F);
    result.resampled = detail::resample_estimate(result.estimated, result.photo, options, threads);
    const float sample_size = detail::sample_size(result.estimated, result.photo);
    decided_depth decided = decider.decide(
        {result.photo, result.estimated, weighted_median(result.resampled, options.surface, options.median, threads),
         options.surface, sample_size},
        threads);
    result.disparity = std::move(decided.disparity), result.shares = std::move(decided.shares);
    progress.report("depth filter", 1.0F);

    progress.report("connected components", 0.0F);
    merge_middle_components(result.disparity, options.surface, detail::scaled(options.components, sample_size));
    progress.report("connected components", 1.0F);
    return result;
}
/// Same as above, with aligned_silhouettes.
template <depth_estimator Estimator, executor Executor = const serial_executor>
cleaned_photo clean_depth(image_view<const std::uint8_t> photo, const Estimator& estimator, const photo3d_options& options = {},
                          Executor&& threads = {}) {
    return clean_depth(photo, estimator, aligned_silhouettes{options.alignment}, options, threads);
}

/// The layer of a photo, and its silhouettes.
template <payload_column... Own>
struct lifted_photo {
    /// Colors beside silhouettes are unmixed, or marked as unknown.
    single_layer<color_column, disparity_column, known_column, matte_column, rim_column, Own...> layer;
    buffer<discontinuity_curve> curves;
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
        raise(error_code::mismatch, "photo_columns", "an image of " + std::to_string(Column::channels) + " channels with pixels",
              shape_text(from));
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

/// Lifts a photo and prepares it for expand(). Raises the same errors for options as clean_depth(), and mismatch if an image of
/// `own` has no pixel or the wrong number of channels.
template <payload_column... Own, executor Executor = const serial_executor>
lifted_photo<Own...> lift_photo(const cleaned_photo& photo, const photo_columns<Own...>& own, const photo3d_options& options,
                                Executor&& threads = {}) {
    detail::check(options);
    const float sample_size = detail::sample_size(photo.estimated, photo.photo);
    const auto width = static_cast<std::int32_t>(photo.photo.width()), height = static_cast<std::int32_t>(photo.photo.height());
    lifted_photo<Own...> result;
    result.facts = {
        {width, height, focal_length_from_35mm(options.focal_length_35mm, width, height)}, photo.range, options.surface};
    photo_layer layer = lift(photo.photo, photo.disparity, result.facts, threads);
    buffer<std::int32_t> no_rims(layer.size(), 0);
    result.layer = std::apply(
        [&](const auto&... images) {
            return detail::with_columns<Own...>(std::move(layer).template with<rim_column>(std::move(no_rims)), images...);
        },
        own.images);
    result.curves = find_discontinuity_curves(result.layer, options.surface, detail::scaled(options.curves, sample_size));
    close_spurious_discontinuities(result.layer, result.curves);
    unmix_colors(result.layer, options.mixed_colors, {photo.shares.data(), photo.shares.size()});
    result.rims = mark_uncertain_rims(result.layer, detail::rim_width(options.alignment, sample_size));
    return result;
}
template <executor Executor = const serial_executor>
lifted_photo<> lift_photo(const cleaned_photo& photo, const photo3d_options& options = {}, Executor&& threads = {}) {
    return lift_photo(photo, photo_columns<>(), options, threads);
}

/// Colors the hidden surfaces, then restores the colors of the rims.
///
/// rims       from lift_photo()
/// inpainter  texture and grain are added to its result; set both strengths to 0 for an inpainter that makes its own texture
template <has_columns<color_column, disparity_column, known_column, rim_column> Layers, class Inpainter,
          executor Executor = const serial_executor>
void inpaint_hidden(Layers& layers, std::span<const uncertain_rim> rims, const Inpainter& inpainter,
                    const photo3d_options& options = {}, Executor&& threads = {}) {
    inpainter.inpaint(layers, options.progress, threads);
    add_texture(layers, options.texture, options.grain);
    restore_rims(layers, rims);
}

/// Makes a 3D photo of a photo whose depth is clean: the stages after clean_depth().
///
/// photo      result of clean_depth() with the same options
/// own        columns that accompany their pixels through all stages; gather() (mesh/gather.hpp) transfers them to the vertices
/// inpainter  as for inpaint_hidden()
///
/// Raises the errors of the stages.
template <color_inpainter Inpainter, payload_column... Own, executor Executor = const serial_executor>
basic_photo3d<Own...> make_photo3d(cleaned_photo photo, const photo_columns<Own...>& own, const Inpainter& inpainter,
                                   const photo3d_options& options = {}, Executor&& threads = {}) {
    const progress_listener& progress = options.progress;
    progress.report("occluded geometry", 0.0F);
    lifted_photo<Own...> lifted = lift_photo(photo, own, options, threads);
    if (!options.keeps_depth_maps) photo.resampled = {}, photo.disparity = {};
    basic_photo3d<Own...> result;
    result.photo = std::move(photo.photo), result.estimated = std::move(photo.estimated);
    result.resampled = std::move(photo.resampled), result.disparity = std::move(photo.disparity);
    result.curves = std::move(lifted.curves), result.facts = lifted.facts;
    auto [layers, motion] = expand(std::move(lifted.layer), options.surface, result.curves, options.expand, progress);
    result.facts.motion = motion;

    progress.report("color inpainting", 0.0F);
    inpaint_hidden(layers, lifted.rims, inpainter, options, threads);
    result.layers = decltype(result.layers)(std::move(layers));
    if (options.frame == photo_frame::grow) result.facts.margin = grow_past_frame(result.layers, result.facts);
    progress.report("color inpainting", 1.0F);

    progress.report("chart generation", 0.0F);
    result.charts = make_charts(result.layers, options.surface, options.charts);
    progress.report("chart generation", 1.0F);

    progress.report("chart padding", 0.0F);
    result.atlas = make_atlas(result.layers, result.charts, options.atlas, threads);
    progress.report("chart padding", 1.0F);

    progress.report("meshing", 0.0F);
    result.mesh = build_mesh(result.layers, result.facts, result.charts, result.atlas, options.mesh, threads);
    progress.report("meshing", 1.0F);
    return result;
}
/// Converts a photo to a 3D photo.
///
/// photo  H x W x 3, at least one pixel
///
/// Raises the errors of the stages. Memory and time are bounded for any depth map: each stage documents its bound, and
/// bench/photo3d/README.md has the peaks.
template <depth_estimator Estimator, silhouette_decider Decider, color_inpainter Inpainter, payload_column... Own,
          executor Executor = const serial_executor>
basic_photo3d<Own...> make_photo3d(image_view<const std::uint8_t> photo, const photo_columns<Own...>& own,
                                   const Estimator& estimator, const Decider& decider, const Inpainter& inpainter,
                                   const photo3d_options& options = {}, Executor&& threads = {}) {
    return make_photo3d(clean_depth(photo, estimator, decider, options, threads), own, inpainter, options, threads);
}
template <depth_estimator Estimator, silhouette_decider Decider, color_inpainter Inpainter,
          executor Executor = const serial_executor>
photo3d make_photo3d(image_view<const std::uint8_t> photo, const Estimator& estimator, const Decider& decider,
                     const Inpainter& inpainter, const photo3d_options& options = {}, Executor&& threads = {}) {
    return make_photo3d(photo, photo_columns<>(), estimator, decider, inpainter, options, threads);
}
/// Same as above, with aligned_silhouettes.
template <depth_estimator Estimator, color_inpainter Inpainter, payload_column... Own, executor Executor = const serial_executor>
basic_photo3d<Own...> make_photo3d(image_view<const std::uint8_t> photo, const photo_columns<Own...>& own,
                                   const Estimator& estimator, const Inpainter& inpainter, const photo3d_options& options = {},
                                   Executor&& threads = {}) {
    return make_photo3d(photo, own, estimator, aligned_silhouettes{options.alignment}, inpainter, options, threads);
}
template <depth_estimator Estimator, color_inpainter Inpainter, executor Executor = const serial_executor>
photo3d make_photo3d(image_view<const std::uint8_t> photo, const Estimator& estimator, const Inpainter& inpainter,
                     const photo3d_options& options = {}, Executor&& threads = {}) {
    return make_photo3d(photo, photo_columns<>(), estimator, inpainter, options, threads);
}

}}  // namespace ldi
