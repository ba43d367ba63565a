#include <ldi/io/photo_depth.hpp>

#include <catch2/catch.hpp>
#include <tests/io/phone_files.hpp>

#include <algorithm>
#include <cmath>

using namespace ldi;
using namespace ldi::testing;

#if defined(LDI_WITH_PUGIXML)

namespace {

const image<std::uint8_t> picture = smooth_picture(24, 40, 3);
const byte_string photo_file = encode_jpeg(picture, 90);

/// A picture of half the photo's size; values start at 10.
image<std::uint8_t> depth_picture() {
    image<std::uint8_t> depth(12, 20, 1);
    for (std::size_t i = 0; i < depth.size(); ++i) depth.data()[i] = static_cast<std::uint8_t>(10 + i);
    return depth;
}

const image<std::uint8_t> stored = depth_picture();
const byte_string depth_file = encode_png(stored);
const byte_string decoy_file = encode_jpeg(image<std::uint8_t>(12, 20, 1, 200), 90);  // a gain map of the same shape

/// Checks the depth map that is decoded from a file.
///
/// source     expected name of the format
/// disparity  returns 1 / distance for a stored value, 0 to 1
template <class Disparity>
void check_depth(const byte_string& file, const std::string& source, bool is_metric, Disparity&& disparity,
                 double tolerance = 1e-5) {
    const photo_with_depth found = decode_photo_with_depth(file);
    INFO(found.refused);
    REQUIRE(found.depth);
    CHECK(found.refused.empty());
    CHECK(found.depth->source == source);
    CHECK(found.depth->is_metric == is_metric);
    CHECK(found.depth->is_inverse_depth);
    CHECK_FALSE(found.depth->is_white_near_a_guess);
    REQUIRE(found.depth->disparity.size() == stored.size());
    for (std::size_t i = 0; i < stored.size(); ++i)
        REQUIRE(found.depth->disparity.data()[i] == Approx(disparity(stored.data()[i] / 255.0)).epsilon(tolerance));
    CHECK(same_shape(found.photo.color, picture));
}

void check_refused(const byte_string& file, const std::string& words) {
    const photo_with_depth found = decode_photo_with_depth(file);
    CHECK_FALSE(found.depth);
    CHECK_THAT(found.refused, Catch::Contains(words));
    CHECK(same_shape(found.photo.color, picture));
}

}  // namespace

TEST_CASE("both GDepth formats are converted to 1 / distance, which is metric if the file states a unit") {
    const auto inverse = [](double v) { return 1 / (8.0 * 2.0 / (8.0 - v * (8.0 - 2.0))); };  // the reference's formula
    const auto linear = [](double v) { return 1 / (2.0 + v * (8.0 - 2.0)); };
    const std::string range = "GDepth:Near=\"2\" GDepth:Far=\"8\" ";
    check_depth(gdepth_jpeg(photo_file, depth_file, range + "GDepth:Format=\"RangeInverse\""), "GDepth, RangeInverse", false,
                inverse);
    check_depth(gdepth_jpeg(photo_file, depth_file, range + "GDepth:Format=\"RangeLinear\" GDepth:Units=\"m\""),
                "GDepth, RangeLinear", true, linear);
    check_depth(gdepth_jpeg(photo_file, depth_file, range + "GDepth:Format=\"RangeInverse\" GDepth:Units=\"mm\""),
                "GDepth, RangeInverse", true, [&](double v) { return 1000 * inverse(v); });
}

