"""Each rule of check_architecture.py and check_size.py, broken once in a small house."""

import pathlib
import tempfile
import unittest

import check_architecture
import check_size

DESIGN = """A room includes public headers, its own, and those of the rooms behind its arrow:

```text
apps → all          top, side → middle → bottom
lab → all           made → top
```
"""
ROOMS = ["top", "side", "middle", "bottom", "fifth", "sixth"]


class House(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.root = pathlib.Path(self.folder.name)
        self.write("docs/design.md", DESIGN)
        for room in ROOMS:
            self.write(f"src/{room}/{room}.hpp", "#pragma once\n")
        for i in range(11):
            self.write(f"include/octosurf/public{i}.hpp", "#include <vector>\n#include <Eigen/Core>\n")
        self.write("lab/made/made.hpp", "#pragma once\n")
        self.write("lab/main.cpp", '#include "made/made.hpp"\n')
        self.write("apps/main.cpp", '#include "bottom/bottom.hpp"\n')

    def tearDown(self):
        self.folder.cleanup()

    def write(self, path, text):
        file = self.root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text)

    def problem(self):
        found = list(check_architecture.problems(self.root))
        self.assertEqual(len(found), 1, found)
        return found[0]

    def test_a_house_in_order_has_no_problem(self):
        self.write("src/top/a.cpp", '#include "middle/middle.hpp"\n#include "bottom/bottom.hpp"\n#include <cmath>\n')
        self.assertEqual(list(check_architecture.problems(self.root)), [])

    def test_an_arrow_up(self):
        self.write("src/bottom/a.cpp", '#include "middle/middle.hpp"\n')
        self.assertIn("bottom → middle is no arrow", self.problem())

    def test_an_arrow_aside(self):
        self.write("src/top/a.hpp", '  #  include "side/side.hpp"\n')
        self.assertIn("top → side is no arrow", self.problem())

    def test_an_arrow_into_the_laboratory(self):
        self.write("apps/main.cpp", '#include "made/made.hpp"\n')
        self.assertIn("apps → made is no arrow", self.problem())

    def test_arrows_in_a_circle(self):
        self.write("docs/design.md", DESIGN.replace("→ bottom", "→ bottom → top"))
        found = list(check_architecture.problems(self.root))
        self.assertEqual([line.split()[-4] for line in found], ["bottom", "middle", "top"], found)

    def test_an_arrow_of_no_room(self):
        self.write("docs/design.md", DESIGN.replace("side", "cellar"))
        self.assertIn("cellar", self.problem())

    def test_headers_in_a_circle(self):
        self.write("src/top/a.hpp", '#include "top/b.hpp"\n')
        self.write("src/top/b.hpp", '#include "top/a.hpp"\n')
        self.assertIn("include each other", self.problem())

    def test_a_header_called_like_a_public_one(self):
        self.write("src/top/public3.hpp", "")
        self.assertIn("called like", self.problem())

    def test_a_declaration_in_another_rooms_namespace(self):
        self.write("src/top/a.hpp", "namespace octosurf {\nstruct Forward;\n}\nnamespace octosurf::top {\nint a();\n}\n")
        self.write("src/top/steps/b.hpp", "namespace octosurf::steps {\nint b();\n}\n")
        self.assertEqual(list(check_architecture.problems(self.root)), [])
        self.write("src/side/a.hpp", "namespace octosurf {\n\nint a();\n\n}\n")
        self.assertEqual(self.problem(), "src/side/a.hpp declares in octosurf, not in octosurf::side")

    def test_a_heavy_public_header(self):
        self.write("include/octosurf/public3.hpp", "#include <CGAL/Point_2.h>\n")
        self.assertIn("CGAL", self.problem())

    def test_lines_are_those_of_sources_without_what_is_left_out(self):
        self.write("lab/made/more.cpp", "int a;\nint b;\n")
        self.write("lab/test/test.cpp", "int c;\n")
        self.write("lab/node_modules/foreign.js", "\n\n\n")
        self.write("lab/notes.md", "\n")
        self.assertEqual(check_size.lines_in(self.root, ["lab", "-lab/test"]), 4)
        self.assertEqual(check_size.lines_in(self.root, ["lab"]), 5)

    def test_a_room_may_neither_outgrow_its_limit_nor_fall_far_below_it(self):
        limits = {"top": 100}
        self.assertEqual(list(check_size.problems({"top": 100}, limits)), [])
        self.assertEqual(list(check_size.problems({"top": 97}, limits)), [])
        self.assertIn("1 lines more", *check_size.problems({"top": 101}, limits))
        self.assertIn("lower its limit to 96", *check_size.problems({"top": 96}, limits))


if __name__ == "__main__":
    unittest.main()
