// The matrix product of kernels/gemm_u8/amx.hpp, written over a tile unit: eight registers that each hold up to 16 rows of 64
// bytes, and an instruction that multiplies two of them and adds the product to a third. The processor's is one; the tests have
// another in software, which checks what the processor would fault on.
//
// A tile of activations is 16 pixels by 64 inputs, read from where they lie; one of weights 64 inputs by 16 outputs; one of sums
// 16 pixels by 16 outputs. Two tiles of pixels times two of outputs take four products for four loads and fill the eight
// registers.
#pragma once

#include <ldi/kernels/gemm_u8/contract.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

namespace ldi::inline LDI_CONFIGURATION::detail {

/// What LDTILECFG reads.
struct alignas(64) tile_configuration {
    std::uint8_t palette = 1, first_row = 0;
    std::uint8_t reserved[14] = {};
    std::uint16_t row_bytes[16] = {};  ///< palette 1 has 8 tiles; nothing may stand here and in `rows` for more
    std::uint8_t rows[16] = {};
};
static_assert(sizeof(tile_configuration) == 64);

/// The registers: sums of pixel tile 0 and output tiles 0 and 1, of pixel tile 1 and the same; pixels; weights.
struct tile_names {
    enum { sums_00, sums_01, sums_10, sums_11, pixels_0, pixels_1, weights_0, weights_1 };
};

inline constexpr std::size_t tile_rows = 16, tile_row_bytes = 64, tile_outputs = 16, tile_group = 4;
inline constexpr std::size_t tiled_pixels = 2 * tile_rows, tiled_outputs = 2 * tile_outputs;

/// How one segment's inputs are cut into tiles: all of one size, so that one configuration serves them, the last overlapping the
/// one before it. What is read of a pixel ends less than 4 bytes behind its inputs.
struct tile_inputs {
    std::size_t padded, tiles, bytes;

    explicit tile_inputs(std::size_t inputs)
        : padded(round_up(inputs)),
          tiles((padded + tile_row_bytes - 1) / tile_row_bytes),
          bytes(round_up((padded + tiles - 1) / tiles)) {}

    std::size_t first(std::size_t tile) const { return (std::min)(tile * bytes, padded - bytes); }
    std::size_t first_new(std::size_t tile) const { return tile * bytes; }  ///< that the tiles before do not hold
    std::size_t weight_bytes() const { return bytes * tile_outputs; }

private:
    static std::size_t round_up(std::size_t bytes) { return (bytes + tile_group - 1) / tile_group * tile_group; }
};

/// Up to two tiles of outputs at a time, segment by segment: tiles of rows of 16 outputs x 4 inputs.
inline void pack_tiles(gemm_u8_weights& packed, std::span<const std::uint8_t> weights, std::uint8_t weight_zero_point) {
    const tile_inputs cut(packed.inputs);
    const int sign = is_negated(packed.fast) ? -1 : 1;
    const auto append = [&](std::size_t segment, std::size_t tile, std::size_t first_output) {
        for (std::size_t group = cut.first(tile); group < cut.first(tile) + cut.bytes; group += tile_group)
            for (std::size_t o = first_output; o < first_output + tile_outputs; ++o)
                for (std::size_t i = group; i < group + tile_group; ++i) {
                    const bool counts = o < packed.outputs && i < packed.inputs && i >= cut.first_new(tile);
                    const int weight =
                        counts ? weights[(o * packed.segments + segment) * packed.inputs + i] - int{weight_zero_point} : 0;
                    packed.narrow.push_back(static_cast<std::int8_t>(sign * weight));
                }
    };
    for (std::size_t first = 0; first < packed.outputs; first += tiled_outputs)
        for (std::size_t segment = 0; segment < packed.segments; ++segment)
            for (std::size_t tile = 0; tile < cut.tiles; ++tile)
                for (std::size_t o = first; o < (std::min)(first + tiled_outputs, packed.outputs); o += tile_outputs)
                    append(segment, tile, o);
}

/// Sums that wait to be requantized: two tiles of pixels, rows behind rows.
struct tile_sums {
    const std::int32_t* values = nullptr;
    std::size_t rows = 0;           ///< of each of the two tiles
    std::size_t row_sums = 0;       ///< 16 or 32
    std::size_t used = 0;           ///< of these sums
    std::uint8_t* results[2] = {};  ///< of each tile's first pixel
    std::size_t outputs = 0;        ///< bytes from a pixel's results to the next pixel's
};

/// One product of kernels/gemm_u8.hpp. A unit has
///
///     configure(const tile_configuration&)          before anything else
///     load<tile>(const void* rows, bytes_between)    bytes_between may be 0
///     multiply_add<sums, pixels, weights>()          unsigned bytes by signed bytes, four at a time, wrapping around
///     store<tile>(void* rows, bytes_between)
///     release()                                      after everything else
///     requantize(const tile_sums&)                   to 8-bit results; nothing to do with tiles
template <class Unit>
class tiled_product {
public:
    tiled_product(Unit& unit, const gemm_u8_weights& weights, const std::uint8_t* const* segments, std::size_t pixel_stride)
        : unit_(unit), weights_(weights), segments_(segments), stride_(pixel_stride), cut_(weights.inputs) {}

