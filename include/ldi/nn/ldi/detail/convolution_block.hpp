// Computes one block of a convolution's outputs. Where possible, the kernel reads the windows of a plan's segments in place. All
// other windows are first gathered in a small buffer. The order of summation is the same in both cases.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/executor.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/kernels/conv_f32.hpp>
#include <ldi/kernels/conv_u8.hpp>
#include <ldi/nn/ldi/convolution_plan.hpp>
#include <ldi/nn/ldi/feature_map.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

inline void multiply(const conv_f32_weights& weights, const float* const* rows, std::size_t pixel_stride, std::size_t pixels,
                     const float* ratios, float* result) {
    conv_f32(weights, rows, pixel_stride, pixels, ratios, result);
}
template <class Result>
void multiply(const conv_u8_weights& weights, const std::uint8_t* const* rows, std::size_t pixel_stride, std::size_t pixels,
              const float* ratios, Result* result) {
    conv_u8(weights, rows, pixel_stride, pixels, ratios, result);
}

/// Result value that represents zero.
template <class Result, class Weights>
Result zero_of_results(const Weights& weights) {
    if constexpr (std::is_same_v<Result, typename Weights::value_type>)
        return weights->result_zero_point;
    else
        return Result{};
}

/// Arguments that all blocks of a convolution share.
template <class Weights, class Result>
struct convolution_job {
    using value_type = typename Weights::value_type;
    using result_type = Result;
    using source_type = basic_feature_view<value_type>;

    const convolution_plan& plan;
    const Weights& weights;
    std::span<const source_type> sources;
    bool is_partial;
    std::span<Result> result;
    std::span<std::uint8_t> result_mask;
    std::size_t channels;

    bool reads_memory_as_it_is() const { return sources.size() == 1 && sources[0].rows.empty() && sources[0].mask.empty(); }
};

/// Computes blocks. Each thread uses its own object, which contains the working memory.
template <class Job>
class convolution_block {
public:
    explicit convolution_block(const Job& job) : job_(job) {
        const std::size_t window = job.plan.elements() * job.channels;
        batch_ = (std::min)(whole_tiles(largest_buffer / window), largest_batch);
        stretch_ = whole_tiles(largest_buffer / (k() * job.channels));
        const std::size_t stretch_pixels = stride() * stretch_ + k();
        values_.resize((std::max)(batch_ * window, job.reads_memory_as_it_is() ? 0 : stretch_pixels * k() * job.channels));
        results_.resize(batch_ * job.weights->outputs);
        ratios_.resize((std::max)(batch_, stretch_));
        counts_.resize(stretch_pixels);
    }

    /// Computes the plan's outputs in [first, last).
    void run(std::int32_t first, std::int32_t last) {
        const convolution_plan& plan = job_.plan;
        const auto ends_before = [&](const convolution_plan::segment& c) { return c.first + c.count <= first; };
        const array_view<const convolution_plan::segment> segments = plan.segments();
        std::size_t s = index_in(segments, std::partition_point(segments.begin(), segments.end(), ends_before));
        for (; s < segments.size() && segments[s].first < last; ++s) {
            const convolution_plan::segment here = segments[s];
            const std::int32_t from = (std::max)(first, here.first), to = (std::min)(last, here.first + here.count);
            row_pixels rows{};
            for (std::size_t r = 0; r < k(); ++r)
                rows[r] = plan.rows_of(s)[r] + plan.stride() * (from - here.first) - plan.kernel_size() / 2;
            run_segment(static_cast<std::size_t>(from), static_cast<std::size_t>(to - from), rows);
        }
        const array_view<const std::int32_t> irregular = plan.irregular();
        const std::int32_t* const begin = std::lower_bound(irregular.begin(), irregular.end(), first);
        const std::size_t end = index_in(irregular, std::lower_bound(begin, irregular.end(), last));
        for (std::size_t i = index_in(irregular, begin); i < end; i += batch_) run_irregular(i, (std::min)(batch_, end - i));
    }

private:
    using value_type = typename Job::value_type;
    using result_type = typename Job::result_type;
    using row_starts = std::array<const value_type*, max_kernel_size>;

