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
    return types.SimpleNamespace(**{"seeds": 10, "budget": None, "again": False, **changed})


class Results(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        (self.folder / "docs").mkdir()
        (self.folder / "README.md").write_text("above\n<!-- results -->\n| old | 54.9 % |\n<!-- /results -->\nbelow\n",
                                               encoding="utf-8")
        (self.folder / "docs/demo.md").write_text("above\n<!-- demo -->\nold\n<!-- /demo -->\nbelow\n", encoding="utf-8")
        saved = results.ROOT, results.STORE, results.DATA
        self.addCleanup(lambda: setattr(results, "ROOT", saved[0]) or setattr(results, "STORE", saved[1])
                        or setattr(results, "DATA", saved[2]))
        results.ROOT, results.STORE, results.DATA = self.folder, self.folder / "store", self.folder / "data"
        results.STORE.mkdir()

    def store(self, name, commit, content):
        record = {"commit": commit, "date": "2000-01-01", "machine": "a machine", "load": 0.0, "seconds": 60.0,
                  "seeds": 10, "content": content}
        (results.STORE / f"{name}.json").write_text(json.dumps(record), encoding="utf-8")

    def written(self, commit="new"):
        with contextlib.redirect_stdout(io.StringIO()):
            results.write_documents(commit, {})
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
        self.assertTrue(readme.startswith("above\n") and readme.endswith("below\n"))
        self.assertRegex((self.folder / "docs/demo.md").read_text(encoding="utf-8"), r"above\n(?s:.*)not measured(?s:.*)below\n$")

    def test_long_tasks_run_only_by_name_and_the_rest_in_half_an_hour(self):
        default = results_tasks.tasks_of(results_tasks.GROUPS)
        self.assertEqual([task.name for task in default if task.long], [])
        self.assertLessEqual(sum(results.expected_s(task, options(seeds=1)) for task in default), 30 * 60)
        for name in results_tasks.LONG:
            self.assertEqual(len(results_tasks.tasks_of([*results_tasks.GROUPS, name])), len(default) + 1)
            self.assertRegex(self.written()[0], f"`--long {name}`")

    def test_a_guess_counts_seeds_and_the_last_time_with_as_many_counts_more(self):
        depth = results_tasks.tasks_of(["depth"])[0]
        self.assertAlmostEqual(results.expected_s(depth, options(seeds=3)), 3 * 60 * depth.minutes)
        self.store("depth", "old", [])
        self.assertEqual(results.expected_s(depth, options(seeds=10)), 60)

    def speed(self, digest):
        def run(name, kind, **counters):
            return {"run_name": f"kitchen/d:0.02/{name}/iterations:4/real_time", "label": name, "time_unit": "ms",
                    **({"run_type": "aggregate", "aggregate_name": kind} if kind else {"run_type": "iteration"}), **counters}
        counters = {"heap_bytes": 3000, "tree_bytes": 1000, "leaves": 50, "voxels": 1e6}
        context = {"cpu_model": "a", "num_cpus": 2, "compiler": "g++", "octomap": "1", "pcl": "1", "cgal": "5",
                   "date": "2000-01-01T00", "form": "full form"}
        octomap = [run("octomap", kind, **counters, digest=7, real_time=time)
                   for kind, time in (("", 300.0), ("mean", 260.0), ("median", 250.0), ("cv", 0.03))]
        return {"context": context, "benchmarks": [*octomap, run("occupancy", "", **counters, digest=digest, real_time=10.0)]}

    def test_speed_rows_are_medians_beside_the_other_and_say_where_maps_differ(self):
        self.store("speed-kitchen", "new", self.speed(digest=7))
        document, readme = self.written()
        self.assertIn("| occupancy | octomap | 10.0 ms | 250 ms ± 3 % | 25.0× | 1.00 million voxels equal |", document)
        self.assertIn("60.0 B; OctoMap's pruned tree 60.0 B", readme)
        self.store("speed-kitchen", "new", self.speed(digest=8))
        self.assertIn("**1.00 million voxels differ**", self.written()[0])

    def test_a_damaged_record_is_none(self):
        (results.STORE / "depth.json").write_text('{"commit": "new"', encoding="utf-8")
        self.assertIn("not measured at this commit", self.written()[1])

    def test_a_task_is_stored_whole_or_not_at_all(self):
        def task(script):
            return results_tasks.Task("g", "t", "a task", "", lambda _, output: ["sh", "-c", script.replace("OUT", str(output))],
                                      0)
        self.assertEqual(self.run_all([task("echo '[1]' > OUT; echo no more memory; exit 3")]),
                         {"t": "exit code 3: no more memory"})
        self.assertIn("left no numbers", self.run_all([task("echo '[1' > OUT")])["t"])
        self.assertEqual(list(results.STORE.glob("*.json")), [])
        self.assertEqual(self.run_all([task("echo '[1]' > OUT")]), {})
        self.assertEqual(results.stored(task(""))["content"], [1])
        self.assertEqual(self.run_all([task("exit 1")]), {}, "measured already")
        self.assertEqual(self.run_all([task("exit 1")], again=True)["t"][:11], "exit code 1")

    def test_the_budget_and_missing_data_are_reasons(self):
        slow = results_tasks.Task("g", "slow", "an hour", "", lambda *_: ["false"], 60)
        data = results_tasks.Task("g", "data", "a recording", "", lambda *_: ["false"], 0, needs="kitchen")
        self.assertEqual(self.run_all([slow, data], budget=5),
                         {"slow": "takes about 60 min, beyond the budget", "data": "no ../shared/data/kitchen"})

    def test_the_readme_shows_what_the_document_does(self):
        document = SOURCE / "docs/results.md"
        block = re.search(r"<!-- results -->\n(.*?)<!-- /results -->", (SOURCE / "README.md").read_text(encoding="utf-8"), re.DOTALL)[1]
        text = document.read_text(encoding="utf-8")
        self.assertEqual(re.search(r"commit (\S+);", block)[1], re.search(r"at commit \*\*(\S+)\*\*", text)[1])
        rows = re.findall(r"^\| (.+?) \| (.+?) \|$", block, re.MULTILINE)[1:]
        self.assertEqual(len(rows), len(results_tables.ten({})))
        for what, result in rows:
            self.assertIn(f"| {what} | {result} | `--only", text)


if __name__ == "__main__":
    unittest.main()
