"""Each rule of check_architecture.py and check_size.py, broken once in a small house."""

import json
import pathlib
import subprocess
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
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.write("docs/design.md", DESIGN)
        for room in ROOMS:
            self.write(f"src/{room}/{room}.hpp", "#pragma once\n")
        self.write("src/top/b.hpp", '#include "top/top.hpp"\n')
        for i in range(11):
            self.write(f"include/octosurf/public{i}.hpp", "#include <vector>\n#include <Eigen/Core>\n")
        self.write("lab/made/made.hpp", "#pragma once\n")
        self.write("lab/main.cpp", '#include "made/made.hpp"\n')
        self.write("apps/main.cpp", '#include "bottom/bottom.hpp"\n')

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

    def test_arrows_in_a_circle(self):
        self.write("docs/design.md", DESIGN.replace("→ bottom", "→ bottom → top"))
        found = list(check_architecture.problems(self.root))
        self.assertEqual([line.split()[-4] for line in found], ["bottom", "middle", "top"], found)

    def test_each_rule_names_what_breaks_it(self):
        for path, text, told in (
                ("src/bottom/a.cpp", '#include "middle/middle.hpp"\n', "bottom → middle is no arrow"),
                ("src/top/a.hpp", '  #  include "side/side.hpp"\n', "top → side is no arrow"),
                ("apps/main.cpp", '#include "made/made.hpp"\n', "apps → made is no arrow"),
                ("docs/design.md", DESIGN.replace("side", "cellar"), "cellar"),
                ("src/top/top.hpp", '#include "top/b.hpp"\n', "include each other"),
                ("src/top/public3.hpp", "", "called like"),
                ("include/octosurf/public3.hpp", "#include <CGAL/Point_2.h>\n", "CGAL")):
            with self.subTest(told):
                file = self.root / path
                before = file.read_text() if file.exists() else None
                self.write(path, text)
                self.assertIn(told, self.problem())
                file.unlink()
                if before is not None:
                    self.write(path, before)

    def test_a_declaration_in_another_rooms_namespace(self):
        self.write("src/top/a.hpp", "namespace octosurf {\nstruct Forward;\n}\nnamespace octosurf::top {\nint a();\n}\n")
        self.write("src/top/steps/b.hpp", "namespace octosurf::steps {\nint b();\n}\n")
        self.assertEqual(list(check_architecture.problems(self.root)), [])
        self.write("src/side/a.hpp", "namespace octosurf {\n\nint a();\n\n}\n")
        self.assertEqual(self.problem(), "src/side/a.hpp declares in octosurf, not in octosurf::side")

    def test_counts(self):
        self.write("lab/made/more.cpp", "int a;\nint b;\n")
        self.write("lab/test/test.cpp", "int c;\n")
        self.write("bench/bench.cpp", "int d;\n")
        self.write("apps/CMakeLists.txt", "\n")
        self.write("dev", "\n\n")
        self.write("lab/node_modules/foreign.js", "\n\n\n")
        self.write("lab/notes.md", "\n")
        self.write("README.md", "Three plain words.\n")
        self.write("CHANGELOG.md", "")
        self.write("include/octosurf/public3.hpp", "struct A {\n  enum class B { c };\n};\nclass D;\nstruct A f() {\n")
        self.write("src/top/a.cpp", "constexpr double half_m = f(0.5, 1), third_m = 1. / 3;\nconstexpr std::uint8_t two{2};\nconstexpr const char* text = 0;\n"
                   "int many(int a) {\n" + "if (a) ++a;\n" * check_size.BRANCHES + "return a;\n}\nint few(int a) { return a ? 1 : 2; }\n")
        for source in check_size.FLAG_SOURCES:
            self.write(source, "")
        self.write(check_size.FLAG_SOURCES[0], 'verb->add_option("-o,--output", a, "see --force");\nverb.add_flag(\n    "--force", b);\n'
                   'verb.add_option("input", c);\nverb.add_option_function<std::vector<int>>(\n  "--origin", d);\n')
        self.write(check_size.FLAG_SOURCES[-1], '(o, {"hit", "", "probability"}, {"up_x", "", "x"}\n')
        counts = check_size.counts_of(self.root)
        words = len(DESIGN.split()) + 3
        product = counts.pop("product")
        self.assertEqual(counts.pop("complex functions", 1), 1)  # only where lizard is
        self.assertEqual(counts, {"lab": 4, "product and lab": product + 4, "tests": 1, "bench": 1, "CMake and dev": 3, "words": words,
                                  "public types": 2, "constants": 3, "flags of map": 4})

    def test_a_count_may_not_outgrow_its_ceiling(self):
        ceilings = {"tests": 1000}
        self.assertEqual(list(check_size.problems({"tests": 1000}, ceilings)), [])
        self.assertEqual(list(check_size.problems({"tests": 9}, ceilings)), [])
        self.assertIn("1001 is above 1000", *check_size.problems({"tests": 1001}, ceilings))

    def test_lower_ceilings_leave_room_and_none_rises(self):
        ceilings = {"tests": 1000, "lab": 90, "public types": 9}
        self.assertEqual(check_size.lowered({"tests": 600, "lab": 80, "public types": 4}, ceilings),
                         {"tests": 900, "lab": 90, "public types": 6})

    def test_no_commit_may_raise_a_ceiling(self):
        def commit(ceilings):
            self.write("test/architecture/size.json", json.dumps({"ceilings": ceilings}))
            for words in (["add", "."], ["-c", "user.name=a", "-c", "user.email=a@b", "commit", "-qm", "a"]):
                subprocess.run(["git", "-C", self.root, *words], check=True)
            return list(check_size.raised(check_size.versions(self.root)))

        subprocess.run(["git", "init", "-q", self.root], check=True)
        self.assertEqual(list(check_size.versions(self.root)), [])
        self.assertEqual(commit({"lab": 9, "words": 5}), [])
        self.assertEqual(commit({"lab": 7, "words": 5}), [])
        self.assertIn("raised the ceiling of lab to 8", *commit({"lab": 8, "words": 5}))
        self.assertIn("raised the ceiling of lab to 8", *commit({"lab": 6, "words": 5}))  # lowering it again mends nothing
        self.assertEqual(len(commit({"lab": 6})), 2)

if __name__ == "__main__":
    unittest.main()
