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


def tidy(signature):
    """A signature of pybind11 as Python: names of NumPy's types, defaults that no checker can read."""
    text = signature.replace("hapsix._hapsix.", "").replace("(self: object", "(self")
    text = re.sub(r"numpy\.ndarray(\[[^\]]*\])?", "NDArray[Any]", text)
    text = re.sub(r"List\[float\[\d+\]\]|List\[int\[\d+\]\]", "Sequence[float]", text)
    text = re.sub(r"(self|arg0): \w+", "self", text)
    text = re.sub(r"= array\([^)]*\)|= <[^>]*>|= \[[^\]]*\]", "= ...", text)
    text = text.replace("h6FrameRecord", "Any").replace("::", "").replace("handle", "object")
    text = re.sub(r"\bfunction: object", "function: Optional[Callable[[str, str], None]]", text)
    text = re.sub(r"progress: object", "progress: Optional[Callable[[str, float], Optional[bool]]]", text)
    text = re.sub(r"\*\*kwargs", "**kwargs: Any", text)
    text = re.sub(r"kwargs: Any: Any", "kwargs: Any", text)
    text = re.sub(r"(\w+): (\w+) = None", r"\1: Optional[\2] = None", text)
    parameters, arrow, result = text.partition(" -> ")  # an argument may be a list of numbers too
    return parameters.replace("NDArray[Any]", "ArrayLike") + arrow + result


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
        marks = (f"{indent}@overload\n" if len(overloads) > 1 else "") + (f"{indent}@staticmethod\n" if static else "")
        out += f"{marks}{indent}def {signature}:\n" + body(" ".join(found[i + 1:end]), indent + "    ")
    return out


def attribute(name, value, indent):
    got = tidy((value.fget.__doc__ or "").strip().splitlines()[0])
    kind = got.split("->")[1].strip() if "->" in got else "Any"
    mark = "" if value.fset else f"{indent}@property\n{indent}def {name}(self) -> {kind}:\n"
    about = inspect.getdoc(value) or ""
    if not value.fset:
        return mark + body(about, indent + "    ")
    # What may be assigned is wider than what is read: any sequence of numbers for a tuple.
    kind = "Any" if kind in ("tuple", "object") else kind
    return f"{indent}{name}: {kind}\n" + (body(about, indent) if about else "")


def class_of(name, cls):
    out = f"class {name}:\n" + body(cls.__doc__ or "", "    ")
    members = [(n, v) for n, v in vars(cls).items()
               if n in ("__init__", "__len__") or not n.startswith("_")]
    for n, v in sorted(members, key=lambda m: (m[0] != "__init__", m[0])):
        if isinstance(v, property):
            out += attribute(n, v, "    ")
        else:
            static = isinstance(v, staticmethod)
            out += function(n, (v.__func__ if static else v).__doc__, "    ", static)
    return out


def main():
    print("# SPDX-License-Identifier: Apache-2.0")
    print("# Written by python/stubs.py.")
    print("from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple, overload\n")
    print("from numpy.typing import ArrayLike, NDArray\n")
    print("class Error(RuntimeError):")
    print(body(module.Error.__doc__, "    ") + "    code: str\n")
    for name, value in sorted(vars(module).items(), key=lambda m: (not inspect.isclass(m[1]), m[0])):
        if name.startswith("_") or name == "Error":
            continue
        print(class_of(name, value) if inspect.isclass(value) else function(name, value.__doc__))


if __name__ == "__main__":
    main()
