// Runs consecutive layers as one chain. Each task computes one strip (consecutive rows of the last layer's result), a few rows
// per step. Ring buffers between the layers keep only the rows that the next layer still needs. They are so small that they
// stay in the processor's caches. The tensors inside the network's inverted residual blocks therefore never reach memory. These
// tensors have 6 to 15 times as many channels as the tensors between the blocks.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/kernels/repeat_pixels_u8.hpp>
#include <ldi/nn/dense/detail/packed_layer.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <variant>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Rows `first` to `end - 1` of a tensor.
struct row_range {
    std::size_t first = 0, end = 0;

    std::size_t count() const { return end - first; }
};

/// One layer of a chain and the shapes around it.
struct chain_stage {
    const packed_layer* layer = nullptr;
    tensor_size input, output;  ///< sizes of the stored input, before `repeat` upsamples it, and of the result
    std::size_t input_channels = 0;
    std::size_t repeat = 1;        ///< depthwise only: factor by which the stage first upsamples its input
    std::size_t other = 0;         ///< addition only: the tensor from outside the chain
    bool chain_is_second = false;  ///< addition only: the chain computes the second operand
    std::size_t rows = 0;          ///< rows computed per step
    std::size_t ring_rows = 0;     ///< rows of the result that the ring keeps; 0 for the last stage

    std::size_t output_row_bytes() const { return output.width * layer->channels; }
    std::size_t input_row_bytes() const { return input.width * input_channels; }

    std::size_t kernel() const {
        if (const auto* d = std::get_if<dense_layer>(&layer->kind)) return d->kernel;
        return std::holds_alternative<depthwise_layer>(layer->kind) ? 3 : 1;
    }
    std::size_t stride() const {
        if (const auto* d = std::get_if<dense_layer>(&layer->kind)) return d->stride;
        const auto* d = std::get_if<depthwise_layer>(&layer->kind);
        return d == nullptr ? 1 : d->weights->stride;
    }
    /// Factor by which the stage upsamples its input: as a resize, or as a depthwise convolution of repeated pixels.
    std::size_t enlargement() const {
        const auto* r = std::get_if<resize_layer>(&layer->kind);
        return r == nullptr ? repeat : r->factor;
    }

    /// Rows of the input that the given rows of the result depend on.
    row_range needs(row_range result) const {
        const std::size_t margin = kernel() / 2, height = input.height * enlargement();
        const std::size_t first = result.first * stride(), last = (result.end - 1) * stride() + margin;
        return {(first > margin ? first - margin : 0) / enlargement(), (std::min)(last, height - 1) / enlargement() + 1};
    }
    /// Maximum number of rows that needs() returns for `count` rows of the result.
    std::size_t max_needed(std::size_t count) const {
        return (std::min)(input.height, ((count - 1) * stride() + kernel() + enlargement() - 2) / enlargement() + 1);
    }

    std::size_t padded_row_bytes() const { return (input.width + kernel() - 1) * input_channels + slack; }
    /// Bytes of the stage's padded copies of input rows. Dense convolutions other than pointwise ones read these copies.
    std::size_t padded_bytes() const {
        const auto* d = std::get_if<dense_layer>(&layer->kind);
        return d == nullptr || d->is_pointwise() ? 0 : d->kernel * padded_row_bytes();
    }
    std::size_t ring_bytes() const { return ring_rows == 0 ? 0 : ring_rows * output_row_bytes() + slack; }

    static constexpr std::size_t slack = 64;  ///< kernels require this many readable bytes after the last value
};

/// Minimum number of pixels per step: enough to reuse packed weights while they are in the cache.
inline constexpr std::size_t wanted_pixels = 64;

/// Sets the number of rows that each stage computes per step and the number of rows that its ring keeps.
inline void plan_rings(buffer<chain_stage>& chain) {
    chain_stage& last = chain.back();
    last.rows = std::clamp<std::size_t>((wanted_pixels + last.output.width - 1) / last.output.width, 1, last.output.height);
    for (std::size_t s = chain.size() - 1; s > 0; --s) {
        chain[s - 1].ring_rows = chain[s].max_needed(chain[s].rows);
        chain[s - 1].rows = chain[s - 1].ring_rows;
    }
}

