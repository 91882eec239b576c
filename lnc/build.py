"""From C++ text to a program: the runtime is built once per machine, each network once; a cache is keyed by content."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from lnc.locations import cache_folder, data_root


class BuildError(Exception):
    """The machine cannot build what is asked for; the message says what is missing or what failed."""


@dataclass(frozen=True)
class BuildOptions:
    """`portable`: code for any x86-64 processor instead of this machine's."""

    portable: bool = False


@dataclass(frozen=True)
class Runtime:
    """A built runtime library: how to compile and link against it."""

    key: str
    folder: Path  # the CMake build folder; tests build their targets in it, too
    compiler: str
    compile_flags: tuple[str, ...]
    link_flags: tuple[str, ...]


def build_program(
    cpp: str, include_folders: Iterable[Path], output: Path, options: BuildOptions, quiet: bool = False
) -> None:
    """Compiles a network's C++ text into the program `output`. Raises BuildError.

    `include_folders`: the operator libraries whose headers the text includes. The program is taken from the cache if
    nothing that it is made from has changed.
    """
    _refuse_bad_output(output)
    runtime = build_runtime(options, quiet)
    folders = tuple(include_folders)
    key = digest([runtime.key, cpp, *(_tree_digest(folder, (".hpp",)) for folder in folders)])
    programs = _writable_cache() / "programs"
    programs.mkdir(parents=True, exist_ok=True)
    program = programs / key
    if not program.exists():
        # Not while the library is being built again.
        with _lock(programs / f"{key}.lock"), _lock(runtime.folder / "lock", shared=True):
            if not program.exists():
                _compile(cpp, folders, runtime, program)
    _install(program, output)


def program_path(output: Path) -> Path:
    """Where the cache keeps programs that `lnc run` compiles for itself."""
    return _writable_cache() / "run" / output


def build_runtime(options: BuildOptions, quiet: bool = False) -> Runtime:
    """The runtime library, built if this machine does not have it yet (about two minutes, once).

    Its build folder belongs to the sources' place, the compiler and the processor. When sources change, only what they
    touch is built again.
    """
    root = data_root()
    compiler = os.environ.get("CXX", "c++")
    machine = [_compiler_identity(compiler), "portable" if options.portable else _processor()]
    folder = _writable_cache() / "runtime" / digest([str(root), *machine])[:16]
    key = digest([runtime_sources(), (root / "CMakeLists.txt").read_text(), *machine])
    done = folder / "built"
    if _text_of(done) != key:
        folder.mkdir(parents=True, exist_ok=True)
        with _lock(folder / "lock"):
            if _text_of(done) != key:
                if not quiet:
                    again = (
                        " again: its sources have changed"
                        if done.exists()
                        else " (once for this machine; some two minutes)"
                    )
                    print(f"lnc: building the runtime library{again}", file=sys.stderr, flush=True)
                _cmake(root, folder, options)
                done.write_text(key)
    return _read_flags(key, folder)


def runtime_sources() -> str:
    """Changes with the sources of the runtime library."""
    return _tree_digest(data_root() / "runtime" / "cpp", (".cpp", ".hpp", ".S"))


def digest(parts: Iterable[str]) -> str:
    """Tells sequences of texts apart."""
    found = hashlib.sha256()
    for part in parts:
        data = part.encode("utf-8", "surrogateescape")
        found.update(len(data).to_bytes(8, "little") + data)
    return found.hexdigest()[:32]


def _text_of(file: Path) -> str | None:
    try:
        return file.read_text()
    except OSError:
        return None


def _cmake(root: Path, folder: Path, options: BuildOptions) -> None:
    if shutil.which("cmake") is None:
        raise BuildError("cmake is not installed; 'lnc doctor' lists what is needed")
    generator = ["-G", "Ninja"] if shutil.which("ninja") else []
    portable = "ON" if options.portable else "OFF"
    _run(
        ["cmake", "-S", str(root), "-B", str(folder), *generator, f"-DLN_PORTABLE={portable}"],
        "configuring the runtime library",
    )
    jobs = str(len(os.sched_getaffinity(0)))
    _run(["cmake", "--build", str(folder), "--target", "ln_runtime", "-j", jobs], "building the runtime library")


