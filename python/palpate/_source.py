"""Source code and values that decide a planner's plans, so that a run detects an edited planner or another argument."""

from __future__ import annotations

import ast
import dis
import hashlib
import importlib.util
import inspect
import pickle
import sys
import sysconfig
import uuid
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from types import CodeType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

__all__ = ["source_of"]


def source_of(planner: Any) -> str:
    """Returns the source code and the values that decide a planner's plans.

    The code is that of the planner's module and of the modules in its folder that it imports, directly or indirectly;
    installed packages do not count. For a planner of a script or notebook (`__main__`) it is the planner's definition,
    and what the definition uses there. The values are those that the code does not contain: arguments of a partial,
    variables of enclosing functions, defaults, and the state of an instance. A planner with a part that cannot be
    described is unique each time.
    """
    found = _Parts()
    found.add_planner(planner)
    return "\n".join(f"# {name}\n{found.texts[name]}" for name in sorted(found.texts))


class _Parts:
    """Texts by their names, collected once each."""

    def __init__(self) -> None:
        self.texts: dict[str, str] = {}
        self._seen: dict[int, Any] = {}
        self._files: set[Path] = set()

    def _is_new(self, item: Any) -> bool:
        is_new = id(item) not in self._seen
        self._seen[id(item)] = item  # kept, so that no other object gets its id
        return is_new

    def add_planner(self, planner: Any) -> None:
        """Adds a class, a function, a partial, or an instance."""
        if isinstance(planner, partial):
            self.add_planner(planner.func)
            self.texts["arguments"] = self.described([list(planner.args), planner.keywords])
        elif isinstance(planner, (type, FunctionType)):
            self.add_code(planner, is_planner=True)
        else:
            self.add_code(type(planner), is_planner=True)
            self.texts["state"] = self.described(planner)

    def add_code(self, code: Any, is_planner: bool = False) -> None:
        """Adds the source of a class or function, and the values that it uses."""
        if code.__module__ in sys.builtin_module_names or not self._is_new(code):
            return
        module = sys.modules.get(code.__module__)
        file = getattr(module, "__file__", None)
        is_main = module is None or module.__name__ == "__main__" or not file
        if not is_main:
            if _is_installed(Path(str(file))) and not is_planner:
                return
            self.add_module(module)
        for part in getattr(code, "__mro__", (code,)):
            if part.__module__ != code.__module__:
                self.add_code(part)
                continue
            if is_main:
                self._add_definition(part)
            for name, function in _functions(part):
                self._add_values(f"{part.__qualname__} {name}", function, is_main)

    def _add_definition(self, code: Any) -> None:
        try:
            source = inspect.getsource(code)
        except (OSError, TypeError):
            source = _unique()
        if code.__qualname__.endswith("<lambda>"):  # whose source may be cut, or that of several
            source += repr(_bytecode(code.__code__))
        self.texts[f"{code.__module__} {code.__qualname__}"] = source

    def _add_values(self, name: str, function: FunctionType, is_main: bool) -> None:
        """Adds what a function uses besides its source."""
        cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=False)
        values = {variable: _contents(cell) for variable, cell in cells if variable != "__class__"}
        if function.__defaults__ or function.__kwdefaults__:
            values["defaults"] = [function.__defaults__, function.__kwdefaults__]
        if is_main:
            there = function.__globals__
            values |= {used: there[used] for used in _globals(function.__code__) if used in there}
        for variable, value in values.items():
            self.texts[f"{name} {variable}"] = self.described(value)

    def add_module(self, module: Any) -> None:
        """Adds the source of a module and of those in its folder that it imports."""
        folder = Path(str(module.__file__)).parent
        waiting = [(module.__name__, Path(str(module.__file__)))]
        while waiting:
            module_name, file = waiting.pop()
            if file in self._files:
                continue
            self._files.add(file)
            name = file.relative_to(folder).as_posix()
            while name in self.texts:  # of another folder
                name += "+"
            self.texts[name] = file.read_bytes().decode(errors="replace")
            for used in _imported(module_name, self.texts[name]):
                origin = _file_of(used)
                if origin is not None and origin.is_relative_to(folder) and not _is_installed(origin):
                    waiting.append((used, origin))

    def described(self, value: Any) -> str:
        """Returns a text that differs for other values; adds the source of code in it."""
        if isinstance(value, (bool, int, float, complex, str, bytes, type(None), np.generic)):
            return repr(value)
        if isinstance(value, (type, FunctionType)):
            self.add_code(value)
            return f"{value.__module__}:{value.__qualname__}"
        kind = type(value)
        if not self._is_new(value):
            return kind.__qualname__
        if isinstance(value, ModuleType):
            file = _file_of(value.__name__)
            if file is not None and not _is_installed(file):
                self.add_module(value)
            return value.__name__
        if isinstance(value, partial):
            return f"partial({self.described([value.func, list(value.args), value.keywords])})"
        if isinstance(value, MethodType):
            return f"method({self.described([value.__func__, value.__self__])})"
        if kind is dict:
            return "{" + ", ".join(f"{self.described(k)}: {self.described(v)}" for k, v in value.items()) + "}"
        if kind in (list, tuple):
            return "[" + ", ".join(self.described(item) for item in value) + "]"
        if kind in (set, frozenset):
            return "{" + ", ".join(sorted(self.described(item) for item in value)) + "}"
        if kind is np.ndarray and value.dtype != object:
            return f"{value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
        self.add_code(kind)
        try:
            reduced = value.__reduce_ex__(4)
            makes = getattr(reduced[0], "__name__", "") if isinstance(reduced, tuple) else ""
            if makes == "__newobj__" and reduced[1] == (kind,):
                parts = [self.described(_listed(part)) for part in reduced[2:]]
                return f"{kind.__qualname__}({', '.join(parts)})"
            return f"{kind.__qualname__} {hashlib.sha256(pickle.dumps(value, 4)).hexdigest()}"
        except Exception:  # whatever the object's own methods raise
            return _unique()