inline std::size_t round_up(std::size_t bytes) { return (bytes + buffer_alignment - 1) / buffer_alignment * buffer_alignment; }

/// Bytes of working memory per strip.
inline std::size_t chain_bytes(const buffer<chain_stage>& chain) {
    std::size_t bytes = 0;
    for (const chain_stage& stage : chain) bytes += round_up(stage.ring_bytes()) + round_up(stage.padded_bytes());
    return bytes;
}

/// Addresses of a tensor's rows. The rows of `middle` are read from the tensor itself. The rows before and after them are read
/// from copies, because other strips may overwrite the originals.
struct row_source {
    /// addresses of row 0 of the tensor, of the copy of row middle.first - reach, and of the copy of row middle.end - reach
    const std::uint8_t *rows = nullptr, *before = nullptr, *behind = nullptr;
    row_range middle;
    std::size_t reach = 0, row_bytes = 0;  ///< reach: number of copied rows on each side of a cut

    const std::uint8_t* row(std::size_t y) const {
        if (y < middle.first) return before + (y + reach - middle.first) * row_bytes;
        if (y >= middle.end) return behind + (y + reach - middle.end) * row_bytes;
        return rows + y * row_bytes;
    }
    /// Number of contiguous rows, starting with row y.
    std::size_t run(std::size_t y) const {
        return (y < middle.first ? middle.first : y < middle.end ? middle.end : ~std::size_t{0}) - y;
    }
};

/// Computes rows of a chain's result. Each strip has its own object.
class chain_runner {
public:
    /// memory   chain_bytes() bytes, aligned to a cache line
    /// tensors  address of each tensor that an addition of the chain reads
    chain_runner(const buffer<chain_stage>& chain, const row_source& input, std::uint8_t* const* tensors, std::uint8_t* result,
                 std::uint8_t* memory)
        : chain_(chain), input_(input), tensors_(tensors), result_(result), state_(chain.size()) {
        for (std::size_t s = 0; s < chain.size(); ++s) {
            state_[s].ring = memory;
            memory += round_up(chain[s].ring_bytes());
            state_[s].padded = memory;
            memory += round_up(chain[s].padded_bytes());
        }
    }

    void run(row_range rows) {
        row_range needed = rows;
        for (std::size_t s = chain_.size(); s-- > 0;) {
            state_[s].made = needed.first;
            needed = chain_[s].needs(needed);
            state_[s].next_padded = needed.first;
        }
        make(chain_.size() - 1, rows.end);
    }

private:
    struct stage_state {
        std::uint8_t *ring = nullptr, *padded = nullptr;
        std::size_t made = 0;         // rows before this one are computed
        std::size_t next_padded = 0;  // rows of the input before this one are copied to `padded`
    };

    /// Computes all rows of a stage before row `end` that are not computed yet. First computes the rows of earlier stages that
    /// they depend on.
    void make(std::size_t s, std::size_t end) {
        const chain_stage& stage = chain_[s];
        while (state_[s].made < end) {
            const row_range rows{state_[s].made, (std::min)(end, state_[s].made + stage.rows)};
            if (s > 0) make(s - 1, stage.needs(rows).end);
            std::visit([&](const auto& kind) { compute(kind, s, rows); }, stage.layer->kind);
            state_[s].made = rows.end;
        }
    }

    const std::uint8_t* input_row(std::size_t s, std::size_t y) const { return s == 0 ? input_.row(y) : output_row(s - 1, y); }
    std::uint8_t* output_row(std::size_t s, std::size_t y) const {
        const std::size_t bytes = chain_[s].output_row_bytes();
        return s + 1 == chain_.size() ? result_ + y * bytes : state_[s].ring + y % chain_[s].ring_rows * bytes;
    }
    /// Number of contiguous rows of a stage's result, starting with row y.
    std::size_t run_of_output(std::size_t s, std::size_t y) const {
        return s + 1 == chain_.size() ? ~std::size_t{0} : chain_[s].ring_rows - y % chain_[s].ring_rows;
    }
    std::size_t run_of_rows(std::size_t s, std::size_t y, std::size_t max_rows) const {
        const std::size_t input = s == 0 ? input_.run(y) : run_of_output(s - 1, y);
        return (std::min)({input, run_of_output(s, y), max_rows});
    }

