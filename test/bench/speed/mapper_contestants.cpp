// Whole scans: Mapper, and the paper's pipeline from stock PCL parts.

#include "bench/speed/contestant.hpp"
#include "reference/paper_pipeline.hpp"

#include <filesystem>
#include <optional>

#include <octosurf/mapper.hpp>

namespace octosurf::bench {
namespace {

class MapperSide : public Contestant {
 public:
  explicit MapperSide(const Json& settings)
      : heap_before_(heap_in_use()),
        parameters_(parameters_from(settings)),
        threads_(settings.value("threads", 1)),
        fresh_(settings.value("fresh", false)) {
    mapper_.emplace(parameters_, threads_);
  }

  void prepare(const Scan& scan) override {
    if (fresh_) mapper_.emplace(parameters_, threads_);
    scan_ = scan;
  }
  void run() override { report_ = mapper_->insert(scan_); }
  Json stages() const override { return report_.stage_ms; }

  /// {"save": STEM}: the map is saved there; {"evaluate": TRUTH FILE}: its scores.
  Json tell(const Json& question) override {
    scan_ = Scan();
    const std::size_t heap = heap_in_use() - heap_before_;
    const Map::Size size = mapper_->map().size();
    Json answer{{"heap", heap},
                {"tree_bytes", size.bytes},
                {"leaves", size.leaves},
                {"points", size.points},
                {"surfaces", mapper_->snapshot()->surfaces.size()}};
    if (question.contains("save")) {
      const std::filesystem::path stem(question["save"].get<std::string>());
      save_map(mapper_->map(), stem);
      answer["file_bytes"] = std::filesystem::file_size(stem.string() + ".surfaces");
    }
    if (question.contains("evaluate")) answer.update(scores(*mapper_->snapshot(), question));
    return answer;
  }

 private:
  std::size_t heap_before_;
  Parameters parameters_;
  int threads_;
  bool fresh_;
  std::optional<Mapper> mapper_;
  Scan scan_;
  ScanReport report_;
};

class PaperSide : public Contestant {
 public:
  explicit PaperSide(const Json& settings) : pipeline_(parameters_of(settings)) {}
  void prepare(const Scan& scan) override { scan_ = scan; }
  void run() override { pipeline_.insert(scan_); }
  Json tell(const Json& /*question*/) override {
    return {{"surfaces", pipeline_.snapshot().surfaces.size()}, {"pending", pipeline_.pending()}};
  }

 private:
  static Parameters parameters_of(const Json& settings) {
    const auto resolution = settings.at("resolution").get<double>();
    Parameters parameters = settings.value("small_radius", false)
                                ? reference::paper_parameters_small_radius(resolution)
                                : reference::paper_parameters(resolution);
    parameters.occupancy.max_range = parameters_from(settings).occupancy.max_range;
    return parameters;
  }
  reference::PaperPipeline pipeline_;
  Scan scan_;
};

}  // namespace

std::unique_ptr<Contestant> make_mapper(const Json& settings) {
  return std::make_unique<MapperSide>(settings);
}
std::unique_ptr<Contestant> make_paper(const Json& settings) { return std::make_unique<PaperSide>(settings); }

}  // namespace octosurf::bench
