// Plans the memory accesses of a k x k convolution on a layered depth image. Most of an LDI consists of ordinary image rows.
// There, k pointers into memory describe a window. Planning explores windows link by link (core/window.hpp) only near
// silhouettes and borders. A plan depends only on the graph and the kernel size; all layers of a level share it.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/core/coarsening.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/level_map.hpp>
#include <ldi/core/validate.hpp>
#include <ldi/core/window.hpp>
#include <ldi/nn/ldi/detail/regular_pixels.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

class convolution_plan;

namespace detail {

/// A run of outputs of a plan.
struct plan_segment {
    std::int32_t first, count;
};

/// Writable contents of a plan. Planning and renumbering functions fill them.
struct plan_parts {
    std::int32_t kernel_size = 1, stride = 1;
    std::size_t input_count = 0;     ///< pixels of the graph
    std::size_t output_count = 0;    ///< pixels of the graph or, with stride 2, of the coarse graph
    buffer<plan_segment> segments;   ///< in ascending order of outputs
    buffer<std::int32_t> rows;       ///< segments x kernel_size: center pixels of window rows, as in rows_of()
    buffer<std::int32_t> irregular;  ///< outputs, ascending
    buffer<std::int32_t> windows;    ///< irregular x kernel_size x kernel_size: pixels, or no_pixel

    std::size_t k() const { return static_cast<std::size_t>(kernel_size); }
    std::size_t elements() const { return k() * k(); }
};

convolution_plan plan_of(plan_parts parts);
plan_parts parts_of(convolution_plan plan);

}  // namespace detail

/// A plan. Its outputs are the pixels of the graph or, with stride 2, of the coarse graph. Every output of a full plan belongs
/// to one segment or is irregular. restrict_to() omits outputs; convolutions do not compute omitted outputs. Plans are
/// immutable, so their pixel and output indices stay valid.
class convolution_plan {
public:
    /// A run of outputs first, first + 1, ... with ordinary windows. Row r of the window of output first + i consists of the
    /// kernel_size pixels centered at pixel `rows_of(s)[r] + stride * i`, where s is the index of the segment.
    using segment = detail::plan_segment;

    /// Makes a plan without inputs and outputs.
    convolution_plan() = default;
    convolution_plan(const convolution_plan&) = default;
    convolution_plan& operator=(const convolution_plan& other) { return *this = convolution_plan(other); }
    /// The moved-from plan is empty.
    convolution_plan(convolution_plan&& other) noexcept : parts_(std::exchange(other.parts_, {})) {}
    convolution_plan& operator=(convolution_plan&& other) noexcept {
        parts_ = std::exchange(other.parts_, {});
        return *this;
    }

    std::int32_t kernel_size() const { return parts_.kernel_size; }
    std::int32_t stride() const { return parts_.stride; }
    /// Number of pixels of the graph.
    std::size_t input_count() const { return parts_.input_count; }
    /// Number of pixels of the graph or, with stride 2, of the coarse graph.
    std::size_t output_count() const { return parts_.output_count; }
    /// Whether a convolution computes all outputs. Time is linear in the number of segments.
    bool is_full() const {
        std::size_t computed = parts_.irregular.size();
        for (const segment& s : parts_.segments) computed += static_cast<std::size_t>(s.count);
        return computed == output_count();
    }
    /// kernel_size() as std::size_t.
    std::size_t k() const { return parts_.k(); }
    /// Number of pixels per window.
    std::size_t elements() const { return parts_.elements(); }

    /// The segments, in ascending order of outputs.
    array_view<const segment> segments() const& { return parts_.segments; }
    array_view<const segment> segments() const&& = delete;  // the values would be destroyed with the plan
    /// The kernel_size rows of the window of a segment's first output, top to bottom, each identified by its center pixel.
    std::span<const std::int32_t> rows_of(std::size_t s) const& { return std::span(parts_.rows).subspan(s * k(), k()); }
    std::span<const std::int32_t> rows_of(std::size_t) const&& = delete;
    /// The irregular outputs, ascending.
    array_view<const std::int32_t> irregular() const& { return parts_.irregular; }
    array_view<const std::int32_t> irregular() const&& = delete;
    /// The window of the output irregular()[i], row by row; no_pixel where the window has no pixel.
    std::span<const std::int32_t> window_of(std::size_t i) const& {
        return std::span(parts_.windows).subspan(i * elements(), elements());
    }
    std::span<const std::int32_t> window_of(std::size_t) const&& = delete;
    /// The windows of all irregular outputs.
    array_view<const std::int32_t> windows() const& { return parts_.windows; }
    array_view<const std::int32_t> windows() const&& = delete;

    /// Memory that the plan has allocated, in bytes.
    std::size_t bytes() const {
        return parts_.segments.capacity() * sizeof(segment) +
               (parts_.rows.capacity() + parts_.irregular.capacity() + parts_.windows.capacity()) * sizeof(std::int32_t);
    }

private:
    friend convolution_plan detail::plan_of(detail::plan_parts parts);
    friend detail::plan_parts detail::parts_of(convolution_plan plan);

    explicit convolution_plan(detail::plan_parts parts) : parts_(std::move(parts)) {}

    detail::plan_parts parts_;
};

