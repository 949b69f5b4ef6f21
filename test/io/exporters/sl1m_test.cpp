// Pieces for SL1M, read as its own convert_surface_to_inequality() (constants_and_tools.py) reads them.
#include "io/exporters/planner_fixture.hpp"
#include "support/paths.hpp"

#include <cstdlib>
#include <fstream>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <sstream>

#include <octosurf/error.hpp>

namespace octosurf::test {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class Sl1m : public PlannerFormats {
 protected:
  json written(const std::vector<PlannerSurface>& surfaces) const {
    export_sl1m(surfaces, path("pieces.json"), true);
    return json::parse(std::ifstream(path("pieces.json")));
  }
};

std::vector<Eigen::Vector3d> points_of(const json& list) {
  std::vector<Eigen::Vector3d> points;
  for (const json& p : list) points.emplace_back(p.at(0), p.at(1), p.at(2));
  return points;
}

/// Its normal: of the first three vertices, turned upward, z if they are collinear.
Eigen::Vector3d sl1m_normal(const std::vector<Eigen::Vector3d>& s) {
  Eigen::Vector3d n = (s[1] - s[0]).cross(s[2] - s[0]);
  if (n.z() <= 0) n = -n;
  if (n.norm() <= 1e-6) return Eigen::Vector3d::UnitZ();
  return n.normalized();
}

/// Its default_transform_from_pos_normal(), with ux² in both places of the diagonal, as there.
Eigen::Matrix3d sl1m_transform(const Eigen::Vector3d& n) {
  const Eigen::Vector3d v = Eigen::Vector3d::UnitZ().cross(n);
  const double c = n.z();
  if (std::abs(c) > 0.99) return Eigen::Matrix3d::Identity();
  const Eigen::Vector3d u = v.normalized();
  const double h = (1 - c) / (1 - c * c), s = std::sqrt(1 - c * c);
  Eigen::Matrix3d R;
  R << c + h * u.x() * u.x(), h * u.x() * u.y() - u.z() * s, h * u.x() * u.z() + u.y() * s,
      h * u.x() * u.y() + u.z() * s, c + h * u.x() * u.x(), h * u.y() * u.z() - u.x() * s,
      h * u.x() * u.z() - u.y() * s, h * u.y() * u.z() + u.x() * s, c + h * u.z() * u.z();
  return R;
}

/// Area of the hull of the vertices in the frame that SL1M chooses for them.
double sl1m_hull_area(const std::vector<Eigen::Vector3d>& s) {
  const Eigen::Matrix3d R = sl1m_transform(sl1m_normal(s));
  Ring2 flat;
  for (const Eigen::Vector3d& p : s) flat.emplace_back((R * p).head<2>());
  return shapes::ring_area(convex_hull(flat));
}

/// Area of what A·p ≤ b leaves of a large square in the plane of its last two rows.
double area_of_rows(const json& piece) {
  const json &A = piece.at("A"), &b = piece.at("b");
  const auto row = [&](std::size_t i) { return Eigen::Vector3d(A[i][0], A[i][1], A[i][2]); };
  const std::size_t edges = A.size() - 2;
  const Eigen::Vector3d n = row(edges);
  EXPECT_EQ(row(edges + 1), -n);
  EXPECT_NEAR(b[edges].get<double>(), -b[edges + 1].get<double>(), 1e-8);
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  const auto vertices = points_of(piece.at("vertices"));
  for (const Eigen::Vector3d& v : vertices) middle += v / static_cast<double>(vertices.size());
  const Eigen::Vector3d e1 = n.unitOrthogonal(), e2 = n.cross(e1);
  Ring2 ring = shapes::box(-50, -50, 100, 100);
  for (std::size_t i = 0; i < edges; ++i) {
    const Eigen::Vector2d a(row(i).dot(e1), row(i).dot(e2));
    const double bound = b[i].get<double>() - row(i).dot(middle);
    Ring2 kept;
    for (std::size_t k = 0; k < ring.size(); ++k) {
      const Eigen::Vector2d &p = ring[k], &q = ring[(k + 1) % ring.size()];
      const double dp = a.dot(p) - bound, dq = a.dot(q) - bound;
      if (dp <= 0) kept.push_back(p);
      if ((dp < 0 && dq > 0) || (dp > 0 && dq < 0)) kept.push_back(p + dp / (dp - dq) * (q - p));
    }
    ring = kept;
  }
  return shapes::ring_area(ring);
}

TEST_F(Sl1m, ItsOwnHullOfLevelPiecesHasTheirArea) {
  std::mt19937_64 random = rng();
  for (int round = 0; round < 200; ++round) {
    std::uniform_real_distribution<double> tilt(0, 8 * std::numbers::pi / 180);  // beyond, it shears
    PlannerSurface surface = random_surface(random, 7, tilt(random));
    const Ring2 ring = random_convex(random, 1);
    surface.pieces = {piece_on(surface, ring)};
    const auto vertices = points_of(written({surface}).at(0).at("vertices"));
    // Its frame is the identity there: it sees the piece from above.
    const double foreshortened = shapes::ring_area(ring) * surface.T_world_surface(2, 2);
    EXPECT_NEAR(sl1m_hull_area(vertices), foreshortened, 1e-7 * (1 + foreshortened));
    EXPECT_LT((sl1m_normal(vertices) - surface.T_world_surface.linear().col(2)).norm(), 1e-4);
  }
}

TEST_F(Sl1m, OurRowsHoldForAnyTiltWhereItsFrameShears) {
  std::mt19937_64 random = rng();
  double worst_of_sl1m = 0;
  for (int round = 0; round < 200; ++round) {
    std::uniform_real_distribution<double> tilt(0, std::numbers::pi);
    PlannerSurface surface = random_surface(random, 7, tilt(random));
    const Ring2 ring = random_convex(random, 1);
    surface.pieces = {piece_on(surface, ring)};
    const json piece = written({surface}).at(0);
    ASSERT_EQ(piece.at("A").size(), ring.size() + 2);
    for (const Eigen::Vector3d& v : points_of(piece.at("vertices")))
      for (std::size_t i = 0; i < piece.at("A").size(); ++i) {
        const json& a = piece.at("A")[i];
        const Eigen::Vector3d row(a[0], a[1], a[2]);
        EXPECT_NEAR(row.norm(), 1, 1e-12);
        EXPECT_LE(row.dot(v), piece.at("b")[i].get<double>() + 2e-9);
      }
    const double area = shapes::ring_area(ring);
    EXPECT_NEAR(area_of_rows(piece), area, 1e-6 * (1 + area));
    worst_of_sl1m =
        std::max(worst_of_sl1m, std::abs(sl1m_hull_area(points_of(piece.at("vertices"))) / area - 1));
  }
  EXPECT_GT(worst_of_sl1m, 0.05);  // the trap that A and b are written for is still there
}

TEST_F(Sl1m, FirstThreeVerticesAreNeverCollinear) {
  PlannerSurface surface;
  surface.id = 3;
  // Four vertices on one side, as cuts of a region leave them.
  surface.pieces = {piece_on(surface, {{0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 1}, {0, 1}})};
  const json piece = written({surface}).at(0);
  const auto v = points_of(piece.at("vertices"));
  EXPECT_GT((v[1] - v[0]).cross(v[2] - v[0]).z(), 0.9);
  EXPECT_EQ(v.size(), 6u);
  EXPECT_EQ(piece.at("id"), 3);
  EXPECT_EQ(points_of(json::array({piece.at("normal")}))[0], Eigen::Vector3d::UnitZ());
}

TEST_F(Sl1m, PiecesAreDisjointAndOfTheTurnedWorld) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
  const PlannerSurface table = table_with_hole(5);
  const json pieces = written({turned(table, turn)});
  ASSERT_EQ(pieces.size(), 4u);
  double sum = 0;
  for (const json& piece : pieces) {
    EXPECT_NEAR(piece.at("normal")[1].get<double>(), -1, 1e-12);
    sum += area_of_rows(piece);
  }
  EXPECT_NEAR(sum, 1.8 * 1.8 - 0.6 * 0.6, 1e-6);
}

