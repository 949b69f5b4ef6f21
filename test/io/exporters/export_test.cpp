// Surfaces as files: read by others' readers, refused where they would be wrong.
#include "io/exporters/export_fixture.hpp"
#include "io/exporters/export_mcap.hpp"
#include "io/readers/bag.hpp"
#include "octosurf_foxglove.pb.h"
#include "support/full_disk.hpp"

#include <nlohmann/json.hpp>
#include <pcl/PolygonMesh.h>
#include <pcl/conversions.h>
#include <pcl/io/ply_io.h>
#include <pcl/point_types.h>
#include <tiny_gltf.h>

namespace octosurf::test {
namespace {

using enum ExportPart;

constexpr double float_noise = 2e-6;  // coordinates up to 6 m as 32-bit floats

Mesh load_ply(const fs::path& file) {
  pcl::PolygonMesh from;
  EXPECT_EQ(pcl::io::loadPLYFile(file.string(), from), 0);
  pcl::PointCloud<pcl::PointXYZ> cloud;
  pcl::fromPCLPointCloud2(from.cloud, cloud);
  Mesh mesh;
  for (const pcl::PointXYZ& p : cloud) mesh.vertices.emplace_back(p.x, p.y, p.z);
  for (const pcl::Vertices& face : from.polygons) {
    EXPECT_EQ(face.vertices.size(), 3u);
    const auto corner = [&](std::size_t i) { return static_cast<std::uint32_t>(face.vertices[i]); };
    mesh.triangles.push_back({corner(0), corner(1), corner(2)});
  }
  return mesh;
}

Eigen::AlignedBox3d bounds_of(const Surface& surface) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3d& v : surface.boundary) box.extend(v);
  return box;
}

void expect_same(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
  EXPECT_LT((a.min() - b.min()).norm() + (a.max() - b.max()).norm(), float_noise);
}

const Eigen::AlignedBox3d room_box(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(6, 4, 2.5));

TEST_F(ExportTest, PlyIsReadByPcl) {
  const Mesh mesh = load_ply(write("flat.ply", {polygons}));
  EXPECT_NEAR(area(mesh), total_area(), 1e-4);
  expect_same(bounds(mesh), room_box);
  pcl::PointCloud<pcl::PointXYZRGB> colored;
  ASSERT_EQ(pcl::io::loadPLYFile(path("flat.ply").string(), colored), 0);
  const Eigen::Array3f color = Eigen::Map<const Eigen::Array3f>(room_.surfaces[0]->color.data());
  EXPECT_LE((Eigen::Array3f(colored[0].r, colored[0].g, colored[0].b) - 255 * color).abs().maxCoeff(), 1);

  const Mesh closed = load_ply(write("closed.ply", {meshes}));
  EXPECT_NEAR(volume(closed), 0.02 * total_area(), 1e-4);
  const Eigen::Vector3d thickness = Eigen::Vector3d::Constant(0.02);  // outward: the room is seen from inside
  expect_same(bounds(closed), {room_box.min() - thickness, room_box.max() + thickness});

  EXPECT_NEAR(area(load_ply(write("convex.ply", {convex}))), 1.6, 1e-5);
}

TEST_F(ExportTest, PlyPointsAreReadByPcl) {
  pcl::PointCloud<pcl::PointXYZRGBL> read;
  ASSERT_EQ(pcl::io::loadPLYFile(write("points.ply", {points}).string(), read), 0);
  ASSERT_EQ(read.size(), 2 * room_.surfaces.size());
  for (std::size_t i = 0; i < read.size(); ++i) {
    const Surface& surface = *room_.surfaces[i / 2];
    EXPECT_EQ(read[i].label, surface.id);
    const Eigen::Vector3d& point = extras_.points[surface.id][i % 2];
    EXPECT_LT((read[i].getVector3fMap().cast<double>() - point).norm(), float_noise);
    EXPECT_NEAR(read[i].g, 255 * surface.color[1], 0.51);
  }
}

