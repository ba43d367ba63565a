// Reads the size of a coded picture in a HEIC or AVIF file from the codec's headers: HEVC (ITU-T H.265, 7.3.2.2) and AV1 (AV1
// bitstream specification, 5.5). Decoders ignore the size that the container states. Also counts the pictures in an item, because
// decoders decode all of them.
#pragma once

#include <ldi/formats/picture_header.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

struct coded_size {
    std::uint64_t width = 0, height = 0;
    bool is_deep = false;      ///< more than 8 bits per sample
    std::size_t pictures = 0;  ///< number of coded pictures; in HEVC, of slices, each of which may cover the whole picture

    void include(const coded_size& other) {
        pictures += other.pictures;
        width = (std::max)(width, other.width), height = (std::max)(height, other.height);
        is_deep = is_deep || other.is_deep;
    }
};

/// Reads bits, most significant first. Bits beyond the end are 0.
class bit_reader {
public:
    /// is_escaped  whether to skip a byte of value 3 after two zero bytes (HEVC's emulation prevention)
    bit_reader(std::span<const std::byte> bytes, bool is_escaped) : bytes_(bytes), is_escaped_(is_escaped) {}

    std::uint64_t next(unsigned count) {
        std::uint64_t value = 0;
        for (; count > 0; --count) value = value << 1 | bit();
        return value;
    }
    /// Reads an Exp-Golomb number. Valid numbers are below 2^32.
    std::uint64_t golomb() {
        unsigned zeros = 0;
        while (zeros < 32 && bit() == 0) ++zeros;
        return (std::uint64_t{1} << zeros) - 1 + next(zeros);
    }

private:
    unsigned bit() {
        if (left_ == 0) {
            const bool is_escape = is_escaped_ && at_ >= 2 && at_ < bytes_.size() && byte_at(bytes_, at_) == 3 &&
                                   byte_at(bytes_, at_ - 1) == 0 && byte_at(bytes_, at_ - 2) == 0;
            if (is_escape) ++at_;
            current_ = at_ < bytes_.size() ? byte_at(bytes_, at_) : 0;
            ++at_, left_ = 8;
        }
        return current_ >> --left_ & 1;
    }

    std::span<const std::byte> bytes_;
    bool is_escaped_;
    std::size_t at_ = 0;
    unsigned current_ = 0, left_ = 0;
};

/// Returns the size that a sequence parameter set states, or one picture of 0 x 0 for a slice, or nothing for other units.
///
/// unit  a NAL unit (network abstraction layer) of HEVC
inline coded_size size_in_hevc_unit(std::span<const std::byte> unit) {
    constexpr std::uint64_t end_of_slices = 32, sequence_parameter_set = 33;
    bit_reader bits(unit, true);
    bits.next(1);
    const std::uint64_t type = bits.next(6);
    if (type < end_of_slices) return {.pictures = unit.size() > 2 ? std::size_t{1} : 0};
    if (type != sequence_parameter_set || bits.next(6) != 0) return {};
    bits.next(3 + 4);
    const std::uint64_t layers = bits.next(3);
    bits.next(1 + 64), bits.next(32);  // profile, tier and level
    bool has_profile[8] = {}, has_level[8] = {};
    for (std::uint64_t i = 0; i < layers; ++i) has_profile[i] = bits.next(1) != 0, has_level[i] = bits.next(1) != 0;
    if (layers > 0) bits.next(static_cast<unsigned>(2 * (8 - layers)));
    for (std::uint64_t i = 0; i < layers; ++i) {
        if (has_profile[i]) bits.next(64), bits.next(24);
        if (has_level[i]) bits.next(8);
    }
    bits.golomb();
    if (bits.golomb() == 3) bits.next(1);
    coded_size size;
    size.width = bits.golomb(), size.height = bits.golomb();
    if (bits.next(1) != 0)
        for (int side = 0; side < 4; ++side) bits.golomb();
    const bool is_luma_deep = bits.golomb() > 0;
    size.is_deep = bits.golomb() > 0 || is_luma_deep;
    return size;
}

