#include <ldi/io/depth_map.hpp>

#include <ldi/io/photo.hpp>
#include <ldi/io/picture.hpp>

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <tests/support/files.hpp>

#include <bit>
#include <cstring>

using namespace ldi;
using namespace ldi::testing;

namespace {

constexpr float nan_value = std::numeric_limits<float>::quiet_NaN();
constexpr float infinity = std::numeric_limits<float>::infinity();

image<float> random_map(std::size_t height, std::size_t width, std::mt19937& random) {
    image<float> map(height, width);
    for (float& v : map) v = std::uniform_real_distribution<float>(0.1F, 9.0F)(random);
    return map;
}

/// Whether two maps are equal. NaN equals NaN.
bool same(const image<float>& a, const image<float>& b) {
    if (!same_shape(a, b)) return false;
    for (std::size_t i = 0; i < a.size(); ++i)
        if (!(a.data()[i] == b.data()[i] || (std::isnan(a.data()[i]) && std::isnan(b.data()[i])))) return false;
    return true;
}

template <class Scalar>
void append_scalar(byte_string& to, Scalar value, bool little_endian) {
    std::byte bytes[sizeof(Scalar)];
    std::memcpy(bytes, &value, sizeof(Scalar));
    if (little_endian != (std::endian::native == std::endian::little)) std::reverse(bytes, bytes + sizeof(Scalar));
    to.insert(to.end(), bytes, bytes + sizeof(Scalar));
}

byte_string pfm_file(const image<float>& map, bool little_endian, const std::string& magic = "Pf",
                     const std::string& line_end = "\n") {
    byte_string file = bytes_of(magic + line_end + std::to_string(map.width()) + " " + std::to_string(map.height()) + line_end +
                                (little_endian ? "-1.0" : "1.0") + line_end);
    for (std::size_t y = map.height(); y-- > 0;)
        for (std::size_t x = 0; x < map.width(); ++x) append_scalar(file, map(y, x, 0), little_endian);
    return file;
}

struct npy_layout {
    bool is_double = false, little_endian = true, columns_first = false;
    int version = 1;
    std::string shape = "";  ///< as Python prints it; an empty text stands for (H, W)
};

byte_string npy_header(const std::string& dictionary, int version) {
    byte_string file = bytes_of("\x93NUMPY");
    file.push_back(static_cast<std::byte>(version));
    file.push_back(std::byte{0});
    if (version == 1)
        append_scalar(file, static_cast<std::uint16_t>(dictionary.size()), true);
    else
        append_scalar(file, static_cast<std::uint32_t>(dictionary.size()), true);
    append(file, bytes_of(dictionary));
    return file;
}

byte_string npy_file(const image<float>& map, const npy_layout& layout = {}) {
    std::string shape = layout.shape;
    if (shape.empty())
        shape.append("(").append(std::to_string(map.height())).append(", ").append(std::to_string(map.width())).append(")");
    const std::string type = std::string(layout.little_endian ? "<" : ">") + (layout.is_double ? "f8" : "f4");
    byte_string file = npy_header("{'descr': '" + type + "', 'fortran_order': " + (layout.columns_first ? "True" : "False") +
                                      ", 'shape': " + shape + ", }   \n",
                                  layout.version);
    for (std::size_t i = 0; i < map.size(); ++i) {
        const float value = layout.columns_first ? map(i % map.height(), i / map.height(), 0) : map.data()[i];
        if (layout.is_double)
            append_scalar(file, static_cast<double>(value), layout.little_endian);
        else
            append_scalar(file, value, layout.little_endian);
    }
    return file;
}

}  // namespace

TEST_CASE("PFM files with both byte orders and all line ends are read exactly, with the top row first") {
    std::mt19937 random(1);
    for (int i = 0; i < 50; ++i) {
        const image<float> map = random_map(1 + random() % 9, 1 + random() % 9, random);
        for (const char* line_end : {"\n", "\r\n", "\r"})
            for (const bool little_endian : {true, false})
                CHECK(same(decode_depth_map(pfm_file(map, little_endian, "Pf", line_end)), map));
    }
}

