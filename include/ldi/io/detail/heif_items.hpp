// Computes the cost of decoding a picture in a HEIC or AVIF file. The picture may be derived from other pictures, as a grid, an
// overlay or a rotated or cropped copy ("iden"). The cost covers all coded pictures and all pictures derived from them. Rejects
// pictures that contain themselves.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/numbers.hpp>
#include <ldi/io/detail/decoding_budget.hpp>
#include <ldi/io/detail/heif_boxes.hpp>
#include <ldi/io/detail/heif_coded_size.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

class heif_items {
public:
    /// Reads the boxes of the file and charges the bytes of all items. libheif reads the bytes of every item before decoding. If
    /// several extents contain the same bytes, libheif reads these bytes several times.
    ///
    /// Raises invalid_data, unsupported, too_large.
    heif_items(std::span<const std::byte> bytes, decoding_budget& budget, const std::string& where)
        : boxes_(bytes, where), where_(where), file_size_(nearest_double(bytes.size())) {
        double listed = 0;
        for (const auto& [id, item] : boxes_.items)
            for (const std::span<const std::byte>& extent : item.extents) listed += nearest_double(extent.size());
        budget.charge(2 * listed, where, "items of " + std::to_string(static_cast<std::uint64_t>(listed)) + " bytes");
        for (const auto& [id, item] : boxes_.items)
            if (!item.sources.empty() || !item.auxiliaries.empty()) cost_of(id, 0);
    }

    /// Charges the primary picture.
    picture_header take_primary(decoding_budget& budget) { return take(boxes_.primary, budget, where_); }

    /// Charges all auxiliary depth pictures of the primary picture, because libheif chooses the one to decode. Returns the
    /// largest number of bytes charged for one; nothing if there are no depth pictures.
    std::optional<double> take_depth(decoding_budget& budget) {
        const auto primary = boxes_.items.find(boxes_.primary);
        if (primary == boxes_.items.end()) return std::nullopt;
        std::optional<double> largest;
        for (const std::uint32_t id : primary->second.auxiliaries) {
            if (!is_auxiliary(id, "urn:mpeg:hevc:2015:auxid:2") &&
                !is_auxiliary(id, "urn:mpeg:mpegB:cicp:systems:auxiliary:depth"))
                continue;
            largest = (std::max)(largest.value_or(0), take(id, budget, where_ + ", depth").more_memory);
        }
        return largest;
    }

private:
    /// Cost of decoding an item.
    struct cost {
        double width = 0, height = 0, memory = 0;
        double pixels = 0;        ///< pixels of all pictures, counted once per decoding, rotation, mirroring and crop
        double pictures = 0;      ///< number of decoded pictures (coded_size), with repetitions
        double coded = 0;         ///< bytes of their data, with repetitions
        double per_pixel = 0;     ///< memory in bytes
        bool is_foreign = false;  ///< the codec is neither HEVC nor AV1
        int levels = 0;           ///< largest number of pictures on the way to a picture that is not derived and has no auxiliary
        bool is_known = false;    ///< false while the cost is being computed
    };

    // No camera file reaches this limit: a grid of 4,096 tiles of 512 x 512 pixels has a gigapixel.
    static constexpr double max_pictures = 4096;
    static constexpr int max_depth = 8;  ///< maximum nesting of derived pictures
    // Maximum number of HEVC's NAL units or AV1's open bitstream units that are read for all items together. Items may share data
    // and configurations, so the same unit may be read many times.
    static constexpr std::size_t max_units = std::size_t{1} << 18;

    [[noreturn]] void broken(const std::string& found) const { damaged(picture_format::heif, where_, found); }

