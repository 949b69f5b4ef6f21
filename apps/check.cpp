// `octosurf check`: why the scans of a recording contradict each other.
#include "bounds.hpp"
#include "check/search.hpp"
#include "command_line.hpp"
#include "io/new_file.hpp"
#include "io/text_file.hpp"
#include "output_files.hpp"
#include "parameter_options.hpp"
#include "run_statistics.hpp"
#include "scan_feed.hpp"
#include "sensing/pose_form.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <octosurf/error.hpp>
#include <octosurf/mapper.hpp>
#include <octosurf/scan_source.hpp>

namespace octosurf {
namespace {

constexpr const char* check_description = R"(Finds out why the scans of a recording contradict each other.

Examples:
  octosurf check kitchen                                   after `map kitchen` has warned of it
  octosurf check depth --poses trajectory.txt --intrinsics K.txt
  octosurf check walk.mcap --topic /points --write-poses walk.txt

Views spread over the recording are compared as `map` compares them, as given and under other meanings of poses,
readings and scans, one or two at a time: inverse poses, axes, scales, mounts, delays, kinds of depth, clouds that
lie in the map already, values for no return, repeated scans, a jump. A cause is named only if with it the recording
agrees as a right one does; then follows the command that maps it so, or what to do by hand. --write-poses writes
the poses by that meaning, one line (tx ty tz qx qy qz qw) a scan. Exit code 1: no cause is known.
)";

struct CheckOptions {
  std::vector<std::string> inputs;
  std::string write_poses;
  bool force = false;
  int threads = 1;
  ScanSourceOptions source;
  ScanRange range;
  ParameterOptions parameters;
};

void print_judgement(const char* how, const Judgement& judgement) {
  std::printf(
      "%s%zu of %zu pairs of views contradict each other, %zu of %zu views see nothing that others see\n",
      how, judgement.contradicting, judgement.pairs, judgement.alone, judgement.views);
}

/// The form of poses that reads all as the meaning does.
std::optional<PoseForm> form_of(const check::Recording& recording, const check::Meaning& meaning) {
  for (std::size_t f = 0; f < pose_form_names.size(); ++f) {
    const auto form = static_cast<PoseForm>(f);
    bool same = true;
    for (std::size_t i = 0; i < recording.poses().size() && same; ++i) {
      const auto T = meaning.pose_of(recording, i);
      same = T && T->isApprox(sensing::pose_from(form, recording.poses()[i].T_map_sensor), 1e-6);
    }
    if (same) return form;
  }
  return {};
}

/// A line for each scan; one without a pose has numbers that are none.
void write_poses(const CheckOptions& options, const check::Recording& recording,
                 const check::Meaning& meaning, const Eigen::Vector3d& origin) {
  io::write_file(options.write_poses, options.force, [&](std::ostream& out) {
    for (std::size_t i = 0; i < recording.poses().size(); ++i) {
      const auto T = meaning.pose_of(recording, i);
      if (!T) {
        out << "nan nan nan 0 0 0 1\n";
        continue;
      }
      const Eigen::Vector3d position = T->translation() + origin;
      const Eigen::Quaterniond q(T->linear());
      out << io::formatted("%.9g %.9g %.9g %.9g %.9g %.9g %.9g\n", position.x(), position.y(), position.z(),
                           q.x(), q.y(), q.z(), q.w());
    }
  });
}

/// `mapped`: what `map` would have of it.
check::Recording read(const CheckOptions& options, std::unique_ptr<ScanSource> source,
                      std::optional<RunStatistics>* mapped = nullptr) {
  const Parameters parameters = ParameterChoice(options.parameters).in_force({}, source->sensor());
  check::Recording recording(parameters);
  Mapper mapper(parameters, options.threads);
  if (mapped != nullptr) mapped->emplace(parameters);
  ScanFeed feed(std::move(source), options.range);
  while (const std::optional<Scan> scan = feed.next()) {
    recording.add(*scan);
    if (mapped != nullptr) (*mapped)->add(*scan, mapper.insert(*scan), 0, 0);
  }
  return recording;
}

/// Whether `map` would warn of nothing. Scans that fit nowhere are as doubtful as pairs that contradict: a
/// tenth, and two.
bool agrees(const RunStatistics& mapped) {
  const std::size_t left_out = mapped.scans_with(AlignmentOutcome::rejected);
  return !mapped.judgement().contradicts() && check::sees_enough(mapped.judgement()) &&
         (left_out < 2 || 10 * left_out <= mapped.scans());
}

std::unique_ptr<ScanSource> open(const CheckOptions& options, const ScanSourceOptions& source) {
  return open_scans({options.inputs.begin(), options.inputs.end()}, source);
}

/// Those that its readings are in: read by one a metre they are so many times as long.
double units_per_metre(const CheckOptions& options, const check::Recording& recording) {
  ScanSourceOptions by_one = options.source;
  by_one.depth_scale = 1;
  return read(options, open(options, by_one)).median_range() / recording.median_range();
}

/// What to give `map` so that it reads a recording by a meaning.
struct Mend {
  ScanSourceOptions source;                                       ///< with it
  std::vector<std::pair<std::string, std::string>> options = {};  ///< that differ: name, value
  bool poses = false;                                             ///< a file of them is among these
};

Mend mend_of(const CheckOptions& options, const check::Recording& recording, const check::Meaning& meaning) {
  Mend mend{options.source};
  const auto add = [&](const char* name, const std::string& value) {
    mend.options.emplace_back(name, value);
  };
  std::optional<PoseForm> form = form_of(recording, meaning);
  const bool in_map = meaning.reading == check::Meaning::Reading::in_map;
  const PoseForm as_read = in_map ? PoseForm::in_map : PoseForm::as_given;
  if (in_map) form = form == PoseForm::as_given ? std::optional(as_read) : std::nullopt;
  if (options.source.pose_form && form != PoseForm::as_given) form.reset();  // it is of what that one gives
  if (!form) {
    mend.poses = true;
    mend.source.poses = options.write_poses;
    add("--poses", options.write_poses);
    if (options.source.pose_form || in_map) {
      mend.source.pose_form = as_read;
      add("--pose-form", pose_form_names[static_cast<std::size_t>(as_read)]);
    }
    if (meaning.leaves_out(recording)) {
      mend.source.skip_bad = true;
      add("--skip-bad", "");
    }
  } else if (*form != PoseForm::as_given) {
    mend.source.pose_form = form;
    add("--pose-form", pose_form_names[static_cast<std::size_t>(*form)]);
  }
  if (meaning.readings_scale != 1) {
    mend.source.depth_scale = units_per_metre(options, recording) / meaning.readings_scale;
    add("--depth-scale", io::formatted("%.5g", *mend.source.depth_scale));
  }
  if (meaning.no_return) {
    mend.source.no_return.push_back(*meaning.no_return);
    add("--no-return", io::formatted("%.3f", *meaning.no_return));
  }
  if (meaning.first_session < recording.poses().size()) add("--first", std::to_string(meaning.first_session));
  return mend;
}

/// The verb's own words, but for those that a mend replaces, and the mend's.
std::string command_with(const CLI::App& check, const Mend& mend) {
  std::vector<std::string_view> but;
  for (const auto& [name, value] : mend.options) but.emplace_back(name);
  std::string text = "octosurf map" + words_for(check, check, but);
  for (const auto& [name, value] : mend.options)
    text += shell_word(name) + (value.empty() ? "" : shell_word(value));
  return text + " -o MAP";
}

/// Reads the recording as the mend says, and judges it anew.
void try_out(const CheckOptions& options, const Mend& mend, const check::Meaning& meaning) {
  check::Meaning as_read;
  as_read.first_session = meaning.first_session;
  const Judgement verdict = judge(read(options, open(options, mend.source)), as_read);
  if (verdict.contradicts())
    throw Error(Error::Kind::data, "", "read so, the " + verdict.describe(), "check the units by hand");
}

void run_check(const CLI::App& verb, const CheckOptions& options) {
  if (!options.write_poses.empty()) {
    require_apart("--write-poses", options.write_poses, options.inputs);
    require_writable(options.write_poses, options.force);
  }
  auto source = open(options, options.source);
  for (const std::string& note : source->notes()) std::printf("%s\n", note.c_str());
  const Eigen::Vector3d origin = source->origin();
  std::optional<RunStatistics> mapped;
  const check::Recording recording = read(options, std::move(source), &mapped);
  print_judgement("as mapped    ", mapped->judgement());
  if (agrees(*mapped)) {
    std::printf("The scans agree with each other as `map` maps them, with these options.\n");
    return;
  }
  const check::Finding finding = check::search(recording, options.threads);
  print_judgement("as given     ", finding.as_given);
  if (!finding.meaning && !finding.as_given.contradicts()) {
    std::printf("%s\n", check::sees_enough(finding.as_given)
                            ? "The scans agree with each other as they are given; --align off maps them so."
                            : "Too little is seen twice to tell whether the scans agree.");
    return;
  }
  if (!finding.meaning)
    throw Error(Error::Kind::data, "",
                "the scans contradict each other, most " + finding.as_given.worst[0] + " and " +
                    finding.as_given.worst[1] + "; the cause is not among those known",
                check::facts_of(recording) + "look at these two; poses that drift are none of the causes");
  for (const std::string& cause : finding.causes) std::printf("cause        %s\n", cause.c_str());
  if (finding.or_drift)
    std::printf("             unless poses drift by about as much, which `map` corrects by itself\n");
  print_judgement("so read      ", finding.as_meant);
  const std::string by_hand = finding.meaning->by_hand();
  if (!by_hand.empty()) {
    std::printf("mend         %s\n", by_hand.c_str());
    return;
  }
  const Mend mend = mend_of(options, recording, *finding.meaning);
  if (mend.poses && options.write_poses.empty()) {
    std::printf("mend         --write-poses FILE writes poses by which they agree, for map's --poses\n");
    return;
  }
  if (mend.poses) write_poses(options, recording, *finding.meaning, origin);
  try_out(options, mend, *finding.meaning);
  std::printf("mend         %s\n", command_with(verb, mend).c_str());
}

}  // namespace

void add_check(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("check", check_description);
  const auto options = std::make_shared<CheckOptions>();
  verb->add_option("input", options->inputs, "folders or files")->required();
  verb->add_option("--write-poses", options->write_poses, "write the poses by which the recording agrees")
      ->type_name("FILE");
  add_threads(*verb, options->threads);
  verb->add_flag("--force", options->force, "overwrite the file of poses");
  add_scan_options(*verb, options->source, options->range);
  add_parameter_options(*verb, options->parameters);
  verb->callback([verb, options] { run_check(*verb, *options); });
}

}  // namespace octosurf
