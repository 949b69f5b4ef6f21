// Rows about parts of the surfaces' work: planes, normals, outlines.

#include "bench/speed/scans.hpp"
#include "bench/support.hpp"
#include "simulation/recording.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include <octosurf/error.hpp>

namespace octosurf::bench {
namespace {

constexpr double resolution = 0.02;  // m

struct Method {
  const char* kind;
  const char* title;
};
constexpr Method cgal_methods[] = {{"region_growing", "CGAL Region_growing"},
                                   {"ransac", "CGAL Efficient_RANSAC"}};

/// Scans, and for the simulated ones what is true of each and of all.
struct PlaneScene {
  std::string name;
  bool accumulate = false;
  /// visit(scan, truth file or empty, last)
  std::function<void(const std::function<void(const Scan&, const std::string&, bool)>&)> each;
};

std::string truth_file(const simulation::Recording::Visibility& visibility) {
  const std::filesystem::path file = scratch_folder() / "truth.json";
  evaluation::save_truth(visibility.truth(), file);
  return file.string();
}

/// `count` scans spread evenly over the recording. Truth: of the single scan, or at the end of all.
PlaneScene simulated_planes(const std::string& scene, std::size_t count, bool accumulate) {
  return {scene, accumulate, [=](const auto& visit) {
            simulation::SimulationOptions simulation;
            simulation.scene = scene;
            const simulation::Recording recording(simulation);
            simulation::Recording::Visibility all = recording.visibility();
            for (std::size_t k = 0; k < count; ++k) {
              const std::size_t i = k * recording.size() / count;
              const simulation::Readings ideal = recording.ideal(i);
              simulation::Recording::Visibility one = recording.visibility();
              one.add(i, ideal);
              all.add(i, ideal);
              const bool last = k + 1 == count;
              const std::string truth = !accumulate ? truth_file(one) : last ? truth_file(all) : "";
              visit(recording.labelled_scan(i, ideal).scan, truth, last);
            }
          }};
}

PlaneScene kitchen_planes(const SpeedOptions& options, std::size_t count, bool accumulate) {
  SpeedOptions spread = options;
  spread.every = std::max<std::size_t>(options.every, accumulate ? 3 : 10);
  const ScanSet scans = kitchen_scans(spread, count);
  return {"kitchen", accumulate, [=](const auto& visit) {
            std::size_t seen = 0;
            scans.each([&](const Scan& scan) { visit(scan, std::string(), ++seen == count); });
          }};
}

/// What all methods made of one scene; measured once.
class PlanesResult {
 public:
  explicit PlanesResult(PlaneScene scene) : scene_(std::move(scene)) {}

  Numbers against(const std::string& kind) {
    if (sides_.empty()) measure();
    const Side &ours = sides_.at("mapper"), &theirs = sides_.at(kind);
    std::vector<Turn> planes = ours.turns;  // CGAL neither groups points by voxel nor keeps an octree
    for (Turn& turn : planes) turn.ms = sum(turn.stage_ms) - turn.stage_ms[0] - turn.stage_ms[1];
    std::vector<Turn> theirs_turns = theirs.turns;
    if (scene_.accumulate) {  // once the map holds half of the scans
      planes.erase(planes.begin(), planes.begin() + static_cast<std::ptrdiff_t>(planes.size() / 2));
      theirs_turns.assign(planes.size(), theirs.turns.back());
    }
    Numbers numbers = compare(planes, theirs_turns);
    numbers.erase("cpu_ratio");  // of whole turns
    numbers["insert_ms"] = median(milliseconds(ours.turns));
    if (scene_.accumulate) numbers["insert_all_scans_ms"] = sum(milliseconds(ours.turns));
    for (const auto& [name, side] : {std::pair{"ours", &ours}, std::pair{"theirs", &theirs}}) {
      const std::string prefix = std::string(name) + "_";
      numbers[prefix + "surfaces"] = side->surfaces;
      if (side->faces == 0) continue;
      numbers["faces"] = side->faces;
      numbers[prefix + "correct_percent"] = 100 * side->correct / side->faces;
      numbers[prefix + "noise"] = side->noise;
      numbers[prefix + "unsafe_percent"] = 100 * side->unsafe_m2 / side->area_m2;
    }
    return numbers;
  }