    picture_header take(std::uint32_t id, decoding_budget& budget, const std::string& where) {
        const cost c = cost_of(id, 0);
        if (c.pictures > max_pictures)
            raise(error_code::too_large, where,
                  "a picture of at most " + std::to_string(static_cast<int>(max_pictures)) + " tiles and slices", "more");
        if (c.is_foreign) raise(error_code::unsupported, where, "a picture coded as HEVC or AV1", "another codec");
        picture_header header;
        header.format = picture_format::heif;
        header.width = static_cast<std::size_t>(c.width), header.height = static_cast<std::size_t>(c.height);
        if (header.width == 0 || header.height == 0) broken("an empty picture");
        header.more_memory = c.memory + 4e6;  // memory of the decoder itself
        budget.charge(header, where);
        // Decoding one byte of data takes as long as processing about 40 samples. The first decoding of the file's data is
        // free.
        budget.charge_samples(3 * c.pixels + 40 * (std::max)(c.coded - file_size_, 0.0), where,
                              "pictures of " + std::to_string(static_cast<std::uint64_t>(c.pixels)) + " pixels and " +
                                  std::to_string(static_cast<std::uint64_t>(c.coded)) + " bytes, with repetitions");
        return header;
    }

    /// Returns the cost of an item, and stores it for later calls. Raises invalid_data for items that contain themselves.
    const cost& cost_of(std::uint32_t id, int depth) {
        const auto item = boxes_.items.find(id);
        if (item == boxes_.items.end()) broken("a picture that is derived from a missing picture");
        if (depth > max_depth) broken("derived pictures nested " + std::to_string(depth) + " deep");
        const auto [place, is_new] = costs_.try_emplace(id);
        cost& c = place->second;
        if (!is_new) {
            if (!c.is_known) broken("a picture that contains itself");
            if (depth + c.levels > max_depth) broken("derived pictures nested " + std::to_string(depth + c.levels) + " deep");
            return c;
        }
        read_properties(item->second, c);
        if (item->second.type == "grid" || item->second.type == "iovl" || item->second.type == "iden")
            read_derived(item->second, c, depth);
        else
            read_coded(item->second, c);
        for (const std::uint32_t other : item->second.auxiliaries) {
            const cost& auxiliary = cost_of(other, depth + 1);
            c.levels = (std::max)(c.levels, auxiliary.levels + 1);
            if (is_auxiliary(other, "urn:mpeg:avc:2015:auxid:1") || is_auxiliary(other, "urn:mpeg:hevc:2015:auxid:1") ||
                is_auxiliary(other, "urn:mpeg:mpegB:cicp:systems:auxiliary:alpha"))
                c.memory += auxiliary.memory, c.pixels += auxiliary.pixels, c.pictures += auxiliary.pictures,
                    c.coded += auxiliary.coded;
        }
        c.is_known = true;
        return c;
    }

    /// Reads the stated size, which may be too small. Counts the passes over the picture: one for decoding, and one for each
    /// rotation, mirroring or crop.
    void read_properties(const heif_item& item, cost& c) const {
        double passes = 1;
        for (const std::size_t index : item.properties) {
            const heif_property& p = boxes_.properties[index];
            if (p.type == "ispe" && p.body.size() >= 12) {
                c.width = (std::max)(c.width, nearest_double(big_endian_32(p.body, 4)));
                c.height = (std::max)(c.height, nearest_double(big_endian_32(p.body, 8)));
            }
            if (p.type == "irot" || p.type == "imir" || p.type == "clap") ++passes;
        }
        c.pixels = passes;  // passes per pixel; add_own() multiplies them by the number of pixels
    }

    /// Adds the cost of the picture itself, without the pictures that it is derived from.
    static void add_own(cost& c) {
        c.memory += c.width * c.height * c.per_pixel;
        c.pixels *= c.width * c.height;
    }

