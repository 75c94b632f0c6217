#!/bin/sh
# slurm.sh: runs the shards of a sweep as an array of SLURM jobs. A requeued job resumes.
#
#   sbatch data/sweeps/slurm.sh SPEC OUT
# drivers/tutorials/03-sweep.md has the merge, a job that begins when all these jobs have ended.
#
#SBATCH --job-name=flesh-sweep
#SBATCH --array=1-32
#SBATCH --cpus-per-task=1
#SBATCH --time=04:00:00
#SBATCH --requeue
set -eu
exec "${FLESH:-flesh}" sweep "$1" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" \
  --out "$2/shard$SLURM_ARRAY_TASK_ID" --jobs "${SLURM_CPUS_PER_TASK:-1}" --resume --quiet