/// Accessor `index` as rows of `width` numbers, which may be shorter than a Number.
template <class Number, std::size_t width>
std::vector<std::array<Number, width>> rows_of(const tinygltf::Model& model, int index) {
  const tinygltf::Accessor& accessor = model.accessors.at(static_cast<std::size_t>(index));
  const tinygltf::BufferView& view = model.bufferViews.at(static_cast<std::size_t>(accessor.bufferView));
  const unsigned char* data = model.buffers.at(static_cast<std::size_t>(view.buffer)).data.data() +
                              view.byteOffset + accessor.byteOffset;
  const auto stride = static_cast<std::size_t>(accessor.ByteStride(view));
  const auto component = static_cast<std::uint32_t>(accessor.componentType);
  const auto size = static_cast<std::size_t>(tinygltf::GetComponentSizeInBytes(component));
  EXPECT_EQ(component == TINYGLTF_COMPONENT_TYPE_FLOAT, std::is_floating_point_v<Number>);
  EXPECT_LE(size, sizeof(Number));
  std::vector<std::array<Number, width>> rows(accessor.count);
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t k = 0; k < width; ++k) std::memcpy(&rows[i][k], data + i * stride + k * size, size);
  return rows;
}

Mesh from_gltf(const tinygltf::Model& model, const tinygltf::Primitive& primitive) {
  Mesh mesh;
  for (const auto& [x, y, z] : rows_of<float, 3>(model, primitive.attributes.at("POSITION")))
    mesh.vertices.emplace_back(x, y, z);
  if (primitive.mode != TINYGLTF_MODE_TRIANGLES) return mesh;
  const auto indices = rows_of<std::uint32_t, 1>(model, primitive.indices);
  for (std::size_t i = 0; i + 2 < indices.size(); i += 3)
    mesh.triangles.push_back({indices[i][0], indices[i + 1][0], indices[i + 2][0]});
  return mesh;
}

tinygltf::Model load_glb(const fs::path& file) {
  tinygltf::TinyGLTF loader;
  tinygltf::Model model;
  std::string error, warning;
  EXPECT_TRUE(loader.LoadBinaryFromFile(&model, &error, &warning, file.string())) << error;
  EXPECT_EQ(error + warning, "");
  return model;
}

TEST_F(ExportTest, GlbIsReadByTinygltf) {
  for (const ExportPart part : {polygons, meshes}) {
    const bool closed = part == meshes;
    const tinygltf::Model model = load_glb(write(closed ? "closed.glb" : "flat.glb", {part}));
    ASSERT_EQ(model.meshes.size(), room_.surfaces.size());
    std::size_t found = 0;
    for (const tinygltf::Node& node : model.nodes) {
      if (node.mesh < 0) continue;
      const Surface& surface = *room_.surfaces.at(found++);
      EXPECT_EQ(node.name, "surface_" + std::to_string(surface.id));
      EXPECT_TRUE(node.matrix.empty());
      const auto& primitives = model.meshes.at(static_cast<std::size_t>(node.mesh)).primitives;
      ASSERT_EQ(primitives.size(), 1u);
      const Mesh mesh = from_gltf(model, primitives[0]);
      if (closed) {
        EXPECT_NEAR(volume(mesh), 0.02 * surface.area_m2, 1e-5);
      } else {
        EXPECT_NEAR(area(mesh), surface.area_m2, 1e-5);
        expect_same(bounds(mesh), bounds_of(surface));
      }
      const auto& material = model.materials.at(static_cast<std::size_t>(primitives[0].material));
      EXPECT_TRUE(material.doubleSided);
      for (std::size_t c = 0; c < 3; ++c) {  // glTF's factors are linear: back by the sRGB curve
        const double linear = material.pbrMetallicRoughness.baseColorFactor.at(c);
        EXPECT_NEAR(1.055 * std::pow(linear, 1 / 2.4) - 0.055, surface.color[c], 1e-3);
      }
    }
    EXPECT_EQ(found, room_.surfaces.size());
  }
}

