"""Directed graphs as `node -> the nodes it reads`: components, loops. No recursion, so any size will do."""

from __future__ import annotations


def strong_components(sources: dict[str, list[str]]) -> list[list[str]]:
    """Strongly connected components, what is read before what reads it; members in the order of `sources`.

    Tarjan's algorithm.
    """
    position = {name: i for i, name in enumerate(sources)}
    number: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    on_stack: set[str] = set()
    components: list[list[str]] = []
    for root, reads in sources.items():
        if root in number:
            continue
        work = [(root, iter(reads))]
        number[root] = low[root] = len(number)
        stack.append(root)
        on_stack.add(root)
        while work:
            name, rest = work[-1]
            for source in rest:
                if source not in number:
                    number[source] = low[source] = len(number)
                    stack.append(source)
                    on_stack.add(source)
                    work.append((source, iter(sources[source])))
                    break
                if source in on_stack:
                    low[name] = min(low[name], number[source])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[name])
                if low[name] == number[name]:
                    members: list[str] = []
                    while not members or members[-1] != name:
                        members.append(stack.pop())
                        on_stack.discard(members[-1])
                    components.append(sorted(members, key=position.__getitem__))
    return components


def find_loop(sources: dict[str, list[str]], consumer: str, source: str) -> list[str]:
    """The shortest loop through the edge source -> consumer, as the light flows, beginning at `consumer`."""
    before: dict[str, str] = {source: source}
    queue = [source]
    for name in queue:
        if name == consumer:
            break
        for reads in sources[name]:
            if reads not in before:
                before[reads] = name
                queue.append(reads)
    loop = [consumer]
    while loop[-1] != source:
        loop.append(before[loop[-1]])
    return loop
