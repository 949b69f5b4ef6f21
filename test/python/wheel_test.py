"""`pip install .` into a fresh environment, without a network, and the module used from elsewhere."""

import os
import subprocess
import sys
import unittest

import world

BACKEND = world.SOURCE / "bindings/python/build_backend"

PROGRAM = """
import numpy as np, octosurf
assert octosurf.__file__.startswith({environment!r}), octosurf.__file__
x, y = np.meshgrid(np.arange(0, 1, 0.01), np.arange(0, 1, 0.01))
mapper = octosurf.Mapper()
mapper.insert_points(np.stack([x, y, np.full_like(x, 1)], axis=-1), np.diag([1.0, -1, -1, 1]))
(surface,) = mapper.snapshot().surfaces
assert octosurf.nearest(mapper.snapshot(), [0.5, -0.5, 0]).id == surface.id
"""


def clean_environment():
    """Without what would help pip: an index that refuses every connection, so that whoever fetches fails."""
    kept = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "PIP_NO_INDEX")}
    return kept | {"PIP_INDEX_URL": "http://127.0.0.1:9/", "PIP_RETRIES": "0", "PIP_CONFIG_FILE": os.devnull}


class Progress(unittest.TestCase):
    """How far a build has come, on the terminal of a user whose pip keeps the backend's output."""

    def test_is_one_line_on_the_terminal(self):
        # Stands for CMake: two steps as Ninja prints them, one as make does, and a line that is none.
        steps = world.FOLDER / "steps"
        steps.write_text("[1/3] one\n[3/3] three\n[ 50%] half\nnone [9/9]\n")
        run = f"{sys.executable} -c 'import octosurf_wheel; octosurf_wheel.run(\"cat\", \"{steps}\")' > {world.FOLDER}/kept"
        environment = os.environ | {"PYTHONPATH": str(BACKEND)}
        shown = subprocess.run(["script", "-qec", run, os.devnull], env=environment, check=True, capture_output=True).stdout
        self.assertEqual([line.split(" built")[0].strip() for line in shown.decode().split("\r\x1b[K")[1:]],
                         ["octosurf: 1 of 3", "octosurf: 3 of 3", "octosurf: 50%"])
        self.assertNotIn(b"\n", shown)
        # Without a terminal all is printed as well.
        subprocess.run(["sh", "-c", run + ".alone"], env=environment, start_new_session=True, check=True)
        for kept in ("kept", "kept.alone"):
            self.assertIn("none [9/9]", (world.FOLDER / kept).read_text())


class Wheel(unittest.TestCase):
    def test_metadata_takes_no_build(self):
        empty = world.FOLDER / "empty"  # a PATH without CMake
        empty.mkdir()
        done = subprocess.run([sys.executable, "-m", "pip", "install", "--dry-run", "--no-deps", "--ignore-installed",
                               "--break-system-packages", world.SOURCE],
                              env=clean_environment() | {"PATH": str(empty)}, capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"Would install octosurf-\d")

    def test_of_another_python_is_refused(self):
        code = ("import octosurf_wheel, sysconfig\n"
                "sysconfig.get_config_vars()['EXT_SUFFIX'] = '.cpython-20-x86_64-linux-gnu.so'\n"
                f"octosurf_wheel.build_wheel({str(world.FOLDER)!r}, {{'build-dir': {str(world.BUILD)!r}, 'jobs': 1}})")
        done = subprocess.run([sys.executable, "-c", code], env=os.environ | {"PYTHONPATH": str(BACKEND)},
                              capture_output=True, text=True)
        self.assertNotEqual(done.returncode, 0)
        self.assertIn("is for another Python", done.stderr)

    def test_installs_offline_and_works(self):
        environment = world.FOLDER / "environment"
        # NumPy is Debian's: without a network there is no other.
        subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", environment], check=True)
        python = environment / "bin/python"
        clean = clean_environment()
        subprocess.run([python, "-m", "pip", "install", "--no-warn-script-location", world.SOURCE,
                        "--config-settings", f"build-dir={world.BUILD}", "--config-settings", "jobs=1"],
                       check=True, env=clean)
        subprocess.run([python, "-c", PROGRAM.format(environment=str(environment))], check=True, env=clean,
                       cwd=world.FOLDER)
