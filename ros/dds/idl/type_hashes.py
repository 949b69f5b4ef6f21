"""Writes the type hashes (REP 2016, RIHS01) of what octosurf-dds reads and writes, by the types' names over DDS, as a C++
table: type_hashes.py type_hashes.hpp

ROS 2 since Iron warns about endpoints without. Those of ros2.idl are the published definitions', octosurf_msgs' follow
from its files."""

import hashlib
import json
import pathlib
import re
import sys

from make_idl import PACKAGE, members_of

HERE = pathlib.Path(__file__).resolve().parent
# type_description_interfaces/FieldType, by IDL's names.
IDS = {"float": 10, "double": 11, "octet": 3, "int8": 2, "short": 4, "unsigned short": 5, "long": 6, "unsigned long": 7,
       "long long": 8, "unsigned long long": 9, "boolean": 15, "string": 17}
BOUNDED_STRING, ARRAY, SEQUENCE = 21, 48, 144
# Topics' types that are parts of others, too.
NESTED_ELSEWHERE = {"octosurf_msgs/msg/Surfaces", "grid_map_msgs/msg/GridMap", "std_msgs/msg/Float32MultiArray"}


def ros_name(name):
    """a::msg::dds_::B_ → a/msg/B"""
    return name.replace("::dds_::", "::").replace("::", "/").removesuffix("_")


def field(idl_type, name, size=""):
    sequence = re.fullmatch(r"sequence<(.*)>", idl_type)
    element = sequence[1] if sequence else idl_type
    bounded = re.fullmatch(r"string<(\d+)>", element)
    nested = "" if bounded or element in IDS else ros_name(element)
    kind = 1 if nested else BOUNDED_STRING if bounded else IDS[element]
    return {"name": name, "type": {"type_id": kind + (SEQUENCE if sequence else ARRAY if size else 0), "capacity": int(size or 0),
                                   "string_capacity": int(bounded[1]) if bounded else 0, "nested_type_name": nested}}


def fields_of(members):
    """Of "TYPE NAME;" and "TYPE NAME[N];"."""
    return [field(*re.fullmatch(r"(.+) (\w+)(?:\[(\d+)\])?;", member).groups("")) for member in members]


def described():
    """The fields of each type."""
    types = {}
    for module in re.finditer(r"module (\w+) \{ module msg \{ module dds_ \{(.*?)\n\}; \}; \};", (HERE / "ros2.idl").read_text(), re.S):
        for name, body in re.findall(r"struct (\w+)_ \{(.*?)\};", module[2], re.S):
            body = re.sub(r"sequence<octet>( \w+;) *// int8\[\]", r"sequence<int8>\1", body)
            members = " ".join(re.sub(r"//.*", "", body).split()).split(";")[:-1]
            types[f"{module[1]}/msg/{name}"] = fields_of(f"{member.strip()};" for member in members)
    for file in sorted(PACKAGE.glob("*/*.*")):
        parts = zip(("_Request", "_Response"), file.read_text().split("---\n")) if file.suffix == ".srv" else [("", file.read_text())]
        for part, definition in parts:
            types[f"{PACKAGE.name}/{file.parent.name}/{file.stem}{part}"] = fields_of(member for _, member in members_of(definition))
    return types


def hash_of(name, types):
    referenced = set()

    def add(of):
        for one in types[of]:
            nested = one["type"]["nested_type_name"]
            if nested and nested not in referenced:
                referenced.add(nested)
                add(nested)

    add(name)
    describe = lambda of: {"type_name": of, "fields": types[of]}
    text = json.dumps({"type_description": describe(name), "referenced_type_descriptions": [describe(of) for of in sorted(referenced)]})
    return "RIHS01_" + hashlib.sha256(text.encode()).hexdigest()


def dds_name(name):
    package, kind, name = name.split("/")
    return f"{package}::{kind}::dds_::{name}_"


def text():
    types = described()
    used = {field["type"]["nested_type_name"] for fields in types.values() for field in fields}
    outermost = sorted(name for name in types if name not in used or name in NESTED_ELSEWHERE)
    rows = "".join(f'    {{"{dds_name(name)}", "{hash_of(name, types)}"}},\n' for name in outermost)
    return ("#include <string_view>\n#include <utility>\n\n"
            f"inline constexpr std::pair<std::string_view, std::string_view> type_hashes[] = {{\n{rows}}};\n")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    pathlib.Path(sys.argv[1]).write_text(text())
