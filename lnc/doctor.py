"""`lnc doctor`: whether everything is there that a network needs to become a program."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import lnc
from lnc import locations
from lnc.library_reader import load_library

TOOLS = (
    ("C++ compiler", ("c++", "g++", "clang++"), "install g++"),
    ("cmake", ("cmake",), "install cmake"),
    ("pkg-config", ("pkg-config",), "install pkg-config"),
)
LIBRARIES = (("OpenEXR", "OpenEXR", "libopenexr-dev"), ("OpenImageIO", "OpenImageIO", "libopenimageio-dev"))
EMBREE_HEADERS = ("embree4/rtcore.h", "embree3/rtcore.h")
INCLUDE_FOLDERS = ("/usr/include", "/usr/local/include", "/opt/homebrew/include")


def doctor(ops: tuple[str, ...]) -> tuple[str, bool]:
    """A report, and whether nothing is missing."""
    lines = [f"lnc {lnc.__version__}, Python {sys.version.split()[0]}"]
    fine = True

    def say(good: bool, what: str, help: str = "") -> None:
        nonlocal fine
        fine = fine and good
        lines.append(f"  {'ok' if good else 'MISSING':8} {what}" + (f"  ({help})" if help and not good else ""))

    library, faults = load_library(ops)
    folders = ", ".join(str(f) for f in locations.library_folders(ops))
    say(not faults and bool(library.operators), f"{len(library.operators)} operators in {folders}", "see: lnc ops")
    headers = [op for op in library.operators.values() if not os.path.exists(f"{op.folder}/{op.file_stem}.hpp")]
    say(not headers, "a C++ header for each operator", "without: " + ", ".join(op.name for op in headers))
    say((locations.runtime_folder() / "cpp").is_dir(), f"runtime sources in {locations.runtime_folder()}")
    say(_writable(), f"cache folder {locations.cache_folder()}", "not writable: every start is slow")
    for name, programs, help in TOOLS:
        found = next((path for program in programs if (path := shutil.which(program))), None)
        say(found is not None, f"{name}: {found or 'none on the PATH'}", help)
    header = next((h for h in EMBREE_HEADERS for f in INCLUDE_FOLDERS if os.path.exists(f"{f}/{h}")), None)
    say(header is not None, f"Embree: {header or 'no header found'}", "install libembree-dev")
    for name, package, debian in LIBRARIES:
        version = _pkg_config(package)
        say(version is not None, f"{name}: {version or 'not known to pkg-config'}", f"install {debian}")
    return "\n".join(lines) + "\n", fine


def _writable() -> bool:
    folder = locations.cache_folder()
    while not folder.exists() and folder != folder.parent:
        folder = folder.parent
    return os.access(folder, os.W_OK)


def _pkg_config(package: str) -> str | None:
    program = shutil.which("pkg-config")
    if program is None:
        return None
    done = subprocess.run([program, "--modversion", package], capture_output=True, text=True, check=False)
    return done.stdout.strip() or None
