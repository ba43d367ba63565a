// Checks whether positions inside a chart are far enough from its outline for inner vertices.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/core/graph.hpp>
#include <ldi/mesh/detail/boundary_walk.hpp>

#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Checks the surroundings of a pixel's left side. Precondition of all checks: in the pixel's row, at least `clearance` pixels
/// to the left and `clearance` pixels to the right of this side belong to the pixel's chart.
class outline_clearance {
public:
    /// sides      K: the boundary sides of each pixel (mark_boundary_sides)
    /// clearance  in pixels, 1 to 64
    outline_clearance(const graph_view& g, const buffer<std::uint8_t>& sides, std::int32_t clearance)
        : g_(g), sides_(sides), clearance_(clearance) {}

    /// Whether the chart ends directly above any of the pixels that lie in the row of `pixel` and within the clearance.
    bool ends_above(std::int32_t pixel) const { return (sides_around(pixel) & side_bit(0)) != 0; }

    /// Whether the chart contains the `clearance` rows that start at the row of `pixel` and continue toward side `s` (0 up, 2
    /// down). Each row extends by the clearance to the left and right of the pixel's left side.
    bool is_clear(std::int32_t pixel, int s) const {
        for (std::int32_t row = 1;; ++row) {
            const std::int32_t first = pixel - clearance_, last = pixel + clearance_ - 1;
            if (first < 0 || last >= sides_.count()) return false;  // the pixels are not in canonical order
            for (std::int32_t i = first; i < last; ++i)
                if ((sides_[i] & side_bit(1)) != 0) return false;
            if (row == clearance_) return true;
            if ((sides_around(pixel) & side_bit(s)) != 0) return false;
            pixel = (s == 0 ? g_.up() : g_.down())[pixel];
        }
    }

private:
    /// Returns the union of the boundary sides of all pixels in the row of `pixel` within the clearance.
    std::uint8_t sides_around(std::int32_t pixel) const {
        const std::uint8_t* at = sides_.data() + (pixel - clearance_);
        const std::uint8_t* const end = sides_.data() + (pixel + clearance_);
        std::uint64_t eight = 0, all = 0;
        for (; end - at >= 8; at += 8) std::memcpy(&eight, at, 8), all |= eight;
        for (const int half : {32, 16, 8}) all |= all >> half;
        std::uint8_t around = all & 0xFF;
        for (; at != end; ++at) around |= *at;
        return around;
    }

    graph_view g_;
    const buffer<std::uint8_t>& sides_;
    std::int32_t clearance_;
};

}}}  // namespace ldi::detail
