// Textures of a 3D photo: its atlas, and sheets at the photo's own size if the photo is shown larger than its layered image
// (`photo3d --size`).
#pragma once

#include "heap.hpp"

#include <ldi/core/image.hpp>
#include <ldi/mesh/move_to_sheets.hpp>
#include <ldi/photo3d.hpp>
#include <ldi/render/gap_colors.hpp>
#include <ldi/render/rasterizer.hpp>
#include <ldi/texture/sheets.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

namespace ldi::examples {

/// Whether a photo is shown larger than its layered image.
inline bool needs_sheets(image_view<const std::uint8_t> photo, std::size_t shown_side, std::size_t worked_side) {
    return std::min(shown_side, std::max(photo.height(), photo.width())) > worked_side;
}

class photo_texture {
public:
    /// made         3D photo; if the photo needs sheets, made with options that for_sheets() has adapted
    /// photo        source of `made`, H x W x 3; must outlive this object
    /// shown_side   long side of the shown photo; larger photos are shrunk to it
    /// worked_side  long side of the layered image
    template <executor Executor>
    photo_texture(const photo3d& made, image_view<const std::uint8_t> photo, std::size_t shown_side, std::size_t worked_side,
                  Executor& threads)
        : made_(made), photo_(made.photo) {
        if (!needs_sheets(photo, shown_side, worked_side)) return;
        trim_heap();  // the memory that the stages released is too fragmented for sheets
        photo_ = photo;
        if (shown_side < std::max(photo.height(), photo.width())) {
            shrunk_ = ldi::shrink_photo(photo, shown_side, threads);
            photo_ = shrunk_;
        }
        sheet_options sheets;
        sheets.margin = made.facts.margin;
        layout_ = lay_out_sheets(made.layers, made.charts, made.atlas, photo_.height(), photo_.width(), sheets);
        on_sheets_ = move_to_sheets(made.mesh, made.charts, made.atlas, *layout_);
    }
    photo_texture(const photo_texture&) = delete;
    photo_texture& operator=(const photo_texture&) = delete;

    /// The mesh, with one part per texture.
    const textured_mesh& mesh() const { return layout_ ? on_sheets_ : made_.mesh; }
    /// Number of textures.
    std::size_t count() const { return mesh().part_count(); }
    /// Size of the shown photo.
    std::size_t height() const { return photo_.height(); }
    std::size_t width() const { return photo_.width(); }

    /// Calls `use(number, picture)` for each texture; at most one sheet is in memory at a time.
    template <class Use, executor Executor>
    void for_each(Use&& use, Executor& threads) const {
        use(std::size_t{0}, made_.atlas.color);
        for (std::size_t i = 1; i < count(); ++i) use(i, sheet(i, threads));
    }

    /// Draws the 3D photo from a viewpoint. Uses the sheets only if the picture is larger than the layered image. gap_colors()
    /// fills gaps and the area beyond the photo's border.
    template <executor Executor>
    rendering draw(const view& from, raster_options options, Executor& threads) {
        rendering seen = draw_surfaces(from, options, threads);
        if (!has_gaps(seen)) return seen;
        const image<std::uint8_t> backdrop = gap_colors(std::move(seen));
        options.backdrop = backdrop;
        return draw_surfaces(from, options, threads);
    }

    /// The camera that took the photo, at the size of the shown photo.
    pinhole_camera camera() const {
        pinhole_camera shown = made_.facts.camera;
        shown.focal_length *= static_cast<float>(width()) / static_cast<float>(shown.width);
        shown.width = static_cast<std::int32_t>(width()), shown.height = static_cast<std::int32_t>(height());
        return shown;
    }

private:
    template <executor Executor>
    rendering draw_surfaces(const view& from, const raster_options& options, Executor& threads) {
        if (!layout_ || (from.camera.width <= made_.facts.camera.width && from.camera.height <= made_.facts.camera.height))
            return rasterize(made_.mesh, made_.atlas.color, from, options, threads);
        if (drawn_.empty())
            for_each([&](std::size_t, const image<std::uint8_t>& picture) { drawn_.push_back(picture); }, threads);
        return rasterize(on_sheets_, drawn_, from, options, threads);
    }

    template <executor Executor>
    image<std::uint8_t> sheet(std::size_t i, Executor& threads) const {
        return draw_sheet(*layout_, i, made_.charts, made_.atlas, made_.photo, photo_, threads);
    }

    const photo3d& made_;
    image<std::uint8_t> shrunk_;
    image_view<const std::uint8_t> photo_;
    std::optional<sheet_layout> layout_;  // empty: the atlas is the only texture
    textured_mesh on_sheets_;
    std::vector<image<std::uint8_t>> drawn_;  // all textures, kept for draw()
};

}  // namespace ldi::examples
