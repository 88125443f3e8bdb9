# smachpy: `make run` drives the patrol mission, `make test` checks everything.
BIN := .venv/bin
# Continuous integration (CI=true) runs the slow tests and those in a browser too.
TESTS := $(if $(CI),,-m "not slow and not browser")
# One worker more than two cores: many tests wait for processes.
WORKERS := -n 3 --dist worksteal

# The commands and the tests start many processes; each is quicker with cached bytecode.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help run test contract-100 lint types format bench clean

help:  ## Show the targets
	@sed -n 's/^\([a-z0-9-]*\):.*## /\1\t/p' Makefile | expand -t 14

run:  ## Drive the simulated robot through the patrol mission
	@.ci/venv dot,sim
	@$(BIN)/smachpy run patrol --start-robot --out out

test: lint types  ## Check everything: ruff, mypy, import-linter, pytest
	$(BIN)/python -m pytest -q $(WORKERS) $(TESTS)

contract-100:  ## Run the contract tests a hundred times in a row, with other faults each time
	@.ci/venv dot,sim,test
	@.ci/contract 100 $(WORKERS) $(TESTS)

lint:
	@.ci/venv dot,sim,test
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/lint-imports

types:
	@.ci/venv dot,sim,test
	$(BIN)/mypy

format:  ## Put the code into shape
	@.ci/venv dot,sim,test
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

clean:  ## Remove everything that was made
	rm -rf .venv out build dist *.egg-info .mypy_cache .ruff_cache .hypothesis