    void read_coded(const heif_item& item, cost& c) {
        // libheif 1.15 reads nothing from an extent without a length, and its AV1 decoder leaks memory if it receives no data.
        if (item.has_open_end) broken("a picture whose data has no stated length");
        const std::span<const std::byte> data = contiguous(item);
        if (data.empty()) broken("a picture without data");
        coded_size size;
        std::optional<av1_sequence> sequence;
        bool is_configured = false;
        for (const std::size_t index : item.properties) {
            const heif_property& p = boxes_.properties[index];
            if (p.type != "hvcC" && p.type != "av1C") continue;
            // Each further configuration would cause another pass over the picture's data.
            if (std::exchange(is_configured, true)) broken("a picture with two configurations of its decoder");
            if (p.type == "hvcC" && p.body.size() > 21) {
                size.include(size_in_hevc_configuration(p.body, units_left_));
                size.include(size_in_hevc_item(data, (byte_at(p.body, 21) & 3) + 1, units_left_));
            }
            if (p.type == "av1C" && p.body.size() >= 4) {
                size.include(size_in_av1_units(p.body.subspan(4), units_left_, sequence));
                size.include(size_in_av1_units(data, units_left_, sequence));
            }
        }
        if (units_left_ == 0)
            raise(error_code::too_large, where_, "fewer than " + std::to_string(max_units) + " coded units", "at least as many");
        c.width = (std::max)(c.width, nearest_double(size.width)), c.height = (std::max)(c.height, nearest_double(size.height));
        // Bytes per pixel: for the coded picture (at most 3 samples), its tiles and the assembled picture, the RGB picture, and
        // the additional memory of an AV1 decoder.
        const bool is_av1 = item.type == "av01";
        c.per_pixel = size.is_deep ? (is_av1 ? 24 : 18) : is_av1 ? 15 : 10;
        c.pictures = nearest_double((std::max)(size.pictures, std::size_t{1}));
        c.pixels += c.pictures - 1;  // passes per pixel
        c.coded = nearest_double(data.size());
        c.is_foreign = item.type != "hvc1" && item.type != "av01";
        add_own(c);
    }

    void read_derived(const heif_item& item, cost& c, int depth) {
        double pixels = 0, memory = 0;
        for (const std::uint32_t id : item.sources) {
            const cost& source = cost_of(id, depth + 1);
            c.levels = (std::max)(c.levels, source.levels + 1);
            pixels += source.pixels, c.pictures += source.pictures, c.coded += source.coded;
            memory = (std::max)(memory, source.memory);
            c.per_pixel = (std::max)(c.per_pixel, source.per_pixel), c.is_foreign = c.is_foreign || source.is_foreign;
            if (item.type == "iden") c.width = (std::max)(c.width, source.width), c.height = (std::max)(c.height, source.height);
        }
        ++c.pictures;
        if (item.type != "iden") read_canvas(item, c);
        add_own(c);
        c.pixels += pixels;
        c.memory += 4 * memory;  // libheif decodes up to four tiles at the same time
    }

    /// Reads the size of the picture that a grid or overlay produces.
    void read_canvas(const heif_item& item, cost& c) const {
        buffer<std::byte> data;
        for (const std::span<const std::byte>& extent : item.extents)
            if (data.size() < 24) data.append(extent.data(), extent.data() + (std::min)(extent.size(), std::size_t{24}));
        heif_numbers numbers({data.data(), data.size()}, where_);
        numbers.next(1);
        const std::size_t size = (numbers.next(1) & 1) != 0 ? 4 : 2;
        numbers.next(item.type == "grid" ? 2 : 8);  // rows and columns of a grid; background of an overlay
        c.width = (std::max)(c.width, nearest_double(numbers.next(size)));
        c.height = (std::max)(c.height, nearest_double(numbers.next(size)));
    }

    std::span<const std::byte> contiguous(const heif_item& item) const {
        if (item.extents.size() == 1) return item.extents[0];
        joined_.clear();
        for (const std::span<const std::byte>& extent : item.extents)
            joined_.append(extent.data(), extent.data() + extent.size());
        return {joined_.data(), joined_.size()};
    }

    /// Whether an item's auxC property has this type.
    bool is_auxiliary(std::uint32_t id, std::string_view type) const {
        const auto item = boxes_.items.find(id);
        if (item == boxes_.items.end()) return false;
        for (const std::size_t index : item->second.properties) {
            const heif_property& p = boxes_.properties[index];
            if (p.type == "auxC" && has_text(p.body, 4, type)) return true;
        }
        return false;
    }

    heif_boxes boxes_;
    const std::string& where_;
    double file_size_;
    std::map<std::uint32_t, cost> costs_;
    mutable buffer<std::byte> joined_;
    std::size_t units_left_ = max_units;
};

}}}  // namespace ldi::detail