TEST_CASE("NPY files of every byte order, axis order, precision and version are read exactly") {
    std::mt19937 random(2);
    for (bool is_double : {false, true})
        for (bool little_endian : {false, true})
            for (bool columns_first : {false, true})
                for (int version : {1, 2, 3}) {
                    const image<float> map = random_map(2 + random() % 9, 2 + random() % 9, random);
                    CHECK(same(decode_depth_map(npy_file(map, {is_double, little_endian, columns_first, version, ""})), map));
                }
}

TEST_CASE("NPY axes of length 1 before and after height and width are dropped, and other shapes are refused") {
    std::mt19937 random(3);
    const image<float> map = random_map(4, 6, random);
    for (const char* shape : {"(4, 6)", "(4,6)", "(4, 6, 1)", "(1, 4, 6, 1)", "(1, 4, 6)", "(1, 1, 4, 6)", "(4, 6,)"})
        CHECK(same(decode_depth_map(npy_file(map, {.shape = shape})), map));
    for (const char* shape : {"(24,)", "()", "(2, 2, 6)", "(4, 3, 2)", "(0, 6)"})
        CHECK(raised([&] { decode_depth_map(npy_file(map, {.shape = shape})); }) == error_code::unsupported);
    for (const char* shape :
         {"(4, 7)", "(4 6", "4, 6", "(4, -6)", "(4, x)", "(4,, 6)", "(99999999999, 6)", "(1,1,1,1,1,1,1,4,6)"})
        CHECK(raised([&] { decode_depth_map(npy_file(map, {.shape = shape})); }) == error_code::invalid_data);
    CHECK(raised([&] { decode_depth_map(npy_file(map, {.shape = "(2147483647, 2147483647)"})); }) == error_code::too_large);
}

TEST_CASE("the error for a file that is not a readable depth map states the file's name and the reason") {
    const auto refused = [](const byte_string& file, error_code code, const std::string& words) {
        CHECK(raised([&] { decode_depth_map(file); }) == code);
        CHECK_THAT(message_of([&] { decode_depth_map(file, {}, "map.bin"); }),
                   Catch::Contains("map.bin") && Catch::Contains(words));
    };
    const image<float> map(2, 2, 1, 1.0F);
    refused({}, error_code::invalid_data, "an empty file");
    refused(pfm_file(map, true, "PF"), error_code::unsupported, "a color PFM file");
    refused(npy_header("{'descr': '<i4', 'fortran_order': False, 'shape': (2, 2), }", 1), error_code::unsupported, "<i4");
    refused(npy_header("{'descr': '<f4', 'fortran_order': False, 'shape': (2, 2), }", 9), error_code::unsupported, "9");
    refused(npy_header("{'descr': '<f4', 'shape': (2, 2), }", 1), error_code::invalid_data, "no fortran_order");
    refused(bytes_of("GIF89a??"), error_code::unsupported, "a GIF file");
    refused(bytes_of("Pf\n2 2\n0\n0123456789abcdef"), error_code::invalid_data, "scale");
    refused(bytes_of("Pf\n2 x\n1\n0123456789abcdef"), error_code::invalid_data, "no size");
    refused(encode_png(smooth_picture(20, 20, 3)), error_code::unsupported, "a color picture");
}

TEST_CASE("a truncated depth map is always refused") {
    std::mt19937 random(4);
    const image<float> map = random_map(3, 5, random);
    for (const byte_string& file : {pfm_file(map, true), npy_file(map), npy_file(map, {.is_double = true, .version = 2})})
        for (std::size_t size = 0; size < file.size(); ++size)
            REQUIRE(raised([&] { decode_depth_map(std::span(file).first(size)); }));
}

