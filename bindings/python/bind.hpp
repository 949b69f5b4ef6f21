#pragma once

#include "arrays.hpp"
#include "casters.hpp"
#include "values.hpp"

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

// What every file that binds a part of the library starts from.

namespace octosurf::python {

/// Python's other threads run during the call.
using Released = py::call_guard<py::gil_scoped_release>;

using SnapshotPtr = std::shared_ptr<Snapshot>;

/// An object of the library with a lock, for several threads; Python's others run while one uses it.
template <class T>
class Locked {
 public:
  template <class... Arguments>
  requires std::is_constructible_v<T, Arguments...>
  explicit Locked(Arguments&&... arguments) : object_(std::forward<Arguments>(arguments)...) {}

  template <class Job>
  auto use(Job job) {
    const py::gil_scoped_release others_run;
    const std::lock_guard alone(busy_);
    return job(object_);
  }

 private:
  std::mutex busy_;
  T object_;
};

using Points = Dense<float>;

/// Throws Error(data) unless the shape is (…, 3).
void require_shape(const Points& points);

/// Copies points that have that shape; may be called without Python's lock.
void copy_points(const Points& points, std::vector<Eigen::Vector3f>& to);

/// Scan.from_depth(), which documents the accepted types. Throws Error(data) for other shapes and types, and
/// for a camera without focal length.
Scan scan_of_depth(const py::array& depth, const py::object& intrinsics,
                   const Eigen::Isometry3d& T_map_camera, double depth_scale, double stamp_s,
                   std::string name);

// Each binds one header. module.cpp calls them in dependency order, so that docstrings have Python's names.
void bind_error(Module& module);
void bind_parameters(Module& module);
void bind_occupancy(Module& module);
void bind_surfaces(Module& module);
void bind_scans(Module& module);
void bind_maps(Module& module);
void bind_mapper(Module& module);
void bind_queries(Module& module);
void bind_changes(Module& module);
void bind_contact(Module& module);
void bind_footsteps(Module& module);
void bind_ground(Module& module);
void bind_exports(Module& module);
void bind_ros(Module& module);

}  // namespace octosurf::python