TEST_F(ExportTest, GlbStandsUpright) {
  ExportOptions options = extras_;
  options.force = true;
  for (const Eigen::Vector3d& z : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.2, -0.9, -0.4)}) {
    options.up = z;
    export_surfaces(room_, path("room.glb"), options);
    const tinygltf::Model model = load_glb(path("room.glb"));
    ASSERT_EQ(model.scenes.size(), 1u);
    ASSERT_EQ(model.scenes[0].nodes.size(), 1u);
    const tinygltf::Node& root = model.nodes.at(static_cast<std::size_t>(model.scenes[0].nodes[0]));
    EXPECT_EQ(root.children.size(), room_.surfaces.size());
    ASSERT_EQ(root.matrix.size(), 16u);
    const Eigen::Map<const Eigen::Matrix4d> matrix(root.matrix.data());  // column-major, as Eigen
    Eigen::Vector4d up(0, 0, 0, 0);
    up.head<3>() = z.normalized();
    EXPECT_LT((matrix * up - Eigen::Vector4d(0, 1, 0, 0)).norm(), 1e-6);  // glTF's up is y
    EXPECT_NEAR(matrix.determinant(), 1, 1e-6);
  }
  options.up.setZero();
  EXPECT_THROW(export_surfaces(room_, path("room.glb"), options), Error);
}

TEST_F(ExportTest, AnOriginStandsOnceInGlbAndJson) {
  ExportOptions options = extras_;
  options.origin = {448000.25, 5411000, 120};
  for (const char* ending : {".glb", ".json"}) {
    export_surfaces(room_, path(std::string("far") + ending), options);
    export_surfaces(room_, path(std::string("near") + ending), extras_);
  }
  const tinygltf::Model far = load_glb(path("far.glb")), near = load_glb(path("near.glb"));
  const auto extras = [](const tinygltf::Model& model) {
    return model.nodes.at(static_cast<std::size_t>(model.scenes[0].nodes[0])).extras;
  };
  ASSERT_TRUE(extras(far).Has("origin"));
  for (int i = 0; i < 3; ++i)
    EXPECT_EQ(extras(far).Get("origin").Get(i).GetNumberAsDouble(), options.origin[i]);
  EXPECT_FALSE(extras(near).Has("origin"));
  EXPECT_EQ(far.meshes.size(), near.meshes.size());
  EXPECT_EQ(far.buffers.at(0).data, near.buffers.at(0).data);
  auto far_json = nlohmann::json::parse(read_file(path("far.json")));
  EXPECT_EQ(far_json.at("origin"), nlohmann::json({448000.25, 5411000.0, 120.0}));
  far_json.erase("origin");
  EXPECT_EQ(far_json, nlohmann::json::parse(read_file(path("near.json"))));
}

TEST_F(ExportTest, GlbPointsAreReadByTinygltf) {
  const tinygltf::Model model = load_glb(write("points.glb", {points}));
  ASSERT_EQ(model.meshes.size(), room_.surfaces.size());
  for (std::size_t i = 0; i < model.meshes.size(); ++i) {
    ASSERT_EQ(model.meshes[i].primitives.size(), 1u);
    EXPECT_EQ(model.meshes[i].primitives[0].mode, TINYGLTF_MODE_POINTS);
    const Mesh mesh = from_gltf(model, model.meshes[i].primitives[0]);
    ASSERT_EQ(mesh.vertices.size(), 2u);
    EXPECT_LT((mesh.vertices[0] - extras_.points[room_.surfaces[i]->id][0]).norm(), float_noise);
  }
}

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
    assert set(s) == {'id','color','plane','T_map_surface','area_m2','inliers','rms_m','covariance','normal_std_deg','offset_std_m','revision','parents','polygons','gaps','boundary'} and s['gaps'] == []
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
assert all(set(p) == {'outer', 'holes'} for s in d['surfaces'] for p in s['polygons'])
d = json.load(open('empty.json'))
assert d['surfaces'] == [] and d['cylinders'] == []
)";
  if (std::system("python3 -c '' 2>/dev/null") != 0) GTEST_SKIP() << "python3 is missing";
  EXPECT_EQ(std::system(("python3 '" + path("read.py").string() + "' '" + folder.string() + "'").c_str()), 0);
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
    EXPECT_GT(fs::file_size(path(name)), 1000u);
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
  fs::create_directory(path("folder.json"));
  expect_refused(Error::Kind::output, [&] { export_surfaces(room_, path("folder.json"), options); });
  fs::remove(path("folder.json"));
  EXPECT_EQ(count_files(), 0u);  // no temporary file is left
}

