// Splits a row for depthwise kernels that keep partial sums of windows in registers. The channels are split into units that
// fill the vectors. If a unit has too few channels to fill them, the row is also split into stretches: equally long runs of
// adjacent pixels. A vector then contains the unit's channels of one pixel from each stretch.
#pragma once

#include <ldi/kernels/depthwise_u8/contract.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// A range of channels, for all pixels of a row. It has `max_channels` channels, or a half or a quarter of this number, but at
/// least 16. The last unit may overlap the one before it.
struct depthwise_unit {
    std::size_t first, channels;

    /// Selects the unit that follows the first `done` of `all` channels.
    depthwise_unit(std::size_t all, std::size_t done, std::size_t max_channels) {
        const std::size_t left = all - done;
        channels = left > 48 ? 64 : left > 16 ? 32 : 16;
        while (channels > max_channels || (channels > all && channels > 16)) channels /= 2;
        first = done + channels <= all || all < channels ? done : all - channels;
    }
    std::size_t end() const { return first + channels; }
};

/// Order of a unit's channels in four vectors of sums, which have `count` lanes in total. Vector i contains channels 4 i to
/// 4 i + 3 of every 16, because unpacking interleaves the inputs in this order. Packing the four vectors restores the channels'
/// order.
template <std::size_t count>
struct depthwise_order {
    std::size_t channels[count];

    explicit depthwise_order(const depthwise_unit& unit) {
        constexpr std::size_t lanes = count / 4;
        for (std::size_t i = 0; i < count; ++i)
            channels[i] = unit.first + (i % lanes / 4 * 16 + i / lanes * 4 + i % 4) % unit.channels;
    }
};

/// Packs weights by unit (up to `max_channels` channels), then by column of the window: 4 vectors with 4 rows per channel. The
/// fourth row has weight 0.
///
/// sign  -1 to negate the weights, else 1
template <std::size_t max_channels>
void pack_columns(depthwise_u8_data& packed, const depthwise_source& source, int sign) {
    for (std::size_t done = 0; done < packed.channels;) {
        const depthwise_unit unit(packed.channels, done, max_channels);
        const depthwise_order<max_channels> order(unit);
        for (std::size_t column = 0; column < 3; ++column)
            for (std::size_t c : order.channels)
                for (std::size_t row = 0; row < 4; ++row)
                    packed.narrow.push_back(static_cast<std::int8_t>(sign * source.weight(c, row * 3 + column)));
        for (std::size_t c : order.channels) packed.bias.push_back(sign * source.folded_bias(c));
        done = unit.end();
    }
}

struct depthwise_call {
    const depthwise_u8_data& weights;
    const std::uint8_t* const* rows;
    std::size_t width, repeat;
    std::uint8_t* result;
    alignas(64) std::uint8_t padding[64];

    depthwise_call(const depthwise_u8_data& packed, const std::uint8_t* const* from, std::size_t pixels, std::size_t repetitions,
                   std::uint8_t* to)
        : weights(packed), rows(from), width(pixels), repeat(repetitions), result(to) {
        std::memset(padding, packed.padding, sizeof padding);
    }
    std::size_t result_width() const { return weights.result_width(width, repeat); }
};

/// Addresses of one pixel per stretch in each of the three rows.
template <std::size_t stretches>
struct depthwise_position {
    const std::uint8_t* at[3][stretches];
    std::size_t moves[3];  ///< per row, the mask to apply to offsets: all ones for a row of the image, 0 for padding

    const std::uint8_t* find(std::size_t row, std::size_t stretch, std::size_t offset) const {
        return at[row][stretch] + (offset & moves[row]);
    }
};

template <std::size_t stretches>
struct depthwise_stretches {
    const depthwise_call& call;
    std::size_t first_channel, length, starts[stretches];

    /// Splits `all` pixels into stretches. The caller splits either the stored rows or the result. The last stretches may overlap
    /// those before them.
    depthwise_stretches(const depthwise_call& what, std::size_t channel, std::size_t all)
        : call(what), first_channel(channel), length((all + stretches - 1) / stretches) {
        for (std::size_t s = 0; s < stretches; ++s) starts[s] = s * length + length <= all ? s * length : all - length;
    }

    /// Returns the addresses of one column per stretch, or of padding for a column outside the row.
    depthwise_position<stretches> at(const std::size_t (&columns)[stretches]) const {
        depthwise_position<stretches> found;
        for (std::size_t r = 0; r < 3; ++r) {
            found.moves[r] = call.rows[r] == nullptr ? 0 : ~std::size_t{0};
            for (std::size_t s = 0; s < stretches; ++s) {
                const bool outside = call.rows[r] == nullptr || columns[s] >= call.width;
                found.at[r][s] = outside ? call.padding : call.rows[r] + columns[s] * call.weights.channels + first_channel;
            }
        }
        return found;
    }
    /// Returns the addresses of column `scale` * start + `column` for each stretch, where start is the stretch's first pixel.
    ///
    /// column  at least -1
    depthwise_position<stretches> at(std::ptrdiff_t column, std::size_t scale) const {
        std::size_t columns[stretches];  // -1 wraps to a value larger than any width
        for (std::size_t s = 0; s < stretches; ++s) columns[s] = starts[s] * scale + static_cast<std::size_t>(column);
        return at(columns);
    }
    /// For each stretch of the result, returns the addresses of column `tap` (0 to 2) in the window around the stretch's pixel x,
    /// for any stride and repetition.
    depthwise_position<stretches> at_tap(std::size_t x, std::size_t tap) const {
        std::size_t columns[stretches];
        for (std::size_t s = 0; s < stretches; ++s) {
            // Column of the upsampled row, plus one: 0 is the padding to the left of the row.
            const std::size_t enlarged = (starts[s] + x) * call.weights.stride + tap;
            columns[s] = enlarged == 0 ? call.width : (enlarged - 1) / call.repeat;
        }
        return at(columns);
    }
    /// Returns the address of a stretch's results, with `scale` result pixels per pixel of the stretch.
    std::uint8_t* result(std::size_t stretch, std::size_t scale) const {
        return call.result + starts[stretch] * scale * call.weights.channels + first_channel;
    }
};

}}}  // namespace ldi::detail