/// Returns the largest width and height that the sequence parameter sets of an item state, and the number of its slices.
///
/// data        NAL units, each preceded by its length in `length_size` bytes
/// units_left  maximum number of units to read; reduced by the number of units read
inline coded_size size_in_hevc_item(std::span<const std::byte> data, std::size_t length_size, std::size_t& units_left) {
    coded_size largest;
    for (; data.size() > length_size && units_left > 0; --units_left) {
        std::size_t length = 0;
        for (std::size_t i = 0; i < length_size; ++i) length = length << 8 | byte_at(data, i);
        data = data.subspan(length_size);
        length = (std::min)(length, data.size());
        largest.include(size_in_hevc_unit(data.first(length)));
        data = data.subspan(length);
    }
    return largest;
}

/// Returns the largest width and height that the sequence parameter sets of a decoder configuration state.
///
/// hvcc  the decoder configuration record
inline coded_size size_in_hevc_configuration(std::span<const std::byte> hvcc, std::size_t& units_left) {
    coded_size largest;
    if (hvcc.size() < 23) return largest;
    std::size_t at = 23;
    for (unsigned arrays = byte_at(hvcc, 22); arrays > 0 && at + 3 <= hvcc.size(); --arrays) {
        at += 3;
        for (unsigned units = big_endian_16(hvcc, at - 2); units > 0 && at + 2 <= hvcc.size() && units_left > 0; --units) {
            --units_left;
            const std::size_t length = (std::min)(std::size_t{big_endian_16(hvcc, at)}, hvcc.size() - at - 2);
            largest.include(size_in_hevc_unit(hvcc.subspan(at + 2, length)));
            at += 2 + length;
        }
    }
    return largest;
}

/// An AV1 sequence header: the sizes of its frames, and what a reader of their headers must know.
struct av1_sequence {
    coded_size stated;             ///< size of the frames that do not state their own
    coded_size possible;           ///< largest size that a frame can state for itself
    bool is_reduced = false;       ///< a still picture whose frame can't state a size
    unsigned time_bits = 0;        ///< length of the presentation time of a shown frame
    unsigned identifier_bits = 0;  ///< length of a frame's identifier
    unsigned screen_tools = 0;     ///< allow_screen_content_tools of all frames; 2: each frame states it
    unsigned whole_vectors = 0;    ///< force_integer_mv of all frames; 2: each frame states it
};

/// Skips the fields of an AV1 sequence header that precede the size. Returns the length of the presentation time of a shown
/// frame.
inline unsigned skip_av1_operating_points(bit_reader& bits) {
    bool has_decoder_model = false;
    unsigned delay_bits = 0, time_bits = 0;
    if (bits.next(1) != 0) {  // timing information is present
        bits.next(64);
        const bool has_equal_intervals = bits.next(1) != 0;
        if (has_equal_intervals) bits.golomb();
        has_decoder_model = bits.next(1) != 0;
        if (has_decoder_model) {
            delay_bits = static_cast<unsigned>(bits.next(5)) + 1;
            bits.next(32 + 5);
            time_bits = static_cast<unsigned>(bits.next(5)) + 1;
        }
        if (has_equal_intervals) time_bits = 0;
    }
    const bool has_display_delay = bits.next(1) != 0;
    for (std::uint64_t points = bits.next(5) + 1; points > 0; --points) {
        bits.next(12);
        if (bits.next(5) > 7) bits.next(1);
        if (has_decoder_model && bits.next(1) != 0) bits.next(2 * delay_bits + 1);
        if (has_display_delay && bits.next(1) != 0) bits.next(4);
    }
    return time_bits;
}

