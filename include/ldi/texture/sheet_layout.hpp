// Places of full-size charts on sheets (texture/sheets.hpp).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/texture/packing.hpp>
#include <ldi/texture/padding.hpp>

#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

struct sheet_options {
    /// A sheet is at most this wide and high, in texels; a multiple of 16. Telephones take 4096.
    std::int32_t max_side = 4096;
    /// Around charts, in pixels of the layered image; at least 1, and at most the atlas's filter padding.
    std::int32_t padding = 4;
    /// Pixels of the layered image on each side beyond the photo's (photo_facts::margin).
    std::int32_t margin = 0;
};

/// Along one direction: the pixels of the photo, which count more or less than those of the layered image. Places in the layered
/// image count from the edge of its margin.
struct sheet_scale {
    std::int64_t photo = 1, layers = 1;  ///< pixels of the photo; the layered image's within its margin
    std::int32_t margin = 0;

    /// A place of the layered image in the photo.
    double in_photo(double place) const {
        return (place - margin) * detail::nearest_double(photo) / detail::nearest_double(layers);
    }
    /// A place of the photo in the layered image.
    double in_layers(double place) const {
        return place * detail::nearest_double(layers) / detail::nearest_double(photo) + margin;
    }
    /// The pixel of the layered image, below 0 or beyond the last maybe, in which the middle of a pixel of the photo lies.
    std::int32_t pixel_of(std::int64_t photo_pixel) const { return floored((2 * photo_pixel + 1) * layers, 2 * photo) + margin; }
    /// The pixel of the photo at whose place, or before, a pixel of the layered image begins.
    std::int32_t first_at(std::int64_t pixel) const { return floored((pixel - margin) * photo, layers); }
    /// The pixel of the photo that begins at the same place, or behind.
    std::int32_t last_at(std::int64_t pixel) const { return -floored((margin - pixel) * photo, layers); }

private:
    static std::int32_t floored(std::int64_t a, std::int64_t positive) {
        return static_cast<std::int32_t>(a / positive - (a % positive < 0 ? 1 : 0));
    }
};

/// The place of a chart.
struct sheet_placement {
    std::int32_t sheet = 0;                 ///< 0: it stays in the atlas, and nothing else here counts
    atlas_rectangle room = {};              ///< on the sheet
    std::int32_t photo_x = 0, photo_y = 0;  ///< the pixel of the photo at the room's top left texel; it may lie outside
};

struct sheet_layout {
    sheet_scale across, down;
    std::int32_t padding = 0;
    buffer<rectangle_size> sizes;        ///< of all textures, in texels: the atlas, then the sheets
    buffer<sheet_placement> placements;  ///< one per chart
};

}}  // namespace ldi
