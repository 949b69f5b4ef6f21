"""The node of ros/octosurf_ros beside rclpy over Fast DDS: a robot's topics in, the map's topics and services out."""
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

import ros_workspace

ros_workspace.make(pathlib.Path(sys.prefix))
os.environ.update(ROS_DOMAIN_ID=str(1 + os.getpid() % 100), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST", AMENT_PREFIX_PATH=sys.prefix)

import octosurf
import rclpy
from convex_plane_decomposition_msgs.msg import PlanarTerrain
from geometry_msgs.msg import Point, TransformStamped, Vector3
from grid_map_msgs.msg import GridMap
from octomap_msgs.msg import Octomap
from octosurf_msgs import srv
from octosurf_msgs.msg import Stairs, Status, Surfaces
from rcl_interfaces.srv import DescribeParameters
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message
from rosbags.rosbag2 import Writer
from rosbags.typesys import Stores, get_typestore
from sensor_msgs.msg import CameraInfo, Image, PointCloud2, PointField
from std_msgs.msg import Float32MultiArray
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SENSOR = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
RELIABLE = QoSProfile(depth=1000)
IMAGES, CLOUDS, START = "/camera/depth/image", "/lidar/points", 1_700_000_000
OUT = {"surfaces": Surfaces, "stairs": Stairs, "markers": MarkerArray, "planar_terrain": PlanarTerrain,
       "octomap_binary": Octomap, "grid_map": GridMap, "status": Status, "heights": Float32MultiArray, "patch": GridMap}
SERVICES = ("save", "load", "query", "contact_regions", "plan", "changes", "publish", "clear")


def until(condition, seconds=60):
    """What it gives once that is true; the robot listens meanwhile."""
    end = time.monotonic() + seconds
    while not (given := condition()) and time.monotonic() < end:
        Room.executor.spin_once(timeout_sec=0.02)
    return given


def seen(origin, rays):
    """Distances along rays to a floor at 0 and a step of 0.2 m over x > 1."""
    with np.errstate(divide="ignore", invalid="ignore"):
        floor, top, riser = -origin[2] / rays[..., 2], (0.2 - origin[2]) / rays[..., 2], (1 - origin[0]) / rays[..., 0]
        on_top = (top > 0) & (origin[0] + top * rays[..., 0] > 1)
        height = origin[2] + riser * rays[..., 2]
        at_riser = (riser > 0) & (height > 0) & (height < 0.2) & ~on_top
    return np.where(on_top, top, np.where(at_riser, riser, np.where(floor > 0, floor, 0)))


def stamped(header, frame, stamp):
    header.frame_id, header.stamp.sec, header.stamp.nanosec = frame, int(stamp // 10**9), int(stamp % 10**9)


def transform(parent, child, stamp, at, turn=(0.0, 0.0, 0.0, 1.0)):
    one = TransformStamped(child_frame_id=child)
    stamped(one.header, parent, stamp)
    for part, values in ((one.transform.translation, at), (one.transform.rotation, turn)):
        for name, value in zip("xyzw", values):
            setattr(part, name, float(value))
    return one


def recording(lidar=False, count=6):
    """(topic, stamp, message) of a walk toward the step: base in map, and a sensor on it, by a chain of transforms."""
    half = np.sqrt(0.5)
    down = np.array([0.0, np.sin(0.4), 0.0, np.cos(0.4)])  # 46 degrees, about y
    optical = np.array([-0.5, 0.5, -0.5, 0.5])  # z forward, x right
    yield "/tf_static", START * 10**9, TFMessage(transforms=[
        transform("base_link", "neck", START * 10**9, (0.2, 0, 0), down),
        transform("neck", "camera_optical_frame" if not lidar else "lidar", START * 10**9, (0, 0, 0), optical if not lidar else (0, 0, 0, 1))])
    c, s = np.cos(0.8), np.sin(0.8)
    R_base_neck = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    R_neck_optical = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    for i in range(count):
        stamp = START * 10**9 + (i + 1) * 33_333_333
        base = np.array([0.1 * i, 0.05 * i, 1.2])
        yield "/tf", stamp, TFMessage(transforms=[transform("map", "base_link", stamp, base)])
        if lidar:
            yaw, pitch = np.meshgrid(np.linspace(-1.2, 1.2, 160), np.linspace(-0.6, 0.8, 100))
            rays = np.stack([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), -np.sin(pitch)], -1)
            points = (rays * seen(base + [0.2, 0, 0], rays @ R_base_neck.T)[..., None]).reshape(-1, 3).astype("<f4")
            cloud = PointCloud2(width=len(points), height=1, point_step=12, row_step=12 * len(points), data=points.tobytes(),
                                fields=[PointField(name=n, offset=4 * k, datatype=PointField.FLOAT32, count=1) for k, n in enumerate("xyz")])
            stamped(cloud.header, "lidar", stamp)
            yield CLOUDS, stamp, cloud
            continue
        camera = CameraInfo(width=160, height=120, k=[120.0, 0.0, 79.5, 0.0, 120.0, 59.5, 0.0, 0.0, 1.0], distortion_model="plumb_bob")
        u, v = np.meshgrid(np.arange(160), np.arange(120))
        rays = np.stack([(u - 79.5) / 120, (v - 59.5) / 120, np.ones(u.shape)], -1)
        depth = np.round(seen(base + [0.2, 0, 0], rays @ (R_base_neck @ R_neck_optical).T) * 1000)
        image = Image(width=160, height=120, encoding="16UC1", step=320, data=np.where(depth < 8000, depth, 0).astype("<u2").tobytes())
        stamped(camera.header, "camera_optical_frame", stamp)
        stamped(image.header, "camera_optical_frame", stamp)
        yield IMAGES.replace("image", "camera_info"), stamp, camera
        yield IMAGES, stamp, image


class Room(unittest.TestCase):
    """A robot, the node, and a folder for its maps."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="octosurf-ros-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        rclpy.init()
        cls.robot = rclpy.create_node("robot")
        Room.executor = rclpy.executors.SingleThreadedExecutor()
        cls.executor.add_node(cls.robot)
        cls.publishers, cls.node, cls.log = {}, None, ""

    @classmethod
    def tearDownClass(cls):
        cls.stop(signal.SIGKILL)
        rclpy.shutdown()

    @classmethod
    def start(cls, **parameters):
        words = [sys.executable, "-c", "from octosurf_ros.node import main; main()", "--ros-args"]
        usual = {"output": cls.folder / "live", "resolution": 0.05, "detection_budget": 0, "publish": 0.05}
        for name, value in {**usual, **parameters}.items():
            words += ["-p", f"{name}:={value}"]
        path = f"{os.environ['PYTHONPATH']}:{os.environ['OCTOSURF_SOURCE']}/ros/octosurf_ros"
        cls.errors = open(cls.folder / "log", "w+")
        cls.node = subprocess.Popen(words, env={**os.environ, "PYTHONPATH": path}, stderr=cls.errors)
        cls.status = cls.hear("status")

    @classmethod
    def stop(cls, how=signal.SIGINT):
        if cls.node:
            cls.node.send_signal(how)
            cls.node.wait(60)
            cls.node = None
            cls.robot.destroy_subscription(cls.status[1])

    @classmethod
    def said(cls):
        return (cls.folder / "log").read_text()

    @classmethod
    def hear(cls, topic, qos=LATCHED):
        """A list of the messages, as bytes, and the subscription."""
        messages = []
        return messages, cls.robot.create_subscription(OUT[topic], "/octosurf/" + topic, messages.append, qos, raw=True)

    def latched(self, topic):
        """What one who comes now gets."""
        messages, subscription = self.hear(topic)
        self.assertTrue(until(lambda: messages), topic + self.said())
        self.robot.destroy_subscription(subscription)
        return messages[-1]

    @classmethod
    def now(cls):
        return deserialize_message(cls.status[0][-1], Status) if cls.status[0] else Status()

    def meet(self, messages):
        """Publishers, each spoken with until the node has heard it: what was sent before they knew each other is the past."""
        first = {}
        for topic, _, message in messages:
            first.setdefault(topic, message)
        for topic, message in first.items():
            if topic not in self.publishers:
                qos = LATCHED if topic == "/tf_static" else RELIABLE
                self.publishers[topic] = self.robot.create_publisher(type(message), topic, qos)
        scans = IMAGES if IMAGES in first else CLOUDS

        def heard():
            self.publishers["/tf"].publish(TFMessage())
            self.publishers["/tf_static"].publish(first["/tf_static"])
            if scans == IMAGES:
                self.publishers[IMAGES.replace("image", "camera_info")].publish(first[IMAGES.replace("image", "camera_info")])
            self.publishers[scans].publish(type(first[scans])())  # of nothing: it is refused
            until(lambda: False, 0.2)
            return self.now().transforms > 1 and self.now().refused and "CameraInfo" not in self.now().last_refusal

        self.assertTrue(until(heard), self.said())
        self.assertTrue(until(lambda: not self.now().waiting))

    def play(self, messages, mapped=None, shift=0):
        """As drivers do; waits until so many scans are mapped in all."""
        for topic, _, message in messages:
            if shift:
                for header in [one.header for one in message.transforms] if hasattr(message, "transforms") else [message.header]:
                    header.stamp.sec += shift
            self.publishers[topic].publish(message)
        if mapped is not None:
            self.assertTrue(until(lambda: self.now().mapped >= mapped and not self.now().waiting), f"{self.now()} {self.said()}")

    def forget_publishers(self):
        for one in self.publishers.values():
            self.robot.destroy_publisher(one)
        self.publishers.clear()

    def call(self, service, **request):
        kind = getattr(srv, "".join(word.title() for word in service.split("_")))
        client = self.robot.create_client(kind, "/octosurf/" + service)
        self.assertTrue(client.wait_for_service(30), service)
        answer = client.call_async(kind.Request(**request))
        self.assertTrue(until(answer.done), service + self.said())
        self.robot.destroy_client(client)
        return answer.result()

    def offline(self, name, messages, *options):
        """What `octosurf map` makes of a bag of the messages."""
        types = get_typestore(Stores.ROS2_HUMBLE)
        with Writer(self.folder / (name + "_bag"), version=9) as bag:
            topics = {}
            for topic, stamp, message in messages:
                if topic not in topics:
                    package = type(message).__module__.split(".")[0]
                    topics[topic] = bag.add_connection(topic, f"{package}/msg/{type(message).__name__}", typestore=types)
                bag.write(topics[topic], stamp, serialize_message(message))
        subprocess.run([os.environ["OCTOSURF"], "map", self.folder / (name + "_bag"), "-o", self.folder / name, "--resolution", "0.05",
                        "--detection-budget", "0", *options], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def assert_same_map(self, name):
        for ending in (".surfaces", ".bt"):
            self.assertEqual((self.folder / ("live" + ending)).read_bytes(), (self.folder / (name + ending)).read_bytes(), ending)


class Mapping(Room):
    """Each test has a node of its own, which may not hear the last one's publishers."""

    def tearDown(self):
        self.stop(signal.SIGKILL)
        self.forget_publishers()
        for file in self.folder.glob("live*"):
            file.unlink()

    def test_is_killed_and_goes_on_to_the_map_of_the_recording(self):
        walk = list(recording())
        first = [i for i, one in enumerate(walk) if one[0] == IMAGES][3] + 1
        self.offline("offline", walk)
        self.start(depth=IMAGES, reliable=True, checkpoint=0.0)
        self.meet(walk)
        self.play(walk[:first], 4)
        self.assertTrue(self.call("save").success)
        self.stop(signal.SIGKILL)
        self.start(depth=IMAGES, resume=True)
        self.meet(walk)
        self.play(walk[first:], 2)
        self.stop()
        self.assert_same_map("offline")

    def test_maps_clouds_without_the_robot_itself(self):
        walk = list(recording(lidar=True, count=4))
        box = "base_link -1 -1 -2 1.2 1 1"
        self.offline("boxed", walk, "--self-box", *box.split())
        self.start(cloud=CLOUDS, reliable=True, self_box=f'["{box}"]')
        self.meet(walk)
        self.play(walk, 4)
        self.stop()
        self.assert_same_map("boxed")

    def test_goes_on_when_publishers_restart_and_the_clock_goes_back(self):
        self.start(depth=IMAGES, reliable=True)
        self.meet(recording())
        self.play(recording(), 6)
        self.forget_publishers()
        self.assertTrue(until(lambda: self.now().scan_publishers == 0))
        self.meet(recording())
        self.play(recording(), 12, shift=-100)
        self.assertIn("time was set back by 1", self.said())

    def test_refuses_what_is_broken_and_nothing_is_lost(self):
        walk = list(recording())
        self.offline("whole", walk)
        self.start(depth=IMAGES, reliable=True, wait=0.2)
        self.meet(walk)
        self.play(walk[:4], 1)
        whole = serialize_message(walk[3][2])
        for place, kind, value, words in ((None, "", None, "too early"), ("encoding", "", "rgb8", "rgb8"), ("height", "", 121, "camera"),
                                          ("header", "", ("nowhere", START * 10**9), "nowhere"), ("header", "", ("camera_optical_frame", 1), "pose")):
            bad = deserialize_message(whole, Image)
            if place == "header":
                stamped(bad.header, *value)
            elif place:
                setattr(bad, place, value)
            before = self.now().refused
            self.publishers[IMAGES].publish(bad if place else whole[:-1000])
            self.assertTrue(until(lambda: self.now().refused == before + 1), words + self.said())
            self.assertIn(words, self.now().last_refusal)
        self.publishers["/tf"].publish(TFMessage(transforms=[transform("map", "base_link", START, (np.nan, 0, 0))]))
        self.assertTrue(until(lambda: self.now().messages_refused == 1))
        self.play(walk[4:], 6)
        self.stop()
        self.assert_same_map("whole")

    def test_names_what_it_does_not_hear(self):
        images = self.robot.create_publisher(Image, IMAGES, SENSOR)
        self.addCleanup(self.robot.destroy_publisher, images)
        self.start(depth=IMAGES, reliable=True, tf="/robot/tf")
        self.assertTrue(until(lambda: "RELIABILITY" in self.said()), self.said())
        self.assertTrue(until(lambda: "no publisher of /robot/tf_static or /robot/tf" in self.said()), self.said())

    def test_beyond_the_queue_the_oldest_make_way(self):
        walk = list(recording())
        self.start(depth=IMAGES, reliable=True, queue=1, wait=60.0)
        self.meet(walk)
        for k in range(40):  # of 38 kB, and the first waits for its pose
            before = self.now().received
            self.publishers[IMAGES].publish(walk[3][2])
            self.assertTrue(until(lambda: self.now().received > before), k)
        self.assertEqual((self.now().dropped, self.now().waiting), (12, 27))

    def test_says_what_is_wrong_with_its_use(self):
        (self.folder / "there.surfaces").write_text("")
        for wrong in ({}, {"depth": "/d", "cloud": "/c"}, {"cloud": "/c", "hit": -1}, {"cloud": "/c", "output": self.folder / "there"},
                      {"cloud": "/c", "self_box": '["1 2 3"]'}, {"cloud": "/c", "max_slope": 100.0}):
            self.start(**wrong)
            self.assertEqual(self.node.wait(30), 1, wrong)
            self.assertNotEqual(self.said(), "")


class Map(Room):
    """A node that has mapped a walk, and is asked."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.start(depth=IMAGES, reliable=True, foot_radius=0.05, max_slope=20.0, clearance=0.3, radius=3.0, patch_cell=0.1)
        room = cls("offline")
        walk = list(recording())
        room.meet(walk)
        room.play(walk, 6)
        room.offline("offline", walk)
        cls.map = octosurf.load(cls.folder / "offline")
        cls.snapshot = cls.map.snapshot()
        cls.stamp = walk[-1][2].header.stamp

    def test_topics_and_services_have_their_names_types_and_qos(self):
        for topic, kind in OUT.items():
            info, = until(lambda: self.robot.get_publishers_info_by_topic("/octosurf/" + topic))
            self.assertEqual(info.topic_type.split("/")[-1], kind.__name__)
            latched = topic not in ("heights", "patch")
            self.assertEqual(info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL, latched, topic)
            self.assertEqual(info.qos_profile.reliability == ReliabilityPolicy.RELIABLE, latched, topic)
        heard = {name: self.robot.get_subscriptions_info_by_topic(name)[0].qos_profile for name in ("/tf", "/tf_static", IMAGES)}
        self.assertEqual(heard["/tf_static"].durability, DurabilityPolicy.TRANSIENT_LOCAL)
        self.assertEqual(heard["/tf"].durability, DurabilityPolicy.VOLATILE)
        services = dict(self.robot.get_service_names_and_types_by_node("octosurf", "/"))
        for name in SERVICES:
            kind = "".join(word.title() for word in name.split("_"))
            self.assertEqual(services["/octosurf/" + name], ["octosurf_msgs/srv/" + kind])

    def test_parameters_have_types_and_ranges(self):
        client = self.robot.create_client(DescribeParameters, "/octosurf/describe_parameters")
        self.assertTrue(client.wait_for_service(30))
        answer = client.call_async(DescribeParameters.Request(names=["max_slope", "queue", "depth", "resolution"]))
        self.assertTrue(until(answer.done))
        slope, queue, depth, resolution = answer.result().descriptors
        self.assertEqual([one.type for one in (slope, queue, depth)], [3, 2, 4])
        self.assertEqual((slope.floating_point_range[0].to_value, queue.integer_range[0].from_value), (80, 1))
        self.assertTrue(resolution.dynamic_typing and slope.read_only)

    def test_what_is_published_is_the_offline_map(self):
        surfaces = deserialize_message(self.latched("surfaces"), Surfaces)
        self.assertEqual((surfaces.header.frame_id, surfaces.header.stamp, surfaces.revision), ("map", self.stamp, self.snapshot.revision))
        self.assertGreater(len(surfaces.surfaces), 1)
        for one, of in zip(surfaces.surfaces, self.snapshot.surfaces, strict=True):
            self.assertEqual((one.id, one.area, one.offset, one.inliers), (of.id, of.area_m2, of.plane.offset, of.inliers))
            ring = np.array([(p.x, p.y, p.z) for p in one.polygons[0].outer.points])
            np.testing.assert_array_equal(ring, of.to_map(of.polygons[0].outer))
            np.testing.assert_array_equal(one.covariance, of.covariance.ravel())
            q = one.pose.orientation
            placed = octosurf.pose_from_transform([one.pose.position.x, one.pose.position.y, one.pose.position.z], [q.x, q.y, q.z, q.w])
            np.testing.assert_allclose(placed, of.T_map_surface, atol=1e-12)
        stairs = deserialize_message(self.latched("stairs"), Stairs)
        self.assertEqual((len(stairs.stairs), len(stairs.single_steps)), (0, 1))  # the step
        self.assertAlmostEqual(stairs.single_steps[0].riser, 0.2, delta=0.01)
        markers = deserialize_message(self.latched("markers"), MarkerArray).markers
        self.assertEqual([one.action for one in markers], [3] + [0] * len(self.snapshot))
        self.assertEqual([len(one.points) % 3 for one in markers[1:]], [0] * len(self.snapshot))
        octomap = deserialize_message(self.latched("octomap_binary"), Octomap)
        self.assertEqual((octomap.binary, octomap.id, octomap.resolution, octomap.header.stamp), (True, "OcTree", 0.05, self.stamp))
        self.assertTrue((self.folder / "offline.bt").read_bytes().endswith(b"data\n" + octomap.data.tobytes()))

    def test_grid_map_and_terrain_are_the_librarys(self):
        rules = octosurf.GroundRules.of(octosurf.Quadruped(), 0.05)
        rules.foot = octosurf.ContactShape.disc(0.05)
        rules.limits.max_slope_rad, rules.limits.clearance_m, rules.limits.up = np.radians(20), 0.3, np.array([0.0, 0.0, 1.0])
        ground = octosurf.GroundView(self.snapshot, self.map.octree(), rules)
        stamp = self.stamp.sec * 10**9 + self.stamp.nanosec
        grid = deserialize_message(self.latched("grid_map"), GridMap)
        self.assertEqual(grid.layers, ["elevation", "normal_x", "normal_y", "normal_z", "surface_id"])
        heights = np.array(grid.data[0].data)
        self.assertEqual(len(heights), grid.data[0].layout.dim[0].stride)
        self.assertEqual(sorted(set(np.round(heights[np.isfinite(heights)], 1))), [0, np.float32(0.2)])
        terrain = deserialize_message(self.latched("planar_terrain"), PlanarTerrain)
        self.assertEqual(terrain.gridmap.header.stamp, self.stamp)
        surfaces = octosurf.planner_surfaces(ground.solid(), rules.foot, limits=rules.limits, octree=self.map.octree())
        within = (np.array([grid.info.pose.position.x, grid.info.pose.position.y])
                  + np.outer([-0.5, 0.5], [grid.info.length_x, grid.info.length_y]))
        expected = octosurf.planar_terrain_message(
            surfaces, octosurf.height_grid(ground.solid(), cell=0.05, max_slope_rad=np.radians(20), within=tuple(within)), "map", stamp)
        self.assertEqual(len(terrain.planar_regions), len(deserialize_message(expected, PlanarTerrain).planar_regions))

    def test_patches_have_the_ground_about_the_base(self):
        (patches, one), (heights, other) = self.hear("patch", SENSOR), self.hear("heights", SENSOR)
        self.assertTrue(until(lambda: len(patches) > 2 and len(heights) > 2), self.said())
        self.robot.destroy_subscription(one)
        self.robot.destroy_subscription(other)
        patch, flat = deserialize_message(patches[-1], GridMap), deserialize_message(heights[-1], Float32MultiArray)
        self.assertEqual((patch.layers, patch.info.length_x), (["elevation", "cell", "slope", "edge"], 1.6))
        self.assertEqual([(one.label, one.size) for one in flat.layout.dim], [("x", 16), ("y", 10)])
        grid = np.array(patch.data[0].data).reshape(16, 16).T  # rows run against x
        seen_before = grid[np.isfinite(grid)]
        self.assertAlmostEqual(float(seen_before.max()), 0.2, delta=0.02)
        self.assertGreater(np.isfinite(grid[:8]).sum(), np.isfinite(grid[8:]).sum())  # the camera looks forward
        self.assertAlmostEqual(float(np.nanmin(flat.data)), -1.2, delta=0.03)  # from the base

    def test_answers_about_places_are_those_of_the_module(self):
        index, at = octosurf.SurfaceIndex(self.snapshot), Point(x=0.6, y=0.1, z=2.0)
        asked = srv.Query.Request
        below = self.call("query", kind=asked.BELOW, point=at)
        known = index.below([at.x, at.y, at.z])
        self.assertEqual((below.success, below.found, below.revision, list(below.surfaces)), (True, True, self.snapshot.revision, [known.id]))
        self.assertEqual((below.point.z, below.distance), (known.point[2], known.distance))
        self.assertEqual(self.call("query", kind=asked.NEAREST, point=at).distance, index.nearest([at.x, at.y, at.z]).distance)
        ray = self.call("query", kind=asked.RAY, point=at, direction=Vector3(z=-1.0))
        self.assertEqual((ray.found, ray.front, list(ray.surfaces)), (True, True, [known.id]))
        self.assertEqual(list(self.call("query", kind=asked.SPHERE, point=at, distance=2.5).surfaces), index.in_sphere([at.x, at.y, at.z], 2.5))
        corner = Point(x=-0.5, y=-0.5, z=-0.1)
        inside = index.inside(octosurf.ConvexSpace.box([-0.5, -0.5, -0.1], [at.x, at.y, at.z]))
        self.assertEqual(list(self.call("query", kind=asked.BOX, point=at, corner=corner).surfaces), inside)
        self.assertEqual([self.call("query", kind=asked.VOXEL, point=Point(x=0.6, y=0.1, z=z)).state for z in (0.0, 0.5, 9.0)], [2, 1, 0])
        ground = self.call("query", kind=asked.GROUND, point=Point(x=0.6, y=0.1, z=0.1))
        self.assertEqual((ground.ground, list(ground.surfaces)), ("supported", [known.id]))
        self.assertIn("none of octosurf_msgs/Query", self.call("query", kind=77).message)
        self.assertFalse(self.call("query", kind=asked.GROUND, surface=10**6).success)

    def test_regions_and_plans(self):
        floor = self.call("query", kind=srv.Query.Request.BELOW, point=Point(x=0.6, y=0.1, z=2.0)).surfaces[0]
        every = self.call("contact_regions", radius=0.03, any_heading=True, pieces=3)
        self.assertEqual(len(every.regions), len(self.snapshot))
        one, = self.call("contact_regions", surface=floor, radius=0.03, any_heading=True, as_mapped=True).regions
        whole = self.snapshot.find(floor).area_m2
        self.assertTrue(0.7 * whole < one.area < whole, (one.area, whole))
        near, = self.call("contact_regions", surface=floor, length=0.2, width=0.1, about=Point(x=0.6, y=0.1), reach=0.3).regions
        self.assertTrue(0 < near.area < 0.4, near.area)
        self.assertIn("no foot, or two", self.call("contact_regions", surface=floor).message)
        plan = self.call("plan", robot="quadruped", start=Point(x=0.4, y=0.1), goal=Point(x=0.6, y=0.1))
        self.assertTrue(plan.success and (plan.found or plan.message), plan)
        self.assertIn("neither", self.call("plan", robot="wheels").message)

    def test_zz_is_saved_cleared_and_loaded_beside_its_own_only(self):
        for name in ("../x", "/tmp/x", ".x", "a/b"):
            self.assertIn("plain name", self.call("save", file=name).message)
        self.assertTrue(self.call("save", file="other").success)
        self.assertEqual((self.folder / "other.surfaces").read_bytes(), (self.folder / "offline.surfaces").read_bytes())
        revision, count = self.snapshot.revision, len(self.snapshot)
        self.assertEqual(len(self.call("changes").changed.surfaces), count)
        self.assertEqual(len(self.call("changes", since=revision).changed.surfaces), 0)
        self.assertFalse(self.call("changes", since=revision + 1).success)
        self.assertFalse(self.call("publish", radius=-1.0).success)
        surfaces = self.hear("surfaces")[0]
        self.assertTrue(until(lambda: surfaces))
        heard = len(surfaces)
        self.assertTrue(self.call("publish").success)
        self.assertTrue(until(lambda: len(surfaces) > heard))
        cleared = self.call("clear", size=Vector3(x=100.0, y=100.0, z=100.0))
        self.assertIn(f"{count} surfaces gone", cleared.message)
        self.assertTrue(until(lambda: not deserialize_message(surfaces[-1], Surfaces).surfaces))
        self.assertEqual(len(self.call("changes", since=revision).gone), count)
        self.assertFalse(self.call("load", file="none").success)
        self.assertIn("no longer as", self.call("load", file="other").message)
        self.assertTrue(until(lambda: self.now().revision == revision))

