#!/usr/bin/env python3
"""The code blocks of the documents (*.md here and in docs/): compiled and run as they stand there, so that none of them is stale.

  blocks.py links                   every relative link of every document leads somewhere
  blocks.py cpp DOCUMENT OUT.cpp    its ```cpp blocks as one translation unit
  blocks.py run DOCUMENT            its blocks, in order, in a folder made for it
  blocks.py update [DOCUMENT…]      the same, of all documents if none is named, and writes what they print into them

What a fence is called decides: ```cpp is a program, or functions and types with what they include; ```sh is run by
bash, ```python by python3, ```cmake configured as a CMakeLists.txt against the installed package; ```text and ```json
are for reading. In the folder of a document are the repository's `maps` and `examples`; PATH has octosurf, PYTHONPATH
the module. All blocks of a document share folder and shell. Without a build (OCTOSURF_BUILD) octosurf is installed: programs
that are files are built by the ```cmake block before them. Comments before a block, which readers do not see:

  <!-- setup COMMANDS -->   run before it
  <!-- check CODE -->      C++ that is compiled behind it: what makes use of a template, say
  <!-- file NAME -->        it is written to this file (what a ```cmake block builds, say); only a C++ program is run, too
  <!-- output -->           ```text: what the block before printed; … stands for any lines left out. Words must be equal,
                            numbers nearly, as another processor rounds otherwise; times and memory may differ
  <!-- output about -->     the same, but all numbers may: of poses that drift, where a last digit decides what parts
                            and what joins, another processor's map has other counts
  <!-- needs NAME… -->      programs or Python modules; without them the test ends here, as skipped
  <!-- with NAME… -->       the same, but only this block is left out
  <!-- not run: WHY -->     it is not, and the test says so
"""
import argparse
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass

ROOT = pathlib.Path(__file__).resolve().parents[2]
RUN = ("cpp", "sh", "python", "cmake")
READ = ("text", "json")
SKIPPED = 77
FENCE = re.compile(r"(?P<notes>(?:^<!--(?:(?!-->).)*-->\n)*)^```(?P<language>[^\n]*)\n(?P<code>.*?)^```$",
                   re.MULTILINE | re.DOTALL)


def documents():
    return sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])


@dataclass
class Block:
    line: int
    language: str
    code: str
    notes: dict
    span: tuple  # of the code in the document

    def program(self):
        return re.search(r"^int main\(", self.code, re.MULTILINE) is not None


def blocks_of(document):
    text = document.read_text(encoding="utf-8")
    blocks = []
    for match in FENCE.finditer(text):
        notes = {}
        for note in re.findall(r"<!-- *(.*?) *-->", match["notes"], re.DOTALL):
            name, value = re.match(r"(not run:|\S+)\s*(.*)", note, re.DOTALL).groups()
            notes[name] = value
        line = text.count("\n", 0, match.start("code")) + 1
        if match["language"] not in RUN + READ:
            sys.exit(f"{document}:{line - 1}: a block of '{match['language']}'; one of {', '.join(RUN + READ)} is needed")
        blocks.append(Block(line, match["language"], match["code"], notes, match.span("code")))
    if len(re.findall(r"^ *```", text, re.MULTILINE)) != 2 * len(blocks):
        sys.exit(f"{document}: a fence is indented or not closed")
    return blocks


def name_of(document):
    return str(document.resolve().relative_to(ROOT))


# ---- links ----

def anchors(document):
    """As GitHub makes them of headings."""
    text = FENCE.sub("", document.read_text(encoding="utf-8"))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
            for heading in re.findall(r"^#+ +(.*)$", text, re.MULTILINE)}


def check_links():
    dead = []
    for document in documents():
        text = FENCE.sub("", document.read_text(encoding="utf-8"))
        for target in re.findall(r"\]\(([^)\s]+)\)", text):
            if re.match(r"[a-z]+:", target):
                continue
            path, _, anchor = target.partition("#")
            file = document.parent / path if path else document
            if not file.exists():
                dead.append(f"{name_of(document)}: {target}: no such file")
            elif anchor and file.suffix == ".md" and anchor not in anchors(file):
                dead.append(f"{name_of(document)}: {target}: no such heading")
    return dead


