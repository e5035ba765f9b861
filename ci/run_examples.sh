#!/usr/bin/env bash
# Runs every job of examples/ as a user would, by the command that examples/expected.tsv names (else `run`), and compares its exit code with
# the one stated there.
# Usage: ci/run_examples.sh OUTPUT_FOLDER
set -uo pipefail
cd "$(dirname "$0")/.."
out=$1
rm -rf "$out" && mkdir -p "$out"
wrong=0 run=0
while IFS=$'\t' read -r job expected command; do
  case "$job" in ''|'#'*) continue ;; esac
  name=$(basename "$(dirname "$job")")
  start=$SECONDS
  target/release/meltpath "${command:-run}" "examples/$job" --out "$out/$name" >"$out/$name.log" 2>&1
  code=$?
  printf '%-28s exit %s, expected %s, %s s\n' "$name" "$code" "$expected" $((SECONDS - start))
  [ "$code" = "$expected" ] || { wrong=1; tail -n 20 "$out/$name.log"; }
  run=$((run + 1))
done <examples/expected.tsv
jobs=$(find examples -name job.toml -o -name tune.toml | wc -l)
[ "$run" = "$jobs" ] || { echo "examples/ holds $jobs jobs, examples/expected.tsv lists $run"; wrong=1; }
exit $wrong
