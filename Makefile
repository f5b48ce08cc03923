# The commands of the project, from a bare Debian 12 or 13 on. `make` alone lists them.

PYTHON := .venv/bin/python
# Debian's own mpirun, whatever else may be first on PATH. More ranks than cores are fine here.
MPIRUN := /usr/bin/mpirun.openmpi --oversubscribe
# Seconds after which one run of the tests or the demo is stopped: ranks that wait for each other never end.
LIMIT := 3600
# Whether `make docs` executes the lessons: force, or off where the tests have done so.
LESSONS := force
# Whether `make test` runs the tests marked long, too: yes.
ALL :=
# More options for pytest, as in: make test ARGS="-k hemitropic"
ARGS :=

# Open MPI, on one machine: allow root (containers), shared memory only, no warnings about absent hardware.
export OMPI_ALLOW_RUN_AS_ROOT := 1
export OMPI_ALLOW_RUN_AS_ROOT_CONFIRM := 1
export OMPI_MCA_btl := self,vader
export HWLOC_HIDE_ERRORS := 2
export UCX_LOG_LEVEL := fatal
# Ranks that wait leave the core to those that work: other things may run beside.
export OMPI_MCA_mpi_yield_when_idle := 1
# One thread a rank.
export OMP_NUM_THREADS := 1
# Pictures into files, without a display.
export MPLBACKEND := Agg
export PYVISTA_OFF_SCREEN := true
export VTK_DEFAULT_OPENGL_WINDOW := vtkEGLRenderWindow

.PHONY: help setup demo test lint figures notebooks docs bench clean

help: ## list these commands
	@sed -n 's/^\([a-z]*\):.*## /\1\t/p' Makefile | expand -t 12

setup: ## install what is missing: Debian packages (as root or by sudo) and .venv
	@tools/setup.sh viz,tables,test

demo: setup ## follow a hemitropic rod past its bifurcations and draw it
	timeout --foreground -k 10 $(LIMIT) $(MPIRUN) -n 2 $(PYTHON) -m rodfem run demos/hemitropic.py
	@echo "The pictures:"; ls results/hemitropic/diagram.png results/hemitropic/shape.png

test: setup ## run the tests: serially, on two ranks, and the short ones on three
	@all=$(ALL) tools/test.sh "$(PYTHON)" "$(MPIRUN)" "$(LIMIT)" $(ARGS)

lint: setup ## check style and types
	@tools/setup.sh dev
	$(PYTHON) -m ruff check
	$(PYTHON) -m ruff format --check
	$(PYTHON) -m mypy

figures: setup ## run all demos
	@set -e; for demo in demos/*.py; do echo "$$demo"; $(PYTHON) "$$demo"; done

docs: setup ## build the site in build/site; LESSONS=off does not execute the course
	@tools/setup.sh docs
	RODFEM_LESSONS=$(LESSONS) $(PYTHON) -m sphinx -q -W --keep-going -b html docs build/site
	@echo "The site: build/site/index.html"

notebooks: setup ## the lessons of the course as notebooks, in results/notebooks
	@tools/setup.sh docs
	@$(PYTHON) tools/notebooks.py results/notebooks

bench: setup ## measure speed, ways to judge a state, hard cases: docs/speed.md, stability.md, robustness.md and their logs (80 minutes)
	$(PYTHON) -m benchmarks.speed
	$(PYTHON) -m benchmarks.stability
	$(PYTHON) -m benchmarks.robustness

clean: ## remove what the commands above made, but not .venv
	rm -rf results build *.egg-info .mypy_cache .ruff_cache .pytest_cache
	find rodfem forms demos docs tests -name __pycache__ -prune -exec rm -rf {} +