    static constexpr std::size_t largest_buffer = 8192, largest_batch = 96;  // approximate values per buffer; outputs per batch

    /// Rounds up to a multiple of the kernels' tile size, at least one tile.
    static std::size_t whole_tiles(std::size_t outputs) {
        constexpr std::size_t tile = 24;
        return std::max<std::size_t>((outputs + tile - 1) / tile, 1) * tile;
    }

    template <class T>
    static std::size_t index_in(array_view<const T> values, const T* place) {
        return static_cast<std::size_t>(place - values.begin());
    }

    std::size_t k() const { return job_.plan.k(); }
    std::size_t stride() const { return static_cast<std::size_t>(job_.plan.stride()); }
    result_type* result_of(std::size_t output) const { return job_.result.data() + output * job_.weights->outputs; }

    using row_pixels = std::array<std::int32_t, max_kernel_size>;

    /// Whether the kernel can read pixels rows[r] + first to rows[r] + first + pixels - 1 in place, for every window row r. This
    /// requires a single source, without an index map and with all of these pixels unmasked.
    bool is_whole(const row_pixels& rows, std::size_t first, std::size_t pixels) const {
        const auto& source = job_.sources[0];
        if (job_.sources.size() != 1 || !source.rows.empty()) return false;
        for (std::size_t r = 0; r < k() && !source.mask.empty(); ++r) {
            const std::uint8_t* const row = source.mask.data() + rows[r] + first;
            if (std::find(row, row + pixels, std::uint8_t{0}) != row + pixels) return false;
        }
        return true;
    }

    void run_in_place(std::size_t output, std::size_t count, const row_pixels& rows, std::size_t first) {
        row_starts starts{};
        for (std::size_t r = 0; r < k(); ++r) starts[r] = job_.sources[0].values_of(rows[r]) + first * job_.channels;
        multiply(job_.weights, starts.data(), stride() * job_.channels, count, nullptr, result_of(output));
        if (!job_.result_mask.empty()) std::fill_n(job_.result_mask.data() + output, count, std::uint8_t{1});
    }

    /// Computes outputs `output` to `output + count - 1`, which belong to one segment.
    ///
    /// rows  leftmost pixel of each row of the first output's window, top to bottom
    void run_segment(std::size_t output, std::size_t count, const row_pixels& rows) {
        if (job_.reads_memory_as_it_is()) return run_in_place(output, count, rows, 0);
        row_starts starts{};
        for (std::size_t done = 0; done < count; done += stretch_) {
            const std::size_t here = (std::min)(stretch_, count - done), pixels = stride() * (here - 1) + k();
            if (is_whole(rows, stride() * done, pixels)) {
                run_in_place(output + done, here, rows, stride() * done);
                continue;
            }
            std::fill_n(counts_.begin(), pixels, std::size_t{0});
            value_type* to = values_.data();
            for (std::size_t r = 0; r < k(); ++r) {
                starts[r] = to;
                for (std::size_t p = 0; p < pixels; ++p, to += job_.channels)
                    counts_[p] += copy_pixel(job_.sources, rows[r] + static_cast<std::int32_t>(stride() * done + p), to);
            }
            for (std::size_t o = 0; o < here; ++o) {
                std::size_t counted = 0;
                for (std::size_t x = 0; x < k(); ++x) counted += counts_[stride() * o + x];
                ratios_[o] = ratio(counted);
            }
            multiply(job_.weights, starts.data(), stride() * job_.channels, here, ratios(), result_of(output + done));
            for (std::size_t o = 0; o < here; ++o) finish(output + done + o, ratios_[o]);
        }
    }

