#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <ranges>
#include <sstream>
#include <string_view>

#include <octosurf/error.hpp>
#include <octosurf/parameters.hpp>

namespace octosurf {
namespace {

/// Six digits: for display; use parameter_value() for exact values.
std::string text_of(double value) {
  std::ostringstream out;
  out << value;
  return out.str();
}

[[noreturn]] void refuse(const std::string& name, const std::string& value, const std::string& rule) {
  throw Error(Error::Kind::usage, name, "is " + value, "must be " + rule);
}

enum class Form { real, integer, flag, choice };

/// One row of the table shared by command line, config, reports and map files. Values are doubles in the
/// code's units; none: the parameter is derived by `in_force`.
struct Entry {
  ParameterInfo info;
  Form form;
  std::function<std::optional<double>(const Parameters&)> get;
  std::function<void(Parameters&, std::optional<double>)> set;
  std::function<std::string(const Parameters&)> in_force{};  // empty: never derived
  std::vector<std::string> choices{};                        // of a choice, in order of their values
};

template <class Group, class Owner, class Value>
Entry plain(Group group, Value Owner::*field, Form form, ParameterInfo info,
            std::vector<std::string> choices = {}) {
  return {std::move(info),
          form,
          [=](const Parameters& p) { return static_cast<double>(std::invoke(group, p).*field); },
          [=](Parameters& p, std::optional<double> value) {
            std::invoke(group, p).*field = static_cast<Value>(*value);
          },
          {},
          std::move(choices)};
}

template <class Group, class Value>
Entry derived(Group Parameters::*group, std::optional<Value> Group::*field, Form form, ParameterInfo info,
              std::function<std::string(const Parameters&)> in_force) {
  return {std::move(info), form, [=](const Parameters& p) { return std::optional<double>(p.*group.*field); },
          [=](Parameters& p, std::optional<double> value) {
            p.*group.*field = value ? std::optional(static_cast<Value>(*value)) : std::nullopt;
          },
          std::move(in_force)};
}

/// A component of `up`. Components are set separately; validate() checks for a unit vector.
Entry component(int axis, ParameterInfo info) {
  return {std::move(info), Form::real,
          [=](const Parameters& p) -> std::optional<double> {
            return p.up ? std::optional((*p.up)[axis]) : std::nullopt;
          },
          [=](Parameters& p, std::optional<double> value) {
            if (!value) return p.up.reset();
            if (!p.up) p.up = Eigen::Vector3d::Zero();
            (*p.up)[axis] = *value;
          },
          [](const Parameters&) { return std::string("estimated"); }};
}

std::vector<Entry> make_entries() {
  using P = Parameters;
  using O = OccupancyParameters;
  using S = SurfaceParameters;
  using D = DetectionParameters;
  constexpr auto o = &P::occupancy;
  constexpr auto s = &P::surfaces;
  constexpr auto d = &P::detection;
  return {
      plain(o, &O::resolution, Form::real, {"resolution", "m", "d: voxel edge of the octree"}),
      derived(s, &S::surface_tolerance, Form::real,
              {"surface_tolerance", "m", "s: how far a point may lie off a plane"},
              [](const P& p) { return text_of(p.surface_tolerance()); }),
      plain(s, &S::sensor_noise, Form::real, {"sensor_noise", "m", "standard deviation near the sensor"}),
      derived(s, &S::range_noise, Form::real,
              {"range_noise", "1/m", "noise is sensor_noise + range_noise*z^2; auto: from the scans"},
              [](const P&) { return std::string("estimated"); }),
      derived(s, &S::max_hole_size, Form::real,
              {"max_hole_size", "m", "h: alpha of the polygons, largest gap within a surface"},
              [](const P& p) { return text_of(p.max_hole_size()); }),
      derived(d, &D::search_radius, Form::real,
              {"search_radius", "m", "r: neighbourhood of a point, for the paper's detector"},
              [](const P& p) { return text_of(p.search_radius()); }),
      derived(d, &D::min_surface_points, Form::integer,
              {"min_surface_points", "", "n: fewest points of a surface"},
              [](const P& p) { return std::to_string(p.min_surface_points()); }),
      plain(s, &S::min_surface_width, Form::real,
            {"min_surface_width", "m", "narrower planar clusters do not become surfaces"}),
      derived(o, &O::max_range, Form::real, {"max_range", "m", "farther points only free space"},
              [](const P&) { return std::string("sensor"); }),
      plain(o, &O::min_range, Form::real, {"min_range", "m", "nearer points are dropped"}),
      plain(o, &O::hit, Form::real, {"hit", "", "probability of a hit"}),
      plain(o, &O::miss, Form::real, {"miss", "", "probability of a miss"}),
      plain(o, &O::clamp_min, Form::real, {"clamp_min", "", "lower clamp of the occupancy probability"}),
      plain(o, &O::clamp_max, Form::real, {"clamp_max", "", "upper clamp of the occupancy probability"}),
      plain(o, &O::occupied, Form::real, {"occupied", "", "occupancy probability of an occupied voxel"}),
      plain(o, &O::preserve_surfaces, Form::flag,
            {"preserve_surfaces", "", "grazing rays do not erode surfaces"}),
      plain(d, &D::detect_cylinders, Form::flag,
            {"detect_cylinders", "", "find pillars, rails and rungs in points that are on no plane"}),
      plain(d, &D::detection_budget, Form::integer,
            {"detection_budget", "",
             "most pending readings segmented in a scan (a quarter of them, if that is more); 0: all"}),
      plain(d, &D::detector, Form::choice,
            {"detector", "", "likelihood, or paper: the paper's thresholds, by PCL's parts"},
            {"likelihood", "paper"}),
      plain(std::identity(), &P::align, Form::choice,
            {"align", "",
             "auto: correct poses once surfaces seen long ago show that they drift; off: take them as given"},
            {"off", "auto"}),
      component(0, {"up_x", "", "unit vector against gravity, map frame; auto: from the surfaces"}),
      component(1, {"up_y", "", "its y"}),
      component(2, {"up_z", "", "its z"}),
  };
}

const std::vector<Entry>& entries() {
  static const std::vector<Entry> table = make_entries();
  return table;
}

const Entry& entry(const std::string& name) {
  for (const Entry& e : entries())
    if (e.info.name == name) return e;
  throw Error(Error::Kind::usage, name, "is not a parameter", "octosurf map --help lists them");
}

/// The number in all of the text.
std::optional<double> number_of(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

/// "z", "-y", "0 -0.9 -0.4" or the same with commas; empty for anything else.
std::optional<Eigen::Vector3d> direction_of(std::string text) {
  const std::string_view axes = "xyz";
  const bool has_sign = text.size() == 2 && (text[0] == '-' || text[0] == '+');
  if (text.size() == 1 || has_sign)
    if (const auto axis = axes.find(text.back()); axis != std::string_view::npos)
      return (text[0] == '-' ? -1.0 : 1.0) * Eigen::Vector3d::Unit(static_cast<Eigen::Index>(axis));
  std::replace(text.begin(), text.end(), ',', ' ');
  std::istringstream words(text);
  Eigen::Vector3d direction;
  std::string word;
  for (double& coordinate : direction) {
    const auto value = words >> word ? number_of(word) : std::nullopt;
    if (!value) return {};
    coordinate = *value;
  }
  const double length = direction.stableNorm();
  if (words >> word || !(length > 0) || !std::isfinite(length)) return {};
  return direction.stableNormalized();
}

void set_up(Parameters& parameters, const std::string& text) {
  if (text == "auto") return parameters.up.reset();
  const std::optional<Eigen::Vector3d> up = direction_of(text);
  if (!up) refuse("up", "'" + text + "'", "X Y Z, not all 0, or x, -x, y, -y, z, -z, or auto");
  parameters.up = up;
}

}  // namespace

Parameters Parameters::paper(double resolution, double sensor_noise) {
  Parameters p;
  p.occupancy.resolution = resolution;
  p.surfaces.sensor_noise = sensor_noise;
  p.align = false;
  p.detection.detector = DetectorKind::paper;
  p.detection.detect_cylinders = false;
  p.surfaces.surface_tolerance = sensor_noise + resolution * std::sqrt(3.0);
  p.surfaces.range_noise = 0;
  p.surfaces.min_surface_width = 0;
  p.detection.search_radius = std::max(5 * resolution, std::min(0.15, 64 * resolution));
  p.detection.min_surface_points = 50;
  return p;
}

double Parameters::surface_tolerance() const {
  return surfaces.surface_tolerance.value_or(surfaces.sensor_noise + occupancy.resolution / 2);
}

double Parameters::max_hole_size() const {
  return surfaces.max_hole_size.value_or(std::max(0.08, 4 * occupancy.resolution));
}

double Parameters::search_radius() const {
  return detection.search_radius.value_or(std::max(0.06, 5 * occupancy.resolution));
}

int Parameters::min_surface_points() const {
  if (detection.min_surface_points) return *detection.min_surface_points;
  const double voxels = 0.02 / (occupancy.resolution * occupancy.resolution);
  return static_cast<int>(std::lround(std::clamp(voxels, 20.0, 500.0)));
}

void Parameters::validate() const {
  const auto check = [this](const char* name, bool holds, const char* rule) {
    if (!holds) refuse(name, get_parameter(*this, name), rule);
  };
  // Written so that NaN violates every rule.
  const OccupancyParameters& o = occupancy;
  check("resolution", o.resolution >= 1e-3 && o.resolution <= 10, "from 0.001 to 10 m");
  check("max_range", !o.max_range || (*o.max_range > 0 && *o.max_range <= 1e6),
        "more than 0 and at most 1e6 m");
  check("min_range", o.min_range >= 0 && o.min_range < o.max_range.value_or(1e6),
        "at least 0 and below max_range");
  check("hit", o.hit > 0.5 && o.hit < 1, "more than 0.5 and less than 1");
  check("miss", o.miss > 0 && o.miss < 0.5, "more than 0 and less than 0.5");
  check("clamp_min", o.clamp_min > 0 && o.clamp_min < o.occupied, "above 0 and below 'occupied'");
  check("clamp_max", o.clamp_max < 1 && o.clamp_max > o.occupied, "below 1 and above 'occupied'");
  check("occupied", o.occupied > 0 && o.occupied < 1, "more than 0 and less than 1");
  const SurfaceParameters& s = surfaces;
  check("sensor_noise", s.sensor_noise >= 0 && s.sensor_noise <= 1, "from 0 to 1 m");
  check("range_noise", !s.range_noise || (*s.range_noise >= 0 && *s.range_noise <= 1), "from 0 to 1 1/m");
  check("surface_tolerance", surface_tolerance() > 0 && surface_tolerance() <= 1,
        "more than 0 and at most 1 m");
  // The effort of a scan grows with the cube of h in voxels: with 32 it is ten times that of the default.
  check("max_hole_size",
        max_hole_size() >= o.resolution && max_hole_size() <= std::max(0.08, 32 * o.resolution),
        "from 1 to 32 voxels, or up to 0.08 m");
  check("min_surface_width", s.min_surface_width >= 0 && s.min_surface_width <= 10, "from 0 to 10 m");
  const DetectionParameters& d = detection;
  if (d.detector != DetectorKind::likelihood && d.detector != DetectorKind::paper)
    refuse("detector", "unknown", "likelihood or paper");
  check("search_radius", search_radius() >= o.resolution && search_radius() <= 64 * o.resolution,
        "from 1 to 64 voxels");
  check("min_surface_points", min_surface_points() >= 3, "at least 3");
  check("detection_budget", d.detection_budget >= 0, "at least 0");
  check("up", !up || std::fabs(up->norm() - 1) <= 1e-6, "of length 1");
}

const std::vector<ParameterInfo>& parameter_infos() {
  static const auto infos = std::views::transform(entries(), &Entry::info);
  static const std::vector<ParameterInfo> all(infos.begin(), infos.end());
  return all;
}

std::string get_parameter(const Parameters& parameters, const std::string& name) {
  if (name == "up") {
    if (!parameters.up) return "estimated";
    const Eigen::Vector3d& up = *parameters.up;
    return text_of(up.x()) + " " + text_of(up.y()) + " " + text_of(up.z());
  }
  const Entry& e = entry(name);
  const std::optional<double> value = e.get(parameters);
  if (!value) return e.in_force(parameters);
  if (e.form == Form::flag) return *value != 0 ? "true" : "false";
  if (e.form == Form::choice) return e.choices.at(static_cast<std::size_t>(*value));
  return text_of(*value);
}

void set_parameter(Parameters& parameters, const std::string& name, const std::string& text) {
  if (name == "up") return set_up(parameters, text);
  const Entry& e = entry(name);
  if (text == "auto" && e.in_force) return e.set(parameters, std::nullopt);
  if (e.form == Form::flag) {
    const bool on = text == "true" || text == "on" || text == "1";
    if (!on && text != "false" && text != "off" && text != "0")
      refuse(name, "'" + text + "'", "true or false");
    return e.set(parameters, on);
  }
  if (e.form == Form::choice) {
    const auto found = std::find(e.choices.begin(), e.choices.end(), text);
    if (found == e.choices.end()) refuse(name, "'" + text + "'", e.choices[0] + " or " + e.choices[1]);
    return e.set(parameters, static_cast<double>(found - e.choices.begin()));
  }
  const std::optional<double> value = number_of(text);
  if (!value) refuse(name, "'" + text + "'", e.in_force ? "a finite number or auto" : "a finite number");
  if (e.form == Form::integer && (*value != std::floor(*value) || std::fabs(*value) > 1e9))
    refuse(name, "'" + text + "'", "an integer");
  e.set(parameters, *value);
}

std::optional<double> parameter_value(const Parameters& parameters, const std::string& name) {
  return entry(name).get(parameters);
}

void set_parameter_value(Parameters& parameters, const std::string& name, std::optional<double> value) {
  const Entry& e = entry(name);
  if (!value && !e.in_force) refuse(name, "not given", "a number");
  constexpr double largest_count = 1e9;  // fits an int: casting more, or NaN, would be undefined
  const bool counts = e.form == Form::integer || e.form == Form::flag;
  if (value && counts && !(std::fabs(*value) <= largest_count))
    refuse(name, std::to_string(*value), "a count");
  if (value && e.form == Form::choice && *value != 0 && *value != 1)
    refuse(name, std::to_string(*value), "0 or 1");
  e.set(parameters, value);
}

}  // namespace octosurf
