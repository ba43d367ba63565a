// Reads the first picture of a TIFF file with libtiff. Accepts every kind of picture that libtiff converts to 8-bit RGB.
// Rejects camera raw files, that is, DNG files and TIFF files that begin with a thumbnail.
#pragma once

#include <ldi/base/numbers.hpp>
#include <ldi/formats/jpeg_png_header.hpp>
#include <ldi/formats/picture_header.hpp>
#include <ldi/io/detail/decoding_budget.hpp>
#include <ldi/io/detail/stored_photo.hpp>
#include <ldi/io/detail/tiff_directory.hpp>

#include <tiffio.h>

#include <algorithm>
#include <bit>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <optional>
#include <span>
#include <string>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

/// A file in memory for libtiff's callbacks, and libtiff's first error message.
struct tiff_memory {
    std::span<const std::byte> bytes;
    std::size_t position = 0;
    std::string complaint;

    static tiff_memory& of(thandle_t self) { return *static_cast<tiff_memory*>(self); }
    static tmsize_t read(thandle_t self, void* to, tmsize_t size) {
        tiff_memory& file = of(self);
        const std::size_t left = file.bytes.size() - (std::min)(file.position, file.bytes.size());
        const std::size_t count = (std::min)(left, static_cast<std::size_t>((std::max)(size, tmsize_t{0})));
        if (count > 0) std::memcpy(to, file.bytes.data() + file.position, count);
        file.position += count;
        return static_cast<tmsize_t>(count);
    }
    static tmsize_t write(thandle_t, void*, tmsize_t) { return 0; }
    static toff_t seek(thandle_t self, toff_t offset, int whence) {
        tiff_memory& file = of(self);
        const toff_t base = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? file.position : file.bytes.size();
        file.position = static_cast<std::size_t>(base + offset);
        return file.position;
    }
    static int close(thandle_t) { return 0; }
    static toff_t size(thandle_t self) { return of(self).bytes.size(); }
    static int complain(TIFF*, void* self, const char*, const char* format, va_list arguments) {
        std::string& complaint = of(self).complaint;
        char text[200];
        std::vsnprintf(text, sizeof text, format, arguments);
        if (complaint.empty()) complaint = text;
        return 1;
    }
    static int ignore(TIFF*, void*, const char*, const char*, va_list) { return 1; }
};

struct tiff_closer {
    void operator()(TIFF* file) const { TIFFClose(file); }
    void operator()(TIFFOpenOptions* options) const { TIFFOpenOptionsFree(options); }
};
using tiff_handle = std::unique_ptr<TIFF, tiff_closer>;

inline tiff_handle open_tiff(tiff_memory& memory, std::size_t max_block) {
    const std::unique_ptr<TIFFOpenOptions, tiff_closer> options(TIFFOpenOptionsAlloc());
    if (!options) return nullptr;
    TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), static_cast<tmsize_t>(max_block));
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), tiff_memory::complain, &memory);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), tiff_memory::ignore, nullptr);
    return tiff_handle(TIFFClientOpenExt("photo", "rm", &memory, tiff_memory::read, tiff_memory::write, tiff_memory::seek,
                                         tiff_memory::close, tiff_memory::size, nullptr, nullptr, options.get()));
}

/// Whether JPEG data have a progressive frame, whose cost depends on its scans. Time is linear in the bytes.
inline bool is_progressive_jpeg(std::span<const std::byte> jpeg) {
    for (std::size_t at = find_jpeg_marker(jpeg, 0); at + 4 <= jpeg.size();) {
        const unsigned marker = byte_at(jpeg, at + 1);
        if (marker == 0xC2 || marker == 0xC6 || marker == 0xCA || marker == 0xCE) return true;
        if (marker == 0xDA) return false;
        at = find_jpeg_marker(jpeg, at + 2 + big_endian_16(jpeg, at + 2));
    }
    return false;
}

/// An open TIFF file. The constructor reads its directory and charges the cost of decoding.
struct opened_tiff {
    tiff_memory memory;
    tiff_handle file;
    picture_header header;

    /// Raises unsupported, invalid_data, too_large.
    opened_tiff(std::span<const std::byte> bytes, decoding_budget& budget, const std::string& where) : memory{bytes, 0, {}} {
        budget.check_format(picture_format::tiff, where);
        // libtiff loads the values of every entry, even if several entries share them, so a small file could exhaust memory.
        double listed = 0;
        tiff_directory(bytes).for_each([&](const tiff_directory::entry& e) {
            if (!e.is_inside) listed += (std::min)(e.bytes, nearest_double(bytes.size()));
        });
        budget.charge(2 * listed, where, "a directory of " + std::to_string(static_cast<std::uint64_t>(listed)) + " bytes");
        file = open_tiff(memory, budget.left());
        if (!file) broken(where);
        charge_header(budget, where);
    }

