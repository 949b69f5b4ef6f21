#pragma once

#include "plan_query.hpp"
#include "planning/questions.hpp"

#include <concepts>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace CLI {
class App;
}  // namespace CLI

namespace octosurf {

// Farther off than any octree reaches (65,536 voxels), and numbers still keep their micrometres there.
constexpr double farthest_m = 1e6;
// Larger than any robot; what stands within it of a foot is looked at voxel by voxel.
constexpr double largest_robot_m = 10;

/// A field of a question, with a unit in its name ("max_slope_deg"); as an option "--max-slope".
struct QuestionField {
  using Take = std::function<void(const std::vector<double>&)>;

  std::string name, description;
  std::size_t numbers = 1;  ///< 0: a text
  double low = 0, high = 0;
  Take take{};
  bool whole = false, required = false;
  std::string usual{};               ///< as it would be given; empty: none
  std::vector<std::string> words{};  ///< that a text may be; empty: any
  std::string or_file{};             ///< of an option, whose text may also name a file; empty: it may not
  std::function<void(const std::string&)> take_text{};

  std::string option() const;
  /// Takes numbers within the limits. Throws Error(usage) of `called`.
  void put(const std::vector<double>& given, const std::string& called) const;

  QuestionField needed() && { return required = true, std::move(*this); }
  QuestionField by_default(std::string value) && { return usual = std::move(value), std::move(*this); }
};
using QuestionFields = std::vector<QuestionField>;

// Fields that write to a question. `unit`: of what is given, in SI.

template <class T>
QuestionField point_field(const char* name, const char* description, T& to, double farthest = farthest_m) {
  return {name,      description, 3,
          -farthest, farthest,    [&to](const std::vector<double>& v) { to = Eigen::Vector3d(v.data()); }};
}
template <class T>
QuestionField number_field(const char* name, const char* description, T& to, double low, double high,
                           double unit = 1) {
  const auto take = [&to, unit](const std::vector<double>& v) {
    if constexpr (std::integral<T>)
      to = static_cast<T>(v[0]);
    else
      to = v[0] * unit;
  };
  return {name, description, 1, low, high, take, std::integral<T>};
}
QuestionField text_field(const char* name, const char* description, std::vector<std::string> words,
                         std::function<void(const std::string&)> take);
/// With its heading in degrees; required.
QuestionField standing_field(const char* name, const char* description, Standing& to,
                             double farthest = farthest_m);

/// Of both footholds and contact regions.
QuestionFields contact_fields(planning::ContactQuestion& question);
/// Likewise, and a region's alone.
QuestionFields region_fields(planning::ContactQuestion& question);
/// What is planned, and for whom.
QuestionFields plan_fields(PlanQuery& query);

void add_options(CLI::App& verb, const QuestionFields& fields);

}  // namespace octosurf
