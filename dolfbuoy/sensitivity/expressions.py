"""Arithmetic with parameters of a scene and outputs of its run, with derivatives.

    sum     = product {("+" | "-") product}
    product = power {("*" | "/") power}
    power   = ["-"] atom ["**" number]
    atom    = number | NAME | "(" sum ")"

A NAME is a key of the scene (`cable.line_density`) or an output (`tension_top.max`, or `tension_top.max[port]` for one
line).
"""

import operator
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from ..scene.quantities import number_of

_TOKEN = re.compile(
    r"\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)|([A-Za-z_][\w.-]*(?:\[[^\]]*\])?)|(\*\*|[-+*/()]))"
)
#: Largest number of characters in an expression, and of brackets.
LONGEST, DEEPEST = 1000, 30


@dataclass(frozen=True)
class Dual:
    """A number and its derivatives."""

    value: float
    slope: NDArray[Any]

    def __add__(self, other: "Dual") -> "Dual":
        return Dual(self.value + other.value, self.slope + other.slope)

    def __sub__(self, other: "Dual") -> "Dual":
        return Dual(self.value - other.value, self.slope - other.slope)

    def __mul__(self, other: "Dual") -> "Dual":
        return Dual(self.value * other.value, self.slope * other.value + other.slope * self.value)

    def __truediv__(self, other: "Dual") -> "Dual":
        ratio = self.value / other.value
        return Dual(ratio, (self.slope - ratio * other.slope) / other.value)

    def __pow__(self, power: float) -> "Dual":
        return Dual(self.value**power, power * self.value ** (power - 1) * self.slope)


OPERATORS = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}
Tree = tuple[Any, ...]  #: ("number", x), ("name", NAME), ("-", tree), (operator, left, right), ("**", tree, x)


class Expression:
    """A parsed expression.  Raises InputError if it is invalid; where: the option that it belongs to."""

    def __init__(self, text: str, where: str) -> None:
        self.text, self._where = text.strip(), where
        if len(self.text) > LONGEST:
            raise self._wrong(f"must have {LONGEST} characters at most")
        self._tokens, place = [], 0
        while place < len(self.text):
            found = _TOKEN.match(self.text, place)
            if found is None:
                raise self._wrong(f"cannot be read from {self.text[place : place + 10]!r} on")
            self._tokens.append(found.groups())
            place = found.end()
        self._deep = 0
        self.tree = self._sum()
        if self._tokens:
            raise self._wrong(f"ends before {''.join(part or '' for part in self._tokens[0])!r}")

    def _wrong(self, why: str) -> InputError:
        return InputError(
            f"{self._where} {self.text[:80]}: {why}; it takes numbers, keys, outputs, + - * / ** and brackets."
        )

    def _operator(self, *allowed: str) -> str | None:
        if self._tokens and self._tokens[0][2] in allowed:
            return str(self._tokens.pop(0)[2])
        return None

    def _sum(self) -> Tree:
        tree = self._product()
        while sign := self._operator("+", "-"):
            tree = (sign, tree, self._product())
        return tree

    def _product(self) -> Tree:
        tree = self._power()
        while sign := self._operator("*", "/"):
            tree = (sign, tree, self._power())
        return tree

    def _power(self) -> Tree:
        if self._operator("-"):
            return ("-", ("number", 0.0), self._power())
        tree = self._atom()
        if self._operator("**"):
            minus = -1.0 if self._operator("-") else 1.0
            number, _, _ = self._tokens.pop(0) if self._tokens else (None, None, None)
            if number is None:
                raise self._wrong("a power must be a number")
            tree = ("**", tree, minus * self._number(number))
        return tree

    def _number(self, text: str) -> float:
        try:
            return number_of(text)
        except ValueError as error:
            raise self._wrong(str(error)) from None

    def _atom(self) -> Tree:
        if not self._tokens:
            raise self._wrong("ends too early")
        number, name, sign = self._tokens.pop(0)
        if number is not None:
            return ("number", self._number(number))
        if name is not None:
            return ("name", name)
        if sign != "(":
            raise self._wrong(f"has {sign!r} where a number or a name must stand")
        self._deep += 1
        if self._deep > DEEPEST:
            raise self._wrong(f"has more than {DEEPEST} brackets")
        tree = self._sum()
        if not self._operator(")"):
            raise self._wrong("has a bracket that is not closed")
        return tree

    @property
    def names(self) -> list[str]:
        """The keys and outputs in it."""
        found, rest = [], [self.tree]
        while rest:
            kind, *parts = rest.pop()
            if kind == "name":
                found.append(parts[0])
            rest += [part for part in parts if isinstance(part, tuple)]
        return list(dict.fromkeys(found))

    def at(self, value_of: Callable[[str], Dual], size: int) -> Dual:
        """Value of the expression for these values of its names, with `size` derivatives.  Raises InputError."""

        def value(tree: Tree) -> Dual:
            kind, *parts = tree
            if kind == "number":
                return Dual(parts[0], np.zeros(size))
            if kind == "name":
                return value_of(parts[0])
            if kind == "**":
                return value(parts[0]) ** parts[1]
            return OPERATORS[kind](value(parts[0]), value(parts[1]))

        try:
            found = value(self.tree)
        except (ZeroDivisionError, OverflowError):
            raise self._wrong("divides by zero, or is too large") from None
        if isinstance(found.value, complex) or not np.isfinite(found.value):
            raise self._wrong("has no value here")
        return found
