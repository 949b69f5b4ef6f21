#pragma once

#include <Eigen/Core>
#include <array>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace octosurf::io {

/// Splits a text in memory into lines, without line ends, and counts them.
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}

  /// False at the end. Lines are split at '\n'; a '\r' before it is dropped.
  bool next(std::string_view& line);
  std::size_t number() const { return number_; }  ///< of the line read last, from 1
  std::string_view rest() const { return text_; }

 private:
  std::string_view text_;
  std::size_t number_ = 0;
};

/// The first `most` words of a line: a word in memory takes eight times its two bytes in a file.
std::vector<std::string_view> words_between(std::string_view separators, std::string_view line,
                                            std::size_t most);

/// One line of a text file that is neither blank nor a comment.
struct TextLine {
  std::size_t number = 0;  ///< counted from 1
  std::vector<std::string> words;
};

/// Words between blanks, commas or semicolons; `#` starts a comment: the last before the words is the
/// `heading`. Throws Error(data), also for UTF-16 and decimal commas.
std::vector<TextLine> read_text(const std::filesystem::path& file, std::string* heading = nullptr);

/// "file:line", for messages.
std::string at_line(const std::filesystem::path& file, std::size_t line);

/// "448000 5411000 120", for messages.
std::string text_of(const Eigen::Vector3d& place);

/// "1 scan", "2 scans", for messages.
std::string count_of(std::size_t count, const char* what);

/// As printf() writes it, up to 400 bytes.
template <class... Values>
std::string formatted(const char* format, Values... values) {
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(), format, values...);
  return text.data();
}

/// The shortest text that reads back as the same number, in any locale.
std::string digits_of(double value, std::chars_format format = std::chars_format::general);

/// The whole word as a number; throws Error(data) naming file, line and word.
double number(std::string_view word, const std::filesystem::path& file, std::size_t line);

/// The same for a time stamp, which must be finite.
double time_stamp(std::string_view word, const std::filesystem::path& file, std::size_t line);

/// All words of a line as numbers.
std::vector<double> numbers(const TextLine& line, const std::filesystem::path& file);

/// Without what no terminal should get, of a foreign file.
std::string printable(std::string text);

/// zlib's CRC-32; continues that of the bytes `before`.
std::uint32_t crc32_of(std::string_view bytes, std::uint32_t before = 0);

/// The file's bytes; throws Error(data) if it cannot be read or is larger than `limit`.
std::string read_bytes(const std::filesystem::path& file, std::size_t limit);

}  // namespace octosurf::io
