# Every target sets up what it needs: a virtual environment in .venv with the package installed
# editable. `make PYTHON=python3.12 test` chooses the interpreter it is made with.

PYTHON ?= python3
BIN := .venv/bin
READY := .venv/.ready
# Tests start hundreds of processes: none has to compile modules that another has compiled.
unexport PYTHONDONTWRITEBYTECODE
SUPPORTED := import sys; sys.exit(sys.version_info < (3, 11))
# What an extra brings is installed without the package, whose C core would be compiled anew for it.
NEEDED := import sys, tomllib; print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"][sys.argv[1]], sep="\n")
bring = $(BIN)/python -c '$(NEEDED)' $(1) > .venv/$(1).txt && $(BIN)/python -m pip install --quiet -r .venv/$(1).txt

.DEFAULT_GOAL := help
.PHONY: help paper article test test-long second-model wheel packaging fuzz hardcases events adversarial scenes curves bench first-calls bench-scenes bench-design battery intervals optima pulses shocks mutations weakenings verify certificates regions attraction fastest horseshoe lint types contract lines generate core check-generated docs docs-links site cross-wheels octave explorer explorer-test explorer-measure clean

help:  ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 18

paper: $(READY)  ## the main job: the paper's case study, and results/report.html
	$(BIN)/capsule-sym paper --out results/paper
	@$(MAKE) -j2 --no-print-directory results/verify.json results/hardcases.json
	$(BIN)/capsule-sym report

sources = $(filter-out %.pyc,$(wildcard $(foreach at,$(1),$(addprefix $(at),/*.* /*/*.* /*/*/*.*))))
within = $(call sources,$(addprefix capsule_sym/,$(1)))
PROVED := capsule_sym/paper.toml $(call within,_symbolic _enclosures _orbits _map _native generated)
results/verify.json: $(READY) $(PROVED)
	@mkdir -p results
	$(BIN)/capsule-sym verify --json > $@.part
	@mv $@.part $@

HARD := $(call sources,benchmarks/hardcases) $(call within,_study _map _native generated)
results/hardcases.json: $(READY) capsule_sym/paper.toml $(HARD)
	@mkdir -p results
	$(BIN)/python -m benchmarks hardcases --json > $@.part
	@mv $@.part $@

results/enclose.json: $(READY) $(call within,_symbolic _enclosures _orbits _map _native generated)
	@mkdir -p results
	$(BIN)/capsule-sym enclose --json > $@.part
	@mv $@.part $@

article: paper results/enclose.json  ## write the journal paper and the note on Section 4 from these records; needs LaTeX to typeset
	$(BIN)/python docs/paper/build.py

# A test that stands still shows what each thread is at, and fails; the longest takes two minutes.
STILL := -o faulthandler_timeout=600 -o faulthandler_exit_on_timeout=true --max-worker-restart 2

test: $(READY)  ## run the tests
	$(BIN)/python -m pytest -n 2 --dist loadscope --no-loadscope-reorder -q $(STILL)

test-long: $(READY)  ## run the tests that take more than ten seconds each
	CAPSULE_SYM_ALL=1 $(BIN)/python -m pytest -n 2 --dist worksteal -q -m "long or sampled" $(STILL)

second-model: $(READY)  ## declare another model, generate and compile it, and judge its runs
	$(BIN)/python -m pytest -q -m long $(STILL) tests/secondmodel

wheel: $(READY)  ## build the wheel of this machine in dist/, repair it, and try it with every Python here
	@$(call bring,wheel)
	$(BIN)/python .ci/wheel $(PYTHONS)

cross-wheels: $(READY) wheel  ## cross-build wheels for ARM 64 and musl in dist/, and try that for ARM 64 under emulation
	@$(call bring,wasm)
	$(BIN)/python .ci/cross

packaging: $(READY)  ## test what wheels and source distributions hold, with and without a compiler
	$(BIN)/python -m pytest -q -m long $(STILL) tests/test_packaging.py

LINES ?= 2000
fuzz: $(READY)  ## try LINES command lines of all kinds (LINES=2000)
	CAPSULE_SYM_ALL=1 CAPSULE_SYM_FUZZ=$(LINES) $(BIN)/python -m pytest -q -m long tests/cli/test_fuzz.py

ONLY ?=
hardcases: $(READY)  ## judge every switch of the hard cases by 50 digits, or of those with ONLY in their name
	$(BIN)/python -m benchmarks hardcases --only '$(ONLY)'

events: $(READY)  ## write benchmarks/events/events.json, the suite of hard events for any integrator
	$(BIN)/python -m benchmarks events

N ?= 1000000
adversarial: $(READY)  ## compare N random hard starts with 50 digits (N=1000000); resumes
	$(BIN)/python -m benchmarks adversarial --count $(N) --out results/adversarial

