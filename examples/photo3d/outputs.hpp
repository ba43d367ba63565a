// Inputs and outputs of a run: `-` for standard input and output, names derived from the photo's name, and all checks of names
// that are possible before the conversion starts.
#pragma once

#include "file_set.hpp"
#include "file_system.hpp"
#include "html_page.hpp"
#include "messages.hpp"
#include "system.hpp"

#include <ldi/base/error.hpp>
#include <ldi/io/file.hpp>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace ldi::examples {

/// Whether a name means standard input or output.
inline bool is_standard(const std::filesystem::path& name) { return name == "-"; }

/// Returns the extension in lower case, such as ".mp4".
inline std::string extension_of(const std::filesystem::path& file) {
    std::string extension = file.extension().string();
    for (char& c : extension)
        if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
    return extension;
}

/// Reads a file or standard input. Raises the errors of read_file().
inline std::vector<std::byte> read_input(const std::filesystem::path& name, std::size_t max_bytes = max_file_bytes) {
    if (!is_standard(name)) return read_file(name, max_bytes);
    constexpr std::size_t chunk = std::size_t{1} << 16;
    std::vector<std::byte> bytes;
    for (;;) {
        const std::size_t used = bytes.size();
        bytes.resize(used + chunk);
        const std::ptrdiff_t got = read_standard_input(std::span(bytes).subspan(used));
        if (got < 0) raise_system_error(errno, "standard input", "readable input");
        bytes.resize(used + static_cast<std::size_t>(got));
        if (bytes.size() > max_bytes)
            raise(error_code::too_large, "standard input", "at most " + std::to_string(max_bytes) + " bytes", "more");
        if (got == 0) return bytes;
    }
}

/// Writes all bytes to standard output. Raises file_access or unavailable, for example if the reader has closed the pipe.
inline void print_bytes(std::span<const std::byte> bytes) {
    if (const int failure = write_standard_output(bytes); failure != 0)
        raise_system_error(failure, "standard output", "a writable output");
}
inline void print_text(std::string_view text) { print_bytes(std::as_bytes(std::span(text))); }

/// Name of an input in messages.
inline std::string name_of_input(const std::filesystem::path& name) {
    return is_standard(name) ? "standard input" : name.string();
}

/// Reports an input that does not exist, is a folder or can't be opened, before any work. Ignores an empty name. Raises
/// file_access.
inline void check_input(const std::filesystem::path& name, std::string_view expected) {
    if (name.empty() || is_standard(name)) return;
    std::error_code unknown;
    const std::filesystem::file_status status = std::filesystem::status(name, unknown);
    if (status.type() == std::filesystem::file_type::not_found || status.type() == std::filesystem::file_type::none)
        raise_system_error(unknown ? unknown.value() : ENOENT, name, expected);
    if (std::filesystem::is_directory(status)) raise(error_code::file_access, name.string(), expected, "a folder");
    errno = 0;
    if (std::filesystem::is_regular_file(status) && !std::ifstream(name)) raise_system_error(last_error(), name, expected);
}

/// All files that a run writes. They appear together at its end, or not at all.
class output_files {
public:
    /// Returns the set of files, which a signal discards.
    file_set& files() { return files_; }

    /// Registers an input (a file, all files of a folder, or standard input), so that it can't also be an output. Ignores an
    /// empty name.
    void read_from(const std::filesystem::path& input) {
        std::error_code ignored;
        if (is_standard(input)) files_.protect("/dev/stdin");
        if (std::filesystem::is_directory(input, ignored))
            for (const auto& item : std::filesystem::directory_iterator(input, ignored)) files_.protect(item.path());
        files_.protect(input);
    }

    /// Registers a file that the run will write; `-` is standard output. Raises the errors of file_set::claim(), and
    /// invalid_option for a second `-` or for binary output to a terminal.
    ///
    /// is_text  whether the output may go to a terminal
    void claim(const std::filesystem::path& output, bool is_text = false) {
        if (!is_standard(output)) return files_.claim(output);
        if (uses_standard_output_) raise(error_code::invalid_option, "-", "one output that goes to standard output", "two");
        if (!is_text && is_terminal(stdout))
            raise(error_code::invalid_option, "-", "standard output that goes to a file or a program", "a terminal");
        uses_standard_output_ = true;
    }

