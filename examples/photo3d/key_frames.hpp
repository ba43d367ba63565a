// Reads custom camera paths: a JSON file of key frames. Errors name the key frame and the member.
#pragma once

#include "json_input.hpp"

#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/io/file.hpp>
#include <ldi/render/camera_paths.hpp>

#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

namespace ldi::examples {

/// Locates a syntax error of JSON by line and column, counted from 1.
inline std::string place_of_fault(const std::string& text) {
    struct fault_finder : nlohmann::json_sax<nlohmann::json> {
        std::size_t position = 0;
        bool null() override { return true; }
        bool boolean(bool) override { return true; }
        bool number_integer(number_integer_t) override { return true; }
        bool number_unsigned(number_unsigned_t) override { return true; }
        bool number_float(number_float_t, const string_t&) override { return true; }
        bool string(string_t&) override { return true; }
        bool binary(binary_t&) override { return true; }
        bool start_object(std::size_t) override { return true; }
        bool key(string_t&) override { return true; }
        bool end_object() override { return true; }
        bool start_array(std::size_t) override { return true; }
        bool end_array() override { return true; }
        bool parse_error(std::size_t at, const std::string&, const nlohmann::detail::exception&) override {
            position = at;
            return false;
        }
    } finder;
    nlohmann::json::sax_parse(text, &finder);
    std::size_t line = 1, letter = 1;
    for (std::size_t i = 0; i + 1 < finder.position && i < text.size(); ++i) {
        letter = text[i] == '\n' ? 1 : letter + 1;
        line += text[i] == '\n' ? 1U : 0U;
    }
    return "line " + std::to_string(line) + ", column " + std::to_string(letter);
}

/// Reads the members of one key frame.
class key_frame_reader {
public:
    key_frame_reader(const nlohmann::json& key, std::string where) : key_(key), where_(std::move(where)) {
        if (!key.is_object()) fail("an object: {\"time\": ..., \"position\": ..., \"target\": ...}", kind_of(key));
    }
    float number(const char* name) const {
        const auto value = key_.find(name);
        if (value == key_.end()) fail(quoted(name) + ", a number", "none");
        return to_number(name, *value);
    }
    std::array<float, 3> point(const char* name) const {
        const auto value = key_.find(name);
        if (value == key_.end()) fail(quoted(name) + ", a list of three numbers", "none");
        if (!value->is_array()) fail(quoted(name) + ", a list of three numbers", kind_of(*value));
        if (value->size() != 3) fail(quoted(name) + ", a list of three numbers", std::to_string(value->size()) + " values");
        return {to_number(name, (*value)[0]), to_number(name, (*value)[1]), to_number(name, (*value)[2])};
    }
    bool has(const char* name) const { return key_.contains(name); }
    [[noreturn]] void fail(const std::string& expected, const std::string& found) const {
        raise(error_code::invalid_data, where_, expected, found);
    }

private:
    static std::string quoted(const char* name) { return '"' + std::string(name) + '"'; }
    static std::string kind_of(const nlohmann::json& value) {
        switch (value.type()) {
            case nlohmann::json::value_t::null: return "null";
            case nlohmann::json::value_t::object: return "an object";
            case nlohmann::json::value_t::array: return "a list";
            case nlohmann::json::value_t::string: return "a string";
            case nlohmann::json::value_t::boolean: return "true or false";
            default: return "a number";
        }
    }
    float to_number(const char* name, const nlohmann::json& value) const {
        if (!value.is_number()) fail("a number in " + quoted(name), kind_of(value));
        const double number = value.get<double>();
        if (!(std::abs(number) <= 1e6)) fail(quoted(name) + " between -1000000 and 1000000", value.dump());
        return static_cast<float>(number);
    }

    const nlohmann::json& key_;
    std::string where_;
};

/// Reads [{"time": 0, "position": [0, 0, 0], "target": [0, 0, -2], "zoom": 1}, ...]. Lengths are in the units of the photo's
/// space, in which the nearest surface is at z = -1 unless depth is metric. Positions beyond the motion budget are moved toward
/// the photo's viewpoint (within_motion). Raises file_access, invalid_data.
inline std::vector<key_frame> load_key_frames(const std::filesystem::path& file) {
    constexpr std::size_t max_bytes = std::size_t{1} << 24;
    std::error_code ignored;
    const std::filesystem::file_status status = std::filesystem::status(file, ignored);
    if (std::filesystem::is_other(status))  // the program reads the file twice
        raise(error_code::file_access, file.string(), "a file of key frames", "a pipe or a device");
    const std::vector<std::byte> bytes = read_file(file, max_bytes);
    const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
    const nlohmann::json keys = parse_json(text, file.string());
    const auto fail = [&](const char* expected, const std::string& found) {
        raise(error_code::invalid_data, file.string(), expected, found);
    };
    if (keys.is_discarded()) fail("a list of key frames, as JSON", "invalid JSON at " + place_of_fault(text));
    if (!keys.is_array()) fail("a list of key frames: [{\"time\": 0, ...}, ...]", "JSON that is not a list");
    if (keys.empty()) fail("a list of key frames", "an empty list");
    std::vector<key_frame> result;
    for (const nlohmann::json& key : keys) {
        const key_frame_reader reader(key, file.string() + ", key frame " + std::to_string(result.size() + 1));
        key_frame k;
        k.time = reader.number("time");
        k.position = reader.point("position");
        k.target = reader.point("target");
        k.zoom = reader.has("zoom") ? reader.number("zoom") : 1.0F;
        if (k.position[0] == k.target[0] && k.position[2] == k.target[2])
            reader.fail("a target that is not straight above or below the position", "a target straight above or below");
        if (!(k.zoom > 0)) reader.fail("a \"zoom\" above 0", detail::to_text(k.zoom));
        if (!result.empty() && !(k.time > result.back().time))
            reader.fail("increasing times", detail::to_text(result.back().time) + ", then " + detail::to_text(k.time));
        result.push_back(k);
    }
    return result;
}

}  // namespace ldi::examples
