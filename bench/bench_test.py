#!/usr/bin/env python3
"""What results.py promises: only rows of the present commit are shown, and what is missing is said; and how rows add up."""

import contextlib
import io
import json
import pathlib
import re
import subprocess
import tempfile
import unittest

import bench
import results

SOURCE = pathlib.Path(__file__).resolve().parents[1]


def accuracy_row(scene, seed, correct):
    summary = {"mean": 0.5, "max": 2.0, "count": correct}
    numbers = dict.fromkeys(("over_segmented", "under_segmented", "missed", "noise", "unsafe_m2", "unsafe_share", "ms"), 0)
    return {"method": "ours/default", "sensor": "depth", "scene": scene, "seed": seed, "faces": 1000, "correct": correct, "scans": 1,
            "coverage": 0.9, "visible_m2": 2.0, "area_m2": 4.0, "normal_deg": summary, "offset_m": summary,
            **numbers}


def side(name, ms, **counters):
    return {"name": f"kitchen/d:0.02/{name}", "label": name, "ms": ms, **counters}


class Results(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = pathlib.Path(temporary.name)
        (self.folder / "docs").mkdir()
        (self.folder / "README.md").write_text("above\n<!-- results -->\n| old | 54.9 % |\n<!-- /results -->\nbelow\n", encoding="utf-8")
        saved = results.ROOT, results.STORE, results.DATA
        self.addCleanup(lambda: [setattr(results, *one) for one in zip(("ROOT", "STORE", "DATA"), saved)])
        results.ROOT, results.STORE, results.DATA = self.folder, self.folder / "store", self.folder / "data"
        results.STORE.mkdir()

    def store(self, name, commit, content):
        record = {"commit": commit, "date": "2000-01-01", "machine": "a machine", "busy": 0.0, "seconds": 60.0, "content": content}
        (results.STORE / f"{name}.json").write_text(json.dumps(record), encoding="utf-8")

    def written(self):
        with contextlib.redirect_stdout(io.StringIO()):
            results.write_documents("new", {})
        return [(self.folder / file).read_text(encoding="utf-8") for file in ("docs/results.md", "README.md")]

    def test_rows_of_another_commit_are_not_shown(self):
        self.store("depth", "old", [accuracy_row("room", 1, 877)])
        document, readme = self.written()
        self.assertNotIn("87.7", document + readme)
        self.assertNotIn("54.9", readme)
        self.assertIn("Not measured at this commit: `depth`; ", document)
        (results.STORE / "noise.json").write_text('{"commit": "new"', encoding="utf-8")  # damaged: none
        self.store("depth", "new", [accuracy_row("room", 1, 900), accuracy_row("room", 2, 924)])
        document, readme = self.written()
        for text in (document, readme):
            self.assertIn("91.2 % of 2000 faces correct, 90.0 % covered, 0.00 % unsafe (2 seeds)", text)
        self.assertIn("- a machine, 2000-01-01.", document)
        self.assertTrue(readme.startswith("above\n") and readme.endswith("below\n"))

    def test_a_task_is_stored_whole_or_not_at_all_and_reasons_are_said(self):
        class Stub(results.Task):
            def measure(self, seeds):
                if self.bench == "fails":
                    raise ChildProcessError("no more memory")
                return [seeds]

        def run_all(bench_name, again=False, needs=""):
            with contextlib.redirect_stdout(io.StringIO()):
                return results.run_all({"t": Stub("g", "a task", bench_name, needs=needs)}, 2, "new", again)
        self.assertEqual(run_all("fails"), {"t": "no more memory"})
        self.assertEqual(list(results.STORE.glob("*")), [])
        self.assertEqual(run_all("works", needs="kitchen"), {"t": "no ../shared/data/kitchen"})
        self.assertEqual(run_all("works"), {})
        self.assertEqual(results.stored("t")["content"], [[1, 2]])
        self.assertEqual(run_all("fails"), {}, "measured already")
        self.assertEqual(run_all("fails", again=True), {"t": "no more memory"})

    def test_speed_rows_are_medians_beside_the_other(self):
        octomap = [side("octomap", ms, heap_bytes=3000, leaves=50) for ms in (300.0, 240.0, 250.0)]
        self.store("speed-sides", "new", [*octomap, side("occupancy", 10.0, heap_bytes=3000, tree_bytes=1000)])
        document, readme = self.written()
        self.assertIn("| occupancy | octomap | 10.0 ms | 250 ms ± 12 % | 25.0× |  |", document)
        self.assertIn("60.0 B; OctoMap's pruned tree 60.0 B", readme)

    def test_scenes_add_up_and_drift_walks_twice(self):
        rows = [accuracy_row("room", 1, 900), accuracy_row("office", 1, 500)]
        header, lines = bench.table_of("accuracy", rows)
        self.assertEqual([line[1:4] for line in lines], [["room", "ours/default", "90.0 % of 1000"], ["office", "ours/default", "50.0 % of 1000"],
                                                         ["all", "ours/default", "70.0 % of 2000"]])
        self.assertEqual(len(header), len(lines[0]))
        self.assertEqual(bench.complete(bench.options_of("accuracy", ["--drift-m", "0.01", "--seeds", "1,2"])),
                         {"laps": 2, "drift_m": 0.01, "seeds": [1, 2]})

    def test_the_figures_are_not_old(self):
        text = (SOURCE / "docs/results.md").read_text(encoding="utf-8")
        commit = re.search(r"at commit \*\*([0-9a-f]+)", text)[1]
        since = subprocess.run(["git", "-C", SOURCE, "rev-list", "--count", f"{commit}..HEAD", "--", "src/core", "src/pcl", "src/planning"],
                               capture_output=True, text=True, check=False)
        if since.returncode != 0:
            self.skipTest(f"no history back to {commit}: {since.stderr.strip()}")
        self.assertLessEqual(int(since.stdout), 20, "commits to src/core, src/pcl, src/planning since: ./dev bench results")

    def test_the_readme_shows_what_the_document_does(self):
        block = re.search(r"<!-- results -->\n(.*?)<!-- /results -->", (SOURCE / "README.md").read_text(encoding="utf-8"), re.DOTALL)[1]
        text = (SOURCE / "docs/results.md").read_text(encoding="utf-8")
        self.assertEqual(re.search(r"commit (\S+);", block)[1], re.search(r"at commit \*\*(\S+)\*\*", text)[1])
        rows = re.findall(r"^\| (.+?) \| (.+?) \|$", block, re.MULTILINE)[1:]
        self.assertEqual(len(rows), len(results.ten({})))
        for what, result in rows:
            self.assertIn(f"| {what} | {result} |\n", text)


if __name__ == "__main__":
    unittest.main()
