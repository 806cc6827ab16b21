# Every target sets up what it needs: a virtual environment in .venv with the package installed
# editable. `make PYTHON=python3.12 test` chooses the interpreter it is made with. Proofs and
# experiments are commands: `.venv/bin/python -m paper` and `.venv/bin/python -m benchmarks`.

PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
CORES := .venv/.cores
# Tests start hundreds of processes: none has to compile modules that another has compiled.
unexport PYTHONDONTWRITEBYTECODE
SUPPORTED := import sys; sys.exit(sys.version_info < (3, 11))
# Installs a dependency group without the package, whose C core would be compiled anew for it.
bring = $(BIN)/python -m pip install --quiet --group $(1)

.DEFAULT_GOAL := help
.PHONY: help paper test test-long second-model packaging lint types contract lines generate core check-generated docs wheel octave explorer explorer-test bench clean

help:  ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 18

paper: $(READY)  ## the main job: the paper's case study, and results/report.html
	$(BIN)/python -m paper

sources = $(shell find -H $(1) -type f ! -name '*.pyc')
within = $(call sources,$(addprefix capsule_sym/,$(1)))
PROVED := $(call sources,$(addprefix paper/,claims derived proofs study)) $(wildcard paper/*.py paper/*.toml capsule_sym/_*.py) \
    paper/commands/claims.py capsule_sym/_commands/verify.py $(call within,_symbolic _enclosures _orbits _map _native generated)

# A test that stands still shows what each thread is at, and fails; the longest takes two minutes.
STILL := -o faulthandler_timeout=600 -o faulthandler_exit_on_timeout=true
PYTEST := $(BIN)/python -m pytest -q --durations=10 $(STILL)

test: $(CORES)  ## run the tests of the tool, the paper and the benchmarks
	$(PYTEST) -n 2 --max-worker-restart 2 --dist loadscope --no-loadscope-reorder

test-long: $(CORES)  ## run the tests that take long, and all cases of sampled ones
	CAPSULE_SYM_ALL=1 $(PYTEST) -n 2 --max-worker-restart 2 --dist worksteal -m "long or sampled"

second-model: $(CORES)  ## test that another model is declared, generated and compiled
	$(PYTEST) -m long tests/secondmodel

packaging: $(CORES)  ## test what wheels and source distributions hold, with and without a compiler
	$(PYTEST) -m long tests/test_packaging.py

lint: $(READY)  ## check style, format and English
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/python -m benchmarks.prose

types: $(READY)  ## check types, strictly
	$(BIN)/mypy

contract: $(READY)  ## check which package imports which
	$(BIN)/lint-imports
	$(BIN)/python -m benchmarks.houses

lines: $(READY)  ## print the size of the house beside its goals
	@$(BIN)/python -m benchmarks.lines

generate: $(READY)  ## derive and write generated/
	$(BIN)/python -m capsule_sym.codegen

INSTALL = $(BIN)/python -m pip install --quiet --no-build-isolation -C build-dir=.venv/core \
    -C cmake.define.CAPSULE_CORES=$(1) --editable
core: $(READY)  ## compile what changed of the C cores, as after `make generate`
	$(call INSTALL,all) . --no-deps
	@touch $(CORES)

# The paper needs the capsule's core alone; tests and pages need those of all scenes.
$(CORES): $(READY)
	$(call INSTALL,all) . --no-deps
	@touch $@

check-generated: $(READY)  ## check that generated/ is what the derivation gives
	$(BIN)/python -m capsule_sym.codegen --check

# The documentation shows what is proved: results/*.md, made anew where what they are made from is newer.
results/verify.md: $(PROVED) | $(READY)
	$(BIN)/capsule-sym verify --out $@ > /dev/null
results/claims.md: $(PROVED) | $(READY)
	$(BIN)/python -m paper claims --out $@ > /dev/null

# What the pages are built with is installed once, for it takes as long as the pages.
.venv/.docs: $(CORES)
	@$(call bring,docs)
	@touch $@

docs: .venv/.docs  ## build the documentation in docs/_build/html, and run what `make test` leaves of its examples
	@$(MAKE) --no-print-directory -j 2 results/verify.md results/claims.md
	$(BIN)/python -m sphinx -q -W --keep-going -j auto docs docs/_build/html
	$(BIN)/python -m pytest -n 2 --dist worksteal -q -m long tests/docs

wheel: $(READY)  ## build the wheel of this machine in dist/, repair it, and try it with every Python here
	@$(call bring,wheel)
	$(BIN)/python .ci/wheel $(PYTHONS)

# Octave with mkoctfile, and gnuplot to draw with: octave, octave-dev and gnuplot-nox in Debian.
octave: $(CORES)  ## run the gateways for MATLAB in Octave, which has to be there
	@command -v octave-cli > /dev/null && command -v mkoctfile > /dev/null || { echo 'octave-cli or mkoctfile is missing' >&2; exit 1; }
	CAPSULE_SYM_ALL=1 $(BIN)/python -m pytest -q -m "long or not long" tests/octave

# The explorer's page needs Node.js, to be built, and Chromium, to be tested.
explorer/node_modules/.package-lock.json: explorer/package-lock.json
	cd explorer && npm ci --no-audit --no-fund
	@touch $@

EXPLORER := $(CORES) explorer/node_modules/.package-lock.json
explorer: $(EXPLORER)  ## build the page of `capsule-sym explore`; needs Node.js
	@$(call bring,explorer)
	$(BIN)/python explorer/build.py
	cd explorer && npm run --silent types

explorer-test: $(EXPLORER)  ## drive the page in headless Chromium, which has to be there
	@$(call bring,explorer)
	$(BIN)/python -m pytest -q -m "long or not long" explorer/tests

bench: $(CORES)  ## measure speed against error beside other tools, of each scene, first calls, and installation
	@$(call bring,peers)
	$(BIN)/python -m benchmarks bench --out results/bench
	$(BIN)/python -m benchmarks scenes --out results/bench
	$(BIN)/python -m benchmarks first-calls --out results/bench
	$(BIN)/python -m benchmarks installation --out results/bench

clean:  ## remove the environment, builds and caches; results/ stays
	rm -rf .venv build dist .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find benchmarks capsule_sym generated paper tests -name __pycache__ -prune -exec rm -rf {} +

# An environment that works is kept, whoever made it; one without pip is made again. The pip that
# comes with a Python may be too old to know dependency groups.
$(READY): pyproject.toml
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || { \
	    $(PYTHON) -c '$(SUPPORTED)' || { \
	        echo 'capsule-sym needs Python 3.11 or newer; "$(PYTHON)" is not. Try: make PYTHON=python3.11 $(MAKECMDGOALS)' >&2; \
	        exit 1; }; \
	    $(PYTHON) -m venv --clear .venv; }
	@$(BIN)/python -c '$(SUPPORTED)' || { \
	    echo 'capsule-sym needs Python 3.11 or newer, and .venv has an older one. Remove it with: make clean' >&2; \
	    exit 1; }
	$(BIN)/python -m pip install --quiet --upgrade 'pip>=25.1'
	@$(call bring,dev)
	$(call INSTALL,capsule) '.[all]'
	@$(BIN)/python -m capsule_sym --version | grep -q '(C core, ' || \
	    echo 'No C compiler was found: runs are computed by NumPy, hundreds of times slower. Install one (gcc or clang), then: make core' >&2
	@touch $@
