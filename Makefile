# palette4d: from a fresh clone to results. Needs Python 3.11 to 3.13, make and a C++17 compiler;
# cmake, ninja and all else come from the package index that pip is set up for.
#
# Everything built lies under .venv/, build/ and demo_output/; `make clean` removes them.

SHELL := /bin/sh
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

# The Python to build with: the first suitable one on PATH, or make PYTHON=/path/to/python3.12 ...
PYTHON ?=
CXX ?= g++
# Passed on to pytest: make test-py PYTEST_ARGS="-k slice -x"
PYTEST_ARGS ?=

# How many tests run at a time.
JOBS ?= $(shell nproc 2>/dev/null || echo 2)
# The slow tests too: make test-py SLOW=1
SLOW ?=

# How long libFuzzer may look: make test-fuzz FUZZ_SECONDS=3600
FUZZ_SECONDS ?= 60

# An OpenFX SDK whose headers the C++ tests are to be built with: make test OPENFX_ROOT=/path/to/openfx
OPENFX_ROOT ?=

# A Python path or an active environment of the caller must not leak into what is tested.
unexport PYTHONPATH PYTHONHOME VIRTUAL_ENV

VENV := .venv
TOOLS := build/tools
TEST_VENV := build/test-venv
WHEELS := build/wheels
TEST_WHEELS := build/test-wheels
PIP := -m pip --quiet --disable-pip-version-check

# Folders are listed too, so that a removed file counts as a change.
SOURCES := pyproject.toml README.md LICENSE $(shell find src ofx_plugin analysis lut_export \
	! -name '__pycache__*' ! -name '*.pyc')
CXX_FILES = $(shell find ofx_plugin tests -name '*.cpp' -o -name '*.hpp' -o -name '*.h' -o -name '*.inl')

.PHONY: help demo studio docs-images test test-all install dev wheel lint style types build-cpp build-sanitize build-threads \
	build-fuzz test-cpp test-sanitize test-threads test-threads-short test-fuzz test-py format clean \
	compiler fuzz-compiler

help: ## this list
	@echo "make demo            from nothing to results in demo_output/"
	@echo "make studio          the window, with the demo's result"
	@echo "make test            lint, C++ tests (plain and sanitized), the wheel, host tests; no slow tests"
	@echo "make test-all        the same with the slow tests, ThreadSanitizer and libFuzzer, before a release"
	@echo
	@echo "make install         .venv with palette4d in it (.venv/bin/palette4d)"
	@echo "make dev             .venv with an editable palette4d and every tool"
	@echo "make wheel           the wheel, in $(WHEELS)/"
	@echo "make lint            ruff, clang-format, mypy (strict, on the installed wheel)"
	@echo "make test-cpp        C++ tests, warnings as errors"
	@echo "make test-sanitize   the same under AddressSanitizer and UndefinedBehaviorSanitizer"
	@echo "make test-threads    the node's tests in the strict host under ThreadSanitizer (not part of make test)"
	@echo "make test-fuzz       libFuzzer over the sidecar's reader for FUZZ_SECONDS (needs Clang; not part of make test)"
	@echo "make test-py         pytest on the wheel in a fresh environment (PYTEST_ARGS=... is passed on)"
	@echo "make format          rewrite the sources as ruff and clang-format want them"
	@echo "make docs-images     draw the pictures of the docs again, from the demo"
	@echo "make clean           remove everything that was built"
	@echo
	@echo "PYTHON=/path/to/python3.12 chooses the Python; CXX=... the compiler; OPENFX_ROOT=... a folder"
	@echo "whose include/ holds the official OpenFX headers, for the C++ tests."

# ---------------------------------------------------------------------------- environments

# $(call new-venv,FOLDER)
define new-venv
	@rm -rf $(1)
	@mkdir -p $(dir $(1))
	@python=$$(tools/find_python.sh "$(PYTHON)") && echo "== $(1), with $$python" && \
		"$$python" -m venv $(1)
endef

compiler:
	@command -v $(firstword $(CXX)) >/dev/null 2>&1 || { \
		echo "palette4d needs a C++17 compiler: $(CXX) was not found (install g++, or set CXX)" >&2; \
		exit 1; }

fuzz-compiler:
	@command -v clang++ >/dev/null 2>&1 || { \
		echo "libFuzzer is Clang's, and clang++ was not found (Debian: clang and libclang-rt-dev)" >&2; \
		exit 1; }

$(VENV)/.created:
	$(call new-venv,$(VENV))
	@touch $@

build/wheel.stamp: $(SOURCES) | $(VENV)/.created compiler
	@echo "== the wheel (compiles the core, the bindings and the OpenFX bundle; takes 1 to 3 minutes)"
	@rm -rf $(WHEELS)
	$(VENV)/bin/python $(PIP) wheel . --no-deps --wheel-dir $(WHEELS)
	@touch $@

