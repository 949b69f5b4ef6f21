#include "sensing/locate.hpp"

namespace octosurf::sensing {
namespace {

// GCC's and Clang's vector extension: uses the target's vector registers, or plain code.
using Real = double __attribute__((vector_size(32)));
using Single = float __attribute__((vector_size(16)));
using Whole = std::int32_t __attribute__((vector_size(16)));

template <class V, class T>
[[gnu::always_inline]] inline void store(T* to, V v) {
  __builtin_memcpy(to, &v, sizeof v);
}

/// `rows`: 3×4, row-major.
[[gnu::always_inline]] inline void locate_fours(const Eigen::Vector3f* points, std::size_t fours,
                                                const double* rows, double per_metre, LocatedPoints& out) {
  constexpr double reach = geometry::VoxelGrid::origin;
  float* const positions[3] = {out.x.data(), out.y.data(), out.z.data()};
  std::int32_t* const keys[3] = {out.key_x.data(), out.key_y.data(), out.key_z.data()};
  for (std::size_t i = 0; i < 4 * fours; i += 4) {
    const Eigen::Vector3f* p = points + i;
    const Real x{p[0].x(), p[1].x(), p[2].x(), p[3].x()};
    const Real y{p[0].y(), p[1].y(), p[2].y(), p[3].y()};
    const Real z{p[0].z(), p[1].z(), p[2].z(), p[3].z()};
    Whole inside = Whole{} - 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const double* r = rows + 4 * a;
      const Single in_map = __builtin_convertvector(r[0] * x + r[1] * y + r[2] * z + r[3], Single);
      const Real scaled = __builtin_convertvector(in_map, Real) * per_metre;
      const auto in_reach = (scaled >= -reach) & (scaled < reach);
      inside &= __builtin_convertvector(in_reach, Whole);
      const Real safe = in_reach ? scaled : Real{};  // invalid keys must not overflow below
      const Whole cut = __builtin_convertvector(safe, Whole);
      // A comparison is −1 where true: corrects truncation toward zero to rounding down.
      const Whole below = __builtin_convertvector(safe < __builtin_convertvector(cut, Real), Whole);
      store(positions[a] + i, in_map);
      store(keys[a] + i, cut + below + geometry::VoxelGrid::origin);
    }
    store(out.inside.data() + i, inside);
  }
}

using Locate = void (*)(const Eigen::Vector3f*, std::size_t, const double*, double, LocatedPoints&);

void locate_anywhere(const Eigen::Vector3f* points, std::size_t fours, const double* rows, double per_metre,
                     LocatedPoints& out) {
  locate_fours(points, fours, rows, per_metre, out);
}
#if defined(__x86_64__)
// The same operations, a third faster in AVX's encoding.
[[gnu::target("avx2")]] void locate_with_avx2(const Eigen::Vector3f* points, std::size_t fours,
                                              const double* rows, double per_metre, LocatedPoints& out) {
  locate_fours(points, fours, rows, per_metre, out);
}
const Locate best = __builtin_cpu_supports("avx2") ? locate_with_avx2 : locate_anywhere;
#else
const Locate best = locate_anywhere;
#endif

}  // namespace

void locate(std::span<const Eigen::Vector3f> points, const Eigen::Isometry3d& T_map_sensor,
            const geometry::VoxelGrid& grid, LocatedPoints& out) {
  const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> rows = T_map_sensor.matrix().topRows<3>();
  const double per_metre = grid.per_metre();
  const std::size_t fours = points.size() / 4;
  best(points.data(), fours, rows.data(), per_metre, out);
  if (points.size() % 4 == 0) return;
  std::array<Eigen::Vector3f, 4> rest;
  for (std::size_t i = 0; i < 4; ++i) rest[i] = points[std::min(4 * fours + i, points.size() - 1)];
  LocatedPoints last;
  best(rest.data(), 1, rows.data(), per_metre, last);
  for (std::size_t i = 0; 4 * fours + i < points.size(); ++i) {
    const std::size_t to = 4 * fours + i;
    out.x[to] = last.x[i], out.y[to] = last.y[i], out.z[to] = last.z[i];
    out.key_x[to] = last.key_x[i], out.key_y[to] = last.key_y[i], out.key_z[to] = last.key_z[i];
    out.inside[to] = last.inside[i];
  }
}

}  // namespace octosurf::sensing
