"""Numbers with units: the text of a literal -> its value in SI units."""

from __future__ import annotations

import math
import re

from lnc.diagnostics import quote

UNITS: dict[str, dict[str, float]] = {
    "count": {"": 1, "k": 1e3, "M": 1e6, "G": 1e9},
    "number": {"": 1, "k": 1e3, "M": 1e6, "G": 1e9},
    "ratio": {"": 1, "%": 0.01},
    "length": {"m": 1, "km": 1e3, "cm": 1e-2, "mm": 1e-3, "um": 1e-6},
    "angle": {"deg": math.pi / 180, "rad": 1},
    "time": {"s": 1, "ms": 1e-3, "min": 60, "h": 3600},
}
EXAMPLES = {"count": "200k", "number": "0.5", "ratio": "1%", "length": "5cm", "angle": "30deg", "time": "10s"}
_LITERAL = re.compile(r"(-?[0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?)([A-Za-z%]*)")


class ValueFault(Exception):
    """A literal that does not fit its type; the text says what was wanted."""


def number(text: str, type: str) -> int | float:
    """The value of a literal of one of the types in UNITS. Raises ValueFault."""
    match = _LITERAL.fullmatch(text)
    if match is None or len(text) > 100:
        raise ValueFault(f"{quote(text)} is not a number")
    digits, unit = match.groups()
    units = UNITS[type]
    value = float(digits)
    if unit not in units and not (value == 0 and unit == ""):
        known = ", ".join(u for u in units if u)
        if unit == "":
            raise ValueFault(f"{quote(text)} needs a unit ({known}): for example {EXAMPLES[type]}")
        example = f"; write {value / 100:g}" if type == "number" and unit == "%" else ""
        raise ValueFault(f"{quote(unit)} is not a unit of a {type} (known: {known}){example}")
    value *= units.get(unit, 1)
    if not math.isfinite(value):
        raise ValueFault(f"{quote(text)} is too large")
    if type == "count":
        if abs(value - round(value)) > 1e-6 * max(1, abs(value)):
            raise ValueFault(f"{quote(text)} is not a whole number")
        return round(value)
    return value
