#!/usr/bin/env bash
# Runs the toy in eight shards by GNU parallel and by Slurm, and compares the rows with those of one process, byte
# by byte. One Slurm task is killed and submitted again. What is not installed is skipped, and an error if
# PALPATE_REQUIRE is 1. Usage: test.sh PALPATE, from the project's folder.
set -eu
export PALPATE=$1
has_parallel() { command -v parallel >/dev/null; }
has_slurm() { [ "$(command -v sbatch slurmd munged | wc -l)" = 3 ] && unshare --net true 2>/dev/null; }
skip() {
    echo "$1: skipped, $2" >&2
    [ "${PALPATE_REQUIRE:-}" != 1 ]
}
has_parallel || skip "GNU parallel" "not installed; use make tools"
has_slurm || skip Slurm "not installed, or not root; use make tools"
has_parallel || has_slurm || exit 0

scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT
export OUT=$scratch EXPERIMENT=$scratch/toy.toml

# 24 trials, so that a task runs long enough to be killed.
"$PALPATE" --quiet run toy --shard 1/1 --out "$scratch/toy" --set trials=1 >/dev/null
sed 's/^trials = .*/trials = 24/' "$scratch/toy/resolved.toml" >"$EXPERIMENT"
"$PALPATE" --quiet run "$EXPERIMENT" --no-report --out "$OUT/whole" >/dev/null

# Compares the rows of the run in folder $1 with those of one process.
same() {
    cmp "$OUT/whole/trials.jsonl" "$1/trials.jsonl"
    echo "$2: rows identical to those of one process"
}

if has_parallel; then
    parallel "$PALPATE" --quiet run "$EXPERIMENT" --shard {}/8 --threads 1 --out "$OUT/{}" ::: $(seq 8) >/dev/null
    "$PALPATE" report "$OUT/by-parallel" --merge $(seq -f "$OUT/%g" 8) >/dev/null
    same "$OUT/by-parallel" "GNU parallel"
fi

by_slurm() {
    submit=(experiments/slurm/submit.sh "$EXPERIMENT" 8 "$OUT/by-slurm")
    "${submit[@]}" >/dev/null 2>"$OUT/lost.txt" &
    submitted=$!
    # Kills the first unfinished task that has written a row.
    for _ in $(seq 2000); do
        for part in "$OUT"/by-slurm-*-of-8; do
            rows=$(cat "$part/trials.jsonl" 2>/dev/null | wc -l)
            if [ "$rows" -gt 0 ] && pkill -KILL -f -- "--out $part "; then break 2; fi
        done
        sleep 0.01
    done
    killed=$(wc -l <"$part/trials.jsonl")
    if wait "$submitted"; then
        echo "Slurm: submit.sh returned 0 although a task was killed" >&2
        return 1
    fi
    grep -q "not merged" "$OUT/lost.txt"
    "${submit[@]}" >/dev/null
    echo "Slurm: a task was killed after $killed rows and submitted again"
    same "$OUT/by-slurm" Slurm
}
export -f by_slurm same

if has_slurm; then
    unshare --net bash tests/clusters/slurm.sh "$OUT/slurm" bash -euc by_slurm
fi
