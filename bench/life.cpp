// A month of a robot's rounds through an office: people walk, doors open, chairs move every day, tables once
// a week; every day the process is killed and goes on from its last checkpoint. What grows, and what is lost?

#include "bench/bench.hpp"
#include "evaluation/evaluate.hpp"
#include "simulation/ray_caster.hpp"
#include "simulation/scenes.hpp"
#include "simulation/sensor.hpp"
#include "simulation/trajectory.hpp"
#include "simulation/visible_cells.hpp"

#include <csignal>
#include <fstream>
#include <sys/wait.h>
#include <unistd.h>

#include <octosurf/map.hpp>

namespace octosurf::bench {
namespace {

using simulation::Random;

constexpr std::size_t days = 30, laps_a_day = 8, saves_a_day = 10;

/// The office at a scan; equal arguments give equal worlds and readings.
class Office {
 public:
  Office(std::uint64_t seed, std::size_t scans)
      // Each day ends with a save, so that the next one, in which the process is killed, begins anew.
      : seed_(seed),
        scans_a_day_(scans / days / saves_a_day * saves_a_day),
        sensor_(simulation::make_sensor("spinning")) {
    const simulation::Scene office = simulation::make_scene("office", Random(seed, 0), 0);
    poses_ = simulation::walk_path(office.path, scans_a_day_, laps_a_day);
    for (const simulation::View& view : office.path) floor_.extend(view.eye.head<2>());
    // A small lidar: every second beam in every eighth column.
    std::vector<Eigen::Vector3f> rays;
    for (std::size_t i = 0; i < sensor_.rays.size(); ++i)
      if (i % 2 == 0 && i / 32 % 8 == 0) rays.push_back(sensor_.rays[i]);
    sensor_.rays = std::move(rays);
  }

  std::size_t scans() const { return days * scans_a_day_; }
  std::size_t day_of(std::size_t scan) const { return scan / scans_a_day_; }

  Scan scan(std::size_t i) const {
    Random noise(seed_, 1000 + i);
    Scan scan;
    scan.sensor = sensor_.kind;
    scan.stamp_s = static_cast<double>(i) / sensor_.scans_per_s;
    scan.T_map_sensor = pose(i);
    for_each_hit(i, [&](const Eigen::Vector3f& ray, const simulation::Hit& hit) {
      const double t = sensor_.rounded(hit.t + sensor_.sigma(hit.t) * noise.normal());
      if (t > 0) scan.points.push_back(static_cast<float>(t) * ray);
    });
    return scan;
  }

  /// What stands at a day's end, as far as that day showed it.
  evaluation::Truth truth(std::size_t day) const {
    const simulation::Faces faces(scene(day * scans_a_day_), {});
    simulation::VisibleCells cells(faces.all(), sensor_);
    for (std::size_t i = day * scans_a_day_; i < (day + 1) * scans_a_day_; i += 5) {
      std::vector<float> t(sensor_.rays.size());
      std::vector<std::uint16_t> labels(t.size());
      for_each_hit(i, [&](const Eigen::Vector3f& ray, const simulation::Hit& hit) {
        const auto k = static_cast<std::size_t>(&ray - sensor_.rays.data());
        const Eigen::Vector3d direction = pose(i).linear() * ray.cast<double>();
        t[k] = hit.t;
        labels[k] = faces.label(hit.facet, pose(i).translation() + hit.t * direction, direction);
      });
      cells.add(pose(i), t, labels);
    }
    evaluation::Truth truth{"life", "small lidar", seed_, sensor_.cell, 1, cells.faces(), {}};
    return truth;
  }

 private:
  Eigen::Isometry3d pose(std::size_t i) const { return sensor_.mount(poses_[i % scans_a_day_], i); }

  Eigen::Vector2d place(Random& random) const {
    return {random.uniform(floor_.min().x(), floor_.max().x()),
            random.uniform(floor_.min().y(), floor_.max().y())};
  }

