// Draws a chart as large as the photo (texture/sheets.hpp), row by row.
#pragma once

#include <ldi/base/memory.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/charts/charts.hpp>
#include <ldi/core/image.hpp>
#include <ldi/texture/atlas.hpp>
#include <ldi/texture/padding.hpp>
#include <ldi/texture/sheet_layout.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace ldi::inline LDI_CONFIGURATION::detail {

class sheet_painter {
public:
    sheet_painter(const sheet_layout& layout, const chart& shape, const sheet_placement& place, const texture_atlas& atlas,
                  chart_placement in_atlas, image_view<const std::uint8_t> worked_on, image_view<const std::uint8_t> photo)
        : shape_(shape),
          place_(place),
          atlas_(atlas),
          in_atlas_(in_atlas),
          padding_(layout.padding),
          worked_on_(worked_on),
          photo_(photo) {
        columns_ = samples_along(layout.across, place.photo_x, place.room.width, shape.x, shape.width);
        rows_ = samples_along(layout.down, place.photo_y, place.room.height, shape.y, shape.height);
    }

    std::size_t rows() const { return rows_.size(); }

    /// Draws rows of the chart's room. Rows share nothing: threads may draw different ones at once.
    void draw(std::size_t first_row, std::size_t last_row, image<std::uint8_t>& sheet) const {
        buffer<source> sources;
        for (std::size_t y = first_row; y < last_row; ++y) {
            if (y == first_row || rows_[y].pixel != rows_[y - 1].pixel) find_sources(rows_[y].pixel, sources);
            std::uint8_t* const to = sheet.row(place_.room.y + static_cast<std::int32_t>(y)) + 3 * std::ptrdiff_t{place_.room.x};
            draw_row(static_cast<std::int32_t>(y), sources, to);
        }
    }

private:
    /// Where the color of the texels in a pixel of the layered image comes from.
    enum class source : std::uint8_t {
        atlas,
        photo,
        either,  ///< the photo where it looks like the atlas, for what is in sight but had its color changed
    };

    /// A texel along one direction. Places count from the chart's first pixel.
    struct sample {
        std::int32_t pixel;      ///< that its middle lies in
        std::int32_t texels[2];  ///< of the atlas, between which the atlas is interpolated
        float share;             ///< of the second
    };

    buffer<sample> samples_along(const sheet_scale& scale, std::int32_t photo_pixel, std::int32_t count, std::int32_t chart_begin,
                                 std::int32_t chart_length) const {
        buffer<sample> samples;
        samples.reserve(static_cast<std::size_t>(count));
        for (std::int32_t i = 0; i < count; ++i) {
            const double place =
                (nearest_double(photo_pixel + i) + 0.5) * nearest_double(scale.layers) / nearest_double(scale.photo) -
                nearest_double(chart_begin) - 0.5;
            const double before = std::floor(place);
            const auto kept = [&](double texel) {
                return static_cast<std::int32_t>(
                    std::clamp(texel, -nearest_double(padding_), nearest_double(chart_length + padding_ - 1)));
            };
            samples.push_back({scale.pixel_of(photo_pixel + i) - chart_begin,
                               {kept(before), kept(before + 1)},
                               static_cast<float>(place - before)});
        }
        return samples;
    }

    /// Of the pixels of a row, from `padding_` before the chart's first to `padding_` behind its last.
    void find_sources(std::int32_t row, buffer<source>& sources) const {
        sources.assign(static_cast<std::size_t>(shape_.width + 2 * padding_), source::atlas);
        const std::int32_t y = shape_.y + row;
        if (row < -padding_ || row >= shape_.height + padding_ || y < 0 || y >= static_cast<std::int32_t>(worked_on_.height()))
            return;
        for (std::int32_t i = -padding_; i < shape_.width + padding_; ++i) {
            const std::int32_t x = shape_.x + i;
            if (x < 0 || x >= static_cast<std::int32_t>(worked_on_.width())) continue;
            const std::int32_t u = in_atlas_.x + i, v = in_atlas_.y + row;
            const texel_kind kind = atlas_.kind(v, u);
            const bool is_same =
                std::equal(worked_on_.row(y) + 3 * x, worked_on_.row(y) + 3 * x + 3, atlas_.color.row(v) + 3 * u);
            if (is_same && (kind == texel_kind::photo || kind == texel_kind::copied))
                sources[i + padding_] = source::photo;
            else if (kind == texel_kind::photo || kind == texel_kind::refilled)
                sources[i + padding_] = source::either;
        }
    }

