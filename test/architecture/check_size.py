"""The size of the house: counts against the ceilings in size.json beside this file.

A count above its ceiling fails, and so does a commit that raised or dropped a ceiling. Maintainers lower them, by
`check_size.py ROOT --lower`, which leaves ROOM above each count, so that a field, a flag or a row more is no failure.
Lines are those of `wc -l` over sources. Exit code 77: in order, but the history of the ceilings, or lizard (PyPI), which
counts branches, is not here.
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
# What stands behind the type, up to the semicolon: one declarator or several.
CONSTANTS = re.compile(r"constexpr (?:double|float|int|unsigned|auto|(?:std::)?(?:size_t|u?int\d+_t)) (?=\w+ *[={])([^;]+);")
NESTED = re.compile(r"//.*|\([^()]*\)|\[[^\[\]]*\]|\{[^{}]*\}")
# Of the verb map: its own flags, those of scans and readings, and the parameters, of which --up stands for three.
FLAG = re.compile(r'add_(?:option|flag)(?:_function)?(?:<[^(]*>)?\(\s*"(?:-\w,)?--[\w-]+|(?<=\s)\{"(?!up_)\w+",\s*"[^"]*",')
FLAG_SOURCES = ["apps/map.cpp", "apps/scan_options.cpp", "apps/options/bounds.cpp", "apps/options/parameter_options.cpp",
                "src/core/surfaces/parameters.cpp"]
CEILINGS = pathlib.PurePosixPath("test/architecture/size.json")
ROOM, ROOM_OF_LINES = {"words": 100, "public types": 2, "constants": 10, "flags of map": 2, "complex functions": 2}, 300
BRANCHES = 15  # a function with more is complex (McCabe's number, as lizard counts it)
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


def build_lines(root):
    """CMake's files and dev."""
    files = [root / name for name in ("dev", "CMakeLists.txt", "CMakePresets.json") if (root / name).exists()]
    for folder in [*PRODUCT, "lab", "test", "bench", "examples", "cmake"]:
        files += [file for file in (root / folder).rglob("*") if file.name == "CMakeLists.txt" or ".cmake" in file.suffixes]
    return sum(file.read_bytes().count(b"\n") for file in files if not NOT_OURS & set(file.parts))


def constants_in(files):
    count = 0
    for declarators in (match for file in files for match in CONSTANTS.findall(file.read_text())):
        while declarators != (flat := NESTED.sub("", declarators)):
            declarators = flat
        count += 1 + declarators.count(",")
    return count


def complex_functions(files):
    """None without lizard."""
    try:
        import lizard
    except ImportError:
        return None
    analyses = lizard.analyze_files(map(str, files), exts=lizard.get_extensions([]))
    return sum(function.cyclomatic_complexity > BRANCHES for one in analyses for function in one.function_list)


def words_in(root):
    pages = [root / "README.md", root / "CHANGELOG.md", *files_in(root, ["docs"], {".md"})]
    return sum(len(page.read_text().split()) for page in pages)


def counts_of(root):
    product, lab = lines_in(root, PRODUCT), lines_in(root, ["lab", "-lab/test"])
    counts = {
        "product": product,
        "lab": lab,
        "product and lab": product + lab,
        "tests": lines_in(root, ["test", "lab/test"]),
        "bench": lines_in(root, ["bench"]),
        "CMake and dev": build_lines(root),
        "words": words_in(root),
        "public types": matches_in(files_in(root, ["include"]), TYPE),
        "constants": constants_in(files_in(root, PRODUCT)),
        "flags of map": matches_in([root / file for file in FLAG_SOURCES], FLAG),
        "complex functions": complex_functions(files_in(root, PRODUCT)),
    }
    return {name: count for name, count in counts.items() if count is not None}


def problems(counts, ceilings):
    for name, count in counts.items():
        if count > ceilings[name]:
            yield f"{name}: {count} is above {ceilings[name]}; take as much away"


def lowered(counts, ceilings):
    return {name: min(ceiling, counts.get(name, ceiling) + ROOM.get(name, ROOM_OF_LINES)) for name, ceiling in ceilings.items()}


def versions(root):
    """(commit, its ceilings, those of each of its parents), of every commit that changed them; none without the history."""

    def git(*arguments):
        done = subprocess.run(["git", "-C", root, *arguments], capture_output=True, text=True)
        return done.stdout if done.returncode == 0 else ""

    def ceilings_at(commit):
        return json.loads(git("show", f"{commit}:{CEILINGS}") or "{}").get("ceilings", {})

    if git("rev-parse", "--is-shallow-repository").strip() != "false":
        return
    for line in git("log", "--full-history", "--format=%h %p", "--", str(CEILINGS)).splitlines():
        commit, *parents = line.split()
        yield commit, ceilings_at(commit), [ceilings_at(parent) for parent in parents]


def raised(history):
    for commit, ceilings, parents in history:
        for name, ceiling in ceilings.items():
            if any(ceiling > parent.get(name, ceiling) for parent in parents):
                yield f"{commit} raised the ceiling of {name} to {ceiling}"
        for name in set().union(*parents) - set(ceilings):
            yield f"{commit} dropped the ceiling of {name}"


def main(root, lower):
    file = root / CEILINGS
    ceilings = json.loads(file.read_text())["ceilings"]
    counts = counts_of(root)
    if lower:
        ceilings = lowered(counts, ceilings)
        file.write_text(json.dumps({"ceilings": ceilings}, indent=2) + "\n")
    rows = [(room, lines_in(root, folders), "") for room, folders in ROOMS.items()]
    rows += [(name, counts.get(name, "-"), ceiling) for name, ceiling in ceilings.items()]
    print("\n".join(f"{name:<18}{count:>8}{most:>8}" for name, count, most in [("", "now", "most"), *rows]))
    history = list(versions(root))
    found = [*problems(counts, ceilings), *raised(history)]
    missing = [name for name, here in (("the history of size.json", history), ("lizard", len(counts) == len(ceilings))) if not here]
    print(*found, *(f"{name} is not here" for name in missing), sep="\n")
    return BROKEN if found else SKIPPED if missing else IN_ORDER


if __name__ == "__main__":
    sys.exit(main(pathlib.Path(sys.argv[1]), lower="--lower" in sys.argv))
