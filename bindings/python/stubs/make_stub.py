#!/usr/bin/env python3
"""Writes octosurf/__init__.pyi, the types of the module, out of the signatures that pybind11 puts into docstrings:
make_stub.py FOLDER, where FOLDER/octosurf is the package.
"""

import inspect
import pathlib
import re
import sys

FOLDER = pathlib.Path(sys.argv[1])
sys.path.insert(0, str(FOLDER))
import octosurf  # noqa: E402
from octosurf import _octosurf  # noqa: E402

HEADER = '''"""Types and docstrings of octosurf, written by bindings/python/stubs/make_stub.py."""

import os
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Dict, List, Optional, Tuple, Union, overload

import numpy as np
import numpy.typing as npt

__version__: str

'''


def split(text):
    """At the commas that stand in no bracket and no quotes."""
    parts, depth, quote, start = [], 0, "", 0
    for at, char in enumerate(text):
        if quote:
            quote = "" if char == quote else quote
        elif char in "'\"":
            quote = char
        elif char in "[({":
            depth += 1
        elif char in "])}":
            depth -= 1
        elif char == "," and depth == 0:
            parts.append(text[start:at].strip())
            start = at + 1
    return [part for part in parts + [text[start:].strip()] if part]


def array_of(inside, given):
    """`numpy.float64[m, 3]` or a C++ type of rows, as an argument or as a result."""
    if given:
        return "npt.ArrayLike"
    element = re.match(r"numpy\.(\w+)", inside)
    return f"npt.NDArray[np.{element.group(1)}]" if element else "npt.NDArray[np.void]"


def python_type(text, given):
    text = text.strip()
    if text.startswith("numpy.ndarray"):
        return array_of(text[len("numpy.ndarray["):-1], given)
    if text == "os.PathLike":
        return "Union[str, os.PathLike[str]]"
    generic = re.match(r"(List|Dict|Tuple|Optional|Union)\[(.*)\]$", text)
    if generic:
        name, inside = generic.groups()
        fixed = re.match(r"(\w+)\[(\d+)\]$", inside)
        if name == "List" and fixed:
            return f"List[{python_type(fixed.group(1), given)}]"
        kinds = [python_type(part, given) for part in split(inside)]
        if given and name in ("List", "Dict"):
            name = {"List": "Sequence", "Dict": "Mapping"}[name]
        return f"{name}[{', '.join(kinds)}]"
    if text.startswith("octosurf._octosurf."):
        return text[len("octosurf._octosurf."):].split(".")[-1] if "OccupancyView." not in text else (
            "OccupancyView." + text.split(".")[-1])
    if text == "dict":
        return "Dict[str, Any]"
    if text == "tuple":
        return "Tuple[Any, ...]"
    if text == "object":
        return "Any"
    if text in ("float", "int", "str", "bool", "None"):
        return text
    raise SystemExit(f"make_stub.py: no Python type for '{text}'")


def parameter(text, owner):
    if text == "**kwargs":
        return keywords_of(octosurf.Parameters if owner in (octosurf.Mapper, octosurf.Map) else owner)
    if text in ("*", "self") or re.match(r"self: ", text):
        return "self" if text != "*" else "*"
    name, kind = text.split(":", 1) if ":" in text else (text, "object")
    has_default = re.search(r" = ", kind)
    kind = kind[:has_default.start()] if has_default else kind
    if name == "arg0" and owner:
        return "self"
    return f"{name}: {python_type(kind, True)}" + (" = ..." if has_default else "")


def signatures(function, name):
    """(parameters, result, docstring) of each overload."""
    pattern = re.compile(rf"^(?:\d+\. )?{re.escape(name)}\((.*)\) -> (.*)$")
    found = []
    for line in (function.__doc__ or "").splitlines():
        match = pattern.match(line)
        if match:
            found.append((*match.groups(), []))
        elif found:
            found[-1][2].append(line)
    found = [(parameters, result, "\n".join(lines).strip()) for parameters, result, lines in found]
    if not found:
        raise SystemExit(f"make_stub.py: {name} has no signature")
    return found


