// Layout of full-size charts on sheets (texture/sheets.hpp).
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/texture/packing.hpp>
#include <ldi/texture/padding.hpp>

#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION {

/// Options of lay_out_sheets() and max_chart_side().
struct sheet_options {
    /// Maximum width and height of a sheet in texels; a multiple of 16. Phones support at least 4096.
    std::int32_t max_side = 4096;
    /// Padding around charts, in pixels of the layered image; at least 1, and at most the atlas's filter padding.
    std::int32_t padding = 4;
    /// Width of the margin beyond each side of the photo, in pixels of the layered image (photo_facts::margin).
    std::int32_t margin = 0;
};

/// Scale along one axis: `photo` pixels of the photo cover the same length as `layers` pixels of the layered image. Positions in
/// the layered image include its margin.
struct sheet_scale {
    /// `photo`: pixels of the photo; `layers`: pixels of the layered image without its margin
    std::int64_t photo = 1, layers = 1;
    std::int32_t margin = 0;

    /// Converts a position in the layered image to a position in the photo.
    double in_photo(double place) const {
        return (place - margin) * detail::nearest_double(photo) / detail::nearest_double(layers);
    }
    /// Converts a position in the photo to a position in the layered image.
    double in_layers(double place) const {
        return place * detail::nearest_double(layers) / detail::nearest_double(photo) + margin;
    }
    /// Returns the pixel of the layered image that contains the center of a photo pixel. The result may lie outside the layered
    /// image.
    std::int32_t pixel_of(std::int64_t photo_pixel) const {
        return static_cast<std::int32_t>(floored((2 * photo_pixel + 1) * layers, 2 * photo)) + margin;
    }
    /// Returns the last photo pixel that starts at or before the start of a pixel of the layered image.
    std::int64_t first_at(std::int64_t pixel) const { return floored((pixel - margin) * photo, layers); }
    /// Returns the first photo pixel that starts at or after the start of a pixel of the layered image.
    std::int64_t last_at(std::int64_t pixel) const { return -floored((margin - pixel) * photo, layers); }

private:
    static std::int64_t floored(std::int64_t a, std::int64_t positive) { return a / positive - (a % positive < 0 ? 1 : 0); }
};

/// Position of a chart on a sheet.
struct sheet_placement {
    std::int32_t sheet = 0;                 ///< 0: the chart stays in the atlas, and the other members are unused
    atlas_rectangle room = {};              ///< rectangle on the sheet
    std::int32_t photo_x = 0, photo_y = 0;  ///< photo pixel at the room's top left texel; may lie outside the photo
};

/// The sheets of a mesh, and the position of each chart on them; the result of lay_out_sheets().
struct sheet_layout {
    sheet_scale across, down;
    std::int32_t padding = 0;
    buffer<rectangle_size> sizes;        ///< sizes of all textures in texels: the atlas, then the sheets
    buffer<sheet_placement> placements;  ///< one per chart
};

}}  // namespace ldi
