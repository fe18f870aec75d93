# Everything sets itself up: a fresh machine with Python 3.11 or newer needs `make study` and nothing else.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STUDY ?= *
JOBS ?=
CASES ?=
SEED ?=
COUNT ?=

# With uv if it is there.  Modules are compiled by all cores at once, where pip takes one after the other and uv none:
# where nothing may write them later (PYTHONDONTWRITEBYTECODE) every process would compile what it imports.  The tests of
# other packages, a third of all modules, are left out.
UV := $(shell command -v uv 2>/dev/null)
CREATE = $(if $(UV),uv venv --quiet --allow-existing --python $(PYTHON),$(PYTHON) -m venv) $(VENV)
PIP = $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile
INSTALL = $(if $(UV),uv pip install --quiet --python $(BIN)/python,$(PIP)) -c constraints.txt
COMPILE = $(BIN)/python -m compileall -qq -j 0 -x '/tests?/' $(VENV)/lib prb3r || true

.PHONY: study setup test test-long check format docs schemas bench fuzz combinations proof clean

study: $(VENV)/.ready
	$(BIN)/prb3r run $(wildcard studies/$(STUDY).toml) -o results $(if $(JOBS),-j $(JOBS))

setup: $(VENV)/.developing

# What studies need, and what developers need beside it.
$(VENV)/.ready: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "prb3r needs Python 3.11 or newer: make PYTHON=python3.11")'
	@$(CREATE)
	@$(INSTALL) -e .
	@$(COMPILE)
	@touch $@

$(VENV)/.developing: $(VENV)/.ready
	@$(INSTALL) -e '.[dev]'
	@$(COMPILE)
	@touch $@

test: $(VENV)/.developing
	$(BIN)/python -m pytest

test-long: $(VENV)/.developing
	$(BIN)/python -m pytest -m long

check: $(VENV)/.developing
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(VENV)/.developing
	$(BIN)/ruff check --fix --quiet . || true
	$(BIN)/ruff format .

# HTML without network, into results/docs; studies whose figures are not there yet are run for the gallery.
docs: $(VENV)/.developing
	$(BIN)/prb3r run $(wildcard studies/*.toml) -o results $(if $(JOBS),-j $(JOBS)) || test $$? -eq 1
	$(BIN)/python docs/site/build.py -o results/docs

# What the first lines of TOML files name for editors.
schemas: $(VENV)/.ready
	for file in study manipulator recording; do $(BIN)/prb3r schema $$file > schemas/$$file.json; done

bench: $(VENV)/.ready
	$(BIN)/prb3r bench

# Mutated files, which must all end with a sentence: about 20 minutes on one core.
fuzz: $(VENV)/.developing
	PYTHONPATH=tests $(BIN)/python -m fuzz $(if $(COUNT),$(COUNT),100000)

# The suite under every Python that is here, with the newest and the oldest dependencies: some ten minutes each.
combinations: $(VENV)/.developing
	$(BIN)/python tests/combinations.py

# The whole benchmark takes about an hour on two cores, `make proof CASES=60` a few minutes.
proof: $(VENV)/.ready
	$(BIN)/prb3r prove -o results/proof $(if $(CASES),--cases $(CASES)) $(if $(SEED),--seed $(SEED)) $(if $(JOBS),-j $(JOBS))

clean:
	rm -rf $(VENV) build dist .pytest_cache .ruff_cache .mypy_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
