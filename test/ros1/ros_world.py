"""What the tests of the ROS 1 node share: a roscore on a free port, the node, recordings as bags, messages as classes."""

import atexit
import functools
import os
import pathlib
import socket
import subprocess
import sys
import tempfile
import threading
import time

SOURCE = pathlib.Path(os.environ["OCTOSURF_SOURCE"])
COMMAND = os.environ["OCTOSURF"]
NODE = os.environ.get("OCTOSURF_NODE", "")
_folder = tempfile.TemporaryDirectory(prefix="octosurf_ros1_")
FOLDER = pathlib.Path(_folder.name)
PATIENCE = 60  # s, for what comes in milliseconds on a machine with nothing else to do


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


os.environ.update(ROS_MASTER_URI=f"http://127.0.0.1:{free_port()}", ROS_IP="127.0.0.1", ROS_HOME=str(FOLDER / "ros"),
                  ROS_LOG_DIR=str(FOLDER / "log"), ROSCONSOLE_FORMAT="${severity}: ${message}")
os.environ.pop("ROS_HOSTNAME", None)

try:
    import dynamic_reconfigure.client
    import rosbag
    import rosgraph
    import rospy
    import sensor_msgs.msg  # noqa: F401  these are what bags are made of
    import tf2_msgs.msg
    import visualization_msgs.msg  # noqa: F401
except ImportError as missing:
    print(f"skipped: {missing} (./dev test installs it)")
    sys.exit(77)


def make_message_classes():
    """Of octosurf_msgs and of the packages that Debian has not, as genpy makes them."""
    ros = SOURCE / "ros/ros1"
    packages = [ros / "octosurf_msgs", *sorted((ros / "octosurf_ros/foreign_msgs").iterdir())]
    paths = [f"-I{name}:/usr/share/{name}/msg" for name in ("std_msgs", "geometry_msgs")]
    paths += [f"-I{package.name}:{package / 'msg'}" for package in packages]
    for package in packages:
        for kind in ("msg", "srv"):
            files = sorted((package / kind).glob(f"*.{kind}"))
            if not files:
                continue
            out = FOLDER / "python" / package.name / kind
            generator = [sys.executable, f"/usr/lib/genpy/gen{kind}_py.py", *paths, "-p", package.name, "-o", out]
            subprocess.run([*generator, *files], check=True, stdout=subprocess.DEVNULL)
            subprocess.run([*generator, "--initpy"], check=True, stdout=subprocess.DEVNULL)
            (out.parent / "__init__.py").touch()
    sys.path.insert(0, str(FOLDER / "python"))


def wait_for(condition, what, patience=PATIENCE):
    """Until it is true, which is returned."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(0.01)
    raise AssertionError(f"waited {patience} s in vain for {what}")


def octosurf(*arguments):
    done = subprocess.run([COMMAND, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@functools.cache
def start_ros():
    """A master of our own, and this process as a node. Ends with the process."""
    port = os.environ["ROS_MASTER_URI"].rsplit(":", 1)[1]
    core = subprocess.Popen(["roscore", "-p", port], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    atexit.register(lambda: (core.terminate(), core.wait()))
    wait_for(rosgraph.is_master_online, "roscore")
    rospy.init_node("test", disable_signals=True, disable_rosout=True)
    make_message_classes()


class Node:
    """The node under test, its log with it."""

    def __init__(self, **parameters):
        start_ros()
        self.lines, self.status_topic = [], None
        if rospy.has_param("/octosurf"):  # of a node before
            rospy.delete_param("/octosurf")
        words = [f"_{name.replace('__', '/')}:={value}" for name, value in parameters.items()]
        self.follow([NODE, *words])

    def follow(self, words):
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.reader = threading.Thread(target=lambda: self.lines.extend(iter(self.process.stdout.readline, "")))
        self.reader.start()

    def wait_until_ready(self):
        wait_for(lambda: self.logged("ready") or self.process.poll() is not None, "the node")
        assert self.process.poll() is None, f"it ended with {self.end()}: {self.log()}"
        self.status_topic = Topic("status", "octosurf_msgs/Status")
        self.status_topic.next()
        return self

    def log(self):
        return "".join(self.lines)

    def logged(self, text):
        return text in self.log()

    def status(self):
        return self.status_topic.messages[-1]

    def call(self, name, kind, /, **request):
        service = f"/octosurf/{name}"
        rospy.wait_for_service(service, PATIENCE)
        module = __import__("octosurf_msgs.srv", fromlist=[kind])
        return rospy.ServiceProxy(service, getattr(module, kind))(**request)

    def end(self, signal=2):
        """Its exit code. 2 is Ctrl-C."""
        if self.status_topic:
            self.status_topic.subscriber.unregister()
        if self.process.poll() is None:
            self.process.send_signal(signal)
        code = self.process.wait(PATIENCE)
        self.reader.join()
        self.process.stdout.close()
        return code


class Topic:
    """The messages that came on one of the node's topics."""

    def __init__(self, name, kind):
        package, message = kind.split("/")
        self.kind = getattr(__import__(f"{package}.msg", fromlist=[message]), message)
        self.messages = []
        self.subscriber = rospy.Subscriber(f"/octosurf/{name}", self.kind, self.messages.append)

    def next(self, condition=lambda message: True):
        return wait_for(lambda: next((m for m in reversed(self.messages) if condition(m)), None), self.subscriber.name)


