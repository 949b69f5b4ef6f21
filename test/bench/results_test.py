#!/usr/bin/env python3
"""What results.py promises: only rows of the present commit are shown, and what is missing is said."""

import contextlib
import io
import json
import pathlib
import re
import tempfile
import types
import unittest

import results
import results_tables
import results_tasks

SOURCE = pathlib.Path(__file__).resolve().parents[2]


def accuracy_row(scene, correct):
    shares = dict.fromkeys(("coverage", "worst_coverage", "unsafe_share", "worst_unsafe_share"), 0.5)
    lengths = dict.fromkeys(("normal_mean_deg", "normal_max_deg", "offset_mean_mm", "multiplicity", "worst_multiplicity"), 1.0)
    counts = dict.fromkeys(("over_segmented", "under_segmented", "missed", "noise"), 0)
    return {"method": "ours/default", "scene": scene, "seeds": [1, 2], "faces": 1000, "correct": correct,
            **shares, **lengths, **counts}


def options(**changed):
    return types.SimpleNamespace(**{"quick": False, "seeds": 10, "budget": None, "again": False, **changed})


class Results(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        (self.folder / "docs").mkdir()
        (self.folder / "README.md").write_text("above\n<!-- demo -->\nold\n<!-- /demo -->\nbetween\n"
                                               "<!-- results -->\n| old | 54.9 % |\n<!-- /results -->\nbelow\n", encoding="utf-8")
        saved = results.ROOT, results.STORE, results.DATA
        self.addCleanup(lambda: setattr(results, "ROOT", saved[0]) or setattr(results, "STORE", saved[1])
                        or setattr(results, "DATA", saved[2]))
        results.ROOT, results.STORE, results.DATA = self.folder, self.folder / "store", self.folder / "data"
        results.STORE.mkdir()

    def store(self, name, commit, content, quick=False):
        record = {"commit": commit, "date": "2000-01-01", "machine": "a machine", "load": 0.0, "seconds": 60.0,
                  "quick": quick, "seeds": 10, "content": content}
        (results.STORE / f"{name}.json").write_text(json.dumps(record), encoding="utf-8")

    def written(self, commit="new"):
        with contextlib.redirect_stdout(io.StringIO()):
            results.write_documents(options(), commit, {})
        return (self.folder / "docs/results.md").read_text(encoding="utf-8"), \
            (self.folder / "README.md").read_text(encoding="utf-8")

    def run_all(self, tasks, **changed):
        with contextlib.redirect_stdout(io.StringIO()):
            return results.run_all(tasks, options(**changed), "new")

    def test_rows_of_another_commit_are_not_shown(self):
        self.store("depth", "old", [accuracy_row("all", 877)])
        document, readme = self.written()
        self.assertNotIn("87.7", document + readme)
        self.assertNotIn("54.9", readme)
        self.assertIn("`depth`: depth camera, d = 2 cm | not measured at this commit", document)
        self.store("depth", "new", [accuracy_row("all", 912), accuracy_row("room", 713)])
        document, readme = self.written()
        for text in (document, readme):
            self.assertIn("91.2 % of 1000 faces correct", text)
        self.assertIn("71.3 % of 1000", document)
        self.assertIn("| `depth`: depth camera, d = 2 cm | new | 2000-01-01 | a machine |", document)
        self.assertTrue(readme.startswith("above\n") and readme.endswith("below\n") and "between\n" in readme)

    def test_quick_rows_say_so_and_do_not_stand_for_full_ones(self):
        self.store("depth", "new", [accuracy_row("all", 912)], quick=True)
        self.assertIn("1.0 min, quick form", self.written()[0])
        self.assertTrue(results.is_present(results.stored(results_tasks.tasks_of(["depth"])[0]), "new", quick=True))
        self.assertFalse(results.is_present(results.stored(results_tasks.tasks_of(["depth"])[0]), "new", quick=False))

    def test_a_damaged_record_is_none(self):
        (results.STORE / "depth.json").write_text('{"commit": "new"', encoding="utf-8")
        self.assertIn("not measured at this commit", self.written()[1])

    def test_a_task_is_stored_whole_or_not_at_all(self):
        def task(script):
            return results_tasks.Task("g", "t", "a task", "", lambda _, output: ["sh", "-c", script.replace("OUT", str(output))],
                                      0, 0)
        self.assertEqual(self.run_all([task("echo '[1]' > OUT; echo no more memory; exit 3")]),
                         {"t": "exit code 3: no more memory"})
        self.assertIn("left no numbers", self.run_all([task("echo '[1' > OUT")])["t"])
        self.assertEqual(list(results.STORE.glob("*.json")), [])
        self.assertEqual(self.run_all([task("echo '[1]' > OUT")]), {})
        self.assertEqual(results.stored(task(""))["content"], [1])
        self.assertEqual(self.run_all([task("exit 1")]), {}, "measured already")
        self.assertEqual(self.run_all([task("exit 1")], again=True)["t"][:11], "exit code 1")

    def test_the_budget_and_missing_data_are_reasons(self):
        slow = results_tasks.Task("g", "slow", "an hour", "", lambda *_: ["false"], 60, 60)
        data = results_tasks.Task("g", "data", "a recording", "", lambda *_: ["false"], 0, 0, needs="kitchen")
        self.assertEqual(self.run_all([slow, data], budget=5),
                         {"slow": "takes about 60 min, beyond the budget", "data": "no ../shared/data/kitchen"})

    def test_the_readme_shows_what_the_document_does(self):
        document = SOURCE / "docs/results.md"
        block = re.search(r"<!-- results -->\n(.*?)<!-- /results -->", (SOURCE / "README.md").read_text(encoding="utf-8"), re.DOTALL)[1]
        text = document.read_text(encoding="utf-8")
        self.assertEqual(re.search(r"at commit (\S+);", block)[1], re.search(r"at commit \*\*(\S+)\*\*", text)[1])
        rows = re.findall(r"^\| (.+?) \| (.+?) \| `./dev bench results", block, re.MULTILINE)
        self.assertEqual(len(rows), len(results_tables.ten({})))
        for what, result in rows:
            self.assertIn(f"| {what} | {result} | `--only", text)


if __name__ == "__main__":
    unittest.main()
