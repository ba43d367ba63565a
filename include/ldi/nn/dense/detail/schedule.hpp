// Groups the layers of a network into chains and places their tensors in one block of memory.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/stable_sort.hpp>
#include <ldi/nn/dense/detail/packed_layer.hpp>
#include <ldi/nn/dense/detail/row_chain.hpp>

#include <algorithm>
#include <cstddef>
#include <variant>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Layers that run as one chain. The first layer reads tensor `input`; the last layer writes tensor `layers.back() + 1`.
struct schedule_step {
    std::size_t input = 0;
    buffer<std::size_t> layers;

    std::size_t output() const { return layers.back() + 1; }
};

/// Number of readers of each tensor. The network's result has one extra reader.
inline buffer<std::size_t> count_readers(const buffer<packed_layer>& layers, std::size_t output) {
    buffer<std::size_t> readers(layers.size() + 1);
    for (const packed_layer& layer : layers)
        for (std::size_t t : layer.inputs) ++readers[t];
    ++readers[output];
    return readers;
}

inline const dense_layer* pointwise(const packed_layer& layer) {
    const auto* d = std::get_if<dense_layer>(&layer.kind);
    return d != nullptr && d->is_pointwise() ? d : nullptr;
}

/// Whether to recompute a layer for each of its readers. For a dense convolution with few inputs whose readers are all 1 x 1
/// convolutions, recomputing costs less than storing and loading the result.
inline bool is_cheap_head(const buffer<packed_layer>& layers, std::size_t layer, std::size_t output) {
    constexpr std::size_t few = 64;
    const auto* d = std::get_if<dense_layer>(&layers[layer].kind);
    if (d == nullptr || d->is_pointwise() || d->weights->segments * d->weights->inputs > few || output == layer + 1) return false;
    std::size_t readers = 0;
    for (const packed_layer& reader : layers)
        for (std::size_t t : reader.inputs)
            if (t == layer + 1) {
                if (pointwise(reader) == nullptr) return false;
                ++readers;
            }
    return readers > 0;
}

/// Whether `next` may extend a chain that ends with `layer`: both belong to an inverted residual block (1 x 1 convolution,
/// upsampling, depthwise convolution, 1 x 1 convolution, additions).
inline bool continues(const packed_layer& layer, const packed_layer& next) {
    const bool is_resize = std::holds_alternative<resize_layer>(layer.kind);
    if (std::holds_alternative<depthwise_layer>(next.kind)) return pointwise(layer) != nullptr || is_resize;
    if (std::holds_alternative<resize_layer>(next.kind)) return pointwise(layer) != nullptr;
    if (std::holds_alternative<addition_layer>(next.kind)) return !is_resize;
    return pointwise(next) != nullptr && std::holds_alternative<depthwise_layer>(layer.kind);
}

/// Schedules one layer per step.
inline buffer<schedule_step> layer_by_layer(const buffer<packed_layer>& layers) {
    buffer<schedule_step> steps;
    for (std::size_t i = 0; i < layers.size(); ++i) steps.push_back({layers[i].inputs[0], {i}});
    return steps;
}

/// Groups layers into chains. Tensors inside a chain are never stored as a whole (row_chain.hpp).
inline buffer<schedule_step> fuse(const buffer<packed_layer>& layers, std::size_t output) {
    const buffer<std::size_t> readers = count_readers(layers, output);
    buffer<schedule_step> steps;
    for (std::size_t i = 0; i < layers.size();) {
        if (is_cheap_head(layers, i, output)) {
            ++i;
            continue;
        }
        schedule_step step{layers[i].inputs[0], {}};
        if (pointwise(layers[i]) != nullptr && step.input > 0 && is_cheap_head(layers, step.input - 1, output)) {
            step.layers.push_back(step.input - 1);
            step.input = layers[step.input - 1].inputs[0];
        }
        step.layers.push_back(i);
        for (++i; i < layers.size(); ++i) {
            const packed_layer& next = layers[i];
            const bool reads_it = std::find(next.inputs.begin(), next.inputs.end(), i) != next.inputs.end();
            if (!reads_it || readers[i] != 1 || !continues(layers[i - 1], next)) break;
            step.layers.push_back(i);
        }
        steps.push_back(step);
    }
    return steps;
}

/// Lists the tensors that a step reads from memory.
inline buffer<std::size_t> tensors_read(const buffer<packed_layer>& layers, const schedule_step& step) {
    buffer<std::size_t> read{step.input};
    std::size_t brought = step.input;  // the tensor that the chain passes to the next layer as an input
    for (std::size_t layer : step.layers) {
        bool is_brought = false;
        for (std::size_t t : layers[layer].inputs) {
            if (t != brought || is_brought) read.push_back(t);
            is_brought = is_brought || t == brought;
        }
        brought = layer + 1;
    }
    return read;
}

/// A schedule_step, planned for one input size.
struct planned_step {
    buffer<chain_stage> chain;
    std::size_t input = 0, output = 0;
    bool overwrites_input = false;  ///< the result of a chain of several layers replaces the chain's input in memory
    std::size_t reach = 0;          ///< number of input rows on each side that a result row depends on; 0 unless overwrites_input
};

struct schedule_plan {
    buffer<planned_step> steps;
    buffer<std::size_t> offsets;   ///< per tensor: offset of its block; meaningless for tensors inside a chain
    std::size_t tensor_bytes = 0;  ///< memory of all stored tensors, which share blocks
    std::size_t strip_bytes = 0;   ///< working memory of one strip (row_chain.hpp)
    std::size_t cut_bytes = 0;     ///< bytes of the copied rows around one cut between strips
};