 private:
  struct Side {
    std::vector<Turn> turns;
    double faces = 0, correct = 0, surfaces = 0, noise = 0, area_m2 = 0, unsafe_m2 = 0;
  };

  void measure() {
    Contest contest;
    std::vector<std::string> kinds{"mapper"};
    for (const Method& method : cgal_methods) kinds.emplace_back(method.kind);
    for (const std::string& kind : kinds)
      contest.enter(kind, kind,
                    {{"resolution", resolution},
                     {"max_range", camera_range},
                     {"fresh", !scene_.accumulate},
                     {"accumulate", scene_.accumulate}});
    std::map<std::string, Side> sides;
    scene_.each([&](const Scan& scan, const std::string& truth, bool last) {
      for (const std::string& kind : kinds) {
        contest.prepare(kind, scan);
        if (!scene_.accumulate || last || kind == "mapper") contest.run(kind);
        if (scene_.accumulate && !last) continue;
        const Json told = contest.ask(kind, truth.empty() ? Json::object() : Json{{"evaluate", truth}});
        Side& side = sides[kind];
        side.surfaces += told.at("surfaces").get<double>();
        side.faces += told.value("faces", 0.0);
        side.correct += told.value("correct", 0.0);
        side.noise += told.value("noise", 0.0);
        side.area_m2 += told.value("area_m2", 0.0);
        side.unsafe_m2 += told.value("unsafe_m2", 0.0);
      }
    });
    for (auto& [kind, side] : sides) side.turns = contest.turns(kind);
    sides_ = std::move(sides);
  }

  PlaneScene scene_;
  std::map<std::string, Side> sides_;
};

}  // namespace

void add_planes_rows(const SpeedOptions& options) {
  for (const bool accumulate : {false, true}) {
    const std::size_t count = accumulate ? options.count(10, 40) : options.count(4, 20);
    std::vector<PlaneScene> scenes;
    for (const char* name : {"room", "office", "stairs"})
      scenes.push_back(simulated_planes(name, count, accumulate));
    scenes.push_back(kitchen_planes(options, count, accumulate));
    for (const PlaneScene& scene : scenes) {
      const auto result = std::make_shared<PlanesResult>(scene);
      for (const Method& method : cgal_methods) {
        const std::string kind = method.kind;
        register_row(
            {std::string("planes/") + (accumulate ? "accumulated/" : "frame/") + scene.name + "/" + kind,
             (accumulate ? "planes of " + std::to_string(count) + " scans, up to date after one more"
                         : std::string("planes of one frame")) +
                 ", " + scene.name + ", 2 cm",
             method.title, [result, kind] { return result->against(kind); }});
      }
    }
  }
}

namespace {

using Normals = std::vector<std::optional<Eigen::Vector4d>>;

Normals normals_told(const Json& told) {
  Normals normals;
  for (const Json& n : told.at("normals")) {
    if (n.is_null())
      normals.emplace_back();
    else
      normals.emplace_back(Eigen::Vector4d(n[0], n[1], n[2], n[3]));
  }
  return normals;
}

/// Degrees between normals of points that the incumbent finds planar; PCL's have no side.
void collect_angles(const Normals& ours, const Normals& theirs, std::vector<double>& angles) {
  constexpr double planar = 0.01;  // surface variation
  for (std::size_t i = 0; i < std::min(ours.size(), theirs.size()); ++i) {
    if (!ours[i] || !theirs[i] || (*theirs[i])[3] > planar) continue;
    const double cosine = ours[i]->head<3>().normalized().dot(theirs[i]->head<3>().normalized());
    angles.push_back(std::acos(std::min(1.0, std::abs(cosine))) * 180 / std::numbers::pi);
  }
}

Numbers normals_numbers(const ScanSet& scans, double radius) {
  Contest contest;
  Json settings = settings_for(scans, resolution);
  settings["radius"] = radius;
  contest.enter("ours", "normal_field", settings);
  contest.enter("theirs", "mls", settings);
  std::vector<double> angles;
  double points = 0, with_normal = 0;
  scans.each([&](const Scan& scan) {
    contest.turn(scan);
    const Normals ours = normals_told(contest.ask("ours", nullptr));
    const Normals theirs = normals_told(contest.ask("theirs", nullptr));
    if (ours.size() != theirs.size()) throw Error(Error::Kind::data, scan.name, "the points differ");
    collect_angles(ours, theirs, angles);
    points += static_cast<double>(ours.size());
    with_normal +=
        static_cast<double>(std::count_if(ours.begin(), ours.end(), [](auto& n) { return n.has_value(); }));
  });
  Numbers numbers = compare(contest.turns("ours"), contest.turns("theirs"));
  numbers["points"] = points;
  numbers["ours_known_percent"] = 100 * with_normal / points;
  numbers["planar_points"] = static_cast<double>(angles.size());
  numbers["mean_angle_deg"] = sum(angles) / static_cast<double>(std::max<std::size_t>(angles.size(), 1));
  numbers["p95_angle_deg"] = percentile(angles, 0.95);
  return numbers;
}

}  // namespace

void add_normals_rows(const SpeedOptions& options) {
  SpeedOptions spread = options;
  spread.every = std::max<std::size_t>(options.every, 10);
  const ScanSet scans = kitchen_scans(spread, options.count(5, 30));
  for (const double radius : {0.05, 0.06, 0.15}) {
    char name[64];
    std::snprintf(name, sizeof name, "normals/kitchen/r:%g", radius);
    register_row({name, "normals of one kitchen frame, 2 cm, r = " + centimetres(radius),
                  "PCL's moving least squares", [scans, radius] { return normals_numbers(scans, radius); }});
  }
}

namespace {

/// A surface that lives on against both ways from scratch; measured once for a size.
class GrowthResult {
 public:
  GrowthResult(std::size_t inliers, std::size_t steps) : inliers_(inliers), steps_(steps) {}