TEST_CASE("gray pictures are read with their stored values, even if they are saved as color") {
    const image<std::uint8_t> gray = smooth_picture(12, 20, 1);
    image<std::uint8_t> color(12, 20, 3);
    for (std::size_t i = 0; i < color.size(); ++i) color.data()[i] = gray.data()[i / 3];
    for (const byte_string& file : {encode_png(gray), encode_png(color)}) {
        const image<float> map = decode_depth_map(file);
        REQUIRE(map.size() == gray.size());
        for (std::size_t i = 0; i < map.size(); ++i) REQUIRE(map.data()[i] == static_cast<float>(gray.data()[i]));
    }
    const image<float> jpeg = decode_depth_map(encode_jpeg(color, 95));
    for (std::size_t i = 0; i < jpeg.size(); ++i) REQUIRE(std::abs(jpeg.data()[i] - static_cast<float>(gray.data()[i])) <= 4);
}

TEST_CASE("disparity is inverted if dark is near, and holes remain holes") {
    image<float> map(1, 5);
    map(0, 0, 0) = 10, map(0, 1, 0) = 4, map(0, 2, 0) = 0, map(0, 3, 0) = nan_value, map(0, 4, 0) = infinity;
    const image<float> turned = decode_depth_map(npy_file(map), {.white_is_near = false, .invalid_zero = true});
    CHECK(turned(0, 0, 0) == 0);
    CHECK(turned(0, 1, 0) == 6);
    for (std::size_t x : {2u, 3u, 4u}) CHECK(std::isnan(turned(0, x, 0)));
    CHECK(decode_depth_map(npy_file(map), {.white_is_near = false})(0, 2, 0) == 10);
}

TEST_CASE("distances in meters are converted to disparity in 1 / meter, and values that are not distances become holes") {
    image<float> map(1, 7);
    const float values[] = {2000, 500, 0, -3, nan_value, infinity, 1e-42F};
    std::copy(values, values + 7, map.data());
    const image<float> disparity = decode_depth_map(npy_file(map), {.kind = depth_map_kind::meters, .scale = 0.001F});
    CHECK(disparity(0, 0, 0) == Approx(0.5));
    CHECK(disparity(0, 1, 0) == Approx(2));
    for (std::size_t x = 2; x < 7; ++x) CHECK(std::isnan(disparity(0, x, 0)));
    CHECK(same(disparity,
               decode_depth_map(npy_file(map), {.kind = depth_map_kind::meters, .white_is_near = false, .scale = 0.001F})));
}

TEST_CASE("values of type double beyond the range of float become holes") {
    byte_string file = npy_header("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 2), }", 1);
    append_scalar(file, 1e300, true);
    append_scalar(file, 3.0, true);
    const image<float> map = decode_depth_map(file);
    CHECK(std::isnan(map(0, 0, 0)));
    CHECK(map(0, 1, 0) == 3);
}

TEST_CASE("values at both ends of float's range stay finite and ordered, even if they are inverted") {
    image<float> map(1, 3);
    map(0, 0, 0) = -3e38F, map(0, 1, 0) = 0, map(0, 2, 0) = 3e38F;
    for (bool white_is_near : {true, false}) {
        const image<float> disparity = decode_depth_map(npy_file(map), {.white_is_near = white_is_near});
        for (float v : disparity) REQUIRE(std::isfinite(v));
        CHECK((disparity(0, 0, 0) < disparity(0, 1, 0)) == white_is_near);
        CHECK((disparity(0, 1, 0) < disparity(0, 2, 0)) == white_is_near);
    }
}

TEST_CASE("a scale that is not positive and finite, and a map above the pixel limit, are refused") {
    const byte_string file = npy_file(image<float>(3, 4, 1, 1.0F));
    for (float scale : {0.0F, -1.0F, nan_value, infinity})
        CHECK(raised([&] { decode_depth_map(file, {.scale = scale}); }) == error_code::invalid_option);
    CHECK(decode_depth_map(file, {.limits = {.max_pixels = 12}}).size() == 12);
    CHECK(raised([&] { decode_depth_map(file, {.limits = {.max_pixels = 11}}); }) == error_code::too_large);
    CHECK(raised([&] { decode_depth_map(encode_png(smooth_picture(3, 4, 1)), {.limits = {.max_pixels = 11}}); }) ==
          error_code::too_large);
    CHECK(raised([&] { decode_depth_map(bytes_of("Pf 2000000000 2000000000 -1\n")); }) == error_code::too_large);
}

