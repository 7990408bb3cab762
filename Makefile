# Two commands matter: `make study` and `make test`. Both set up .venv first.
PYTHON ?= python3
BIN = .venv/bin

.PHONY: setup study test test-masters clean

setup: .venv/installed

.venv/installed: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "selflock needs Python 3.11 or newer; name one with make PYTHON=...")'
	$(PYTHON) -m venv .venv
	$(BIN)/pip install --quiet --disable-pip-version-check --editable '.[test]'
	@touch $@

study: setup
	$(BIN)/selflock study -o out/study

test: setup
	$(BIN)/python -m pytest -n 2 --dist worksteal

# The same systems in libcosim and Ecos (the latter needs the system's libtbb12).
test-masters: setup
	$(BIN)/pip install --quiet --disable-pip-version-check '.[masters]'
	$(BIN)/python -m pytest tests/masters

clean:
	rm -rf .venv out build *.egg-info
