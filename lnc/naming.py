"""Names for nodes that the text does not name."""

from __future__ import annotations

from collections.abc import Iterable

from lnc.library import snake_case


class Names:
    """The names that are taken."""

    def __init__(self, taken: Iterable[str]) -> None:
        self._taken = set(taken)
        self._last: dict[str, int] = {}

    def free(self, name: str) -> str:
        """The name, or the first of name_2, name_3, ... that is free; it is taken from now on."""
        found, number = name, self._last.get(name, 1)
        while found in self._taken:
            number += 1
            found = f"{name}_{number}"
        self._last[name] = number
        self._taken.add(found)
        return found

    def derived(self, base: str, op: str) -> str:
        """`caustic` and KDPhotonTree give `caustic_tree`."""
        return self.free(f"{base}_{snake_case(op)[-100:].rsplit('_', 1)[-1] or 'wire'}")