    void compute(std::size_t pixels, std::uint8_t* result) {
        if (pixels == 0) return;
        // Pixels are shared out evenly to an even number of tiles, the last of which overlaps the one before it by less than
        // there are tiles. A product takes as long as its pixels have rows, so that smaller tiles cost little.
        const std::size_t tiles = (pixels + tiled_pixels - 1) / tiled_pixels * 2;
        const std::size_t rows = (pixels + tiles - 1) / tiles;
        // Tiles are configured for each product, some tens of cycles for thousands: their shape depends on the layer, and tiles
        // left in use between products would be saved and restored whenever the system switches threads.
        unit_.configure(configuration(rows));
        alignas(buffer_alignment) std::int32_t sums[tiled_pixels * tiled_outputs];
        tile_sums done;
        const std::int8_t* values = weights_.narrow.data();
        for (std::size_t first = 0; first < weights_.outputs; first += tiled_outputs) {
            const std::size_t used = (std::min)(weights_.outputs - first, tiled_outputs);
            const bool wide = used > tile_outputs;
            const std::int32_t* const bias = weights_.bias.data() + first;
            for (std::size_t tile = 0; tile < tiles; tile += 2) {
                const std::size_t starts[2] = {(std::min)(tile * rows, pixels - rows),
                                               (std::min)((tile + 1) * rows, pixels - rows)};
                wide ? multiply<2>(starts, values, bias) : multiply<1>(starts, values, bias);
                unit_.requantize(done);  // of the sums before these: the unit multiplies meanwhile
                wide ? store<2>(sums, rows) : store<1>(sums, rows);
                done = {sums, rows, wide ? tiled_outputs : tile_outputs, used, {}, weights_.outputs};
                for (std::size_t i = 0; i < 2; ++i) done.results[i] = result + starts[i] * weights_.outputs + first;
            }
            values += weights_.segments * cut_.tiles * cut_.weight_bytes() * (wide ? 2 : 1);
        }
        unit_.requantize(done);
        unit_.release();
    }

private:
    using names = tile_names;

    tile_configuration configuration(std::size_t rows) const {
        tile_configuration made;
        const auto shape = [&made](std::size_t tile, std::size_t tile_height, std::size_t bytes) {
            made.rows[tile] = static_cast<std::uint8_t>(tile_height);
            made.row_bytes[tile] = static_cast<std::uint16_t>(bytes);
        };
        for (std::size_t tile : {names::sums_00, names::sums_01, names::sums_10, names::sums_11})
            shape(tile, rows, tile_row_bytes);
        for (std::size_t tile : {names::pixels_0, names::pixels_1}) shape(tile, rows, cut_.bytes);
        for (std::size_t tile : {names::weights_0, names::weights_1}) shape(tile, cut_.bytes / tile_group, tile_row_bytes);
        return made;
    }

    template <std::size_t output_tiles>
    [[gnu::always_inline]] void multiply(const std::size_t (&starts)[2], const std::int8_t* values, const std::int32_t* bias) {
        unit_.template load<names::sums_00>(bias, 0);  // the same row for every pixel
        unit_.template load<names::sums_10>(bias, 0);
        if constexpr (output_tiles == 2) {
            unit_.template load<names::sums_01>(bias + tile_outputs, 0);
            unit_.template load<names::sums_11>(bias + tile_outputs, 0);
        }
        for (std::size_t s = 0; s < weights_.segments; ++s)
            for (std::size_t tile = 0; tile < cut_.tiles; ++tile) {
                const std::uint8_t* const inputs = segments_[s] + cut_.first(tile);
                unit_.template load<names::pixels_0>(inputs + starts[0] * stride_, stride_);
                unit_.template load<names::weights_0>(values, tile_row_bytes);
                unit_.template multiply_add<names::sums_00, names::pixels_0, names::weights_0>();
                unit_.template load<names::pixels_1>(inputs + starts[1] * stride_, stride_);
                unit_.template multiply_add<names::sums_10, names::pixels_1, names::weights_0>();
                values += cut_.weight_bytes();
                if constexpr (output_tiles == 2) {
                    unit_.template load<names::weights_1>(values, tile_row_bytes);
                    unit_.template multiply_add<names::sums_01, names::pixels_0, names::weights_1>();
                    unit_.template multiply_add<names::sums_11, names::pixels_1, names::weights_1>();
                    values += cut_.weight_bytes();
                }
            }
    }

    template <std::size_t output_tiles>
    [[gnu::always_inline]] void store(std::int32_t* sums, std::size_t rows) {
        constexpr std::size_t row_sums = output_tiles * tile_outputs, row_bytes = row_sums * sizeof(std::int32_t);
        unit_.template store<names::sums_00>(sums, row_bytes);
        if constexpr (output_tiles == 2) unit_.template store<names::sums_01>(sums + tile_outputs, row_bytes);
        unit_.template store<names::sums_10>(sums + rows * row_sums, row_bytes);
        if constexpr (output_tiles == 2) unit_.template store<names::sums_11>(sums + rows * row_sums + tile_outputs, row_bytes);
    }

    Unit& unit_;
    const gemm_u8_weights& weights_;
    const std::uint8_t* const* segments_;
    std::size_t stride_;
    tile_inputs cut_;
};

}  // namespace ldi::detail
