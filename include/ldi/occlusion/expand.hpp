// Hallucinates occluded surfaces (paper, section "Occluded Surface Hallucination"). The back surface of every discontinuity grows
// behind the front surface, by one pixel per iteration along a whole curve, as far as the camera can uncover it.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/base/progress.hpp>
#include <ldi/core/columns.hpp>
#include <ldi/core/grown_pixels.hpp>
#include <ldi/core/layered_image.hpp>
#include <ldi/core/single_layer.hpp>
#include <ldi/core/surface.hpp>
#include <ldi/occlusion/detail/expansion.hpp>
#include <ldi/occlusion/detail/hidden_pixels.hpp>
#include <ldi/occlusion/discontinuity_curves.hpp>

#include <algorithm>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of expand().
struct expand_options {
    /// Maximum parallax between the nearest and the farthest surface, as a share of the photo's longer side, 0 to 1
    /// (render/motion.hpp). A step in disparity uncovers a proportional part of this parallax, and the surface behind the step
    /// grows by the uncovered distance. (The paper grows all surfaces by 50 pixels.)
    float motion = 0.08F;
    /// Maximum number of iterations, each of which grows all surfaces by one pixel. If this limit ends growth early, views within
    /// `motion` show gaps.
    int iterations = 4096;
    /// Maximum number of hidden pixels per pixel of the photo, 0 or more; growth ends after the iteration that reaches this
    /// number. 117 photographs and sensor depth maps need at most 1 with the default motion. Without the limit, maps of noise
    /// or of staircases would need 6.
    float max_hidden = 1.25F;
    /// Whether hidden surfaces behind different curves join where they meet at similar depth. If false, they pass each other; for
    /// comparison only.
    bool merges_curves = true;
};

/// A layered image with its hidden surfaces.
template <payload_column... Columns>
struct expanded_layers {
    layered_image<Columns...> layers;
    /// Camera motion for which the hidden surfaces suffice (photo_facts::motion): expand_options::motion, or less if
    /// expand_options::iterations or max_hidden ended growth early.
    float motion = 0.0F;
};

/// Adds the surfaces that a moving camera uncovers behind the curves of a layer.
///
/// layer    result of lift() after close_spurious_discontinuities()
/// surface  rule by which lift() linked the layer; raises mismatch for a rule under which a curve separates pixels of one
///          surface. expand() cannot detect a max_step smaller than lift()'s; hidden surfaces then join too rarely
/// curves   discontinuity curves of this layer; raises mismatch for curves of another layer
///
/// Raises invalid_data for disparities outside [-1, 1], and invalid_option for options outside their ranges or a max_step outside
/// [0.001, 1].
///
/// Returns the same image with hidden pixels added, in canonical order. The disparity of a new pixel is the average over the
/// pixels that it grew from. It is lower than the disparity of the photo's pixel at the same position by more than
/// surface_rule::max_step. All other columns follow their own rules (new_pixel in core/columns.hpp). New links join pixels whose
/// disparities differ by up to about twice the threshold, so that growing surfaces at similar depth become one. A surface that
/// meets another one at similar depth, but cannot be linked to it, ends there; build_mesh() closes the gap. The disparities of
/// two pixels at one position differ by more than surface_rule::max_step.
///
/// `after_iteration(graph, disparity, first_new)`, if given, receives a copy of all pixels after every iteration, for tests and
/// pictures. The pixels are in the order in which they were added; `first_new` is the index of the first hidden one.
///
/// At most about 1 / surface_rule::max_step surfaces exist at one position. Most photos need less than half a hidden pixel per
/// pixel of the photo; expand_options::max_hidden is the limit. The function runs in linear time in the number of pixels of the
/// result, and uses up to 110 bytes of memory per pixel.
template <payload_column... Columns, class AfterIteration = std::nullptr_t, executor Executor = const serial_executor>
expanded_layers<Columns...> expand(single_layer<Columns...> layer, surface_rule surface,
                                   std::span<const discontinuity_curve> curves, const expand_options& options = {},
                                   const progress_listener& progress = {}, AfterIteration&& after_iteration = nullptr,
                                   Executor&& threads = {}) {
    static_assert(has_columns<single_layer<Columns...>, disparity_column>);
    if (options.iterations < 0)
        raise(error_code::invalid_option, "expand_options::iterations", "0 or more", std::to_string(options.iterations));
    if (!(surface.max_step >= 0.001F && surface.max_step <= 1.0F))
        raise(error_code::invalid_option, "expand, surface", "a max_step from 0.001 to 1", detail::to_text(surface.max_step));
    for (const float d : layer.template column<disparity_column>())
        if (!(d >= -1.0F && d <= 1.0F)) raise(error_code::invalid_data, "expand", "disparities in [-1, 1]", detail::to_text(d));
    detail::check_curves(curves, layer.topology(), layer.template column<disparity_column>(), "expand");
    for (const discontinuity_curve& c : curves)
        for (const discontinuity& d : c.sides) {
            const auto disparity = layer.template column<disparity_column>();
            if (surface.same_surface(disparity[d.back], disparity[d.front]))
                raise(error_code::mismatch, "expand, surface", "the rule by which lift() linked the layer",
                      "a max_step of " + detail::to_text(surface.max_step));
        }
    if (!(options.max_hidden >= 0.0F))
        raise(error_code::invalid_option, "expand_options::max_hidden", "0 or more", detail::to_text(options.max_hidden));
    if (!(options.motion >= 0 && options.motion <= 1))
        raise(error_code::invalid_option, "expand_options::motion", "0 to 1", detail::to_text(options.motion));
    expanded_layers<Columns...> result{detail::expansion_access::layers_of(std::move(layer)), options.motion};
    layered_image<Columns...>& layers = result.layers;
    std::optional<detail::expansion> expansion;
    const array_view<const float> disparity = layers.template column<disparity_column>();
    const auto add_hidden = [&](graph_builder base) {
        expansion.emplace(std::move(base), disparity, surface, curves, options.motion, options.merges_curves);
        const int expected = expansion->expected_iterations();
        const double max_hidden = double{options.max_hidden} * detail::nearest_double(disparity.size());
        int done = 0;
        while (done < options.iterations && !expansion->is_finished(done) &&
               detail::nearest_double(expansion->pixels().hidden_count()) < max_hidden) {
            expansion->run_iteration(done++);
            if constexpr (!std::is_same_v<std::remove_cvref_t<AfterIteration>, std::nullptr_t>)
                expansion->pixels().show(after_iteration);
            progress.report("occluded geometry",
                            (std::min)(1.0F, detail::nearest_float(done) / detail::nearest_float(expected + 1)));
        }
        if (!expansion->is_finished(done))
            result.motion *= detail::nearest_float(done) / detail::nearest_float((std::max)(expected, done + 1));
        return expansion->merge(threads);
    };
    const buffer<grown_piece> pieces = layers.grow(add_hidden, threads);
    expansion->pixels().write_disparity(layers.template column<disparity_column>(), pieces);
    progress.report("occluded geometry", 1.0F);
    return result;
}

}}  // namespace ldi
