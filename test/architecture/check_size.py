"""The size of the house, which only falls: counts against the numbers in size.json beside this file.

A count above its number fails, and so does one more than SLACK below it (`check_size.py ROOT --write` then writes the lower
number), and so does a commit that raised a number. What adds is paid for by a cut in the same commit.
Lines are those of `wc -l` over sources. Exit code 77: in order, but the history of the numbers is not here.
"""

import json
import pathlib
import re
import subprocess
import sys

ROOMS = {
    "include": ["include"],
    "core": ["src/core"],
    "octomap, pcl": ["src/octomap", "src/pcl"],
    "io": ["src/io"],
    "planning": ["src/planning"],
    "footsteps": ["src/footsteps"],
    "apps": ["apps"],
    "ros": ["ros"],
    "bindings": ["bindings"],
    "web": ["web"],
}
PRODUCT = ["include", "src", "apps", "ros", "bindings", "web"]
SOURCES = {".cpp", ".hpp", ".py", ".js", ".mjs", ".css", ".html", ".proto", ".idl"}
NOT_OURS = {"node_modules", "__pycache__"}  # what npm and Python leave in a checkout
TYPE = re.compile(r"^ *(?:struct|class|enum|enum class) \w+[^;({\n]*\{", re.MULTILINE)
CONSTANT = re.compile(r"constexpr (?:double|float|int|unsigned|auto|(?:std::)?(?:size_t|u?int\d+_t)) \w+ *[={]")
# Of the verb map: its own flags, those of scans and readings, and the parameters, of which --up stands for three.
FLAG = re.compile(r'add_(?:option|flag)(?:_function)?(?:<[^(]*>)?\(\s*"(?:-\w,)?--[\w-]+|(?<=\s)\{"(?!up_)\w+",\s*"[^"]*",')
FLAG_SOURCES = ["apps/map.cpp", "apps/scan_options.cpp", "apps/options/bounds.cpp", "apps/options/parameter_options.cpp",
                "src/core/surfaces/parameters.cpp"]
NUMBERS = pathlib.PurePosixPath("test/architecture/size.json")
SLACK = 0.01
IN_ORDER, BROKEN, SKIPPED = 0, 1, 77


def files_in(root, folders, endings=SOURCES):
    """Those of `folders` without those of the folders that begin with "-"."""
    left_out = [root / folder[1:] for folder in folders if folder.startswith("-")]
    for folder in folders:
        for file in (root / folder).rglob("*"):
            if file.suffix in endings and not NOT_OURS & set(file.parts) and not set(left_out) & set(file.parents):
                yield file


def lines_in(root, folders):
    return sum(file.read_bytes().count(b"\n") for file in files_in(root, folders))


def matches_in(files, pattern):
    return sum(len(pattern.findall(file.read_text())) for file in files)


def words_in(root):
    pages = [root / "README.md", root / "CHANGELOG.md", *files_in(root, ["docs"], {".md"})]
    return sum(len(page.read_text().split()) for page in pages)


def counts_of(root):
    return {
        "product": lines_in(root, PRODUCT),
        "tests": lines_in(root, ["test", "lab/test"]),
        "lab": lines_in(root, ["lab", "-lab/test"]),
        "words": words_in(root),
        "public types": matches_in(files_in(root, ["include"]), TYPE),
        "constants": matches_in(files_in(root, PRODUCT), CONSTANT),
        "flags of map": matches_in([root / file for file in FLAG_SOURCES], FLAG),
    }


def problems(counts, numbers):
    for name, count in counts.items():
        if count > numbers[name]:
            yield f"{name}: {count} is above {numbers[name]}; take as much away in the same commit"
        elif count < (1 - SLACK) * numbers[name]:
            yield f"{name}: {count} is far below {numbers[name]}; write the new number: check_size.py ROOT --write"


def versions(root):
    """(commit, its numbers, those of each of its parents), of every commit that changed them; none without the history."""

    def git(*arguments):
        done = subprocess.run(["git", "-C", root, *arguments], capture_output=True, text=True)
        return done.stdout if done.returncode == 0 else ""

    def numbers_at(commit):
        return json.loads(git("show", f"{commit}:{NUMBERS}") or "{}")

    if git("rev-parse", "--is-shallow-repository").strip() != "false":
        return
    for line in git("log", "--full-history", "--format=%h %p", "--", str(NUMBERS)).splitlines():
        commit, *parents = line.split()
        yield commit, numbers_at(commit), [numbers_at(parent) for parent in parents]


def raised(history):
    for commit, numbers, parents in history:
        for name, number in numbers.items():
            if any(number > parent.get(name, number) for parent in parents):
                yield f"{commit} raised the number of {name} to {number}"
        for name in set().union(*parents) - set(numbers):
            yield f"{commit} dropped the number of {name}"


def main(root, write):
    file = root / NUMBERS
    numbers = json.loads(file.read_text())
    counts = counts_of(root)
    if write:
        numbers = {name: min(number, counts.get(name, number)) for name, number in numbers.items()}
        file.write_text(json.dumps(numbers, indent=2) + "\n")
    rows = [(room, lines_in(root, folders), "") for room, folders in ROOMS.items()]
    rows += [(name, count, numbers[name]) for name, count in counts.items()]
    print("\n".join(f"{name:<14}{count:>8}{most:>8}" for name, count, most in [("", "now", "most"), *rows]))
    history = list(versions(root))
    found = [*problems(counts, numbers), *raised(history)]
    print(*found, sep="\n")
    if not history:
        print("the history of size.json is not here")
    return BROKEN if found else IN_ORDER if history else SKIPPED


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1]), write="--write" in sys.argv))
