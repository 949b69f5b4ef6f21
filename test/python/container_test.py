"""The Dockerfile: its packages are those of ./dev, and where CI has Docker the image is built and used.

Elsewhere nobody waits half an hour for an image: CI=1 in the environment asks for it. Without Docker, or without a network
to pull Debian from, that part is skipped."""

import os
import re
import shutil
import subprocess
import unittest

import world

DOCKERFILE = (world.SOURCE / "Dockerfile").read_text()
IMAGE = "octosurf-test"


def skip_reason():
    """Why the image is not built here; None: it is."""
    if not os.environ.get("CI"):
        return "CI is not set"
    if not shutil.which("docker"):
        return "no Docker"
    for what, command in (("Docker does not run", ["info"]), ("no base image", ["pull", "--quiet", "debian:12-slim"])):
        if subprocess.run(["timeout", "300", "docker", *command], capture_output=True).returncode != 0:
            return what
    return None


class Packages(unittest.TestCase):
    def test_are_those_that_dev_installs(self):
        installed = re.findall(r"apt-get install -y --no-install-recommends (.*?)(?:&&|<)", DOCKERFILE, re.DOTALL)
        self.assertEqual(len(installed), 2)
        names = set(" ".join(installed).replace("\\", " ").split())
        self.assertIn("g++", names)
        dev = (world.SOURCE / "dev").read_text()
        lists = re.findall(r"^(?:command|python)_packages=\((.*?)\)$", dev, re.DOTALL | re.MULTILINE)
        self.assertEqual(len(lists), 2)
        known = set(re.sub(r"#.*", "", "\n".join(lists)).split())
        # npm's own: ./dev installs it only where it is missing. Certificates: a bare image has none.
        self.assertLessEqual(names, known | {"nodejs", "npm", "ca-certificates"} | {"python3"})

    def test_of_libraries_are_found_by_what_the_command_is_linked_with(self):
        """The pipe of the Dockerfile, on the command of this build."""
        if not shutil.which("dpkg-query"):
            self.skipTest("not Debian")
        (pipe,) = re.findall(r"^RUN (ldd .*?) > packages$", DOCKERFILE, re.DOTALL | re.MULTILINE)
        pipe = pipe.replace("\\\n", " ").replace("build/container/bin/octosurf", os.environ["OCTOSURF"])
        pipe = pipe.replace("build/container/python/octosurf/*.so", f"{world.BUILD}/python/octosurf/*.so")
        done = subprocess.run(["sh", "-c", pipe], check=True, capture_output=True, text=True)
        packages = done.stdout.split()
        for start in ("libstdc++6", "libassimp", "libembree", "libpcl-common", "liboctomap", "libprotobuf"):
            self.assertTrue([one for one in packages if one.startswith(start)], f"{start} is not among {packages}")
        self.assertFalse([one for one in packages if one.startswith("lib32") or one.endswith("-dev")], packages)


class Image(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        if reason := skip_reason():
            raise unittest.SkipTest(reason)
        subprocess.run(["docker", "build", "-t", IMAGE, world.SOURCE], check=True)

    def run_in(self, *command):
        return subprocess.run(["docker", "run", "--rm", "-v", f"{world.FOLDER}:/data", "-u", f"{os.getuid()}:{os.getgid()}",
                               IMAGE, *command], check=True, capture_output=True, text=True).stdout

    def test_maps_and_shows(self):
        self.run_in("octosurf-lab", "simulate", "room", "--frames", "4", "-o", "scans")
        self.run_in("octosurf", "map", "scans", "-o", "maps/room")
        self.run_in("octosurf", "view", "maps/room", "--html", "room.html")
        self.assertGreater((world.FOLDER / "room.html").stat().st_size, 100000)
        surfaces = self.run_in("python3", "-c", "import octosurf; print(octosurf.load('maps/room').size().surfaces)")
        self.assertGreater(int(surfaces), 3)
