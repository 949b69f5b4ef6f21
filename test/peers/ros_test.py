"""The node of ros/octosurf_ros beside rclpy over Fast DDS: a robot's topics in, the map's topics and services out."""
import os
import pathlib
import random as rng
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
import types
import unittest

import numpy as np
import ros_workspace

ros_workspace.make(pathlib.Path(sys.prefix))
os.environ.update(ROS_DOMAIN_ID=str(1 + os.getpid() % 100), ROS_AUTOMATIC_DISCOVERY_RANGE="LOCALHOST",
                  AMENT_PREFIX_PATH=sys.prefix)

sys.path.append(os.environ["OCTOSURF_SOURCE"] + "/ros/octosurf_ros")

import octosurf  # noqa: E402
import rclpy  # noqa: E402
import world  # noqa: E402
from convex_plane_decomposition_msgs.msg import PlanarTerrain  # noqa: E402
from geometry_msgs.msg import Point, PoseWithCovarianceStamped, TransformStamped, Vector3  # noqa: E402
from grid_map_msgs.msg import GridMap  # noqa: E402
from livox_ros_driver2.msg import CustomMsg, CustomPoint  # noqa: E402
from nav_msgs.msg import OccupancyGrid  # noqa: E402
from octomap_msgs.msg import Octomap  # noqa: E402
from octosurf_msgs import srv  # noqa: E402
from octosurf_msgs.msg import Stairs, Status, SurfaceChanges, Surfaces  # noqa: E402
from octosurf_ros import mapping, messages, publications, terrain  # noqa: E402
from rcl_interfaces.srv import DescribeParameters  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy  # noqa: E402
from rclpy.serialization import deserialize_message, serialize_message  # noqa: E402
from rosbags.rosbag2 import Writer  # noqa: E402
from rosbags.typesys import Stores, get_typestore  # noqa: E402
from scans_test import png  # noqa: E402
from sensor_msgs.msg import CameraInfo, CompressedImage, Image, PointCloud2, PointField  # noqa: E402
from std_msgs.msg import Float32MultiArray  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from tf2_msgs.msg import TFMessage  # noqa: E402
from visualization_msgs.msg import MarkerArray  # noqa: E402

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
SENSOR = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
RELIABLE = QoSProfile(depth=1000)
IMAGES, INFO, CLOUDS = "/camera/depth/image", "/camera/depth/camera_info", "/lidar/points"
START_S = 1_700_000_000
OUT = {"surfaces": Surfaces, "surface_changes": SurfaceChanges, "stairs": Stairs, "markers": MarkerArray,
       "planar_terrain": PlanarTerrain, "octomap_binary": Octomap, "octomap_full": Octomap, "storey": OccupancyGrid,
       "grid_map": GridMap, "patch": GridMap, "status": Status, "heights": Float32MultiArray}
SERVICES = "save", "load", "query", "contact_regions", "plan", "changes", "publish", "clear"
NOT_IN_JAZZY = "convex_plane_decomposition_msgs", "grid_map_msgs", "livox_ros_driver2"
STEP_M = 0.2
R_BASE_SENSOR = np.array([[np.cos(0.8), 0, np.sin(0.8)], [0, 1, 0], [-np.sin(0.8), 0, np.cos(0.8)]])  # looks down
R_SENSOR_OPTICAL = np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0]])


def until(condition, seconds=60):
    """What it gives once that is true; the robot listens meanwhile."""
    end = time.monotonic() + seconds
    while not (given := condition()) and time.monotonic() < end:
        Room.executor.spin_once(timeout_sec=0.02)
    return given


def class_of(service):
    return getattr(srv, "".join(word.title() for word in service.split("_")))


def ranges(origin, rays):
    """In units of the rays, to a floor at 0 and a step over x > 1; 0: nothing."""
    with np.errstate(divide="ignore", invalid="ignore"):
        floor, top = ((level - origin[2]) / rays[..., 2] for level in (0, STEP_M))
        riser = (1 - origin[0]) / rays[..., 0]
        height = origin[2] + riser * rays[..., 2]
        on_top = (top > 0) & (origin[0] + top * rays[..., 0] > 1)
        at_riser = (riser > 0) & (height > 0) & (height < STEP_M)
    return np.where(on_top, top, np.where(at_riser, riser, np.where(floor > 0, floor, 0)))


def stamped(message, frame, stamp_ns):
    message.header.frame_id = frame
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    return message


def transform(parent, child, stamp_ns, at, turn=(0, 0, 0, 1)):
    one = stamped(TransformStamped(child_frame_id=child), parent, stamp_ns)
    for part, values in ((one.transform.translation, at), (one.transform.rotation, turn)):
        for name, value in zip("xyzw", values):
            setattr(part, name, float(value))
    return one


