#!/usr/bin/env python3
"""Writes octosurf/__init__.pyi, the types of the module, out of the signatures that pybind11 puts into docstrings:
make_stub.py FOLDER, where FOLDER/octosurf is the package.
"""

import ast
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
PLAIN = {name: name for name in ("float", "int", "str", "bytes", "bool", "None")} | {
    "dict": "Dict[str, Any]", "tuple": "Tuple[Any, ...]", "object": "Any",
    "os.PathLike": "Union[str, os.PathLike[str]]"}
AS_GIVEN = {"List": "Sequence", "Dict": "Mapping"}  # what arguments may be instead
FIXED = {"__iter__": "def __iter__(self) -> Iterator[Scan]: ...", "__eq__": "def __eq__(self, other: object) -> bool: ...",
         "__repr__": "def __repr__(self) -> str: ..."}
BY_SIGNATURE = ("__init__", "__len__", "__next__", "__bool__")


def python_type(node, given):
    """Of an argument, or of a result."""
    text = ast.unparse(node) if node else "object"
    if text in PLAIN:
        return PLAIN[text]
    if text.startswith("octosurf._octosurf."):
        return text.removeprefix("octosurf._octosurf.")
    if text.startswith("numpy.ndarray"):  # of numpy.float64[m, 3], or of a C++ struct
        element = re.match(r"numpy\.ndarray\[numpy\.(\w+)", text)
        return "npt.ArrayLike" if given else f"npt.NDArray[np.{element[1] if element else 'void'}]"
    if not isinstance(node, ast.Subscript):
        raise SystemExit(f"make_stub.py: no Python type for '{text}'")
    parts = node.slice.elts if isinstance(node.slice, ast.Tuple) else [node.slice]
    if isinstance(parts[0], ast.Subscript) and isinstance(parts[0].slice, ast.Constant):
        parts = [parts[0].value]  # List[float[3]]
    name = AS_GIVEN.get(node.value.id, node.value.id) if given else node.value.id
    return f"{name}[{', '.join(python_type(part, given) for part in parts)}]"


def parsed(signature):
    return ast.parse(f"def {re.sub(r'octosurf::[^]]*', 'void', signature)}: ...").body[0]


def setter_type(member):
    return python_type(parsed("_" + member.fset.__doc__.strip()).args.args[1].annotation, True)


def keywords_of(cls):
    """What a constructor takes that takes the fields of settings by name; of Parameters, those of its groups, too."""
    fields = {}
    for name, member in vars(cls).items():
        if isinstance(member, property) and member.fset:
            kind = setter_type(member)
            group = getattr(octosurf, kind, None)
            if cls is octosurf.Parameters and group:
                fields |= keywords_of(group)
            fields[name] = f"Union[{kind}, Mapping[str, Any]]" if group else kind
    return fields


def definition(signature, owner, static):
    """What pybind11 says of a function, as Python would define it."""
    function = parsed(signature)
    args = function.args
    for one in args.args + args.kwonlyargs:
        one.annotation = ast.Name(python_type(one.annotation, True))
    if owner and not static:
        args.args[0] = ast.arg("self")
    args.defaults = [ast.Constant(...) for _ in args.defaults]
    args.kw_defaults = [one and ast.Constant(...) for one in args.kw_defaults]
    if args.kwarg:
        keywords = keywords_of(octosurf.Parameters if owner in (octosurf.Mapper, octosurf.Map) else owner)
        args.kwonlyargs += [ast.arg(name, ast.Name(kind)) for name, kind in sorted(keywords.items())]
        args.kw_defaults += [ast.Constant(...) for _ in keywords]
        args.kwarg = None
    return f"def {function.name}({ast.unparse(args)}) -> {python_type(function.returns, False)}:"


def with_docstring(line, doc):
    """A definition and what it says of itself."""
    if not doc:
        return [f"{line} ..."]
    doc = doc.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    end = '\n"""' if "\n" in doc or doc.endswith('"') else '"""'
    return [line, *[f"    {one}" if one else "" for one in f'"""{doc}{end}'.splitlines()]]


def function_lines(function, name, owner=None, static=False):
    # Signature and docstring of each overload.
    pattern = rf"^(?:\d+\. )?({re.escape(name)}\(.*\) -> .*)$"
    _, *found = re.split(pattern, function.__doc__ or "", flags=re.MULTILINE)
    if not found:
        raise SystemExit(f"make_stub.py: {name} has no signature")
    lines = []
    for signature, doc in zip(found[::2], found[1::2]):
        lines += ["@overload"] * (len(found) > 2) + ["@staticmethod"] * static
        lines += with_docstring(definition(signature, owner, static), doc.strip())
    return lines


def property_lines(name, member):
    kind = python_type(parsed("_" + member.fget.__doc__.strip()).returns, False)
    lines = ["@property", *with_docstring(f"def {name}(self) -> {kind}:", member.__doc__)]
    if member.fset:
        lines += [f"@{name}.setter", f"def {name}(self, value: {setter_type(member)}) -> None: ..."]
    return lines


def member_lines(cls, name, member):
    if inspect.isclass(member):
        return class_lines(member)
    if isinstance(member, property):
        return property_lines(name, member)
    if name in FIXED:
        return [FIXED[name]]
    if name.startswith("__") and (name not in BY_SIGNATURE or not member.__doc__.startswith(f"{name}(")):
        return []  # such as __init__ of what only the library makes
    static = "static" in type(inspect.getattr_static(cls, name)).__name__
    return function_lines(getattr(cls, name), name, cls, static)


def class_lines(cls):
    lines = with_docstring(f"class {cls.__name__}:", cls.__doc__)
    for name, member in sorted(vars(cls).items()):
        lines += ["    " + line if line else "" for line in member_lines(cls, name, member)]
    return lines


def main():
    blocks = [[*with_docstring("class Error(Exception):", octosurf.Error.__doc__), "    kind: str", "    where: str",
               "    hint: str"]]
    names = [name for name in octosurf.__all__ if name != "Error"]
    for name in sorted(names, key=lambda one: (not inspect.isclass(getattr(_octosurf, one)), one)):
        member = getattr(_octosurf, name)
        blocks.append(class_lines(member) if inspect.isclass(member) else function_lines(member, name))
    text = "\n\n".join("\n".join(block) for block in blocks)
    (FOLDER / "octosurf/__init__.pyi").write_text(f"{HEADER}{text}\n")


if __name__ == "__main__":
    main()
