// A tile unit in software, for kernels/gemm_u8/tiles.hpp: it computes what AMX does and notes what AMX would fault on, by
// the pseudocode of Intel's "Software Developer's Manual", volume 2 (LDTILECFG, TILELOADD, TILESTORED, TDPBUSD, TILERELEASE).
// Nothing here allocates, so that a signal handler may use it.
#pragma once

#include <ldi/kernels/gemm_u8/tiles.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace ldi_test {

/// Memory that may be read, or written.
struct memory_range {
    std::uintptr_t first = 0, end = 0;

    memory_range() = default;
    memory_range(const void* start, std::size_t bytes)
        : first(reinterpret_cast<std::uintptr_t>(start)), end(reinterpret_cast<std::uintptr_t>(start) + bytes) {}

    bool holds(const void* start, std::size_t bytes) const {
        const memory_range other(start, bytes);
        return other.first >= first && other.end <= end;
    }
};

class tile_emulation {
public:
    static constexpr std::size_t tiles = 8, most_rows = 16, most_row_bytes = 64, configuration_bytes = 64;

    /// The first rule that was broken, or nullptr.
    const char* fault = nullptr;
    /// What load_rows() may read; empty ranges at the end are not used. If all are empty, everything.
    std::array<memory_range, 10> readable{};

    bool in_use() const { return palette_ != 0; }

    void load_configuration(const void* from) {
        std::uint8_t bytes[configuration_bytes];
        std::memcpy(bytes, from, sizeof bytes);
        if (bytes[0] > 1) return note("#GP: a palette that does not exist");
        palette_ = bytes[0];
        tiles_ = {};  // all zero
        if (palette_ == 0) return;
        if (bytes[1] != 0) note("a first row to resume from that no fault has left");
        for (std::size_t i = 2; i < 16; ++i)
            if (bytes[i] != 0) note("#GP: reserved bytes 2 to 15");
        for (std::size_t i = 16 + 2 * tiles; i < 48; ++i)
            if (bytes[i] != 0) note("#GP: row bytes of a tile beyond the palette's");
        for (std::size_t i = 48 + tiles; i < 64; ++i)
            if (bytes[i] != 0) note("#GP: rows of a tile beyond the palette's");
        for (std::size_t t = 0; t < tiles; ++t) {
            tile& made = tiles_[t];
            made.row_bytes = static_cast<std::size_t>(bytes[16 + 2 * t]) + 256U * bytes[17 + 2 * t];
            made.rows = bytes[48 + t];
            if (made.row_bytes > most_row_bytes) note("#GP: rows too long");
            if (made.rows > most_rows) note("#GP: too many rows");
            if ((made.rows == 0) != (made.row_bytes == 0)) note("#GP: rows without bytes, or bytes without rows");
        }
        if (fault != nullptr) palette_ = 0;
    }

    void release_tiles() {
        palette_ = 0;
        tiles_ = {};
    }

    void load_rows(std::size_t t, const void* rows, std::size_t bytes_between) {
        if (!check_tile(t)) return;
        tile& to = tiles_[t];
        to.values = {};  // what the configuration leaves out becomes zero
        for (std::size_t r = 0; r < to.rows; ++r) {
            const std::uint8_t* const from = static_cast<const std::uint8_t*>(rows) + r * bytes_between;
            if (!may_read(from, to.row_bytes)) return note("#PF: a read outside the memory that a kernel may read");
            std::memcpy(to.values[r].data(), from, to.row_bytes);
        }
    }

    void store_rows(std::size_t t, void* rows, std::size_t bytes_between) {
        if (!check_tile(t)) return;
        const tile& from = tiles_[t];
        for (std::size_t r = 0; r < from.rows; ++r)
            std::memcpy(static_cast<std::uint8_t*>(rows) + r * bytes_between, from.values[r].data(), from.row_bytes);
    }

