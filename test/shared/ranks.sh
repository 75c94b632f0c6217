# ranks.sh: what the tests of commands on several ranks share. To be sourced after command.sh; MPIRUN names the launcher.
# shellcheck shell=sh
launcher=${MPIRUN:?MPIRUN must name the launcher of MPI}

# Time limits after which a run counts as hung. When a rank ends with an error, Open MPI's launcher sleeps twice for a second
# before it kills the others; these settings make all ranks leave together.
on_ranks() {
  size=$1
  shift
  OMPI_MCA_odls_base_sigkill_timeout=0 timeout 1800 "$launcher" -n "$size" "$@"
}

# begin_on RANKS COMMAND...: starts the command in the background as $launched; the files pid_0, pid_1 ... have its ranks'
# processes. Unlike in on_ranks, the launcher's time for ranks to end after a signal is its default.
begin_on() {
  cat >rank.sh <<'END'
echo $$ >"pid_$OMPI_COMM_WORLD_RANK.part" && mv "pid_$OMPI_COMM_WORLD_RANK.part" "pid_$OMPI_COMM_WORLD_RANK" || exit 1
exec "$@"
END
  rm -f pid_*
  size=$1
  shift
  timeout 1800 "$launcher" -n "$size" sh rank.sh "$@" >stdout.txt 2>stderr.txt &
  launched=$!
}

# Waits until none of these processes lives; the launcher may end before the ranks that it has killed.
wait_for_ends() {
  for process in "$@"; do
    tries=0
    while grep -q '^State:.[^Z]' "/proc/$process/status" 2>/dev/null; do
      tries=$((tries + 1))
      [ "$tries" -lt 36000 ] || { echo "process $process lives on"; return 1; }
      sleep 0.05
    done
  done
}
