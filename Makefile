# smachpy: `make run` drives the patrol mission, `make test` checks everything.
# `make test PYTHON=3.12` (a version, command or path) works in .venv-3.12; else .venv has the system's Python.
export PYTHON
export VENV := .venv$(if $(PYTHON),-$(patsubst python%,%,$(notdir $(PYTHON))))
BIN := $(VENV)/bin
SLOW_TESTS := -m "slow or browser or ros1 or rclpy or postgres"
DEFAULT_TESTS := -m "not slow and not browser and not ros1 and not rclpy and not postgres"
# Continuous integration (CI=true) runs the slow tests, those in a browser, with ROS 1, rclpy and PostgreSQL too.
TESTS := $(if $(CI),,$(DEFAULT_TESTS))
# One worker more than two cores: many tests wait for processes. A fourth takes more CPU time, and no less time.
WORKERS := -n 3 --dist worksteal

# The commands and the tests start many processes; each is quicker with cached bytecode.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help run test test-pythons contract-100 soak soak-durable fuzz search mutants lint types web stubs format bench bench-check scale docs dist check-installed check-dependencies slow-tests clean

help:  ## Show the targets
	@sed -n 's/^\([a-z0-9-]*\):.*## /\1\t/p' Makefile | expand -t 14

run:  ## Drive the simulated robot through the patrol mission
	@.ci/venv dot,sim
	@$(BIN)/smachpy run patrol --start-robot --out out

# The linters and mypy, which takes the longest, each have a core. What both need is there before.
test: stubs  ## Check everything: ruff, mypy, import-linter, the page's JavaScript, pytest
	@$(MAKE) --no-print-directory --jobs=2 --output-sync=target types lint
	@.ci/web test
	$(BIN)/python -m pytest -q $(WORKERS) $(TESTS)

slow-tests:  ## Run what the default selection leaves out: slow tests, a browser, ROS 1, rclpy, PostgreSQL
	@.ci/venv dot,sim,test
	@.ci/web tools
	$(BIN)/python -m pytest -q $(WORKERS) $(SLOW_TESTS)

# What the pages of docs show is executed once, by `make test`.
test-pythons:  ## Run the default tests on the newest Python found, those that depend on it on the others (SKIP=3.11 ALL=1)
	@.ci/test-pythons $(WORKERS) $(DEFAULT_TESTS) --ignore=tests/docs

contract-100:  ## Run the contract tests a hundred times in a row, with other faults each time
	@.ci/venv dot,sim,test
	@.ci/contract 100 $(WORKERS) $(TESTS)

soak:  ## Attack what is promised for some minutes and print the figures (GOALS=20000 SECONDS=150 SEED=1 MACHINES=4000)
	@.ci/venv dot,sim,test
	$(BIN)/python tests/soak/soak.py $(if $(GOALS),--goals $(GOALS)) $(if $(SECONDS),--seconds $(SECONDS)) $(if $(SEED),--seed $(SEED))
	MACHINES=$(or $(MACHINES),4000) $(BIN)/python -m pytest -q -m slow tests/contract/test_differential.py

soak-durable:  ## Kill durable missions, also in virtual time, and update a fleet that works (KILLS=1000 RUNS=1000 UPDATES_S=120 SEED=1)
	@.ci/venv dot,sim,test
	KILLS=$(or $(KILLS),1000) $(BIN)/python -m pytest -q -s -m slow tests/smachpy/durable/test_killed_processes.py
	RUNS=$(or $(RUNS),1000) $(BIN)/python -m pytest -q -m slow tests/missions/test_killed.py
	$(BIN)/python tests/soak/fleet.py --seconds $(or $(UPDATES_S),120) $(if $(SEED),--seed $(SEED))

mutants:  ## Change one line at a time: would the tests notice? (ROOMS="smachpy/engine" SAMPLE=20 SEED=1)
	@.ci/venv dot,sim,test
	$(BIN)/python tests/tools/mutants.py $(ROOMS) $(if $(SAMPLE),--sample $(SAMPLE)) $(if $(SEED),--seed $(SEED))

fuzz:  ## Mutate the inputs of every reader for minutes, and check what others have written (SECONDS=120 SEED=1 ONLY=yaml,net)
	@.ci/venv dot,sim,test
	@.ci/audit
	$(BIN)/python tests/fuzz/fuzz.py $(if $(SECONDS),--seconds $(SECONDS)) $(if $(SEED),--seed $(SEED)) $(if $(ONLY),--only $(ONLY))

search:  ## Try other examples in the property-based tests; "make test" tries the same ones each time (EXAMPLES=2000)
	@.ci/venv dot,sim,test
	EXAMPLES=$(or $(EXAMPLES),2000) $(BIN)/python -m pytest -q $(WORKERS) -m hypothesis --hypothesis-profile=search -o timeout=3600 tests

lint:  ## Check format, style, imports and words: ruff, import-linter, .ci/words; biome and tsc for the page
	@.ci/venv dot,sim,test
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports
	@$(BIN)/python -I -S .ci/words
	@.ci/web lint

types: stubs  ## Check the types: mypy --strict
	$(BIN)/mypy

web:  ## Build the live page into viz/smachpy_viz/web, where it is in the repository (after a change in viz/web)
	@.ci/venv dot,sim,test
	@.ci/web build

stubs:  ## Write the typed stubs of all interfaces, which git ignores; an installation does, too
	@.ci/venv dot,sim,test
	@$(BIN)/python -I -S .ci/stubs

format:  ## Put the code into shape
	@.ci/venv dot,sim,test
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .
	@.ci/web format

# The peers have an environment of their own, without what only tests need.
bench:  ## Measure everything beside its peers and write benchmarks/RESULTS.md (ROUNDS=3 ONLY=machines,actions)
	@VENV=.venv-bench .ci/venv dot,sim,web,bench
	.venv-bench/bin/python benchmarks/bench.py --write benchmarks $(if $(ROUNDS),--rounds $(ROUNDS)) $(if $(ONLY),--only $(ONLY))

bench-check:  ## Measure a short form of each; fail on a figure that stays beyond its budget (benchmarks/budgets.toml)
	@VENV=.venv-bench .ci/venv dot,sim,web,bench
	.venv-bench/bin/python benchmarks/bench.py --check $(if $(ONLY),--only $(ONLY))

scale:  ## Measure how cost grows at larger sizes, with several runners of one queue (STORE=postgresql://HOST/EMPTY)
	@.ci/venv dot,sim,test
	$(BIN)/python benchmarks/scale.py --long $(if $(STORE),--store $(STORE))

docs:  ## Build the site into build/site; warnings and broken links are errors
	@.ci/venv dot,sim,test
	@.ci/docs

dist:  ## Build wheel and source archive into dist/, twice the same, and check them
	@.ci/dist

check-installed: dist  ## Do what README and tutorial say with the wheel, outside the repository (PYTHON=3.12)
	@.ci/installed $(PYTHON)

check-dependencies:  ## Try the oldest versions of all dependencies
	@.ci/venv dot,sim,test
	@.ci/dependencies $$(.ci/python $(PYTHON))

clean:  ## Remove everything that was made
	rm -rf .venv .venv-* viz/web/node_modules out build dist *.egg-info .mypy_cache .ruff_cache .hypothesis
