# `make help` lists the targets. Each sets up what it needs, given cargo, a C compiler, and python3 with pip.

DEPS := .deps
MUJOCO := 3.17.0
LIBRARY := $(DEPS)/lib/libmujoco.so
MUJOCO_LICENCES := $(DEPS)/lib/licences
# Selects the package file independently of the Python version that fetches it.
PLATFORM := --platform manylinux_2_28_x86_64 --python-version 3.12 --implementation cp --abi cp312
FETCH := python3 -m pip download --quiet --no-deps --only-binary=:all: --require-hashes
# Commit that the program reports; "unknown" in a build by cargo alone.
export PALPATE_COMMIT := $(shell git rev-parse --short=12 HEAD 2>/dev/null || echo unknown)
PALPATE := target/release/palpate
VERSION := $(shell sed -n '0,/^version = "\(.*\)"/s//\1/p' Cargo.toml)
DIST := palpate-$(VERSION)-x86_64-linux

# Features of all tests; one set, so that nothing is built twice.
FEATURES := ros2,franka,pictures
# The program of the tests, target/debug/palpate: one without their dependencies' features is another build.
BUILD_TESTS := cargo test --quiet --locked --features $(FEATURES) --no-run
SUITE := cargo test --locked -p palpate --features $(FEATURES) --test suite --

define newline


endef

# Checks a variable $(2) of goal $(1), whose allowed words are $(3).
check = $(if $(filter $(1),$(MAKECMDGOALS)),$(if $(filter-out $(3),$($(2))),$(error $(2)=$(filter-out $(3),$($(2))): allowed are $(3))))

.PHONY: help setup demo test test-code test-arms lint texts docs bench paper tools wheel dist release clean prerequisites

help: ## This list
	@sed -nE 's/^([a-z-]+):[^#]*## (.*)/\1\t\2/p' Makefile | expand -t 12
	@echo
	@echo 'PART of make test: $(PARTS)'
	@echo 'BENCH of make bench: $(BENCHES)'

setup: prerequisites $(LIBRARY) ## MuJoCo's library into .deps; once, before cargo is called directly

prerequisites:
	@command -v cargo >/dev/null || { echo "cargo is missing: install Rust with rustup" >&2; exit 1; }
	@command -v cc >/dev/null || { echo "a C compiler is missing: install gcc (Debian: apt-get install gcc)" >&2; exit 1; }
	@command -v python3 >/dev/null || { echo "python3 is missing (Debian: apt-get install python3 python3-pip)" >&2; exit 1; }

