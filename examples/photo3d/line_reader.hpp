// Lines of a file or of standard input that anybody may have written: a line takes bounded memory, however long it is.
#pragma once

#include <cstddef>
#include <istream>
#include <streambuf>
#include <string>
#include <string_view>

namespace ldi::examples {

/// Unlike std::getline(), which ends as at the end of a file where memory runs out, it throws then.
class line_reader {
public:
    /// A longer line is cut off.
    static constexpr std::size_t max_bytes = std::size_t{1} << 20;

    /// from  must live as long as this
    explicit line_reader(std::istream& from) : from_(*from.rdbuf()) {}

    /// Goes to the next line, if there is one. Throws std::bad_alloc, std::system_error.
    bool next() {
        text_.clear();
        is_too_long_ = false;
        int c = from_.sbumpc();
        if (c == end_of_file) return false;
        for (; c != end_of_file && c != '\n'; c = from_.sbumpc())
            if (text_.size() < max_bytes)
                text_ += static_cast<char>(c);
            else
                is_too_long_ = true;
        has_end_ = c == '\n';
        ++number_;
        return true;
    }

    const std::string& text() const { return text_; }
    bool is_too_long() const { return is_too_long_; }
    bool has_end() const { return has_end_; }  ///< else the file ends within it
    bool is_blank() const { return text_.find_first_not_of(" \t\r") == std::string::npos; }
    std::size_t number() const { return number_; }  ///< from 1

private:
    static constexpr int end_of_file = std::streambuf::traits_type::eof();

    std::streambuf& from_;
    std::string text_;
    std::size_t number_ = 0;
    bool is_too_long_ = false, has_end_ = false;
};

}  // namespace ldi::examples
