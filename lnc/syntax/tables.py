"""The parse table: made by lark from the grammar, once, and kept in the cache as plain data."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from lnc.locations import cached, compiler_fingerprint, grammar_file


@dataclass(frozen=True)
class Rule:
    """A production. `keep[i]`: the i-th symbol's value is handed to the action.

    `inlined`: its name begins with _, it has no action, and its children become those of the rule above.
    """

    name: str
    keep: tuple[bool, ...]
    inlined: bool


@dataclass(frozen=True)
class Tables:
    """An LALR(1) table and the lexer that belongs to it.

    `actions[state][symbol]` is a state to go to (0 or more), or -1 - index of the rule to reduce by.
    """

    actions: tuple[dict[str, int], ...]
    rules: tuple[Rule, ...]
    start: int
    end: int
    pattern: str  # of the lexer: one named group per terminal
    keywords: dict[str, str]  # word -> terminal
    spelling: dict[str, str]  # terminal -> how messages write it


@cache
def load_tables() -> Tables:
    """The tables of `grammar/network.lark`, read once in a process."""
    return cached("grammar", compiler_fingerprint(), lambda: build_tables(grammar_file().read_text("utf-8")))


def build_tables(grammar: str) -> Tables:
    """Let lark analyse the grammar and keep what a parser needs; lark is not imported otherwise."""
    import lark
    from lark.grammar import Rule as LarkRule
    from lark.lexer import TerminalDef

    parser = lark.Lark(grammar, parser="lalr", lexer="basic", start="file", maybe_placeholders=False)
    data, memo = parser.memo_serialize([TerminalDef, LarkRule])
    table = data["parser"]["parser"]
    symbols: dict[int, str] = table["tokens"]

    rules: list[Rule] = []
    rule_index: dict[int, int] = {}
    for number, entry in memo.items():
        if entry["__type__"] == "Rule":
            rule_index[number] = len(rules)
            keep = tuple(not symbol.get("filter_out", False) for symbol in entry["expansion"])
            name = entry["origin"]["name"]
            rules.append(Rule(name, keep, name.startswith("_")))

    states: list[dict[str, int]] = [{} for _ in table["states"]]
    for state, row in table["states"].items():
        for symbol, (kind, argument) in row.items():
            states[state][symbols[symbol]] = argument if kind == 0 else -1 - rule_index[argument["@"]]

    pattern, keywords, spelling = _lexer([entry for entry in memo.values() if entry["__type__"] == "TerminalDef"])
    start, end = table["start_states"]["file"], table["end_states"]["file"]
    return Tables(tuple(states), tuple(rules), start, end, pattern, keywords, spelling)


def _lexer(terminals: list[dict[str, object]]) -> tuple[str, dict[str, str], dict[str, str]]:
    """One regular expression for all terminals; words that are keywords are matched as names first."""
    keywords: dict[str, str] = {}
    spelling: dict[str, str] = {}
    expressions: list[tuple[int, int, str, str]] = []
    for entry in terminals:
        name = str(entry["name"])
        pattern: dict[str, object] = entry["pattern"]  # type: ignore[assignment]
        value = str(pattern["value"])
        if pattern["__type__"] == "PatternRE":
            expressions.append((-int(str(entry["priority"])), 0, name, value))
        elif value.isalpha():
            keywords[value] = name
            spelling[name] = value
        else:
            expressions.append((1, -len(value), name, "".join("\\" + c for c in value)))
            spelling[name] = value
    return "|".join(f"(?P<{name}>{value})" for _, _, name, value in sorted(expressions)), keywords, spelling
