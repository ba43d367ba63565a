// Makes HEIC, AVIF, WebP and TIFF files and ICC profiles with the libraries that read them, if present.
#pragma once

#include <ldi/core/image.hpp>
#include <ldi/io/file.hpp>
#include <tests/support/files.hpp>

#if defined(LDI_WITH_LIBHEIF)
#include <libheif/heif.h>
#endif
#if defined(LDI_WITH_LIBWEBP)
#include <webp/encode.h>
#endif
#if defined(LDI_WITH_LIBTIFF)
#include <tiffio.h>
#endif
#if defined(LDI_WITH_LCMS2)
#include <lcms2.h>
#endif

#include <algorithm>
#include <cstring>
#include <optional>
#include <string>

namespace ldi::testing {

#if defined(LDI_WITH_LIBHEIF)

struct heif_writing {
    heif_compression_format format = heif_compression_HEVC;
    byte_string exif = {}, icc = {};
    unsigned primaries = 0;  ///< code of the color primaries; 0 for sRGB's. The curve is always sRGB's
    bool is_premultiplied = false;
};

/// Makes a lossless file. Returns std::nullopt if libheif has no encoder for the format.
///
/// picture  H x W x 3, or x 4 with alpha, which becomes an auxiliary picture
inline std::optional<byte_string> heif_file_of(const image<std::uint8_t>& picture, const heif_writing& writing = {}) {
    heif_context* const context = heif_context_alloc();
    heif_encoder* encoder = nullptr;
    if (heif_context_get_encoder_for_format(context, writing.format, &encoder).code != heif_error_Ok) {
        heif_context_free(context);
        return std::nullopt;
    }
    heif_encoder_set_lossless(encoder, 1);
    heif_encoder_set_parameter_string(encoder, "chroma", "444");
    const int width = static_cast<int>(picture.width()), height = static_cast<int>(picture.height());
    heif_image* pixels = nullptr;
    const bool has_alpha = picture.channels() == 4;
    heif_image_create(width, height, heif_colorspace_RGB, has_alpha ? heif_chroma_interleaved_RGBA : heif_chroma_interleaved_RGB,
                      &pixels);
    heif_image_add_plane(pixels, heif_channel_interleaved, width, height, 8);
    int stride = 0;
    std::uint8_t* const to = heif_image_get_plane(pixels, heif_channel_interleaved, &stride);
    const std::size_t row = picture.width() * picture.channels();
    for (std::size_t y = 0; y < picture.height(); ++y)
        std::memcpy(to + y * static_cast<std::size_t>(stride), picture.row(y), row);
    heif_color_profile_nclx* const identity = heif_nclx_color_profile_alloc();  // keeps RGB, because YCbCr would round colors
    heif_nclx_color_profile_set_matrix_coefficients(identity, 0);
    heif_nclx_color_profile_set_color_primaries(identity,
                                                static_cast<std::uint16_t>(writing.primaries == 0 ? 1 : writing.primaries));
    heif_nclx_color_profile_set_transfer_characteristics(identity, 13);
    identity->full_range_flag = 1;
    heif_image_set_nclx_color_profile(pixels, identity);
    heif_image_set_premultiplied_alpha(pixels, writing.is_premultiplied ? 1 : 0);
    if (!writing.icc.empty()) heif_image_set_raw_color_profile(pixels, "prof", writing.icc.data(), writing.icc.size());
    heif_encoding_options* const options = heif_encoding_options_alloc();
    options->output_nclx_profile = identity;
    options->save_two_colr_boxes_when_ICC_and_nclx_available = 1;
    heif_image_handle* handle = nullptr;
    byte_string file;
    if (heif_context_encode_image(context, pixels, encoder, options, &handle).code == heif_error_Ok) {
        if (!writing.exif.empty())
            heif_context_add_exif_metadata(context, handle, writing.exif.data(), static_cast<int>(writing.exif.size()));
        heif_writer writer = {1, [](heif_context*, const void* data, std::size_t size, void* user) {
                                  const std::byte* const first = static_cast<const std::byte*>(data);
                                  static_cast<byte_string*>(user)->assign(first, first + size);
                                  return heif_error{heif_error_Ok, heif_suberror_Unspecified, ""};
                              }};
        heif_context_write(context, &writer, &file);
        heif_image_handle_release(handle);
    }
    heif_encoding_options_free(options);
    heif_nclx_color_profile_free(identity);
    heif_image_release(pixels);
    heif_encoder_release(encoder);
    heif_context_free(context);
    if (file.empty()) return std::nullopt;
    return file;
}

/// Changes the type of the auxiliary picture from alpha to depth. Both names have the same length.
inline byte_string alpha_called_depth(byte_string file) {
    for (const auto& [alpha, depth] : {std::pair{bytes_of("hevc:2015:auxid:1"), bytes_of("hevc:2015:auxid:2")},
                                       std::pair{bytes_of("auxiliary:alpha"), bytes_of("auxiliary:depth")}}) {
        const auto at = std::search(file.begin(), file.end(), alpha.begin(), alpha.end());
        if (at != file.end()) std::copy(depth.begin(), depth.end(), at);
    }
    return file;
}

#endif

#if defined(LDI_WITH_LIBWEBP)

/// Makes a chunk of a RIFF file.
inline byte_string riff_chunk_of(const std::string& name, const byte_string& body) {
    const byte_string size = big_endian(static_cast<std::uint32_t>(body.size()), 4);
    byte_string chunk = bytes_of(name);
    chunk.insert(chunk.end(), size.rbegin(), size.rend());
    append(chunk, body);
    if (body.size() % 2 != 0) chunk.push_back(std::byte{0});
    return chunk;
}

/// Makes a lossless file of an H x W x 3 or H x W x 4 picture, with the EXIF data and the profile unless they are empty.
inline byte_string webp_file(const image<std::uint8_t>& picture, const byte_string& exif = {}, const byte_string& icc = {}) {
    std::uint8_t* encoded = nullptr;
    const int width = static_cast<int>(picture.width()), height = static_cast<int>(picture.height());
    const int stride = width * static_cast<int>(picture.channels());
    const auto encode = picture.channels() == 4 ? WebPEncodeLosslessRGBA : WebPEncodeLosslessRGB;
    const std::size_t size = encode(picture.data(), width, height, stride, &encoded);
    const std::byte* const first = reinterpret_cast<const std::byte*>(encoded);
    const byte_string plain(first, first + size);
    WebPFree(encoded);
    if (exif.empty() && icc.empty()) return plain;
    byte_string head = {
        static_cast<std::byte>((icc.empty() ? 0 : 0x20) | (exif.empty() ? 0 : 8) | (picture.channels() == 4 ? 16 : 0)),
        std::byte{0}, std::byte{0}, std::byte{0}};
    for (const std::size_t side : {picture.width(), picture.height()}) {
        const byte_string number = big_endian(static_cast<std::uint32_t>(side - 1), 3);
        head.insert(head.end(), number.rbegin(), number.rend());
    }
    byte_string body = bytes_of("WEBP");
    append(body, riff_chunk_of("VP8X", head));
    if (!icc.empty()) append(body, riff_chunk_of("ICCP", icc));
    body.insert(body.end(), plain.begin() + 12, plain.end());
    if (!exif.empty()) append(body, riff_chunk_of("EXIF", exif));
    return riff_chunk_of("RIFF", body);
}

#endif

#if defined(LDI_WITH_LIBTIFF)

struct tiff_writing {
    std::uint16_t compression = COMPRESSION_LZW, orientation = 1, bits = 8;
    std::uint32_t subfile_type = 0;
    byte_string icc = {};
};

/// Makes a file of an H x W x C picture; 16-bit values are the 8-bit values times 257. With 1 bit, C must be 1, and the bits of a
/// row's first W / 8 values are its pixels.
inline byte_string tiff_file(const image<std::uint8_t>& picture, const tiff_writing& writing = {}) {
    const scratch_folder folder;
    const std::filesystem::path path = folder / "a.tif";
    TIFF* const file = TIFFOpen(path.c_str(), "w");
    TIFFSetField(file, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(picture.width()));
    TIFFSetField(file, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(picture.height()));
    TIFFSetField(file, TIFFTAG_SAMPLESPERPIXEL, static_cast<std::uint16_t>(picture.channels()));
    TIFFSetField(file, TIFFTAG_BITSPERSAMPLE, writing.bits);
    TIFFSetField(file, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(file, TIFFTAG_PHOTOMETRIC, picture.channels() < 3 ? PHOTOMETRIC_MINISBLACK : PHOTOMETRIC_RGB);
    TIFFSetField(file, TIFFTAG_COMPRESSION, writing.compression);
    TIFFSetField(file, TIFFTAG_ORIENTATION, writing.orientation);
    TIFFSetField(file, TIFFTAG_ROWSPERSTRIP, writing.compression == COMPRESSION_JPEG ? 16U : 5U);
    if (writing.subfile_type != 0) TIFFSetField(file, TIFFTAG_SUBFILETYPE, writing.subfile_type);
    if (picture.channels() == 4) {
        const std::uint16_t kind = EXTRASAMPLE_UNASSALPHA;
        TIFFSetField(file, TIFFTAG_EXTRASAMPLES, 1, &kind);
    }
    if (!writing.icc.empty())
        TIFFSetField(file, TIFFTAG_ICCPROFILE, static_cast<std::uint32_t>(writing.icc.size()), writing.icc.data());
    for (std::size_t y = 0; y < picture.height(); ++y) {
        std::vector<std::uint8_t> row;
        for (std::size_t i = 0; i < picture.width() * picture.channels(); ++i)
            for (unsigned byte = 0; byte < (writing.bits + 7U) / 8U; ++byte) row.push_back(picture.row(y)[i]);
        TIFFWriteScanline(file, row.data(), static_cast<std::uint32_t>(y), 0);
    }
    TIFFClose(file);
    return read_file(path);
}

#endif

#if defined(LDI_WITH_LCMS2)

/// An ICC profile of Display P3's colors, or of gray with a gamma of 1.
inline byte_string icc_profile(bool is_gray = false) {
    cmsCIExyY white = {0.3127, 0.3290, 1.0};
    cmsCIExyYTRIPLE p3 = {{0.680, 0.320, 1.0}, {0.265, 0.690, 1.0}, {0.150, 0.060, 1.0}};
    double curve_of_srgb[5] = {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
    cmsToneCurve* const curve = is_gray ? cmsBuildGamma(nullptr, 1.0) : cmsBuildParametricToneCurve(nullptr, 4, curve_of_srgb);
    cmsToneCurve* curves[3] = {curve, curve, curve};
    const cmsHPROFILE profile = is_gray ? cmsCreateGrayProfile(&white, curve) : cmsCreateRGBProfile(&white, &p3, curves);
    cmsUInt32Number size = 0;
    cmsSaveProfileToMem(profile, nullptr, &size);
    byte_string bytes(size);
    cmsSaveProfileToMem(profile, bytes.data(), &size);
    cmsCloseProfile(profile);
    cmsFreeToneCurve(curve);
    return bytes;
}

#endif

/// Splits a profile into JPEG's APP2 segments.
inline byte_string icc_segments(const byte_string& profile, std::size_t parts) {
    byte_string segments;
    const std::size_t size = (profile.size() + parts - 1) / parts;
    for (std::size_t part = 0; part < parts; ++part) {
        byte_string body = bytes_of(std::string_view("ICC_PROFILE\0", 12));
        body.push_back(static_cast<std::byte>(part + 1));
        body.push_back(static_cast<std::byte>(parts));
        const std::size_t begin = part * size, end = std::min(begin + size, profile.size());
        body.insert(body.end(), profile.begin() + static_cast<std::ptrdiff_t>(begin),
                    profile.begin() + static_cast<std::ptrdiff_t>(end));
        byte_string segment = bytes_of("\xFF\xE2");
        append(segment, big_endian(static_cast<std::uint32_t>(body.size() + 2), 2));
        append(segment, body);
        append(segments, segment);
    }
    return segments;
}

/// PNG's iCCP chunk.
inline byte_string iccp_chunk(const byte_string& profile) {
    uLongf size = compressBound(static_cast<uLong>(profile.size()));
    byte_string packed(size);
    compress(reinterpret_cast<unsigned char*>(packed.data()), &size, reinterpret_cast<const unsigned char*>(profile.data()),
             static_cast<uLong>(profile.size()));
    packed.resize(size);
    byte_string body = bytes_of(std::string_view("name\0\0", 6));
    append(body, packed);
    return png_chunk("iCCP", body);
}

}  // namespace ldi::testing
