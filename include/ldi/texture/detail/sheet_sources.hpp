// Selects the photo pixels that color a chart at full texture size (texture/sheets.hpp).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/image.hpp>
#include <ldi/texture/atlas.hpp>
#include <ldi/texture/padding.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// Source of the texels' colors inside a pixel of the layered image.
enum class sheet_source : std::uint8_t {
    atlas,
    photo,
    cleaned,  ///< photo color, with the neighboring surface's contribution removed
};

/// Color sources of the pixels in a chart's bounding box and in the padding around that box. Pixel (0, 0) is the top left corner
/// of the padding.
class sheet_sources {
public:
    sheet_sources(const chart& shape, const texture_atlas& atlas, chart_placement in_atlas, std::int32_t padding,
                  std::int32_t margin, image_view<const std::uint8_t> worked_on)
        : left_(shape.x - padding - margin),
          top_(shape.y - padding - margin),
          atlas_left_(in_atlas.x - padding),
          atlas_top_(in_atlas.y - padding),
          width_(shape.width + 2 * padding),
          height_(shape.height + 2 * padding),
          atlas_(atlas),
          worked_on_(worked_on),
          found_(static_cast<std::size_t>(height_), static_cast<std::size_t>(width_), 1, sheet_source::atlas) {
        for (std::int32_t y = 0; y < height_; ++y)
            for (std::int32_t x = 0; x < width_; ++x) found_(y, x) = own_source(x, y);
        guard_borders();
    }

    sheet_source at(std::int32_t x, std::int32_t y) const {
        return x >= 0 && y >= 0 && x < width_ && y < height_ ? found_(y, x) : sheet_source::atlas;
    }

    /// Estimates the color of the other surface that may be mixed into this pixel: among the photo's pixels within `reach` whose
    /// own source is not `photo`, the color that differs most from this pixel's own color. Returns this pixel's own color if
    /// there is no such pixel.
    std::array<float, 3> color_beside(std::int32_t x, std::int32_t y) const {
        const std::uint8_t* const own = atlas_.color.row(atlas_top_ + y) + 3 * std::ptrdiff_t{atlas_left_ + x};
        std::array<float, 3> color{nearest_float(own[0]), nearest_float(own[1]), nearest_float(own[2])};
        int largest = 0;
        for (std::int32_t v = (std::max)(y - reach, 0); v <= (std::min)(y + reach, height_ - 1); ++v)
            for (std::int32_t u = (std::max)(x - reach, 0); u <= (std::min)(x + reach, width_ - 1); ++u) {
                if (own_source(u, v) == sheet_source::photo || !is_in_photo(u, v)) continue;
                const std::uint8_t* const other = in_photo(u, v);
                int difference = 0;
                for (std::size_t c = 0; c < 3; ++c) difference += (other[c] - own[c]) * (other[c] - own[c]);
                if (difference <= largest) continue;
                largest = difference;
                color = {nearest_float(other[0]), nearest_float(other[1]), nearest_float(other[2])};
            }
        return color;
    }

private:
    /// Distance in pixels from the end of a surface or from a refilled pixel. Within this distance, a pixel that looks unmixed
    /// may contain a rim of another surface, which only the full-size photo shows. Tuned by experiment.
    static constexpr std::int32_t guarded = 2;
    /// Maximum distance, in rows and columns, at which color_beside() searches for the color of the other surface.
    static constexpr std::int32_t reach = 3;

    bool is_in_photo(std::int32_t x, std::int32_t y) const {
        return left_ + x >= 0 && top_ + y >= 0 && left_ + x < static_cast<std::int32_t>(worked_on_.width()) &&
               top_ + y < static_cast<std::int32_t>(worked_on_.height());
    }
    const std::uint8_t* in_photo(std::int32_t x, std::int32_t y) const {
        return worked_on_.row(top_ + y) + 3 * std::ptrdiff_t{left_ + x};
    }

    /// Returns the source that a pixel has by itself, independent of its neighbors.
    sheet_source own_source(std::int32_t x, std::int32_t y) const {
        if (!is_in_photo(x, y)) return sheet_source::atlas;
        const texel_kind kind = atlas_.kind(atlas_top_ + y, atlas_left_ + x);
        const std::uint8_t* const in_atlas = atlas_.color.row(atlas_top_ + y) + 3 * std::ptrdiff_t{atlas_left_ + x};
        const bool is_same = std::equal(in_atlas, in_atlas + 3, in_photo(x, y));
        if (is_same && (kind == texel_kind::photo || kind == texel_kind::copied)) return sheet_source::photo;
        return kind == texel_kind::photo || kind == texel_kind::refilled ? sheet_source::cleaned : sheet_source::atlas;
    }

    /// Changes the source of a pixel from `photo` to `cleaned` if another pixel, within `guarded` rows and columns, has a
    /// different source. Pixels outside the photo do not count. Searches along rows, then along columns.
    void guard_borders() {
        // 1 if the row has a pixel within `guarded` columns whose source is not the photo
        image<std::uint8_t> beside(found_.height(), found_.width());
        for (std::int32_t y = 0; y < height_; ++y)
            for (std::int32_t x = 0; x < width_; ++x)
                if (found_(y, x) != sheet_source::photo && is_in_photo(x, y))
                    for (std::int32_t u = (std::max)(x - guarded, 0); u <= (std::min)(x + guarded, width_ - 1); ++u)
                        beside(y, u) = 1;
        for (std::int32_t y = 0; y < height_; ++y)
            for (std::int32_t x = 0; x < width_; ++x) {
                if (beside(y, x) == 0) continue;
                for (std::int32_t v = (std::max)(y - guarded, 0); v <= (std::min)(y + guarded, height_ - 1); ++v)
                    if (found_(v, x) == sheet_source::photo) found_(v, x) = sheet_source::cleaned;
            }
    }

    std::int32_t left_, top_;  // position of pixel (0, 0) in the photo
    std::int32_t atlas_left_, atlas_top_, width_, height_;
    const texture_atlas& atlas_;
    image_view<const std::uint8_t> worked_on_;
    image<sheet_source> found_;
};

}}}  // namespace ldi::detail
