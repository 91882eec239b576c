"""Right networks of any size, for tests of speed."""

from __future__ import annotations

import random


def network(operators: int, seed: int) -> str:
    """A network of about that many LightOps that carries all light, each path once.

    Paths are told apart by their first events: `w_DG` carries what begins with D G. A tree of such wires grows at
    random places; where it ends, a pull cycle follows all further events.

        direct = Direct(light)
        w_D    = PathTracer(direct, via = D)        a part of the paths: goes on as w_DD, w_DG, w_DS
        w_G    = PathTracer(half_G, via = G) ...    with steps between that change no path
        r_S    = PathTracer(s_S + r_S)              all further events of w_S
    """
    chance = random.Random(seed)
    lines = ["light = Lights()", "direct = Direct(light)"]
    terms = ["direct"]
    ends = {"": "direct"}  # events so far -> wire
    while len(lines) + len(ends) < operators - 3:
        events = chance.choice(sorted(ends))
        wire = ends.pop(events)
        if chance.random() < 0.3:
            lines.append(f"same_{len(lines)} = Scale({wire}, factor = 1)")
            wire = lines[-1].split(" ")[0]
        for event in "DGS":
            lines.append(f"w_{events}{event} = PathTracer({wire}, via = {event})")
            ends[events + event] = f"w_{events}{event}"
            terms.append(f"w_{events}{event}")
    for events, wire in ends.items():
        lines.append(f"r_{events} = PathTracer({wire} + r_{events})")
        terms.append(f"r_{events}")
    chance.shuffle(lines)
    lines += ["expect L@area (D|G|S)* E | L@delta (D|G) (D|G|S)* E", f"image {' + '.join(terms)}"]
    return "\n".join(lines) + "\n"
