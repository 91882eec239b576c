# For people; CI runs ./test. `make help` lists the targets.
PYTHON := .venv/bin/python

.PHONY: help setup check format lint types test-fast test clean

help:  ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/' | expand -t 14

setup:  ## install what is missing (apt, PyPI)
	scripts/setup

check: lint types test-fast  ## format, lint, types and the fast tests

format:  ## format Python and the networks
	$(PYTHON) -m ruff format conftest.py lnc tests benchmarks ops_library examples
	$(PYTHON) -m lnc fmt examples/*.ln

lint:  ## formatting and common mistakes
	$(PYTHON) -m ruff format --check conftest.py lnc tests benchmarks ops_library examples
	$(PYTHON) -m ruff check conftest.py lnc tests benchmarks ops_library examples
	$(PYTHON) -m lnc fmt --check examples/*.ln

types:  ## mypy
	$(PYTHON) -m mypy lnc

test-fast:  ## tests that need no compiled program
	$(PYTHON) -m pytest -m "not program and not slow"

test:  ## all tests but the slow ones
	./test

clean:  ## remove what was built here (not .venv, not the cache of lnc)
	rm -rf build dist picture.exr picture.png out.exr network .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find lnc tests benchmarks ops_library examples -name __pycache__ -prune -exec rm -rf {} +
