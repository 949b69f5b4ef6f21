"""package.xml of octosurf_ros names what its Python and its launch file need, no more, and nothing that rosdep lacks."""
import ast
import configparser
import pathlib
import re
import sys
import unittest
import xml.etree.ElementTree as ElementTree

PACKAGE = pathlib.Path(__file__).resolve().parents[2] / "ros/octosurf_ros"
KEYS = {"numpy": "python3-numpy", "yaml": "python3-yaml"}  # rosdep's, where a module's name is another
# Message packages that some distributions lack: convex_plane_decomposition_msgs and livox_ros_driver2 are in none,
# grid_map_msgs ends with Kilted. The node starts without them; `octosurf` itself is installed by pip.
WITHOUT_KEY = {"convex_plane_decomposition_msgs", "grid_map_msgs", "livox_ros_driver2", "octosurf", "octosurf_ros"}


def needed_by(file):
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            yield from (one.name.split(".")[0] for one in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module.split(".")[0]
        elif isinstance(node, ast.keyword) and node.arg == "package":  # of a node that is launched
            yield node.value.value
        elif isinstance(node, ast.Constant) and re.fullmatch(r"[a-z]\w+/[A-Z]\w+", str(node.value)):  # a message
            yield node.value.split("/")[0]


class Package(unittest.TestCase):
    def test_names_what_is_imported_and_what_rosdep_knows(self):
        files = [*PACKAGE.glob("octosurf_ros/*.py"), *PACKAGE.glob("launch/*.py")]
        needed = {name for file in files for name in needed_by(file)} - sys.stdlib_module_names
        named = {one.text for one in ElementTree.parse(PACKAGE / "package.xml").iter() if one.tag.endswith("depend")}
        self.assertLessEqual(WITHOUT_KEY, needed)
        self.assertEqual({KEYS.get(name, name) for name in needed - WITHOUT_KEY}, named)

    def test_runs_in_the_python_that_has_octosurf(self):
        """On Ubuntu 24.04 that is a virtual environment's, and colcon runs in the system's."""
        config = configparser.ConfigParser()
        config.read(PACKAGE / "setup.cfg")
        self.assertEqual(config["build_scripts"]["executable"], "/usr/bin/env python3")
