// Loop of depthwise_u8 along a row. AVX2, AVX-512 and NEON include this file inside their namespace and target region, after
// these primitives:
//
//     depthwise_max_channels      channels of a full unit
//     depthwise_lanes             type that existing_lanes() returns: the existing channels in each group of 16
//     lane_count, load(from)      32-bit sums per vector; loads a vector of sums
//     four_vectors                four vectors of sums, or of a column's interleaved bytes
//     interleave_bytes(a, b, c, d)                             interleaves the bytes of four rows
//     load_stretches<channels>(position, row, offset, lanes)   loads one vector of one row
//     store_stretches<channels>(to, offset, lanes, bytes)      stores the packed results
//
// The class Sums holds the weights of a unit and has these members:
//
//     start()                         returns the bias
//     add<place>(sum, column)         adds a column's products; `place` is window_left, window_middle or window_right
//     requantizer_of(weights)         returns a requantizer of type requantizer_type
//     requantized(requantizer, sum)   returns the packed results

inline constexpr std::size_t window_left = 0, window_middle = 1, window_right = 2;

[[gnu::always_inline]] inline four_vectors load_sums(const std::int32_t* from) {
    return {{load(from), load(from + lane_count), load(from + 2 * lane_count), load(from + 3 * lane_count)}};
}

/// Addresses of three rows, at one pixel per stretch.
template <std::size_t channels>
struct depthwise_rows {
    detail::depthwise_position<depthwise_max_channels / channels> position;
    depthwise_lanes lanes;

    /// Loads and interleaves the column at `offset` bytes after the position: rows 0, 1, 2, and row 1 again.
    [[gnu::always_inline]] four_vectors column(std::size_t offset) const {
        const auto middle = load_stretches<channels>(position, 1, offset, lanes);
        return interleave_bytes(load_stretches<channels>(position, 0, offset, lanes), middle,
                                load_stretches<channels>(position, 2, offset, lanes), middle);
    }
};

/// Requantizes and stores results at one address per stretch.
template <std::size_t channels, class Sums>
struct depthwise_result {
    std::uint8_t* at[depthwise_max_channels / channels];
    depthwise_lanes lanes;
    typename Sums::requantizer_type requantize;

    [[gnu::always_inline]] void store(const four_vectors& sums, std::size_t offset) const {
        store_stretches<channels>(at, offset, lanes, Sums::requantized(requantize, sums));
    }
};

/// Computes one unit of channels along a row.
template <std::size_t channels, class Sums>
struct depthwise_run {
    static constexpr std::size_t stretch_count = depthwise_max_channels / channels;

    detail::depthwise_stretches<stretch_count> stretches;
    Sums packed;
    std::size_t pixel_stride;
    depthwise_lanes lanes;

    /// all  number of pixels of the row, or of the result, to split into stretches
    depthwise_run(const detail::depthwise_call& call, const Sums& sums, std::size_t first_channel, std::size_t all)
        : stretches(call, first_channel, all),
          packed(sums),
          pixel_stride(call.weights.channels),
          lanes(existing_lanes(pixel_stride)) {}

    depthwise_rows<channels> rows_at(std::ptrdiff_t column, std::size_t scale) const {
        return {stretches.at(column, scale), lanes};
    }
    depthwise_rows<channels> rows_at_tap(std::size_t x, std::size_t tap) const { return {stretches.at_tap(x, tap), lanes}; }
    depthwise_result<channels, Sums> result_at(std::size_t scale) const {
        depthwise_result<channels, Sums> found{{}, lanes, Sums::requantizer_of(stretches.call.weights)};
        for (std::size_t s = 0; s < stretch_count; ++s) found.at[s] = stretches.result(s, scale);
        return found;
    }

    /// Stride 1 without repetition. Each column is the right column of one window, the middle column of the next, and the left
    /// column of the one after.
    void stride_1() const {
        const Sums sums = packed;  // a copy, so that the compiler keeps it in registers
        const std::size_t length = stretches.length, pixel_bytes = pixel_stride;
        const depthwise_rows<channels> rows = rows_at(0, 1);
        const depthwise_result<channels, Sums> result = result_at(1);
        four_vectors next = sums.template add<window_left>(sums.start(), rows_at(-1, 1).column(0));
        four_vectors column = rows.column(0);
        four_vectors current = sums.template add<window_middle>(next, column);
        next = sums.template add<window_left>(sums.start(), column);
        for (std::size_t x = 1; x < length; ++x) {
            column = rows.column(x * pixel_bytes);
            result.store(sums.template add<window_right>(current, column), (x - 1) * pixel_bytes);
            current = sums.template add<window_middle>(next, column);
            next = sums.template add<window_left>(sums.start(), column);
        }
        column = rows_at(static_cast<std::ptrdiff_t>(length), 1).column(0);
        result.store(sums.template add<window_right>(current, column), (length - 1) * pixel_bytes);
    }

