// Finds the pixels of a graph whose k x k window is like that of an image: k rows, each of k pixels that are adjacent in
// memory.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/core/graph.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// A set of pixels with one bit per pixel. Bits before the first and after the last pixel are zero. Shifts and masks replace
/// division by 64, which is slower for signed numbers.
class pixel_bits {
public:
    explicit pixel_bits(std::size_t count) : words_(count / 64 + 3, 0) {}  // one zero word before, at least one after

    std::int32_t word_count() const { return words_.count() - 2; }
    std::uint64_t& word(std::int32_t index) { return words_[index + 1]; }
    std::uint64_t word(std::int32_t index) const { return words_[index + 1]; }

    bool operator[](std::int32_t i) const { return (word(i >> 6) >> (i & 63) & 1) != 0; }

    /// Returns bits i to i + 63, where i ranges from -64 to the last pixel.
    std::uint64_t from(std::int32_t i) const {
        const std::int32_t at = i + 64, shift = at & 63;
        const std::uint64_t low = words_[at >> 6] >> shift;
        return shift == 0 ? low : low | words_[(at >> 6) + 1] << (64 - shift);
    }

    /// Sets each bit first + n, 0 <= n < count, for which bit source_first + n of `source` is set. `source` must be a
    /// different object.
    void copy(std::int32_t first, std::int32_t count, const pixel_bits& source, std::int32_t source_first) {
        for (const std::int32_t last = first + count; first < last;) {
            const std::int32_t here = (std::min)(64 - (first & 63), last - first);
            const std::uint64_t bits = source.from(source_first) & ones(here);
            word(first >> 6) |= bits << (first & 63);
            first += here, source_first += here;
        }
    }

    void set(std::int32_t first, std::int32_t count, bool value) {
        for (const std::int32_t last = first + count; first < last;) {
            const std::int32_t here = (std::min)(64 - (first & 63), last - first);
            const std::uint64_t bits = ones(here) << (first & 63);
            word(first >> 6) = value ? word(first >> 6) | bits : word(first >> 6) & ~bits;
            first += here;
        }
    }

    void keep_common(const pixel_bits& other) {
        for (std::size_t w = 0; w < words_.size(); ++w) words_[w] &= other.words_[w];
    }

private:
    static std::uint64_t ones(std::int32_t count) { return count == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << count) - 1; }

    buffer<std::uint64_t> words_;
};

/// Pixels first, first + 1, ... whose neighbors on one side are target, target + 1, ...
struct pixel_strip {
    std::int32_t first, count, target;
};

/// Returns the first index at or after `i` whose value is not the previous value plus one.
///
/// i  at least 1
inline std::int32_t end_of_strip(std::span<const std::int32_t> links, std::size_t i) {
    // Compares values in blocks for speed: strips are as long as image rows, and these loops read every link of the graph.
    constexpr std::size_t block = 16;
    for (; i + block <= links.size(); i += block) {
        std::int32_t different = 0;
        for (std::size_t n = i; n < i + block; ++n) different |= links[n] ^ (links[n - 1] + 1);
        if (different != 0) break;
    }
    while (i < links.size() && links[i] == links[i - 1] + 1) ++i;
    return static_cast<std::int32_t>(i);
}

/// Splits the pixels that have a neighbor on one side into as few strips as possible.
///
/// links  the neighbor of each pixel on this side, or no_pixel
inline buffer<pixel_strip> strips_of(array_view<const std::int32_t> links) {
    buffer<pixel_strip> strips;
    for (std::int32_t first = 0, last; first < links.count(); first = last) {
        last = first + 1;
        if (links[first] == no_pixel) continue;
        last = end_of_strip(links, static_cast<std::size_t>(last));
        strips.push_back({first, last - first, links[first]});
    }
    return strips;
}

/// Strips of a graph's links, computed once for all kernel sizes.
struct link_strips {
    buffer<pixel_strip> up, down, right;

    explicit link_strips(const graph_view& g) : up(strips_of(g.up())), down(strips_of(g.down())), right(strips_of(g.right())) {}
};

/// The set of regular pixels. A pixel is regular if links form its window as in an image. Let r = kernel_size / 2. The spine of a
/// pixel is the center column of its window: the pixel, r pixels straight up and r pixels straight down along links. The rib of a
/// pixel of the spine is a row of the window: r pixels to the left, the pixel, and r pixels to the right, adjacent in memory. A
/// pixel is regular if its spine and all ribs are complete. gather_window() (core/window.hpp) finds exactly these ribs,
/// regardless of other links.
///
/// Proof. Let (x, y) be the element of the window x columns to the right of the center and y rows below it. Along spine and rib,
/// |x| + |y| links lead to it, and no path is shorter. gather_window() explores links breadth-first, so it reaches the element in
/// round |x| + |y|. Claim: in each round d, every element gets the pixel of its rib, and the elements are reached in this order:
/// those above the center, topmost row first; those below it, bottommost row first; then (-d, 0) and (d, 0). Round 0 satisfies
/// the claim. Suppose round d does, and consider an element (x, y) of round d + 1.
///
/// If x = 0, its only neighbor in round d is the next pixel of the spine toward the center. If y = 0, its only neighbor in round
/// d is the next pixel of the rib toward the center. Otherwise it has two neighbors in round d: A on the same rib, closer to the
/// spine, and B in the row closer to the center. A is in a row farther from the center than B, so exploration processes A first.
/// The link from A along the rib exists, so (x, y) gets the pixel of the rib.
///
/// Each element is thus reached from the previous element of its spine or rib. Elements of one row are reached in the order of
/// these predecessors. For d <= r, the first element of round d above the center is on the spine. Exploration follows its link
/// up, if the window extends that far, before the links to the left and right, so round d + 1 begins with its topmost row. The
/// same holds below the center. This is the claimed order.
///
/// Links outside spine and ribs are irrelevant, so a fold or a silhouette there changes nothing. Some windows of irregular pixels
/// are also contiguous, because exploration bypasses a gap in the spine or in a rib. They are gathered like all irregular
/// windows.
class regular_pixels {
public:
    regular_pixels(const graph_view& g, std::int32_t kernel_size) : regular_pixels(g, kernel_size, link_strips(g)) {}

