# ranks.sh: what the tests of commands on several ranks share. To be sourced after command.sh; MPIRUN names the launcher.
# shellcheck shell=sh
launcher=${MPIRUN:?MPIRUN must name the launcher of MPI}

# Times before anything is called a hang. Once a rank has ended with an error, Open MPI's launcher would sleep for a second
# twice before it kills what is left of the others, of which nothing is to come: all ranks leave together.
on_ranks() {
  size=$1
  shift
  OMPI_MCA_odls_base_sigkill_timeout=0 timeout 1800 "$launcher" -n "$size" "$@"
}

# begin_on RANKS COMMAND...: in the background as $launched; what its ranks' processes are stands in pid_0, pid_1 ... As a
# signal will find them, the launcher gives them the time that it gives a user's.
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

# Until none of these processes lives; the launcher may be gone before those that it has killed.
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
