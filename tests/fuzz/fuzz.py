"""Coverage-guided fuzzing of the parser and the checker, by atheris (pip install -e '.[fuzz]').

    python tests/fuzz/fuzz.py [FOLDER] [-max_total_time=600] [libFuzzer options]

Texts that reach new code are kept in FOLDER (build/fuzz by default), with the repository's networks as a start. What
raises, or takes more than 5 s, ends the run with a file `crash-...` in the current folder. Mend the fault, and put the
file into tests/fuzz/corpus, where test_corpus.py replays it.
"""

from __future__ import annotations

import random
import re
import signal
import sys
from pathlib import Path
from types import FrameType

import atheris

ROOT = Path(__file__).resolve().parent.parent.parent
sys.path.insert(0, str(ROOT))
SECONDS = 5  # of processor time, for a text of 4 KB at most

WORDS = (ROOT / "tests" / "fuzz" / "words.txt").read_text("utf-8").splitlines()

with atheris.instrument_imports(include=["lnc"]):
    from lnc.diagnostics.codes import PAGES
    from tests.fuzz.target import check


def one(data: bytes) -> None:
    signal.setitimer(signal.ITIMER_VIRTUAL, SECONDS)
    check(data.decode("utf-8", "replace"))
    signal.setitimer(signal.ITIMER_VIRTUAL, 0)


def too_slow(_signal: int, _frame: FrameType | None) -> None:
    raise TimeoutError(f"more than {SECONDS} s of processor time")


def mutate(data: bytes, max_size: int, seed: int) -> bytes:
    """libFuzzer's mutations of bytes, or ours: pieces of the language moved, doubled, dropped or replaced by others."""
    chance = random.Random(seed)
    if chance.random() < 0.3:
        return bytes(atheris.Mutate(data, max_size))
    pieces = re.findall(r"\w+|\n|\s+|[^\w\s]", data.decode("utf-8", "replace")) or [" "]
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(pieces))
        end = at + chance.choice((1, 1, 2, 5, 20))
        match chance.randrange(4):
            case 0:
                pieces[at:end] = [" ", chance.choice(WORDS), " "]
            case 1:
                pieces[at:at] = [" ", chance.choice(WORDS), " "]
            case 2:
                pieces[at:at] = pieces[chance.randrange(len(pieces)) :][: end - at]
            case 3 if len(pieces) > end - at:
                del pieces[at:end]
    return "".join(pieces).encode()[:max_size]


def seed(folder: Path) -> None:
    """The networks of the repository, and the examples of the messages' pages."""
    folder.mkdir(parents=True, exist_ok=True)
    texts = [path.read_text("utf-8") for pattern in ("examples/*.ln", "tests/**/*.ln") for path in ROOT.glob(pattern)]
    texts += [page.example for page in PAGES.values() if page.example]
    for number, text in enumerate(texts):
        (folder / f"seed-{number}").write_text(text, "utf-8")


def main() -> None:
    folders = [argument for argument in sys.argv[1:] if not argument.startswith("-")]
    options = [argument for argument in sys.argv[1:] if argument.startswith("-")]
    folder = Path(folders[0]) if folders else ROOT / "build" / "fuzz"
    seed(folder)
    arguments = [sys.argv[0], str(folder), "-max_len=4096", *options]
    signal.signal(signal.SIGVTALRM, too_slow)
    atheris.Setup(arguments, one, custom_mutator=mutate)
    atheris.Fuzz()


if __name__ == "__main__":
    main()
