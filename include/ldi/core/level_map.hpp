// Level maps relate the pixels of a graph to the pixels of the graph at half resolution. Coarsening makes them; plans, pooling
// and nearest-neighbor upsampling read them (paper, section "Mapping the PConv Network to LDI", Downscaling and Upscaling).
#pragma once

#include <ldi/base/array_view.hpp>
#include <ldi/base/buffer.hpp>
#include <ldi/base/config.hpp>
#include <ldi/core/graph.hpp>

#include <cstdint>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION {

struct coarsened;
enum class orphan_rule : std::uint8_t;

namespace detail {
coarsened coarsen_sound(const graph_view& g, orphan_rule orphans);
}

/// Relates the pixels of a graph (fine pixels) to the pixels of the coarser graph that coarsen() makes from it (coarse pixels).
/// Only coarsen() makes nonempty level maps, and no function edits them, so their indices are always valid.
class level_map {
public:
    level_map() = default;
    level_map(const level_map&) = default;
    level_map& operator=(const level_map& other) { return *this = level_map(other); }
    /// The moved-from map is empty.
    level_map(level_map&& other) noexcept
        : width_(std::exchange(other.width_, 0)),
          height_(std::exchange(other.height_, 0)),
          kept_(std::move(other.kept_)),
          parent_(std::move(other.parent_)) {}
    level_map& operator=(level_map&& other) noexcept {
        width_ = std::exchange(other.width_, 0), height_ = std::exchange(other.height_, 0);
        kept_ = std::move(other.kept_), parent_ = std::move(other.parent_);
        return *this;
    }

    /// Size of the fine lattice.
    std::int32_t width() const { return width_; }
    std::int32_t height() const { return height_; }

    /// Per coarse pixel: index of the fine pixel that it keeps; ascending.
    array_view<const std::int32_t> kept() const& { return kept_; }
    array_view<const std::int32_t> kept() const&& = delete;  // the values would be destroyed with the map
    /// Per fine pixel: its coarse pixel, or no_pixel.
    array_view<const std::int32_t> parent() const& { return parent_; }
    array_view<const std::int32_t> parent() const&& = delete;
    /// Moves the values of parent() out, for a caller that needs no other part of the map. The map is then empty.
    buffer<std::int32_t> take_parent() && { return std::move(level_map(std::move(*this)).parent_); }

private:
    friend coarsened detail::coarsen_sound(const graph_view& g, orphan_rule orphans);

    level_map(const graph_view& fine, buffer<std::int32_t> kept, buffer<std::int32_t> parent)
        : width_(fine.width()), height_(fine.height()), kept_(std::move(kept)), parent_(std::move(parent)) {}

    std::int32_t width_ = 0, height_ = 0;
    buffer<std::int32_t> kept_, parent_;
};

}}  // namespace ldi