def _compile(cpp: str, folders: tuple[Path, ...], runtime: Runtime, program: Path) -> None:
    with tempfile.TemporaryDirectory(dir=program.parent) as scratch:
        source = Path(scratch) / "network.cpp"
        source.write_text(cpp, encoding="utf-8", errors="surrogateescape")
        built = Path(scratch) / "program"
        includes = [f"-I{folder}" for folder in folders]
        # The same text gives the same bytes wherever the cache lies.
        prefix = f"-ffile-prefix-map={scratch}=."
        command = [
            runtime.compiler,
            *runtime.compile_flags,
            *includes,
            prefix,
            str(source),
            "-o",
            str(built),
            *runtime.link_flags,
        ]
        _run(command, "compiling the network")
        os.replace(built, program)


def _install(program: Path, output: Path) -> None:
    """Copies to a temporary name and renames: `output` is the old program or the new one, also while it runs."""
    try:
        output.parent.mkdir(parents=True, exist_ok=True)
        descriptor, temporary = tempfile.mkstemp(dir=output.parent, prefix=f".{output.name}.")
        os.close(descriptor)
        try:
            shutil.copyfile(program, temporary)
            os.chmod(temporary, 0o755)
            os.replace(temporary, output)
        except BaseException:
            os.unlink(temporary)
            raise
    except OSError as error:
        raise BuildError(f"{output}: cannot write the program: {error.strerror}") from error


def _refuse_bad_output(output: Path) -> None:
    if output.is_dir():
        raise BuildError(f"{output}: is a folder; give the program a file name")


def _read_flags(key: str, folder: Path) -> Runtime:
    """Reads what CMake wrote: section names and one flag a line."""
    sections: dict[str, list[str]] = {"compiler": [], "compile": [], "link": []}
    current: list[str] = []
    for line in (folder / "network_flags.txt").read_text().splitlines():
        if line in sections:
            current = sections[line]
        elif line and line != "-I":
            current.append(line)
    return Runtime(key, folder, sections["compiler"][0], tuple(sections["compile"]), tuple(sections["link"]))


def _run(command: list[str], what: str) -> None:
    try:
        done = subprocess.run(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace", check=False
        )
    except OSError as error:
        raise BuildError(f"{what}: cannot run {command[0]}: {error.strerror}") from error
    if done.returncode != 0:
        lines = done.stdout.strip().splitlines()
        raise BuildError(f"{what} failed:\n" + "\n".join(lines[-40:]))


def _writable_cache() -> Path:
    folder = cache_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BuildError(
            f"{folder}: cannot make the cache folder: {error.strerror}; set LNC_CACHE to another"
        ) from error
    if not os.access(folder, os.W_OK | os.X_OK):
        raise BuildError(f"{folder}: the cache folder cannot be written; set LNC_CACHE to another")
    return folder


@contextlib.contextmanager
def _lock(path: Path, shared: bool = False) -> Iterator[None]:
    """Holds a lock: two compilations of the same thing wait for each other."""
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_SH if shared else fcntl.LOCK_EX)
        yield


def _tree_digest(folder: Path, endings: tuple[str, ...]) -> str:
    files = sorted(p for p in folder.rglob("*") if p.suffix in endings and "tests" not in p.relative_to(folder).parts)
    return digest(
        text
        for p in files
        for text in (p.relative_to(folder).as_posix(), p.read_text(encoding="utf-8", errors="surrogateescape"))
    )


def _compiler_identity(compiler: str) -> str:
    found = shutil.which(compiler)
    if found is None:
        raise BuildError(f"no C++ compiler: '{compiler}' is not installed; 'lnc doctor' lists what is needed")
    real = os.path.realpath(found)
    stat = os.stat(real)
    return f"{real} {stat.st_size} {stat.st_mtime_ns}"


def _processor() -> str:
    """What -march=native depends on."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return "unknown"
    wanted = ("model name", "flags", "Features", "CPU part")
    return "\n".join(sorted({line for line in lines if line.startswith(wanted)}))