def recording_as_bag(name, simulate, packing):
    """A simulated room as a bag, written by ROS' own library."""
    folder, bag = FOLDER / name, FOLDER / f"{name}.bag"
    if bag.exists():
        return bag
    octosurf("simulate", "room", "-o", folder, *simulate)
    if not (folder / "poses.txt").exists():
        write_poses(folder)
    subprocess.run([sys.executable, SOURCE / "test/io/readers/write_bag.py", folder, bag, *packing], check=True)
    return bag


def quaternion(R):
    """x, y, z, w, from whichever of them is large enough to divide by."""
    squares = [(1 + s[0] * R[0][0] + s[1] * R[1][1] + s[2] * R[2][2]) / 4
               for s in ((1, -1, -1), (-1, 1, -1), (-1, -1, 1), (1, 1, 1))]
    sums = {(0, 1): R[1][0] + R[0][1], (0, 2): R[0][2] + R[2][0], (1, 2): R[2][1] + R[1][2],
            (0, 3): R[2][1] - R[1][2], (1, 3): R[0][2] - R[2][0], (2, 3): R[1][0] - R[0][1]}
    largest = max(range(4), key=lambda i: squares[i])
    value = squares[largest] ** 0.5
    return [value if i == largest else sums[min(i, largest), max(i, largest)] / (4 * value) for i in range(4)]


def write_poses(folder):
    """frame-*.pose.txt as poses with quaternions, which bags have."""
    lines = []
    for file in sorted(folder.glob("frame-*.pose.txt")):
        T = [[float(word) for word in row.split()] for row in file.read_text().splitlines() if row.strip()]
        x, y, z, w = quaternion(T)
        lines.append(" ".join(repr(v) for v in (T[0][3], T[1][3], T[2][3], x, y, z, w)))
        file.unlink()
    (folder / "poses.txt").write_text("\n".join(lines) + "\n")


class Player:
    """Publishes a bag's messages, scan by scan, as a robot does."""

    def __init__(self, bag):
        start_ros()
        self.scans, self.statics, waiting = [], [], []
        self.publishers = {}
        with rosbag.Bag(str(bag)) as recorded:
            for topic, message, _ in recorded.read_messages():
                if topic == "/tf_static":
                    self.statics += message.transforms
                    continue
                waiting.append((topic, message))
                if message._type in ("sensor_msgs/PointCloud2", "sensor_msgs/Image"):
                    self.scans.append(waiting)
                    waiting = []
        for topic, message in [pair for scan in self.scans for pair in scan]:
            if topic not in self.publishers:
                self.publishers[topic] = rospy.Publisher(topic, type(message), queue_size=1000)
        if self.statics:
            self.publishers["/tf_static"] = rospy.Publisher("/tf_static", tf2_msgs.msg.TFMessage, latch=True, queue_size=1)
            self.publishers["/tf_static"].publish(tf2_msgs.msg.TFMessage(self.statics))

    def connect(self):
        for topic, publisher in self.publishers.items():
            wait_for(lambda: publisher.get_num_connections() > 0, f"a subscriber of {topic}")

    def publish(self, scan, tf_last=False):
        """With `tf_last` the poses come after what they are of."""
        messages = sorted(self.scans[scan], key=lambda pair: pair[0] == "/tf") if tf_last else self.scans[scan]
        for topic, message in messages:
            self.publishers[topic].publish(message)

    def play(self, node, scans):
        """One after the other, each when the one before it is mapped."""
        for scan in scans:
            before = node.status()
            self.publish(scan, tf_last=scan % 2 == 1)
            wait_for(lambda: node.status().mapped > before.mapped or node.status().refused > before.refused,
                     f"scan {scan}")
            assert node.status().refused == before.refused, node.log()

    def close(self):
        for publisher in self.publishers.values():
            publisher.unregister()
