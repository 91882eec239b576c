"""Fills the template of a program."""

from __future__ import annotations

from jinja2 import Environment, PackageLoader, StrictUndefined

from lnc.codegen.languages import ReferenceView
from lnc.codegen.names import comment_text, cpp_string
from lnc.codegen.view import ProgramView


def write_program(view: ProgramView) -> str:
    """The C++ text of a network's program; the same view gives the same bytes."""
    return _fill("program.cpp.j2", view)


def write_reference(view: ReferenceView) -> str:
    """The C++ text of a reference tracer."""
    return _fill("reference.cpp.j2", view)


def _fill(template: str, view: object) -> str:
    """A template's text with the values of `view`."""
    environment = Environment(
        loader=PackageLoader("lnc.codegen", "templates"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    environment.filters["comment"] = comment_text
    environment.filters["cpp_string"] = cpp_string
    return environment.get_template(template).render(view=view)
