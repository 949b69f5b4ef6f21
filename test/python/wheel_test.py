"""`pip install .` into a fresh environment, without a network, and the module used from elsewhere."""

import os
import subprocess
import sys
import unittest

import world

PROGRAM = """
import numpy as np, octosurf
assert octosurf.__file__.startswith({environment!r}), octosurf.__file__
x, y = np.meshgrid(np.arange(0, 1, 0.01), np.arange(0, 1, 0.01))
mapper = octosurf.Mapper()
mapper.insert_points(np.stack([x, y, np.full_like(x, 1)], axis=-1), np.diag([1.0, -1, -1, 1]))
(surface,) = mapper.snapshot().surfaces
assert octosurf.nearest(mapper.snapshot(), [0.5, -0.5, 0]).id == surface.id
"""


class Wheel(unittest.TestCase):
    def test_installs_offline_and_works(self):
        environment = world.FOLDER / "environment"
        # NumPy is Debian's: without a network there is no other.
        subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", environment], check=True)
        python = environment / "bin/python"
        clean = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "PIP_NO_INDEX")}
        # An index that refuses every connection: whoever asks for something to be fetched fails.
        clean |= {"PIP_INDEX_URL": "http://127.0.0.1:9/", "PIP_RETRIES": "0", "PIP_CONFIG_FILE": os.devnull}
        subprocess.run([python, "-m", "pip", "install", "--no-warn-script-location", world.SOURCE,
                        "--config-settings", f"build-dir={world.BUILD}", "--config-settings", "jobs=1"],
                       check=True, env=clean)
        subprocess.run([python, "-c", PROGRAM.format(environment=str(environment))], check=True, env=clean,
                       cwd=world.FOLDER)


if __name__ == "__main__":
    unittest.main()
