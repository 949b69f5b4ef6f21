"""blocks.py tells what is wrong with a document."""

import contextlib
import io
import os
import pathlib
import sys
import tempfile
import unittest

import blocks

os.environ.setdefault("OCTOSURF", sys.executable)  # these documents do not ask for the command


class Documents(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        blocks.ROOT = pathlib.Path(self.folder.name).resolve()
        for name in ("docs", "maps", "examples"):
            (blocks.ROOT / name).mkdir()
        (blocks.ROOT / "README.md").write_text("# A heading: of two parts\n")

    def document(self, text):
        file = blocks.ROOT / "docs/a.md"
        file.write_text(text, encoding="utf-8")
        return file

    def run_blocks(self, text, update=False):
        told = io.StringIO()
        with contextlib.redirect_stdout(told), contextlib.redirect_stderr(told):
            try:
                code = blocks.run(self.document(text), update)
            except SystemExit as end:
                return 1, told.getvalue() + str(end)
        return code, told.getvalue()

    def test_links(self):
        self.document("[a](../README.md#a-heading-of-two-parts) [b](a.md) [c](https://nowhere.invalid/x)")
        self.assertEqual(blocks.check_links(), [])
        self.document("[a](../README.md#another) [b](b.md)\n```text\n[c](c.md)\n```\n")
        self.assertEqual(blocks.check_links(), ["docs/a.md: ../README.md#another: no such heading",
                                                "docs/a.md: b.md: no such file"])

    def test_a_block_that_fails_is_named(self):
        self.assertEqual(self.run_blocks("```sh\ntrue\n```\n")[0], 0)
        code, told = self.run_blocks("```sh\ntrue\n```\n\n```sh\nfalse\n```\n")
        self.assertEqual(code, 1)
        self.assertIn("docs/a.md:6: exit code 1", told)

    def test_output(self):
        shown = "```sh\nprintf 'a 3 ms\\nb 100.0\\nc\\nd\\n'\n```\n<!-- output -->\n```text\n{}\n```\n"
        self.assertEqual(self.run_blocks(shown.format("a 900 ms\nb 99.5\n…\nd"))[0], 0)
        pace = "```sh\necho 4/40 scans, 5.3 a second, 0:07 left, 14 surfaces\n```\n<!-- output -->\n```text\n{}\n```\n"
        self.assertEqual(self.run_blocks(pace.format("4/40 scans, 13 a second, 1:30 left, 14 surfaces"))[0], 0)
        self.assertEqual(self.run_blocks(pace.format("4/40 scans, 13 a second, 1:30 left, 28 surfaces"))[0], 1)
        for wrong in ("a 3 ms\nb 50\nc\nd", "a 3 ms\nb 100.0\nd", "a 3 ms\nb 100.0\nc\nd\ne", "A 3 ms\n…"):
            self.assertEqual(self.run_blocks(shown.format(wrong))[0], 1, wrong)
        about = shown.replace("output", "output about")
        self.assertEqual(self.run_blocks(about.format("a 3 ms\nb 50\n…"))[0], 0)
        self.assertEqual(self.run_blocks(about.format("a 3 ms\nbb 50\n…"))[0], 1)
        self.assertEqual(self.run_blocks(shown.format("old\n…\nold"), update=True)[0], 0)
        self.assertIn("a 3 ms\n…\nd\n", (blocks.ROOT / "docs/a.md").read_text(encoding="utf-8"))

    def test_what_is_not_there_and_what_is_not_run_is_said(self):
        code, told = self.run_blocks("<!-- needs no_such_program -->\n```sh\nfalse\n```\n")
        self.assertEqual((code, "missing: no_such_program" in told), (blocks.SKIPPED, True))
        code, told = self.run_blocks("<!-- not run: it's endless -->\n```sh\nfalse\n```\n")
        self.assertEqual((code, "not run: it's endless" in told), (0, True))

    def test_unnamed_languages_are_refused(self):
        self.assertIn("docs/a.md:1: a block of ''", self.run_blocks("```\nx\n```\n")[1])

    def test_no_fence_is_missed(self):
        self.assertIn("indented", self.run_blocks("- item\n  ```sh\n  false\n  ```\n")[1])


if __name__ == "__main__":
    unittest.main()
