"""A stranger's catkin workspace: both packages built against an installed octosurf, started by the launch file, mapping."""

import os
import pathlib
import shlex
import shutil
import subprocess
import sys
import unittest

from ros_world import FOLDER, SOURCE, Node, Player, octosurf, recording_as_bag, start_ros, wait_for

BUILD = pathlib.Path(os.environ["OCTOSURF_BUILD"])
WORKSPACE = FOLDER / "workspace"

if not shutil.which("catkin_make") or not pathlib.Path("/usr/share/message_generation").exists():
    print("skipped: no catkin (./dev test installs it)")
    sys.exit(77)


def run(*words, **more):
    done = subprocess.run([str(word) for word in words], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, **more)
    assert done.returncode == 0, done.stdout[-5000:]


def launched(*words):
    """Words of a command as they run in the workspace's environment."""
    return ["bash", "-c", f"source {WORKSPACE}/devel/setup.bash && exec {shlex.join(map(str, words))}"]


class LaunchedNode(Node):
    def __init__(self, *arguments):
        start_ros()
        self.lines, self.status_topic = [], None
        self.follow(launched("roslaunch", "octosurf_ros", "octosurf.launch", *arguments))


class CatkinWorkspace(unittest.TestCase):
    def test_builds_and_maps(self):
        prefix = FOLDER / "prefix"
        run("cmake", "--install", BUILD, "--prefix", prefix)
        packages = WORKSPACE / "src"
        packages.mkdir(parents=True)
        for package in ("octosurf_msgs", "octosurf_ros"):  # copies: nothing of the checkout around them is seen
            shutil.copytree(SOURCE / "ros/ros1" / package, packages / package)
        path = "/usr/bin:/bin:" + os.environ["PATH"]  # catkin's Python is Debian's
        run("catkin_make", "-C", WORKSPACE, "-j1", "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_PREFIX_PATH={prefix}",
            "-DPYTHON_EXECUTABLE=/usr/bin/python3", env=os.environ | {"PATH": path})

        bag = recording_as_bag("clouds", ["--sensor", "spinning", "--frames", "2"], [])
        octosurf("map", bag, "-o", FOLDER / "offline", "--forget-scans")
        player = Player(bag)
        node = LaunchedNode("cloud:=/lidar/points", f"map:={FOLDER / 'launched'}").wait_until_ready()
        self.addCleanup(node.end)
        player.connect()
        player.play(node, range(2))
        self.assertEqual(node.end(), 0, node.log())
        wait_for((FOLDER / "launched.surfaces").exists, "the map")
        for ending in ("surfaces", "bt"):
            self.assertTrue((FOLDER / f"launched.{ending}").read_bytes() == (FOLDER / f"offline.{ending}").read_bytes())


if __name__ == "__main__":
    start_ros()
    unittest.main(verbosity=2)
