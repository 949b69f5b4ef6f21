"""The Dockerfile: its packages are those of ./dev, and of libraries what the command is linked with."""

import os
import re
import shutil
import subprocess
import unittest

import world

DOCKERFILE = (world.SOURCE / "Dockerfile").read_text()


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
