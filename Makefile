# One command each for what most people want. Everything here is also plain CMake: see CMakePresets.json.
# Variables: ARCH (-march value, default native) · CI=1 (warnings are errors) · JOBS (parallel jobs, default: all cores)

ARCH ?= native
JOBS ?= $(shell nproc)
WERROR := $(if $(CI),ON,OFF)
RELEASE := build/release
SANITIZE := build/sanitize
LUMIGROVE := $(RELEASE)/apps/lumigrove/lumigrove
# Looked up when used, because `make dependencies` may have just installed something.
CCACHE = $(if $(shell command -v ccache),-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
CONFIGURE = cmake --preset $(1) -DLUMIGROVE_ARCH=$(ARCH) -DLUMIGROVE_WERROR=$(WERROR) $(CCACHE)
CTEST = ctest --test-dir $(1) --output-on-failure --parallel $(JOBS)

.PHONY: help
help:
	@echo "make demo      install what is missing, build, render the built-in night city to out/, compare methods on it"
	@echo "make test      install what is missing, build, run every test"
	@echo "make build     the library and the tool, in $(RELEASE)"
	@echo "make bench     build and run the bench"
	@echo "make sanitize  every test under AddressSanitizer and UndefinedBehaviorSanitizer"
	@echo "make format    clang-format over all sources"
	@echo "make clean     remove build/ and out/"

.PHONY: dependencies
dependencies:
	@scripts/install-dependencies.sh

.PHONY: test-dependencies
test-dependencies:
	@scripts/install-dependencies.sh tests

.PHONY: configure
configure: dependencies
	$(call CONFIGURE,release)

.PHONY: build
build: configure
	cmake --build $(RELEASE) --parallel $(JOBS) --target lumigrove_tool

.PHONY: demo
demo: build
	@mkdir -p out
	$(LUMIGROVE) render night-city --size 1280 720 --spp 16 -o out/night-city.exr -o out/night-city.png --stats
	$(LUMIGROVE) compare night-city --methods tree,pool,power --size 480 270 --budget 2s --seeds 2 -o out/comparison --force

# The tests of everything that reads or writes files run a second time, under sanitizers.
.PHONY: test
test: test-dependencies configure
	cmake --build $(RELEASE) --parallel $(JOBS)
	$(call CONFIGURE,sanitize)
	cmake --build $(SANITIZE) --parallel $(JOBS) --target lumigrove_input_tests
	$(call CTEST,$(SANITIZE)) --label-regex lumigrove_input_tests
	$(call CTEST,$(RELEASE))

.PHONY: build-bench
build-bench: configure
	cmake --build $(RELEASE) --parallel $(JOBS) --target lumigrove_bench

.PHONY: bench
bench: build-bench
	$(RELEASE)/bench/lumigrove-bench

.PHONY: sanitize
sanitize: test-dependencies
	$(call CONFIGURE,sanitize)
	cmake --build $(SANITIZE) --parallel $(JOBS)
	$(call CTEST,$(SANITIZE))

.PHONY: format
format:
	git ls-files '*.h' '*.cpp' '*.cu' | xargs clang-format -i

.PHONY: clean
clean:
	rm -rf build out
