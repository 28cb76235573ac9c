#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes hapsix/_hapsix.pyi from the module's own signatures: PYTHONPATH=BUILD/python python/stubs.py > FILE.
A test compares the file with what this prints."""
import inspect
import re
import sys
import textwrap

if __name__ == "__main__":
    sys.path.pop(0)  # the folder of this file has the package without its module
import hapsix._hapsix as module  # noqa: E402


# Names that only the stub has: what may be given for a few numbers, and the dicts that calls return.
HEAD = """\
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, TypedDict, Union, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Numbers = Union[Sequence[float], NDArray[np.floating[Any]], NDArray[np.integer[Any]]]

class _MeshInfo(TypedDict):
    triangles: int
    vertices: int
    parts: int
    duplicates: int
    degenerate: int
    open_edges: int
    odd_edges: int
    components: int
    closed: bool
    low: Tuple[float, ...]
    high: Tuple[float, ...]
    volume: float
    names: List[str]

class _FieldCheck(TypedDict):
    agrees: bool
    drains: bool
    leak: Tuple[float, ...]
    worst_node: float
    worst_between: float
    wall_hundredth: float
    wall_median: float
    gap_hundredth: float
    gap_median: float
    pushed: int
    holding_force: float
    weakest: Tuple[float, ...]

class _Safety(TypedDict):
    state: str
    fault: str
    frames: Dict[str, int]
"""
# Keywords that pass through `**kwargs`.
FIELD_OPTIONS = ("voxels: int, voxel_size: float, tolerance: float, offset: float, sign: str, hollow: bool, "
                 "seal: float, weld: float, band_voxels: float, threads: int, cache: bool")
SHELL_OPTIONS = "points: int, spacing: float, levels: int, seed: int, surface: str, normals: str, " + FIELD_OPTIONS
OPTIONS = {"bake_field": FIELD_OPTIONS, "bake_shell": SHELL_OPTIONS}


def array_of(match):
    kind = match.group(1)
    if kind is None:
        return "NDArray[Any]"
    kind = {"bool": "numpy.bool_"}.get(kind, kind if kind.startswith("numpy.") else "numpy.void")
    return f"NDArray[{kind.replace('numpy.', 'np.')}]"


def tidy(signature):
    """A signature of pybind11 as Python: names of NumPy's types, defaults that no checker can read."""
    text = signature.replace("hapsix._hapsix.", "").replace("(self: object", "(self")
    text = re.sub(r"numpy\.ndarray(?:\[([^\]]*)\])?", array_of, text)
    text = re.sub(r"(self|arg0): \w+", "self", text)
    text = re.sub(r"= array\([^)]*\)|= <[^>]*>|= \[[^\]]*\]", "= ...", text)
    text = re.sub(r"\bfunction: object", "function: Optional[Callable[[str, str], None]]", text)
    text = re.sub(r"progress: object", "progress: Optional[Callable[[str, float], Optional[bool]]]", text)
    text = re.sub(r"(\w+): (\w+) = None", r"\1: Optional[\2] = None", text)
    parameters, arrow, result = text.partition(" -> ")
    return given(parameters) + arrow + result


def given(text):
    """What may be given is wider than what is returned: lists for arrays, any sequence for a list."""
    text = re.sub(r"List\[float\[\d+\]\]", "_Numbers", text)
    text = re.sub(r"List\[int\[\d+\]\]", "Sequence[int]", text)
    text = re.sub(r"NDArray\[(?!np\.void)[^\]]*\]", "ArrayLike", text)
    return text.replace("List[", "Sequence[")


def spread(keywords):
    return ", ".join(f"{k} = ..." for k in keywords)


def lines_of(doc):
    return [line for line in (doc or "").splitlines() if line.strip()]


def body(doc, indent):
    text = " ".join(doc.split())
    quoted = textwrap.fill(text, 98 - len(indent), initial_indent=indent + '"""', subsequent_indent=indent)
    return quoted + '"""\n' if text else f"{indent}...\n"


def function(name, doc, indent="", static=False):
    found = lines_of(doc)
    overloads = [i for i, line in enumerate(found) if re.match(rf"\s*(\d+\. )?{re.escape(name)}\(", line)]
    overloads = [i for i in overloads if "*args, **kwargs" not in found[i] or len(overloads) == 1]
    out = ""
    for k, i in enumerate(overloads):
        end = overloads[k + 1] if k + 1 < len(overloads) else len(found)
        signature = tidy(re.sub(r"^\s*(\d+\. )?", "", found[i]))
        if name in OPTIONS:
            signature = signature.replace("**kwargs", spread(OPTIONS[name].split(", ")))
        marks = (f"{indent}@overload\n" if len(overloads) > 1 else "") + (f"{indent}@staticmethod\n" if static else "")
        out += f"{marks}{indent}def {signature}:\n" + body(" ".join(found[i + 1:end]), indent + "    ")
    return out


def kind_of(value):
    """The types that a property has as it is read and as it is written; "" where it is only read."""
    read = tidy((value.fget.__doc__ or "").strip().splitlines()[0]).split("->")[1].strip()
    if not value.fset:
        return read, ""
    signature = (value.fset.__doc__ or "").strip().splitlines()[0].replace("hapsix._hapsix.", "")
    return read, given(re.search(r"arg\d: ([^:]*)\) -> None", signature).group(1))


def attribute(name, value, indent):
    read, written = kind_of(value)
    about = inspect.getdoc(value) or ""
    if read == written:
        return f"{indent}{name}: {read}\n" + (body(about, indent) if about else "")
    out = f"{indent}@property\n{indent}def {name}(self) -> {read}:\n" + body(about, indent + "    ")
    if written:
        out += f"{indent}@{name}.setter\n{indent}def {name}(self, value: {written}) -> None: ...\n"
    return out


def class_of(name, cls):
    out = f"class {name}:\n" + body(cls.__doc__ or "", "    ")
    members = [(n, v) for n, v in vars(cls).items()
               if n in ("__init__", "__len__") or not n.startswith("_")]
    for n, v in sorted(members, key=lambda m: (m[0] != "__init__", m[0])):
        if isinstance(v, property):
            out += attribute(n, v, "    ")
        else:
            static = isinstance(v, staticmethod)
            made = function(n, (v.__func__ if static else v).__doc__, "    ", static)
            # A definition takes each attribute as a keyword.
            names = sorted(m for m, p in members if isinstance(p, property))
            out += made.replace("**kwargs", "*, " + spread(f"{m}: {kind_of(vars(cls)[m])[1]}" for m in names))
    return out


def main():
    print("# SPDX-License-Identifier: Apache-2.0")
    print("# Written by python/stubs.py.")
    print(HEAD)
    print("class Error(RuntimeError):")
    print(body(module.Error.__doc__, "    ") + "    code: str\n")
    for name, value in sorted(vars(module).items(), key=lambda m: (not inspect.isclass(m[1]), m[0])):
        if name.startswith("_") or name == "Error":
            continue
        print(class_of(name, value) if inspect.isclass(value) else function(name, value.__doc__))


if __name__ == "__main__":
    main()
