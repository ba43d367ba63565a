// Colors as a photo's profile has them (ICC, or primaries by number), made sRGB by Little CMS. Phones store Display P3, whose
// colors look pale when they are taken for sRGB.
#pragma once

#include <ldi/core/image.hpp>
#include <ldi/formats/detail/readers.hpp>
#include <ldi/formats/detail/stored_photo.hpp>

#if defined(LDI_WITH_LCMS2)
#include <lcms2.h>
#endif

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace ldi::inline LDI_CONFIGURATION::detail::inline LDI_READERS {

/// color    H x W x 3; becomes sRGB where the profile is of RGB or gray and can be read, and stays as it is elsewhere
/// profile  what the samples are meant in
inline void convert_to_srgb(image<std::uint8_t>& color, const color_profile& profile);

/// The profile in the APP2 segments of a JPEG file, which may be in parts; empty if there is none or a part is missing.
inline std::vector<std::byte> jpeg_profile(std::span<const std::span<const std::byte>> segments) {
    constexpr std::string_view name("ICC_PROFILE\0", 12);
    std::vector<std::byte> profile;
    for (unsigned part = 1, count = 1; part <= count; ++part) {
        const auto found = std::find_if(segments.begin(), segments.end(), [&](std::span<const std::byte> segment) {
            return has_text(segment, 0, name) && segment.size() > 14 && byte_at(segment, 12) == part;
        });
        if (found == segments.end()) return {};
        if (part == 1) count = byte_at(*found, 13);
        profile.insert(profile.end(), found->begin() + 14, found->end());
    }
    return profile;
}

/// chunk  the body of a PNG file's iCCP chunk: a name, a zero, a method (0), and the profile, compressed
inline std::vector<std::byte> png_profile(std::span<const std::byte> chunk) {
    constexpr std::size_t limit = std::size_t{4} << 20;
    const auto name_end = std::find(chunk.begin(), chunk.end(), std::byte{0});
    const std::size_t begin = static_cast<std::size_t>(name_end - chunk.begin()) + 2;
    if (begin >= chunk.size() || chunk.size() > limit) return {};
    const stb::growth_limit growth(limit);
    int size = 0;
    const std::unique_ptr<char[], stb_free> inflated(stb::stbi_zlib_decode_malloc_guesssize_headerflag(
        reinterpret_cast<const char*>(chunk.data() + begin), static_cast<int>(chunk.size() - begin), 16384, &size, 1));
    if (!inflated) return {};
    const std::byte* const first = reinterpret_cast<const std::byte*>(inflated.get());
    return std::vector<std::byte>(first, first + size);
}

#if defined(LDI_WITH_LCMS2)

struct profile_closer {
    void operator()(void* profile) const { cmsCloseProfile(profile); }
};
struct transform_deleter {
    void operator()(void* transform) const { cmsDeleteTransform(transform); }
};
using profile_handle = std::unique_ptr<void, profile_closer>;

/// Null if the profile is damaged, or sRGB.
inline profile_handle open_profile(const color_profile& profile) {
    if (!profile.icc.empty())
        return profile_handle(cmsOpenProfileFromMem(profile.icc.data(), static_cast<cmsUInt32Number>(profile.icc.size())));
    cmsCIExyY white = {0.3127, 0.3290, 1.0};
    cmsCIExyYTRIPLE p3 = {{0.680, 0.320, 1.0}, {0.265, 0.690, 1.0}, {0.150, 0.060, 1.0}};
    cmsCIExyYTRIPLE bt2020 = {{0.708, 0.292, 1.0}, {0.170, 0.797, 1.0}, {0.131, 0.046, 1.0}};
    if (profile.primaries != 9 && profile.primaries != 12) return nullptr;
    double curve_of_srgb[5] = {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
    cmsToneCurve* const curve = cmsBuildParametricToneCurve(nullptr, 4, curve_of_srgb);
    if (curve == nullptr) return nullptr;
    cmsToneCurve* curves[3] = {curve, curve, curve};
    profile_handle made(cmsCreateRGBProfile(&white, profile.primaries == 12 ? &p3 : &bt2020, curves));
    cmsFreeToneCurve(curve);
    return made;
}

/// Whether a transform moves some color by more than rounding does. Most profiles are sRGB under one name or another.
inline bool changes_colors(void* transform, bool is_gray) {
    for (unsigned i = 0; i < 6 * 6 * 6; ++i) {
        std::uint8_t from[3] = {static_cast<std::uint8_t>(i % 6 * 51), static_cast<std::uint8_t>(i / 6 % 6 * 51),
                                static_cast<std::uint8_t>(i / 36 * 51)};
        if (is_gray) from[1] = from[2] = from[0];
        std::uint8_t to[3];
        cmsDoTransform(transform, from, to, 1);
        for (int c = 0; c < 3; ++c)
            if (std::abs(int{from[c]} - int{to[c]}) > 2) return true;
    }
    return false;
}

inline void convert_to_srgb(image<std::uint8_t>& color, const color_profile& profile) {
    const profile_handle source = open_profile(profile), target(cmsCreate_sRGBProfile());
    if (!source || !target) return;
    const bool is_gray = cmsGetColorSpace(source.get()) == cmsSigGrayData;
    if (!is_gray && cmsGetColorSpace(source.get()) != cmsSigRgbData) return;
    // Gray lies three times in each pixel; two of them are passed over.
    const cmsUInt32Number from = is_gray ? COLORSPACE_SH(PT_GRAY) | CHANNELS_SH(1) | EXTRA_SH(2) | BYTES_SH(1) : TYPE_RGB_8;
    const std::unique_ptr<void, transform_deleter> transform(
        cmsCreateTransform(source.get(), from, target.get(), TYPE_RGB_8, INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOCACHE));
    if (!transform || !changes_colors(transform.get(), is_gray)) return;
    for (std::size_t y = 0; y < color.height(); ++y)
        cmsDoTransform(transform.get(), color.row(y), color.row(y), static_cast<cmsUInt32Number>(color.width()));
}

#else

inline void convert_to_srgb(image<std::uint8_t>&, const color_profile&) {}

#endif

}  // namespace ldi::detail
