#pragma once

#include <Eigen/Core>
#include <pybind11/numpy.h>
#include <vector>

namespace octosurf::python {

/// float32 in C order; arrays that are otherwise are copied so.
using Points = pybind11::array_t<float, pybind11::array::c_style | pybind11::array::forcecast>;

/// Throws Error(data) unless the shape is (…, 3).
void require_shape(const Points& points);

/// Copies points that have that shape; may be called without Python's lock.
void copy_points(const Points& points, std::vector<Eigen::Vector3f>& to);

/// Points in the camera's frame, one per pixel that has a reading; Scan.from_depth() documents the accepted
/// types. Throws Error(data) for other shapes and types, and for a camera without focal length.
std::vector<Eigen::Vector3f> points_of_depth(const pybind11::array& depth, const pybind11::object& intrinsics,
                                             double depth_scale);

}  // namespace octosurf::python