TEST_F(ExportTest, FullDiskIsAnErrorAndLeavesNothing) {
  for (const char* name : {"room.json", "room.ply", "room.glb"}) {
    export_surfaces(room_, path(name));
    const std::uintmax_t size = fs::file_size(path(name));
    for (const auto& entry : fs::directory_iterator(folder)) fs::remove(entry);
    for (const std::uintmax_t room : {std::uintmax_t{0}, size / 2, size - 1}) {
      const FullDisk full(room);
      expect_refused(
          Error::Kind::output, [&] { export_surfaces(room_, path(name)); }, name);
      EXPECT_EQ(count_files(), 0u) << name << ", " << room << " of " << size;
    }
  }
}

TEST_F(ExportTest, WrongUseIsNamed) {
  for (const auto& [name, parts] :
       std::vector<std::pair<const char*, std::vector<ExportPart>>>{{"room.xyz", {polygons}},
                                                                    {"room", {polygons}},
                                                                    {"room.obj", {polygons}},
                                                                    {"room.ply", {polygons, meshes}},
                                                                    {"room.ply", {}}}) {
    ExportOptions options = extras_;
    options.parts = parts;
    expect_refused(
        Error::Kind::usage, [&] { export_surfaces(room_, path(name), options); }, name);
  }
  expect_refused(Error::Kind::data,
                 [&] { export_surfaces(Snapshot{}, path("empty.glb")); });  // nothing in it
  EXPECT_EQ(count_files(), 0u);
}

TEST_F(ExportTest, NumbersThatAreNotFiniteAreRefused) {
  Surface bad = *room_.surfaces[0];
  bad.T_map_surface.translation().x() = std::numeric_limits<double>::quiet_NaN();
  bad.rms_m = std::numeric_limits<double>::infinity();
  Cylinder bent = *room_.cylinders[0];
  bent.axis.x() = std::numeric_limits<double>::quiet_NaN();
  Snapshot flat, round;
  flat.surfaces.push_back(std::make_shared<const Surface>(bad));
  round.cylinders.push_back(std::make_shared<const Cylinder>(bent));
  for (const char* name : {"bad.json", "bad.ply", "bad.glb"})
    expect_refused(
        Error::Kind::data, [&] { export_surfaces(flat, path(name)); }, name);
  expect_refused(Error::Kind::data, [&] { export_surfaces(round, path("bad.json")); });
  EXPECT_EQ(count_files(), 0u);
}

// MCAP files as our own reader finds them, and the messages in them. test/peers/mcap_test.py reads them with
// MCAP's own library.

using ::testing::Pair;

struct Message {
  std::string topic;
  std::uint64_t time_ns = 0;
  std::string bytes;
  bool operator==(const Message&) const = default;
};

class McapExport : public ExportTest {
 protected:
  template <class Fill>
  std::vector<Message> written(const Fill& fill) const {
    std::ofstream out(path("log.mcap"), std::ios::binary);
    fill(out);
    out.close();
    return read();
  }
  std::vector<Message> read() const {
    const auto bag = io::open_mcap(path("log.mcap"));
    std::vector<Message> all;
    std::vector<io::MessagePlace> places;
    bag->read_all(
        [&](const io::BagMessage& message) {
          all.push_back({bag->topics()[message.topic].name, static_cast<std::uint64_t>(message.logged_ns),
                         std::string(message.bytes)});
          places.push_back(message.place);
        },
        nullptr);
    for (std::size_t i = all.size(); i-- > 0;) EXPECT_EQ(bag->read(places[i]), all[i].bytes);
    return all;
  }
  /// Of the messages on a topic.
  template <class Proto>
  static std::vector<Proto> parsed(const std::vector<Message>& messages, const std::string& topic) {
    std::vector<Proto> all;
    for (const Message& message : messages)
      if (message.topic == topic) {
        EXPECT_TRUE(all.emplace_back().ParseFromString(message.bytes));
      }
    return all;
  }
};