# Shared library of the physics engine with its licences, from its Python package.
$(LIBRARY) $(MUJOCO_LICENCES) &: .cargo/mujoco.txt | prerequisites
	@python3 -m pip --version >/dev/null || { echo "pip is missing (Debian: apt-get install python3-pip)" >&2; exit 1; }
	rm -rf $(DEPS)/mujoco && mkdir -p $(DEPS)/mujoco $(MUJOCO_LICENCES)
	$(FETCH) $(PLATFORM) -r .cargo/mujoco.txt -d $(DEPS)/mujoco
	cd $(DEPS)/mujoco && python3 -m zipfile -e mujoco-*.whl .
	cp $(DEPS)/mujoco/mujoco/libmujoco.so.$(MUJOCO) $(DEPS)/lib/
	cp $(DEPS)/mujoco/mujoco-*.dist-info/licenses/* $(MUJOCO_LICENCES)
	rm -rf $(DEPS)/mujoco
	ln -sf libmujoco.so.$(MUJOCO) $@

demo: setup ## Builds and runs a short experiment: runs/demo/report.html
	cargo build --release --locked
	$(PALPATE) run experiments/demo.toml

# Python environments, each with the packages of its list.
$(DEPS)/ros2/ready: tests/ros2/peer.txt
$(DEPS)/franka/ready: tests/franka/box.txt
$(DEPS)/live/ready: tests/live/requirements.txt
$(DEPS)/mcap/ready: tests/mcap.txt
$(DEPS)/peers/ready: benches/peers.txt
$(DEPS)/python/ready: python/requirements.txt
$(DEPS)/python/ready: export PIP_NO_COMPILE := 1
$(DEPS)/%/ready:
	python3 -m venv $(@D)
	$(@D)/bin/python -m pip install --quiet --only-binary=:all: -r $^
	touch $@

# The package of axe-core is fetched for the script in it.
AXE := $(DEPS)/axe/axe_playwright_python/axe.min.js
$(AXE): tests/axe.txt
	rm -rf $(DEPS)/axe && mkdir -p $(DEPS)/axe
	$(FETCH) -r tests/axe.txt -d $(DEPS)/axe
	cd $(DEPS)/axe && python3 -m zipfile -e axe_playwright_python-*.whl .
	touch $@

# Notes that part $(1) of the tests is skipped, and why; an error with PALPATE_REQUIRE=1.
skip = { echo "$(1) is skipped: $(2)" >&2; test "$$PALPATE_REQUIRE" != 1; }

# Runs the command $(2) of part $(1) in a network namespace of its own, isolated from the network.
NAMESPACE := unshare --map-root-user --net bash tests/ros2/namespace.sh
NO_NAMESPACE := no permission for a network namespace (unshare --map-root-user --net)
isolated = if $(NAMESPACE) true 2>/dev/null; then $(2); else $(call skip,$(1),$(NO_NAMESPACE)); fi

# Shards with GNU parallel and with Slurm on one node.
define part-clusters
$(BUILD_TESTS)
tests/clusters/test.sh target/debug/palpate
endef

# Compares instruction counts with experiments/baselines/cost.toml, by valgrind.
define part-cost
CARGO_INCREMENTAL=0 CARGO_PROFILE_DEV_CODEGEN_UNITS=2 $(BUILD_TESTS)
tests/cost.py --program target/debug/palpate
endef

# Distance that the tip moves after each failure between explorer and arm: the table of docs/safety.md.
# It runs in real time and needs an idle machine.
define part-faults
$(SUITE) --ignored --test-threads 1 --nocapture twin_faults
endef

# A Franka arm against a simulated control box.
FRANKA_TOUCHES := 12
FRANKA_TESTS := franka::
needs-franka := $(DEPS)/franka/ready
define part-franka
@$(call isolated,franka,PALPATE_FRANKA=$(abspath $(DEPS)/franka/bin/python) PALPATE_FRANKA_TOUCHES=$(FRANKA_TOUCHES) \
	PALPATE_FRANKA_ENDS=20 $(NAMESPACE) $(SUITE) --ignored --test-threads 1 $(FRANKA_TESTS))
endef

# Randomly altered files and settings cause errors, but no panic and no hang. Takes about an hour. Each run draws other
# ones; PROPTEST_RNG_SEED repeats a run.
FUZZ := 100000
define part-fuzz
@export PALPATE_FUZZ=$(FUZZ) PROPTEST_RNG_SEED=$${PROPTEST_RNG_SEED:-$$(od -An -N4 -tu4 /dev/urandom | tr -d ' ')}; \
	echo "PROPTEST_RNG_SEED=$$PROPTEST_RNG_SEED"; \
	for tests in fuzz:: folders::kills recording::; do $(SUITE) $$tests || exit; done
endef

# All hard cases at all severities, periods and time steps, ten minutes of processor time: writes
# docs/hard-cases.md and fails on an unexplained outcome.
define part-hard-cases
PALPATE_HARD_CASES=1 $(SUITE) hard::all_outcomes
endef

# The live page in Chromium.
needs-live := $(DEPS)/live/ready $(AXE)
define part-live
$(BUILD_TESTS)
$(DEPS)/live/bin/python tests/live/page.py target/debug/palpate models/bird.glb --axe $(AXE) --pictures target/test-live
endef

# Reads a recording with an independent reader.
RECORDED := target/test-mcap
needs-mcap := $(DEPS)/mcap/ready
define part-mcap
$(BUILD_TESTS)
target/debug/palpate run container_finger --set trials=1 --set touches=7 --set planners='["active"]' --record --fresh --no-report --out $(RECORDED)
$(DEPS)/mcap/bin/python tests/mcap_reads.py $(RECORDED)/recordings/active-0000.mcap
endef

# The report page in Chromium, and the accessibility of report and built site by axe-core.
needs-page := $(AXE)
define part-page
PALPATE_REQUIRE=1 PALPATE_AXE=$(abspath $(AXE)) $(SUITE) --include-ignored page:: solid:: accessibility::
endef

# Regression test of planners against experiments/baselines; palpate check --accept REASON accepts a change.
CHECKED := toy container bird
define part-planners
$(BUILD_TESTS)
for experiment in $(CHECKED); do \
	target/debug/palpate --quiet check $$experiment --baseline experiments/baselines/$$experiment.jsonl || exit; \
done
endef

# An explorer, a simulated robot over ROS 2, and a peer with another implementation, whose peers find each other by
# multicast.
TOUCHES := 20
UR_TOUCHES := 24
UR_ENDS := 20
OVER_TOPICS := lab:: lab_camera:: lab_live:: lab_recognition:: lab_strokes:: lab_faults:: lab_ur:: lab_ur_driver:: lab_fr3:: lab_planning_scene::
needs-ros2 := $(DEPS)/ros2/ready
define part-ros2
@$(call isolated,ros2,PALPATE_PEER=$(abspath $(DEPS)/ros2/bin/python) PALPATE_TOUCHES=$(TOUCHES) \
	PALPATE_UR_TOUCHES=$(UR_TOUCHES) PALPATE_UR_ENDS=$(UR_ENDS) $(NAMESPACE) \
	$(SUITE) --ignored --test-threads 1 $(OVER_TOPICS))
endef

# The wheel of a release in bare systems with Python 3.10 to 3.13; needs root and debootstrap.
define part-wheel-systems
tests/wheel_systems.sh $(RELEASE)
endef

# The Python package: types, tests, notebooks.
PYTHON := $(DEPS)/python/bin/python
PYTHON_INSTALLED := $(DEPS)/python/installed
needs-python := $(PYTHON_INSTALLED)
define part-python
cargo clippy --locked --package palpate-python -- -D warnings
cd python && $(abspath $(PYTHON)) -m mypy
cd python/tests && $(abspath $(PYTHON)) -m mypy.stubtest --ignore-disjoint-bases palpate._palpate
# Runs outside the source folder, so that the installed package is tested.
cd python/tests && $(abspath $(DEPS)/python/bin/pytest) --numprocesses auto --dist loadfile
$(PYTHON) tests/wheel.py target/wheels-dev
endef

PARTS := $(sort $(patsubst part-%,%,$(filter part-%,$(.VARIABLES))))
$(call check,test,PART,$(PARTS))

test: setup $(if $(PART),$(foreach part,$(PART),$(needs-$(part))),test-code test-arms) ## All tests; PART="NAME …": parts, which are listed below
	$(foreach part,$(PART),$(part-$(part))$(newline))

# Includes ROS 2, to test the topics of an arm without an arm.
test-code: setup ## Tests that need no simulated arm in real time
	cargo test --locked --features $(FEATURES)
	for example in $(EXAMPLES); do cargo run --quiet --locked --features $(FEATURES) --example $$example || exit; done
	python3 -B tests/test_results.py
	tests/clusters/test.sh target/debug/palpate

EXAMPLES := $(basename $(notdir $(wildcard examples/*.rs crates/*/examples/*.rs)))

test-arms: setup ## Tests of simulated arms in real time; needs an idle machine
	$(MAKE) test PART=faults
	$(MAKE) test PART=ros2 TOUCHES=3 UR_TOUCHES=2 OVER_TOPICS='lab::a_peer lab::an_arm lab::only_the_named lab::the_container lab::the_loop lab_camera:: lab_ur::a_peer lab_ur::the_container_is_touched_by_a_ur lab_ur_driver::the_ lab_ur_driver::a_ur_touches lab_fr3::the_peer lab_fr3::an_fr3_touches'
	$(MAKE) test PART=franka FRANKA_TESTS=franka::a_cylinder FRANKA_TOUCHES=2

# PART=features: code with other features, whose packages take long to check.
define lint-features
cargo clippy --locked --lib --bins --no-default-features --features $(FEATURES) -- -D warnings
cargo clippy --locked --lib --bins --features render,viewer -- -D warnings
endef
define lint
cargo fmt --all --check
cargo clippy --locked --all-targets --features $(FEATURES) -- -D warnings
RUSTDOCFLAGS="-D warnings" cargo doc --locked --no-deps --workspace --features $(FEATURES)
endef

lint: setup ## Format, lints, documentation; PART=features: lints of other features
	$(if $(filter features,$(PART)),$(lint-features),$(lint))

texts: setup ## Writes docs/reference.md and tests/messages.txt, which tests compare with the code
	PALPATE_WRITE_REFERENCE=1 PALPATE_WRITE_MESSAGES=1 $(SUITE) reference:: prose::messages

# The guides and the references of Python and Rust; a broken link is an error. All pages are always built, because Sphinx
# does not repeat warnings for unchanged pages.
define site
python3 -B benches/results.py check
rm -rf target/docs-site
$(DEPS)/python/bin/sphinx-build --quiet --fail-on-warning --keep-going --fresh-env -c docs -d target/docs-tree . target/docs-site
RUSTDOCFLAGS="-D warnings" cargo doc --locked --no-deps --workspace --features $(FEATURES)
cp -r target/doc target/docs-site/rust
endef

docs: $(PYTHON_INSTALLED) ## The site, target/docs-site; PART=notebooks: runs and saves the notebooks
	$(if $(filter notebooks,$(PART)),$(PYTHON) python/tests/notebooks.py,$(site))

# Parts of a trial, and the share of the machine's peak that each reaches. Others print or draw what docs cite: contacts,
# strokes, detection and camera the errors and forces of their pages, growth, around and hypotheses the cost over touches
# and hypotheses (docs/growth*.svg).
BENCH := limits kernels interlocks plant dynamic contact

# Where the processor time of eight works goes, and how near its pieces are to the machine: docs/speed.md.
# It needs perf (Debian: linux-perf) and an idle machine.
PIECES := target/pieces.txt
define bench-speed
cargo build --locked --profile bench
cargo bench --locked --bench limits > $(PIECES)
python3 benches/profile.py $(PALPATE) --pieces $(PIECES)
endef

# Compares Palpate with scikit-learn, egobox and BoTorch, whose packages take 3 GB.
needs-peers := $(DEPS)/peers/ready
define bench-peers
cargo build --release --locked
$(DEPS)/peers/bin/python benches/peers.py
endef

BENCHES := $(sort $(basename $(notdir $(wildcard benches/*.rs))) $(patsubst bench-%,%,$(filter bench-%,$(.VARIABLES))))
$(call check,bench,BENCH,$(BENCHES))

bench: setup $(foreach name,$(BENCH),$(needs-$(name))) ## Times the parts of a trial; BENCH="NAME …": other benchmarks
	$(foreach name,$(BENCH),$(or $(bench-$(name)),cargo bench --locked --bench $(name))$(newline))

# Experiments behind docs/paper.md: those of the paper, the same with the soft finger and the arm, and other planners
# beside the paper's.
PAPER_planners := $(wildcard experiments/paper/planners-*.toml)
PAPER_soft := $(wildcard experiments/paper/*-finger-*.toml experiments/paper/*-pa10-*.toml)
PAPER_rigid := $(filter-out $(PAPER_soft) $(PAPER_planners),$(wildcard experiments/paper/*.toml))
PAPERS := rigid soft planners
$(call check,paper,PART,$(PAPERS))

paper: setup ## Experiments of docs/paper.md; PART=rigid, soft or planners: one part
	cargo build --release --locked
	$(PALPATE) export scenes/container.toml
	$(PALPATE) export scenes/bird.toml
	for experiment in $(foreach part,$(or $(PART),$(PAPERS)),$(PAPER_$(part))); do $(PALPATE) run $$experiment || exit; done

# Commands that tests need, each with its Debian package.
TOOLS := chromium:chromium ip:iproute2 parallel:parallel munged:munge sbatch:slurm-wlm slurmd:slurm-wlm valgrind:valgrind
SUDO = $(if $(filter-out 0,$(shell id -u)),sudo)

tools: ## Debian packages that tests can use: browser, valgrind, schedulers
	@missing=$$(PATH=$$PATH:/usr/sbin:/sbin; for tool in $(TOOLS); do \
		command -v $${tool%:*} >/dev/null || echo $${tool#*:}; done | sort -u); \
	test -z "$$missing" || { $(SUDO) apt-get update && \
		$(SUDO) env DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends $$missing; }

# Wheel without a Rust dependency: program, extension and shipped files, in target/wheels.
PYTHON_HOME := python/palpate/home
# The wheel contains MuJoCo's library, which maturin finds by LD_LIBRARY_PATH. It edits the extension that Cargo linked,
# which is therefore linked again each time.
MATURIN = rm -f target/*/deps/lib_palpate.so target/*/*/deps/lib_palpate.so && \
	LD_LIBRARY_PATH=$(abspath $(DEPS)/lib) PATH=$(abspath $(DEPS)/python/bin):$$PATH \
	maturin build --quiet --locked

