"""Pictures of README and docs.

  pictures_test.py used          documents show what docs/pictures.py draws, all of it and nothing else
  pictures_test.py maps [NAME…]  each is of the map that this code makes: ./dev docs pictures NAME draws it anew; without
                                 names all but the kitchen, a recording that is not everywhere
"""

import json
import pathlib
import re
import sys
import tempfile

import blocks

sys.path.insert(0, str(blocks.ROOT / "docs"))
import pictures  # noqa: E402

SKIPPED = 77


def used():
    drawn = {pictures.OUT / f"{name}.png" for name in pictures.PICTURES}
    kept = {file for ending in ("png", "jpg", "svg") for file in (blocks.ROOT / "docs").rglob(f"*.{ending}")}
    shown = {(document.parent / target).resolve(): blocks.name_of(document) for document in blocks.documents()
             for target in re.findall(r"!\[[^]]*\]\((?!https?:)([^)\s]+)\)", document.read_text(encoding="utf-8"))}
    yield from (f"{shown[file]}: {file.name}: docs/pictures.py does not draw it" for file in shown.keys() - drawn)
    yield from (f"{file.name}: no document shows it" for file in (kept | drawn) - shown.keys())


def near(a, b):
    return all(abs(x - y) <= pictures.NEAR * abs(x) for x, y in zip(a, b, strict=True))


def stale(names):
    digests = json.loads(pictures.DIGESTS.read_text(encoding="utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name in names:
            maps = [*pictures.maps_of(name, folder), *([blocks.ROOT / "maps/office"] if name == "office" else [])]
            found = [pictures.digest(stem, folder) for stem in maps]
            drawn = digests[name] * 2 if name == "office" else digests[name]  # the map behind README's picture is its own
            if not (len(drawn) == len(found) and all(map(near, drawn, found))):
                yield f"{name}: drawn of {drawn}, now {found}: ./dev docs pictures {name}"


if __name__ == "__main__":
    if "kitchen" in sys.argv and not pictures.KITCHEN.is_dir():
        print(f"skipped: {pictures.KITCHEN} is missing")
        sys.exit(SKIPPED)
    problems = list(used() if sys.argv[1] == "used" else stale(sys.argv[2:] or pictures.PICTURES.keys() - {"kitchen"}))
    print(*problems, sep="\n")
    sys.exit(bool(problems))