SCENES ?= $(notdir $(patsubst %/,%,$(dir $(wildcard generated/*/manifest.json))))
RUNS ?= 1000
MOTIONS ?= 500
STARTS ?= 100000
scenes: $(READY)  ## judge RUNS random runs (1000), MOTIONS motions (500) and STARTS hard starts (100000) of each scene; resumes
	$(BIN)/python -m tests.scenes.checks $(SCENES) --runs $(RUNS) --motions $(MOTIONS) --hard $(STARTS)

CURVES ?= 20
curves: $(READY)  ## judge CURVES random curves of bifurcations (20), their points and normal forms, of each scene
	$(BIN)/python -m tests.scenes.bifurcations $(SCENES) --curves $(CURVES)

bench: $(READY)  ## measure speed against error beside other tools, and what has to be reached
	@$(call bring,peers)
	$(BIN)/python -m benchmarks bench --out results/bench
	$(BIN)/python -m benchmarks scenes --out results/bench

first-calls: $(READY)  ## measure what a person calls first, whole processes among it
	@$(call bring,peers)
	$(BIN)/python -m benchmarks first-calls --out results/bench

bench-scenes: $(READY)  ## measure the speed of each scene beside the capsule's
	$(BIN)/python -m benchmarks scenes --out results/bench

bench-design: $(READY)  ## measure what the design of a device asks for
	@$(call bring,peers)
	$(BIN)/python -m benchmarks bench-design --out results/bench

battery: $(READY)  ## judge 60 branches by brute force and look for 1,000 random periodic motions
	@mkdir -p results
	$(BIN)/python -m tests.orbits.battery 60 results/branches.jsonl
	$(BIN)/python -m tests.orbits.random_motions 1000 results/motions.jsonl

PROBLEMS ?= 40
CELLS ?= 100000
optima: $(READY)  ## judge PROBLEMS random optimisations (40) by brute force of CELLS cells (100000), and fronts; resumes
	-$(BIN)/python -m tests.optima --problems $(PROBLEMS) --cells $(CELLS)
	$(BIN)/python -m tests.optima.fronts --cells $(CELLS)

pulses: $(READY)  ## ten shortest pulses between attractors beside brute force over 100,000 amplitudes
	$(BIN)/python -m tests.attractors.brute_pulses

shocks: $(READY)  ## judge minimal shocks by a million random knocks each; resumes
	$(BIN)/python -m tests.attractors.brute_shocks

intervals: $(READY)  ## count how many intervals of fits hold the truth, with each loss and kind of error
	$(BIN)/python -m tests.design.coverage $(SETS)

mutations: $(READY)  ## change every value typed from the paper; each change has to be noticed
	@mkdir -p results
	CAPSULE_SYM_RECORD=results/mutations.json \
	    $(BIN)/python -m pytest -q -s -m long tests/symbolic/test_mutations.py

weakenings: $(READY)  ## take each term of the proofs away, or those with ONLY in their name or file; a test has to fail; resumes
	$(BIN)/python -m paper.tests.weakenings --only '$(ONLY)'

tampering: $(READY)  ## tamper certificates in a hundred ways; both checkers have to refuse them
	$(BIN)/python -m paper.tests.proofs.tampering

verify: $(READY) results/enclose.json  ## prove the theory, and Section 4 in ball arithmetic
	$(BIN)/python -m benchmarks verify

certificates: $(READY)  ## write results/certificates.json, and check it with two checkers of their own code
	$(BIN)/capsule-sym enclose --thresholds --out results/certificates.json
	$(BIN)/python capsule_sym/_enclosures/certificates/checker.py results/certificates.json
	$(BIN)/python capsule_sym/_enclosures/certificates/second_checker.py results/certificates.json

SECONDS ?= 3600
regions: $(READY)  ## prove the (alpha, gamma) plane for SECONDS more (3600); resumes
	@mkdir -p results
	$(BIN)/capsule-sym enclose --region results/regions.jsonl --max-seconds $(SECONDS) --json \
	    --plan benchmarks/kept/regions.jsonl.gz > results/regions.json.part
	@mv results/regions.json.part results/regions.json
	@cat results/regions.json

attraction: $(READY)  ## prove where the motions from rest go, for SECONDS more (3600); resumes
	@mkdir -p results
	$(BIN)/capsule-sym enclose --from-rest results/from-rest.jsonl --max-seconds $(SECONDS) --json \
	    --plan benchmarks/kept/from-rest.jsonl.gz > results/attraction.json.part
	@mv results/attraction.json.part results/attraction.json
	@cat results/attraction.json

fastest: $(READY)  ## prove the largest average velocity over a box of drives, for SECONDS more (3600); resumes
	@mkdir -p results
	$(BIN)/capsule-sym enclose --fastest results/fastest.jsonl --max-seconds $(SECONDS) --json \
	    --plan benchmarks/kept/fastest.jsonl.gz > results/fastest.json.part
	@mv results/fastest.json.part results/fastest.json
	@cat results/fastest.json

horseshoe: $(READY)  ## prove a horseshoe, and check its certificate with code of its own
	@mkdir -p results
	$(BIN)/capsule-sym enclose --horseshoe --out results/horseshoe.json --json \
	    > results/horseshoe-proved.json.part
	$(BIN)/python capsule_sym/_enclosures/certificates/horseshoe_checker.py results/horseshoe.json
	@mv results/horseshoe-proved.json.part results/horseshoe-proved.json

lint: $(READY)  ## check style, format and English
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/python -m benchmarks.prose

types: $(READY)  ## check types, strictly
	$(BIN)/mypy

contract: $(READY)  ## check which package imports which
	$(BIN)/lint-imports

lines: $(READY)  ## count the lines of each room, long functions, circles of imports and the like
	@$(BIN)/python -m benchmarks.lines

generate: $(READY)  ## derive and write generated/
	$(BIN)/python -m capsule_sym.codegen

core: $(READY)  ## compile what changed of the C cores, as after `make generate`
	$(BIN)/python -m pip install --quiet --no-deps --no-build-isolation -C build-dir=.venv/core --editable .

check-generated: $(READY)  ## check that generated/ is what the derivation gives
	$(BIN)/python -m capsule_sym.codegen --check

# The documentation shows what `verify` finds: results/verify.md, made anew where what it is made from is newer.
results/verify.md: $(PROVED) | $(READY)
	$(BIN)/capsule-sym verify --out $@ > /dev/null

# What the pages are built with is installed once, for it takes as long as the pages.
.venv/.docs: $(READY)
	@$(call bring,docs)
	@touch $@

SPHINX := $(BIN)/python -m sphinx -q -W --keep-going -j auto docs
docs: results/verify.md .venv/.docs  ## build the documentation in docs/_build/html, and run its examples
	$(SPHINX) docs/_build/html
	$(BIN)/python -m pytest -n 2 --dist worksteal -q -m "long or not long" tests/docs

SITE ?= docs/_build/site
site: docs  ## put the built pages into SITE (docs/_build/site), beside those of other versions
	$(BIN)/python docs/site.py $(SITE)

docs-links: results/verify.md .venv/.docs  ## follow every link of the documentation
	$(SPHINX) -b linkcheck docs/_build/links

# Octave with mkoctfile, and gnuplot to draw with: octave, octave-dev and gnuplot-nox in Debian.
octave: $(READY)  ## run the functions for MATLAB in Octave, which has to be there
	@command -v octave-cli > /dev/null && command -v mkoctfile > /dev/null || { echo 'octave-cli or mkoctfile is missing' >&2; exit 1; }
	CAPSULE_SYM_ALL=1 $(BIN)/python -m pytest -q -m "long or not long" tests/octave

# The explorer's page needs Node.js, to be built, and Chromium, to be tested and measured.
explorer/node_modules/.package-lock.json: explorer/package-lock.json
	cd explorer && npm ci --no-audit --no-fund
	@touch $@

EXPLORER := $(READY) explorer/node_modules/.package-lock.json
explorer: $(EXPLORER)  ## build the page of `capsule-sym explore`; needs Node.js
	@$(call bring,explorer)
	cd explorer && npm run --silent types
	$(BIN)/python explorer/build.py

explorer-test: $(EXPLORER)  ## drive the page in headless Chromium, which has to be there
	@$(call bring,explorer)
	$(BIN)/python -m pytest -q -m "long or not long" tests/explorer

explorer-measure: $(EXPLORER)  ## measure the page in headless Chromium
	@$(call bring,explorer)
	$(BIN)/python explorer/measure.py

clean:  ## remove the environment, builds and caches; results/ stays
	rm -rf .venv build dist .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find benchmarks capsule_sym generated tests -name __pycache__ -prune -exec rm -rf {} +

# An environment that works is kept, whoever made it; one without pip is made again.
$(READY): pyproject.toml
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || { \
	    $(PYTHON) -c '$(SUPPORTED)' || { \
	        echo 'capsule-sym needs Python 3.11 or newer; "$(PYTHON)" is not. Try: make PYTHON=python3.11 $(MAKECMDGOALS)' >&2; \
	        exit 1; }; \
	    $(PYTHON) -m venv --clear .venv; }
	@$(BIN)/python -c '$(SUPPORTED)' || { \
	    echo 'capsule-sym needs Python 3.11 or newer, and .venv has an older one. Remove it with: make clean' >&2; \
	    exit 1; }
	$(BIN)/python -m pip install --quiet --editable '.[dev]'
	@touch $@
