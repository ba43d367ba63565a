// Converts colors from a photo's color space (an ICC profile or H.273 codes) to sRGB with Little CMS. Many phones store photos in
// Display P3. If interpreted as sRGB, the colors of such photos look pale.
#pragma once

#include <ldi/core/image.hpp>
#include <ldi/io/detail/png_blocks.hpp>
#include <ldi/io/detail/readers.hpp>
#include <ldi/io/detail/stored_photo.hpp>

#if defined(LDI_WITH_LCMS2)
#include <lcms2.h>
#include <lcms2_plugin.h>
#endif

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail { inline namespace LDI_READERS {

/// Maximum memory for reading a profile: its own bytes, and those that Little CMS allocates.
inline constexpr std::size_t max_profile_memory = std::size_t{16} << 20;

/// Converts colors to sRGB in place. Does nothing if the profile is neither RGB nor gray, if reading it needs more memory than
/// max_profile_memory, or if ldi::io was configured without Little CMS.
///
/// color    H x W x 3
/// profile  color space of the samples
inline void convert_to_srgb(image<std::uint8_t>& color, const color_profile& profile);

/// Joins the parts of the profile that a JPEG file stores in its APP2 segments. Returns an empty profile if the file has no
/// profile, if a part is missing, or if the profile is too large.
inline std::vector<std::byte> jpeg_profile(std::span<const std::span<const std::byte>> segments) {
    constexpr std::string_view name("ICC_PROFILE\0", 12);
    std::array<std::span<const std::byte>, 256> parts;
    unsigned count = 0;
    for (const std::span<const std::byte> segment : segments) {
        if (!has_text(segment, 0, name) || segment.size() <= 14) continue;
        std::span<const std::byte>& part = parts[byte_at(segment, 12)];
        if (!part.empty()) continue;
        part = segment.subspan(14);
        if (byte_at(segment, 12) == 1) count = byte_at(segment, 13);
    }
    std::vector<std::byte> profile;
    for (unsigned i = 1; i <= count; ++i) {
        if (parts[i].empty() || profile.size() + parts[i].size() > max_profile_bytes) return {};
        profile.insert(profile.end(), parts[i].begin(), parts[i].end());
    }
    return profile;
}

/// Extracts the profile of a PNG file. Returns an empty profile if it is damaged or too large.
///
/// chunk  body of the iCCP chunk: a name, a zero, a method (0), and the compressed profile
inline std::vector<std::byte> png_profile(std::span<const std::byte> chunk) {
    const auto name_end = std::find(chunk.begin(), chunk.end(), std::byte{0});
    const std::size_t begin = static_cast<std::size_t>(name_end - chunk.begin()) + 2;
    if (begin >= chunk.size() || chunk.size() > max_profile_bytes) return {};
    if (!has_few_blocks(chunk.subspan(begin), max_profile_blocks)) return {};
    const stb::growth_limit growth(max_profile_bytes);
    int size = 0;
    const std::unique_ptr<char[], stb_free> inflated(stb::stbi_zlib_decode_malloc_guesssize_headerflag(
        reinterpret_cast<const char*>(chunk.data() + begin), static_cast<int>(chunk.size() - begin), 16384, &size, 1));
    if (!inflated) return {};
    const std::byte* const first = reinterpret_cast<const std::byte*>(inflated.get());
    return std::vector<std::byte>(first, first + size);
}

#if defined(LDI_WITH_LCMS2)

/// Remaining part of max_profile_memory. A profile may list the same table many times, and Little CMS reads the table each
/// time.
inline thread_local std::size_t profile_memory_left = 0;

/// Whether Little CMS requested more than that. It may then make a transform that takes ten times as long as usual.
inline thread_local bool is_profile_memory_exceeded = false;

/// Allocator for Little CMS. Charges allocations to profile_memory_left and never refunds them.
struct profile_memory {
    static bool take(std::size_t bytes) {
        if (bytes > profile_memory_left) {
            is_profile_memory_exceeded = true;
            return false;
        }
        profile_memory_left -= bytes;
        return true;
    }
    static void* allocate(cmsContext, cmsUInt32Number bytes) { return take(bytes) ? std::malloc(bytes) : nullptr; }
    static void* reallocate(cmsContext, void* block, cmsUInt32Number bytes) {
        return take(bytes) ? std::realloc(block, bytes) : nullptr;
    }
    static void release(cmsContext, void* block) { std::free(block); }
};

struct context_deleter {
    void operator()(cmsContext context) const { cmsDeleteContext(context); }
};
using context_handle = std::unique_ptr<_cmsContext_struct, context_deleter>;

inline context_handle open_context() {
    profile_memory_left = max_profile_memory;
    is_profile_memory_exceeded = false;
    cmsPluginMemHandler handler = {};
    handler.base.Magic = cmsPluginMagicNumber;
    handler.base.ExpectedVersion = 2000;
    handler.base.Type = cmsPluginMemHandlerSig;
    handler.MallocPtr = profile_memory::allocate;
    handler.FreePtr = profile_memory::release;
    handler.ReallocPtr = profile_memory::reallocate;
    return context_handle(cmsCreateContext(&handler, nullptr));
}

struct profile_closer {
    void operator()(void* profile) const { cmsCloseProfile(profile); }
};
struct transform_deleter {
    void operator()(void* transform) const { cmsDeleteTransform(transform); }
};
using profile_handle = std::unique_ptr<void, profile_closer>;

/// Light of a high dynamic range, in units of a white page (203 cd/m2, ITU-R BT.2408).
///
/// transfer  pq_transfer or hlg_transfer; for HLG, the display's gamma of 1.2 applies to each channel
/// sample    0 to 1
inline double light_of(unsigned transfer, double sample) {
    constexpr double white = 203;
    if (transfer == pq_transfer) {
        const double power = std::pow(sample, 32 / 2523.0);
        return 10000 / white * std::pow((std::max)(power - 0.8359375, 0.0) / (18.8515625 - 18.6875 * power), 16384 / 2610.0);
    }
    const double scene = sample <= 0.5 ? sample * sample / 3 : (std::exp((sample - 0.55991073) / 0.17883277) + 0.28466892) / 12;
    return 1000 / white * std::pow(scene, 1.2);
}

/// Maps light of a high dynamic range to 0 to 1. Keeps light up to half of a white page; highlights approach 1 gradually.
inline double tone_mapped(double light) {
    constexpr double kept = 0.5;
    return light <= kept ? light : 1 - (1 - kept) * std::exp((kept - light) / (1 - kept));
}

/// Returns the curve from samples to light: that of sRGB, or for PQ and HLG a curve that includes tone mapping.
inline cmsToneCurve* make_tone_curve(cmsContext context, const color_profile& profile) {
    if (!profile.is_high_dynamic_range()) {
        const double srgb[5] = {2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045};
        return cmsBuildParametricToneCurve(context, 4, srgb);
    }
    std::array<float, 1024> table;
    for (std::size_t i = 0; i < table.size(); ++i)
        table[i] = static_cast<float>(tone_mapped(light_of(profile.transfer, static_cast<double>(i) / (table.size() - 1))));
    return cmsBuildTabulatedToneCurveFloat(context, table.size(), table.data());
}

/// Opens the profile. Returns null if an ICC profile is damaged or contains multi-process elements (tags D2B0 to D2B3). No
/// camera writes these elements, and evaluating them may take hours. Also returns null if the primaries are neither BT.2020 nor
/// Display P3, nor those of sRGB with PQ or HLG.
inline profile_handle open_profile(cmsContext context, const color_profile& profile) {
    if (!profile.icc.empty()) {
        profile_handle opened(
            cmsOpenProfileFromMemTHR(context, profile.icc.data(), static_cast<cmsUInt32Number>(profile.icc.size())));
        for (const cmsTagSignature tag : {cmsSigDToB0Tag, cmsSigDToB1Tag, cmsSigDToB2Tag, cmsSigDToB3Tag})
            if (opened && cmsIsTag(opened.get(), tag) != 0) return nullptr;
        return opened;
    }
    cmsCIExyY white = {0.3127, 0.3290, 1.0};
    const cmsCIExyYTRIPLE srgb = {{0.640, 0.330, 1.0}, {0.300, 0.600, 1.0}, {0.150, 0.060, 1.0}};
    const cmsCIExyYTRIPLE p3 = {{0.680, 0.320, 1.0}, {0.265, 0.690, 1.0}, {0.150, 0.060, 1.0}};
    const cmsCIExyYTRIPLE bt2020 = {{0.708, 0.292, 1.0}, {0.170, 0.797, 1.0}, {0.131, 0.046, 1.0}};
    if (profile.primaries != 9 && profile.primaries != 12 && !(profile.primaries == 1 && profile.is_high_dynamic_range()))
        return nullptr;
    const cmsCIExyYTRIPLE& primaries = profile.primaries == 12 ? p3 : profile.primaries == 9 ? bt2020 : srgb;
    cmsToneCurve* const curve = make_tone_curve(context, profile);
    if (curve == nullptr) return nullptr;
    cmsToneCurve* curves[3] = {curve, curve, curve};
    profile_handle made(cmsCreateRGBProfileTHR(context, &white, &primaries, curves));
    cmsFreeToneCurve(curve);
    return made;
}

/// Whether a transform changes any of 216 sample colors by more than a rounding error. Most profiles are sRGB under various
/// names, so their colors need no conversion.
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
    if (profile.icc.empty() && profile.primaries == 0) return;
    const context_handle context = open_context();
    if (!context) return;
    const profile_handle source = open_profile(context.get(), profile), target(cmsCreate_sRGBProfileTHR(context.get()));
    if (!source || !target) return;
    const bool is_gray = cmsGetColorSpace(source.get()) == cmsSigGrayData;
    if (!is_gray && cmsGetColorSpace(source.get()) != cmsSigRgbData) return;
    // Each pixel stores its gray value three times; the transform skips two of the three.
    const cmsUInt32Number from = is_gray ? COLORSPACE_SH(PT_GRAY) | CHANNELS_SH(1) | EXTRA_SH(2) | BYTES_SH(1) : TYPE_RGB_8;
    const std::unique_ptr<void, transform_deleter> transform(cmsCreateTransformTHR(
        context.get(), source.get(), from, target.get(), TYPE_RGB_8, INTENT_RELATIVE_COLORIMETRIC, cmsFLAGS_NOCACHE));
    if (!transform || is_profile_memory_exceeded || !changes_colors(transform.get(), is_gray)) return;
    for (std::size_t y = 0; y < color.height(); ++y)
        cmsDoTransform(transform.get(), color.row(y), color.row(y), static_cast<cmsUInt32Number>(color.width()));
}

#else

inline void convert_to_srgb(image<std::uint8_t>&, const color_profile&) {}

#endif

}}}}  // namespace ldi::detail
