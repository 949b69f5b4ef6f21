#include "simulation/visible_cells.hpp"

#include "evaluation/planar_region.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace octosurf::simulation {
namespace {

/// Pixels of one face further apart than this many cells leave a gap between them.
constexpr float max_gap_cells = 5;

int steps_between(const Eigen::Vector2f& a, const Eigen::Vector2f& b) {
  return std::max(1, static_cast<int>(std::ceil((b - a).cwiseAbs().maxCoeff())));
}

}  // namespace

VisibleCells::VisibleCells(const std::vector<evaluation::TrueFace>& faces, const SensorModel& sensor)
    : faces_(faces), sensor_(sensor) {
  for (const auto& face : faces_) {
    Eigen::AlignedBox2d box;
    for (const auto& polygon : face.polygons)
      for (const auto& p : polygon.outer) box.extend(p);
    Grid grid;
    grid.column = static_cast<int>(std::floor(box.min().x() / sensor_.cell));
    grid.row = static_cast<int>(std::floor(box.min().y() / sensor_.cell));
    grid.columns = static_cast<int>(std::floor(box.max().x() / sensor_.cell)) - grid.column + 1;
    grid.rows = static_cast<int>(std::floor(box.max().y() / sensor_.cell)) - grid.row + 1;
    grids_.push_back(std::move(grid));
  }
}

void VisibleCells::Grid::mark(const Eigen::Vector2f& cell) {
  const int c = static_cast<int>(std::floor(cell.x())) - column;
  const int r = static_cast<int>(std::floor(cell.y())) - row;
  if (c < 0 || r < 0 || c >= columns || r >= rows) return;
  // Most faces of a large scene are never seen: their grids are never made.
  if (seen.empty()) seen.resize(static_cast<std::size_t>(columns) * rows);
  seen[static_cast<std::size_t>(r) * columns + c] = 1;
}

void VisibleCells::fill(const Eigen::Vector2f& here, const Eigen::Vector2f& right,
                        const Eigen::Vector2f& below, Grid& grid) {
  const Eigen::Vector2f along = right - here;
  const Eigen::Vector2f down = below - here;
  if (along.squaredNorm() > max_gap_cells * max_gap_cells ||
      down.squaredNorm() > max_gap_cells * max_gap_cells)
    return;
  const int columns = steps_between(here, right);
  const int rows = steps_between(here, below);
  for (int r = 0; r < rows; ++r)
    for (int c = 0; c < columns; ++c)
      grid.mark(here + along * (static_cast<float>(c) / static_cast<float>(columns)) +
                down * (static_cast<float>(r) / static_cast<float>(rows)));
}

void VisibleCells::add(const Eigen::Isometry3d& T_map_sensor, std::span<const float> t,
                       std::span<const std::uint16_t> labels) {
  // Sensor frame to each face's (u, v) in cells; only for faces that are met, of a long corridor's few.
  std::vector<std::optional<Eigen::Matrix<float, 2, 4>>> to_cells(faces_.size());
  std::vector<Eigen::Vector2f> cells(t.size());
  std::vector<std::uint16_t> near(t.size(), 0);  // labels of what counts as seen
  const auto reach = static_cast<float>(sensor_.visible_range * sensor_.visible_range);
  for (std::size_t k = 0; k < t.size(); ++k) {
    if (labels[k] == 0) continue;
    const Eigen::Vector3f p = t[k] * sensor_.rays[k];
    if (p.squaredNorm() > reach) continue;
    near[k] = labels[k];
    const std::size_t f = labels[k] - 1u;
    if (!to_cells[f])
      to_cells[f] = ((faces_[f].T_map_face.inverse() * T_map_sensor).matrix().topRows<2>() / sensor_.cell)
                        .cast<float>();
    cells[k] = *to_cells[f] * p.homogeneous();
    grids_[f].mark(cells[k]);
  }
  const std::size_t width = sensor_.image_width;
  if (width == 0) return;
  for (std::size_t k = 0; k + width < t.size(); ++k) {
    const bool last_column = (k + 1) % width == 0;
    if (near[k] == 0 || last_column || near[k + 1] != near[k] || near[k + width] != near[k]) continue;
    fill(cells[k], cells[k + 1], cells[k + width], grids_[near[k] - 1]);
  }
}

std::vector<evaluation::TrueFace> VisibleCells::faces() const {
  std::vector<evaluation::TrueFace> faces = faces_;
  for (std::size_t f = 0; f < faces.size(); ++f) {
    const Grid& grid = grids_[f];
    if (grid.seen.empty()) continue;
    std::size_t count = 0;
    auto& runs = faces[f].visible;
    evaluation::PlanarRegion(faces[f].polygons)
        .for_each_cell(sensor_.cell, [&](const Eigen::Vector2d& centre) {
          const auto column = static_cast<int>(std::floor(centre.x() / sensor_.cell));
          const auto row = static_cast<int>(std::floor(centre.y() / sensor_.cell));
          if (!grid.seen[static_cast<std::size_t>(row - grid.row) * grid.columns + column - grid.column])
            return;
          ++count;
          if (!runs.empty() && runs.back().row == row && runs.back().column + runs.back().count == column)
            ++runs.back().count;
          else
            runs.push_back({row, column, 1});
        });
    faces[f].visible_area_m2 = static_cast<double>(count) * sensor_.cell * sensor_.cell;
  }
  return faces;
}

}  // namespace octosurf::simulation