/// Reads the header of a sequence. AV1 Bitstream & Decoding Process Specification, section 5.5.
inline av1_sequence read_av1_sequence(std::span<const std::byte> header) {
    bit_reader bits(header, false);
    const auto number = [&](unsigned length) { return static_cast<unsigned>(bits.next(length)); };
    av1_sequence sequence;
    number(3 + 1);
    sequence.is_reduced = number(1) != 0;
    if (sequence.is_reduced)
        number(5);
    else
        sequence.time_bits = skip_av1_operating_points(bits);
    const unsigned width_bits = number(4) + 1, height_bits = number(4) + 1;
    sequence.stated.width = bits.next(width_bits) + 1, sequence.stated.height = bits.next(height_bits) + 1;
    sequence.possible.width = std::uint64_t{1} << width_bits, sequence.possible.height = std::uint64_t{1} << height_bits;
    if (sequence.is_reduced) {
        number(3);
    } else {
        if (number(1) != 0) {
            const unsigned difference_bits = number(4) + 2;
            sequence.identifier_bits = number(3) + difference_bits + 1;
        }
        number(7);
        const bool has_order = number(1) != 0;
        if (has_order) number(2);
        sequence.screen_tools = number(1) != 0 ? 2 : number(1);
        sequence.whole_vectors = sequence.screen_tools == 0 || number(1) != 0 ? 2 : number(1);
        if (has_order) number(3);
    }
    number(3);
    sequence.stated.is_deep = sequence.possible.is_deep = number(1) != 0;
    return sequence;
}

/// Whether a frame states its own size. Section 5.9.2 of the specification.
inline bool states_own_size(std::span<const std::byte> frame_header, const av1_sequence& sequence) {
    if (sequence.is_reduced) return false;
    bit_reader bits(frame_header, false);
    constexpr std::uint64_t key_frame = 0, switch_frame = 3;
    if (bits.next(1) != 0) return false;  // an earlier frame is shown
    const std::uint64_t type = bits.next(2);
    const bool is_shown = bits.next(1) != 0;
    bits.next(is_shown ? sequence.time_bits : 1);
    if (type != switch_frame && (type != key_frame || !is_shown)) bits.next(1);
    bits.next(1);
    const bool has_screen_tools = (sequence.screen_tools == 2 ? bits.next(1) : sequence.screen_tools) != 0;
    if (has_screen_tools && sequence.whole_vectors == 2) bits.next(1);
    bits.next(sequence.identifier_bits);
    return type == switch_frame || bits.next(1) != 0;
}

/// Returns the largest width and height that the frames may have, and the number of frames.
///
/// units     open bitstream units, from an item or its configuration
/// sequence  the last sequence header that was read; empty: none
inline coded_size size_in_av1_units(std::span<const std::byte> units, std::size_t& units_left,
                                    std::optional<av1_sequence>& sequence) {
    constexpr unsigned sequence_header = 1, frame_header = 3, frame = 6;
    coded_size largest;
    for (; !units.empty() && units_left > 0; --units_left) {
        const unsigned head = byte_at(units, 0);
        std::size_t at = (head & 4) != 0 ? 2 : 1, size = 0;
        const bool has_size = (head & 2) != 0;
        for (unsigned shift = 0; has_size && shift < 56 && at < units.size(); shift += 7) {
            const unsigned byte = byte_at(units, at++);
            size |= std::size_t{byte & 127} << shift;
            if (byte < 128) break;
        }
        at = (std::min)(at, units.size());
        if (!has_size) size = units.size();
        size = (std::min)(size, units.size() - at);
        const unsigned type = head >> 3 & 15;
        if (type == sequence_header) {
            sequence = read_av1_sequence(units.subspan(at, size));
            largest.include(sequence->stated);
        }
        if (type == frame_header || type == frame) {
            ++largest.pictures;
            if (sequence && states_own_size(units.subspan(at, size), *sequence)) largest.include(sequence->possible);
        }
        units = units.subspan(at + size);
    }
    return largest;
}

}}}  // namespace ldi::detail
