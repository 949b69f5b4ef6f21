// Rows that run the built command on the kitchen's files.

#include "bench/speed/scans.hpp"

#include <fcntl.h>
#include <fstream>
#include <sys/wait.h>
#include <unistd.h>

#include <octosurf/error.hpp>

namespace octosurf::bench {
namespace {

/// Runs the command, what it prints aside; throws Error(data) with its last line if it fails.
void run_app(const std::vector<std::string>& arguments) {
  std::vector<const char*> argv{OCTOSURF_APP};
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  argv.push_back(nullptr);
  const std::string log = (scratch_folder() / "app.log").string();
  const pid_t pid = fork();
  if (pid == 0) {
    const int out = open(log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(out, STDOUT_FILENO);
    dup2(out, STDERR_FILENO);
    execv(OCTOSURF_APP, const_cast<char* const*>(argv.data()));
    _exit(127);
  }
  int status = 0;
  if (pid < 0 || waitpid(pid, &status, 0) != pid || status != 0) {
    std::ifstream in(log);
    std::string last;
    for (std::string line; std::getline(in, line);) last = line;
    throw Error(Error::Kind::data, OCTOSURF_APP, "failed: " + last);
  }
}

/// The report of `octosurf map KITCHEN` with two threads.
Json report_of(const SpeedOptions& options, double resolution, const std::vector<std::string>& more) {
  const std::filesystem::path folder =
      options.input.empty() ? std::filesystem::path(OCTOSURF_DATA_DIR) / "rgbd_7scenes_redkitchen"
                            : std::filesystem::path(options.input);
  if (!std::filesystem::is_directory(folder))
    throw Error(Error::Kind::data, "skipped", folder.string() + " is missing");
  const std::string stem = (scratch_folder() / "app").string(), report = stem + ".json";
  std::vector<std::string> arguments{"map",
                                     folder.string(),
                                     "-o",
                                     stem,
                                     "--report",
                                     report,
                                     "--force",
                                     "--threads",
                                     "2",
                                     "--resolution",
                                     std::to_string(resolution),
                                     "--every",
                                     std::to_string(options.every)};
  if (const std::size_t first = options.count(60, 0); first > 0) {
    arguments.emplace_back("--first");
    arguments.push_back(std::to_string(first));
  }
  arguments.insert(arguments.end(), more.begin(), more.end());
  run_app(arguments);
  std::ifstream in(report);
  return Json::parse(in);
}

double number(const Json& value) { return value.is_null() ? 0 : value.get<double>(); }

Numbers throughput(const SpeedOptions& options, double resolution) {
  const Json report = report_of(options, resolution, {});
  const double scans = number(report.at("scans")), wall_s = number(report.at("wall_s"));
  return {{"scans", scans},
          {"wall_s", wall_s},
          {"frames_per_second", scans / wall_s},
          {"ratio", scans / wall_s / 30},  // so many a second the camera takes
          {"scan_p50_ms", number(report.at("scan_ms").at("p50"))},
          {"scan_p95_ms", number(report.at("scan_ms").at("p95"))},
          {"peak_rss_mb", number(report.at("peak_rss_mb"))}};
}

Numbers realtime(const SpeedOptions& options, double resolution) {
  const Json report = report_of(options, resolution, {"--realtime"});
  // Table I, real-world complex: another place and sensor, eight cores.
  const double paper_first_ms = resolution < 0.015 ? 1940 : 1410;
  const double paper_lag_ms = resolution < 0.015 ? 3040 : 1590;
  const Json& lag = report.at("detection_lag_s");
  return {{"scans", number(report.at("scans"))},
          {"skipped_scans", static_cast<double>(report.at("skipped_scans").size())},
          {"first_detection_ms", 1000 * number(report.at("time_to_first_detection_s"))},
          {"lag_p50_ms", 1000 * number(lag.at("p50"))},
          {"lag_p95_ms", 1000 * number(lag.at("p95"))},
          {"lag_mean_ms", 1000 * number(lag.at("mean"))},
          {"theirs_first_detection_ms", paper_first_ms},
          {"theirs_lag_mean_ms", paper_lag_ms},
          {"categorized_percent", number(report.at("categorized_percent"))}};
}

}  // namespace

void add_app_rows(const SpeedOptions& options) {
  for (const double d : options.resolutions) {
    const std::string name = "d:" + std::to_string(d).substr(0, 4);
    register_row({"app/kitchen/" + name,
                  "`octosurf map` from files to files, kitchen, " + centimetres(d) + ", two threads",
                  "the camera", [options, d] { return throughput(options, d); }});
    register_row({"realtime/kitchen/" + name,
                  "`octosurf map --realtime` at 30 Hz, kitchen, " + centimetres(d) + ", two threads",
                  "the paper's Table I", [options, d] { return realtime(options, d); }});
  }
}

}  // namespace octosurf::bench