    /// Registers a folder for outputs, which may not exist yet. Raises file_access, invalid_option.
    void claim_folder(const std::filesystem::path& folder) {
        if (folder.empty() || is_standard(folder))
            raise(error_code::invalid_option, "output", "the name of a folder", folder.empty() ? "an empty name" : "-");
        std::error_code ignored;
        std::filesystem::path there = std::filesystem::absolute(folder).lexically_normal();
        while (!std::filesystem::exists(there, ignored) && there.has_relative_path()) there = there.parent_path();
        if (!std::filesystem::is_directory(there, ignored))
            raise(error_code::file_access, folder.string(), "a path that consists of folders", "the file " + there.string());
        if (const int denied = check_writable(there); denied != 0)
            raise(error_code::file_access, folder.string(), "a writable place", there.string() + ": " + system_reason(denied));
    }

    bool uses_standard_output() const { return uses_standard_output_; }

    void create_folder(const std::filesystem::path& folder) { files_.create_folder(folder); }

    /// Creates an output's parent folder if it does not exist. A run that fails removes this folder. Raises the errors of
    /// claim_folder() and file_set::create_folder().
    void create_folder_of(const std::filesystem::path& output) {
        const std::filesystem::path folder = output.parent_path();
        std::error_code ignored;
        if (folder.empty() || std::filesystem::exists(folder, ignored)) return;
        claim_folder(folder);
        create_folder(folder);
    }

    std::filesystem::path reserve(const std::filesystem::path& output) { return files_.reserve(output); }
    void write(const std::filesystem::path& output, std::span<const std::byte> bytes) {
        if (!is_standard(output)) return files_.write(output, bytes);
        standard_output_.assign(bytes.begin(), bytes.end());
    }
    void write(const std::filesystem::path& output, std::string_view text) { write(output, std::as_bytes(std::span(text))); }

    /// Puts all files in place and flushes them to the disk. Raises file_access, unavailable.
    void commit() {
        print_bytes(standard_output_);
        files_.commit();
    }

private:
    file_set files_;
    bool uses_standard_output_ = false;
    std::vector<std::byte> standard_output_;
};

/// Whether a name is a device or a pipe, which needs no extension.
inline bool is_stream(const std::filesystem::path& name) {
    std::error_code ignored;
    return is_standard(name) || (std::filesystem::exists(name, ignored) && !std::filesystem::is_regular_file(name, ignored));
}

/// Rejects a name whose extension belongs to another type of file. Raises invalid_option.
inline void check_ending(const std::filesystem::path& output, std::initializer_list<std::string_view> endings,
                         const std::string& what) {
    const std::string extension = extension_of(output);
    if (is_stream(output) || std::find(endings.begin(), endings.end(), extension) != endings.end()) return;
    raise(error_code::invalid_option, output.string(), "a name that ends in " + std::string(*endings.begin()),
          (extension.empty() ? "no ending" : extension) + " (" + what + ")");
}

inline void check_glb_name(const std::filesystem::path& output) {
    check_ending(output, {".glb"}, "photo3d writes a binary glTF file");
}
inline void check_page_name(const std::filesystem::path& output) {
    check_ending(output, {".html", ".htm"}, "photo3d writes a web page");
}

/// Whether this program wrote a file, which then contains the mark.
inline bool is_own_file(const std::filesystem::path& file, std::string_view mark) {
    const std::vector<std::byte> bytes = read_file(file);
    const char* const text = reinterpret_cast<const char*>(bytes.data());
    return std::string_view(text, bytes.size()).find(mark) != std::string_view::npos;
}

/// Checks that an output that the user did not name does not replace another program's file. Raises invalid_option, file_access.
inline void check_own(const std::filesystem::path& output, std::string_view mark, const char* option) {
    std::error_code ignored;
    if (!std::filesystem::is_regular_file(output, ignored) || is_own_file(output, mark)) return;
    raise(error_code::invalid_option, output.string(), "no file, or one that photo3d has written",
          std::string("another file (to replace it, use ") + option + " " + output.string() + ")");
}

}  // namespace ldi::examples