  simulation::Scene scene(std::size_t i) const {
    simulation::Scene scene = simulation::make_scene("office", Random(seed_, 0), 0);
    Random of_week(seed_, 10 + day_of(i) / 7), of_day(seed_, 100 + day_of(i));
    for (int k = 0; k < 2; ++k)
      simulation::add_table(scene, "moved_table" + std::to_string(k), place(of_week),
                            of_week.uniform(0, std::numbers::pi), {1.2, 0.7, 0.6});
    for (int k = 0; k < 4; ++k)
      simulation::add_standing_box(scene, "chair" + std::to_string(k), place(of_day), 0,
                                   of_day.uniform(0, std::numbers::pi), {0.45, 0.45, 0.45});
    // A door's leaf at the middle of a side, which opens and closes ten times a day.
    const bool open = i * 10 / scans_a_day_ % 2 == 0;
    Eigen::Isometry3d leaf = Eigen::Isometry3d::Identity();
    leaf.translation() << floor_.max().x(), floor_.center().y(), 1;
    leaf.rotate(Eigen::AngleAxisd(open ? std::numbers::pi / 2 : 0, Eigen::Vector3d::UnitZ()));
    simulation::add_box(scene, simulation::add_object(scene, "door"), leaf * Eigen::Translation3d(0.45, 0, 0),
                        {0.9, 0.04, 2});
    // People walk the round the other way, a third and two thirds of it off; nobody is nearer than 0.7 m.
    for (std::size_t k = 1; k <= 2; ++k) {
      const auto at =
          (2 * scans_a_day_ + k * scans_a_day_ / laps_a_day / 3 - i % scans_a_day_) % scans_a_day_;
      Eigen::Vector3d person = poses_[at].position;
      if ((person - poses_[i % scans_a_day_].position).norm() < 0.7) person.z() = -10;
      person.z() -= simulation::head_height;
      simulation::add_cylinder(scene, simulation::add_object(scene, "person"), person, 0.22, 1.7);
    }
    return scene;
  }

  template <class Visit>
  void for_each_hit(std::size_t i, const Visit& visit) const {
    const simulation::RayCaster caster(scene(i), {}, 0);
    std::vector<Eigen::Vector3f> directions;
    for (const Eigen::Vector3f& ray : sensor_.rays)
      directions.push_back(pose(i).linear().cast<float>() * ray);
    const std::vector<simulation::Hit> hits = caster.cast(pose(i).translation(), directions, sensor_.max_t);
    for (std::size_t k = 0; k < hits.size(); ++k)
      if (hits[k].t > sensor_.min_t) visit(sensor_.rays[k], hits[k]);
  }

  std::uint64_t seed_;
  std::size_t scans_a_day_;
  simulation::SensorModel sensor_;
  std::vector<simulation::HeadPose> poses_;
  Eigen::AlignedBox2d floor_;
};

std::uint64_t written_bytes() {
  std::ifstream io("/proc/self/io");
  for (std::string name; io >> name;)
    if (std::uint64_t value = 0; io >> value && name == "wchar:") return value;
  return 0;
}

/// Maps from the last checkpoint on until the process is killed, once a day, or all is done.
void live(const Office& office, const std::filesystem::path& file, const Options& options) {
  const bool begun = std::filesystem::exists(file.string() + ".surfaces");
  Map map = begun ? load_map(file).map : Map(parameters_at(options.resolutions.front(), options.set));
  std::size_t i = map.size().scans;
  const std::size_t day_length = office.scans() / days;
  const std::size_t killed_at =
      (office.day_of(i) + 1) * day_length + Random(7, office.day_of(i)).next() % day_length;
  Mapper mapper(std::move(map), options.threads);
  std::vector<double> scan_ms, save_ms, save_bytes;
  for (; i < office.scans(); ++i) {
    if (i == killed_at) ::kill(::getpid(), SIGKILL);
    const Scan scan = office.scan(i);
    scan_ms.push_back(time_ms([&] { mapper.insert(scan); }));
    if ((i + 1) % (day_length / saves_a_day) != 0) continue;
    const std::uint64_t before = written_bytes();
    save_ms.push_back(time_ms([&] { save_map(mapper.map(), file); }));
    save_bytes.push_back(static_cast<double>(written_bytes() - before));
    if ((i + 1) % day_length != 0) continue;
    const std::size_t day = office.day_of(i);
    const auto snapshot = mapper.snapshot();
    Json row = named("day scans surfaces next_id heap_mb file_mb", day + 1, i + 1, snapshot->surfaces.size(),
                     snapshot->surfaces.back()->id, heap_in_use() / 1e6,
                     static_cast<double>(std::filesystem::file_size(file.string() + ".surfaces")) / 1e6);
    row.update(quantiles("scan_", "ms", scan_ms));
    row.update(quantiles("save_", "ms", save_ms));
    row["save_p50_kb"] = percentile(save_bytes, 0.5) / 1e3;
    if (day == 1 || day + 1 == days) {
      const evaluation::Evaluation score = evaluation::evaluate(*snapshot, office.truth(day));
      row.update(named("faces correct missed noise unsafe_m2", score.faces, score.correct, score.missed,
                       score.noise, score.unsafe_m2));
    }
    write(row);
    scan_ms.clear(), save_ms.clear(), save_bytes.clear();
  }
}

}  // namespace

void life(const Options& options) {
  const Office office(options.seeds.front(), options.count);
  const std::filesystem::path file = scratch("life");
  for (int status = 1; status != 0;) {
    const pid_t child = ::fork();
    if (child == 0) {
      live(office, file, options);
      ::_exit(0);
    }
    ::waitpid(child, &status, 0);
    if (WIFEXITED(status) && WEXITSTATUS(status) != 0)
      throw Error(Error::Kind::incomplete, "life", "mapping failed");
  }
}

}  // namespace octosurf::bench
