"""The examples run as a reader runs them, and the code in docs/usage.md does."""

import json
import re
import subprocess
import sys
import unittest

import octosurf
import world


class Examples(unittest.TestCase):
    def run_python(self, *arguments):
        return subprocess.run([sys.executable, *map(str, arguments)], check=True, capture_output=True, text=True,
                              cwd=world.FOLDER).stdout

    def test_kitchen(self):
        picture = world.FOLDER / "kitchen.png"
        told = self.run_python(world.SOURCE / "examples/kitchen.py", world.recording(), "--picture", picture)
        self.assertRegex(told, r"\d+ surfaces")
        self.assertRegex(told, r"steps|no plan: ")
        self.assertGreater(picture.stat().st_size, 10000)

    def test_sl1m_load(self):
        pieces = world.FOLDER / "office.json"
        world.command("export", world.SOURCE / "maps/office", "--to", pieces, "--format", "sl1m", "--foot", "0.22x0.12")
        told = self.run_python(world.SOURCE / "examples/sl1m_load.py", pieces)
        self.assertIn(f"{len(json.loads(pieces.read_text()))} convex pieces", told)

    def test_what_the_docs_show_runs(self):
        text = (world.SOURCE / "docs/usage.md").read_text().split("## Python", 1)[1].split("\n## ", 1)[0]
        code = "\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL))
        names = {"recording": str(world.recording()), "octosurf": octosurf}
        (world.FOLDER / "maps").mkdir(exist_ok=True)
        exec(code.replace('"kitchen"', "recording").replace('"maps/', f'"{world.FOLDER}/maps/'), names)
        self.assertGreater(len(names["snapshot"]), 3)


if __name__ == "__main__":
    unittest.main()
