#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <octosurf/scan_source.hpp>

namespace octosurf::io {

/// What the numbers of a recording's readings mean: the values that stand for no return, and the
/// kind of sensor that they come from. Decided once for each sensor.
class ReadingRules {
 public:
  using Sensor = std::pair<std::size_t, std::uint32_t>;  ///< a recording, and a topic of it

  explicit ReadingRules(const ScanSourceOptions& options) : options_(options) {}

  /// Sets `scan`'s kind of sensor, and its readings without a return to NaN. `depth_image`: it comes
  /// from one. `where` names the sensor in notes. With clear_no_return_m, those that free space become points
  /// at that range instead, whose ascending places are returned for move_to_free_rays().
  std::vector<std::size_t> apply(Scan& scan, const Sensor& sensor, bool depth_image,
                                 const std::string& where);

  /// The kind of sensor is known.
  bool knows(const Sensor& sensor) const { return kind(sensor).has_value(); }
  std::optional<SensorKind> kind(const Sensor& sensor) const;

  /// One line for each kind of sensor and each value without a return that was found.
  const std::vector<std::string>& notes() const { return notes_; }

 private:
  struct Known {
    std::optional<SensorKind> kind;
    int axis = 2;             ///< a camera looks along it
    std::vector<float> none;  ///< m, ranges or a camera's depths without a return
    bool huge = false;        ///< a format's largest numbers were told
  };
  void choose_kind(Known& known, const Scan& scan, bool depth_image, const std::string& where);
  void look_for_none(Known& known, const Scan& scan, const std::string& where);
  std::vector<std::size_t> drop(Known& known, Scan& scan, bool depth_image, const std::string& where);

  ScanSourceOptions options_;
  std::map<Sensor, Known> known_;
  std::vector<std::string> notes_;
};

/// Readings at these places, ascending, become ends of free rays.
void move_to_free_rays(Scan& scan, const std::vector<std::size_t>& places);

/// Sets the readings in these boxes, which are the robot's own, to NaN; returns their number. `sensor_in`:
/// T_frame_sensor at the scan's time.
std::size_t erase_own(Scan& scan, std::span<const SelfBox> boxes,
                      const std::function<Eigen::Isometry3d(const std::string& frame)>& sensor_in);

}  // namespace octosurf::io
