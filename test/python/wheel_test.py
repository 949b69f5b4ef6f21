"""The wheel of ./dev wheel, in a Python that has nothing of Debian."""

import os
import pathlib
import re
import subprocess
import sys
import unittest

import world

PROGRAM = """
import numpy as np, octosurf
x, y = np.meshgrid(np.arange(0, 1, 0.01), np.arange(0, 1, 0.01))
mapper = octosurf.Mapper()
mapper.insert_points(np.stack([x, y, np.full_like(x, 1)], axis=-1), np.diag([1.0, -1, -1, 1]))
(surface,) = mapper.snapshot().surfaces
assert octosurf.SurfaceIndex(mapper.snapshot()).nearest([0.5, -0.5, 0]).id == surface.id
print(octosurf._octosurf.__file__)
"""


class Wheel(unittest.TestCase):
    def test_maps_and_has_its_libraries_and_types(self):
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        subprocess.run([world.SOURCE / "dev", "wheel"], env=environment, check=True)
        subprocess.run([sys.executable, "-m", "pip", "install", "--no-index", "--no-deps", "--target", world.FOLDER,
                        *(world.SOURCE / "out/wheel").glob("*.whl")], env=environment, check=True)
        module = subprocess.run([sys.executable, "-c", PROGRAM], env=environment, cwd=world.FOLDER, check=True,
                                capture_output=True, text=True).stdout.strip()
        self.assertEqual(pathlib.Path(module).parent, world.FOLDER / "octosurf")
        linked = subprocess.run(["ldd", module], check=True, capture_output=True, text=True).stdout
        outside = [name for name, path in re.findall(r"(\S+)\.so\S* => (\S+)", linked) if str(world.FOLDER) not in path]
        self.assertLessEqual(set(outside), {"libc", "libm", "libstdc++", "libgcc_s", "libz"})  # manylinux has these
        # Another pybind11 than the build's has written these docstrings; stub_test has mypy check the build's.
        types = [folder / "octosurf/__init__.pyi" for folder in (world.FOLDER, world.BUILD / "python")]
        self.assertEqual(*[file.read_text() for file in types])