    void compute(const dense_layer& layer, std::size_t s, row_range rows) {
        const chain_stage& stage = chain_[s];
        if (!layer.is_pointwise()) {
            for (std::size_t y = rows.first; y < rows.end; ++y) compute_windows(layer, s, y);
            return;
        }
        for (std::size_t y = rows.first; y < rows.end;) {
            const std::size_t count = run_of_rows(s, y, rows.end - y);
            const std::uint8_t* const input = input_row(s, y);
            gemm_u8(layer.weights, &input, stage.input_channels, count * stage.output.width, output_row(s, y));
            y += count;
        }
    }

    void compute_windows(const dense_layer& layer, std::size_t s, std::size_t y) {
        const chain_stage& stage = chain_[s];
        const std::size_t margin = layer.kernel / 2, row_bytes = stage.padded_row_bytes(), height = stage.input.height;
        stage_state& state = state_[s];
        const row_range needed = stage.needs({y, y + 1});
        state.next_padded = (std::max)(state.next_padded, needed.first);
        for (; state.next_padded < needed.end; ++state.next_padded) {
            std::uint8_t* const to = state.padded + state.next_padded % layer.kernel * row_bytes;
            const std::size_t side = margin * stage.input_channels;
            std::memset(to, layer.padding, side);
            std::memcpy(to + side, input_row(s, state.next_padded), stage.input_row_bytes());
            std::memset(to + side + stage.input_row_bytes(), layer.padding, side + chain_stage::slack);
        }
        std::array<const std::uint8_t*, gemm_u8_data::max_segments> segments{};
        for (std::size_t k = 0; k < layer.kernel; ++k) {
            const std::size_t row = y * layer.stride + k;  // row index in the padded image
            if (row >= margin && row < height + margin) {
                segments[k] = state.padded + (row - margin) % layer.kernel * row_bytes;
            } else {  // padding: the window has fewer image rows than `padded` has slots, so one slot is free
                std::uint8_t* const free = state.padded + (row + layer.kernel - margin) % layer.kernel * row_bytes;
                std::memset(free, layer.padding, row_bytes);
                segments[k] = free;
            }
        }
        gemm_u8(layer.weights, segments.data(), stage.input_channels * layer.stride, stage.output.width, output_row(s, y));
    }

    void compute(const depthwise_layer& layer, std::size_t s, row_range rows) {
        const chain_stage& stage = chain_[s];
        const std::size_t height = stage.input.height * stage.repeat;
        for (std::size_t y = rows.first; y < rows.end; ++y) {
            const std::uint8_t* window[3];
            for (std::size_t k = 0; k < 3; ++k) {
                const std::size_t row = y * layer.weights->stride + k;  // row index in the image padded by 1
                window[k] = row == 0 || row > height ? nullptr : input_row(s, (row - 1) / stage.repeat);
            }
            depthwise_u8(layer.weights, window, stage.input.width, stage.repeat, output_row(s, y));
        }
    }

    void compute(const addition_layer& layer, std::size_t s, row_range rows) {
        const chain_stage& stage = chain_[s];
        const std::size_t bytes = stage.output_row_bytes();
        for (std::size_t y = rows.first; y < rows.end; ++y) {
            const std::uint8_t *a = input_row(s, y), *b = tensors_[stage.other] + y * bytes;
            if (stage.chain_is_second) std::swap(a, b);
            add_u8(layer.sum, a, b, bytes, output_row(s, y));
        }
    }

    void compute(const resize_layer& layer, std::size_t s, row_range rows) {
        const chain_stage& stage = chain_[s];
        for (std::size_t y = rows.first; y < rows.end; ++y)
            repeat_pixels_u8(input_row(s, y / layer.factor), stage.input.width, stage.input_channels, layer.factor,
                             output_row(s, y));
    }

    const buffer<chain_stage>& chain_;
    row_source input_;
    std::uint8_t* const* tensors_;
    std::uint8_t* result_;
    buffer<stage_state> state_;
};

}}}  // namespace ldi::detail
