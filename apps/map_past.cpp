#include "map_past.hpp"

#include "io/text_file.hpp"
#include "last_line.hpp"
#include "output_files.hpp"
#include "surface_table.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include <octosurf/changes.hpp>
#include <octosurf/error.hpp>

namespace octosurf {
namespace {

constexpr const char* log_description = R"(Lists the sessions of a map, and what each changed.

Examples:
  octosurf log maps/office
  octosurf log maps/office --json                    with the surfaces' ids
  octosurf diff maps/office@2026-11-20 maps/office   between the end of that day and now

A session is one run of map, or of remap, merge or clear in place. Its date, UTC, is that of its last scan where the
time stamps are calendar times, else that of the run's end, when it was written. A line has its surfaces, those that
came, changed, went and were merged, and the bytes that its file maps/office.past-* keeps to undo it. A date names the
last session before which, and in which, no later scan was mapped.
)";

constexpr const char* checkout_description = R"(Writes a map as it was.

Examples:
  octosurf checkout maps/office@2026-11-20 -o maps/then      as it was at the end of that day, UTC
  octosurf checkout maps/office@2026-11-20T09:30 -o maps/then
  octosurf checkout maps/office@3 -o maps/then               after the third session that log lists

It writes the whole map: octree, surfaces, ids. It can be continued, but keeps no scans.
)";

std::string past_of(const std::string& stem) {
  std::filesystem::path file(files_of_map(stem).front());
  return file.replace_extension(".past").string();
}

[[noreturn]] void refuse_moment(const std::string& stem, const std::string& moment, const std::string& what) {
  throw Error(Error::Kind::usage, stem + "@" + moment, what, "octosurf log " + stem + " lists its sessions");
}

/// The end of the day, minute or second that a date names. Empty: it is none.
std::optional<double> end_of_date(const std::string& text) {
  const std::array<const char*, 4> forms{"%Y-%m-%dT%H:%M:%SZ", "%Y-%m-%dT%H:%M:%S", "%Y-%m-%dT%H:%M",
                                         "%Y-%m-%d"};
  const std::array<double, 4> lengths_s{1, 1, 60, 86400};
  for (std::size_t k = 0; k < lengths_s.size(); ++k) {
    std::tm time{};
    const char* rest = strptime(text.c_str(), forms[k], &time);
    if (rest == nullptr || *rest != '\0') continue;
    const int day = time.tm_mday;
    const auto begin = static_cast<double>(timegm(&time));  // which makes 3 March of 31 February
    if (time.tm_mday == day) return begin + lengths_s[k];
  }
  return {};
}

std::size_t session_at(const std::string& stem, const std::string& moment, const io::Past& past) {
  const std::vector<io::Session>& all = past.sessions;
  if (all.empty())
    throw Error(Error::Kind::data, past.warnings.empty() ? past_of(stem) : past.warnings.front(),
                "no past of this map is known",
                "runs of octosurf map keep it; " + stem + " itself is the map of now");
  if (!moment.empty() && moment.size() < 9 && moment.find_first_not_of("0123456789") == std::string::npos) {
    const std::size_t number = std::stoul(moment);
    if (number < 1 || number > all.size())
      refuse_moment(stem, moment, "is none of its " + io::count_of(all.size(), "session"));
    return number - 1;
  }
  const std::optional<double> end = end_of_date(moment);
  if (!end)
    refuse_moment(stem, moment, "names no date, as in 2026-11-27 or 2026-11-27T09:30, and no session");
  std::optional<std::size_t> found, first;
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (all[k].date_s == 0) continue;  // before no date, and after none
    if (!first) first = k;
    if (all[k].date_s >= *end) break;
    found = k;
  }
  if (found) return *found;
  refuse_moment(stem, moment,
                first ? "is before its first session, " + date_text(all[*first].date_s)
                      : "cannot be found, as its sessions have no dates");
}

nlohmann::ordered_json session_json(const io::Session& session, std::size_t number) {
  nlohmann::ordered_json json{{"session", number},
                              {"date", nullptr},
                              {"written", nullptr},
                              {"revision", session.revision},
                              {"scans", session.scans},
                              {"surfaces", session.surfaces},
                              {"area_m2", session.area_m2},
                              {"appeared", session.appeared},
                              {"changed", session.changed},
                              {"gone", session.gone},
                              {"merged", session.merged},
                              {"bytes", session.undo_bytes},
                              {"file", session.file.filename().string()}};
  if (session.date_s != 0) json["date"] = date_text(session.date_s);
  if (session.written_s != 0) json["written"] = date_text(session.written_s);
  return json;
}