def _listed(part: Any) -> Any:
    """Returns the items of an iterator as a list."""
    return list(part) if isinstance(part, Iterator) else part


def _bytecode(code: CodeType) -> list[Any]:
    """Returns the instructions, names and constants of code, without its place."""
    constants = [_bytecode(it) if isinstance(it, CodeType) else it for it in code.co_consts]
    return [code.co_code, code.co_names, code.co_varnames, constants]


def _unique() -> str:
    return f"unknown {uuid.uuid4()}"


def _contents(cell: Any) -> Any:
    try:
        return cell.cell_contents
    except ValueError:  # not assigned yet
        return None


def _functions(code: Any) -> Iterator[tuple[str, FunctionType]]:
    """Returns a function, or those of a class, with their names."""
    if isinstance(code, FunctionType):
        yield "", inspect.unwrap(code)
        return
    for name, member in vars(code).items():
        for part in (member, *(getattr(member, it, None) for it in ("__func__", "fget", "fset", "func"))):
            if isinstance(part, FunctionType):
                yield name, inspect.unwrap(part)


def _globals(code: CodeType) -> Iterator[str]:
    """Returns the names of the global variables that code reads."""
    for instruction in dis.get_instructions(code):
        if instruction.opname in ("LOAD_GLOBAL", "LOAD_NAME"):
            yield instruction.argval
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _globals(constant)


def _imported(module: str, text: str) -> list[str]:
    """Returns the full names of the modules that a module's source may import."""
    found = []
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError):
        return []
    known = sys.modules.get(module)
    package = getattr(known, "__package__", None) or ""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            parents = package.split(".")[: -(node.level - 1) or None] if node.level else []
            base = ".".join([*parents, *([node.module] if node.module else [])])
            found += [base, *(f"{base}.{alias.name}" for alias in node.names)]
    return [name for name in found if name]


def _file_of(module: str) -> Path | None:
    """Returns the path of a module's source; None if there is none."""
    try:
        known = sys.modules.get(module)
        origin = known.__file__ if known is not None else importlib.util.find_spec(module).origin  # type: ignore[union-attr]
    except (ImportError, AttributeError, ValueError):
        return None
    file = Path(origin) if origin else None
    return file if file is not None and file.suffix == ".py" and file.is_file() else None


def _is_installed(file: Path) -> bool:
    """Whether a file belongs to Python or to an installed package."""
    is_package = "site-packages" in file.parts or "dist-packages" in file.parts
    return is_package or file.is_relative_to(sysconfig.get_path("stdlib"))