namespace detail {

inline convolution_plan plan_of(plan_parts parts) { return convolution_plan(std::move(parts)); }
inline plan_parts parts_of(convolution_plan plan) { return std::move(plan.parts_); }

/// Returns the view. Raises mismatch if an invariant of `graph` does not hold.
inline const graph_view& checked(const graph_view& g) {
    check_topology(g, "plan_convolution");
    return g;
}

inline void check_kernel_size(std::int32_t kernel_size) {
    if (kernel_size < 1 || kernel_size > max_kernel_size || kernel_size % 2 == 0)
        raise(error_code::invalid_option, "kernel_size", "an odd number from 1 to " + std::to_string(max_kernel_size),
              std::to_string(kernel_size));
}

/// Minimum number of outputs per segment. Outputs of shorter runs become irregular, so that the windows of several runs can
/// share the kernels' tiles.
inline constexpr std::int32_t min_segment = 4;

inline void add_segment(plan_parts& plan, plan_segment s, std::span<const std::int32_t> rows, std::int32_t shift) {
    plan.segments.push_back(s);
    for (const std::int32_t row : rows) plan.rows.push_back(row + shift);
}

/// Sets the windows of all irregular outputs. `center(output)` returns the center pixel of an output's window.
template <class Center>
void gather_windows(plan_parts& plan, const graph_view& g, Center&& center) {
    plan.windows.resize(plan.irregular.size() * plan.elements(), unset);
    for (std::size_t i = 0; i < plan.irregular.size(); ++i)
        gather_window(g, center(plan.irregular[i]), plan.kernel_size,
                      std::span(plan.windows).subspan(i * plan.elements(), plan.elements()));
}

inline convolution_plan plan_all(const graph_view& g, std::int32_t kernel_size, regular_pixels regular) {
    plan_parts plan;
    plan.kernel_size = kernel_size;
    plan.input_count = plan.output_count = g.size();
    regular.for_each_segment([&](std::int32_t first, std::int32_t count, std::span<const std::int32_t> rows) {
        if (count < min_segment) return false;
        add_segment(plan, {first, count}, rows, 0);
        return true;
    });
    plan.irregular = regular.others();
    gather_windows(plan, g, [](std::int32_t pixel) { return pixel; });
    return plan_of(std::move(plan));
}

inline convolution_plan plan_kept(const graph_view& g, std::int32_t kernel_size, const level_map& map, regular_pixels regular) {
    const auto refuse = [&](const std::string& found) {
        raise(error_code::mismatch, "plan_convolution", "the level_map that coarsen() returned for this graph", found);
    };
    const array_view<const std::int32_t> all_kept = map.kept(), parent = map.parent();
    if (parent.size() != g.size())
        refuse("the map of a graph of " + std::to_string(parent.size()) + " instead of " + std::to_string(g.size()) + " pixels");
    if (map.width() != g.width() || map.height() != g.height()) refuse("the map of a graph on a lattice of another size");
    plan_parts plan;
    plan.kernel_size = kernel_size, plan.stride = 2;
    plan.input_count = g.size(), plan.output_count = all_kept.size();
    regular.for_each_segment([&](std::int32_t first, std::int32_t count, std::span<const std::int32_t> rows) {
        if (g.y()[first] % 2 != 0) return true;
        const std::int32_t odd = g.x()[first] % 2, kept = (count - odd + 1) / 2;
        if (kept < min_segment) return false;
        // The kept pixels of a run are consecutive in the coarse graph.
        const std::int32_t output = parent[first + odd];
        if (output < 0 || output > all_kept.count() - kept || all_kept[output] != first + odd ||
            all_kept[output + kept - 1] != first + odd + 2 * (kept - 1))
            refuse("the map of another graph");
        add_segment(plan, {output, kept}, rows, odd);
        return true;
    });
    for (std::int32_t o = 0; o < all_kept.count(); ++o)
        if (!regular.contains(all_kept[o])) plan.irregular.push_back(o);
    gather_windows(plan, g, [&](std::int32_t output) { return all_kept[output]; });
    return plan_of(std::move(plan));
}

}  // namespace detail

/// Plans a convolution with stride 1. The pixels may have any order; the canonical order (core/canonical_order.hpp) is the
/// fastest.
///
/// kernel_size  odd, 1 to max_kernel_size
///
/// Raises invalid_option for any other kernel size.
inline convolution_plan plan_convolution(const graph& g, std::int32_t kernel_size) {
    detail::check_kernel_size(kernel_size);
    return detail::plan_all(g, kernel_size, detail::regular_pixels(g, kernel_size));
}
/// The same for a view of a graph. Even in release builds, raises mismatch if an invariant of `graph` does not hold.
inline convolution_plan plan_convolution(const graph_view& g, std::int32_t kernel_size) {
    detail::check_kernel_size(kernel_size);
    return detail::plan_all(g, kernel_size, detail::regular_pixels(detail::checked(g), kernel_size));
}

/// Plans a convolution with stride 2. Outputs are the pixels of the coarse graph.
///
/// kernel_size  odd, 1 to max_kernel_size
/// map          coarsened::map of the result of coarsen(g)
///
/// Raises invalid_option for any other kernel size. Raises mismatch if `map` belongs to a graph with a different number of pixels
/// or a different lattice size, or if its kept pixels do not match `g` in a run that becomes a segment.
inline convolution_plan plan_convolution(const graph& g, std::int32_t kernel_size, const level_map& map) {
    detail::check_kernel_size(kernel_size);
    return detail::plan_kept(g, kernel_size, map, detail::regular_pixels(g, kernel_size));
}
/// The same for a view of a graph. Even in release builds, raises mismatch if an invariant of `graph` does not hold.
inline convolution_plan plan_convolution(const graph_view& g, std::int32_t kernel_size, const level_map& map) {
    detail::check_kernel_size(kernel_size);
    return detail::plan_kept(g, kernel_size, map, detail::regular_pixels(detail::checked(g), kernel_size));
}

}}  // namespace ldi