def recording(lidar=False, count=6, later_ns=0, drift_m=0):
    """(topic, ns, message) of a walk toward the step; the sensor hangs on the base by a chain of transforms. With drift
    there and back, by odometry that is so much too high on the way back."""
    frame, turn = ("lidar", (0, 0, 0, 1)) if lidar else ("camera_optical_frame", (-0.5, 0.5, -0.5, 0.5))
    yield "/tf_static", START_S * 10**9, TFMessage(transforms=[
        transform("base_link", "neck", START_S * 10**9, (0.2, 0, 0), (0, np.sin(0.4), 0, np.cos(0.4))),
        transform("neck", frame, START_S * 10**9, (0, 0, 0), turn)])
    for i in range(count):
        place = 2 * min(i, count - 1 - i) if drift_m else i
        stamp, base = START_S * 10**9 + (i + 1) * 33_333_333 + later_ns, np.array([0.1 * place, 0.05 * place, 1.2])
        told = "odom" if drift_m else "map", "base_link", stamp, base + [0, 0, drift_m * (i >= count // 2)]
        yield "/tf", stamp, TFMessage(transforms=[transform(*told)])
        if lidar:
            yaw, pitch = np.meshgrid(np.linspace(-1.2, 1.2, 160), np.linspace(-0.6, 0.8, 100))
            rays = np.stack([np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), -np.sin(pitch)], -1)
            points = rays * ranges(base + [0.2, 0, 0], rays @ R_BASE_SENSOR.T)[..., None]
            fields = [PointField(name=name, offset=4 * k, datatype=7, count=1) for k, name in enumerate("xyz")]
            cloud = PointCloud2(width=16000, height=1, point_step=12, row_step=192000, fields=fields)
            cloud.data = points.astype("<f4").tobytes()
            yield CLOUDS, stamp, stamped(cloud, frame, stamp)
            continue
        u, v = np.meshgrid(np.arange(160), np.arange(120))
        rays = np.stack([(u - 79.5) / 120, (v - 59.5) / 120, np.ones(u.shape)], -1)
        depth = np.round(1000 * ranges(base + [0.2, 0, 0], rays @ (R_BASE_SENSOR @ R_SENSOR_OPTICAL).T))
        depth[depth > 8000] = 0
        yield INFO, stamp, stamped(CameraInfo(width=160, height=120, distortion_model="plumb_bob", k=[
            120.0, 0.0, 79.5, 0.0, 120.0, 59.5, 0.0, 0.0, 1.0]), frame, stamp)
        yield IMAGES, stamp, stamped(Image(width=160, height=120, encoding="16UC1", step=320,
                                           data=depth.astype("<u2").tobytes()), frame, stamp)


def packed(topic, stamp, message):
    """As compressed_depth_image_transport sends images, and Livox' driver clouds."""
    if topic == IMAGES:
        depth = np.frombuffer(message.data, "<u2").reshape(120, 160)
        return IMAGES + "/compressedDepth", stamp, CompressedImage(
            header=message.header, format="16UC1; compressedDepth png", data=bytes(12) + png(depth))
    if topic == CLOUDS:
        points = [CustomPoint(x=x, y=y, z=z) for x, y, z in np.frombuffer(message.data, "<f4").reshape(-1, 3).tolist()]
        return "/livox", stamp, CustomMsg(header=message.header, point_num=len(points), points=points)
    return topic, stamp, message


def mutated(message, random):
    """Cut, or with other counts, numbers and letters; of whole words, as DDS delivers it."""
    message, tiny = bytearray(message), struct.pack("<If", random.choice((1, 2**16, 2**31)), 1.4e-45)
    for _ in range(random.choice((1, 1, 3, 10))):
        at = random.randrange(4, random.choice((len(message), min(304, len(message)))))  # there, or before the data
        if random.random() < 0.2:
            message[at] = random.randrange(256)
        elif random.random() < 0.9:
            message[at // 4 * 4:at // 4 * 4 + 8] = random.choice((
                bytes(4), b"\xff" * 4, tiny, struct.pack("<d", 1e300), struct.pack("<ff", np.nan, np.inf)))
        elif at > 8:
            del message[at:]
    return bytes(message) + bytes(-len(message) % 4)


class Receiver:
    """Keeps surfaces by what /octosurf/surface_changes says of them."""

    def __init__(self):
        self.surfaces, self.revision, self.heard = {}, None, []

    def hear(self, message):
        self.heard.append(message)
        if message.since == 0:
            self.surfaces, self.revision = {}, 0
        assert message.since == self.revision, (message.since, self.revision)
        for id in (*message.gone, *(one.before for one in message.merged)):
            del self.surfaces[id]
        self.surfaces.update((one.id, one) for one in message.changed.surfaces)
        self.revision = message.changed.revision