    /// Stride 2 without repetition. Each pair of columns completes one window, as its middle and right columns. The second
    /// column of the pair is also the left column of the next window.
    void stride_2() const {
        const Sums sums = packed;
        const std::size_t length = stretches.length, pixel_bytes = pixel_stride;
        const depthwise_rows<channels> rows = rows_at(0, 2);
        const depthwise_result<channels, Sums> result = result_at(1);
        four_vectors current = sums.template add<window_left>(sums.start(), rows_at(-1, 2).column(0));
        for (std::size_t x = 0; x + 1 < length; ++x) {
            current = sums.template add<window_middle>(current, rows.column(2 * x * pixel_bytes));
            const four_vectors column = rows.column((2 * x + 1) * pixel_bytes);
            result.store(sums.template add<window_right>(current, column), x * pixel_bytes);
            current = sums.template add<window_left>(sums.start(), column);
        }
        const std::ptrdiff_t last = static_cast<std::ptrdiff_t>(2 * length) - 1;
        current = sums.template add<window_middle>(current, rows_at(last - 1, 2).column(0));
        result.store(sums.template add<window_right>(current, rows_at(last, 2).column(0)), (length - 1) * pixel_bytes);
    }

    /// Stride 1, with two or more copies of each column c. Column c occurs in these windows:
    ///
    ///     around the last copy of column c - 1       as the right column
    ///     around its own first and last copies       as two of the three columns
    ///     around its other copies                    as all columns
    ///     around the first copy of column c + 1      as the left column
    ///
    /// fixed_repeat  number of copies if it is a compile-time constant, else 0
    template <std::size_t fixed_repeat>
    void enlarged() const {
        const Sums sums = packed;
        const std::size_t length = stretches.length, pixel_bytes = pixel_stride;
        const std::size_t repeat = fixed_repeat != 0 ? fixed_repeat : stretches.call.repeat;
        const depthwise_rows<channels> rows = rows_at(0, 1);
        const depthwise_result<channels, Sums> result = result_at(repeat);
        four_vectors first = sums.template add<window_left>(sums.start(), rows_at(-1, 1).column(0));
        four_vectors column = rows.column(0);
        std::size_t to = 0;
        result.store(sums.template add<window_right>(sums.template add<window_middle>(first, column), column), to);
        first = sums.template add<window_left>(sums.start(), column);
        four_vectors last = sums.template add<window_middle>(first, column);
        for (std::size_t x = 1; x < length; ++x) {
            for (std::size_t copy = 2; copy < repeat; ++copy)
                result.store(sums.template add<window_right>(last, column), to += pixel_bytes);
            column = rows.column(x * pixel_bytes);
            result.store(sums.template add<window_right>(last, column), to += pixel_bytes);
            result.store(sums.template add<window_right>(sums.template add<window_middle>(first, column), column),
                         to += pixel_bytes);
            first = sums.template add<window_left>(sums.start(), column);
            last = sums.template add<window_middle>(first, column);
        }
        for (std::size_t copy = 2; copy < repeat; ++copy)
            result.store(sums.template add<window_right>(last, column), to += pixel_bytes);
        column = rows_at(static_cast<std::ptrdiff_t>(length), 1).column(0);
        result.store(sums.template add<window_right>(last, column), to + pixel_bytes);
    }

    /// Stride 2 with repetition: loads three columns per window.
    void any() const {
        const Sums sums = packed;
        const std::size_t length = stretches.length, pixel_bytes = pixel_stride;
        const depthwise_result<channels, Sums> result = result_at(1);
        for (std::size_t x = 0; x < length; ++x) {
            four_vectors sum = sums.template add<window_left>(sums.start(), rows_at_tap(x, 0).column(0));
            sum = sums.template add<window_middle>(sum, rows_at_tap(x, 1).column(0));
            result.store(sums.template add<window_right>(sum, rows_at_tap(x, 2).column(0)), x * pixel_bytes);
        }
    }
};

template <std::size_t channels, class Sums>
inline void depthwise_u8_unit(const detail::depthwise_call& call, const Sums& sums, std::size_t first_channel) {
    using run = depthwise_run<channels, Sums>;
    const std::size_t stride = call.weights.stride, result_width = call.result_width();
    if (stride == 1 && call.repeat == 1)
        run(call, sums, first_channel, call.width).stride_1();
    else if (stride == 2 && call.repeat == 1)
        run(call, sums, first_channel, result_width).stride_2();
    else if (stride == 1 && call.repeat == 2)
        run(call, sums, first_channel, call.width).template enlarged<2>();
    else if (stride == 1)
        run(call, sums, first_channel, call.width).template enlarged<0>();
    else
        run(call, sums, first_channel, result_width).any();
}

template <class Sums>
inline void depthwise_u8_unit(const detail::depthwise_call& call, const Sums& sums, const detail::depthwise_unit& unit) {
    if constexpr (depthwise_max_channels >= 64)
        if (unit.channels == 64) return depthwise_u8_unit<64>(call, sums, unit.first);
    if constexpr (depthwise_max_channels >= 32)
        if (unit.channels == 32) return depthwise_u8_unit<32>(call, sums, unit.first);
    depthwise_u8_unit<16>(call, sums, unit.first);
}

/// Computes all units of a row. Sums(values, bias) holds three columns of weights.
template <class Sums>
inline void depthwise_u8_units(const detail::depthwise_call& call) {
    const std::int8_t* values = call.weights.narrow.data();
    const std::int32_t* bias = call.weights.bias.data();
    for (std::size_t done = 0; done < call.weights.channels;) {
        const detail::depthwise_unit unit(call.weights.channels, done, depthwise_max_channels);
        depthwise_u8_unit(call, Sums(values, bias), unit);
        values += 3 * 4 * depthwise_max_channels;
        bias += depthwise_max_channels;
        done = unit.end();
    }
}
