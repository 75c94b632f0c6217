#!/bin/sh
# parallel.sh: runs the shards of a sweep by GNU parallel and joins them into one database.
#
#   sh data/sweeps/parallel.sh SPEC OUT SHARDS [arguments of parallel, such as --jobs 4 or --sshloginfile HOSTS]
#
# FLESH names the program (default: flesh). Started again after it was killed, it resumes. With hosts, OUT must be a
# folder that all of them see; each shard's database is written by one host alone.
set -eu
flesh=${FLESH:-flesh}
spec=$1
out=$2
shards=$3
shift 3
mkdir -p "$out"
seq "$shards" | parallel "$@" -q "$flesh" sweep "$spec" --shard "{}/$shards" --out "$out/shard{}" --jobs 1 --resume \
  --quiet
rm -f "$out/sweep.db"
"$flesh" sweep merge "$out/sweep.db" "$out"/shard*/sweep.db