    source source_at(const buffer<source>& sources, std::int32_t x) const {
        const std::int32_t i = columns_[x].pixel + padding_;
        return i >= 0 && i < sources.count() ? sources[i] : source::atlas;
    }

    void draw_row(std::int32_t y, const buffer<source>& sources, std::uint8_t* to) const {
        for (std::int32_t x = 0; x < columns_.count();) {
            const source from = source_at(sources, x);
            std::int32_t end = x + 1;
            while (end < columns_.count() && source_at(sources, end) == from) ++end;
            const std::uint8_t* const photo =
                from == source::atlas ? nullptr : photo_.row(place_.photo_y + y) + 3 * std::ptrdiff_t{place_.photo_x + x};
            if (from == source::photo)
                std::copy_n(photo, 3 * (end - x), to + 3 * x);
            else
                mix(y, x, end, photo, to + 3 * x);
            x = end;
        }
    }

    /// The atlas, enlarged, and the photo, if any, where it looks the same.
    void mix(std::int32_t y, std::int32_t first, std::int32_t last, const std::uint8_t* photo, std::uint8_t* to) const {
        // Largest differences in red, green or blue, between which the photo gives way to the atlas. Of the second size, colors
        // begin to look different (mixed_color_options::contrast). By trial.
        constexpr float alike = 12, different = 36;
        const sample& row = rows_[y];
        const std::ptrdiff_t upper = in_atlas_.y + row.texels[0], lower = in_atlas_.y + row.texels[1];
        for (std::int32_t x = first; x < last; ++x, to += 3) {
            const std::ptrdiff_t left = in_atlas_.x + columns_[x].texels[0], right = in_atlas_.x + columns_[x].texels[1];
            if (is_empty(upper, left) && is_empty(upper, right) && is_empty(lower, left) && is_empty(lower, right)) continue;
            const float share = columns_[x].share;
            const auto along = [&](std::ptrdiff_t v, std::size_t channel) {
                const std::uint8_t *const a = atlas_.color.row(v) + 3 * left, *const b = atlas_.color.row(v) + 3 * right;
                return nearest_float(a[channel]) * (1 - share) + nearest_float(b[channel]) * share;
            };
            std::array<float, 3> color{};
            for (std::size_t c = 0; c < 3; ++c) color[c] = along(upper, c) * (1 - row.share) + along(lower, c) * row.share;
            if (photo != nullptr) {
                float difference = 0;
                for (std::size_t c = 0; c < 3; ++c)
                    difference = (std::max)(difference, std::abs(nearest_float(photo[c]) - color[c]));
                const float kept = std::clamp((different - difference) / (different - alike), 0.0F, 1.0F);
                for (std::size_t c = 0; c < 3; ++c) color[c] += kept * (nearest_float(photo[c]) - color[c]);
                photo += 3;
            }
            for (std::size_t c = 0; c < 3; ++c) to[c] = rounded_mean(color[c]);
        }
    }

    bool is_empty(std::ptrdiff_t v, std::ptrdiff_t u) const { return atlas_.kind(v, u) == texel_kind::empty; }

    const chart& shape_;
    const sheet_placement& place_;
    const texture_atlas& atlas_;
    chart_placement in_atlas_;
    std::int32_t padding_;
    image_view<const std::uint8_t> worked_on_, photo_;
    buffer<sample> columns_, rows_;
};

}  // namespace ldi::detail
