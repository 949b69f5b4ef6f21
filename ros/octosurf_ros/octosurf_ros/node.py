"""The mapping node: scans and transforms in, the map, its patches and services out."""

import signal
import sys
import threading
import time
import types

import octosurf
import rclpy
from geometry_msgs.msg import PoseWithCovarianceStamped
from octosurf_msgs.msg import Status
from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.event_handler import SubscriptionEventCallbacks, UnsupportedEventTypeError
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo
from tf2_msgs.msg import TFMessage

from octosurf_ros.mapping import PATIENCE_S, Mapping, Sensor, start_of
from octosurf_ros.messages import cdr, class_of, header, pose
from octosurf_ros.patches import Patches
from octosurf_ros.publications import Publications
from octosurf_ros.services import Services

SENSOR = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

# Name: default, whose type it has; meaning; smallest and largest.
PARAMETERS = {
    "depth": ("", "topic of depth as sensor_msgs/Image: 16UC1, mono16, 32FC1; CompressedImage at .../compressedDepth"),
    "cloud": ("", "topic of sensor_msgs/PointCloud2"),
    "livox": ("", "topic of livox_ros_driver2/CustomMsg"),
    "sensors": ([""], "names of more: NAME.topic, NAME.type (depth, cloud or livox), and NAME.no_return and the like"),
    "camera_info": ("", "topic; empty: camera_info beside depth"),
    "depth_scale": (0.0, "depth's units per metre; 0: 1000 of integers, 1 of floats", 0, 1e6),
    "no_return": ([0.0], "m: ranges (of cameras: depths) that stand for no return, besides 0"),
    "self_box": ([""], "boxes of the robot itself: '[FRAME] X Y Z X Y Z', two corners each, m"),
    "sensor": ("", "of clouds: camera or lidar; empty: lidar, camera in an _optical_frame"),
    "reliable": (False, "lost scans are sent again; needs publishers that offer it"),
    "frame": ("map", "the map's, in tf"),
    "publish_tf": (False, "poses are looked up in `odom`, and frame -> odom is published as alignment corrects them"),
    "odom": ("odom", "the odometry's frame, for publish_tf"),
    "locate": (False, "find `odom` in the map that is resumed or loaded, by the first scans; for publish_tf"),
    "base": ("base_link", "the robot's frame in tf, about which patches are read"),
    "tf": ("/tf", "topic of transforms; of fixed ones the same with _static"),
    "wait": (1.0, "s: longest that a scan waits for tf and CameraInfo", 0, 60),
    "queue": (256, "MB of waiting scans; beyond it the oldest are dropped", 1, 65536),
    "output": ("", "the map: MAP.surfaces and MAP.bt"),
    "resume": (False, "go on with the map, if it is there"),
    "force": (False, "start a new map, and overwrite an existing one"),
    "checkpoint": (60.0, "s between saves; 0: only at the end", 0, 1e6),
    "publish": (1.0, "s between publications of the map", 0.01, 3600),
    "radius": (8.0, "m around the robot in which the map is published; 0: everything", 0, 1e6),
    "grid_cell": (0.05, "m, of grid map and planar terrain; at least the map's resolution", 0.001, 10),
    "patch_rate": (50.0, "Hz, of patches about the robot; 0: none", 0, 1000),
    "patch_length": (1.6, "m, of a patch along the robot's heading", 0.01, 6),
    "patch_width": (1.0, "m, of a patch across it", 0.01, 6),
    "patch_cell": (0.05, "m, between a patch's places", 0.01, 1),
    "foot_radius": (0.06, "m, of the planar terrain's insets", 0.001, 1),
    "max_slope": (30.0, "degrees, of planar terrain and grid map", 0, 80),
    "clearance": (octosurf.Quadruped().body.to_m, "m over a foot of the planar terrain that is free; 0: any", 0, 10),
    "robot_radius": (0.3, "m, of the storey's grid, as of `octosurf export --to nav2/`", 0.01, 10),
    "headroom": (1.6, "m, likewise", 0.01, 10),
    "threads": (1, "the result does not depend on it", 1, 256),
}
CORRECTION_LASTS_NS = 500_000_000  # so that tf2 need not wait for the next scan's; AMCL dates its own alike
TYPES = {"depth": "sensor_msgs/Image", "cloud": "sensor_msgs/PointCloud2", "livox": "livox_ros_driver2/CustomMsg"}
OWN = "camera_info", "depth_scale", "no_return", "self_box", "sensor", "reliable"  # a sensor's, if it says so


