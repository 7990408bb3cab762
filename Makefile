# Two commands matter: `make study` and `make test`. Both set up .venv first.
PYTHON ?= python3
BIN = .venv/bin
PIP = $(BIN)/pip install --quiet --disable-pip-version-check
ROOMS = fmus master vehicle view study diagnosis sweep examples

.PHONY: setup study test test-all test-fast test-peers lowest lint house types docs wheel clean

setup: .venv/developed

.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "selflock needs Python 3.11 or newer; name one with make PYTHON=...")'
	$(PYTHON) -m venv .venv

.venv/installed: pyproject.toml | .venv/bin/python
	$(PIP) --editable '.[all]'
	@touch $@

.venv/developed: .venv/installed
	$(PIP) --editable '.[dev]'
	@touch $@

study: .venv/installed
	$(BIN)/selflock study -o out/study

# Long tests of one kind (a hidden cause each, a measured drive each) take turns from day to day.
test: setup
	$(BIN)/python -m pytest -n 2 --dist worksteal --turns

# Each of them: a quarter of an hour or more. Before a release, and after a change of the diagnosis.
test-all: setup
	$(BIN)/python -m pytest -n 2 --dist worksteal

# Some tests of every room, in a minute: before every commit.
test-fast: setup
	$(BIN)/python -m pytest -n 2 --dist worksteal -m 'not slow'

# The quick tests with the lowest versions that pyproject.toml names, in an environment of its own. What these warn of in
# what newer ones of others deprecate is not ours.
lowest: setup
	mkdir -p build && $(BIN)/python -m benchmarks.supply lowest > build/lowest.txt
	$(PYTHON) -m venv --clear build/lowest
	build/lowest/bin/pip install --quiet --disable-pip-version-check --editable '.[test]' --constraint build/lowest.txt
	build/lowest/bin/python -m pytest -n 2 --dist worksteal -m 'not slow' -W ignore::DeprecationWarning

# The same systems in libcosim and Ecos (the latter needs the system's libtbb12).
test-peers: setup
	$(PIP) --editable '.[masters]'
	$(BIN)/python -m pytest tests/peers

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

# mypy and the documents read the rooms as the one package that they are installed as.
house:
	@rm -rf build/house && mkdir -p build/house/selflock
	@ln -s $(addprefix $(CURDIR)/,$(wildcard selflock/*.py selflock/py.typed) $(ROOMS)) build/house/selflock

types: setup house
	$(BIN)/mypy

docs: setup house
	$(PIP) --editable '.[docs]'
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet

# Built, installed into a fresh environment, used beside files named like the rooms.
wheel: setup
	PYTHON=$(BIN)/python tests/wheel.sh

clean:
	rm -rf .venv out build *.egg-info
