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

HEADER = '''"""Types and docstrings of octosurf, written by bindings/python/stubs/make_stub.py."""

import os
from collections.abc import Mapping, Sequence
from typing import Any, Optional, Union, overload

import numpy as np
import numpy.typing as npt

__version__: str
'''
# pybind11's types, as results are said, and what arguments may be instead.
TYPES = [(r"octosurf\._octosurf\.|\[\d+\]", "", ""), (r"Annotated\[(.*?), FixedSize\(\d+\)\]", r"\1", r"\1"),
         (r"numpy\.ndarray\[numpy\.(\w+)(\[[^]]*\])?\]", r"npt.NDArray[np.\1]", "npt.ArrayLike"),
         (r"\b[Ll]ist\b", "list", "Sequence"), (r"\b[Dd]ict\[", "dict[", "Mapping["), (r"\bTuple\b", "tuple", "tuple"),
         (r"\bdict\b(?!\[)", *["dict[str, Any]"] * 2), (r"\btuple\b(?!\[)", *["tuple[Any, ...]"] * 2),
         (r"\bos\.PathLike\b", *["Union[str, os.PathLike[str]]"] * 2), (r"\bobject\b", "Any", "Any")]
SPECIAL = "__bool__ __eq__ __init__ __iter__ __len__ __next__ __repr__".split()


def python_type(node, given):
    """Of an argument, or of a result."""
    text = ast.unparse(node)
    for pattern, result, argument in TYPES:
        text = re.sub(pattern, argument if given else result, text)
    return text


def parsed(signature):
    signature = re.sub(r"numpy\.ndarray(\[octosurf::[^]]*\]|(?!\[))", "numpy.ndarray[numpy.void]", signature)
    return ast.parse("def " + re.sub(r"\(self: [\w.]+", "(self", signature.strip()) + ": ...").body[0]


def keywords_of(cls):
    """What a constructor takes that takes the fields of settings by name; of Parameters, those of its groups, too."""
    fields = {}
    for name, member in vars(cls).items():
        if isinstance(member, property) and member.fset:
            kind = python_type(parsed("_" + member.fset.__doc__.strip()).args.args[1].annotation, True)
            group = getattr(octosurf, kind, None)
            if cls is octosurf.Parameters and group:
                fields |= keywords_of(group)
            fields[name] = f"Union[{kind}, Mapping[str, Any]]" if group else kind
    return fields


def definition(signature, doc, owner):
    """What pybind11 says of a function, as Python would define it."""
    function = parsed(signature)
    args = function.args
    for one in args.args + args.kwonlyargs:
        one.annotation = one.annotation and ast.Name(python_type(one.annotation, True))
    args.defaults = [ast.Constant(...) for _ in args.defaults]
    args.kw_defaults = [one and ast.Constant(...) for one in args.kw_defaults]
    if args.kwarg:
        keywords = keywords_of(octosurf.Parameters if owner in (octosurf.Mapper, octosurf.Map) else owner)
        args.kwonlyargs += [ast.arg(name, ast.Name(kind)) for name, kind in sorted(keywords.items())]
        args.kw_defaults += [ast.Constant(...) for _ in keywords]
        args.vararg = args.kwarg = None
    return with_docstring(f"def {function.name}({ast.unparse(args)}) -> {python_type(function.returns, False)}:", doc)


def with_docstring(line, doc):
    if not doc:
        return [f"{line} ..."]
    doc = doc.replace("\\", "\\\\").replace('"""', '\\"\\"\\"')
    end = '\n"""' if "\n" in doc or doc.endswith('"') else '"""'
    return [line, *[f"    {one}" if one else "" for one in f'"""{doc}{end}'.splitlines()]]


def lines_of(name, member, owner=None):
    if inspect.isclass(member):
        lines = with_docstring(f"class {name}:", member.__doc__)
        for inner, one in sorted(vars(member).items()):
            if not inner.startswith("_") or inner in SPECIAL and one.__doc__.startswith(inner):
                lines += ["    " + line if line else "" for line in lines_of(inner, one, member)]
        return lines
    if isinstance(member, property):
        signature = name + member.fget.__doc__.replace("(arg0", "(self")
        lines = ["@property", *definition(signature, member.__doc__, owner)]
        return lines + ([f"@{name}.setter", *definition(name + member.fset.__doc__, "", owner)] if member.fset else [])
    # Signature and docstring of each overload.
    doc = getattr(owner or octosurf, name).__doc__
    _, *found = re.split(rf"^(?:\d+\. )?({name}\(.*\) -> .*)$", doc, flags=re.MULTILINE)
    if not found:
        raise SystemExit(f"make_stub.py: {name} has no signature")
    lines = []
    for signature, doc in zip(found[::2], found[1::2]):
        lines += ["@overload"] * (len(found) > 2) + ["@staticmethod"] * isinstance(member, staticmethod)
        lines += definition(signature, doc.strip(), owner)
    return lines


members = {name: getattr(octosurf, name) for name in octosurf.__all__ if name != "Error"}
error = with_docstring("class Error(Exception):", octosurf.Error.__doc__)
blocks = [[*error, *[f"    {name}: str" for name in ("kind", "where", "hint")]]]
blocks += [lines_of(*one) for one in sorted(members.items(), key=lambda one: (not inspect.isclass(one[1]), one[0]))]
text = "\n\n".join("\n".join(block) for block in blocks)
(FOLDER / "octosurf/__init__.pyi").write_text(f"{HEADER}\n{text}\n")