class MappingNode(Node):
    def __init__(self):
        super().__init__("octosurf")
        options = types.SimpleNamespace(**{name: self.declared(name, *one) for name, one in PARAMETERS.items()})
        self.options, options.given = options, options.odom if options.publish_tf else options.frame
        sensors = self.sensors()
        if not options.output or not sensors:
            raise ValueError("give output, and depth, cloud, livox or sensors: --ros-args -p NAME:=VALUE")
        described = ParameterDescriptor(dynamic_typing=True, read_only=True, description="see docs/parameters.md")
        names = ["up", *(name for name in octosurf.Parameters.names() if not name.startswith("up_"))]
        given = {name: self.declare_parameter(name, None, described).value for name in names}
        given = {name: str(value) for name, value in given.items() if value not in (None, "")}
        cameras = any(one.depth or one.kind == "depth_camera" for one in sensors)
        start = start_of(options.output, given, options.resume, options.force, cameras)
        self.mapping = Mapping(start, options.output, options, self.get_logger())
        self.lost, self.began, self.told, self.absent = 0, time.monotonic(), set(), {}
        self.heard = {}  # subscriptions of scans, cameras and transforms, with the topic
        # In this order: a scan is better mapped when what fixes its pose was read.
        self.hear("transforms", options.tf + "_static", TFMessage,
                  QoSProfile(depth=1000, durability=DurabilityPolicy.TRANSIENT_LOCAL),
                  lambda message: self.mapping.add_transforms(message, True))
        self.hear("transforms", options.tf, TFMessage, QoSProfile(depth=1000),
                  lambda message: self.mapping.add_transforms(message, False))
        if options.publish_tf:
            self.corrections = self.create_publisher(TFMessage, options.tf, 100)
            self.mapping.corrected = self.publish_correction
            self.create_subscription(PoseWithCovarianceStamped, "/initialpose", self.look_about, 1)
        for sensor in sensors:
            self.hear_sensor(sensor)
        self.publications = Publications(self, self.mapping)
        if options.patch_rate > 0:
            Patches(self, self.mapping)
        Services(self, self.mapping, self.publications)
        self.status = self.advertise("status", "octosurf_msgs/Status")
        self.every(options.publish, self.publish_status)
        if self.absent:
            self.get_logger().warning("not installed: " + "; ".join(
                f"{package}, so there is no {' or '.join(topics)}" for package, topics in self.absent.items()))
        self.get_logger().info("mapping " + ", ".join(one.topic for one in sensors))
        self.mapping.thread.start()  # last: what fails before ends the process

    def sensors(self):
        """Those of the parameters `depth`, `cloud` and `livox`, and of the list."""
        every = vars(self.options)
        sensors = [Sensor(every[kind], TYPES[kind], every) for kind in TYPES if every[kind]]
        for name in filter(None, self.options.sensors):
            own = {one: self.declared(f"{name}.{one}", every[one], *PARAMETERS[one][1:]) for one in OWN}
            topic, kind = (self.declared(f"{name}.{one}", "", "as sensors says") for one in ("topic", "type"))
            if not topic or kind not in TYPES:
                raise ValueError(f"give {name}.topic, and {name}.type, one of {', '.join(TYPES)}")
            sensors.append(Sensor(topic, TYPES[kind], own))
        return sensors

    def hear_sensor(self, sensor):
        if sensor.depth:
            self.hear("cameras", sensor.info, CameraInfo, SENSOR, lambda one: self.mapping.add_camera(sensor, one))
        self.hear("scans", sensor.topic, sensor.message, QoSProfile(depth=10) if sensor.reliable else SENSOR,
                  lambda message, info: self.mapping.add_scan(sensor, message, info["source_timestamp"]))

    def declared(self, name, default, description, low=None, high=None):
        descriptor = ParameterDescriptor(description=description, read_only=True)
        if isinstance(default, int) and low is not None:
            descriptor.integer_range = [IntegerRange(from_value=low, to_value=high)]
        elif low is not None:
            descriptor.floating_point_range = [FloatingPointRange(from_value=float(low), to_value=float(high))]
        return self.declare_parameter(name, default, descriptor).value

    def hear(self, what, topic, kind, qos, receive):
        """Messages come as bytes, which C++ reads."""
        def lost(event):
            if what == "scans":
                self.lost += event.total_count_change

        try:
            events = SubscriptionEventCallbacks(message_lost=lost)
            heard = self.create_subscription(kind, topic, receive, qos, raw=True, event_callbacks=events)
        except UnsupportedEventTypeError:  # not every middleware counts what was lost
            heard = self.create_subscription(kind, topic, receive, qos, raw=True)
        self.heard.setdefault((what, topic.removesuffix("_static")), []).append(heard)

    def advertise(self, topic, word, qos=LATCHED):
        """None if the package of the message, such as std_msgs/Header, is not installed."""
        try:
            return self.create_publisher(class_of(word), "~/" + topic, qos)
        except ModuleNotFoundError as error:
            self.absent.setdefault(error.name.split(".")[0], []).append("~/" + topic)

    def every(self, period, work):
        """Calls `work` in a thread of its own, so that what comes never waits for it."""
        def run():
            problem, due = None, time.monotonic()
            while self.context.ok():
                try:
                    work()
                    problem = None
                except Exception as error:  # tf has no pose yet, for example: said once in a row
                    if str(error) != problem and self.context.ok():
                        self.get_logger().warning(f"{work.__name__}: {error}")
                    problem = str(error)
                due = max(due + period, time.monotonic())
                time.sleep(max(0, due - time.monotonic()))

        threading.Thread(target=run, daemon=True, name=work.__name__).start()

    def publish_correction(self, T_map_odom, stamp_ns):
        at = pose(T_map_odom)
        self.corrections.publish(cdr(TFMessage, {"transforms": [{
            "header": header(self.options.frame, stamp_ns + CORRECTION_LASTS_NS), "child_frame_id": self.options.odom,
            "transform": {"translation": at["position"], "rotation": at["orientation"]}}]}))

    def look_about(self, message):
        """For the next scans' place within 1 m, at any height: RViz says none."""
        at = message.pose.pose.position
        box = [at.x - 1, at.y - 1, -1e4], [at.x + 1, at.y + 1, 1e4]
        self.mapping.tasks.append(lambda _=None: self.mapping.look(*box))

    def publishers_of(self, what):
        return sum(self.count_publishers(one.topic_name)
                   for (of, _), heard in self.heard.items() if of == what for one in heard)

    def publish_status(self):
        mapping, moment = self.mapping, self.mapping.moment
        status = Status(revision=moment.snapshot.revision, surfaces=len(moment.snapshot), waiting=len(mapping.queue),
                        lost=self.lost, last_refusal=mapping.last_refusal, scan_ms=mapping.scan_ms,
                        contradiction=mapping.contradiction, place=mapping.place, publish_ms=self.publications.ms,
                        published_bytes=self.publications.bytes, scan_publishers=self.publishers_of("scans"),
                        camera_publishers=self.publishers_of("cameras"),
                        transform_publishers=self.publishers_of("transforms"), **mapping.counts)
        status.header.frame_id = self.options.frame
        status.header.stamp.sec, status.header.stamp.nanosec = divmod(moment.stamp_ns, 10**9)
        self.status.publish(status)
        if time.monotonic() - self.began > PATIENCE_S:  # by then publishers are discovered
            for what, heard in self.heard.items():
                topics = [one.topic_name for one in heard]
                if what not in self.told and not any(map(self.count_publishers, topics)):
                    self.told.add(what)
                    self.get_logger().warning(
                        f"no publisher of {' or '.join(topics)}: no {what[0]}; is the topic called so?")


def main():
    sys.setswitchinterval(0.0005)  # s: what comes waits no longer for what publishes
    rclpy.init()
    try:
        node = MappingNode()
    except Exception as error:
        sys.exit(f"octosurf_mapping: {error}")
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while rclpy.ok() and node.mapping.failure is None:
            executor.spin_once(timeout_sec=0.5)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # a second Ctrl-C ends it at once
        print(node.mapping.finish(3), file=sys.stderr)  # `ros2 launch` ends what has not ended 10 s after Ctrl-C
