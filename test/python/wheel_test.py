"""The wheel of ./dev wheel in an environment that has nothing of Debian, with the newest NumPy."""

import os
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
assert octosurf.nearest(mapper.snapshot(), [0.5, -0.5, 0]).id == surface.id
print(octosurf.__file__)
"""


class Wheel(unittest.TestCase):
    def test_has_its_libraries_and_types_and_maps(self):
        if not (world.SOURCE / "build/wheel-tools/bin/auditwheel").exists():
            self.skipTest("no auditwheel in build/wheel-tools: ./dev test found no Python package index")
        environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        folder = world.FOLDER / "environment"
        pip = [folder / "bin/pip", "install", "--quiet", "--retries", "1"]
        subprocess.run([sys.executable, "-m", "venv", folder], check=True)
        if subprocess.run([*pip, "numpy"], env=environment).returncode != 0:
            self.skipTest("no Python package index for NumPy")
        subprocess.run([world.SOURCE / "dev", "wheel"], env=environment, check=True)
        subprocess.run([*pip, "--no-index", *(world.SOURCE / "out/wheel").glob("*.whl")], env=environment, check=True)
        package = subprocess.run([folder / "bin/python", "-c", PROGRAM], env=environment, cwd=world.FOLDER, check=True,
                                 capture_output=True, text=True).stdout.strip().removesuffix("__init__.py")
        self.assertTrue(package.startswith(str(folder)), package)
        (extension,) = world.pathlib.Path(package).glob("*.so")
        linked = subprocess.run(["ldd", extension], check=True, capture_output=True, text=True).stdout
        outside = {name for name, path in re.findall(r"(\S+)\.so\S* => (\S+)", linked) if not path.startswith(str(folder))}
        self.assertLessEqual(outside, {"libc", "libm", "libstdc++", "libgcc_s", "libz"})  # manylinux has these
        # By another pybind11, but the types are those that mypy checks: stub_test.
        types = [(world.pathlib.Path(where) / "__init__.pyi").read_text() for where in (package, world.BUILD / "python/octosurf")]
        self.assertEqual(*types)
