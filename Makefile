# Two commands: `make fly` (environment and the whole mission) and `make test` (environment and tests).
# They need Python >= 3.11, make and the package index. PYTHON=/path/to/python chooses the interpreter.

VENV  := .venv
BIN   := $(VENV)/bin
STAMP := $(VENV)/.installed
READ  := $(VENV)/.tests-read
DOCS  := build/docs-env
TESTS ?= tests
# one more than two cores: a tenth of the time a test waits, for a process to start, to end or to fall silent
WORKERS ?= 3
# byte code of the programs is kept: each of a run's processes starts half a second sooner
unexport PYTHONDONTWRITEBYTECODE

.PHONY: env fly test check docs pictures bench clean
.DEFAULT_GOAL := help

help:
	@echo "make fly    build the environment if needed, fly the refuelling, leave a run folder"
	@echo "make test   build the environment if needed, run the tests (TESTS=path to choose)"
	@echo "make env    build .venv from requirements.lock"
	@echo "make check  style, types, import directions, generated pages"
	@echo "make docs   all pages as a site with search, in build/site"
	@echo "make pictures  fly every scenario and picture it for the pages, in both themes (light: needs Chromium)"
	@echo "make bench  speed of everything, printed as a table"
	@echo "make clean  remove .venv, caches and compiled kernels (runs/ stays)"

env: $(STAMP)

$(STAMP): requirements.lock pyproject.toml
	@bash hil_scripts/make_env.sh $(VENV) $(PYTHON)
	@touch $@

fly: env
	$(BIN)/sil run refueling

# the tests are read once beside the first warm-up: otherwise each worker rewrites the assertions of all of them
test: env
	@test -e $(READ) || { $(BIN)/python -m pytest --collect-only -q -m "not rt" $(TESTS) > /dev/null; touch $(READ); } & \
		$(BIN)/sil warmup && wait
	$(BIN)/python -m pytest -q -n $(WORKERS) -m "not rt" $(TESTS)

check: env
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m flightsw.icd.gen --check
	$(BIN)/python -m hil_scripts.launch.reference --check

# the site's tools (extra `docs` of pyproject.toml) have an environment of their own: the locked one stays as it is
$(DOCS)/.installed: pyproject.toml | $(STAMP)
	$(BIN)/python -m venv $(DOCS)
	$(DOCS)/bin/pip install -q --disable-pip-version-check $$($(BIN)/python -c \
		"import tomllib; print(*tomllib.load(open('pyproject.toml', 'rb'))['project']['optional-dependencies']['docs'])")
	@touch $@

docs: $(DOCS)/.installed
	NO_MKDOCS_2_WARNING=1 $(DOCS)/bin/mkdocs build --strict
	@echo "build/site/index.html"

pictures: env
	$(BIN)/sil pictures

bench: env
	$(BIN)/sil bench

clean:
	rm -rf $(VENV) build .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis *.egg-info
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
