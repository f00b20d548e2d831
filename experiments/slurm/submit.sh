#!/usr/bin/env bash
# Runs an experiment as an array of a few large shards, waits, and merges them:
#
#     bash experiments/slurm/submit.sh EXPERIMENT SHARDS [OUT] [SBATCH OPTIONS…]
#     bash experiments/slurm/submit.sh bird 8 runs/bird --partition=long --cpus-per-task=16
#
# PALPATE is the program, by default `palpate`, or target/release/palpate in a checkout. Submit the same line again
# to continue killed tasks; finished shards end at once.
set -euo pipefail
experiment=${1:?experiment}
shards=${2:?number of shards}
out=${3:-runs/$(basename "$experiment" .toml)}
shift $(($# < 3 ? $# : 3))
palpate=${PALPATE:-$(command -v palpate || echo target/release/palpate)}
mkdir -p "$(dirname "$out")"

array=$(sbatch --parsable --array="1-$shards" --job-name=palpate --output="$out-%a.log" "$@" <<EOF
#!/bin/sh
exec "$palpate" --quiet run "$experiment" --shard "\$SLURM_ARRAY_TASK_ID/$shards" \\
    --out "$out-\$SLURM_ARRAY_TASK_ID-of-$shards" --threads "\${SLURM_CPUS_PER_TASK:-1}" --no-report
EOF
)
parts=$(seq -f "$out-%g-of-$shards" 1 "$shards")
sbatch --quiet --wait --dependency="afterok:$array" --kill-on-invalid-dep=yes --job-name=palpate-merge \
    --output="$out-merge.log" "$@" <<EOF || true
#!/bin/sh
exec "$palpate" report "$out" --merge $(echo $parts)
EOF
if [ ! -s "$out/trials.jsonl" ]; then
    echo "$out: not merged, a shard was lost; submit the same line again to continue (details: $out-*.log)" >&2
    exit 1
fi
echo "$out: merged; to draw it: palpate report $out"