def keywords_of(cls):
    """What a constructor takes that takes the fields of settings by name; of Parameters, those of its groups, too."""
    fields = []
    for name, member in vars(cls).items():
        if isinstance(member, property) and member.fset:
            kind = python_type(setter_type(member), True)
            group = getattr(octosurf, kind, None)
            if cls is octosurf.Parameters and group is octosurf.AlignmentParameters:
                fields.append("align: bool = ...")
            elif cls is octosurf.Parameters and group:
                fields += split(keywords_of(group))[1:]
            fields.append(f"{name}: {f'Union[{kind}, Mapping[str, Any]]' if group else kind} = ...")
    return ", ".join(["*", *sorted(fields)])


def with_docstring(line, doc, indent):
    """A definition and what it says of itself."""
    if not doc:
        return [f"{line} ..."]
    doc = doc.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    first, *more = f'"""{doc}'.splitlines()
    more += ['"""'] if more or doc.endswith('"') else []
    lines = [first, *more] if more else [f'{first}"""']
    return [line, *[f"{indent}    {one}" if one else "" for one in lines]]


def setter_type(member):
    return split(re.match(r"\((.*)\) -> None", member.fset.__doc__).group(1))[1].split(":", 1)[1]


def function_lines(function, name, owner=None, static=False):
    found = signatures(function, name)
    lines, indent = [], "    " if owner else ""
    for parameters, result, doc in found:
        if len(found) > 1:
            lines.append(f"{indent}@overload")
        if static:
            lines.append(f"{indent}@staticmethod")
        inside = ", ".join(parameter(part, None if static else owner) for part in split(parameters))
        lines += with_docstring(f"{indent}def {name}({inside}) -> {python_type(result, False)}:", doc, indent)
    return lines


def property_lines(name, member):
    kind = python_type(re.match(r"\(.*\) -> (.*)", member.fget.__doc__).group(1), False)
    lines = ["    @property", *with_docstring(f"    def {name}(self) -> {kind}:", member.__doc__, "    ")]
    if member.fset:
        lines += [f"    @{name}.setter", f"    def {name}(self, value: {python_type(setter_type(member), True)}) -> None: ..."]
    return lines


def special_lines(cls, name, member):
    fixed = {
        "__iter__": "    def __iter__(self) -> Iterator[Scan]: ...",
        "__eq__": "    def __eq__(self, other: object) -> bool: ...",
        "__repr__": "    def __repr__(self) -> str: ...",
    }
    if name in fixed:
        return [fixed[name]]
    if name == "__init__" and not member.__doc__.startswith("__init__("):
        return []  # only the library makes these
    return function_lines(member, name, cls) if name in ("__init__", "__len__", "__next__", "__bool__") else []


def class_lines(cls):
    body = []
    for name, member in sorted(vars(cls).items()):
        if inspect.isclass(member):
            body += ["    " + line if line else "" for line in class_lines(member)]
        elif isinstance(member, property):
            body += property_lines(name, member)
        elif name.startswith("__"):
            body += special_lines(cls, name, member)
        elif isinstance(member, staticmethod) or not hasattr(member, "__get__") or is_static(cls, name):
            body += function_lines(getattr(cls, name), name, cls, static=True)
        else:
            body += function_lines(member, name, cls)
    return with_docstring(f"class {cls.__name__}:", cls.__doc__, "") + body


def is_static(cls, name):
    return type(inspect.getattr_static(cls, name)).__name__ in ("staticmethod", "pybind11_static_method")


def error_lines():
    return [*with_docstring("class Error(Exception):", octosurf.Error.__doc__, ""), "    kind: str", "    where: str", "    mend: str"]


def main():
    blocks = [error_lines()]
    names = [name for name in octosurf.__all__ if name != "Error"]
    for name in sorted(names, key=lambda one: (not inspect.isclass(getattr(_octosurf, one)), one)):
        member = getattr(_octosurf, name)
        blocks.append(class_lines(member) if inspect.isclass(member) else function_lines(member, name))
    stub = FOLDER / "octosurf/__init__.pyi"
    stub.write_text(HEADER + "\n\n".join("\n".join(block) for block in blocks) + "\n")


if __name__ == "__main__":
    main()
