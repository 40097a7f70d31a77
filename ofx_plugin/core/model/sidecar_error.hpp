// The error for an unusable sidecar: what was found where, and what was expected.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace palette4d {

/// Thrown for every unusable sidecar. what() is "FILE: POINTER: found X, expected Y".
class SidecarError : public std::runtime_error {
public:
    SidecarError(std::string file, std::string pointer, std::string found, std::string expected);
    const std::string& file() const { return file_; }
    const std::string& pointer() const { return pointer_; }  ///< JSON pointer (RFC 6901)
    const std::string& found() const { return found_; }
    const std::string& expected() const { return expected_; }

private:
    std::string file_, pointer_, found_, expected_;
};

/// The length of the well-formed UTF-8 sequence at text[at], 0 where there is none.
std::size_t utf8_length(const std::string& text, std::size_t at);
/// Text for a message: valid UTF-8 on one line, at most `limit` bytes plus an ellipsis.
std::string printable(const std::string& text, std::size_t limit);
/// A number for a message, with 15 digits.
std::string decimal_text(double number);
/// A short text in quotes, made printable.
std::string in_quotes(const std::string& text);

}  // namespace palette4d
