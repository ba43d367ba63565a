// Draws a chart at the photo's full size (texture/sheets.hpp), row by row.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/charts/chart_set.hpp>
#include <ldi/core/image.hpp>
#include <ldi/texture/atlas.hpp>
#include <ldi/texture/detail/sheet_sources.hpp>
#include <ldi/texture/padding.hpp>
#include <ldi/texture/sheet_layout.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

class sheet_painter {
public:
    sheet_painter(const sheet_layout& layout, const chart& shape, const sheet_placement& place, const texture_atlas& atlas,
                  chart_placement in_atlas, image_view<const std::uint8_t> worked_on, image_view<const std::uint8_t> photo)
        : place_(place),
          atlas_(atlas),
          photo_(photo),
          sources_(shape, atlas, in_atlas, layout.padding, layout.across.margin, worked_on),
          columns_(
              samples_along(layout.across, place.photo_x, place.room.width, shape.x, shape.width, in_atlas.x, layout.padding)),
          rows_(samples_along(layout.down, place.photo_y, place.room.height, shape.y, shape.height, in_atlas.y, layout.padding)) {
    }

    std::size_t rows() const { return rows_.size(); }

    /// Draws one row of the chart's rectangle on the sheet.
    void draw(std::int32_t y, image<std::uint8_t>& sheet) const {
        std::uint8_t* to = sheet.row(place_.room.y + y) + 3 * std::ptrdiff_t{place_.room.x};
        const std::int32_t pixel_y = rows_[y].pixel;
        for (std::int32_t x = 0, end = 0; x < columns_.count(); to += 3 * (end - x), x = end) {
            const sheet_source source = sources_.at(columns_[x].pixel, pixel_y);
            const auto is_alike = [&](std::int32_t other) {  // each cleaned pixel has its own color_beside()
                return columns_[other].pixel == columns_[x].pixel ||
                       (source != sheet_source::cleaned && sources_.at(columns_[other].pixel, pixel_y) == source);
            };
            for (end = x + 1; end < columns_.count() && is_alike(end);) ++end;
            if (source == sheet_source::atlas) {
                for (std::int32_t i = x; i < end; ++i) put(in_atlas(i, y), to + 3 * (i - x));
                continue;
            }
            const std::uint8_t* const photo = photo_.row(place_.photo_y + y) + 3 * std::ptrdiff_t{place_.photo_x + x};
            if (source == sheet_source::photo) {
                std::copy_n(photo, 3 * (end - x), to);
                continue;
            }
            const color beside = sources_.color_beside(columns_[x].pixel, pixel_y);
            for (std::int32_t i = x; i < end; ++i) put(cleaned(photo + 3 * (i - x), in_atlas(i, y), beside), to + 3 * (i - x));
        }
    }

private:
    using color = std::array<float, 3>;

    /// Sample position of a texel along one axis.
    struct sample {
        std::int32_t pixel;          ///< pixel of sheet_sources that contains the texel's center
        std::int32_t first, second;  ///< texels of the atlas to interpolate between
        float share;                 ///< weight of `second`
    };

    static buffer<sample> samples_along(const sheet_scale& scale, std::int32_t photo_pixel, std::int32_t count,
                                        std::int32_t begin, std::int32_t length, std::int32_t in_atlas, std::int32_t padding) {
        buffer<sample> samples;
        samples.reserve(static_cast<std::size_t>(count));
        for (std::int32_t i = 0; i < count; ++i) {
            const double place = scale.in_layers(nearest_double(photo_pixel + i) + 0.5) - nearest_double(begin) - 0.5;
            const double before = std::floor(place);
            const auto texel = [&](double pixel) {
                const double kept = std::clamp(pixel, -nearest_double(padding), nearest_double(length + padding - 1));
                return in_atlas + static_cast<std::int32_t>(kept);
            };
            samples.push_back({scale.pixel_of(photo_pixel + i) - begin + padding, texel(before), texel(before + 1),
                               static_cast<float>(place - before)});
        }
        return samples;
    }

    color in_atlas(std::int32_t x, std::int32_t y) const {
        const sample &column = columns_[x], &row = rows_[y];
        const auto along = [&](std::int32_t texel_row, std::size_t channel) {
            const std::uint8_t* const texels = atlas_.color.row(texel_row) + channel;
            return nearest_float(texels[3 * std::ptrdiff_t{column.first}]) * (1 - column.share) +
                   nearest_float(texels[3 * std::ptrdiff_t{column.second}]) * column.share;
        };
        color result{};
        for (std::size_t c = 0; c < 3; ++c) result[c] = along(row.first, c) * (1 - row.share) + along(row.second, c) * row.share;
        return result;
    }

    /// Removes the neighboring surface's contribution from a color of the photo: projects the difference from the surface's own
    /// color onto the direction to the neighbor's color, and subtracts this projection. The remaining difference is the texture
    /// of the surface.
    static color cleaned(const std::uint8_t* photo, const color& own, const color& beside) {
        // Keeps contributions that are as small as noise, or that come from a neighbor with a similar color. The thresholds
        // were tuned by experiment.
        constexpr float min_share = 0.02F, certain_share = 0.08F, min_difference = 20;
        color result{};
        float along = 0, squared = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const float step = beside[c] - own[c];
            result[c] = nearest_float(photo[c]);
            along += (result[c] - own[c]) * step, squared += step * step;
        }
        if (squared < min_difference * min_difference) return result;
        const float share = std::clamp(along / squared, 0.0F, 1.0F);
        const float taken = share * std::clamp((share - min_share) / (certain_share - min_share), 0.0F, 1.0F);
        for (std::size_t c = 0; c < 3; ++c) result[c] -= taken * (beside[c] - own[c]);
        return result;
    }

    static void put(const color& from, std::uint8_t* to) {
        for (std::size_t c = 0; c < 3; ++c) to[c] = rounded_mean(std::clamp(from[c], 0.0F, 255.0F));
    }

    const sheet_placement& place_;
    const texture_atlas& atlas_;
    image_view<const std::uint8_t> photo_;
    sheet_sources sources_;
    buffer<sample> columns_, rows_;
};

}}}  // namespace ldi::detail