TEST_CASE("fill_invalid() gives every hole the value of a nearest valid pixel, and changes no other pixel") {
    std::mt19937 random(5);
    for (int i = 0; i < 300; ++i) {
        const std::size_t h = 1 + random() % 12, w = 1 + random() % 12;
        image<float> map = random_map(h, w, random);
        const unsigned holes = static_cast<unsigned>(random() % 10);
        for (float& v : map)
            if (random() % 10 < holes) v = nan_value;
        map(random() % h, random() % w, 0) = 1;
        const image<float> filled = fill_invalid(map);
        for (std::size_t y = 0; y < h; ++y)
            for (std::size_t x = 0; x < w; ++x) {
                const auto distance = [&](std::size_t v, std::size_t u) {
                    return (v > y ? v - y : y - v) + (u > x ? u - x : x - u);
                };
                std::size_t nearest = h + w;
                bool is_one_of_the_nearest = false;
                for (std::size_t v = 0; v < h; ++v)
                    for (std::size_t u = 0; u < w; ++u)
                        if (!std::isnan(map(v, u, 0))) nearest = std::min(nearest, distance(v, u));
                for (std::size_t v = 0; v < h; ++v)
                    for (std::size_t u = 0; u < w; ++u)
                        if (distance(v, u) == nearest && map(v, u, 0) == filled(y, x, 0)) is_one_of_the_nearest = true;
                REQUIRE(is_one_of_the_nearest);
            }
    }
    CHECK(raised([] { fill_invalid(image<float>(3, 3, 1, nan_value)); }) == error_code::invalid_data);
}

TEST_CASE("a depth map may differ from its photo in size, but not in proportions") {
    const image<std::uint8_t> photo(1024, 768, 3, 0);
    const auto fits = [&](std::size_t h, std::size_t w) { return !raised([&] { check_fits(image<float>(h, w), photo); }); };
    CHECK(fits(1024, 768));
    CHECK(fits(384, 288));
    CHECK(fits(4032, 3024));
    CHECK(fits(100, 76));
    CHECK_FALSE(fits(768, 1024));
    CHECK_FALSE(fits(100, 72));
    CHECK_FALSE(fits(100, 78));
    CHECK(raised([&] { check_fits(image<float>(9, 9), photo); }) == error_code::mismatch);
    CHECK_THAT(message_of([&] { check_fits(image<float>(8, 9), photo, "map.png"); }),
               Catch::Contains("map.png") && Catch::Contains("768 x 1024") && Catch::Contains("9 x 8"));
}

TEST_CASE("thousands of damaged depth maps raise an error or are decoded to finite values") {
    std::mt19937 random(6);
    const image<float> map = random_map(5, 7, random);
    image<std::uint16_t> deep(9, 11);
    for (std::uint16_t& v : deep) v = static_cast<std::uint16_t>(random());
    const byte_string originals[] = {pfm_file(map, true), npy_file(map), npy_file(map, {.is_double = true, .version = 2}),
                                     encode_png(deep), encode_jpeg(smooth_picture(17, 17, 1), 90)};
    std::size_t decoded = 0, refused = 0;
    for (const byte_string& original : originals)
        for (int i = 0; i < 2000; ++i) {
            byte_string file = damaged_copy(original, random);
            if (file.size() > 8 && file[1] == std::byte{'P'}) file = with_right_checksums(file);
            depth_map_options options;
            options.limits.max_pixels = 1 << 20;
            options.kind = i % 2 == 0 ? depth_map_kind::disparity : depth_map_kind::meters;
            const std::optional<error_code> code = raised([&] {
                for (float v : fill_invalid(decode_depth_map(file, options))) REQUIRE(std::isfinite(v));
            });
            ++(code ? refused : decoded);
        }
    CHECK(decoded > 1000);
    CHECK(refused > 1000);
}

