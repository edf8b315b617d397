# Filoplume. `make help` lists what there is.
SHELL := /bin/bash
PY := .venv/bin/python
export PYTHONPATH := $(CURDIR)
FILE ?=
# real animals for tests and benchmarks, where they lie beside the checkout
ifneq ($(wildcard ../shared/data),)
export FILOPLUME_DATA ?= $(abspath ../shared/data)
endif

.DEFAULT_GOAL := help
.PHONY: help run test check bench soak lock pictures clean

help: ## show this list
	@grep -hE '^[a-z]+:.*##' $(MAKEFILE_LIST) | awk -F':.*## ' '{printf "  make %-9s %s\n", $$1, $$2}'

.venv/ready: requirements.lock pyproject.toml .ci/setup
	@bash .ci/setup

run: .venv/ready ## open the window on the demo animal (or FILE=); without a display groom it into out/ instead
	@if [ -n "$$DISPLAY$$WAYLAND_DISPLAY" ]; then $(PY) -m app window $(if $(FILE),"$(FILE)",--demo); \
	else $(PY) -m app demo $(if $(FILE),--mesh "$(FILE)",); fi

test: .venv/ready ## every test, GL through EGL included (under 10 minutes on 2 cores)
	@$(PY) -m app.compile_kernels >/dev/null # once, before the workers would all compile them
	@OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 NUMBA_NUM_THREADS=1 $(PY) -m pytest -n auto --dist loadfile --no-loadscope-reorder

check: .venv/ready ## ruff, mypy (strict on core and tools), import contracts
	@$(PY) -m ruff check .
	@$(PY) -m mypy
	@.venv/bin/lint-imports --no-logo

bench: .venv/ready ## the table of measured figures (FILOPLUME_PEERS=python with bpy adds Blender)
	@NUMBA_NUM_THREADS=1 $(PY) -m app bench

soak: .venv/ready ## the long ones: 10,000 kills, a million expressions, 5,000 gestures
	@$(PY) -m pytest tests/soak -p no:cacheprovider -o addopts= -q --timeout=7200

pictures: .venv/ready ## remake the pictures of the manual in docs/
	@$(PY) docs/make_pictures.py

lock: ## resolve the dependencies anew into requirements.lock (needs uv)
	uv pip compile pyproject.toml --group dev --universal --generate-hashes --python-version 3.11 \
	  --no-emit-index-url --no-emit-find-links --no-header --output-file requirements.lock

clean: ## remove .venv, caches and out/
	rm -rf .venv out .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -prune -exec rm -rf {} +