# ---- C++ ----

def translation_unit(document):
    """Each block in a namespace of its own, behind the includes of all; a program's main is found by place."""
    blocks = [block for block in blocks_of(document) if block.language == "cpp"]
    include = re.compile(r"^#include .*$", re.MULTILINE)
    lines = ['#include "docs/programs.hpp"']
    lines += sorted({line for block in blocks for line in include.findall(block.code)})
    for block in blocks:
        code = include.sub("", block.code)
        if block.program():  # only the real main() may end without return
            code = re.sub(r"\n}\s*$", "\n  return 0;\n}\n", code)
        lines += [f"namespace block_{block.line} {{", f'#line {block.line} "{document}"', code.rstrip("\n"), block.notes.get("check", "")]
        if block.program():
            lines.append(f'const octosurf::docs::Program program("{name_of(document)}:{block.line}", main);')
        lines += ["}"]
    return "\n".join(lines) + "\n"


# ---- commands ----

def missing(names):
    return [name for name in names.split() if shutil.which(name) is None and subprocess.run(
        [sys.executable, "-c", f"import {name}"], capture_output=True).returncode != 0]


def script_of(document, blocks, folder):
    """One bash script; what block i prints goes to the file i.out."""
    script, installed, built = ["set -euo pipefail"], "OCTOSURF_BUILD" not in os.environ, None
    for i, block in enumerate(blocks):
        script.append(f"exec >'{folder}/{i}.out' 2>&1")
        if "needs" in block.notes and (lacking := missing(block.notes["needs"])):
            script += [f"echo missing: {' '.join(lacking)}", f"exit {SKIPPED}"]
            break
        if "with" in block.notes and (lacking := missing(block.notes["with"])):
            script.append(f"echo not run, missing: {' '.join(lacking)}")
            continue
        if "setup" in block.notes:
            script += [block.notes["setup"], f"exec >'{folder}/{i}.out' 2>&1"]
        if "file" in block.notes:
            file = folder / "work" / block.notes["file"]
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(block.code, encoding="utf-8")
            if block.language == "cpp" and block.program():
                script.append(f"cmake --build '{built}' >'{folder}/build.out' 2>&1; '{built}/{file.stem}'" if installed else
                              f"\"$DOCS_CPP\" '{name_of(document)}:{block.line}'")
        elif "not run:" in block.notes:
            script.append("echo " + shlex.quote("not run: " + block.notes["not run:"]))
        elif block.language == "sh":
            script.append(block.code)
        elif block.language == "python":
            (folder / f"{i}.py").write_text(block.code, encoding="utf-8")
            script.append(f"python3 - <'{folder}/{i}.py'")  # so that modules are found in the folder
        elif block.language == "cpp" and block.program():
            script.append(f"\"$DOCS_CPP\" '{name_of(document)}:{block.line}'")
        elif block.language == "cmake":
            (folder / "work/CMakeLists.txt").write_text(block.code, encoding="utf-8")
            built = folder / str(i)
            script += [f"cmake -S . -B '{built}'"] if installed else [
                       f"cmake --install \"$OCTOSURF_BUILD\" --prefix '{folder}/prefix' >'{folder}/install.out' 2>&1",
                       f"cmake -S . -B '{built}' -DCMAKE_PREFIX_PATH='{folder}/prefix'"]
    return "\n".join(script) + "\n"


def same_number(shown, printed):
    a, b = float(shown), float(printed)
    return abs(a - b) <= max(0.02, 0.1 * max(abs(a), abs(b)))


NUMBER = r"-?\d+(?:\.\d+)?(?:e[+-]?\d+)?"


def same_line(shown, printed, about=False):
    free = re.compile(rf"{NUMBER} (?=(?:ms|s|MB|GB|a second)\b)|\d+:\d\d (?=left\b)")
    shown, printed = free.sub("# ", shown), free.sub("# ", printed)
    words = lambda line: re.sub(NUMBER, "#", " ".join(line.split()))
    return words(shown) == words(printed) and all(
        about or same_number(a, b) for a, b in zip(re.findall(NUMBER, shown), re.findall(NUMBER, printed)))