TEST_CASE("GDepth is found as XML elements, with another prefix, and in Extended XMP split at any byte") {
    const auto linear = [](double v) { return 1 / (1.0 + v); };
    const std::string elements =
        "<g:Near>1</g:Near><g:Far>2</g:Far><g:Format>RangeLinear</g:Format><g:Data>\n" + base64(depth_file) + "\n</g:Data>";
    check_depth(
        with_segments(photo_file, xmp_segment(xmp_packet("xmlns:g=\"http://ns.google.com/photos/1.0/depthmap/\"", elements))),
        "GDepth, RangeLinear", false, linear);
    const std::string identifier = "0123456789ABCDEF0123456789ABCDEF";
    const std::string first = std::string(gdepth_space) +
                              "xmlns:xmpNote=\"http://ns.adobe.com/xmp/note/\" GDepth:Near=\"1\" GDepth:Far=\"2\" "
                              "GDepth:Format=\"RangeLinear\" xmpNote:HasExtendedXMP=\"" +
                              identifier + "\"";
    const std::string second = xmp_packet(std::string(gdepth_space) + "GDepth:Data=\"" + base64(depth_file) + "\"");
    for (std::size_t part : {std::size_t{37}, std::size_t{200}, std::size_t{60'000}}) {
        byte_string segments = xmp_segment(xmp_packet(first));
        // Segments of another packet, which the reader must ignore.
        append(segments, extended_xmp_segments(std::string(second.size(), 'x'), std::string(32, 'F'), part));
        append(segments, extended_xmp_segments(second, identifier, part));
        check_depth(with_segments(photo_file, segments), "GDepth, RangeLinear", false, linear);
    }
}

TEST_CASE("pixels without confidence in GDepth become unknown") {
    image<std::uint8_t> confidence(6, 10, 1, 255);
    confidence(2, 3, 0) = 0;
    const std::string fields = "GDepth:Near=\"1\" GDepth:Far=\"2\" GDepth:Confidence=\"" + base64(encode_png(confidence)) + "\"";
    const photo_with_depth found = decode_photo_with_depth(gdepth_jpeg(photo_file, depth_file, fields));
    REQUIRE(found.depth);
    for (std::size_t y = 0; y < 12; ++y)
        for (std::size_t x = 0; x < 20; ++x) REQUIRE(std::isnan(found.depth->disparity(y, x, 0)) == (y / 2 == 2 && x / 2 == 3));
}

TEST_CASE("Dynamic Depth is found by its semantic or its address, in both containers, beside other files in any order") {
    const auto inverse = [](double v) { return (1 - v) / 0.5 + v / 4; };
    const std::string fields =
        "DepthMap:Format=\"RangeInverse\" DepthMap:Near=\"0.5\" DepthMap:Far=\"4\" DepthMap:Units=\"Meters\" "
        "DepthMap:DepthURI=\"android/depthmap\"";
    const appended_file gain_map = {"GainMap", "gain", decoy_file}, depth = {"Depth", "", depth_file},
                        by_address = {"", "android/depthmap", depth_file},
                        movie = {"MotionPhoto", "", bytes_of("ftyp and so on")};
    for (const container_words& words : {dynamic_depth_words, photos_words})
        for (const std::vector<appended_file>& files :
             {std::vector{depth}, {by_address}, {gain_map, depth}, {depth, gain_map}, {gain_map, by_address, movie}})
            check_depth(dynamic_depth_jpeg(photo_file, files, fields, words), "Dynamic Depth, RangeInverse", true, inverse);
    // Inserts 100 unlisted bytes after the photo. The reader still finds the depth, because it counts the
    // positions of files from the end.
    byte_string file = dynamic_depth_jpeg(photo_file, {}, fields),
                listed = dynamic_depth_jpeg(photo_file, {gain_map, depth}, fields);
    const std::size_t photo_end = listed.size() - decoy_file.size() - depth_file.size();
    listed.insert(listed.begin() + static_cast<std::ptrdiff_t>(photo_end), 100, std::byte{7});
    check_depth(listed, "Dynamic Depth, RangeInverse", true, inverse);
    check_refused(file, "no such file after the photo");
    check_refused(dynamic_depth_jpeg(photo_file, {gain_map}, fields), "no such file after the photo");
}

TEST_CASE("Apple's disparity and depth are found by the XMP of their picture, among other pictures in the file") {
    const byte_string gray = encode_jpeg(stored, 100);
    const auto apple = [&](const std::string& kind, const std::string& accuracy) {
        return multi_picture_jpeg(photo_file,
                                  {decoy_file, with_segments(gray, xmp_segment(apple_packet(kind, "0.5", "4.5", accuracy)))});
    };
    check_depth(
        apple("disparity", "relative"), "Apple disparity", false, [](double v) { return 0.5 + 4 * v; }, 0.05);
    check_depth(
        apple("disparity", "absolute"), "Apple disparity", true, [](double v) { return 0.5 + 4 * v; }, 0.05);
    check_depth(
        apple("depth", "absolute"), "Apple depth", true, [](double v) { return 1 / (0.5 + 4 * v); }, 0.05);
    const photo_with_depth other = decode_photo_with_depth(multi_picture_jpeg(photo_file, {decoy_file}));
    CHECK_FALSE(other.depth);
    CHECK(other.refused.empty());
}

TEST_CASE("the EXIF orientation rotates the depth map with its photo") {
    const std::string fields = "GDepth:Near=\"1\" GDepth:Far=\"2\" GDepth:Format=\"RangeLinear\"";
    const byte_string file = jpeg_with_exif(gdepth_jpeg(photo_file, depth_file, fields), exif_bytes(6, 26));
    const photo_with_depth found = decode_photo_with_depth(file);
    REQUIRE(found.depth);
    CHECK(found.photo.color.height() == 40);
    REQUIRE(found.depth->disparity.height() == 20);
    CHECK(found.depth->disparity(0, 11, 0) == Approx(1 / (1 + stored(0, 0, 0) / 255.0)));  // the top left pixel is now top right
}

TEST_CASE("pixels that another decoder returned are composited on white, and get the focal length and depth of their file") {
    image<std::uint8_t> pixels(24, 40, 4, 255);
    pixels(5, 6, 0) = 55, pixels(5, 6, 3) = 0;
    pixels(7, 8, 1) = 55, pixels(7, 8, 3) = 51;  // opacity 0.2
    const std::string fields = "GDepth:Near=\"1\" GDepth:Far=\"2\" GDepth:Format=\"RangeLinear\"";
    const byte_string file = jpeg_with_exif(gdepth_jpeg(photo_file, depth_file, fields), exif_bytes(1, 26));
    const photo_with_depth found = with_depth_inside(pixels, file);
    CHECK(found.photo.color.channels() == 3);
    CHECK(found.photo.color(5, 6, 0) == 255);
    CHECK(found.photo.color(7, 8, 1) == 215);
    CHECK(found.photo.focal_length_35mm == 26.0F);
    REQUIRE(found.depth);
    CHECK(std::ranges::equal(found.depth->disparity, decode_photo_with_depth(file).depth->disparity));
    CHECK_FALSE(with_depth_inside(pixels, photo_file).depth);
    CHECK_THROWS_AS(with_depth_inside(pixels, std::span(photo_file).first(30)), error);
}

TEST_CASE("a photo with unusable depth is decoded without it, and the reason is stated") {
    const auto with = [](const std::string& fields) { return gdepth_jpeg(photo_file, depth_file, fields); };
    check_refused(with("GDepth:Near=\"1\""), "finite numbers in Near and Far, found a missing or invalid number");
    check_refused(with("GDepth:Near=\"1\" GDepth:Far=\"x\""),
                  "finite numbers in Near and Far, found a missing or invalid number");
    check_refused(with("GDepth:Near=\"2\" GDepth:Far=\"2\""), "a valid depth range, found 2 to 2");
    check_refused(with("GDepth:Near=\"-1\" GDepth:Far=\"2\""), "a valid depth range, found -1 to 2");
    check_refused(with("GDepth:Near=\"1e-30\" GDepth:Far=\"-1e300\""), "a valid depth range, found 1e-30 to -1e+300");
    check_refused(with("GDepth:Near=\"1\" GDepth:Far=\"2\" GDepth:Format=\"Magic\""), "Magic");
    const std::string range = "GDepth:Near=\"1\" GDepth:Far=\"2\"";
    check_refused(gdepth_jpeg(photo_file, bytes_of("hello"), range), "unknown format");
    check_refused(gdepth_jpeg(photo_file, encode_png(image<std::uint8_t>(20, 20, 1, 9)), range), "proportions");
    check_refused(gdepth_jpeg(photo_file, bytes_of("Pf\n2 2\n-1.0\n0123456789abcdef"), range), "expected a JPEG or PNG file");
    byte_string cut = depth_file;
    cut.resize(cut.size() / 2);
    check_refused(gdepth_jpeg(photo_file, cut, range), "cut off");
}

TEST_CASE("deeply nested, long or malformed XMP is read without failure and yields no depth") {
    std::string nested, wide = xmp_packet(gdepth_space);
    for (int i = 0; i < 20'000; ++i) nested += "<a>";
    for (int i = 0; i < 10'000; ++i) wide.insert(wide.size() - 60, "<b:c/>");
    for (const std::string& packet :
         {nested, wide, std::string("<!DOCTYPE a [<!ENTITY b \"bbbb\">]><a>&b;</a>"), std::string(3, '<')})
        CHECK_FALSE(decode_photo_with_depth(with_segments(photo_file, xmp_segment(packet.substr(0, 65'000)))).depth);
}

TEST_CASE("thousands of damaged photos with depth raise an error or are decoded; known disparities are positive and finite") {
    std::mt19937 random(9);
    const std::string fields = "DepthMap:Near=\"0.5\" DepthMap:Far=\"4\"";
    const byte_string gray = with_segments(encode_jpeg(stored, 90), xmp_segment(apple_packet("disparity", "0.5", "4.5")));
    const byte_string originals[] = {
        gdepth_jpeg(photo_file, depth_file, "GDepth:Near=\"1\" GDepth:Far=\"2\""),
        dynamic_depth_jpeg(photo_file, {{"GainMap", "", decoy_file}, {"Depth", "", depth_file}}, fields),
        multi_picture_jpeg(photo_file, {decoy_file, gray})};
    std::size_t with_depth = 0, without = 0;
    for (const byte_string& original : originals)
        for (int i = 0; i < 1000; ++i)
            raised([&] {
                const photo_with_depth found = decode_photo_with_depth(damaged_copy(original, random));
                ++(found.depth ? with_depth : without);
                if (!found.depth) return;
                for (float v : found.depth->disparity) REQUIRE((std::isnan(v) || (std::isfinite(v) && v > 0)));
            });
    CHECK(with_depth > 100);
    CHECK(without > 100);
}

#endif

TEST_CASE("a depth map file beside the photo is read with white as near, and this choice is marked as a guess") {
    const scratch_folder folder;
    image<std::uint8_t> map(12, 20, 1, 3);
    map(0, 0, 0) = 9;
    save_jpeg(folder / "a.jpg", smooth_picture(24, 40, 3));
    CHECK_FALSE(load_photo_with_depth(folder / "a.jpg").depth);
    save_png(folder / "a_depth.png", map);
    const photo_with_depth found = load_photo_with_depth(folder / "a.jpg");
    REQUIRE(found.depth);
    CHECK(found.depth->source == (folder / "a_depth.png").string());
    CHECK(found.depth->disparity(0, 0, 0) == 9);
    CHECK(found.depth->is_white_near_a_guess);
    CHECK_FALSE(found.depth->is_inverse_depth);
    const photo_with_depth decoded = decode_photo_with_map(read_file(folder / "a.jpg"), encode_png(map), {}, "photo", "map");
    REQUIRE(decoded.depth);
    CHECK(decoded.depth->source == "map");
    CHECK(std::ranges::equal(decoded.depth->disparity, found.depth->disparity));
    save_png(folder / "a_depth.png", image<std::uint8_t>(12, 12, 1, 3));
    const photo_with_depth other = load_photo_with_depth(folder / "a.jpg");
    CHECK_FALSE(other.depth);
    CHECK_THAT(other.refused, Catch::Contains("a_depth.png") && Catch::Contains("proportions"));
}

TEST_CASE(
    "the right half of a PNG file is read as depth only if it is gray, has many shades, and is not a gray copy of the left "
    "half") {
    const image<std::uint8_t> left = smooth_picture(24, 40, 3);
    const auto beside = [&](const auto& right) {
        image<std::uint8_t> both(24, 80, 3);
        for (std::size_t y = 0; y < 24; ++y)
            for (std::size_t x = 0; x < 40; ++x)
                for (std::size_t c = 0; c < 3; ++c) both(y, x, c) = left(y, x, c), both(y, 40 + x, c) = right(y, x, c);
        return decode_photo_with_depth(encode_png(both));
    };
    const auto map = [](std::size_t y, std::size_t x) { return static_cast<std::uint8_t>(20 + 2 * x + 90 * (y / 12)); };
    const photo_with_depth found = beside([&](std::size_t y, std::size_t x, std::size_t) { return map(y, x); });
    REQUIRE(found.depth);
    CHECK(largest_difference(found.photo.color, left) == 0);
    for (std::size_t y = 0; y < 24; ++y)
        for (std::size_t x = 0; x < 40; ++x) REQUIRE(found.depth->disparity(y, x, 0) == map(y, x));

    const auto is_whole = [](const photo_with_depth& photo) { return !photo.depth && photo.photo.color.width() == 80; };
    CHECK(is_whole(beside([&](std::size_t y, std::size_t x, std::size_t c) {
        return static_cast<std::uint8_t>(map(y, x) + (y == 23 && x == 39 && c == 0));  // one colored pixel
    })));
    CHECK(is_whole(beside([](std::size_t, std::size_t x, std::size_t) { return static_cast<std::uint8_t>(x % 2); })));
    CHECK(is_whole(beside([](std::size_t y, std::size_t x, std::size_t) {  // another gray photo, with much detail
        return static_cast<std::uint8_t>(40 * ((7 * x + 3 * y) % 5) + y);
    })));
    CHECK(is_whole(beside([](std::size_t y, std::size_t x, std::size_t) {  // a page of text: white, a tenth of it gray
        return static_cast<std::uint8_t>(x % 10 == 9 ? 10 * y : 255);
    })));
    CHECK(is_whole(beside([&](std::size_t y, std::size_t x, std::size_t) {  // a gray copy of the left half
        return static_cast<std::uint8_t>((left(y, x, 0) + left(y, x, 1) + left(y, x, 2)) / 3);
    })));
}

TEST_CASE("a depth map is inverted if the estimate contradicts it, and stays as it is if either is flat") {
    photo_depth depth{image<float>(9, 13), false, false, true, "map"};
    image<float> estimate(30, 20);
    for (std::size_t y = 0; y < 9; ++y)
        for (std::size_t x = 0; x < 13; ++x) depth.disparity(y, x, 0) = 1 + static_cast<float>(x * x);
    for (std::size_t y = 0; y < 30; ++y)
        for (std::size_t x = 0; x < 20; ++x) estimate(y, x, 0) = 3 - static_cast<float>(x);
    CHECK_FALSE(invert_if_contradicted(depth, image<float>(4, 4, 1, 2.0F)));
    CHECK(depth.source == "map");
    CHECK(invert_if_contradicted(depth, estimate));
    CHECK(depth.source == "map, black is near");
    CHECK(depth.disparity(4, 0, 0) == 145);
    CHECK(depth.disparity(4, 1, 0) == 144);
    CHECK(depth.disparity(4, 12, 0) == 1);
    CHECK_FALSE(invert_if_contradicted(depth, estimate));
    for (float& v : depth.disparity) v = v < 100 ? 3e38F : -3e38F;  // the difference of these values exceeds the range of floats
    CHECK(invert_if_contradicted(depth, estimate));
    for (const float v : depth.disparity) REQUIRE(std::abs(v) == 3e38F);
}

TEST_CASE("the expected source of depth is found in every photo of the collection") {
    const std::filesystem::path folder = std::filesystem::path(LDI_SHARED_DIR) / "depth_companions";
    if (!std::filesystem::exists(folder)) {
        WARN("skipped: no " << folder);
        return;
    }
    const std::pair<const char*, const char*> sources[] = {
#if defined(LDI_WITH_PUGIXML)
        {"gdepth_cafe.jpg", "GDepth, RangeInverse"},
        {"gdepth_melons.jpg", "GDepth, RangeInverse"},
        {"gdepth_pens.jpg", "GDepth, RangeInverse"},
        {"iphone_mpo_a.jpg", "Apple disparity"},
#if defined(LDI_WITH_LIBHEIF)
        {"iphone_portrait_pug.heic", "HEIC disparity"},
#endif
#endif
        {"pair_flowers.jpg", "pair_flowers_depth.jpg"},
        {"pair_mango.jpg", "pair_mango_depth.jpg"},
        {"pair_shelf.jpg", "pair_shelf_depth.jpg"},
        {"pair_tunnel.jpg", "pair_tunnel_depth.jpg"},
    };
    for (const auto& [name, source] : sources) {
        const photo_with_depth found = load_photo_with_depth(folder / name);
        INFO(name << found.refused);
        REQUIRE(found.depth);
        CHECK_THAT(found.depth->source, Catch::EndsWith(source));
    }
}