  Numbers against(const std::string& kind) {
    if (!contest_) measure();
    Numbers numbers = compare(contest_->turns("derive_grown"), contest_->turns(kind));
    numbers["ring_vertices"] = vertices_;
    if (kind == "derive_fresh")
      numbers["outlines_that_differ"] = differ_;
    else
      numbers["area_differs_percent"] = area_differs_percent_;
    return numbers;
  }

 private:
  void measure() {
    auto contest = std::make_unique<Contest>();
    const Json settings{{"resolution", resolution}, {"inliers", inliers_}, {"step", 1000}};
    for (const char* kind : {"derive_grown", "derive_fresh", "derive_reference"})
      contest->enter(kind, kind, settings);
    for (std::size_t step = 0; step < steps_; ++step) {
      contest->turn(Scan());
      const Json grown = contest->ask("derive_grown", nullptr);
      const double area = grown.at("area_m2").get<double>();
      const double reference = contest->ask("derive_reference", nullptr).at("area_m2").get<double>();
      differ_ += grown.at("digest") != contest->ask("derive_fresh", nullptr).at("digest");
      area_differs_percent_ = std::max(area_differs_percent_, 100 * std::abs(area - reference) / reference);
      vertices_ = grown.at("vertices").get<double>();
    }
    contest_ = std::move(contest);
  }

  std::size_t inliers_, steps_;
  std::unique_ptr<Contest> contest_;
  double differ_ = 0, area_differs_percent_ = 0, vertices_ = 0;
};

}  // namespace

void add_derive_rows(const SpeedOptions& options) {
  for (const std::size_t inliers : {100'000, 1'000'000}) {
    const auto result = std::make_shared<GrowthResult>(inliers, options.count(5, 20));
    const std::string what = std::string("outline of a surface of ") +
                             (inliers == 100'000 ? "100,000" : "1,000,000") + " inliers that grew by 1,000";
    for (const auto& [kind, against] :
         {std::pair<std::string, std::string>{"derive_fresh", "our own from scratch"},
          {"derive_reference", "CGAL's Delaunay from scratch"}})
      register_row({"derive/" + std::to_string(inliers) + "/" + kind, what, against,
                    [result, kind = kind] { return result->against(kind); }});
  }
}

}  // namespace octosurf::bench