TEST_CASE("every depth map of the RGB-D collection loads, matches its photo, and has the range that the manifest states") {
    const std::filesystem::path folder = std::filesystem::path(LDI_SHARED_DIR) / "rgbd";
    if (!std::filesystem::exists(folder / "manifest.json")) {
        WARN("skipped: no " << folder);
        return;
    }
    const byte_string text = read_file(folder / "manifest.json");
    const char* const first = reinterpret_cast<const char*>(text.data());
    std::size_t checked = 0;
    for (const nlohmann::json& entry : nlohmann::json::parse(first, first + text.size())) {
        const std::string name = entry["name"];
        INFO(name);
        const bool meters = entry["kind"] == "depth";
        depth_map_options options;
        options.kind = meters ? depth_map_kind::meters : depth_map_kind::disparity;
        options.scale = 1 / entry["scale"].get<float>();
        options.invalid_zero = true;
        if (!std::filesystem::exists(folder / entry["map"].get<std::string>())) continue;
        const image<float> map = load_depth_map(folder / entry["map"].get<std::string>(), options);
        check_fits(map, load_photo(folder / entry["image"].get<std::string>()).color, name);
        float lowest = infinity, highest = 0;
        std::size_t valid = 0;
        for (float v : map) {
            if (std::isnan(v)) continue;
            const float stored = meters ? 1 / v : v;
            lowest = std::min(lowest, stored), highest = std::max(highest, stored), ++valid;
        }
        CHECK(static_cast<double>(valid) / static_cast<double>(map.size()) == Approx(entry["valid"].get<double>()).margin(1e-3));
        CHECK(lowest == Approx(entry["min"].get<double>()).epsilon(1e-3));
        CHECK(highest == Approx(entry["max"].get<double>()).epsilon(1e-3));
        ++checked;
    }
    CHECK(checked > 40);
}

TEST_CASE("a disparity map of the published network loads and has the proportions of its photo") {
    const std::filesystem::path folder = std::filesystem::path(LDI_SHARED_DIR) / "tiefenrausch";
    if (!std::filesystem::exists(folder / "output")) {
        WARN("skipped: no " << folder / "output");
        return;
    }
    const image<float> columns = load_depth_map(folder / "output/columns.npy");
    CHECK(columns.height() == 384);
    CHECK(columns.width() == 288);
    CHECK(*std::min_element(columns.begin(), columns.end()) == Approx(0.37730852));
    CHECK(*std::max_element(columns.begin(), columns.end()) == Approx(2.1164987));
    check_fits(columns, load_photo(folder / "input/columns.jpg").color);
}

TEST_CASE("shrink_depth_map() averages the known pixels of each block, and keeps maps within the limit unchanged") {
    const float unknown = std::numeric_limits<float>::quiet_NaN();
    image<float> map(3, 5);
    for (std::size_t i = 0; i < map.size(); ++i) map.data()[i] = static_cast<float>(i);
    map(0, 1) = unknown, map(2, 4) = unknown;
    const image<float> same = shrink_depth_map(map, 15);
    CHECK((same.height() == 3 && same.width() == 5));
    const image<float> small = shrink_depth_map(map, 14);  // blocks of 2 x 2, truncated at the right and at the bottom
    REQUIRE((small.height() == 2 && small.width() == 3));
    CHECK(small(0, 0) == Approx((0 + 5 + 6) / 3.0));
    CHECK(small(0, 1) == Approx((2 + 3 + 7 + 8) / 4.0));
    CHECK(small(0, 2) == Approx((4 + 9) / 2.0));
    CHECK(small(1, 0) == Approx((10 + 11) / 2.0));
    CHECK(std::isnan(small(1, 2)));
}
