#!/usr/bin/env python3
"""Writes the comments of the public headers as a C++ table of Python's docstrings: header_docs.py OUTPUT HEADER...

A row is {"Class.member", "text"}, sorted; overloads have the text of the first.
"""

import json
import pathlib
import re
import sys

# What a C++ programmer reads, and what Python says.
WORDS = [
    (r"\bstd::bad_alloc\b", "MemoryError"),
    (r"\bnullptr\b", "None"),
    (r"\boctosurf::", ""),
    (r"\bMap::(Voxel|Size)\b", r"Map\1"),
    (r"::", "."),
    (r",? ?\((?:[\w/]+\.hpp|see payload\.hpp|docs/design\.md §\d)\)|, (?:mapper|up)\.hpp\b", ""),
    (r"\b[\w/]+\.hpp's ", ""),
    (r"^src/core/\w+: | \(src/core/\w+\)", ""),
]
AS_IT_IS = re.compile(r"(m|rad|s|ms|d|h|n|r|1/m)\b|\W|\w+[_(.]")  # units, symbols, names: may begin a sentence
SKIPPED = re.compile(r"(using|friend|static_assert|inline|enum)\b")
SCOPE = re.compile(r"(?:(?:struct|class) (\w+)|namespace [\w:]+)[^;=(]*\{$")


def in_python(text):
    for pattern, word in WORDS:
        text = re.sub(pattern, word, text)
    text = text if AS_IT_IS.match(text) else text[0].upper() + text[1:]
    return text if text.endswith((".", "…")) else text + "."


def name_of(statement):
    """The member, function or class that it declares; None: nothing."""
    if scope := SCOPE.match(statement):
        return scope[1]
    while (plain := re.sub(r"<[^<>]*>", "", statement)) != statement:
        statement = plain
    words = re.findall(r"\w+", re.split(r"[=({;]", statement)[0])
    return words[-1] if words and not SKIPPED.match(statement) else None


def docs_of(header):
    """Qualified name -> comment, of a header that clang-format has laid out."""
    docs, last = {}, None
    scopes = []  # their names; "" of namespaces, None of what has no members: bodies, enumerations, initialisers
    above, statement = [], ""
    for line in map(str.strip, header.read_text().splitlines()):
        if line.startswith("///<"):
            docs[last] += " " + line[4:].strip()
            continue
        if line.startswith("///"):
            above.append(line[4:])
            continue
        code, _, beside = map(str.strip, line.partition("///<"))
        code = "" if code.startswith(("#", "//")) else code.partition("  //")[0].strip()
        if code.startswith("}"):
            scopes.pop()
            code = code[1:].strip()
        if scopes and scopes[-1] is None:
            opened = code.count("{") - code.count("}")
            scopes = scopes + [None] * opened if opened >= 0 else scopes[:opened]
            continue
        statement = f"{statement} {code}".strip()
        if statement and not statement.endswith((";", "{", "}", ":")):
            continue  # goes on in the next line
        name = name_of(statement)
        if name and (beside or above):
            last = ".".join([*filter(None, scopes), name])
            docs.setdefault(last, beside or "\n".join(above))
        opened = statement.count("{") - statement.count("}")
        scopes += [name or ""] if SCOPE.match(statement) else [None] * opened
        above, statement = [], ""
    return docs


def main():
    docs = {}
    for header in sys.argv[2:]:
        docs = docs_of(pathlib.Path(header)) | docs
    rows = [f"    {{{json.dumps(name)}, {json.dumps(in_python(text), ensure_ascii=False)}}},\n"
            for name, text in sorted(docs.items())]
    pathlib.Path(sys.argv[1]).write_text(
        "#include <string_view>\n#include <utility>\n\n"
        f"inline constexpr std::pair<std::string_view, const char*> header_docs[] = {{\n{''.join(rows)}}};\n")


if __name__ == "__main__":
    main()
