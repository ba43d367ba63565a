// The pixels of a chart, as runs of consecutive indices. Most pixels of a chart follow each other in memory, row by row, so a run
// needs far less memory than its indices.
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>

#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// An ascending list of pixels. Iterates over the pixels; runs() returns the runs.
class chart_pixels {
public:
    /// Pixels first, first + 1, ..., first + count - 1.
    struct run {
        std::int32_t first, count;
        friend bool operator==(const run&, const run&) = default;
    };

    /// Forward iterator over the pixels.
    class iterator {
    public:
        using iterator_category = std::forward_iterator_tag;
        using value_type = std::int32_t;
        using difference_type = std::ptrdiff_t;
        using pointer = const std::int32_t*;
        using reference = std::int32_t;

        iterator() = default;
        std::int32_t operator*() const { return run_->first + offset_; }
        iterator& operator++() {
            if (++offset_ == run_->count) ++run_, offset_ = 0;
            return *this;
        }
        iterator operator++(int) {
            const iterator before = *this;
            ++*this;
            return before;
        }
        friend bool operator==(const iterator&, const iterator&) = default;

    private:
        friend chart_pixels;
        explicit iterator(const run* at) : run_(at) {}

        const run* run_ = nullptr;
        std::int32_t offset_ = 0;
    };

    /// Adds the pixels first, first + 1, ..., first + count - 1. Raises mismatch for a count below 1, if `first` does not exceed
    /// all pixels of the list, if it is negative, and for a last pixel of 2^31 - 1 or more.
    void add_run(std::int32_t first, std::int32_t count) {
        const std::int32_t smallest = runs_.empty() ? 0 : back() + 1;
        if (count < 1 || first < smallest || count > (std::numeric_limits<std::int32_t>::max)() - first)
            raise(error_code::mismatch, "chart_pixels", "at least one pixel, from " + std::to_string(smallest) + " to 2147483646",
                  std::to_string(count) + " pixels from " + std::to_string(first) + " on");
        if (!runs_.empty() && first == smallest)
            runs_.back().count += count;
        else
            runs_.push_back({first, count});
    }
    /// Adds one pixel. Raises the errors of add_run().
    void push_back(std::int32_t pixel) { add_run(pixel, 1); }

    /// Number of pixels. Time is linear in the number of runs.
    std::size_t size() const {
        std::size_t total = 0;
        for (const run& r : runs_) total += static_cast<std::size_t>(r.count);
        return total;
    }
    bool empty() const { return runs_.empty(); }
    /// The first and the last pixel of a list that is not empty.
    std::int32_t front() const { return runs_.front().first; }
    std::int32_t back() const { return runs_.back().first + (runs_.back().count - 1); }
    /// The runs, ascending. Between two runs, at least one pixel is missing.
    array_view<const run> runs() const& { return runs_; }
    array_view<const run> runs() const&& = delete;  // the runs would be destroyed with the list

    iterator begin() const& { return iterator(runs_.data()); }
    iterator begin() const&& = delete;
    iterator end() const& { return iterator(runs_.data() + runs_.size()); }
    iterator end() const&& = delete;

    friend bool operator==(const chart_pixels&, const chart_pixels&) = default;

private:
    buffer<run> runs_;
};

}}  // namespace ldi
