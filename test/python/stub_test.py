"""mypy accepts the types that the build writes, and the examples that use them."""

import shutil
import subprocess
import unittest

import world

STUB = world.BUILD / "python/octosurf/__init__.pyi"


class Stub(unittest.TestCase):
    def test_is_checked_by_mypy(self):
        mypy = shutil.which("mypy", path="/usr/bin")  # Debian's, which sees Debian's NumPy
        if not mypy:
            self.skipTest("mypy is not installed")
        examples = [file for file in sorted((world.SOURCE / "examples").glob("*.py"))
                    if "import octosurf" in file.read_text() and "rospy" not in file.read_text()]  # ROS has no types
        self.assertTrue(examples)
        settings = world.FOLDER / "mypy.ini"
        settings.write_text("[mypy]\nstrict = True\n[mypy-matplotlib.*,ompl.*,coal.*,pinocchio.*,example_robot_data.*]\nignore_missing_imports = True\n")
        for file in [STUB, *examples]:
            checked = subprocess.run([mypy, "--config-file", settings, "--cache-dir", world.FOLDER / "mypy", file],
                                     capture_output=True, text=True,
                                     env={"MYPYPATH": str(world.BUILD / "python"), "PATH": "/usr/bin:/bin"})
            self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)