inline buffer<chain_stage> plan_chain(const buffer<packed_layer>& layers, const schedule_step& step,
                                      const buffer<tensor_size>& sizes, const buffer<std::size_t>& channels) {
    buffer<chain_stage> chain;
    std::size_t from = step.input, repeat = 1;
    for (std::size_t i = 0; i < step.layers.size(); ++i) {
        const std::size_t l = step.layers[i];
        const packed_layer& layer = layers[l];
        const std::size_t brought = i == 0 ? step.input : step.layers[i - 1] + 1;
        const auto* resize = std::get_if<resize_layer>(&layer.kind);
        if (resize != nullptr && i + 1 < step.layers.size()) {  // the next layer, a depthwise convolution, repeats the pixels
            repeat = resize->factor;
            continue;
        }
        chain_stage stage;
        stage.layer = &layer;
        stage.input = sizes[from], stage.output = sizes[l + 1], stage.input_channels = channels[from];
        stage.repeat = repeat;
        if (layer.inputs.size() == 2) {
            stage.chain_is_second = layer.inputs[0] != brought;
            stage.other = layer.inputs[stage.chain_is_second ? 0 : 1];
        }
        chain.push_back(stage);
        from = l + 1, repeat = 1;
    }
    plan_rings(chain);
    return chain;
}

/// Sets `overwrites_input` and `reach` if the chain has several layers and `tensor` is its input. The chain ends with an
/// addition, which is the last reader of `tensor` and overwrites it.
inline void plan_overwriting(planned_step& step, std::size_t tensor) {
    if (tensor != step.input || step.chain.size() == 1) return;
    std::size_t reach = 0;
    for (const chain_stage& stage : step.chain) reach += stage.kernel() / 2;
    step.overwrites_input = true;
    step.reach = reach;
}

inline bool can_overwrite(const planned_step& step, std::size_t tensor) {
    const chain_stage& last = step.chain.back();
    if (!std::holds_alternative<addition_layer>(last.layer->kind) || last.other != tensor) return false;
    if (tensor != step.input || step.chain.size() == 1) return true;
    // The chain overwrites an input row soon after the first layer has read the row. Besides the first layer, only the addition
    // at the end may read the row. The addition reads each row just before overwriting it.
    for (const chain_stage& stage : step.chain)
        if (stage.stride() != 1 || stage.repeat != 1) return false;
    return std::holds_alternative<dense_layer>(step.chain.front().layer->kind);
}

/// A block of memory that several tensors occupy in succession.
struct tensor_block {
    std::size_t bytes = 0, first_step = 0, last_step = 0, offset = 0;
};

/// Places large blocks first, each at the lowest offset that is free during its lifetime. Returns the end of the highest block.
inline std::size_t place(buffer<tensor_block>& blocks) {
    buffer<tensor_block*> order, placed;
    for (tensor_block& block : blocks)
        if (block.bytes > 0) order.push_back(&block);
    stable_sort(order, [](const auto* a, const auto* b) { return a->bytes > b->bytes; });
    std::size_t highest = 0;
    for (tensor_block* block : order) {
        block->offset = 0;
        for (const tensor_block* other : placed) {  // sorted by offset
            const bool meets = other->first_step <= block->last_step && block->first_step <= other->last_step;
            if (!meets) continue;
            if (block->offset + block->bytes <= other->offset) break;
            block->offset = (std::max)(block->offset, other->offset + other->bytes);
        }
        highest = (std::max)(highest, block->offset + block->bytes);
        placed.insert(std::upper_bound(placed.begin(), placed.end(), block,
                                       [](const auto* a, const auto* b) { return a->offset < b->offset; }),
                      block);
    }
    return highest;
}

/// Plans the chains and the memory for one input size.
///
/// sizes, channels  size and number of channels of each tensor
inline schedule_plan plan_schedule(const buffer<packed_layer>& layers, const buffer<schedule_step>& schedule,
                                   const buffer<tensor_size>& sizes, const buffer<std::size_t>& channels, std::size_t output,
                                   bool overwrite) {
    schedule_plan plan;
    buffer<std::size_t> last_reader(sizes.size());
    for (std::size_t i = 0; i < schedule.size(); ++i)
        for (std::size_t t : tensors_read(layers, schedule[i])) last_reader[t] = i;
    last_reader[output] = schedule.size();

    const auto bytes = [&](std::size_t t) {
        return round_up(sizes[t].height * sizes[t].width * channels[t] + chain_stage::slack);
    };
    buffer<tensor_block> blocks{{bytes(0), 0, last_reader[0], 0}};
    buffer<std::size_t> block_of(sizes.size());
    for (std::size_t i = 0; i < schedule.size(); ++i) {
        planned_step step{plan_chain(layers, schedule[i], sizes, channels), schedule[i].input, schedule[i].output()};
        const std::size_t last_step = (std::max)(last_reader[step.output], i);
        const std::size_t other = step.chain.back().other;
        if (overwrite && last_reader[other] == i && can_overwrite(step, other)) {
            block_of[step.output] = block_of[other];
            blocks[block_of[other]].last_step = last_step;
            plan_overwriting(step, other);
        } else {
            block_of[step.output] = blocks.size();
            blocks.push_back({bytes(step.output), i, last_step, 0});
        }
        plan.strip_bytes = (std::max)(plan.strip_bytes, chain_bytes(step.chain));
        if (step.overwrites_input)
            plan.cut_bytes =
                (std::max)(plan.cut_bytes, round_up(2 * step.reach * step.chain.front().input_row_bytes() + chain_stage::slack));
        plan.steps.push_back(step);
    }
    plan.tensor_bytes = place(blocks);
    for (std::size_t t = 0; t < sizes.size(); ++t) plan.offsets.push_back(blocks[block_of[t]].offset);
    return plan;
}

}}}  // namespace ldi::detail