    opened_tiff(const opened_tiff&) = delete;  // libtiff keeps the address of `memory`
    opened_tiff& operator=(const opened_tiff&) = delete;

    [[noreturn]] void broken(const std::string& where) const {
        const bool is_damaged =
            memory.complaint.find("(0 elements") != std::string::npos;  // "Failed to allocate memory (0 elements"
        for (const char* const said : {"No space", "ut of memory", "nsufficient memory", "allocate memory"})
            if (!is_damaged && memory.complaint.find(said) != std::string::npos)
                raise(error_code::out_of_memory, where, "enough memory", "too little: " + memory.complaint);
        damaged(picture_format::tiff, where, memory.complaint.empty() ? "data that cannot be decoded" : memory.complaint);
    }

private:
    /// Returns the compression. Raises unsupported for compressions whose decoders may use more memory or
    /// time than the size of a strip or tile suggests, or end the program (JBIG).
    std::uint16_t check_compression(const std::string& where) const {
        std::uint16_t compression = COMPRESSION_NONE;
        TIFFGetFieldDefaulted(file.get(), TIFFTAG_COMPRESSION, &compression);
        switch (compression) {
            case COMPRESSION_NONE:
            case COMPRESSION_CCITTRLE:
            case COMPRESSION_CCITTFAX3:
            case COMPRESSION_CCITTFAX4:
            case COMPRESSION_LZW:
            case COMPRESSION_ADOBE_DEFLATE:
            case COMPRESSION_DEFLATE:
            case COMPRESSION_PACKBITS:
            case COMPRESSION_JPEG: return compression;
            default:
                raise(error_code::unsupported, where,
                      "a TIFF file without compression, or with LZW, Deflate, PackBits, CCITT or JPEG",
                      "compression " + std::to_string(compression));
        }
    }

    /// Reads the directory into `header`, and charges the cost of decoding.
    void charge_header(decoding_budget& budget, const std::string& where) {
        std::uint32_t width = 0, height = 0, kind = 0;
        const void* data = nullptr;
        TIFFGetField(file.get(), TIFFTAG_SUBFILETYPE, &kind);
        if ((kind & FILETYPE_REDUCEDIMAGE) != 0 || TIFFGetField(file.get(), TIFFTAG_DNGVERSION, &data) == 1)
            raise(error_code::unsupported, where, "a TIFF picture", "a camera's raw file (develop it first)");
        TIFFGetField(file.get(), TIFFTAG_IMAGEWIDTH, &width);
        TIFFGetField(file.get(), TIFFTAG_IMAGELENGTH, &height);
        if (width == 0 || height == 0) broken(where);
        const std::uint16_t compression = check_compression(where);
        const bool is_jpeg = compression == COMPRESSION_JPEG;
        const bool is_fax =
            compression == COMPRESSION_CCITTRLE || compression == COMPRESSION_CCITTFAX3 || compression == COMPRESSION_CCITTFAX4;
        header.format = picture_format::tiff;
        header.width = width, header.height = height;
        header.memory_per_pixel = 8;  // packed RGBA, then RGB
        // more_memory covers the compressed bytes (at most the whole file), the samples of a strip or tile, and the packed
        // samples of a tile. The samples of a strip or tile count twice, because some codecs keep two copies. If each channel is
        // a separate plane, they count eight times.
        std::uint32_t tile_width = 0, tile_height = 0;
        const bool is_tiled = TIFFIsTiled(file.get()) != 0;
        if (is_tiled) {
            TIFFGetField(file.get(), TIFFTAG_TILEWIDTH, &tile_width);
            TIFFGetField(file.get(), TIFFTAG_TILELENGTH, &tile_height);
        }
        std::uint16_t layout = PLANARCONFIG_CONTIG;
        TIFFGetFieldDefaulted(file.get(), TIFFTAG_PLANARCONFIG, &layout);
        const double part = nearest_double(is_tiled ? TIFFTileSize64(file.get()) : TIFFStripSize64(file.get()));
        header.more_memory = nearest_double(memory.bytes.size()) + 2 * part * (layout == PLANARCONFIG_CONTIG ? 1 : 4) +
                             4 * nearest_double(tile_width) * nearest_double(tile_height);
        if (is_fax) header.more_memory += 16 * nearest_double(is_tiled ? tile_width : width);  // libtiff's tables of a row's runs
        budget.charge(header, where);
        // Several strips or tiles may share the same bytes of the file, and libtiff reads them for each.
        const std::uint32_t parts = is_tiled ? TIFFNumberOfTiles(file.get()) : TIFFNumberOfStrips(file.get());
        const double size = nearest_double(memory.bytes.size());
        double coded = 0;
        for (std::uint32_t i = 0; i < parts && coded <= 2 * size; ++i) {
            const std::uint64_t begin = TIFFGetStrileOffset(file.get(), i), bytes = TIFFGetStrileByteCount(file.get(), i);
            coded += (std::min)(nearest_double(bytes), size);
            const std::uint64_t first = (std::min)(begin, std::uint64_t{memory.bytes.size()});
            const std::span<const std::byte> rest = memory.bytes.subspan(static_cast<std::size_t>(first));
            // libtiff passes only these bytes to its decoder, so the sum above also bounds this search.
            if (is_jpeg &&
                is_progressive_jpeg(rest.first(static_cast<std::size_t>((std::min)(bytes, std::uint64_t{rest.size()})))))
                raise(error_code::unsupported, where, "baseline JPEG in a TIFF file", "progressive JPEG");
        }
        if (coded > 2 * size) raise(error_code::too_large, where, "strips or tiles of at most twice the file's size", "more");
        // libtiff decodes all channels, although the photo uses at most four of them.
        std::uint16_t channels = 1;
        TIFFGetFieldDefaulted(file.get(), TIFFTAG_SAMPLESPERPIXEL, &channels);
        if (!is_tiled) {
            budget.charge_samples(
                nearest_double(width) * nearest_double(height) * nearest_double(channels), where,
                std::to_string(channels) + " channels of " + std::to_string(width) + " x " + std::to_string(height));
            return;
        }
        // libtiff decodes whole tiles, even if most of a tile lies outside the picture.
        budget.charge_samples(  // `parts` counts the tiles of all planes, if each channel is a separate plane
            nearest_double(parts) * nearest_double(tile_width) * nearest_double(tile_height) *
                (layout == PLANARCONFIG_CONTIG ? nearest_double(channels) : 1.0),
            where, std::to_string(parts) + " tiles of " + std::to_string(tile_width) + " x " + std::to_string(tile_height));
    }
};