def matches(shown, printed, about=False):
    """Line by line; a line … stands for any number of lines."""
    if not shown:
        return not printed
    if shown[0].strip() == "…":
        return any(matches(shown[1:], printed[i:], about) for i in range(len(printed) + 1))
    return bool(printed) and same_line(shown[0], printed[0], about) and matches(shown[1:], printed[1:], about)


def shortened(shown, printed):
    """What was printed, with … where the document had it: as many lines before and behind as there were."""
    if "…" not in [line.strip() for line in shown]:
        return printed
    at = [line.strip() for line in shown].index("…")
    behind = len(shown) - at - 1
    return printed[:at] + ["…"] + (printed[-behind:] if behind else [])


def environment(folder):
    octosurf = pathlib.Path(os.environ["OCTOSURF"])
    (folder / "bin").mkdir()
    (folder / "bin/octosurf").symlink_to(octosurf)
    (folder / "bin/octosurf-lab").symlink_to(octosurf.with_name("octosurf-lab"))
    (folder / "bin/python3").symlink_to(sys.executable)
    return {**os.environ, "PATH": f"{folder}/bin:{os.environ['PATH']}", "MPLBACKEND": "Agg",
            "PYTHONPATH": os.environ.get("OCTOSURF_BUILD", "") + "/python", "COLUMNS": "120"}


def run(document, update):
    blocks = blocks_of(document)
    failures = []
    with tempfile.TemporaryDirectory(prefix="octosurf-docs-") as name:
        folder = pathlib.Path(name)
        (folder / "work").mkdir()
        shutil.copytree(ROOT / "maps", folder / "work/maps")
        (folder / "work/examples").symlink_to(ROOT / "examples")
        (folder / "script.sh").write_text(script_of(document, blocks, folder), encoding="utf-8")
        shell = subprocess.Popen(["bash", folder / "script.sh"], cwd=folder / "work", env=environment(folder),
                                 start_new_session=True)
        status = shell.wait()
        try:
            os.killpg(shell.pid, 15)  # servers that a block has started
        except ProcessLookupError:
            pass
        printed = {i: file.read_text(encoding="utf-8") for i in range(len(blocks))
                   if (file := folder / f"{i}.out").exists()}
        last = max(printed, default=0)
        for i in printed:
            print(f"== {name_of(document)}:{blocks[i].line} ({blocks[i].language})\n{printed[i]}")
        if status == SKIPPED:
            return SKIPPED
        if status != 0:
            sys.exit(f"{name_of(document)}:{blocks[last].line}: exit code {status}, see above")
    text = document.read_text(encoding="utf-8")
    for i, block in reversed(list(enumerate(blocks))):
        if "output" not in block.notes:
            continue
        shown, output = block.code.splitlines(), printed[i - 1].splitlines()
        if update:
            text = text[:block.span[0]] + "\n".join(shortened(shown, output)) + "\n" + text[block.span[1]:]
        elif not matches(shown, output, block.notes["output"] == "about"):
            failures.append(f"{name_of(document)}:{block.line}: the program prints something else now; "
                            "./dev docs outputs writes it")
    if update:
        document.write_text(text, encoding="utf-8")
    for failure in failures:
        print(failure, file=sys.stderr)
    return 1 if failures else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("verb", choices=["links", "cpp", "run", "update"])
    parser.add_argument("files", nargs="*", type=pathlib.Path)
    arguments = parser.parse_args()
    files = [file.resolve() for file in arguments.files]
    if arguments.verb == "links":
        dead = check_links()
        print("\n".join(dead))
        return 1 if dead else 0
    if arguments.verb == "cpp":
        document, out = files
        out.write_text(translation_unit(document), encoding="utf-8")
        return 0
    if arguments.verb == "run":
        (document,) = files
        return run(document, update=False)
    return max(run(document, update=True) for document in files or documents())


if __name__ == "__main__":
    sys.exit(main())
