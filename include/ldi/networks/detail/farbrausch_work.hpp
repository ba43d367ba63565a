// Plans the inpainting network's work on a layered image: the levels of detail, and the pixels of each level that the requested
// results depend on. Planning traces these dependencies backward through the network.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/core/coarsening.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/core/level_map.hpp>
#include <ldi/core/other_bytes.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>
#include <ldi/nn/ldi/convolution_planner.hpp>
#include <ldi/nn/ldi/pixel_subset.hpp>
#include <ldi/nn/ldi/restrict_plan.hpp>

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// A level of detail and the network's work on it.
struct farbrausch_level {
    std::size_t pixel_count = 0;      ///< pixels of the level's graph
    buffer<std::int32_t> above;       ///< parent of each pixel on the next coarser level, or no_pixel; empty on the last level
    convolution_plan average;         ///< 3 x 3 windows of all pixels
    convolution_plan average_coarse;  ///< 3 x 3 windows of the pixels that remain on the next level

    pixel_subset read;        ///< pixels at which the network reads its input (level 0) or the encoder's result
    pixel_subset decoded;     ///< pixels at which the decoder computes a result or, on the last level, reads the encoder's
    convolution_plan encode;  ///< encoder's convolution; its outputs are the pixels read on the next level
    convolution_plan decode;  ///< decoder's convolution; its outputs are this level's decoded pixels
};

/// Returns the parent of each read pixel, as its row among the next level's decoded pixels, or no_pixel.
inline buffer<std::int32_t> parents_of_read(const farbrausch_level& level, const pixel_subset& decoded_above) {
    buffer<std::int32_t> rows(level.read.size(), unset);
    level.read.for_each_run([&](std::int32_t first, std::int32_t count, std::int32_t row) {
        for (std::int32_t i = 0; i < count; ++i) {
            const std::int32_t parent = level.above[first + i];
            rows[row + i] = parent == no_pixel ? no_pixel : decoded_above.row_of(parent);
        }
    });
    return rows;
}

/// Plans a level's convolutions between this level and the next coarser one.
///
/// encode  set to the plan of the encoder's convolution, unless its kernel is 3 x 3: then level.average_coarse is this plan
inline void plan_transition(convolution_planner& planner, level_map map, std::int32_t kernel, farbrausch_level& level,
                            convolution_plan& encode) {
    level.average_coarse = planner.plan(3, map);
    if (kernel != 3) encode = planner.plan(kernel, map);
    level.above = std::move(map).take_parent();
}

/// Plans all levels, from the finest to the coarsest.
///
/// finest   level 0, a graph or graph_view in canonical order
/// kernels  sizes of the encoder's convolutions, one per level, at least one
/// wanted   one per pixel of `finest`, nonzero where the network's result is requested
template <class Graph, executor Executor = const serial_executor>
buffer<farbrausch_level> plan_farbrausch(const Graph& finest, std::span<const std::int32_t> kernels,
                                         std::span<const std::uint8_t> wanted, Executor&& threads = {}) {
    const std::size_t depth = kernels.size();
    buffer<farbrausch_level> levels(depth + 1);
    buffer<convolution_plan> encode(depth);
    levels[0].pixel_count = finest.size();
    std::optional<convolution_planner> planner;
    coarsened second;
    run_both(
        threads, [&] { levels[0].average = planner.emplace(finest).plan(3); }, [&] { second = coarsen(finest); });
    const auto finish_finest = [&] {
        plan_transition(*planner, std::move(second.map), kernels[0], levels[0], encode[0]);
        planner.reset();
    };
    const auto plan_others = [&] {
        graph coarse = std::move(second.topology);
        for (std::size_t i = 1; i <= depth; ++i) {
            levels[i].pixel_count = coarse.size();
            convolution_planner plans(coarse);
            levels[i].average = plans.plan(3);
            if (i == depth) break;
            coarsened next = coarsen(coarse);
            plan_transition(plans, std::move(next.map), kernels[i], levels[i], encode[i]);
            coarse = std::move(next.topology);
        }
    };
    run_both(threads, finish_finest, plan_others);

    // Traces the decoder in reverse order, from its final result to the coarsest level.
    buffer<buffer<std::uint8_t>> read_marks(depth);
    levels[0].decoded = pixel_subset::marked(wanted);
    for (std::size_t i = 0; i < depth; ++i) {
        farbrausch_level& level = levels[i];
        level.decode = restrict_to(level.average, level.decoded);
        read_marks[i].assign(level.pixel_count, 0);
        mark_needed_inputs(level.decode, read_marks[i]);
        buffer<std::uint8_t> above_marks(levels[i + 1].pixel_count, 0);
        for_each_other_byte(read_marks[i], 0, [&](std::int32_t pixel) {
            if (level.above[pixel] != no_pixel) above_marks[level.above[pixel]] = 1;
        });
        levels[i + 1].decoded = pixel_subset::marked(above_marks);
    }
    // Traces the encoder in reverse order, from the coarsest level to the finest. Both the decoder and the next encoder stage
    // read the result of an encoder stage.
    levels[depth].read = levels[depth].decoded;
    for (std::size_t i = depth; i-- > 0;) {
        farbrausch_level& level = levels[i];
        const pixel_subset& read_above = levels[i + 1].read;
        level.encode = restrict_to(kernels[i] == 3 ? level.average_coarse : encode[i], read_above);
        encode[i] = {};
        mark_needed_inputs(level.encode, read_marks[i]);
        level.read = pixel_subset::marked(read_marks[i]);
        read_marks[i] = {};
        level.encode = on_subsets(std::move(level.encode), read_above, level.read);
        level.decode = on_subsets(std::move(level.decode), level.decoded, level.read);
    }
    return levels;
}

}}}  // namespace ldi::detail
