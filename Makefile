# Two commands: `make fly` (environment and the whole mission) and `make test` (environment and tests).
# They need Python >= 3.11, make and the package index. PYTHON=/path/to/python chooses the interpreter.

VENV  := .venv
BIN   := $(VENV)/bin
STAMP := $(VENV)/.installed
TESTS ?= tests
# byte code of the programs is kept: each of a run's processes starts half a second sooner
unexport PYTHONDONTWRITEBYTECODE

.PHONY: env fly test check bench clean
.DEFAULT_GOAL := help

help:
	@echo "make fly    build the environment if needed, fly the refuelling, leave a run folder"
	@echo "make test   build the environment if needed, run the tests (TESTS=path to choose)"
	@echo "make env    build .venv from requirements.lock"
	@echo "make check  style, types, import directions, dialect"
	@echo "make bench  speed of everything, printed as a table"
	@echo "make clean  remove .venv, caches and compiled kernels (runs/ stays)"

env: $(STAMP)

$(STAMP): requirements.lock pyproject.toml
	@bash hil_scripts/make_env.sh $(VENV) $(PYTHON)
	@touch $@

fly: env
	$(BIN)/sil run refueling

test: env
	$(BIN)/sil warmup
	$(BIN)/python -m pytest -q -n 2 -m "not rt" $(TESTS)

check: env
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m flightsw.icd.gen --check

bench: env
	$(BIN)/sil bench

clean:
	rm -rf $(VENV) build .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
