# Needs Python >= 3.11 and make. Every target installs what it needs into $(VENV), once, and again when
# pyproject.toml changes. An environment of your own serves as well: make test VENV=path/to/environment

VENV ?= .venv
PYTHON ?= $(shell for p in python3 python3.14 python3.13 python3.12 python3.11 python; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && echo $$p && break; done)
WORKERS ?= 2
PYTEST_ARGS ?= -n $(WORKERS) --dist loadfile
BIN := $(VENV)/bin

# A recorded motion that the project carries; any file will do: make demo RECORDING=path
RECORDING ?= tests/data/broad_06_excerpt.npz

.DEFAULT_GOAL := help
.NOTPARALLEL:
.PHONY: help demo test bench fuzz lint format docs clean

help:
	@echo "make demo    filter a recorded motion: track, covariances and a figure in demo/"
	@echo "make test    run all tests"
	@echo "make bench   time this package beside its peers; writes benchmarks/RESULTS.md"
	@echo "make fuzz    feed damaged files to every reader for FUZZ_SECONDS, an hour unless given"
	@echo "make lint    ruff, pyright (strict), import-linter"
	@echo "make format  let ruff lay out the code"
	@echo "make docs    build the site into docs/_build/html"
	@echo "make clean   remove what the targets above made, except $(VENV)"

$(BIN)/python:
	@test -n "$(PYTHON)" || { echo "No Python 3.11 or newer on PATH; name one: make PYTHON=/path/to/python3" >&2; exit 2; }
	$(PYTHON) -m venv $(VENV)

# The stem names the extras of pyproject.toml to install.
$(VENV)/.with-%: pyproject.toml | $(BIN)/python
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable ".[$*]"
	@touch $@

# One thread for each worker's linear algebra, two where a test asks for threads.
test: export OMP_NUM_THREADS = 1
test: export OPENBLAS_NUM_THREADS = 1
test: export NUMBA_NUM_THREADS = 2
test: export MPLBACKEND = Agg
test: $(VENV)/.with-test
	$(BIN)/python -m pytest $(PYTEST_ARGS)

demo: export MPLBACKEND = Agg
demo: $(VENV)/.with-cli,io
	$(BIN)/bingham track $(RECORDING) -o demo

bench: $(VENV)/.with-cli,io,bench
	$(BIN)/python benchmarks/run.py

# An hour in all, other inputs each time; CI takes a minute, the same ones each time.
FUZZ_SECONDS ?= 3600
FUZZ_SEED ?=
fuzz: $(VENV)/.with-test
	-$(BIN)/python -m pip install --quiet --disable-pip-version-check --only-binary :all: "atheris>=2.3"
	$(BIN)/python tests/fuzz/run.py $(FUZZ_SECONDS) $(if $(FUZZ_SEED),--seed $(FUZZ_SEED))

lint: $(VENV)/.with-test $(VENV)/.with-lint
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/lint-imports

format: $(VENV)/.with-lint
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

# One thread: threads that wait for work count as processor time, and batches of examples are small.
docs: export MPLBACKEND = Agg
docs: export NUMBA_NUM_THREADS = 1
docs: export OMP_NUM_THREADS = 1
docs: export OPENBLAS_NUM_THREADS = 1
docs: $(VENV)/.with-docs
	$(BIN)/python -m sphinx -W --keep-going -b html docs docs/_build/html

clean:
	rm -rf build dist demo docs/_build docs/gallery docs/api/generated docs/sg_execution_times.rst
	find src tests benchmarks -name __pycache__ -prune -exec rm -rf {} +