void run_log(const std::string& name, bool as_json) {
  const io::Past past = io::past_of(name);
  const std::vector<io::Session>& sessions = past.sessions;
  if (sessions.empty()) {
    load_map(name);  // there is one
    session_at(name, "", past);
  }
  for (const std::string& warning : past.warnings) std::fprintf(stderr, "warning: %s\n", warning.c_str());
  if (as_json) {
    nlohmann::ordered_json json = nlohmann::ordered_json::array();
    for (std::size_t k = 0; k < sessions.size(); ++k) json.push_back(session_json(sessions[k], k + 1));
    std::printf("%s\n", json.dump(1).c_str());
    return;
  }
  std::printf(
      "session  date                 written                  scans  surfaces        m²  came  changed  went "
      " "
      "merged     bytes\n");
  for (std::size_t k = 0; k < sessions.size(); ++k) {
    const io::Session& one = sessions[k];
    std::printf("%7zu  %-20s %-20s %9llu %9llu %9.2f %5zu %8zu %5zu %7zu %9llu\n", k + 1,
                one.date_s == 0 ? "not known" : date_text(one.date_s).c_str(),
                one.written_s == 0 ? "not known" : date_text(one.written_s).c_str(),
                static_cast<unsigned long long>(one.scans), static_cast<unsigned long long>(one.surfaces),
                one.area_m2, one.appeared.size(), one.changed.size(), one.gone.size(), one.merged.size(),
                static_cast<unsigned long long>(one.undo_bytes));
  }
}

void run_checkout(const std::string& name, const std::string& output, bool force) {
  if (name.rfind('@') == std::string::npos)
    throw Error(Error::Kind::usage, name, "names no date",
                "write it behind the map, as in maps/office@2026-11-20");
  for (const std::string& file : files_of_map(output)) {
    std::error_code ignored;
    if (!force && std::filesystem::exists(file, ignored))
      throw Error(Error::Kind::usage, file, "exists already", "--force overwrites it");
  }
  for (const std::string& file : files_of_map(name.substr(0, name.rfind('@'))))
    for (const std::string& written : files_of_map(output)) require_apart("-o", written, {file});
  const LoadedMap then = load_map_at(name);
  make_folder_of(output);
  save_session(then.map, output);
  const Map::Size size = then.map.size();
  std::printf("%-12s %llu\n%-12s %zu, %.2f m²\n", "scans", static_cast<unsigned long long>(size.scans),
              "surfaces", size.surfaces, total_area(*then.map.snapshot()));
  const std::vector<std::string> files = files_of_map(output);
  std::printf("%-12s %s, %s\n", "written", files[0].c_str(), files[1].c_str());
}

}  // namespace

std::string date_text(double date_s) {
  const auto whole = static_cast<std::time_t>(std::floor(date_s));
  std::tm time{};
  std::array<char, 40> text{};
  if (gmtime_r(&whole, &time) == nullptr ||
      std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &time) == 0)
    return "not known";
  return text.data();
}

LoadedMap load_map_at(const std::string& name) {
  const std::size_t at = name.rfind('@');
  std::error_code ignored;
  if (at == std::string::npos || std::filesystem::exists(files_of_map(name).front(), ignored))
    return load_map(name);
  const std::string stem = name.substr(0, at);
  const io::Past past = io::past_of(stem);
  if (past.sessions.empty()) load_map(stem);  // there is one
  return {io::map_after(past, session_at(stem, name.substr(at + 1), past)), ""};
}

void keep_session(io::PastKeeper& past, const Map& map, std::optional<double> stamp_s) try {
  // Stamps of a recording since 2001, or else of the clock: others count from a start of their own.
  constexpr double calendar_s = 1e9, beyond_s = 1e10;
  const std::optional<std::uint64_t> since = past.since();
  const std::shared_ptr<const Snapshot> now = map.snapshot();
  past.save(map, stamp_s > calendar_s && stamp_s < beyond_s ? stamp_s : std::nullopt,
            since && *since <= now->revision ? changes_since(*now, *since) : MapChanges());
} catch (const std::exception& error) {
  std::fprintf(stderr, "warning: the map's past is not kept: %s\n", reason_of(error));
}

void save_session(const Map& map, const std::string& output, const std::vector<std::string>& begun_as,
                  std::optional<double> stamp_s, const KeptScans& kept) {
  const auto at = std::find_if(begun_as.begin(), begun_as.end(), [&](const std::string& one) {
    return same_file(files_of_map(one).front(), files_of_map(output).front());
  });
  io::PastKeeper past(output, at != begun_as.end() ? output : std::string());
  for (const std::string& warning : past.warnings()) std::fprintf(stderr, "warning: %s\n", warning.c_str());
  past.begin();
  save_map(map, output, kept);
  keep_session(past, map, stamp_s);
}

void add_log(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("log", log_description);
  const auto name = std::make_shared<std::string>();
  const auto json = std::make_shared<bool>(false);
  verb->add_option("map", *name, "map: name without ending, as given to map -o")->required();
  verb->add_flag("--json", *json, "as JSON");
  verb->callback([name, json] { run_log(*name, *json); });
}

void add_checkout(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("checkout", checkout_description);
  const auto name = std::make_shared<std::string>(), output = std::make_shared<std::string>();
  const auto force = std::make_shared<bool>(false);
  verb->add_option("map", *name, "MAP@DATE, or MAP@SESSION")->required();
  verb->add_option("-o,--output", *output, "map to write: name without ending")->required();
  verb->add_flag("--force", *force, "overwrite a map");
  verb->callback([name, output, force] { run_checkout(*name, *output, *force); });
}

}  // namespace octosurf