ifeq ($(wildcard $(VENV)/.editable),)
$(VENV)/.installed: build/wheel.stamp
	@echo "== palette4d and what it needs into $(VENV) (takes 1 to 3 minutes the first time)"
	$(VENV)/bin/python $(PIP) install $(WHEELS)/*.whl
	$(VENV)/bin/python $(PIP) install --no-deps --force-reinstall $(WHEELS)/*.whl
	@touch $@
else
$(VENV)/.installed: $(SOURCES)
	@echo "== palette4d into $(VENV) (editable)"
	$(VENV)/bin/python $(PIP) install --no-build-isolation --no-deps --editable .
	@touch $@
endif

install: $(VENV)/.installed ## .venv with palette4d in it

dev: $(VENV)/.created compiler ## .venv with an editable palette4d and every tool
	@mkdir -p build
	$(VENV)/bin/python tools/requirements.py native > build/native.txt
	$(VENV)/bin/python $(PIP) install -r build/native.txt
	$(VENV)/bin/python $(PIP) install --no-build-isolation --editable '.[dev]'
	@touch $(VENV)/.editable $(VENV)/.installed
	@echo "An editable palette4d and its tools are in $(VENV); C++ changes are compiled by: make dev"

$(TOOLS)/.installed: pyproject.toml tools/requirements.py
	$(call new-venv,$(TOOLS))
	$(TOOLS)/bin/python tools/requirements.py native lint > $(TOOLS)/requirements.txt
	$(TOOLS)/bin/python $(PIP) install -r $(TOOLS)/requirements.txt
	@touch $@

# The wheel that is tested, and with it the C++ tests, from one build: what pytest, the strict host and
# ctest run is the same machine code. Warnings are errors here, not in a user's build.
build/test-wheel.stamp: $(SOURCES) $(shell find tests/core tests/host tests/fuzz -name '*.[chi]*' -o -name CMakeLists.txt) \
		| $(TOOLS)/.installed compiler
	@echo "== C++: core, bindings, OpenFX bundle and their tests (takes 2 to 4 minutes)"
	@rm -rf $(TEST_WHEELS)
	@PATH="$(CURDIR)/$(TOOLS)/bin:$$PATH" $(TOOLS)/bin/python $(PIP) wheel . --no-deps --no-build-isolation \
		--wheel-dir $(TEST_WHEELS) -C build-dir=build/cmake/test -C cmake.define.PALETTE4D_BUILD_TESTS=ON \
		-C cmake.define.PALETTE4D_WERROR=ON -C cmake.define.OPENFX_ROOT="$(abspath $(OPENFX_ROOT))"
	@touch $@

# A fresh environment for every new wheel: nothing but the wheel, its dependencies and the tests'.
$(TEST_VENV)/.installed: build/test-wheel.stamp
	$(call new-venv,$(TEST_VENV))
	@wheel=$$(echo $(TEST_WHEELS)/*.whl) && set -x && \
		$(TEST_VENV)/bin/python $(PIP) install "$$wheel[test]"
	@touch $@

# ---------------------------------------------------------------------------- demo

demo: $(VENV)/.installed ## from nothing to results in demo_output/
	@$(VENV)/bin/python tools/demo.py demo_output

demo_output/sample.p4d.json:
	$(MAKE) demo

$(VENV)/.studio: $(VENV)/.installed pyproject.toml
	@echo "== the window's toolkit into $(VENV)"
	$(VENV)/bin/python tools/requirements.py studio > $(VENV)/studio.txt
	$(VENV)/bin/python $(PIP) install -r $(VENV)/studio.txt
	@touch $@

studio: $(VENV)/.studio demo_output/sample.p4d.json ## the window, with the demo's result
	@$(VENV)/bin/palette4d studio demo_output/sample.p4d.json

docs-images: $(VENV)/.studio demo_output/sample.p4d.json ## draw the pictures of the docs again
	$(VENV)/bin/python docs/pictures.py demo_output
	$(VENV)/bin/python docs/page_pictures.py
	$(VENV)/bin/python docs/studio_pictures.py demo_output

# ---------------------------------------------------------------------------- tests

test: lint test-cpp test-sanitize test-py ## what a change must pass: all but the slow tests
	@echo "== all of make test passed"

# Before a release: the slow tests too, ThreadSanitizer over all tests of the node, ten minutes of
# libFuzzer, and a wheel built as pip builds it for users.
test-all: ## everything, before a release
	$(MAKE) SLOW=1 test test-threads wheel
	$(MAKE) FUZZ_SECONDS=600 test-fuzz
	@echo "== all of make test-all passed"

wheel: build/wheel.stamp ## the wheel
	@ls $(WHEELS)/*.whl

lint: style types

style: $(TOOLS)/.installed
	@echo "== ruff, clang-format"
	$(TOOLS)/bin/ruff check .
	$(TOOLS)/bin/ruff format --check .
	@$(TOOLS)/bin/clang-format --dry-run --Werror $(CXX_FILES)
	$(TOOLS)/bin/python tools/check_core_rooms.py

# mypy sees palette4d as its users do: the installed wheel, never the source tree.
types: $(TOOLS)/.installed $(TEST_VENV)/.installed
	@echo "== mypy --strict on the installed wheel"
	$(TOOLS)/bin/mypy --python-executable $(TEST_VENV)/bin/python -p palette4d
	$(TOOLS)/bin/mypy --python-executable $(TEST_VENV)/bin/python tools
	@echo "== stubtest: _core.pyi against the compiled module"
	@PYTHONPATH=$$($(TOOLS)/bin/python -c 'import sysconfig; print(sysconfig.get_path("platlib"))') \
		$(TEST_VENV)/bin/python -m mypy.stubtest palette4d._core --allowlist tools/stub_allowlist.txt
	@echo "== import-linter: who may import whom"
	@PYTHONPATH=$$($(TEST_VENV)/bin/python -c 'import sysconfig; print(sysconfig.get_path("platlib"))') \
		$(TOOLS)/bin/lint-imports --no-cache --config pyproject.toml

# $(call preset,NAME,COMMAND): run a command of CMake's with our tools, where the presets are
define preset
	@PATH="$(CURDIR)/$(TOOLS)/bin:$$PATH" && export PATH && cd ofx_plugin && $(2) --preset $(1)
endef

build-cpp: build/test-wheel.stamp
build-sanitize build-threads: compiler
build-fuzz: fuzz-compiler
build-sanitize build-threads build-fuzz: build-%: $(TOOLS)/.installed
	@echo "== C++ (preset $*)"
	$(call preset,$*,cmake -DPython_EXECUTABLE="$(CURDIR)/$(TOOLS)/bin/python" \
		-DOPENFX_ROOT="$(abspath $(OPENFX_ROOT))")
	$(call preset,$*,cmake --build)

test-threads-short: build-threads
test-cpp test-sanitize test-threads: test-%: build-%
test-cpp test-sanitize test-threads test-threads-short: test-%:
	@echo "== C++ tests (preset $(CTEST_PRESET_$*))"
	$(call preset,$(CTEST_PRESET_$*),ctest --parallel $(JOBS) $(if $(SLOW),,--label-exclude slow))
CTEST_PRESET_cpp := test
CTEST_PRESET_sanitize := sanitize
CTEST_PRESET_threads := threads
CTEST_PRESET_threads-short := threads-short

# What it finds new goes on from run to run in build/fuzz/; a crash leaves its input there.
test-fuzz: build-fuzz
	@echo "== libFuzzer, $(FUZZ_SECONDS) s"
	@mkdir -p build/fuzz/found
	build/cmake/fuzz/tests/fuzz/fuzz_sidecar -max_total_time=$(FUZZ_SECONDS) -max_len=16384 -timeout=30 \
		-verbosity=0 -print_final_stats=1 -artifact_prefix=build/fuzz/ \
		build/fuzz/found tests/fuzz/corpus tests/golden/sidecars

# From a folder of its own, so that no file of the tree can stand in for the installed package.
test-py: $(TEST_VENV)/.installed
	@echo "== pytest on the installed wheel"
	@rm -rf build/test-run && mkdir -p build/test-run
	@qt=$$($(TEST_VENV)/bin/python -c 'import PySide6.QtWidgets' 2>&1) && qt= || { \
		echo "== without the window's tests: Qt needs libegl1 libgl1 libxkbcommon0 libfontconfig1 libdbus-1-3"; \
		qt="-p no:pytest-qt"; }; \
	wheel=$$(echo "$(CURDIR)"/$(TEST_WHEELS)/*.whl) && cd build/test-run && \
		PALETTE4D_WHEEL="$$wheel" "$(CURDIR)/$(TEST_VENV)/bin/python" -P -m pytest \
		-c "$(CURDIR)/pyproject.toml" --rootdir "$(CURDIR)" "$(CURDIR)/tests" -n $(JOBS) --durations 10 $$qt \
		$(if $(SLOW),,-m "not slow") $(PYTEST_ARGS)

format: $(TOOLS)/.installed ## rewrite the sources as ruff and clang-format want them
	$(TOOLS)/bin/ruff check --fix .
	$(TOOLS)/bin/ruff format .
	$(TOOLS)/bin/clang-format -i $(CXX_FILES)

clean: ## remove everything that was built
	rm -rf $(VENV) build dist demo_output .cache .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find src ofx_plugin analysis lut_export tests tools -name __pycache__ -type d -exec rm -rf {} +
