# `make route` plans the demonstration route, `make test` passes all checks, `make docs` builds the
# documentation, `make site` with executed notebooks, `make study` measures all methods on public maps; all set up by
# themselves.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
TOOLS := $(VENV)/.tools
KERNELS := $(VENV)/.kernels
INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile

SPHINX := $(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet --fresh-env
NOJIT_TESTS := tests/pyramid/test_invariants.py tests/search/test_search.py

# quarter or whole; the folder of the maps.
STUDY ?= quarter
PYTHONS ?= $(or $(wildcard $(HOME)/.pyenv/versions/3.1[0-9]*/bin/python),$(PYTHON))
HYBRIDNAV_DATA ?= $(wildcard ../shared/data)

.PHONY: route test test-full lint docs site study unit nojit full setup wheels test-corners maps lock clean

route: $(INSTALLED)
	mkdir -p out
	$(BIN)/hybridnav plan maps/office/office.yaml --start 1.0,13.2 --goal 40.6,19.4 --compare --plot out/route.png
	@echo "picture: out/route.png"
	@$(MAKE) --no-print-directory $(KERNELS)

# What uses one core runs side by side.
test: setup
	$(MAKE) --no-print-directory -j2 lint docs nojit
	$(MAKE) --no-print-directory unit

test-full: lint docs full nojit

lint: setup
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The documentation's site, out/docs/index.html: a warning is an error, and nothing is fetched.
docs: $(TOOLS)
	$(SPHINX) docs out/docs

# The same with the notebooks executed, out/site/index.html: minutes, and seconds where nothing that
# they run on has changed.
site: setup
	$(SPHINX) -D nb_execution_mode=cache docs out/site

# Thrun's questions on 28 public maps: out/study, docs/study.md and every figure that is quoted from it. A run that was
# stopped goes on. Planners of others are asked if they can be installed.
study: setup
	-$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --editable '.[bench]'
	HYBRIDNAV_DATA='$(HYBRIDNAV_DATA)' $(BIN)/python -m benchmarks study --study $(STUDY)

# On all cores, a file of tests to each in turn. Each process imports all tests, half of it to rewrite their assertions,
# so that these tell values: only tests that fail are asked again for that.
unit: setup
	$(BIN)/python -m pytest -m "not full" -n auto --dist loadfile --no-loadscope-reorder --assert=plain || \
	  { $(BIN)/python -m pytest --last-failed --last-failed-no-failures none; false; }

# The kernels as plain Python, on maps of at most 12 x 12 cells: a second reading of the same code.
nojit: setup
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest -m "not full" $(NOJIT_TESTS)

# Seven times as many examples as `unit` tries, new ones each time. Bounds checks need a cache of their own: cached code
# ignores the setting.
full: setup
	HYBRIDNAV_EXAMPLES=2 $(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder
	NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=$(VENV)/numba-bounds $(BIN)/python -m pytest -m "not full" $(NOJIT_TESTS)

setup: $(TOOLS) $(KERNELS)

# What the package needs, without bytecode: Python writes that of the modules that a command loads.
# The kernels of the route are compiled by its first plan, those of other commands after it.
$(INSTALLED): requirements.lock pyproject.toml
	$(PYTHON) -c "import sys; sys.exit(sys.version_info < (3, 11) and 'a clone needs Python 3.11 or newer')"
	@echo "setting up $(VENV): half a minute the first time"
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(INSTALL) --constraint requirements.lock hatchling editables
	$(INSTALL) --constraint requirements.lock --no-build-isolation --editable .
	touch $(INSTALLED)

$(TOOLS): $(INSTALLED)
	@echo "setting up the tools: about two minutes the first time"
	$(INSTALL) -r requirements.lock
	touch $(TOOLS)

# After the picture, so that nobody waits for it, and no later command has to compile.
$(KERNELS): $(INSTALLED)
	@echo "compiling what the other commands need, once: about a minute"
	$(BIN)/python -m hybridnav.cli.warm
	touch $(KERNELS)

# Wheels that bring compiled kernels, one for each Python of PYTHONS, in out/wheels; from a clean tree.
wheels: setup
	$(BIN)/python -m benchmarks wheels --python $(PYTHONS)

# The oldest and the newest Python and numpy: tests of what plans, in environments of their own.
test-corners: setup
	$(BIN)/python -m benchmarks corners --python $(PYTHONS)

maps: setup
	$(BIN)/python -m benchmarks worlds maps

# Needs uv (https://docs.astral.sh/uv); writes the versions that `setup` installs.
lock:
	uv pip compile --quiet --universal --no-header --no-annotate --python-version 3.11 --extra dev --extra cluster --extra study --extra view --extra agent --extra docs pyproject.toml --output-file requirements.lock

clean:
	rm -rf $(VENV) out .mypy_cache .ruff_cache .pytest_cache .import_linter_cache
