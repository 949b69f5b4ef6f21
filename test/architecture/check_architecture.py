"""Says which includes break the house: docs/design.md §2 has the arrows, this reads them there.

- A room of src/, src/core/ or lab/, apps/, and lab/ itself include headers of their own, public ones, and those of the rooms
  behind their arrows; only lab/ includes rooms of lab/.
- The arrows have no cycle, and neither have the headers.
- No header of src/ is called like a public one.
- What a header of a room declares stands in the room's namespace, octosurf::room, or in that of a folder of the room;
  elsewhere it only names beforehand what is declared there.
- Public headers (but for adapters/) include one another, Eigen and the standard library.
- With --types, that alone: no two types of one namespace share a name. Rooms are linked together, so that two are one to the
  linker; types in unnamed namespaces and in classes are their own.
"""

import collections
import pathlib
import re
import sys

INCLUDE = re.compile(r'^\s*#\s*include\s+[<"]([^>"]+)[>"]', re.MULTILINE)
# "a, b → c, d", several to a line apart by blanks; "a → b → c" are two arrows.
ARROW = re.compile(r"\w+(?:, \w+)*(?:\s+→ \w+(?:, \w+)*)+")


def rooms_in(text):
    return text.strip().split(", ")


def arrows_of(design):
    """Room → the rooms that it may include."""
    table = re.search(r"behind its arrow:\n\n```text\n(.*?)```", design, re.DOTALL)
    assert table, "docs/design.md has no table of arrows"
    arrows = {}
    for chain in ARROW.findall(table[1]):
        steps = [rooms_in(step) for step in chain.split("→")]
        for sources, targets in zip(steps, steps[1:]):
            for room in sources:
                arrows.setdefault(room, set()).update(targets)
    return arrows


def includes_of(file):
    return INCLUDE.findall(file.read_text())


def closed(arrows):
    """What a room may include that may include what …: rooms further behind are allowed, too."""
    reach = {room: set(targets) for room, targets in arrows.items()}
    for _ in reach:
        for targets in reach.values():
            targets |= set().union(*(reach.get(room, set()) for room in targets))
    return reach


def wrong_arrows(root, arrows):
    folders = {folder.name: folder for base in ("src", "src/core", "lab") for folder in (root / base).glob("*/")}
    laboratory = {name for name, folder in folders.items() if folder.parent.name == "lab"} - {"test"}
    rooms = set(folders) - {"test", "core"}
    assert len(rooms) > 5, "hardly any rooms: is the layout another one?"
    everything = {"apps": rooms - laboratory, "lab": rooms}
    arrows = {room: everything[room] if targets == {"all"} else targets for room, targets in arrows.items()}
    unknown = (set(arrows) | set().union(*arrows.values())) - rooms - {"apps", "lab"}
    yield from (f"docs/design.md has an arrow of {room}, which is no room" for room in sorted(unknown))
    reach = closed(arrows)
    yield from (f"the arrows lead from {room} back to it" for room in sorted(reach) if room in reach[room])
    for folder in sorted({folders[room] for room in rooms} | {root / "apps", root / "lab"}):
        for file in sorted(folder.glob("*.[ch]pp") if folder.name == "lab" else folder.rglob("*.[ch]pp")):
            for include in includes_of(file):
                room = include.split("/")[0]
                if room in rooms and room != folder.name and room not in reach.get(folder.name, set()):
                    yield f"{file.relative_to(root)} includes {include}: {folder.name} → {room} is no arrow"


def header_cycles(root):
    """The public header `x` is told apart from those of src/ by its folder."""
    graph = {}
    for base, prefix in ((root / "src", ""), (root / "src/core", ""), (root / "lab", ""), (root / "include", "")):
        for file in base.rglob("*.hpp"):
            graph[prefix + str(file.relative_to(base))] = includes_of(file)
    done, path = set(), []

    def visit(header):
        if header in path:
            yield "headers include each other: " + " → ".join([*path[path.index(header):], header])
        elif header in graph and header not in done:
            path.append(header)
            for include in graph[header]:
                yield from visit(include)
            path.pop()
            done.add(header)

    for header in sorted(graph):
        yield from visit(header)


def like_public_ones(root):
    public = {file.name for file in (root / "include" / "octosurf").glob("*.hpp")}
    assert len(public) > 10, "hardly any public headers: is the layout another one?"
    for file in sorted((root / "src").rglob("*.hpp")):
        if file.name in public:
            yield f"{file.relative_to(root)} is called like a public header"


NAMESPACE = re.compile(r"^namespace (octosurf[\w:]*) \{\n(.*?)^\}", re.MULTILINE | re.DOTALL)
# Or names of its own that it gives to all rooms.
FORWARD_DECLARATIONS = re.compile(r"(((class|struct) \w+|using \w+::\w+);\n|\n)*")


def wrong_namespaces(root):
    for room in sorted(folder for folder in (root / "src").iterdir() if folder.is_dir()):
        for file in sorted(room.rglob("*.hpp")):
            own = {f"octosurf::{folder}" for folder in file.relative_to(root / "src").parts[:-1]}
            for name, body in NAMESPACE.findall(file.read_text()):
                if name not in own and not FORWARD_DECLARATIONS.fullmatch(body):
                    yield f"{file.relative_to(root)} declares in {name}, not in octosurf::{room.name}"


def heavy_public_headers(root):
    for file in sorted((root / "include" / "octosurf").glob("*.hpp")):
        for include in includes_of(file):
            standard = re.fullmatch(r"[a-z_0-9]+", include)
            if not (standard or include.startswith(("octosurf/", "Eigen/"))) or "adapters" in include:
                yield f"{file.relative_to(root)} includes {include}"


OPENED = re.compile(r"namespace (\w[\w:]*)? ?\{")
TYPE = re.compile(r"(?:template <.*> )?(?:struct|class|union|enum|enum class) (?:alignas\(\w+\) )?(\w+)(?: final)?(?: :[^:].*)? \{")


def types_in(file):
    """Of what stands at the beginning of a line, as clang-format puts what a namespace holds."""
    open_namespaces = []
    for line in file.read_text().splitlines():
        if opened := OPENED.match(line):
            open_namespaces.append(opened[1])
        elif line.startswith("}  // namespace"):
            open_namespaces.pop()
        elif (found := TYPE.match(line)) and None not in open_namespaces:
            yield "::".join([*open_namespaces, found[1]])


def types_of_one_name(root):
    places = collections.defaultdict(list)
    for folder in ("include", "src", "apps", "lab", "test"):
        for file in sorted((root / folder).rglob("*.[ch]pp")):
            for name in types_in(file):
                places[name].append(str(file))
    assert len(places) > 100, "hardly any types found: is the layout another one?"
    yield from (f"{name} is defined in {' and in '.join(files)}" for name, files in places.items() if len(files) > 1)


def problems(root):
    arrows = arrows_of((root / "docs" / "design.md").read_text())
    yield from wrong_arrows(root, arrows)
    yield from header_cycles(root)
    yield from like_public_ones(root)
    yield from wrong_namespaces(root)
    yield from heavy_public_headers(root)


if __name__ == "__main__":
    found = list((types_of_one_name if "--types" in sys.argv else problems)(pathlib.Path(sys.argv[1])))
    print(*found, sep="\n")
    sys.exit(1 if found else 0)
