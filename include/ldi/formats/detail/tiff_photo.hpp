// TIFF files, through libtiff: the first picture of a file, of any kind that libtiff makes 8-bit RGB of. Raw files of cameras,
// which are TIFF files too and begin with a thumbnail, are refused.
#pragma once

#include <ldi/base/numbers.hpp>
#include <ldi/formats/detail/stored_photo.hpp>

#include <tiffio.h>

#include <algorithm>
#include <cstdarg>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <memory>
#include <span>
#include <string>

namespace ldi::inline LDI_CONFIGURATION::detail {

/// A file in memory, as libtiff's callbacks see it, and the first thing that libtiff complained of.
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

inline tiff_handle open_tiff(tiff_memory& memory, const picture_limits& limits) {
    const std::unique_ptr<TIFFOpenOptions, tiff_closer> options(TIFFOpenOptionsAlloc());
    if (!options) return nullptr;
    TIFFOpenOptionsSetMaxSingleMemAlloc(options.get(), static_cast<tmsize_t>(limits.max_memory));
    TIFFOpenOptionsSetErrorHandlerExtR(options.get(), tiff_memory::complain, &memory);
    TIFFOpenOptionsSetWarningHandlerExtR(options.get(), tiff_memory::ignore, nullptr);
    return tiff_handle(TIFFClientOpenExt("photo", "rm", &memory, tiff_memory::read, tiff_memory::write, tiff_memory::seek,
                                         tiff_memory::close, tiff_memory::size, nullptr, nullptr, options.get()));
}

/// What libtiff gives: red, green, blue, alpha, from the lowest byte up, colors multiplied by alpha. Becomes bytes, laid on
/// white.
inline void lay_on_white(std::uint8_t* samples, std::size_t pixels) {
    for (std::size_t i = 0; i < pixels; ++i) {
        std::uint32_t packed;
        std::memcpy(&packed, samples + 4 * i, 4);
        const std::uint32_t paper = 255 - TIFFGetA(packed);
        const std::uint32_t color[3] = {TIFFGetR(packed), TIFFGetG(packed), TIFFGetB(packed)};
        for (std::size_t c = 0; c < 3; ++c)
            samples[3 * i + c] = static_cast<std::uint8_t>((std::min)(color[c] + paper, std::uint32_t{255}));
    }
}

/// Raises unsupported, invalid_data, too_large.
inline stored_photo decode_tiff(std::span<const std::byte> bytes, const picture_limits& limits, const std::string& where) {
    tiff_memory memory{bytes, 0, {}};
    const tiff_handle file = open_tiff(memory, limits);
    const auto broken = [&] { raise(error_code::invalid_data, where, "an undamaged TIFF file", memory.complaint); };
    if (!file) broken();
    std::uint32_t width = 0, height = 0, kind = 0, count = 0;
    const void* data = nullptr;
    TIFFGetField(file.get(), TIFFTAG_SUBFILETYPE, &kind);
    if ((kind & FILETYPE_REDUCEDIMAGE) != 0 || TIFFGetField(file.get(), TIFFTAG_DNGVERSION, &data) == 1)
        raise(error_code::unsupported, where, "a TIFF file of a picture", "a camera's raw file: develop it first");
    TIFFGetField(file.get(), TIFFTAG_IMAGEWIDTH, &width);
    TIFFGetField(file.get(), TIFFTAG_IMAGELENGTH, &height);
    if (width == 0 || height == 0) broken();
    picture_header header;
    header.width = width, header.height = height, header.memory_per_pixel = 16;  // samples of 16 bits, then packed ones
    check_limits(header, bytes.size(), limits, where);
    char reason[1024] = "";
    if (TIFFRGBAImageOK(file.get(), reason) == 0) raise(error_code::unsupported, where, "a TIFF file of 8 or 16 bits", reason);

    stored_photo photo;
    std::uint16_t orientation = 1;
    TIFFGetFieldDefaulted(file.get(), TIFFTAG_ORIENTATION, &orientation);
    photo.orientation = orientation;
    TIFFSetField(file.get(), TIFFTAG_ORIENTATION, ORIENTATION_TOPLEFT);  // libtiff would mirror, but not turn
    if (TIFFGetField(file.get(), TIFFTAG_ICCPROFILE, &count, &data) == 1) {
        const std::byte* const first = static_cast<const std::byte*>(data);
        photo.profile.icc.assign(first, first + count);
    }
    photo.picture = allocate_picture(height, width, 4, where);
    std::uint8_t* const samples = photo.picture.samples.get();
    if (TIFFReadRGBAImageOriented(file.get(), width, height, reinterpret_cast<std::uint32_t*>(samples), ORIENTATION_TOPLEFT, 1) ==
        0)
        broken();
    lay_on_white(samples, std::size_t{width} * height);
    photo.picture.channels = 3;

    toff_t exif = 0;
    std::uint16_t focal_length = 0;
    if (TIFFGetField(file.get(), TIFFTAG_EXIFIFD, &exif) == 1 && TIFFReadEXIFDirectory(file.get(), exif) == 1 &&
        TIFFGetField(file.get(), EXIFTAG_FOCALLENGTHIN35MMFILM, &focal_length) == 1 && focal_length > 0)
        photo.focal_length_35mm = nearest_float(focal_length);
    return photo;
}

}  // namespace ldi::detail
