"""Says which types of one namespace share a name: rooms are linked together, so that two are one to the linker.

Looks at what stands at the beginning of a line, as clang-format puts what a namespace holds; types in unnamed
namespaces and in classes are their own."""

import collections
import pathlib
import re
import sys

NAMESPACE = re.compile(r"namespace (\w[\w:]*)? ?\{")
TYPE = re.compile(r"(?:template <.*> )?(?:struct|class|union|enum|enum class) (?:alignas\(\w+\) )?(\w+)(?: final)?(?: :[^:].*)? \{")


def types_in(file):
    open_namespaces = []
    for line in file.read_text().splitlines():
        if opened := NAMESPACE.match(line):
            open_namespaces.append(opened[1])
        elif line.startswith("}  // namespace"):
            open_namespaces.pop()
        elif (found := TYPE.match(line)) and None not in open_namespaces:
            yield "::".join([*open_namespaces, found[1]])


def main(folders):
    places = collections.defaultdict(list)
    for folder in folders:
        for file in sorted(pathlib.Path(folder).rglob("*.[ch]pp")):
            for name in types_in(file):
                places[name].append(str(file))
    assert len(places) > 100, "hardly any types found: is the layout another one?"
    clashes = {name: files for name, files in places.items() if len(files) > 1}
    for name, files in clashes.items():
        print(f"{name} is defined in {' and in '.join(files)}")
    return 1 if clashes else 0


sys.exit(main(sys.argv[1:]))
