// Interfaces of the objects that the caller passes to make_photo3d() (photo3d.hpp): sources of depth, silhouettes, and colors
// of hidden surfaces.
#pragma once

#include <ldi/base/executor.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/image.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/depth/decided_depth.hpp>
#include <ldi/inpaint/uncertain_rims.hpp>

#include <concepts>
#include <cstdint>
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
                                   const serial_executor& threads) {
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
    image<float> disparity(image_view<const std::uint8_t>, const progress_listener&, Executor&&) const& {
        return map;
    }
    template <executor Executor>
    image<float> disparity(image_view<const std::uint8_t>, const progress_listener&, Executor&&) && {
        return std::move(map);
    }
    float quantization_step() const { return 1.0F; }
};

}}  // namespace ldi
