"""C++ spellings: identifiers, literals, comments. Nothing that a user writes can leave the place it is put in."""

from __future__ import annotations

import math
from collections.abc import Iterable

# Members of the generated struct, and names that its functions use.
RESERVED = frozenset(
    {
        "Network",
        "image",
        "prepare",
        "measured",
        "request",
        "write",
        "write_taps",
        "next",
        "step",
        "context",
        "ln",
        "main",
        "std",
        "value",
    }
)


def unique_names(wanted: Iterable[str], prefix: str = "", taken: Iterable[str] = ()) -> dict[str, str]:
    """A C++ name for each wanted one: itself with the prefix, followed by `_` as often as it takes to be new."""
    used = set(RESERVED) | set(taken)
    names: dict[str, str] = {}
    for name in wanted:
        candidate = prefix + name
        while candidate in used:
            candidate += "_"
        used.add(candidate)
        names[name] = candidate
    return names


def cpp_string(text: str) -> str:
    """A string literal with the same UTF-8 bytes. Octal escapes, three digits each, cannot swallow what follows."""
    out: list[str] = []
    for byte in text.encode("utf-8", "surrogateescape"):
        char = chr(byte)
        out.append(char if 0x20 <= byte < 0x7F and char not in '"\\?' else f"\\{byte:03o}")
    return '"' + "".join(out) + '"'


def comment_text(text: str) -> str:
    """Text for a `//` comment: one line, and no backslash at its end that would continue the comment."""
    line = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text).rstrip()
    return line + " ." if line.endswith(("\\", "??/")) else line


def float_literal(value: float) -> str:
    """A float literal that has the value exactly as near as a float can."""
    if not math.isfinite(value):
        raise ValueError(f"no literal for {value}")
    text = repr(float(value))
    return text + "f"
