#include "export_fixture.hpp"
#include "support/full_disk.hpp"

namespace octosurf::test {
namespace {

using enum ExportPart;

/// Fails the test unless `work` throws an Error of this kind, in one line, with a hint.
template <class Work>
void expect_refused(Error::Kind kind, const Work& work, const std::string& what = "") {
  SCOPED_TRACE(what);
  failure(kind, [&] {
    try {
      work();
    } catch (const Error& error) {
      EXPECT_FALSE(error.hint().empty());
      throw;
    }
  });
}

TEST_F(ExportTest, FilesAreReadByPython) {
  write("room.json", {polygons});
  write("all.json", {meshes, convex, points});
  export_surfaces(Snapshot{}, path("empty.json"));
  const Surface& floor = *room_.surfaces[0];
  PolygonEdges edges;
  edges.outer.assign(floor.polygons[0].outer.size(), EdgeKind::real);
  edges.outer[1] = EdgeKind::sensor_limit;
  edges.holes.emplace_back(floor.polygons[0].holes[0].size(), EdgeKind::occluded);
  edges.holes[0].back() = EdgeKind::frontier;
  extras_.edges[floor.id] = {edges};
  write("edges.json", {polygons});
  // Areas by the shoelace formula in 3-D: half the length of the summed cross products.
  std::ofstream(path("read.py")) << R"(
import json, math, os, sys
os.chdir(sys.argv[1])
d = json.load(open('room.json'), parse_constant=lambda c: 1/0)
assert (d['format'], d['version'], d['resolution'], d['revision']) == ('octosurf-surfaces', 1, 0.02, 812)
assert len(d['surfaces']) == 31
def cross(a, b): return [a[1]*b[2]-a[2]*b[1], a[2]*b[0]-a[0]*b[2], a[0]*b[1]-a[1]*b[0]]
def dot(a, b): return sum(x*y for x, y in zip(a, b))
def area(ring, n): return dot(n, [sum(c) for c in zip(*(cross(p, q) for p, q in zip(ring, ring[1:]+ring[:1])))])/2
for i, s in enumerate(d['surfaces']):
    assert set(s) == {'id','color','plane','T_map_surface','area_m2','inliers','rms_m','covariance','normal_std_deg','offset_std_m','revision','parents','polygons','boundary'}
    assert s['id'] == 3*i+2 and s['inliers'] == 100*s['id'] and s['revision'] == 10+s['id']
    assert abs(s['rms_m'] - 0.001*s['id']) < 1e-12 and s['parents'] == ([1, 4] if s['id'] > 4 else [])
    k = s['id']
    assert s['covariance'] == [4e-6*k, 1e-6*k, 0, 1e-6*k, 4e-6*k, 0, 0, 0, 1e-6*k]
    assert abs(s['normal_std_deg'] - math.degrees(math.sqrt(5e-6*k))) < 1e-9, 'along the diagonal'
    assert abs(s['offset_std_m'] - math.sqrt(1e-6*k)) < 1e-12
    assert len(s['color']) == 3 and all(0 <= c <= 1 for c in s['color'])
    n, T = s['plane']['normal'], s['T_map_surface']
    assert len(T) == 16 and T[12:] == [0, 0, 0, 1] and [T[2], T[6], T[10]] == n
    assert abs(dot(n, [T[3], T[7], T[11]]) - s['plane']['offset']) < 1e-12
    total = 0
    for p in s['polygons']:
        assert area(p['outer'], n) > 0 and all(area(h, n) < 0 for h in p['holes'])
        total += area(p['outer'], n) + sum(area(h, n) for h in p['holes'])
        for v in p['outer'] + sum(p['holes'], []):
            assert abs(dot(n, v) - s['plane']['offset']) < 1e-6 and v in s['boundary']
    assert abs(total - s['area_m2']) < 1e-6
floor, window = d['surfaces'][0], d['surfaces'][3]
assert abs(floor['area_m2'] - 23.52) < 1e-9 and len(floor['polygons'][0]['holes']) == 1
assert len(window['polygons']) == 2
assert d['cylinders'] == [{'id': 3, 'axis_point': [5, 1, 1.25], 'axis': [0, 0, 1], 'radius_m': 0.125,
    'length_m': 2.5, 'span_deg': 90, 'start': [0, -1, 0], 'inliers': 1234, 'rms_m': 0.002, 'revision': 17}]
d = json.load(open('all.json'))
for s in d['surfaces']:
    table = s['id'] == 20
    assert len(s['points']) == 2
    assert len(s['convex']) == (1 if table else 0)
    v, six = s['mesh']['vertices'], 0
    directed = set()
    for t in s['mesh']['triangles']:
        a, b, c = (v[i] for i in t)
        six += a[0]*(b[1]*c[2]-b[2]*c[1]) + a[1]*(b[2]*c[0]-b[0]*c[2]) + a[2]*(b[0]*c[1]-b[1]*c[0])
        for e in zip(t, t[1:]+t[:1]):
            assert tuple(e) not in directed
            directed.add(tuple(e))
    assert all((b, a) in directed for a, b in directed)
    assert abs(six/6 - 0.02*s['area_m2']) < 1e-6
table = next(s for s in d['surfaces'] if s['id'] == 20)
assert table['convex'][0]['A'] == [[1, 0], [0, 1], [-1, 0], [0, -1]] and table['convex'][0]['b'] == [1.6, 1, 0, 0]
assert table['convex'][0]['vertices'] == table['polygons'][0]['outer']
assert table['points'] == [[1.7, 1.4, 0.75], [1.8, 1.3, 0.75]]
for s in json.load(open('edges.json'))['surfaces']:
    for p in s['polygons']:
        if s['id'] != 2:
            assert set(p) == {'outer', 'holes'}
            continue
        assert set(p) == {'outer', 'holes', 'outer_edges', 'hole_edges'}
        assert p['outer_edges'] == ['real', 'sensor_limit'] + ['real'] * (len(p['outer']) - 2)
        assert p['hole_edges'] == [['occluded'] * (len(p['holes'][0]) - 1) + ['frontier']]
d = json.load(open('empty.json'))
assert d['surfaces'] == [] and d['cylinders'] == []
)";
  if (std::system("python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "python3 is missing";
  EXPECT_EQ(std::system(("python3 '" + path("read.py").string() + "' '" + folder.string() + "'").c_str()), 0);
}

TEST_F(ExportTest, EdgeLabelsOfOtherPolygonsAreRefused) {
  const Surface& floor = *room_.surfaces[0];
  PolygonEdges edges;
  edges.outer.assign(floor.polygons[0].outer.size(), EdgeKind::real);
  edges.holes.emplace_back(floor.polygons[0].holes[0].size(), EdgeKind::real);
  const auto refused = [&](const std::vector<PolygonEdges>& wrong) {
    ExportOptions options;
    options.edges[floor.id] = wrong;
    expect_refused(Error::Kind::data, [&] { export_surfaces(room_, path("wrong.json"), options); });
    EXPECT_EQ(count_files(), 0U);
  };
  refused({});
  refused({edges, edges});
  refused({{edges.outer, {}}});
  refused({{edges.holes[0], {edges.holes[0], edges.holes[0]}}});
  PolygonEdges shorter = edges;
  shorter.outer.pop_back();
  refused({shorter});
  shorter = edges;
  shorter.holes[0].pop_back();
  refused({shorter});
}

TEST_F(ExportTest, SameInputSameBytes) {
  for (const std::string ending : {".json", ".ply", ".glb"}) {
    export_surfaces(room_, path("a" + ending));
    export_surfaces(make_room(), path("b" + ending));
    EXPECT_EQ(read_file(path("a" + ending)), read_file(path("b" + ending))) << ending;
  }
}

TEST_F(ExportTest, ExistingFileIsKeptUnlessForced) {
  for (const char* name : {"kept.json", "kept.ply", "kept.glb"}) {
    std::ofstream(path(name)) << "precious";
    expect_refused(Error::Kind::usage, [&] { export_surfaces(room_, path(name)); });
    EXPECT_EQ(read_file(path(name)), "precious");
    ExportOptions options;
    options.force = true;
    export_surfaces(room_, path(name), options);
    EXPECT_GT(std::filesystem::file_size(path(name)), 1000u);
  }
}

TEST_F(ExportTest, UnwritablePlaceIsNamed) {
  for (const char* name : {"no/folder.json", "no/folder.ply", "no/folder.glb"}) {
    expect_refused(Error::Kind::output, [&] { export_surfaces(room_, path(name)); });
  }
  ExportOptions options = extras_;
  options.parts = {points};
  expect_refused(Error::Kind::output, [&] { export_surfaces(room_, path("no/folder.ply"), options); });
  options.force = true;
  std::filesystem::create_directory(path("folder.json"));
  expect_refused(Error::Kind::output, [&] { export_surfaces(room_, path("folder.json"), options); });
  std::filesystem::remove(path("folder.json"));
  EXPECT_EQ(count_files(), 0u);  // no temporary file is left
}

TEST_F(ExportTest, FullDiskIsAnErrorAndLeavesNothing) {
  for (const char* name : {"room.json", "room.ply", "room.glb"}) {
    export_surfaces(room_, path(name));
    const std::uintmax_t size = std::filesystem::file_size(path(name));
    for (const auto& entry : std::filesystem::directory_iterator(folder)) std::filesystem::remove(entry);
    for (const std::uintmax_t room : {std::uintmax_t{0}, size / 2, size - 1}) {
      const FullDisk full(room);
      expect_refused(
          Error::Kind::output, [&] { export_surfaces(room_, path(name)); }, name);
      EXPECT_EQ(count_files(), 0u) << name << ", " << room << " of " << size;
    }
  }
}

TEST_F(ExportTest, WrongUseIsNamed) {
  const auto expect_wrong = [&](const char* name, const std::vector<ExportPart>& parts) {
    ExportOptions options = extras_;
    options.parts = parts;
    expect_refused(
        Error::Kind::usage, [&] { export_surfaces(room_, path(name), options); }, name);
  };
  expect_wrong("room.xyz", {polygons});
  expect_wrong("room", {polygons});
  expect_wrong("room.obj", {polygons});
  expect_wrong("room.ply", {polygons, meshes});
  expect_wrong("room.ply", {});
  expect_refused(Error::Kind::data,
                 [&] { export_surfaces(Snapshot{}, path("empty.glb")); });  // nothing in it
  EXPECT_EQ(count_files(), 0u);
}

TEST_F(ExportTest, NumbersThatAreNotFiniteAreRefused) {
  Surface bad = *room_.surfaces[0];
  bad.T_map_surface.translation().x() = std::numeric_limits<double>::quiet_NaN();
  bad.rms_m = std::numeric_limits<double>::infinity();
  Snapshot snapshot;
  snapshot.surfaces.push_back(std::make_shared<const Surface>(bad));
  for (const char* name : {"bad.json", "bad.ply", "bad.glb"}) {
    expect_refused(
        Error::Kind::data, [&] { export_surfaces(snapshot, path(name)); }, name);
  }
  Cylinder bent = *room_.cylinders[0];
  bent.axis.x() = std::numeric_limits<double>::quiet_NaN();
  Snapshot round;
  round.cylinders.push_back(std::make_shared<const Cylinder>(bent));
  expect_refused(Error::Kind::data, [&] { export_surfaces(round, path("bad.json")); });
  EXPECT_EQ(count_files(), 0u);
}

}  // namespace
}  // namespace octosurf::test