class Room(unittest.TestCase):
    """A robot, the node, and a folder for its maps."""

    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp(prefix="octosurf-ros-"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        rclpy.init()
        cls.addClassCleanup(rclpy.shutdown)
        cls.robot, Room.executor = rclpy.create_node("robot"), rclpy.executors.SingleThreadedExecutor()
        cls.executor.add_node(cls.robot)
        cls.publishers, cls.node = {}, None

    @classmethod
    def tearDownClass(cls):
        cls.stop(signal.SIGKILL)

    @classmethod
    def start(cls, *arguments, without=(), **parameters):
        """`without`: packages that are as if not installed."""
        usual = {"output": cls.folder / "live", "resolution": 0.05, "detection_budget": 0, "publish": 0.05}
        words = [sys.executable, "-c", f"import sys; sys.modules.update(dict.fromkeys({without}))\n"
                 "from octosurf_ros.node import main; main()", "--ros-args", *arguments]
        for name, value in {**usual, **parameters}.items():
            words += ["-p", f"{name}:={value}"]
        path = f"{os.environ['PYTHONPATH']}:{os.environ['OCTOSURF_SOURCE']}/ros/octosurf_ros"
        with open(cls.folder / "log", "w") as log:
            cls.node = subprocess.Popen(words, env={**os.environ, "PYTHONPATH": path}, stderr=log)
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
        """A list of what comes, and the subscription."""
        came = []
        return came, cls.robot.create_subscription(OUT[topic], "/octosurf/" + topic, came.append, qos)

    def latched(self, topic, qos=LATCHED):
        """What one who comes now gets."""
        came, subscription = self.hear(topic, qos)
        self.assertTrue(until(lambda: came), topic + self.said())
        self.robot.destroy_subscription(subscription)
        return came[-1]

    @classmethod
    def now(cls):
        return cls.status[0][-1] if cls.status[0] else Status()

    def meet(self, messages):
        """Publishers, spoken with until the node hears them: what was sent before they knew each other is the past."""
        first, before = {}, self.now()
        for topic, _, message in messages:
            first.setdefault(topic, message)
        for topic, message in first.items():
            if topic not in self.publishers:
                qos = LATCHED if topic == "/tf_static" else RELIABLE
                self.publishers[topic] = self.robot.create_publisher(type(message), topic, qos)
                if topic == "/tf_static":
                    self.publishers[topic].publish(message)

        def heard():
            for topic, message in first.items():  # transforms of nothing, and scans of nothing, which are refused
                if topic != "/tf_static":
                    self.publishers[topic].publish(message if topic == INFO else type(message)())
            until(lambda: False, 0.2)
            now = self.now()
            return (now.transforms > before.transforms + 1 and now.refused > before.refused
                    and "CameraInfo" not in now.last_refusal)

        self.assertTrue(until(heard), self.said())
        self.assertTrue(until(lambda: not self.now().waiting))

    def play(self, messages, shift_s=0):
        """As drivers do, but each scan is mapped before the next one is sent."""
        for topic, _, message in messages:
            for one in message.transforms if isinstance(message, TFMessage) else [message]:
                one.header.stamp.sec += shift_s
            mapped = self.now().mapped
            self.publishers[topic].publish(message)
            if topic not in ("/tf", "/tf_static", INFO):
                done = until(lambda: self.now().mapped > mapped and not self.now().waiting)
                self.assertTrue(done, f"{self.now()} {self.said()}")

    def call(self, service, **request):
        kind = Trigger if service in ("reset", "locate") else class_of(service)
        client = self.robot.create_client(kind, "/octosurf/" + service)
        self.assertTrue(client.wait_for_service(30), service)
        answer = client.call_async(kind.Request(**request))
        self.assertTrue(until(answer.done), service + self.said())
        self.robot.destroy_client(client)
        return answer.result()

    def offline(self, name, messages, *options):
        """What `octosurf map` makes of a bag of the messages."""
        types, topics = get_typestore(Stores.ROS2_HUMBLE), {}
        with Writer(self.folder / (name + "_bag"), version=9) as bag:
            for topic, stamp, message in messages:
                if topic not in topics:
                    kind = f"{type(message).__module__.split('.')[0]}/msg/{type(message).__name__}"
                    topics[topic] = bag.add_connection(topic, kind, typestore=types)
                bag.write(topics[topic], stamp, serialize_message(message))
        subprocess.run([os.environ["OCTOSURF"], "map", self.folder / (name + "_bag"), "-o", self.folder / name,
                        "--resolution", "0.05", "--detection-budget", "0", *options], check=True, capture_output=True)

    def assert_live_is(self, name):
        stems = [self.folder / one for one in ("live", name)]
        for of in (lambda stem: octosurf.load(stem).digest(), lambda stem: stem.with_suffix(".bt").read_bytes()):
            self.assertEqual(*map(of, stems))


class Mapping(Room):
    """A node each."""

    def tearDown(self):
        self.stop(signal.SIGKILL)
        self.forget_publishers()
        for file in self.folder.glob("live*"):
            file.unlink()

    def forget_publishers(self):
        for one in self.publishers.values():
            self.robot.destroy_publisher(one)
        self.publishers.clear()

    def test_is_killed_and_goes_on_to_the_map_of_the_recording(self):
        walk = list(recording())
        half = [i for i, one in enumerate(walk) if one[0] == IMAGES][3] + 1
        self.offline("offline", walk)
        self.start(depth=IMAGES, reliable=True, checkpoint=0.0)
        self.meet(walk)
        self.play(walk[:half])
        self.assertTrue(self.call("save").success)
        self.stop(signal.SIGKILL)
        self.start(depth=IMAGES, resume=True)
        self.meet(walk)
        self.play(walk[half:])
        self.stop()
        self.assert_live_is("offline")

    def test_maps_clouds_without_the_robot_itself(self):
        walk, box = list(recording(lidar=True, count=4)), "base_link -1 -1 -2 1.2 1 1"
        self.offline("boxed", walk, "--self-box", *box.split())
        self.start(cloud=CLOUDS, reliable=True, self_box=f'["{box}"]')
        self.meet(walk)
        self.play(walk)
        self.stop()
        self.assert_live_is("boxed")

    def test_maps_sensors_at_once(self):
        """Those of the example, and as drivers pack their messages."""
        both = sorted([*recording(), *recording(lidar=True, later_ns=10**7)], key=lambda one: one[1])
        self.offline("both", both, "--topic", IMAGES, "--topic", CLOUDS)
        example = "--params-file", os.environ["OCTOSURF_SOURCE"] + "/ros/octosurf_ros/config/robot.yaml"
        for messages, arguments, topics in ((both, example, {}), ([packed(*one) for one in both], (), {
                "depth": IMAGES + "/compressedDepth", "livox": "/livox"})):
            self.start(*arguments, reliable=True, frame="map", **topics)
            self.meet(messages)
            self.play(messages)
            self.stop()
            self.assert_live_is("both")
            self.tearDown()

    def test_starts_without_the_packages_that_jazzy_lacks(self):
        self.start(depth=IMAGES, reliable=True, without=NOT_IN_JAZZY)
        self.meet(recording())
        self.play(recording())
        self.assertGreater(len(self.latched("surfaces").surfaces), 1)
        self.assertTrue(self.latched("heights", SENSOR).data)
        line, = (line for line in self.said().splitlines() if "not installed" in line)
        for absent in (*NOT_IN_JAZZY[:2], "~/planar_terrain", "~/grid_map", "~/patch"):
            self.assertIn(absent, line)
        count = self.robot.count_publishers  # killed nodes count for some seconds
        for topic in ("planar_terrain", "grid_map", "patch"):
            self.assertTrue(until(lambda: count("/octosurf/" + topic) == count("/octosurf/heights") - 1), topic)
        self.stop()
        self.start(livox="/livox", without=NOT_IN_JAZZY)
        self.assertEqual(self.node.wait(60), 1)
        self.assertIn("octosurf_mapping: No module named 'livox_ros_driver2", self.said())

    def test_changes_add_up_to_the_surfaces_in_the_box(self):
        """Of both who are there from the start and who come later. The step is in the box, the floor is not."""
        walk, receivers = list(recording()), [Receiver(), Receiver()]

        def join(receiver):
            one = self.robot.create_subscription(SurfaceChanges, "/octosurf/surface_changes", receiver.hear, RELIABLE)
            self.addCleanup(self.robot.destroy_subscription, one)
            self.assertTrue(until(lambda: receiver.revision is not None), self.said())

        def meets(condition=lambda: True):
            def done():
                known = {one.id: one for one in whole[-1].surfaces}
                return condition() and all(one.surfaces == known for one in receivers)

            self.assertTrue(until(done), [(list(one.surfaces), one.revision) for one in receivers])

        def last_two():
            return [(one.since == 0, len(one.changed.surfaces), len(one.gone)) for one in heard[-2:]]

        self.start(depth=IMAGES, reliable=True, radius=1.1, publish=0.1)
        self.meet(walk)
        join(receivers[0])
        self.play(walk[:len(walk) // 2])
        join(receivers[1])
        self.play(walk[len(walk) // 2:])
        self.assertTrue(until(lambda: [one.since == 0 for one in receivers[1].heard[:2]] == [True, False]))
        whole, subscription = self.hear("surfaces")
        self.addCleanup(self.robot.destroy_subscription, subscription)
        self.assertTrue(until(lambda: whole))
        meets(lambda: receivers[0].surfaces)
        count, heard = len(whole[-1].surfaces), receivers[0].heard
        self.assertTrue(self.call("publish", radius=0.1).success)  # nothing is in this box, then as much as before
        self.assertTrue(until(lambda: last_two() == [(True, 0, 0), (False, count, 0)]), last_two())
        every = len(self.call("changes").changes.changed.surfaces)  # with the floor, which comes and leaves the box
        self.assertTrue(self.call("publish").success)
        self.assertTrue(until(lambda: last_two() == [(True, every, 0), (False, 0, every - count)]), last_two())
        self.assertGreater(every, count)
        meets()
        self.call("reset")
        meets(lambda: heard[-1].since == 0 and not whole[-1].surfaces)

    def test_tells_how_far_odometry_is_off(self):
        walk, heard = list(recording(lidar=True, count=20, drift_m=0.08)), []
        tf = self.robot.create_subscription(TFMessage, "/tf", lambda one: heard.extend(one.transforms), RELIABLE)
        self.addCleanup(self.robot.destroy_subscription, tf)
        self.start(cloud=CLOUDS, reliable=True, publish_tf=True)
        self.meet(walk)
        self.play(walk)
        off = [one.transform.translation.z for one in heard
               if (one.header.frame_id, one.child_frame_id) == ("map", "odom")]
        self.assertEqual((len(off), round(off[0], 9)), (20, 0))
        self.assertAlmostEqual(off[-1], -0.08, delta=0.01)

    def test_finds_itself_in_the_map_and_goes_on(self):
        """Odometry that begins anywhere: the map's frame turned by 180 degrees and shifted."""
        world.command("simulate", "office", "--sensor", "spinning", "--frames", 24, "-o", self.folder / "office")
        world.command("map", self.folder / "office", "-o", self.folder / "live", "--first", 12, "--resolution", 0.05,
                      "--detection-budget", 0)
        T_odom_map, walk = np.diag([-1.0, -1, 1, 1]), []
        T_odom_map[:3, 3] = 7, -4, 0
        for i, scan in enumerate(octosurf.open_scans(self.folder / "office")):
            stamp, points = (START_S + i) * 10**9, scan.points.astype("<f4")
            at, turn = messages.pose(T_odom_map @ scan.T_map_sensor).values()
            fields = [PointField(name=name, offset=4 * k, datatype=7, count=1) for k, name in enumerate("xyz")]
            cloud = PointCloud2(width=len(points), height=1, point_step=12, row_step=12 * len(points), fields=fields)
            cloud.data = points.tobytes()
            walk += [("/tf", stamp, TFMessage(transforms=[transform("odom", "lidar", stamp, at, turn)])),
                     (CLOUDS, stamp, stamped(cloud, "lidar", stamp))]
        heard = []
        tf = self.robot.create_subscription(TFMessage, "/tf", lambda one: heard.extend(one.transforms), RELIABLE)
        guess = self.robot.create_publisher(PoseWithCovarianceStamped, "/initialpose", 1)
        for one in (lambda: self.robot.destroy_subscription(tf), lambda: self.robot.destroy_publisher(guess)):
            self.addCleanup(one)
        self.start(cloud=CLOUDS, reliable=True, publish_tf=True, resume=True, locate=True)
        self.meet(walk)
        self.assertEqual((self.now().place, self.now().mapped), ("waiting for a scan", 0))

        def found():
            """Plays until the place is found; the scans by then, of which none was mapped."""
            mapped = self.now().mapped
            for k, (topic, _, message) in enumerate(playing):
                self.publishers[topic].publish(message)
                if topic == CLOUDS and until(lambda: not self.now().place, 5):
                    self.assertEqual(self.now().mapped, mapped)
                    return 1 + k // 2
            self.fail(f"{self.now().place} {self.said()}")

        playing = iter(walk[24:])
        self.assertLess(found(), 8)
        self.play([next(playing), next(playing)])
        self.assertIn("looking for the place", self.call("locate").message)
        self.assertTrue(until(lambda: self.now().place))
        found()
        there = PoseWithCovarianceStamped()
        there.pose.pose.position.x, there.pose.pose.position.y, _ = scan.T_map_sensor[:3, 3]
        guess.publish(there)
        self.assertTrue(until(lambda: self.now().place))
        playing = iter(walk[-2:])
        found()
        poses = [one.transform for one in heard if (one.header.frame_id, one.child_frame_id) == ("map", "odom")]
        self.assertEqual(len(poses), 3 + self.now().mapped)
        for one in poses:
            self.assertLess(np.hypot(one.translation.x - 7, one.translation.y + 4), 0.1)
            self.assertGreater(abs(one.rotation.z), 0.999)

    def test_goes_on_when_publishers_restart_and_the_clock_goes_back(self):
        self.start(depth=IMAGES, reliable=True)
        self.meet(recording())
        self.play(recording())
        self.forget_publishers()
        self.assertTrue(until(lambda: self.now().scan_publishers == 0))
        self.meet(recording())
        self.play(recording(), shift_s=-100)
        self.assertIn("time was set back by 1", self.said())

    def test_refuses_what_is_broken_and_nothing_is_lost(self):
        walk = list(recording())
        self.offline("whole", walk)
        self.start(depth=IMAGES, reliable=True, wait=0.2)
        self.meet(walk)
        self.play(walk[:4])
        image = serialize_message(walk[3][2])
        bad = {"too early": image[:-1000]}
        for words, change in {"rgb8": {"encoding": "rgb8"}, "camera has": {"height": 121}}.items():
            bad[words] = deserialize_message(image, Image)
            setattr(bad[words], *next(iter(change.items())))
        for words, header in {"nowhere": ("nowhere", START_S * 10**9), "pose": ("camera_optical_frame", 10**9)}.items():
            bad[words] = stamped(deserialize_message(image, Image), *header)
        for words, message in bad.items():
            before = self.now().refused
            self.publishers[IMAGES].publish(message)
            self.assertTrue(until(lambda: self.now().refused == before + 1), words + self.said())
            self.assertIn(words, self.now().last_refusal)
        self.play(walk[4:])
        self.stop()
        self.assert_live_is("whole")

    def test_goes_on_after_mutated_messages_and_counts_them(self):
        """Some 300 by this seed, OCTOSURF_TEST_ROUNDS times as many, of sensors 500 m away from the walk."""
        random = rng.Random(int(os.environ.get("OCTOSURF_TEST_SEED", "1")))
        rounds = int(os.environ.get("OCTOSURF_TEST_ROUNDS", "1"))
        whole = {"/tf": TFMessage(transforms=[transform("map", "mast", START_S * 10**9, (500, 0, 0))])}
        for one in (*recording(count=1), *recording(lidar=True, count=1)):
            if one[0] == CLOUDS:
                one[2].width, one[2].row_step, one[2].data = 200, 2400, one[2].data[-2400:]
            for topic, _, message in (one, packed(*one)) * (one[0] not in ("/tf", "/tf_static")):
                whole["/mast" + topic] = stamped(message, "mast", START_S * 10**9)
        scans = dict(zip([*whole][2:], ("depth", "depth", "cloud", "livox")))
        whole["/mast" + INFO].d = [0.1, 0.0, 0.0, 0.0, 0.0]
        named = {f"s{i}.{key}": value for i, one in enumerate(scans.items())
                 for key, value in zip(("topic", "type"), one)}
        self.start(depth=IMAGES, reliable=True, wait=0.0, checkpoint=0.0, sensors="[s0, s1, s2, s3]", **named)
        walk, sent = list(recording()), {}
        self.meet(walk)
        for topic, one in whole.items():
            sent[topic] = self.robot.create_publisher(type(one), topic, RELIABLE)
            self.addCleanup(self.robot.destroy_publisher, sent[topic])
        self.assertTrue(until(lambda: all(one.get_subscription_count() for one in sent.values())), self.said())
        whole = {topic: serialize_message(one) for topic, one in whole.items()}
        nowhere = serialize_message(TFMessage(transforms=[transform("map", "mast", 0, (np.nan, 0, 0))]))
        sent["/tf"].publish(nowhere.replace(b"mast", b"m\0\xffs"))  # a NUL ended the node
        until(lambda: False, 0.3)  # for what was said in meeting
        before, count = self.now(), 0

        def since(*names):
            return sum(getattr(self.now(), name) - getattr(before, name) for name in names)

        for k in range(10 * rounds):
            for topic, message in whole.items():  # five of each, as the node hears ten at once, then a whole one
                for one in (*(mutated(message, random) for _ in range(5)), message):
                    sent[topic].publish(one)
                    count += topic in scans
            self.assertTrue(until(lambda: since("received") == count and not self.now().waiting and since(
                "transforms", "messages_refused") > 6 * k + 6), (k, self.node.poll(), self.now(), self.said()[-3000:]))
        refused, others, mapped = since("refused"), since("messages_refused"), since("mapped", "rejected")
        self.assertEqual((refused + mapped, since("dropped")), (count, 0))
        self.assertGreaterEqual(min(refused, others, mapped), 40 * rounds)  # as many as are whole
        self.play(walk[:4])

    def test_names_what_it_does_not_hear(self):
        images = self.robot.create_publisher(Image, IMAGES, SENSOR)
        clouds = self.robot.create_publisher(PointCloud2, CLOUDS, RELIABLE)
        for one in (images, clouds):
            self.addCleanup(self.robot.destroy_publisher, one)
        self.start(depth=IMAGES, cloud=CLOUDS, reliable=True, tf="/robot/tf", wait=0.1)
        for words in ("RELIABILITY", "no publisher of /robot/tf_static or /robot/tf", "between map and lidar"):
            def said():
                clouds.publish(stamped(PointCloud2(), "lidar", START_S * 10**9))
                return words in self.said()

            self.assertTrue(until(said), self.said())

    def test_beyond_the_queue_the_oldest_make_way(self):
        walk = list(recording())
        self.start(depth=IMAGES, reliable=True, queue=1, wait=60.0)
        self.meet(walk)
        for k in range(40):  # of 38.5 kB; the first is at hand and waits for its pose
            before = self.now().received
            self.publishers[IMAGES].publish(walk[3][2])
            self.assertTrue(until(lambda: self.now().received > before), k)
        self.assertEqual((self.now().dropped, self.now().waiting), (12, 27))

    def test_loses_no_map(self):
        """By save, load and reset, each of which says what became of what was mapped."""
        walk, scans = list(recording()), lambda name: octosurf.load(self.folder / name).size().scans
        self.offline("kitchen", walk[:6])
        kitchen = (self.folder / "kitchen.surfaces").read_bytes()
        shutil.copy(self.folder / "kitchen.bt", self.folder / "lone.bt")
        self.start(depth=IMAGES, reliable=True, checkpoint=0.0, output=f"{self.folder / 'live'}.surfaces")
        self.meet(walk)
        self.play(walk[:10])
        mapped = self.now().mapped
        for name in ("kitchen", "kitchen.surfaces", "kitchen.bt", "lone"):
            answer = self.call("save", file=name)
            self.assertFalse(answer.success)
            self.assertIn("exists", answer.message)
        self.assertEqual((self.folder / "kitchen.surfaces").read_bytes(), kitchen)
        self.assertTrue(self.call("save", file="live.surfaces").success)
        self.play(walk[10:13])
        answer = self.call("load", file="kitchen")
        self.assertIn("live: ", answer.message)
        self.assertEqual((scans("live"), self.now().mapped), (mapped + 1, mapped + 1))
        self.play(walk[13:])
        before = scans("kitchen")
        reset = self.call("reset")
        self.assertTrue(reset.success)
        self.assertIn("kitchen-2", reset.message)
        added = self.now().mapped - mapped - 1
        self.assertEqual(scans("kitchen"), before + added)
        self.play(recording(), shift_s=100)
        loaded = self.call("load", file="kitchen-2")  # nothing was saved there yet
        self.assertIn("no such map", loaded.message)
        self.assertTrue(self.call("save").success)
        self.play(recording(count=1), shift_s=200)
        loaded = self.call("load")  # as it was saved last, and what was mapped since is beside it
        self.assertIn("kitchen-3", loaded.message)
        self.assertEqual((scans("kitchen-2"), scans("kitchen-3")), (6, 7))
        self.stop()
        self.assertEqual((scans("kitchen"), scans("kitchen-2")), (before + added, 6))
        self.start(depth=IMAGES, output=self.folder / "lone", resume=True)
        self.assertEqual(self.node.wait(60), 1)
        self.assertIn("only the .bt is there", self.said())

    def test_says_what_is_wrong_with_its_use(self):
        (self.folder / "there.surfaces").touch()
        (self.folder / "octomap.bt").touch()
        for wrong in ({"cloud": "''"}, {"sensors": "[top]"}, {"hit": -1}, {"max_slope": 100.0},
                      {"self_box": '["1 2 3"]'}, {"output": self.folder / "there"},
                      {"output": self.folder / "there.bt"}, {"output": self.folder / "octomap"},
                      {"cloud": "'bad topic'"}, {"tf": "'bad topic'"}, {"depth": "/d", "camera_info": "'bad topic'"}):
            self.start(**{"cloud": "/c", **wrong})
            self.assertEqual(self.node.wait(60), 1, wrong)
            self.assertIn("octosurf_mapping: ", self.said())
            self.assertFalse((self.folder / "live.lock").exists(), "the next one could not start")

    def test_answers_when_it_has_ended(self):
        options = types.SimpleNamespace(locate=False, threads=1, checkpoint=0)
        ended = mapping.Mapping(octosurf.Map(), str(self.folder / "ended"), options, None)
        ended.thread.start()
        ended.finish(0)
        self.assertRaisesRegex(RuntimeError, "the node ends", ended.save)


class Map(Room):
    """One that has mapped the walk, and is asked."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.start(depth=IMAGES, reliable=True, foot_radius=0.05, max_slope=20.0, clearance=0.3, patch_cell=0.1)
        room, walk = cls(), list(recording())
        room.meet(walk)
        room.play(walk)
        room.offline("offline", walk)
        cls.map = octosurf.load(cls.folder / "offline")
        cls.snapshot, cls.stamp = cls.map.snapshot(), walk[-1][2].header.stamp
        cls.index = octosurf.SurfaceIndex(cls.snapshot)

    def runTest(self):
        """Of the room alone."""

    def test_topics_and_services_have_their_names_types_and_qos(self):
        for topic, kind in OUT.items():
            info, = until(lambda: self.robot.get_publishers_info_by_topic("/octosurf/" + topic))
            qos, reliable = info.qos_profile, topic not in ("heights", "patch")
            self.assertEqual(info.topic_type.split("/")[-1], kind.__name__)
            self.assertEqual((qos.durability == DurabilityPolicy.TRANSIENT_LOCAL,
                              qos.reliability == ReliabilityPolicy.RELIABLE),
                             (reliable and topic != "surface_changes", reliable), topic)
        services = dict(self.robot.get_service_names_and_types_by_node("octosurf", "/"))
        for name in SERVICES:
            self.assertEqual(services["/octosurf/" + name], ["octosurf_msgs/srv/" + class_of(name).__name__])
        client = self.robot.create_client(DescribeParameters, "/octosurf/describe_parameters")
        answer = client.call_async(DescribeParameters.Request(names=["max_slope", "queue", "depth", "resolution"]))
        self.assertTrue(until(answer.done))
        slope, queue, depth, resolution = answer.result().descriptors
        self.assertEqual((slope.type, queue.type, depth.type, resolution.dynamic_typing), (3, 2, 4, True))
        self.assertEqual((slope.floating_point_range[0].to_value, queue.integer_range[0].from_value), (80, 1))

    def test_what_is_published_is_the_offline_map(self):
        surfaces = self.latched("surfaces")
        self.assertEqual((surfaces.header.frame_id, surfaces.header.stamp), ("map", self.stamp))
        self.assertEqual(surfaces.revision, self.snapshot.revision)
        self.assertGreater(len(surfaces.surfaces), 1)
        for one, of in zip(surfaces.surfaces, self.snapshot.surfaces, strict=True):
            self.assertEqual((one.id, one.area, one.offset), (of.id, of.area_m2, of.plane.offset))
            ring = np.array([(point.x, point.y, point.z) for point in one.polygons[0].outer.points])
            np.testing.assert_array_equal(ring, of.to_map(of.polygons[0].outer))
            np.testing.assert_array_equal(one.covariance, of.covariance.ravel())
            at, q = one.pose.position, one.pose.orientation
            placed = octosurf.pose_from_transform([at.x, at.y, at.z], [q.x, q.y, q.z, q.w])
            np.testing.assert_allclose(placed, of.T_map_surface, atol=1e-12)
        stairs = self.latched("stairs")
        self.assertEqual((len(stairs.stairs), len(stairs.single_steps)), (0, 1))
        self.assertAlmostEqual(stairs.single_steps[0].riser, STEP_M, delta=0.01)
        markers = self.latched("markers").markers
        self.assertEqual([one.action for one in markers], [3] + [0] * len(self.snapshot))
        self.assertTrue(all(one.points and len(one.points) % 3 == 0 for one in markers[1:]))
        octomap = self.latched("octomap_binary")
        self.assertEqual((octomap.binary, octomap.id, octomap.resolution), (True, "OcTree", 0.05))
        octree, full = self.folder / "offline.ot", self.latched("octomap_full")
        subprocess.run([os.environ["OCTOSURF"], "export", self.folder / "offline", "--to", octree], check=True,
                       capture_output=True)
        self.assertEqual((full.binary, full.id, full.resolution), (False, "OcTree", 0.05))
        for file, message in ((octree, full), (octree.with_suffix(".bt"), octomap)):
            self.assertTrue(file.read_bytes().endswith(b"data\n" + message.data.tobytes()), file)

    def test_grid_map_terrain_and_patches_have_the_step(self):
        grid, terrain = self.latched("grid_map"), self.latched("planar_terrain")
        self.assertEqual(grid.layers, ["elevation", "normal_x", "normal_y", "normal_z", "surface_id"])
        heights = np.array(grid.data[0].data)
        self.assertEqual(len(heights), grid.data[0].layout.dim[0].stride)
        self.assertEqual(set(np.round(heights[np.isfinite(heights)], 1)), {np.float32(0), np.float32(STEP_M)})
        self.assertEqual((terrain.gridmap.header.stamp, grid.header.stamp), (self.stamp, self.stamp))
        places = sorted(round(region.plane_parameters.position.z, 1) for region in terrain.planar_regions)
        self.assertEqual(set(places), {0, STEP_M})
        patch, flat = self.latched("patch", SENSOR), self.latched("heights", SENSOR)
        self.assertEqual((patch.layers, patch.info.length_x), (["elevation", "cell", "slope", "edge"], 1.6))
        self.assertEqual([(one.label, one.size) for one in flat.layout.dim], [("x", 16), ("y", 10)])
        around = np.array(patch.data[0].data).reshape(16, 16).T  # rows run against x
        self.assertAlmostEqual(float(np.nanmax(around[:8])), STEP_M, delta=0.02)
        self.assertGreater(np.isfinite(around[:8]).sum(), np.isfinite(around[8:]).sum())
        self.assertAlmostEqual(float(np.nanmin(flat.data)), -1.2, delta=0.03)  # from the base

    def test_the_storeys_grid_ends_at_the_step(self):
        """The floor before it is too small for a storey."""
        grid = self.latched("storey")
        origin, edge_m = grid.info.origin.position, grid.info.resolution
        self.assertEqual((grid.header.frame_id, grid.header.stamp, edge_m), ("map", self.stamp, np.float32(0.05)))
        self.assertAlmostEqual(origin.z, STEP_M, delta=0.01)
        row = np.array(grid.data).reshape(grid.info.height, grid.info.width)[int((0.1 - origin.y) / edge_m)]
        x = origin.x + edge_m * (np.arange(len(row)) + 0.5)
        self.assertEqual((set(row[(x > 0.8) & (x < 0.95)]), set(row[(x > 1.1) & (x < 2)])), ({100}, {0}))

    def test_answers_about_places_are_those_of_the_module(self):
        asked, place = srv.Query.Request, (0.6, 0.1, 2.0)
        at, known = Point(x=0.6, y=0.1, z=2.0), self.index.below(place)
        below, nearest = (self.call("query", kind=kind, point=at) for kind in (asked.BELOW, asked.NEAREST))
        self.assertEqual((below.success, below.found, below.revision), (True, True, self.snapshot.revision))
        self.assertEqual((list(below.surfaces), below.distance), ([known.id], known.distance))
        self.assertEqual(nearest.distance, self.index.nearest(place).distance)
        ray = self.call("query", kind=asked.RAY, point=at, direction=Vector3(z=-1.0))
        self.assertEqual((ray.found, ray.front, list(ray.surfaces)), (True, True, [known.id]))
        sphere = self.call("query", kind=asked.SPHERE, point=at, distance=2.5).surfaces
        self.assertEqual(list(sphere), self.index.in_sphere(place, 2.5))
        inside = self.call("query", kind=asked.BOX, point=at, corner=Point(x=-0.5, y=-0.5, z=-0.1)).surfaces
        self.assertEqual(list(inside), self.index.inside(octosurf.ConvexSpace.box([-0.5, -0.5, -0.1], place)))
        voxels = [self.call("query", kind=asked.VOXEL, point=Point(x=0.6, y=0.1, z=z)).state for z in (0.0, 0.5, 9.0)]
        self.assertEqual(voxels, [2, 1, 0])
        ground = self.call("query", kind=asked.GROUND, point=Point(x=0.6, y=0.1, z=0.1))
        self.assertEqual((ground.ground, list(ground.surfaces)), ("supported", [known.id]))
        self.assertIn("none of octosurf_msgs/Query", self.call("query", kind=77).message)
        self.assertFalse(self.call("query", kind=asked.GROUND, surface=10**6).success)

    def test_regions_and_plans(self):
        floor = self.index.below((0.6, 0.1, 2.0)).id
        whole = self.snapshot.find(floor).area_m2
        every = self.call("contact_regions", radius=0.03, any_heading=True, pieces=3)
        self.assertEqual(len(every.regions), len(self.snapshot))
        one, = self.call("contact_regions", surface=floor, radius=0.03, any_heading=True, as_mapped=True).regions
        self.assertTrue(0.7 * whole < one.area < whole, (one.area, whole))
        near, = self.call("contact_regions", surface=floor, length=0.2, width=0.1, about=Point(x=0.6, y=0.1),
                          reach=0.3).regions
        self.assertTrue(0 < near.area <= 0.36, near.area)
        self.assertIn("no foot, or two", self.call("contact_regions", surface=floor).message)
        plan = self.call("plan", robot="quadruped", start=Point(x=0.4, y=0.1), goal=Point(x=0.6, y=0.1))
        self.assertTrue(plan.success and (plan.found or plan.message), plan)
        self.assertIn("neither", self.call("plan", robot="wheels").message)

    def test_zz_is_saved_cleared_and_loaded_beside_its_own_only(self):
        for name in ("../x", "/tmp/x", ".x", "a/b"):
            self.assertIn("plain name", self.call("save", file=name).message)
        self.assertTrue(self.call("save", file="other").success)
        self.assertEqual(*((self.folder / (name + ".bt")).read_bytes() for name in ("other", "offline")))
        revision, count = self.snapshot.revision, len(self.snapshot)
        self.assertEqual(len(self.call("changes").changes.changed.surfaces), count)
        self.assertEqual(len(self.call("changes", since=revision).changes.changed.surfaces), 0)
        self.assertFalse(self.call("changes", since=revision + 1).success)
        surfaces = self.hear("surfaces")[0]
        self.assertTrue(until(lambda: surfaces))
        heard = len(surfaces)
        self.assertFalse(self.call("publish", radius=-1.0).success)
        self.assertTrue(self.call("publish").success)
        self.assertTrue(until(lambda: len(surfaces) > heard))
        self.assertIn(f"{count} surfaces gone", self.call("clear", size=Vector3(x=100.0, y=100.0, z=100.0)).message)
        self.assertTrue(until(lambda: not surfaces[-1].surfaces))
        self.assertEqual(len(self.call("changes", since=revision).changes.gone), count)
        self.assertFalse(self.call("load", file="none").success)
        self.assertIn("other: ", self.call("load", file="other").message)
        self.assertTrue(until(lambda: self.now().revision == revision))
        for ending in (".bt", ".surfaces"):
            shutil.copy(pathlib.Path(os.environ["OCTOSURF_SOURCE"], "maps/office" + ending), self.folder)
        self.assertTrue(self.call("load", file="office").success)
        storeys = self.hear("storey")[0]  # the one at 0.55 m, and not that at 1.52, above the camera
        self.assertTrue(until(lambda: storeys and abs(storeys[-1].info.origin.position.z - 0.55) < 0.01), storeys[-1:])
        self.call("reset")
        self.assertTrue(until(lambda: self.now().revision == 0 and self.now().surfaces == 0))
        self.assertTrue(until(lambda: not surfaces[-1].surfaces))


def box(u, v, size, holes=()):
    return types.SimpleNamespace(outer=np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * size + [u, v], holes=holes)


def hole(*at):
    return box(*at).outer[::-1]


class Terrain(unittest.TestCase):
    """Without the node."""

    def terrain(self, *surfaces):
        grid = types.SimpleNamespace(cell=0.05, center=(4, -1), elevation=np.full((40, 44), 0.75, "f4"))
        grid.elevation[3, 5] = grid.elevation[20, 21] = np.nan
        grid.elevation[20, 20] = 0.25
        value = terrain.planar_terrain(surfaces, grid, "odom", 5 * 10**9 + 7)
        return deserialize_message(bytes(messages.cdr(PlanarTerrain, value)), PlanarTerrain)

    def surface(self, polygons, insets, slope_deg=0.0):
        T, slope = np.eye(4), np.radians(slope_deg)
        T[:3, 1:3] = np.array([[0, np.cos(slope), np.sin(slope)], [0, -np.sin(slope), np.cos(slope)]]).T
        T[:3, 3] = 3, -2, 0.75
        return types.SimpleNamespace(T_world_surface=T, polygons=polygons, insets=insets)

    def test_of_the_office_has_its_heights_and_contact_regions(self):
        mapper = octosurf.Mapper(octosurf.load(os.environ["OCTOSURF_SOURCE"] + "/maps/office"))
        mapper.share_octree()
        snapshot = mapper.snapshot()
        options = types.SimpleNamespace(frame="lab", grid_cell=0.05, foot_radius=0.06, max_slope=80.0, clearance=0.5)
        corners = np.concatenate([one.to_map(of.outer) for one in snapshot.surfaces for of in one.polygons])
        middle = np.median(corners, axis=0)
        for up in ((0, 0, 1), (0.2, 0.1, 1)):
            for within in (None, np.array([middle - 1, middle + 1])):
                kept = publications.Terrain(snapshot, mapping.Ground(up / np.linalg.norm(up)),
                                            [one.id for one in snapshot.surfaces], within, options)
                view, solid, grid = kept.grid()
                made = deserialize_message(kept.grid_map(0), GridMap)
                place = made.info.pose.position
                self.assertEqual((made.header.frame_id, place.x, place.y), ("lab", *grid.center))
                for layer, known in zip(made.data, (grid.elevation, *grid.normal, grid.surface), strict=True):
                    np.testing.assert_array_equal(np.reshape(layer.data, known.shape[::-1]).T, known)
                surfaces = octosurf.planner_surfaces(solid, view.rules.foot, limits=view.rules.limits,
                                                     octree=snapshot.octree)
                regions = deserialize_message(kept.planar_terrain(0), PlanarTerrain).planar_regions
                insets = sum(len(one.insets) for one in regions)
                self.assertEqual(insets, sum(len(one.insets) for one in surfaces))
                self.assertGreater(insets, len(regions))

    def test_a_region_has_pose_box_boundary_and_insets(self):
        """Of a table with a hole, not of the island in it, which has no room."""
        table = self.surface([box(0, 0, 2, [hole(0.8, 0.8, 0.4)]), box(0.9, 0.9, 0.2)],
                             [box(0.1, 0.1, 1.8, [hole(0.7, 0.7, 0.6)])], slope_deg=20)
        one, = self.terrain(table).planar_regions
        at, q = one.plane_parameters.position, one.plane_parameters.orientation
        placed = octosurf.pose_from_transform([at.x, at.y, at.z], [q.x, q.y, q.z, q.w])
        np.testing.assert_allclose(placed, table.T_world_surface, atol=1e-12)
        low_high = one.bbox2d.min_x, one.bbox2d.min_y, one.bbox2d.max_x, one.bbox2d.max_y
        self.assertEqual(low_high, (0, 0, 2, 2))
        for polygon, of in ((one.boundary, table.polygons[0]), (*one.insets, table.insets[0])):
            for ring, known in zip((polygon.outer_boundary, *polygon.holes), (of.outer, *of.holes), strict=True):
                np.testing.assert_array_equal([(p.x, p.y) for p in ring.points], known.astype("f4"))

    def test_every_inset_goes_to_the_polygon_it_lies_in(self):
        """One lies on its polygon's outline."""
        surface = self.surface([box(0, 0, 1), box(2, 0, 1)], [box(2.1, 0.1, 0.3), box(0, 0, 1), box(2.6, 0.1, 0.3)])
        self.assertEqual([len(one.insets) for one in self.terrain(surface).planar_regions], [1, 2])

    def test_steep_and_cramped_regions_are_left_out(self):
        table = [box(0, 0, 1)]
        left_out = self.surface(table, table, 81), self.surface(table, table, 180), self.surface(table, [])
        some, none = self.terrain(*left_out, self.surface(table, table, 79)), self.terrain(*left_out)
        self.assertEqual((len(some.planar_regions), len(none.planar_regions)), (1, 0))
        self.assertEqual(none.gridmap, some.gridmap)

    def test_the_grid_has_its_layers_column_by_column_without_gaps(self):
        """As grid_map_ros reads them: from the +x, +y corner."""
        grid = self.terrain().gridmap
        self.assertEqual((grid.header.frame_id, grid.header.stamp.sec, grid.header.stamp.nanosec), ("odom", 5, 7))
        self.assertEqual((grid.layers, grid.basic_layers), (["elevation", "smooth_planar"], ["elevation"]))
        self.assertEqual((grid.outer_start_index, grid.inner_start_index), (0, 0))
        info, at = grid.info, grid.info.pose
        self.assertEqual((info.resolution, info.length_x, info.length_y), (0.05, 2, 2.2))
        self.assertEqual((at.position.x, at.position.y, at.position.z, at.orientation.w), (4, -1, 0, 1))
        layers = []
        for layer in grid.data:
            dim = [(one.label, one.size, one.stride) for one in layer.layout.dim]
            self.assertEqual(dim, [("column_index", 44, 1760), ("row_index", 40, 40)])
            layers.append(np.array(layer.data).reshape(44, 40).T)
        elevation, smooth = layers
        known = np.full((40, 44), 0.75)
        known[20, 20:22] = 0.25  # the lowest on the gap's rim
        np.testing.assert_array_equal(elevation, known)
        self.assertAlmostEqual(smooth[20, 20], (23 * 0.75 + 2 * 0.25) / 25, 6)
        self.assertEqual(smooth[30, 30], np.float32(0.75))

    def test_gaps_are_filled_as_by_sweeps(self):
        random = np.random.default_rng(0)
        for shape in random.integers(1, 13, (50, 2)):
            heights = random.integers(0, 100, shape).astype("f4")
            heights[random.random(shape) < 0.5] = np.nan
            heights[0, 0] = 50
            gap, known = np.isnan(heights), np.where(np.isnan(heights), np.inf, heights)
            for _ in range(heights.size):
                around = np.pad(known, 1, constant_values=np.inf)
                rim = np.min([around[:-2, 1:-1], around[2:, 1:-1], around[1:-1, :-2], around[1:-1, 2:]], axis=0)
                known = np.where(gap, np.minimum(known, rim), known)
            np.testing.assert_array_equal(terrain.without_gaps(heights), known)
        self.assertTrue(np.isnan(terrain.without_gaps(np.full((3, 2), np.nan, "f4"))).all())

    def test_the_mean_is_of_the_square_as_far_as_the_grid_reaches(self):
        heights = np.random.default_rng(1).random((17, 9), "f4")
        for cells in (0.5, 1, 3, 4, 100):
            mean, reach = terrain.mean_over(heights, cells), int(cells / 2)
            for r, c in np.ndindex(heights.shape):
                square = heights[max(r - reach, 0):r + reach + 1, max(c - reach, 0):c + reach + 1]
                self.assertAlmostEqual(mean[r, c], square.mean(), 5)
