// Pearson correlation of two sequences.
#pragma once

#include <ldi/base/config.hpp>

#include <cmath>
#include <limits>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Pearson correlation of pairs of values, which are added one by one.
class correlation {
public:
    void add(double a, double b) { ++count_, a_sum_ += a, b_sum_ += b, aa_ += a * a, bb_ += b * b, ab_ += a * b; }
    double count() const { return count_; }
    /// Returns the correlation, or NaN if there are no values or if one sequence is constant.
    double value() const {
        const double spread = (aa_ - a_sum_ * a_sum_ / count_) * (bb_ - b_sum_ * b_sum_ / count_);
        if (!(spread > 0)) return std::numeric_limits<double>::quiet_NaN();
        return (ab_ - a_sum_ * b_sum_ / count_) / std::sqrt(spread);
    }

private:
    double count_ = 0, a_sum_ = 0, b_sum_ = 0, aa_ = 0, bb_ = 0, ab_ = 0;
};

}}}  // namespace ldi::detail
