# For people; CI runs ./test. `make help` lists the targets.
PYTHON := .venv/bin/python

.PHONY: help setup check format lint types test-fast test bench clean

help:  ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 14

setup:  ## install what is missing (apt, PyPI)
	scripts/setup

check: lint types test-fast  ## format, lint, types and the fast tests

format:  ## format Python and the networks
	$(PYTHON) -m ruff format lnc tests benchmarks ops_library examples
	.venv/bin/lnc fmt examples/*.ln

lint:  ## formatting and common mistakes
	$(PYTHON) -m ruff format --check lnc tests benchmarks ops_library examples
	$(PYTHON) -m ruff check lnc tests benchmarks ops_library examples
	.venv/bin/lnc fmt --check examples/*.ln

types:  ## mypy
	$(PYTHON) -m mypy lnc

test-fast:  ## tests that need no compiled program
	$(PYTHON) -m pytest -q -m "not program and not slow"

test:  ## all tests of a developer
	./test

clean:  ## remove build results (not the caches of lnc)
	rm -rf build dist picture.exr picture.png
