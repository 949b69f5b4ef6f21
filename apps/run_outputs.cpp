#include "io/new_file.hpp"
#include "output_files.hpp"
#include "pose_log.hpp"
#include "run_observers.hpp"
#include "run_summary.hpp"
#include "run_warnings.hpp"
#include "scene_log.hpp"

#include <cstdio>
#include <utility>

#include <octosurf/error.hpp>

namespace octosurf {
namespace {

class MapSaver : public RunObserver {
 public:
  MapSaver(RunState& run, const ScanKeeper& keeper) : run_(run), keeper_(keeper) {}

  void save(Saving saving) override {
    const Map& map = run_.mapper.map();
    if (saving == Saving::checkpoint)
      return run_.checkpoints.try_to_save(map, run_.statistics.scans(), keeper_.kept());
    run_.saving_last = true;
    require_agreement();
    run_.checkpoints.save(map, run_.statistics.scans(), keeper_.kept());
    run_.written = {run_.options.output + ".surfaces", run_.options.output + ".bt"};
    for (const std::string& file :
         {keeper_.kept().folder.string(), run_.options.write_poses, run_.options.mcap, run_.options.report})
      if (!file.empty()) run_.written.push_back(file);
  }

 private:
  void require_agreement() const {
    if (!run_.options.strict) return;
    if (const std::string text = contradiction_text(run_.statistics); !text.empty())
      throw Error(Error::Kind::data, run_.options.output, text,
                  "no map is written; without --strict it would be");
  }

  RunState& run_;
  const ScanKeeper& keeper_;
};

/// The report, the summary and the warnings of a run that is over.
class RunReport : public RunObserver {
 public:
  explicit RunReport(RunState& run) : run_(run) {}

  void save(Saving saving) override {
    if (saving == Saving::checkpoint) return;
    const Map& map = run_.mapper.map();
    const std::string& report = run_.options.report;
    run_.context.wall_s = run_.now_s();
    if (!report.empty()) {
      io::NewFile file(report, run_.options.force);
      file.write([&](std::ostream& out) { out << run_.statistics.to_json(map, run_.context) << '\n'; });
      file.commit();
    }
    print_summary(run_);
    print_warnings(run_.statistics, map, !run_.options.viewpoint.empty());
  }

 private:
  RunState& run_;
};

}  // namespace

RunObservers outputs_of(RunState& run, KeptScans kept) {
  const MapOptions& options = run.options;
  RunObservers outputs;
  auto keeper = std::make_unique<ScanKeeper>(std::move(kept));
  auto saver = std::make_unique<MapSaver>(run, *keeper);
  if (options.serve_port) outputs.push_back(live_view(run));
  outputs.push_back(std::move(keeper));
  outputs.push_back(std::move(saver));
  outputs.push_back(std::make_unique<PoseLog>(options.write_poses, options.force, run.mapper.map().origin()));
  if (!options.mcap.empty())
    outputs.push_back(std::make_unique<SceneLog>(options.mcap, options.force, run.mapper));
  outputs.push_back(std::make_unique<RunReport>(run));
  return outputs;
}

}  // namespace octosurf
