# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The expressions of a xacro file, `${...}` and `$(eval ...)`, computed node by node of Python's syntax tree.

What is not listed here is refused: expressions reach numbers, text, lists, mappings, the functions below and xacro's
own, and never an attribute of an object, a function of their own (lambda) or anything that Python would import.
"""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Iterator, Mapping
from typing import Any

_BUILTINS: tuple[Callable[..., Any], ...] = (
    *(abs, all, any, bool, complex, dict, divmod, enumerate, filter, float, frozenset, int, isinstance, len, list, map),
    *(max, min, ord, range, repr, reversed, round, set, sorted, str, sum, tuple, zip),
)
FUNCTIONS: dict[str, Callable[..., Any]] = {each.__name__: each for each in _BUILTINS} | {
    name: each for name, each in vars(math).items() if callable(each) and not name.startswith("_")
}
CONSTANTS: dict[str, Any] = {"pi": math.pi, "e": math.e, "tau": math.tau, "inf": math.inf, "nan": math.nan}
# Functions that xacro adds: they read data beside the file, or print.
OF_XACRO = (
    *("load_yaml", "abs_filename", "dotify", "arg", "tokenize", "message", "warning", "error", "fatal"),
    *("print_location", "dirname", "find", "env", "optenv"),
)
MOST_BITS = 4096
NAMESPACES = ("math", "python", "xacro")
# Methods by the exact types whose they are; str.format is none of them, since it reaches attributes.
METHODS: dict[str, tuple[type, ...]] = dict.fromkeys(
    (
        *("capitalize", "endswith", "find", "isdigit", "join", "lower", "lstrip", "replace", "rsplit", "rstrip"),
        *("split", "startswith", "strip", "title", "upper", "zfill"),
    ),
    (str,),
) | {"get": (dict,), "items": (dict,), "keys": (dict,), "values": (dict,), "index": (str, list), "count": (str, list)}


def _power(base: Any, exponent: Any) -> Any:
    """`base ** exponent`, unless it is an integer of more than MOST_BITS bits."""
    if isinstance(base, int) and isinstance(exponent, int) and base.bit_length() * exponent > MOST_BITS:
        raise OverflowError("the power is too large for a robot")
    return base**exponent


_OPERATORS: dict[type[ast.AST], Callable[..., Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: _power,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
    ast.Invert: operator.invert,
    ast.Not: operator.not_,
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.In: lambda a, b: operator.contains(b, a),
    ast.NotIn: lambda a, b: not operator.contains(b, a),
}


class NotAllowedError(Exception):
    """An expression holds what this evaluator does not know."""


def evaluate(expression: str, names: Mapping[str, Any], more: Mapping[str, Any] | None = None) -> Any:
    """The value of an expression.

    Args:
        expression: Python's syntax of one expression.
        names: Values by name: properties and arguments of the xacro file, and the functions that xacro exposes.
        more: More of them, looked in first.

    Raises:
        NotAllowedError: It uses syntax, a function or an attribute that is not listed in this module.
        SyntaxError, NameError, TypeError, ValueError, ArithmeticError, LookupError: As Python's own evaluation would.
    """
    tree = ast.parse(expression.strip(), mode="eval")
    return _Evaluator(names, more or {}).value(tree.body)


class _Evaluator:
    """Walks a tree; `bound` are the variables of comprehensions."""

    def __init__(self, *names: Mapping[str, Any]) -> None:
        self.names = tuple(reversed(names))
        self.bound: dict[str, Any] = {}

    def value(self, node: ast.AST) -> Any:
        """The value of a node."""
        method = getattr(self, f"_{type(node).__name__}", None)
        if method is None:
            raise NotAllowedError(f"{type(node).__name__} is not known in an expression")
        return method(node)

    def _Constant(self, node: ast.Constant) -> Any:
        return node.value

    def _Name(self, node: ast.Name) -> Any:
        return self._named(node.id)

    def _named(self, name: str) -> Any:
        if name.startswith("__"):
            raise NotAllowedError(f"the name {name} is not known in an expression")
        if name in self.bound:
            return self.bound[name]
        for names in self.names:
            try:
                found = names[name]
            except KeyError:
                continue
            return self._trusted(name, found)
        if name in FUNCTIONS or name in CONSTANTS:
            return FUNCTIONS.get(name, CONSTANTS.get(name))
        raise NameError(f"name '{name}' is not defined")

    @staticmethod
    def _trusted(name: str, found: Any) -> Any:
        """Data as it is; of functions those of the lists alone, Python's own as they are known here."""
        if not callable(found):
            return found
        if name in FUNCTIONS:
            return FUNCTIONS[name]
        if name in OF_XACRO:
            return found
        raise NotAllowedError(f"the function {name} is not known in an expression")

    def _Attribute(self, node: ast.Attribute) -> Any:
        """An entry of a namespace or of a mapping read from YAML: never an attribute of an object."""
        owner = self.value(node.value)
        if not isinstance(owner, Mapping) or node.attr.startswith("__"):
            raise NotAllowedError(f"the attribute {node.attr} is not known in an expression")
        try:
            return self._trusted(node.attr, owner[node.attr])
        except (KeyError, AttributeError):
            raise NameError(f"name '{node.attr}' is not defined") from None

    def _Call(self, node: ast.Call) -> Any:
        function = self._function(node.func)
        arguments: list[Any] = []
        for each in node.args:
            arguments += self.value(each.value) if isinstance(each, ast.Starred) else [self.value(each)]
        keywords = {word.arg: self.value(word.value) for word in node.keywords if word.arg is not None}
        if len(keywords) < len(node.keywords):
            raise NotAllowedError("** is not known in an expression")
        return function(*arguments, **keywords)

    def _function(self, node: ast.expr) -> Callable[..., Any]:
        if isinstance(node, ast.Attribute) and node.attr in METHODS:
            owner = self.value(node.value)
            for kind in METHODS[node.attr]:
                if isinstance(owner, kind) and not self._is_namespace(node.value):
                    method: Callable[..., Any] = getattr(kind, node.attr)
                    return lambda *given, **words: method(owner, *given, **words)
        found = self.value(node)
        if not callable(found):
            raise TypeError(f"{ast.unparse(node)} is not a function")
        return found  # type: ignore[no-any-return] # _trusted let it through

    @staticmethod
    def _is_namespace(node: ast.expr) -> bool:
        return isinstance(node, ast.Name) and node.id in NAMESPACES

    def _UnaryOp(self, node: ast.UnaryOp) -> Any:
        return _OPERATORS[type(node.op)](self.value(node.operand))

    def _BinOp(self, node: ast.BinOp) -> Any:
        operation = _OPERATORS.get(type(node.op))
        if operation is None:
            raise NotAllowedError("@ is not known in an expression")
        return operation(self.value(node.left), self.value(node.right))

    def _BoolOp(self, node: ast.BoolOp) -> Any:
        stop = isinstance(node.op, ast.Or)
        found: Any = None
        for each in node.values:
            found = self.value(each)
            if bool(found) == stop:
                break
        return found

    def _Compare(self, node: ast.Compare) -> Any:
        left = self.value(node.left)
        for kind, each in zip(node.ops, node.comparators, strict=True):
            right = self.value(each)
            if not _OPERATORS[type(kind)](left, right):
                return False
            left = right
        return True

    def _IfExp(self, node: ast.IfExp) -> Any:
        return self.value(node.body if self.value(node.test) else node.orelse)

    def _List(self, node: ast.List) -> list[Any]:
        return [self.value(each) for each in node.elts]

    def _Tuple(self, node: ast.Tuple) -> tuple[Any, ...]:
        return tuple(self.value(each) for each in node.elts)

    def _Set(self, node: ast.Set) -> set[Any]:
        return {self.value(each) for each in node.elts}

    def _Dict(self, node: ast.Dict) -> dict[Any, Any]:
        if None in node.keys:
            raise NotAllowedError("** is not known in an expression")
        keys = [key for key in node.keys if key is not None]
        return {self.value(key): self.value(each) for key, each in zip(keys, node.values, strict=True)}

    def _Subscript(self, node: ast.Subscript) -> Any:
        owner, place = self.value(node.value), self.value(node.slice)
        found = owner[place]
        return self._trusted(str(place), found) if callable(found) else found

    def _Slice(self, node: ast.Slice) -> slice:
        return slice(*(None if each is None else self.value(each) for each in (node.lower, node.upper, node.step)))

    def _ListComp(self, node: ast.ListComp) -> list[Any]:
        return [self.value(node.elt) for _ in self._bindings(node.generators)]

    def _GeneratorExp(self, node: ast.GeneratorExp) -> list[Any]:
        return [self.value(node.elt) for _ in self._bindings(node.generators)]

    def _SetComp(self, node: ast.SetComp) -> set[Any]:
        return {self.value(node.elt) for _ in self._bindings(node.generators)}

    def _DictComp(self, node: ast.DictComp) -> dict[Any, Any]:
        return {self.value(node.key): self.value(node.value) for _ in self._bindings(node.generators)}

    def _bindings(self, generators: list[ast.comprehension]) -> Iterator[None]:
        """Binds the variables of a comprehension to one set of values after the other."""
        if not generators:
            yield
            return
        first, *others = generators
        outside = dict(self.bound)
        for each in self.value(first.iter):
            self.bound = outside | _unpacked(first.target, each)
            if all(self.value(test) for test in first.ifs):
                yield from self._bindings(others)
        self.bound = outside


def _unpacked(target: ast.expr, value: Any) -> dict[str, Any]:
    """The variables of `for TARGET in ...` and their values."""
    if isinstance(target, ast.Name):
        return {target.id: value}
    if isinstance(target, ast.Tuple | ast.List):
        values = list(value)
        if len(values) != len(target.elts):
            raise ValueError(f"expected {len(target.elts)} values to unpack, got {len(values)}")
        return {k: v for part, each in zip(target.elts, values, strict=True) for k, v in _unpacked(part, each).items()}
    raise NotAllowedError("only names can be bound in an expression")
