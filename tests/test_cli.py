"""The command line: exit status, formats, files and caches."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import xml.dom.minidom
from pathlib import Path

import pytest

from lnc.cli import main

ROOT = Path(__file__).parent.parent
CAUSTICS = str(ROOT / "examples" / "caustics.ln")
GOOD = "light = Lights()\nexpect L S* E | L (D|G) S* E\nimage Direct(light)\n"
BAD = "light = Lights()\nimage Direct(ligth)\n"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "good.ln").write_text(GOOD)
    (tmp_path / "bad.ln").write_text(BAD)
    (tmp_path / "latin.ln").write_bytes(b"light = \xe9\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_check_status(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "good.ln", CAUSTICS]) == 0
    assert main(["check", "good.ln", "bad.ln"]) == 1
    for unreadable in ("missing.ln", "latin.ln", ".", "a\0b"):
        assert main(["check", "bad.ln", unreadable]) == 2
    output = capsys.readouterr()
    assert "bad.ln:2:14" in output.err and "did you mean 'light'?" in output.err


def test_a_file_of_macros_alone_is_no_network_but_fine(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "macros.ln").write_text("op Twice(in: Points) -> Points {\n    out = Scale(in, factor = 2)\n}\n")
    (folder / "wrong.ln").write_text("op Twice(in: Poinst) -> Points {\n    out = Scale(in, factor = 2)\n}\n")
    assert main(["check", "macros.ln", "good.ln"]) == 0
    assert main(["check", "wrong.ln"]) == 1
    assert "did you mean 'Points'?" in capsys.readouterr().err
    assert main(["compile", "macros.ln", "-o", "program"]) == 1
    assert "the network has no result" in capsys.readouterr().err


def test_a_pipe_is_not_used(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Nobody writes into it, so reading it would never end."""
    os.mkfifo(folder / "pipe.ln")
    (folder / "use.ln").write_text('use "pipe.ln"\n' + GOOD)
    assert main(["check", "use.ln"]) == 1
    assert "'pipe.ln' cannot be used: is not a regular file" in capsys.readouterr().err


def test_wrong_usage(capsys: pytest.CaptureFixture[str]) -> None:
    for arguments in ([], ["chek"], ["check"], ["check", "--format", "xml", CAUSTICS], ["check", CAUSTICS, "--nope"]):
        try:
            status = main(arguments)
        except SystemExit as stop:
            status = stop.code  # type: ignore[assignment]
        assert status == 2, arguments
        assert len(capsys.readouterr().err.strip().splitlines()) == 1
    assert main(["check", CAUSTICS, "--ops", "no/such/folder"]) == 2
    assert main(["explain", "LN9999"]) == 2
    assert main(["ops", "Dirct"]) == 2


