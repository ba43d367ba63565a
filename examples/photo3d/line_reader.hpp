// Reads lines of an untrusted file or of standard input with bounded memory, for lines of any length.
#pragma once

#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <iostream>
#include <streambuf>
#include <string>
#include <string_view>
#include <system_error>

namespace ldi::examples {

/// Reads lines. Throws an error if memory runs out, whereas std::getline() would behave as at the end of the file.
class line_reader {
public:
    /// Maximum length of a line. Longer lines are truncated.
    static constexpr std::size_t max_bytes = std::size_t{1} << 20;

    /// from  must outlive this object
    explicit line_reader(std::istream& from) : from_(*from.rdbuf()) {}

    /// Reads the next line; false at the end. Throws std::bad_alloc, std::system_error.
    bool next() {
        text_.clear();
        is_too_long_ = false;
        int c = next_byte();
        if (c == end_of_file) return false;
        for (; c != end_of_file && c != '\n'; c = next_byte())
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
    bool has_end() const { return has_end_; }  ///< false: the file ends within the line
    bool is_blank() const { return text_.find_first_not_of(" \t\r") == std::string::npos; }
    std::size_t number() const { return number_; }  ///< starting at 1

private:
    static constexpr int end_of_file = std::streambuf::traits_type::eof();

    /// At the end of a file, throws if the file could not be read. std::cin reports such an error as the end of the file.
    int next_byte() {
        const int c = from_.sbumpc();
        if (c == end_of_file && &from_ == std::cin.rdbuf() && std::ferror(stdin) != 0)
            throw std::system_error(errno != 0 ? errno : EIO, std::generic_category());
        return c;
    }

    std::streambuf& from_;
    std::string text_;
    std::size_t number_ = 0;
    bool is_too_long_ = false, has_end_ = false;
};

}  // namespace ldi::examples
