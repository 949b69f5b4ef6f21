"""octosurf/__init__.pyi says what is in the module, and nothing else; mypy takes it and the examples that use it."""

import shutil
import subprocess
import sys
import unittest

import world

STUB = world.SOURCE / "bindings/python/octosurf/__init__.pyi"


class Stub(unittest.TestCase):
    def test_is_what_the_module_says(self):
        made = subprocess.run([sys.executable, world.SOURCE / "bindings/python/stubs/make_stub.py"], check=True,
                              capture_output=True, text=True).stdout
        self.assertEqual(made, STUB.read_text(), "make it anew: bindings/python/stubs/make_stub.py says how")

    def test_is_checked_by_mypy(self):
        if not shutil.which("mypy", path="/usr/bin:/usr/local/bin"):
            self.skipTest("mypy is not installed")
        examples = sorted((world.SOURCE / "examples").glob("*.py"))
        self.assertTrue(examples)
        cache = world.FOLDER / "mypy"
        for file in [STUB, *examples]:
            checked = subprocess.run(["/usr/bin/mypy", "--strict", "--cache-dir", cache, file], capture_output=True,
                                     text=True, env={"MYPYPATH": str(world.BUILD / "python"), "PATH": "/usr/bin:/bin"})
            self.assertEqual(checked.returncode, 0, checked.stdout + checked.stderr)


if __name__ == "__main__":
    unittest.main()