TEST_F(McapExport, MessagesComeBackAsTheyWereWritten) {
  EXPECT_TRUE(written([](std::ostream& out) { io::write_mcap(out, {}, ""); }).empty());
  std::mt19937_64 random = rng();
  std::vector<Message> wanted;
  for (int i = 0; i < 60; ++i) {
    // Some do not compress.
    std::string bytes(random() % (i % 10 == 0 ? 3'000'000 : 300'000), static_cast<char>(i));
    if (i % 2 == 0)
      for (char& byte : bytes) byte = static_cast<char>(random());
    wanted.push_back({i % 3 == 0 ? "/a" : "/b", random() % 1'000'000'000'000, bytes});
  }
  const std::vector<Message> found = written([&](std::ostream& out) {
    std::vector<io::McapMessage> messages;
    for (const Message& message : wanted)
      messages.push_back({message.topic, "some.Type", message.time_ns, message.bytes});
    io::write_mcap(out, messages, "");
  });
  EXPECT_TRUE(found == wanted);
  std::fstream(path("log.mcap"), std::ios::in | std::ios::out | std::ios::binary)
      .seekp(2'000'000)
      .put(0)
      .put(1);
  EXPECT_THROW(read(), Error) << "check sums see what is changed later";
}

TEST_F(McapExport, ASurfaceIsItsTrianglesWithoutItsHoles) {
  const auto messages = written([&](std::ostream& out) {
    io::write_foxglove(out, room_, Eigen::Vector3d::UnitZ(), {{7.25, Eigen::Isometry3d::Identity()}});
  });
  ASSERT_EQ(messages.size(), 3U) << "a pose twice";
  EXPECT_EQ(messages[0].time_ns, 7'250'000'000U);
  const auto update = parsed<foxglove::SceneUpdate>(messages, "/surfaces").at(0);
  ASSERT_EQ(update.entities_size(), static_cast<int>(room_.surfaces.size() + room_.cylinders.size()));
  for (int i = 0; i < update.entities_size() - 1; ++i) {
    const Surface& surface = *room_.surfaces[static_cast<std::size_t>(i)];
    const foxglove::SceneEntity& entity = update.entities(i);
    EXPECT_EQ(entity.id(), "surface_" + std::to_string(surface.id));
    EXPECT_EQ(entity.frame_id(), "map");
    const foxglove::TriangleListPrimitive& list = entity.triangles(0);
    EXPECT_EQ(list.pose().orientation().w(), 1);
    EXPECT_EQ(static_cast<float>(list.color().g()), surface.color[1]);
    EXPECT_EQ(list.color().a(), 1);
    Mesh mesh;
    for (const auto& point : list.points()) mesh.vertices.emplace_back(point.x(), point.y(), point.z());
    for (int k = 0; k < list.indices_size(); k += 3)
      mesh.triangles.push_back({list.indices(k), list.indices(k + 1), list.indices(k + 2)});
    EXPECT_NEAR(area(mesh), surface.area_m2, 1e-9) << entity.id();
    for (const Eigen::Vector3d& vertex : mesh.vertices)
      EXPECT_NEAR(surface.plane.signed_distance(vertex), 0, 1e-9);
  }
  std::map<std::string, std::string> wall;
  for (const auto& pair : update.entities(2).metadata()) wall[pair.key()] = pair.value();
  EXPECT_THAT(wall, ElementsAre(Pair("area_m2", "15"), Pair("inliers", "800"), Pair("rms_m", "0.008"),
                                Pair("slope_deg", "90")));
  const foxglove::CylinderPrimitive& pillar = update.entities(update.entities_size() - 1).cylinders(0);
  EXPECT_EQ(pillar.size().x(), 0.25);
  EXPECT_EQ(pillar.size().z(), 2.5);
  EXPECT_EQ(pillar.pose().position().z(), 1.25);
}

TEST_F(McapExport, TimeNeverGoesBack) {
  std::vector<io::StampedPose> poses;
  for (const double stamp_s : {-3.0, 5.0, 4.9, 5.1})
    poses.emplace_back(stamp_s, Eigen::Isometry3d::Identity());
  const std::vector<Message> messages =
      written([&](std::ostream& out) { io::write_foxglove(out, {}, Eigen::Vector3d::UnitZ(), poses); });
  std::vector<std::uint64_t> times;
  for (const Message& message : messages)
    if (message.topic == "/tf") times.push_back(message.time_ns);
  EXPECT_THAT(times, ElementsAre(0U, 5'000'000'000U, 5'000'000'000U, 5'100'000'000U));
  EXPECT_EQ(parsed<foxglove::FrameTransform>(messages, "/tf").at(3).timestamp().nanos(), 100'000'000);
}

}  // namespace
}  // namespace octosurf::test
