#include "io/readers/scan_stamps.hpp"

#include "io/text_file.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace octosurf::io {

namespace fs = std::filesystem;

std::optional<double> stamp_in_name(const fs::path& file) {
  constexpr const char* digit = "0123456789";
  const std::string stem = file.stem().string();
  // The number at the end, after a word, or after another number and '_'.
  const std::size_t before = stem.find_last_not_of("0123456789.");
  std::string_view text = std::string_view(stem).substr(before == std::string::npos ? 0 : before + 1);
  const auto number_of = [](std::string_view word) -> std::optional<double> {
    double value = 0;
    const auto [stop, error] =
        std::from_chars(word.data(), word.data() + word.size(), value, std::chars_format::fixed);
    if (error != std::errc() || stop != word.data() + word.size() || !std::isfinite(value)) return {};
    return value;
  };
  const auto value = number_of(text);
  if (!value) return {};
  // "000002_-7.5": before 1970, as of a simulated clock.
  const bool negative =
      before != std::string::npos && before > 0 && stem[before] == '-' && stem[before - 1] == '_';
  const std::size_t between = negative ? before - 1 : before;
  const bool only_numbers = before == std::string::npos ||
                            (stem[between] == '_' && between > 0 && stem.find_first_not_of(digit) == between);
  if (text.find('.') != std::string_view::npos) {
    constexpr double year_1973 = 1e8;  // after a word, smaller numbers are of other things
    if (only_numbers && negative) return -*value;
    if (only_numbers || *value >= year_1973) return value;
    return {};
  }
  // Whole seconds since 1970 and nanoseconds, as ROS has them.
  constexpr std::size_t seconds_digits = 10, ns_digits = 9;
  if (before != std::string::npos && text.size() <= ns_digits) {
    const std::string_view head = std::string_view(stem).substr(0, before);
    const std::size_t word = head.find_last_not_of(digit);
    const std::string_view seconds = head.substr(word == std::string_view::npos ? 0 : word + 1);
    if (seconds.size() == seconds_digits && seconds[0] != '0') return *number_of(seconds) + 1e-9 * *value;
  }
  // One number without a point is a time if it has as many digits as one since 1970 in s, ms, us or ns.
  if (text[0] == '0') return {};
  switch (text.size()) {
    case seconds_digits:
      return *value;
    case seconds_digits + 3:
      return *value / 1e3;
    case seconds_digits + 6:
      return *value / 1e6;
    case seconds_digits + 9:
      return *value / 1e9;
    default:
      return {};
  }
}

namespace {

void convert_stamps(std::vector<ListedScan>& scans) {
  std::vector<double> stamps;
  for (const ListedScan& scan : scans) stamps.push_back(*scan.stamp_s);
  to_seconds(stamps);
  for (std::size_t i = 0; i < scans.size(); ++i) scans[i].stamp_s = stamps[i];
}

}  // namespace

void find_stamps(ListedRecording& recording) {
  auto& scans = recording.scans;
  if (recording.bag) return;
  if (scans.front().stamp_s) return convert_stamps(scans);  // of depth.txt
  if (scans.front().kind == FileKind::graph) return;
  const fs::path times = find_beside(around(recording.folder), {"times.txt"}, "--rate");
  if (!times.empty()) {
    const auto lines = read_text(times);
    if (lines.size() != scans.size()) fail_count(times, scans.size(), lines.size(), "time stamp");
    for (std::size_t i = 0; i < scans.size(); ++i)
      scans[i].stamp_s = time_stamp(lines[i].words[0], times, lines[i].number);
    return convert_stamps(scans);
  }
  if (!std::all_of(scans.begin(), scans.end(), [](const auto& s) { return stamp_in_name(s.file); })) return;
  for (auto& scan : scans) scan.stamp_s = stamp_in_name(scan.file);
}

}  // namespace octosurf::io
