"""Immutable records, as frozen dataclasses are, without their cost at import: the syntax tree has fifty of them.

`@dataclass` writes and compiles five methods per class, a millisecond each time `lnc` starts; these share theirs.
"""

from __future__ import annotations

from typing import Any, ClassVar, Self, dataclass_transform


@dataclass_transform(frozen_default=True)
class Record:
    """Fields are the annotations of a subclass. Fields called `span` or `..._span` do not count in comparisons."""

    __match_args__: ClassVar[tuple[str, ...]] = ()
    _compared: ClassVar[tuple[str, ...]] = ()
    _defaults: ClassVar[dict[str, Any]] = {}

    def __init_subclass__(cls) -> None:
        names = tuple(cls.__annotations__)
        cls.__match_args__ = names  # type: ignore[misc]
        cls._compared = tuple(n for n in names if n != "span" and not n.endswith("_span"))
        cls._defaults = {n: cls.__dict__[n] for n in names if n in cls.__dict__}

    def __init__(self, *values: Any, **named: Any) -> None:
        fields = self.__dict__
        names = self.__match_args__
        fields.update(zip(names, values, strict=False))
        fields.update(named)
        if len(fields) != len(names) or len(values) > len(names):
            for name, value in self._defaults.items():
                fields.setdefault(name, value)
            if set(fields) != set(names) or len(values) > len(names):
                raise TypeError(f"{type(self).__name__} takes {', '.join(names)}")

    def changed(self, **changes: Any) -> Self:
        """A copy with other values for some fields."""
        return type(self)(**{**self.__dict__, **changes})

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"{type(self).__name__} is immutable")

    def __eq__(self, other: object) -> bool:
        if self is other:
            return True
        if type(self) is not type(other):
            return NotImplemented
        return all(self.__dict__[n] == other.__dict__[n] for n in self._compared)

    def __hash__(self) -> int:
        return hash((type(self), *(self.__dict__[n] for n in self._compared)))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{n}={self.__dict__[n]!r}' for n in self._compared)})"