    /// Computes the plan's irregular outputs with indices first, first + 1, ...
    void run_irregular(std::size_t first, std::size_t count) {
        const std::size_t elements = job_.plan.elements();
        value_type* to = values_.data();
        for (std::size_t o = 0; o < count; ++o) {
            std::size_t counted = 0;
            for (const std::int32_t pixel : job_.plan.window_of(first + o)) {
                counted += copy_pixel(job_.sources, pixel, to);
                to += job_.channels;
            }
            ratios_[o] = ratio(counted);
        }
        row_starts starts{};
        for (std::size_t r = 0; r < k(); ++r) starts[r] = values_.data() + r * k() * job_.channels;
        multiply(job_.weights, starts.data(), elements * job_.channels, count, ratios(), results_.data());
        const std::size_t outputs = job_.weights->outputs;
        for (std::size_t o = 0; o < count; ++o) {
            const std::size_t output = static_cast<std::size_t>(job_.plan.irregular()[first + o]);
            copy_row(results_.data() + o * outputs, outputs, result_of(output));
            finish(output, ratios_[o]);
        }
    }

    const float* ratios() const { return job_.is_partial ? ratios_.data() : nullptr; }

    float ratio(std::size_t counted) const {
        return counted == 0 ? 0.0F : nearest_float(job_.plan.elements() * job_.channels) / nearest_float(counted);
    }

    /// Finishes an output of a partial convolution: stores its mask. If the whole window is masked, sets the output to zero,
    /// without bias.
    void finish(std::size_t output, float ratio) const {
        if (!job_.is_partial) return;
        if (ratio == 0.0F) std::fill_n(result_of(output), job_.weights->outputs, zero_of_results<result_type>(job_.weights));
        if (!job_.result_mask.empty()) job_.result_mask[output] = ratio > 0.0F ? 1 : 0;
    }

    const Job& job_;
    // maximum number of outputs per kernel call: for irregular outputs, and for segments whose windows are copied
    std::size_t batch_ = 0, stretch_ = 0;
    buffer<value_type> values_;
    buffer<result_type> results_;
    buffer<float> ratios_;
    buffer<std::size_t> counts_;  // number of unmasked channels in each column of pixels of a segment
};

template <class Weights, class Result, executor Executor>
void run_convolution(const convolution_plan& plan, const Weights& weights,
                     std::span<const basic_feature_view<typename Weights::value_type>> sources, bool is_partial,
                     std::span<Result> result, std::span<std::uint8_t> result_mask, Executor& threads) {
    const auto expect = [](const char* what, std::size_t expected, std::size_t found) {
        if (found != expected)
            raise(error_code::mismatch, "convolution", std::to_string(expected) + " " + what, std::to_string(found));
    };
    std::size_t channels = 0;
    for (const auto& source : sources) {
        check_rows("convolution", source);
        expect("pixels in each source", plan.input_count(), source.pixels());
        channels += source.channels;
    }
    expect("window rows in the plan", weights->rows, plan.k());
    expect("channels in all sources", weights->inputs / weights->rows, channels);
    expect("values in the result", plan.output_count() * weights->outputs, result.size());
    if (!result_mask.empty()) expect("values in the result's mask", plan.output_count(), result_mask.size());
    const convolution_job<Weights, Result> job{plan, weights, sources, is_partial, result, result_mask, channels};

    // Each block computes its irregular outputs right after its segments, while the inputs are still in the cache.
    constexpr std::size_t block = 4096;
    parallel_for(threads, (plan.output_count() + block - 1) / block, 1, [&](std::size_t first, std::size_t last) {
        convolution_block worker(job);
        for (std::size_t b = first; b < last; ++b)
            worker.run(static_cast<std::int32_t>(b * block),
                       static_cast<std::int32_t>((std::min)((b + 1) * block, plan.output_count())));
    });
}

}  // namespace detail
}}  // namespace ldi
