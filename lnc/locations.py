"""The one place that knows where the grammar, the operator library, the runtime and the cache lie."""

from __future__ import annotations

import hashlib
import os
import pickle
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

import lnc

T = TypeVar("T")

KEPT = 16  # cache files of one kind
_PACKAGE = Path(__file__).resolve().parent


def data_root() -> Path:
    """Holds `ops_library`, `runtime` and `CMakeLists.txt`: the checkout, or the wheel's data."""
    installed = _PACKAGE / "_data"
    return installed if installed.is_dir() else _PACKAGE.parent


def grammar_file() -> Path:
    return _PACKAGE / "grammar" / "network.lark"


def library_folders(extra: tuple[str, ...] = ()) -> tuple[Path, ...]:
    """The built-in operator library, then the folders of LNC_OPS_PATH, then those of `--ops`."""
    listed = [part for part in os.environ.get("LNC_OPS_PATH", "").split(os.pathsep) if part]
    return (data_root() / "ops_library", *(Path(folder).absolute() for folder in (*listed, *extra)))


def runtime_folder() -> Path:
    return data_root() / "runtime"


def cache_folder() -> Path:
    """LNC_CACHE, else `lnc` in XDG_CACHE_HOME, else in ~/.cache. It need not exist, nor be writable."""
    if os.environ.get("LNC_CACHE"):
        return Path(os.environ["LNC_CACHE"]).absolute()
    base = os.environ.get("XDG_CACHE_HOME", "")
    if os.path.isabs(base):
        return Path(base) / "lnc"
    try:
        return Path.home() / ".cache" / "lnc"
    except RuntimeError:  # no home folder
        return Path("/tmp") / f"lnc-{os.getuid()}"


def compiler_fingerprint() -> str:
    """Changes with the version of Python, of `lnc`, and with its sources in a checkout."""
    parts = [sys.version, lnc.__version__]
    for folder in (_PACKAGE, _PACKAGE / "syntax", _PACKAGE / "passes", _PACKAGE / "paths", _PACKAGE / "grammar"):
        for entry in sorted(os.scandir(folder), key=lambda e: e.name):
            if entry.name.endswith((".py", ".lark")):
                stat = entry.stat()
                parts.append(f"{entry.name} {stat.st_size} {stat.st_mtime_ns}")
    return "\n".join(parts)


def cached(kind: str, key: str, make: Callable[[], T]) -> T:
    """`make()`, or its pickled result of an earlier run with the same key.

    A cache file is read only if it is ours, nobody else can write it, and its checksum is right; any fault means that
    the value is made again. A cache that cannot be written is not an error.
    """
    path = cache_folder() / "compiler" / f"{kind}-{hashlib.sha256(key.encode()).hexdigest()[:32]}.pickle"
    found = _read_trusted(path)
    if found is not None:
        try:
            return pickle.loads(found)  # type: ignore[no-any-return]
        except Exception:  # whatever a broken file does, the value can be made
            pass
    value = make()
    _write_atomically(path, pickle.dumps(value, protocol=5))
    return value


def _prune(path: Path) -> None:
    """Keep the newest few files of a kind."""
    kind = path.name.split("-")[0]
    files = sorted(path.parent.glob(f"{kind}-*.pickle"), key=lambda file: file.stat().st_mtime, reverse=True)
    for old in files[KEPT:]:
        old.unlink(missing_ok=True)


def _read_trusted(path: Path) -> bytes | None:
    try:
        with path.open("rb") as file:
            stat = os.fstat(file.fileno())
            if stat.st_uid != os.getuid() or stat.st_mode & 0o022:
                return None
            content = file.read()
    except OSError:
        return None
    digest, payload = content[:32], content[32:]
    return payload if hashlib.sha256(payload).digest() == digest else None


def _write_atomically(path: Path, payload: bytes) -> None:
    temporary = path.with_name(f"{path.name}.{os.getpid()}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(descriptor, "wb") as file:
            file.write(hashlib.sha256(payload).digest() + payload)
        os.replace(temporary, path)
        _prune(path)
    except OSError:
        with suppress(OSError):
            temporary.unlink()