def test_json_diagnostics(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", "bad.ln", "missing.ln", "--format", "json"]) == 2
    first, second = json.loads(capsys.readouterr().out)
    assert first == {
        "code": "LN0102",
        "severity": "error",
        "message": "no wire is called 'ligth'",
        "file": "bad.ln",
        "line": 2,
        "column": 14,
        "end_line": 2,
        "end_column": 19,
        "notes": ["help: did you mean 'light'?"],
        "witness": None,
    }
    assert second["code"] == "LN0100"
    assert main(["check", "good.ln", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out) == []


def test_explain_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", CAUSTICS, "--format", "json"]) == 0
    found = json.loads(capsys.readouterr().out)
    wires = {wire["name"]: wire for wire in found["wires"]}
    assert wires["photons_tree"]["inserted"] and not wires["caustic"]["inserted"]
    assert wires["caustic"]["angular"] == ["irradiance"]
    assert wires["caustic"]["light_paths"] == {"irradiance": "L S+"}
    assert wires["caustic"]["representation"] == "Points" and wires["caustic"]["tags"] == []
    assert [step["name"] for step in found["schedule"]] == ["light", "direct", "photons", "photons_tree", "caustic"]
    assert found["image_paths"] == "L (G | S* D)? S* E"
    assert found["missing"] == {"path": "LDDE", "count": 0, "expected": 1, "routes": []}


def test_explain_text_and_pages(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["explain", CAUSTICS]) == 0
    assert "photons_tree = KDPhotonTree(...): 'caustic.map' takes PhotonMap" in capsys.readouterr().out
    assert main(["explain", "ln0402"]) == 0
    assert "unbounded recursion" in capsys.readouterr().out


def test_fmt(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = folder / "messy.ln"
    path.write_text("light=Lights( )   // all\nimage    Direct(light)")
    path.chmod(0o640)
    assert main(["fmt", "--check", "messy.ln"]) == 1
    assert main(["fmt", "messy.ln"]) == 0
    assert path.read_text() == "light = Lights()  // all\nimage Direct(light)\n"
    assert path.stat().st_mode & 0o777 == 0o640
    assert main(["fmt", "--check", "messy.ln"]) == 0
    assert main(["fmt", "missing.ln"]) == 2
    path.write_text("light = = Lights()\n")
    assert main(["fmt", "messy.ln"]) == 1
    assert path.read_text() == "light = = Lights()\n"
    assert sorted(p.name for p in folder.iterdir()) == ["bad.ln", "good.ln", "latin.ln", "messy.ln"]
    capsys.readouterr()
    assert main(["fmt", "--explicit", CAUSTICS]) == 0
    assert "photons_tree = KDPhotonTree(photons)\n" in capsys.readouterr().out


def test_graph(folder: Path) -> None:
    assert main(["graph", CAUSTICS, "-o", "caustics.svg"]) == 0
    text = (folder / "caustics.svg").read_text()
    xml.dom.minidom.parseString(text)
    assert "irradiance: L S+" in text and 'class="inserted"' in text
    assert main(["graph", CAUSTICS, "-o", "caustics.png"]) == 2
    assert main(["graph", CAUSTICS, "-o", "no/such/folder.svg"]) == 2
    assert main(["graph", "bad.ln", "-o", "bad.svg"]) == 1
    assert not (folder / "bad.svg").exists()


def test_texts_are_written_into_what_is_no_file(folder: Path) -> None:
    """A pipe keeps what it gets; a folder is refused, and a link to a file remains one."""
    done = lnc("compile", "good.ln", "--emit-cpp", "/dev/stdout", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "int main(" in done.stdout
    assert lnc("compile", "good.ln", "--emit-cpp", "/dev/null", cwd=folder).returncode == 0
    refused = lnc("compile", "good.ln", "--emit-cpp", ".", cwd=folder)
    assert refused.returncode == 2 and "cannot be written" in refused.stderr

    (folder / "elsewhere").mkdir()
    (folder / "elsewhere" / "real.cpp").write_text("old")
    (folder / "link.cpp").symlink_to("elsewhere/real.cpp")
    assert main(["compile", "good.ln", "--emit-cpp", "link.cpp"]) == 0
    assert (folder / "link.cpp").is_symlink()
    assert (folder / "elsewhere" / "real.cpp").read_text() == done.stdout
    assert [p.name for p in (folder / "elsewhere").iterdir()] == ["real.cpp"]


def test_ops(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["ops"]) == 0
    listed = capsys.readouterr().out
    assert "NNDensity" in listed and "PhotonMap -> Points" in listed
    assert all(line.endswith(".") for line in listed.splitlines()[1:] if line), "what is listed are whole sentences"
    assert main(["ops", "NNDensity"]) == 0
    assert "neighbours: count = 60" in capsys.readouterr().out


def test_operators_of_ones_own(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    own = folder / "ops" / "propagate" / "my_direct"
    own.mkdir(parents=True)
    declaration = "/// Mine.\noperator MyDirect(light: Emission) -> Points {\n    paths radiance = light@area\n}\n"
    (own / "my_direct.ln").write_text(declaration)
    (folder / "mine.ln").write_text("image MyDirect(Lights())\n")
    assert main(["check", "mine.ln"]) == 1
    assert main(["check", "mine.ln", "--ops", "ops"]) == 0
    monkeypatch.setenv("LNC_OPS_PATH", str(folder / "ops"))
    assert main(["check", "mine.ln"]) == 0
    (own / "my_direct.ln").write_text(declaration.replace("area", "aera"))
    assert main(["check", "mine.ln"]) == 1


def lnc(*arguments: str, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "lnc", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        env={**os.environ, "PYTHONPATH": str(ROOT), **environment},
        check=False,
    )


def test_caches_that_are_broken_or_not_writable(folder: Path) -> None:
    cache = folder / "cache"
    first = lnc("check", "good.ln", cwd=folder, LNC_CACHE=str(cache))
    assert first.returncode == 0, first.stderr
    files = list((cache / "compiler").iterdir())
    assert {path.name.split("-")[0] for path in files} == {"grammar", "library"}
    for path in files:
        path.write_bytes(path.read_bytes()[:-7] + b"garbage")
    assert lnc("check", "good.ln", cwd=folder, LNC_CACHE=str(cache)).returncode == 0
    assert lnc("check", "good.ln", cwd=folder, LNC_CACHE="/proc/nothing").returncode == 0


def test_control_characters_are_escaped(folder: Path) -> None:
    (folder / "\x1b[2J.ln").write_text("light = \x1b[31mLights()\n\u202eimage x // \x07\n")
    done = lnc("check", "\x1b[2J.ln", cwd=folder)
    assert done.returncode == 1
    assert not [c for c in done.stderr + done.stdout if c != "\n" and not c.isprintable()]
    missing = lnc("check", "\x1b[2J", cwd=folder)
    assert missing.returncode == 2 and "\x1b" not in missing.stderr + missing.stdout


def test_a_check_starts_fast(folder: Path) -> None:
    """lark, json, jinja2 and the build are not imported; the time itself depends on the machine."""
    code = (
        "import sys; sys.argv = ['lnc', 'check', 'good.ln']; from lnc.cli import main; main();"
        "print(sorted({'lark', 'json', 'jinja2', 'subprocess', 'tempfile', 'lnc.build'} & set(sys.modules)))"
    )
    lnc("check", "good.ln", cwd=folder)
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        check=False,
    )
    assert done.stdout.splitlines()[-1] == "[]", done.stdout + done.stderr
