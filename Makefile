# smachpy: `make run` drives the patrol mission, `make test` checks everything.
# `make test PYTHON=3.12` (a version, command or path) works in .venv-3.12; else .venv has the system's Python.
export PYTHON
export VENV := .venv$(if $(PYTHON),-$(patsubst python%,%,$(notdir $(PYTHON))))
BIN := $(VENV)/bin
DEFAULT_TESTS := -m "not slow and not browser and not ros1 and not rclpy and not postgres"
# Continuous integration (CI=true) runs the slow tests, those in a browser, with ROS 1, rclpy and PostgreSQL too.
TESTS := $(if $(CI),,$(DEFAULT_TESTS))
# One worker more than two cores: many tests wait for processes.
WORKERS := -n 3 --dist worksteal

# The commands and the tests start many processes; each is quicker with cached bytecode.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help run test test-pythons contract-100 soak soak-durable lint types format bench clean

help:  ## Show the targets
	@sed -n 's/^\([a-z0-9-]*\):.*## /\1\t/p' Makefile | expand -t 14

run:  ## Drive the simulated robot through the patrol mission
	@.ci/venv dot,sim
	@$(BIN)/smachpy run patrol --start-robot --out out

test: lint types  ## Check everything: ruff, mypy, import-linter, the page's JavaScript, pytest
	@.ci/web test
	$(BIN)/python -m pytest -q $(WORKERS) $(TESTS)

# What the pages of docs show is executed once, by `make test`.
test-pythons:  ## Run the default tests on every Python that is claimed and found (SKIP=3.11: but that one)
	@.ci/test-pythons $(WORKERS) $(DEFAULT_TESTS) --ignore=tests/docs

contract-100:  ## Run the contract tests a hundred times in a row, with other faults each time
	@.ci/venv dot,sim,test
	@.ci/contract 100 $(WORKERS) $(TESTS)

soak:  ## Attack what is promised for some minutes and print the figures (GOALS=20000 SECONDS=150 SEED=1)
	@.ci/venv dot,sim,test
	$(BIN)/python tests/soak/soak.py $(if $(GOALS),--goals $(GOALS)) $(if $(SECONDS),--seconds $(SECONDS)) $(if $(SEED),--seed $(SEED))

soak-durable:  ## Kill a durable mission's processes, and the shipped missions in virtual time (KILLS=1000 RUNS=1000 SEED=1)
	@.ci/venv dot,sim,test
	KILLS=$(or $(KILLS),1000) $(BIN)/python -m pytest -q -s -m slow tests/smachpy/durable/test_killed_processes.py
	RUNS=$(or $(RUNS),1000) $(BIN)/python -m pytest -q -m slow tests/missions/test_killed.py

lint:
	@.ci/venv dot,sim,test
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports
	@.ci/web lint

types:
	@.ci/venv dot,sim,test
	$(BIN)/mypy

format:  ## Put the code into shape
	@.ci/venv dot,sim,test
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .
	@.ci/web format

clean:  ## Remove everything that was made
	rm -rf .venv .venv-* viz/web/node_modules out build dist *.egg-info .mypy_cache .ruff_cache .hypothesis
