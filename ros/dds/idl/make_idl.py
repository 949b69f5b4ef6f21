"""Writes the messages and services of ../../octosurf_msgs as IDL: make_idl.py octosurf_msgs.idl"""

import pathlib
import re
import sys

PACKAGE = pathlib.Path(__file__).resolve().parents[2] / "octosurf_msgs"
HEAD = """\
// octosurf_msgs (the .msg and .srv files explain the fields) as DDS names its types, written by make_idl.py. Requests and replies begin with what rmw_cyclonedds_cpp puts before them: the client's id and the
// request's number.
#include "ros2.idl"
"""
NUMBERS = {"bool": "boolean", "uint8": "octet", "uint32": "unsigned long", "uint64": "unsigned long long",
           "float64": "double", "string": "string"}


def type_of(name):
    if name in NUMBERS:
        return NUMBERS[name]
    package, _, message = name.rpartition("/")
    return f"{package or PACKAGE.name}::msg::dds_::{message}_"


def members_of(definition):
    """(the type's name, the member in IDL) for each field; constants are none."""
    for line in definition.splitlines():
        field = line.partition("#")[0].split()
        if not field or "=" in line.partition("#")[0]:
            continue
        name, array, size = re.fullmatch(r"([\w/]+)(\[(\d*)\])?", field[0]).groups()
        kind = f"sequence<{type_of(name)}>" if array and not size else type_of(name)
        yield name, f"{kind} {field[1]}" + (f"[{size}]" if size else "") + ";"


def struct(name, members):
    return [f"    struct {name}_ {{", *(f"      {member}" for member in members), "    };"]


def messages():
    """Those that others are made of before these."""
    definitions = {file.stem: list(members_of(file.read_text())) for file in sorted((PACKAGE / "msg").glob("*.msg"))}
    done = {}

    def add(name):
        for part, _ in definitions[name]:
            if part in definitions and part not in done:
                add(part)
        done.setdefault(name, struct(name, [member for _, member in definitions[name]]))

    for name in definitions:
        add(name)
    return [line for lines in done.values() for line in lines]


def services():
    call = f"{PACKAGE.name}::srv::dds_::Call_ call;"
    yield from struct("Call", ["unsigned long long client;", "long long number;"])
    for file in sorted((PACKAGE / "srv").glob("*.srv")):
        for part, definition in zip(("Request", "Response"), file.read_text().split("---\n"), strict=True):
            yield from struct(f"{file.stem}_{part}", [call, *(member for _, member in members_of(definition))])


def idl():
    lines = [HEAD, f"module {PACKAGE.name} {{", "  module msg { module dds_ {", *messages(), "  }; };", "",
             "  module srv { module dds_ {", *services(), "  }; };", "};"]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    pathlib.Path(sys.argv[1]).write_text(idl())