wheel: setup $(DEPS)/python/ready $(PYTHON_HOME) ## The Python package, target/wheels
	$(MATURIN) --release --out target/wheels

# Installs a development build into the test environment; otherwise equal to the release wheel.
$(PYTHON_INSTALLED): setup $(DEPS)/python/ready $(PYTHON_HOME)
	rm -rf target/wheels-dev
	$(MATURIN) --profile dev --out target/wheels-dev
	$(PYTHON) -m pip install --quiet --no-deps --force-reinstall target/wheels-dev/*.whl
	touch $@

# Data files of the package, read at run time.
$(PYTHON_HOME): FORCE
	python3 python/backend.py

FORCE:

dist: setup $(MUJOCO_LICENCES) ## Archive of program, library, shipped files and licences, target/dist
	cargo build --release --locked
	rm -rf target/dist && mkdir -p target/dist/$(DIST)/licences
	cp $(PALPATE) $(DEPS)/lib/libmujoco.so.$(MUJOCO) README.md CHANGELOG.md CITATION.cff target/dist/$(DIST)
	cp -r docs models scenes experiments target/dist/$(DIST)
	cp LICENSE-* target/dist/$(DIST)/licences
	cp -r $(MUJOCO_LICENCES) target/dist/$(DIST)/licences/mujoco
	python3 .cargo/licences.py > target/dist/$(DIST)/licences/packages.txt
	tar -C target/dist -czf target/dist/$(DIST).tar.gz $(DIST)

# A wheel for all Linux distributions with glibc 2.28 or later, the source distribution, the archive, the crates.
# TAG, if given, must be the version.
RELEASE := target/release-files

release: dist $(DEPS)/python/ready $(PYTHON_HOME) ## Files of a release, checked, target/release-files
	cargo test --locked --features $(FEATURES) -p palpate --test suite release::
	@test -z "$(TAG)" || test "$(TAG)" = "v$(VERSION)" || { echo "tag $(TAG): allowed is v$(VERSION)" >&2; exit 2; }
	rm -rf $(RELEASE) && mkdir -p $(RELEASE)
	$(PYTHON) -m pip install --quiet --only-binary=:all: -r python/release.txt
	$(MATURIN) --release --zig --compatibility manylinux_2_28 --out $(RELEASE)
	$(PYTHON) -m auditwheel show $(RELEASE)/*.whl | tee /dev/stderr | grep -q '"manylinux_2_28_x86_64"'
	$(PYTHON) -m maturin sdist --out $(RELEASE)
	$(PYTHON) tests/wheel.py $(RELEASE)
	rm -rf target/from-sdist && $(PYTHON) -m pip wheel --quiet --no-deps --wheel-dir target/from-sdist $(RELEASE)/palpate-*.tar.gz
	$(PYTHON) tests/wheel.py target/from-sdist
	cargo publish --workspace --locked --dry-run
	cp target/dist/$(DIST).tar.gz $(RELEASE)

clean: ## Removes target, .deps and runs
	rm -rf target $(DEPS) runs
