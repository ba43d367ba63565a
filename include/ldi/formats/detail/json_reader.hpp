// Checks JSON (RFC 8259) and locates its values, for detail/json.hpp. Rejects duplicate names, nesting deeper than the caller
// allows, and strings that are not UTF-8.
#pragma once

#include <ldi/base/buffer.hpp>
#include <ldi/base/error.hpp>
#include <ldi/base/printable.hpp>
#include <ldi/base/utf8.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace ldi { inline namespace LDI_CONFIGURATION { namespace detail {

enum class json_kind { none, null, boolean, number, string, array, object };
constexpr std::string_view kind_text(json_kind kind) {
    constexpr std::string_view names[] = {"nothing", "null", "a boolean", "a number", "a string", "an array", "an object"};
    return names[static_cast<std::size_t>(kind)];
}

/// The text of a value, without surrounding white space.
struct json_value {
    json_kind kind = json_kind::none;
    std::string_view text = "nothing";
};

/// Callback for the members of an object or the elements of an array. This is a function pointer, not a template parameter, so
/// that the reader is compiled only once.
using json_visitor = void (*)(void* to, std::string_view name, const json_value& value);

/// Returns 0 to 15, or 16 if c is not a hexadecimal digit.
inline std::uint32_t hexadecimal_value(char c) {
    if (c >= '0' && c <= '9') return static_cast<std::uint32_t>(c - '0');
    if (c >= 'a' && c <= 'f') return static_cast<std::uint32_t>(c - 'a') + 10;
    return c >= 'A' && c <= 'F' ? static_cast<std::uint32_t>(c - 'A') + 10 : 16;
}

/// Appends the decoded content of a checked string. `written` includes the quotes.
inline void append_unescaped(std::string_view written, buffer<char>& to) {
    const auto code_at = [&](std::size_t i) {
        std::uint32_t code = 0;
        for (std::size_t digit = 0; digit < 4; ++digit) code = code * 16 + hexadecimal_value(written[i + digit]);
        return code;
    };
    for (std::size_t i = 1; i + 1 < written.size(); ++i) {
        if (written[i] != '\\') {
            to.push_back(written[i]);
            continue;
        }
        const char escape = written[++i];
        if (escape != 'u') {
            constexpr std::string_view escapes = "bfnrt", meant = "\b\f\n\r\t";
            const std::size_t found = escapes.find(escape);
            to.push_back(found == std::string_view::npos ? escape : meant[found]);
            continue;
        }
        std::uint32_t code = code_at(i + 1);
        i += 4;
        if (code >= 0xD800 && code < 0xDC00) {
            code = 0x10000 + ((code - 0xD800) << 10) + (code_at(i + 3) - 0xDC00);
            i += 6;
        }
        const auto put = [&](std::uint32_t byte) { to.push_back(static_cast<char>(byte)); };
        if (code < 0x80) {
            put(code);
        } else {
            const int more = code < 0x800 ? 1 : code < 0x10000 ? 2 : 3;
            put((0xFF00U >> (more + 1) & 0xFF) | code >> (6 * more));
            for (int rest = more - 1; rest >= 0; --rest) put(0x80 | (code >> (6 * rest) & 0x3F));
        }
    }
}

/// Walks over a JSON text and checks it along the way. Raises invalid_data for invalid JSON.
class json_reader {
public:
    /// max_depth  maximum nesting of objects and arrays
    /// where      name of the text in messages
    json_reader(std::string_view text, int max_depth, std::string where)
        : text_(text), max_depth_(max_depth), where_(std::move(where)) {}
    /// Walks over a text that another reader has already checked, without checking it again.
    explicit json_reader(std::string_view checked) : text_(checked), is_checked_(true) {}

    /// Reads a text that consists of one object.
    json_value whole_object() {
        skip_space();
        if (peek() != '{') fail("a JSON object");
        const json_value result = read_value(0);
        skip_space();
        if (at_ != text_.size()) fail("nothing after the JSON object");
        return result;
    }

    /// Calls visit(to, name, value) for the members of the object at the start of the text. Names include quotes and escapes.
    void walk_object(int depth, json_visitor visit, void* to) {
        names seen;
        enter(depth);
        for (bool first = true; !leave('}', first, "a name or } in a JSON object"); first = false) {
            if (peek() != '"') fail("a name in a JSON object");
            const std::string_view name = read_string();
            if (!is_checked_) seen.add(name);
            skip_space();
            if (peek() != ':') fail("a colon after a name");
            ++at_;
            skip_space();
            const json_value value = read_value(depth + 1);
            if (visit != nullptr) visit(to, name, value);
        }
        if (!is_checked_) seen.check(where_);
    }

    /// Calls visit(to, {}, value) for the elements of the array at the start of the text.
    void walk_array(int depth, json_visitor visit, void* to) {
        enter(depth);
        for (bool first = true; !leave(']', first, "a value or ] in a JSON array"); first = false) {
            const json_value value = read_value(depth + 1);
            if (visit != nullptr) visit(to, {}, value);
        }
    }

private:
    /// Names of one object, to detect duplicates.
    class names {
    public:
        void add(std::string_view written) {
            append_unescaped(written, letters_);
            ends_.push_back(letters_.size());
        }
        void check(const std::string& where) const {
            buffer<std::string_view> sorted;
            for (std::size_t i = 0; i < ends_.size(); ++i) {
                const std::size_t begin = i == 0 ? 0 : ends_[i - 1];
                sorted.emplace_back(letters_.data() + begin, ends_[i] - begin);
            }
            std::sort(sorted.begin(), sorted.end());
            const std::string_view* const twice = std::adjacent_find(sorted.begin(), sorted.end());
            if (twice != sorted.end()) raise(error_code::invalid_data, where, "unique names", printable(*twice) + " twice");
        }