/// Decodes the first picture. Raises unsupported, invalid_data, too_large.
inline stored_photo decode_tiff(std::span<const std::byte> bytes, decoding_budget& budget, const std::string& where) {
    opened_tiff opened(bytes, budget, where);
    const tiff_handle& file = opened.file;
    const std::uint32_t width = static_cast<std::uint32_t>(opened.header.width),
                        height = static_cast<std::uint32_t>(opened.header.height);
    char reason[1024] = "";
    if (TIFFRGBAImageOK(file.get(), reason) == 0)
        raise(error_code::unsupported, where, "a TIFF file with 8 or 16 bits per sample", reason);

    stored_photo photo;
    std::uint16_t orientation = 1;
    TIFFGetFieldDefaulted(file.get(), TIFFTAG_ORIENTATION, &orientation);
    photo.orientation = orientation;
    // With the stored orientation, libtiff would mirror the picture, but not rotate it.
    TIFFSetField(file.get(), TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);
    std::uint32_t count = 0;
    const void* data = nullptr;
    if (TIFFGetField(file.get(), TIFFTAG_ICCPROFILE, &count, &data) == 1 && count <= max_profile_bytes) {
        const std::byte* const first = static_cast<const std::byte*>(data);
        photo.profile.icc.assign(first, first + count);
    }
    photo.picture = allocate_picture(height, width, 4, where);
    require_memory(8 * std::size_t{width} * height, where);
    std::uint8_t* const samples = photo.picture.samples.get();
    if (TIFFReadRGBAImageOriented(file.get(), width, height, reinterpret_cast<std::uint32_t*>(samples), ORIENTATION_TOPLEFT, 1) ==
        0)
        opened.broken(where);
    if constexpr (std::endian::native == std::endian::big)  // libtiff's pixels are numbers with red in the lowest byte
        for (std::size_t i = 0; i < 4 * std::size_t{width} * height; i += 4) std::reverse(samples + i, samples + i + 4);
    lay_on_white(photo.picture);

    constexpr std::size_t exif_tag = 0x8769, focal_length_tag = 0xA405;
    const tiff_directory directory(bytes);
    if (const std::optional<std::uint64_t> exif = directory.find(exif_tag)) {
        const std::uint64_t focal_length = directory.at(*exif).find(focal_length_tag).value_or(0);
        if (focal_length > 0 && focal_length < 65536) photo.focal_length_35mm = nearest_float(focal_length);
    }
    return photo;
}

}}}  // namespace ldi::detail
