# `make demo` and `make test` work on a new machine: they set up, build and run.
# They need cargo, a C compiler, python3 with pip, and make.

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

.PHONY: test-franka test-faults test-clusters install-clusters demo paper paper-dynamic paper-planners test test-code test-arms check-planners check-cost hard-cases test-ros2 page-test test-live test-mcap fuzz reference messages lint lint-features bench contacts strokes detection camera growth speed bench-peers growth-around growth-hypotheses wheel release test-wheel-systems install-python test-python docs notebooks dist setup tools clean

# Features of all tests; one set, so that nothing is built twice.
FEATURES := ros2,franka,pictures

EXAMPLES := $(basename $(notdir $(wildcard examples/*.rs crates/*/examples/*.rs)))

demo: setup
	cargo build --release --locked
	$(PALPATE) run experiments/demo.toml

# Experiments behind docs/paper.md: those of the paper, the same with the soft finger and the arm, and
# other planners beside the paper's.
PLANNERS := $(wildcard experiments/paper/planners-*.toml)
SOFT := $(wildcard experiments/paper/*-finger-*.toml experiments/paper/*-pa10-*.toml)
RIGID := $(filter-out $(SOFT) $(PLANNERS),$(wildcard experiments/paper/*.toml))

paper: setup
	cargo build --release --locked
	$(PALPATE) export scenes/container.toml
	$(PALPATE) export scenes/bird.toml
	for experiment in $(RIGID); do $(PALPATE) run $$experiment || exit; done

paper-dynamic: setup
	cargo build --release --locked
	for experiment in $(SOFT); do $(PALPATE) run $$experiment || exit; done

paper-planners: setup
	cargo build --release --locked
	for experiment in $(PLANNERS); do $(PALPATE) run $$experiment || exit; done

test: test-code test-arms

# Includes ROS 2, to test the topics of an arm without an arm.
test-code: setup
	cargo test --locked --features $(FEATURES)
	for example in $(EXAMPLES); do cargo run --quiet --locked --features $(FEATURES) --example $$example || exit; done
	tests/clusters/test.sh target/debug/palpate

# Simulated arms that move in real time, a part of all of them; they need an idle machine.
test-arms: setup
	$(MAKE) test-faults
	$(MAKE) test-ros2 TOUCHES=3 UR_TOUCHES=2 OVER_TOPICS='lab::a_peer lab::an_arm lab::only_the_named lab::the_container lab::the_loop lab_camera:: lab_ur::a_peer lab_ur::the_container_is_touched_by_a_ur lab_ur_driver::the_ lab_ur_driver::a_ur_touches lab_fr3::the_peer lab_fr3::an_fr3_touches'
	$(MAKE) test-franka FRANKA_TESTS=franka::a_cylinder FRANKA_TOUCHES=2

# Distance that the tip moves after each failure between explorer and arm: the table of docs/safety.md.
# It runs in real time and needs an idle machine.
test-faults: setup
	cargo test --locked -p palpate --features $(FEATURES) --test suite -- --ignored --test-threads 1 --nocapture twin_faults

# Regression test of planners against experiments/baselines; palpate check --accept REASON accepts a change.
CHECKED := toy container bird

# The program of the tests is used, because one without their dependencies' features is another build.
check-planners: setup
	cargo test --quiet --locked --features $(FEATURES) --no-run
	for experiment in $(CHECKED); do \
		target/debug/palpate --quiet check $$experiment --baseline experiments/baselines/$$experiment.jsonl || exit; \
	done

# Compares instruction counts with experiments/baselines/cost.toml; skipped without valgrind.
check-cost: export CARGO_INCREMENTAL := 0
check-cost: export CARGO_PROFILE_DEV_CODEGEN_UNITS := 2
check-cost: setup
	cargo test --quiet --locked --features $(FEATURES) --no-run
	tests/cost.py --program target/debug/palpate

# All hard cases at all severities, periods and time steps, ten minutes of processor time: writes
# docs/hard-cases.md and fails on an unexplained outcome.
hard-cases: setup
	PALPATE_HARD_CASES=1 cargo test --locked -p palpate --test suite hard::all_outcomes

# Shards with GNU parallel and with Slurm on one node; each is skipped if not installed.
test-clusters: setup
	cargo build --locked --features $(FEATURES)
	tests/clusters/test.sh target/debug/palpate

install-clusters:
	apt-get install --yes --no-install-recommends parallel slurm-wlm munge

# An explorer, a simulated robot over ROS 2, and a peer with another implementation, in their own network
# namespace, isolated from the network.
TOUCHES := 20
UR_TOUCHES := 24
UR_ENDS := 20
OVER_TOPICS := lab:: lab_camera:: lab_live:: lab_recognition:: lab_strokes:: lab_faults:: lab_ur:: lab_ur_driver:: lab_fr3:: lab_planning_scene::
NAMESPACE := unshare --map-root-user --net bash tests/ros2/namespace.sh
NO_NAMESPACE := no permission for a network namespace (unshare --map-root-user --net)
LAB_TESTS = cargo test --locked -p palpate --features $(1) --test suite -- --ignored --test-threads 1 $(OVER_TOPICS)

test-ros2: setup $(DEPS)/ros2/bin/python
	@if $(NAMESPACE) true 2>/dev/null; then \
		PALPATE_PEER=$(abspath $(DEPS)/ros2/bin/python) PALPATE_TOUCHES=$(TOUCHES) \
			PALPATE_UR_TOUCHES=$(UR_TOUCHES) PALPATE_UR_ENDS=$(UR_ENDS) $(NAMESPACE) \
			$(call LAB_TESTS,$(FEATURES)); \
	else echo "test-ros2 is skipped: $(NO_NAMESPACE)"; fi

$(DEPS)/ros2/bin/python: tests/ros2/peer.txt
	python3 -m venv $(DEPS)/ros2
	$(DEPS)/ros2/bin/python -m pip install --quiet --only-binary=:all: -r tests/ros2/peer.txt
	touch $@

# A Franka arm against a simulated control box, in their own network namespace.
FRANKA_TOUCHES := 12
FRANKA_TESTS := franka::
test-franka: setup $(DEPS)/franka/bin/python
	@if $(NAMESPACE) true 2>/dev/null; then \
		PALPATE_FRANKA=$(abspath $(DEPS)/franka/bin/python) PALPATE_FRANKA_TOUCHES=$(FRANKA_TOUCHES) \
			PALPATE_FRANKA_ENDS=20 $(NAMESPACE) cargo test --locked -p palpate --features $(FEATURES) \
			--test suite -- --ignored --test-threads 1 $(FRANKA_TESTS); \
	else echo "test-franka is skipped: $(NO_NAMESPACE)"; fi

$(DEPS)/franka/bin/python: tests/franka/box.txt
	python3 -m venv $(DEPS)/franka
	$(DEPS)/franka/bin/python -m pip install --quiet --only-binary=:all: -r tests/franka/box.txt
	touch $@

# Tests the report page in a browser, and the accessibility of report and built site with axe-core; fails without
# Chromium. Accessibility is skipped if axe-core cannot be fetched.
AXE := $(DEPS)/axe/axe_playwright_python/axe.min.js

page-test: setup
	@$(MAKE) --no-print-directory $(AXE) || echo "accessibility is not tested: the package of tests/axe.txt cannot be fetched"
	PALPATE_PAGE_TEST=1 PALPATE_AXE=$(abspath $(AXE)) cargo test --locked -p palpate --test suite -- page accessibility

# Tests the live page in a browser: needs Chromium (Debian: chromium).
LIVE := $(DEPS)/live/bin/python

test-live: setup $(LIVE) $(AXE)
	cargo build --locked --features $(FEATURES)
	$(LIVE) tests/live/page.py target/debug/palpate models/bird.glb --axe $(AXE) --pictures target/test-live

$(LIVE): tests/live/requirements.txt
	python3 -m venv $(DEPS)/live
	$(DEPS)/live/bin/python -m pip install --quiet --only-binary=:all: -r tests/live/requirements.txt
	touch $@

# The package is fetched for the script in it.
$(AXE): tests/axe.txt
	rm -rf $(DEPS)/axe && mkdir -p $(DEPS)/axe
	$(FETCH) -r tests/axe.txt -d $(DEPS)/axe
	cd $(DEPS)/axe && python3 -m zipfile -e axe_playwright_python-*.whl .
	touch $@

# Reads a recording with an independent reader; skipped if the Python packages cannot be fetched.
READER := $(DEPS)/mcap/bin/python
RECORDED := target/test-mcap

test-mcap: setup
	cargo build --release --locked
	$(PALPATE) run container_finger --set trials=1 --set touches=7 --set planners='["active"]' --record --fresh --no-report --out $(RECORDED)
	@if $(MAKE) --no-print-directory $(READER); then $(READER) tests/mcap_reads.py $(RECORDED)/recordings/active-0000.mcap; \
	else echo "test-mcap is skipped: the packages of tests/mcap.txt cannot be fetched"; fi

$(READER): tests/mcap.txt
	python3 -m venv $(DEPS)/mcap
	$(READER) -m pip install --quiet --only-binary=:all: -r tests/mcap.txt
	touch $@

# Fuzz tests: randomly altered files and settings cause errors, but no panic and no hang. Takes about an hour.
FUZZ := 100000

fuzz: setup
	PALPATE_FUZZ=$(FUZZ) cargo test --locked -p palpate --test suite fuzz::
	PALPATE_FUZZ=$(FUZZ) cargo test --locked -p palpate --test suite folders::kills
	PALPATE_FUZZ=$(FUZZ) cargo test --locked -p palpate --test suite recording::

# Generates docs/reference.md from the code; a test checks that it is up to date.
reference: setup
	PALPATE_WRITE_REFERENCE=1 cargo test --locked -p palpate --test suite reference::

# Lists every message of the program in tests/messages.txt.
messages: setup
	PALPATE_WRITE_MESSAGES=1 cargo test --locked -p palpate --test suite prose::

lint: setup
	cargo fmt --all --check
	cargo clippy --locked --all-targets --features $(FEATURES) -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --locked --no-deps --workspace --features $(FEATURES)

# Code with other features, whose packages take long to check.
lint-features: setup
	cargo clippy --locked --lib --bins --no-default-features --features $(FEATURES) -- -D warnings
	cargo clippy --locked --lib --bins --features render,viewer -- -D warnings

bench: setup
	cargo bench --locked --bench limits
	cargo bench --locked --bench kernels
	cargo bench --locked --bench interlocks
	cargo bench --locked --bench plant
	cargo bench --locked --bench dynamic
	cargo bench --locked --bench contact

# Where the processor time of eight works goes, and how near its pieces are to the machine: docs/speed.md.
# It needs perf (Debian: linux-perf) and an idle machine.
PIECES := target/pieces.txt
speed: setup
	cargo build --locked --profile bench
	cargo bench --locked --bench limits > $(PIECES)
	python3 benches/profile.py $(PALPATE) --pieces $(PIECES)

# Error of contacts located by the electrodes.
contacts: setup
	cargo bench --locked --bench contacts

# Error, force and lost contact of strokes at several speeds.
strokes: setup
	cargo bench --locked --bench strokes

# Force at which contact is detected, and rate of false detections.
detection: setup
	cargo bench --locked --bench detection

# Errors of registered views, and how often a wrong view is named.
camera: setup
	cargo bench --locked --bench camera

# Cost over the number of touches; draws docs/growth.svg.
growth: setup
	cargo bench --locked --bench growth

# Cost over the number of touches around a whole object; draws docs/growth-around.svg.
growth-around: setup
	cargo bench --locked --bench around

# Cost over the number of hypotheses; draws docs/growth-hypotheses.svg.
growth-hypotheses: setup
	cargo bench --locked --bench hypotheses

# Compares Palpate with scikit-learn and egobox, in a separate environment.
# BoTorch's packages take 3 GB.
bench-peers: setup $(DEPS)/peers/bin/python
	cargo build --release --locked
	$(DEPS)/peers/bin/python benches/peers.py

$(DEPS)/peers/bin/python: benches/peers.txt
	python3 -m venv $(DEPS)/peers
	$(DEPS)/peers/bin/python -m pip install --quiet --only-binary=:all: -r benches/peers.txt
	touch $@

# Wheel without a Rust dependency: program, extension and shipped files, in target/wheels.
PYTHON := $(DEPS)/python/bin/python
PYTHON_READY := $(DEPS)/python/ready
PYTHON_HOME := python/palpate/home
# The wheel contains MuJoCo's library, which maturin finds by LD_LIBRARY_PATH. It edits the extension that Cargo linked,
# which is therefore linked again each time.
MATURIN = rm -f target/*/deps/lib_palpate.so target/*/*/deps/lib_palpate.so && \
	LD_LIBRARY_PATH=$(abspath $(DEPS)/lib) PATH=$(abspath $(DEPS)/python/bin):$$PATH \
	maturin build --quiet --locked

wheel: setup $(PYTHON_READY) $(PYTHON_HOME)
	$(MATURIN) --release --out target/wheels

# Files of a release, checked: a wheel for all Linux distributions with glibc 2.28 or later, the source distribution,
# the archive, the crates. TAG, if given, must be the version.
RELEASE := target/release-files

release: dist $(PYTHON_READY) $(PYTHON_HOME)
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

# The wheel of a release in bare systems with Python 3.10 to 3.13; needs root and debootstrap.
test-wheel-systems:
	tests/wheel_systems.sh $(RELEASE)

# Installs a development build into the test environment; otherwise equal to the release wheel.
install-python: setup $(PYTHON_READY) $(PYTHON_HOME)
	rm -rf target/wheels-dev
	$(MATURIN) --profile dev --out target/wheels-dev
	$(PYTHON) -m pip install --quiet --no-deps --force-reinstall target/wheels-dev/*.whl

test-python: install-python
	cargo clippy --locked --package palpate-python -- -D warnings
	cd python && $(abspath $(PYTHON)) -m mypy
	cd python/tests && $(abspath $(PYTHON)) -m mypy.stubtest --ignore-disjoint-bases palpate._palpate
	# Runs outside the source folder, so that the installed package is tested.
	cd python/tests && $(abspath $(DEPS)/python/bin/pytest) --numprocesses auto --dist loadfile
	$(PYTHON) tests/wheel.py target/wheels-dev

# Builds the guides and the references of Python and Rust as a site in target/docs-site; a broken link is an error.
# It always rebuilds all pages, because Sphinx does not repeat warnings for unchanged pages.
docs: install-python
	rm -rf target/docs-site
	$(DEPS)/python/bin/sphinx-build --quiet --fail-on-warning --keep-going --fresh-env -c docs -d target/docs-tree . target/docs-site
	RUSTDOCFLAGS="-D warnings" cargo doc --locked --no-deps --workspace --features $(FEATURES)
	cp -r target/doc target/docs-site/rust

# Runs the notebooks and stores their outputs, to be committed.
notebooks: install-python
	$(PYTHON) python/notebooks/run.py

$(PYTHON_READY): python/requirements.txt
	python3 -m venv $(DEPS)/python
	$(PYTHON) -m pip install --quiet --no-compile --only-binary=:all: -r python/requirements.txt
	touch $@

# Data files of the package, read at run time.
$(PYTHON_HOME): FORCE
	python3 python/backend.py

FORCE:

# Archive that runs after unpacking: program, library, shipped files, licences.
dist: setup $(MUJOCO_LICENCES)
	cargo build --release --locked
	rm -rf target/dist && mkdir -p target/dist/$(DIST)/licences
	cp $(PALPATE) $(DEPS)/lib/libmujoco.so.$(MUJOCO) README.md CHANGELOG.md CITATION.cff target/dist/$(DIST)
	cp -r docs models scenes experiments target/dist/$(DIST)
	cp LICENSE-* target/dist/$(DIST)/licences
	cp -r $(MUJOCO_LICENCES) target/dist/$(DIST)/licences/mujoco
	python3 .cargo/licences.py > target/dist/$(DIST)/licences/packages.txt
	tar -C target/dist -czf target/dist/$(DIST).tar.gz $(DIST)

setup: tools $(LIBRARY)

tools:
	@command -v cargo >/dev/null || { echo "cargo is missing: install Rust with rustup" >&2; exit 1; }
	@command -v cc >/dev/null || { echo "a C compiler is missing: install gcc (Debian: apt-get install gcc)" >&2; exit 1; }
	@command -v python3 >/dev/null || { echo "python3 is missing (Debian: apt-get install python3 python3-pip)" >&2; exit 1; }

# Shared library of the physics engine with its licences, from its Python package.
$(LIBRARY) $(MUJOCO_LICENCES) &: .cargo/mujoco.txt | tools
	@python3 -m pip --version >/dev/null || { echo "pip is missing (Debian: apt-get install python3-pip)" >&2; exit 1; }
	rm -rf $(DEPS)/mujoco && mkdir -p $(DEPS)/mujoco $(MUJOCO_LICENCES)
	$(FETCH) $(PLATFORM) -r .cargo/mujoco.txt -d $(DEPS)/mujoco
	cd $(DEPS)/mujoco && python3 -m zipfile -e mujoco-*.whl .
	cp $(DEPS)/mujoco/mujoco/libmujoco.so.$(MUJOCO) $(DEPS)/lib/
	cp $(DEPS)/mujoco/mujoco-*.dist-info/licenses/* $(MUJOCO_LICENCES)
	rm -rf $(DEPS)/mujoco
	ln -sf libmujoco.so.$(MUJOCO) $@

clean:
	rm -rf target $(DEPS) runs