TEST_F(Sl1m, TheLoaderInTheDocsReadsIt) {
  std::string python;
  for (const char* one : {"/usr/bin/python3", "python3"})  // Debian's own is the one with Debian's numpy
    if (std::system((std::string(one) + " -c 'import numpy' 2>/dev/null").c_str()) == 0) python = one;
  if (python.empty()) GTEST_SKIP() << "python3's numpy is missing";
  std::ifstream docs(test::paths::source() + "/docs/formats.md");
  std::stringstream text;
  text << docs.rdbuf();
  const std::string begin = "```python\nimport json, numpy as np";
  const auto from = text.str().find(begin);
  ASSERT_NE(from, std::string::npos);
  std::string loader = text.str().substr(from + 10);
  loader.resize(loader.find("```"));
  EXPECT_EQ(std::count(loader.begin(), loader.end(), '\n'), 5);
  const auto file = loader.find("office.json");
  ASSERT_NE(file, std::string::npos);
  loader.replace(file, 11, path("pieces.json").string());

  export_sl1m({table_with_hole(5)}, path("pieces.json"));
  std::ofstream(path("load.py")) << loader << R"(
assert len(surfaces) == 4 and all(s.shape == (3, 4) for s in surfaces)
for s, (A, b) in zip(surfaces, inequalities):
    assert A.shape == (6, 3) and b.shape == (6,)
    assert (A @ s <= b[:, None] + 2e-9).all()
    normal = np.cross(s[:, 1] - s[:, 0], s[:, 2] - s[:, 0])
    assert normal[2] > 0.1 and abs(normal[:2]).max() < 1e-9
)";
  EXPECT_EQ(std::system((python + " '" + path("load.py").string() + "'").c_str()), 0);
}

TEST_F(Sl1m, NothingToWriteAndOverwritingAreRefused) {
  PlannerSurface bare = table_with_hole(5);
  bare.pieces.clear();
  EXPECT_THROW(export_sl1m({bare}, path("none.json")), Error);
  EXPECT_FALSE(std::filesystem::exists(path("none.json")));
  export_sl1m({table_with_hole(5)}, path("a.json"));
  EXPECT_THROW(export_sl1m({table_with_hole(5)}, path("a.json")), Error);
  export_sl1m({table_with_hole(5)}, path("a.json"), true);
  PlannerSurface broken = table_with_hole(5);
  broken.pieces[1].vertices[2].y() = std::nan("");
  EXPECT_THROW(export_sl1m({broken}, path("b.json")), Error);
  EXPECT_FALSE(std::filesystem::exists(path("b.json")));
}

}  // namespace
}  // namespace octosurf::test
