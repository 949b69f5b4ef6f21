#include "io/text_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <zlib.h>

#include <octosurf/error.hpp>

namespace octosurf::io {
namespace {

constexpr std::size_t text_limit = std::size_t{256} << 20;
constexpr std::size_t longest_line = std::size_t{64} << 10;
// Memory limit of a text as words, with the poses parsed from them: 64 MiB and eight times its size. TUM's
// poses of 80 bytes take 4 times.
constexpr std::size_t text_free_bytes = std::size_t{40} << 20, text_bytes_per_file_byte = 5;
constexpr std::string_view byte_order_mark = "\xEF\xBB\xBF";

constexpr std::string_view separators = " \t\r,;\v\f";

/// A '#' starts a comment only at the beginning of a word (7-Scenes has "-1.#IND").
std::size_t begin_of_comment(std::string_view line) {
  auto at = line.find('#');
  while (at != std::string_view::npos && at > 0 && separators.find(line[at - 1]) == std::string_view::npos)
    at = line.find('#', at + 1);
  return at;
}

/// "0,22 1,5 2": most words between blanks or semicolons have one, and none has a point.
bool has_decimal_commas(std::string_view line) {
  const auto commas = std::ranges::count(line, ',');
  for (const char* const other : {".", ", ", " ,"})
    if (commas == 0 || line.find(other) != line.npos) return false;
  const auto words = std::ssize(words_between(" \t\r;\v\f", line, longest_line));
  return words > 1 && commas <= words && words < 2 * commas;
}

}  // namespace

bool Lines::next(std::string_view& line) {
  if (text_.empty()) return false;
  const auto end = std::min(text_.find('\n'), text_.size());
  line = text_.substr(0, end);
  if (line.ends_with('\r')) line.remove_suffix(1);
  text_.remove_prefix(std::min(end + 1, text_.size()));
  ++number_;
  return true;
}

std::vector<std::string_view> words_between(std::string_view separators, std::string_view line,
                                            std::size_t most) {
  std::vector<std::string_view> words;
  while (words.size() < most) {
    const auto begin = line.find_first_not_of(separators);
    if (begin == std::string_view::npos) break;
    line.remove_prefix(begin);
    words.push_back(line.substr(0, line.find_first_of(separators)));
    line.remove_prefix(words.back().size());
  }
  return words;
}

std::vector<TextLine> read_text(const std::filesystem::path& file, std::string* heading) {
  const std::string bytes = read_bytes(file, text_limit);
  std::string_view rest = bytes;
  if (rest.starts_with(byte_order_mark)) rest.remove_prefix(byte_order_mark.size());
  if (rest.starts_with("\xFF\xFE") || rest.starts_with("\xFE\xFF"))
    throw Error(Error::Kind::data, file.string(), "is UTF-16 text", "write it as UTF-8 or ASCII");
  std::vector<TextLine> result;
  std::size_t memory = 0;
  Lines lines(rest);
  for (std::string_view line; lines.next(line);) {
    if (line.size() > longest_line)
      throw Error(Error::Kind::data, at_line(file, lines.number()), "a line of over 64 KiB",
                  "give a file of poses, intrinsics or time stamps");
    const std::size_t comment = std::min(begin_of_comment(line), line.size());
    if (has_decimal_commas(line.substr(0, comment)))
      throw Error(Error::Kind::data, at_line(file, lines.number()), "numbers with decimal commas",
                  "write decimal points, as LC_ALL=C has them");
    const auto words = words_between(separators, line.substr(0, comment), longest_line);
    if (heading != nullptr && result.empty() && words.empty() && comment < line.size())
      *heading = line.substr(comment + 1, 1000);  // EuRoC's has 400
    memory += words.size() * sizeof(std::string) + (words.empty() ? 0 : 2 * sizeof(TextLine));
    if (memory > text_free_bytes + text_bytes_per_file_byte * bytes.size())
      throw Error(Error::Kind::data, at_line(file, lines.number()),
                  "too many short words to be a list of numbers",
                  "give a file of poses, intrinsics or time stamps");
    if (!words.empty()) result.push_back({lines.number(), {words.begin(), words.end()}});
  }
  return result;
}

std::string text_of(const Eigen::Vector3d& place) {
  return formatted("%.10g %.10g %.10g", place.x(), place.y(), place.z());  // of a survey to the millimetre
}

std::string count_of(std::size_t count, const char* what) {
  return std::to_string(count) + " " + what + (count == 1 ? "" : "s");
}

std::string digits_of(double value, std::chars_format format) {
  std::array<char, 400> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value, format).ptr};
}

std::string at_line(const std::filesystem::path& file, std::size_t line) {
  return file.string() + ":" + std::to_string(line);
}

double number(std::string_view word, const std::filesystem::path& file, std::size_t line) {
  double value = 0;
  const char* begin = word.data() + (word.starts_with('+') ? 1 : 0);
  const char* end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(begin, end, value);
  if (error == std::errc() && stop == end) return value;
  throw Error(Error::Kind::data, at_line(file, line),
              "'" + printable(std::string(word.substr(0, 40))) + "' is not a number",
              "give plain numbers separated by blanks or commas");
}

double time_stamp(std::string_view word, const std::filesystem::path& file, std::size_t line) {
  const double value = number(word, file, line);
  if (std::isfinite(value)) return value;
  throw Error(Error::Kind::data, at_line(file, line), "the time stamp is not finite");
}

std::vector<double> numbers(const TextLine& line, const std::filesystem::path& file) {
  std::vector<double> values;
  values.reserve(line.words.size());
  for (const auto& word : line.words) values.push_back(number(word, file, line.number));
  return values;
}

std::string printable(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return c < ' ' || c > '~'; }, '?');
  return text;
}

std::uint32_t crc32_of(std::string_view bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(
      ::crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

std::string read_bytes(const std::filesystem::path& file, std::size_t limit) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  std::ifstream stream(file, std::ios::binary);
  if (error || !stream)
    throw Error(Error::Kind::data, file.string(),
                std::filesystem::is_symlink(file, error) ? "is a link to a file that cannot be read"
                                                         : "cannot be read");
  if (size > limit)
    throw Error(Error::Kind::data, file.string(), "is too large (" + std::to_string(size) + " bytes)");
  std::string bytes(size, '\0');
  stream.read(bytes.data(), static_cast<std::streamsize>(size));
  if (stream.gcount() != static_cast<std::streamsize>(size))
    throw Error(Error::Kind::data, file.string(), "cannot be read");
  return bytes;
}

}  // namespace octosurf::io
