// Positions for the vertices inside a chart. Studs (vertical polylines, mesh/studs.hpp) and single vertices lie on evenly spaced
// lines, at the bends of the disparity along each line.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Divides an extent with evenly spaced lines at integer positions. A table stores the first line at or after each position,
/// because every row of a chart looks up its first line.
class even_lines {
public:
    even_lines(std::int32_t begin, std::int32_t length, std::int32_t spacing) : first_(begin) {
        const std::int32_t count = (std::max)((length + spacing / 2) / spacing - 1, 0);
        for (std::int32_t line = 1; line <= count; ++line) positions_.push_back(begin + line * length / (count + 1));
        std::int32_t line = 0;
        for (std::int32_t offset = 0; offset <= length; ++offset) {
            while (line < count && position(line) < begin + offset) ++line;
            line_from_.push_back(line);
        }
    }

    std::int32_t count() const { return positions_.count(); }
    std::int32_t position(std::int32_t line) const { return positions_[line]; }
    /// Returns the first line at or after `at`, or count() if there is none.
    ///
    /// at  at most the end of the extent
    std::int32_t line_from(std::int32_t at) const { return line_from_[(std::max)(at - first_, 0)]; }
    bool has_line_at(std::int32_t at) const {
        const std::int32_t line = line_from(at);
        return line < count() && position(line) == at;
    }

private:
    std::int32_t first_;
    buffer<std::int32_t> positions_, line_from_;
};

/// Finds the bends of a profile: the points that Douglas-Peucker keeps, except the two ends.
class bend_finder {
public:
    /// Calls found(i) for each bend i in [margin, size - margin), in ascending order. If a section [first, last] has no bend and
    /// is_too_long(first, last), its middle counts as a bend.
    template <class TooLong, class Function>
    void operator()(const buffer<float>& profile, float tolerance, std::int32_t margin, TooLong&& is_too_long, Function&& found) {
        keep_.assign(profile.size(), 0);
        stack_.assign(1, {0, profile.count() - 1});
        while (!stack_.empty()) {
            const auto [first, last] = stack_.back();
            stack_.pop_back();
            const float slope = (profile[last] - profile[first]) / nearest_float((std::max)(last - first, 1));
            float worst = tolerance, expected = profile[first];
            std::int32_t split = 0;
            for (std::int32_t i = first + 1; i < last; ++i) {
                expected += slope;
                const float error = std::abs(profile[i] - expected);
                if (error > worst) worst = error, split = i;
            }
            if (split == 0 && last - first > 1 && is_too_long(first, last)) split = first + (last - first) / 2;
            if (split == 0) continue;
            keep_[split] = 1;
            stack_.emplace_back(first, split);
            stack_.emplace_back(split, last);
        }
        for (std::int32_t i = margin; i < profile.count() - margin; ++i)
            if (keep_[i] != 0) found(i);
    }

private:
    buffer<std::uint8_t> keep_;
    buffer<std::pair<std::int32_t, std::int32_t>> stack_;
};

}}}  // namespace ldi::detail