    private:
        buffer<char> letters_;
        buffer<std::size_t> ends_;
    };

    [[noreturn]] void fail(const char* expected) const {
        raise(error_code::invalid_data, where_ + ", byte " + std::to_string(at_) + " of its JSON", expected,
              at_ == text_.size() ? "the end" : printable(text_.substr(at_, 1)));
    }

    /// Returns the next byte, or 0 at the end. Valid JSON contains no byte 0.
    char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }

    void skip_space() {
        while (peek() == ' ' || peek() == '\t' || peek() == '\n' || peek() == '\r') ++at_;
    }

    void enter(int depth) {
        if (!is_checked_ && depth >= max_depth_)
            raise(error_code::invalid_data, where_, "JSON nested at most " + std::to_string(max_depth_) + " deep",
                  "deeper nesting");
        ++at_;
    }

    /// Returns whether the object or array ends here. If not, moves to its next member or element.
    bool leave(char closing, bool first, const char* expected) {
        skip_space();
        if (peek() == closing) {
            ++at_;
            return true;
        }
        if (first) {
            if (peek() == '\0') fail(expected);
            return false;
        }
        if (peek() != ',') fail(closing == '}' ? "a comma or } in a JSON object" : "a comma or ] in a JSON array");
        ++at_;
        skip_space();
        return false;
    }

    json_value read_value(int depth) {
        const std::size_t begin = at_;
        json_kind kind = json_kind::number;
        switch (peek()) {
            case '{': kind = json_kind::object, walk_object(depth, nullptr, nullptr); break;
            case '[': kind = json_kind::array, walk_array(depth, nullptr, nullptr); break;
            case '"': kind = json_kind::string, read_string(); break;
            case 't': kind = json_kind::boolean, read_word("true"); break;
            case 'f': kind = json_kind::boolean, read_word("false"); break;
            case 'n': kind = json_kind::null, read_word("null"); break;
            default: read_number();
        }
        return {kind, text_.substr(begin, at_ - begin)};
    }

    void read_word(std::string_view word) {
        if (text_.substr(at_, word.size()) != word) fail("a JSON value");
        at_ += word.size();
    }

    void read_digits(const char* expected) {
        if (peek() < '0' || peek() > '9') fail(expected);
        while (peek() >= '0' && peek() <= '9') ++at_;
    }

    void read_number() {
        const bool negative = peek() == '-';
        if (negative) ++at_;
        if (peek() == '0')
            ++at_;
        else
            read_digits(negative ? "a digit" : "a JSON value");
        if (peek() == '.') {
            ++at_;
            read_digits("a digit after the point");
        }
        if (peek() == 'e' || peek() == 'E') {
            ++at_;
            if (peek() == '+' || peek() == '-') ++at_;
            read_digits("a digit of an exponent");
        }
    }

    /// Reads a string and returns it with its quotes.
    std::string_view read_string() {
        const std::size_t begin = at_++;
        while (peek() != '"') {
            if (at_ == text_.size()) fail("a quote that ends a string");
            if (peek() == '\\')
                read_escape();
            else
                read_character();
        }
        ++at_;
        return text_.substr(begin, at_ - begin);
    }

    void read_escape() {
        ++at_;
        if (peek() != 'u') {
            if (std::string_view("\"\\/bfnrt").find(peek()) == std::string_view::npos) fail("a valid escape");
            ++at_;
            return;
        }
        const std::uint32_t code = read_code();
        if (code >= 0xDC00 && code < 0xE000) fail("a high surrogate before a low surrogate");
        if (code < 0xD800 || code >= 0xDC00) return;
        if (peek() != '\\') fail("a low surrogate after a high surrogate");
        ++at_;
        if (peek() != 'u') fail("a low surrogate after a high surrogate");
        const std::uint32_t second = read_code();
        if (second < 0xDC00 || second >= 0xE000) fail("a low surrogate after a high surrogate");
    }

    /// Reads the four digits after the u of an escape.
    std::uint32_t read_code() {
        std::uint32_t code = 0;
        for (int digit = 0; digit < 4; ++digit) {
            ++at_;
            const std::uint32_t value = hexadecimal_value(peek());
            if (value == 16) fail("four hexadecimal digits");
            code = code * 16 + value;
        }
        ++at_;
        return code;
    }

    void read_character() {
        if (static_cast<unsigned char>(peek()) < 0x20) fail("no control characters in a string");
        const std::size_t length = utf8_length(text_.substr(at_));
        if (length == 0) fail("UTF-8");
        at_ += length;
    }

    std::string_view text_;
    std::size_t at_ = 0;
    int max_depth_ = 0;
    std::string where_;
    bool is_checked_ = false;
};

}}}  // namespace ldi::detail