    /// sums (M x N) += a (M x K, unsigned) * b (K x N, signed), both of four bytes to each of K.
    void multiply_bytes(std::size_t sums, std::size_t a, std::size_t b) {
        if (!check_tile(sums) || !check_tile(a) || !check_tile(b)) return;
        if (sums == a || a == b || sums == b) return note("#UD: one register in two roles");
        tile& to = tiles_[sums];
        const tile &left = tiles_[a], &right = tiles_[b];
        if (to.row_bytes % 4 != 0 || left.row_bytes % 4 != 0 || right.row_bytes % 4 != 0)
            return note("#UD: rows that are not whole groups of four bytes");
        if (to.rows != left.rows) return note("#UD: other rows of sums than of the left factor");
        if (left.row_bytes / 4 != right.rows) return note("#UD: other columns of the left factor than rows of the right one");
        if (to.row_bytes != right.row_bytes) return note("#UD: other columns of sums than of the right factor");
        for (std::size_t m = 0; m < to.rows; ++m)
            for (std::size_t n = 0; n < to.row_bytes; n += 4) {
                std::uint32_t sum = 0;  // wraps around
                std::memcpy(&sum, to.values[m].data() + n, sizeof sum);
                for (std::size_t k = 0; k < right.rows; ++k)
                    for (std::size_t i = 0; i < 4; ++i)
                        sum += static_cast<std::uint32_t>(int{left.values[m][4 * k + i]} *
                                                          int{static_cast<std::int8_t>(right.values[k][n + i])});
                std::memcpy(to.values[m].data() + n, &sum, sizeof sum);
            }
    }

private:
    struct tile {
        std::size_t rows = 0, row_bytes = 0;
        std::array<std::array<std::uint8_t, most_row_bytes>, most_rows> values{};
    };

    void note(const char* rule) {
        if (fault == nullptr) fault = rule;
    }
    bool check_tile(std::size_t t) {
        if (palette_ == 0) note("#UD: no tiles are configured");
        if (t >= tiles || tiles_[t].rows == 0) note("#UD: a tile that is not configured");
        return fault == nullptr;
    }
    bool may_read(const void* from, std::size_t bytes) const {
        bool any = false;
        for (const memory_range& range : readable) {
            if (range.holds(from, bytes)) return true;
            any = any || range.first != range.end;
        }
        return !any;
    }

    int palette_ = 0;
    std::array<tile, tiles> tiles_{};
};

/// The unit that ldi::detail::tiled_product takes, with requantization to its definition.
struct emulated_tile_unit {
    ldi::float_requantization output;
    memory_range result;  ///< that requantize() may write to
    tile_emulation hardware{};
    std::size_t products = 0;

    void configure(const ldi::detail::tile_configuration& shapes) {
        if (hardware.in_use()) hardware.fault = "tiles of another product are still in use";
        hardware.load_configuration(&shapes);
    }
    void release() { hardware.release_tiles(); }
    template <int tile>
    void load(const void* rows, std::size_t bytes_between) {
        hardware.load_rows(tile, rows, bytes_between);
    }
    template <int tile>
    void store(void* rows, std::size_t bytes_between) {
        hardware.store_rows(tile, rows, bytes_between);
    }
    template <int sums, int pixels, int weights>
    void multiply_add() {
        hardware.multiply_bytes(sums, pixels, weights);
        ++products;
    }
    void requantize(const ldi::detail::tile_sums& sums) {
        for (std::size_t tile = 0; tile < 2; ++tile)
            for (std::size_t row = 0; row < sums.rows; ++row) {
                std::uint8_t* const to = sums.results[tile] + row * sums.outputs;
                if (!result.holds(to, sums.used)) hardware.fault = "a result is written outside the memory for it";
                if (hardware.fault != nullptr) return;
                for (std::size_t o = 0; o < sums.used; ++o)
                    to[o] = output(sums.values[(tile * sums.rows + row) * sums.row_sums + o]);
            }
    }
};

}  // namespace ldi_test