    regular_pixels(const graph_view& g, std::int32_t kernel_size, const link_strips& strips)
        : radius_(kernel_size / 2), g_(g), regular_(g.size()), continues_(g.size()) {
        pixel_bits has_right(g.size());  // whether the right neighbor is the next pixel in memory
        for (const pixel_strip& strip : strips.right)
            if (strip.target == strip.first + 1) has_right.set(strip.first, strip.count, true);
        continues_ = has_right;
        regular_.set(0, g.count(), true);
        for (std::int32_t w = 0; w < regular_.word_count(); ++w)
            for (std::int32_t x = -radius_; x < radius_; ++x) regular_.word(w) &= has_right.from(w * 64 + x);
        const pixel_bits ribs = regular_;
        follow(strips.up, ribs);
        follow(strips.down, ribs);
    }

    std::int32_t kernel_size() const { return 2 * radius_ + 1; }
    bool contains(std::int32_t pixel) const { return regular_[pixel]; }

    /// Calls `visit(first, count, rows)` for each run of regular pixels whose spines are adjacent in memory. `rows` is the spine
    /// of the run's first pixel: kernel_size pixels. If `visit` returns false, the pixels of the run become irregular.
    template <class Visit>
    void for_each_segment(Visit&& visit) {
        buffer<std::int32_t> firsts, lasts, rows(static_cast<std::size_t>(2 * radius_ + 1));
        for (std::int32_t w = 0; w < regular_.word_count(); ++w) {
            const std::int32_t i = w * 64;
            append_set_bits(regular_.word(w) & ~(regular_.from(i - 1) & continues_.from(i - 1)), w, firsts);
            append_set_bits(regular_.word(w) & ~(regular_.from(i + 1) & continues_.word(w)), w, lasts);
        }
        for (std::size_t s = 0; s < firsts.size(); ++s) {
            rows[radius_] = firsts[s];
            for (std::int32_t n = 1; n <= radius_; ++n) {
                rows[radius_ - n] = g_.neighbor(rows[radius_ - n + 1], side::up);
                rows[radius_ + n] = g_.neighbor(rows[radius_ + n - 1], side::down);
            }
            const std::int32_t count = lasts[s] - firsts[s] + 1;
            if (!visit(firsts[s], count, std::span<const std::int32_t>(rows))) regular_.set(firsts[s], count, false);
        }
    }

    /// Returns all irregular pixels, ascending.
    buffer<std::int32_t> others() const {
        buffer<std::int32_t> pixels;
        for (std::int32_t w = 0; w < regular_.word_count(); ++w) append_set_bits(~regular_.word(w), w, pixels);
        while (!pixels.empty() && pixels.back() >= g_.count()) pixels.pop_back();
        return pixels;
    }

private:
    static void append_set_bits(std::uint64_t bits, std::int32_t word, buffer<std::int32_t>& pixels) {
        for (; bits != 0; bits &= bits - 1) pixels.push_back(word * 64 + std::countr_zero(bits));
    }

    /// Follows the half of each spine that extends to one side, up or down. Clears a pixel's bit in `regular_` if this half is
    /// incomplete or has an incomplete rib. Clears its bit in `continues_` if this half is not adjacent in memory to the
    /// corresponding half of the next pixel's spine.
    ///
    /// strips  links toward that side
    void follow(std::span<const pixel_strip> strips, const pixel_bits& ribs) {
        pixel_bits with_rib = ribs, side_by_side(g_.size());
        for (const pixel_strip& strip : strips) side_by_side.set(strip.first, strip.count - 1, true);
        for (std::int32_t n = 1; n <= radius_; ++n) {
            with_rib = as_seen_from_neighbors(with_rib, strips);
            regular_.keep_common(with_rib);
            if (n > 1) side_by_side = as_seen_from_neighbors(side_by_side, strips);
            continues_.keep_common(side_by_side);
        }
    }

    /// Returns, for each pixel, the bit of its neighbor along `strips`, or zero for a pixel without this neighbor.
    pixel_bits as_seen_from_neighbors(const pixel_bits& bits, std::span<const pixel_strip> strips) const {
        pixel_bits seen(g_.size());
        for (const pixel_strip& strip : strips) seen.copy(strip.first, strip.count, bits, strip.target);
        return seen;
    }

    std::int32_t radius_;
    graph_view g_;
    pixel_bits regular_;
    pixel_bits continues_;  // per pixel: whether its spine and the next pixel's spine are adjacent in memory
};

}}}  // namespace ldi::detail
