# TEST full program seconds=300 needs=flesh,stop_at
# test_sweep_killed.sh: nothing of a sweep is lost when it is killed, shared, stopped, or out of disk.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
. "$source_folder/shared/sweep.sh"
. "$source_folder/shared/full_disk.sh"
bar_cases || exit 1
cat >long.yaml <<END
scene: $data/scenes/twist.yaml
set: {time.end: 1000}
max_seconds: 1.5
axes: [{key: body.material.poisson, values: [0.3, 0.4, 0.45]}]
END

# child PID: waits until the process has a child, and prints the number of the first.
child() {
  wait_until "$1" has_child "$1" >&2 && children "$1" | head -n 1
}
children() { grep -ls "^PPid:[[:space:]]*$1\$" /proc/[0-9]*/status | tr -dc '0-9\n'; }
has_child() { [ -n "$(children "$1")" ]; }

# A sweep is killed with all its children at twenty random times: rows that were complete stay as they are. Pauses grow until
# they are longer than the start of a sweep on this machine.
killed_twenty_times_nothing_is_lost_or_done_again() {
  undisturbed || return 1
  amidst=0
  scale=1
  for pause in $(awk -v seed="$$" 'BEGIN { srand(seed); for (k = 0; k < 20; k++) print 0.02 + 0.15 * rand() }'); do
    setsid "$flesh" sweep bar.yaml --out killed --jobs 2 --resume --quiet &
    sweep=$!
    sleep "$(awk "BEGIN { print $scale * $pause }")"
    kill -9 "-$sweep" 2>/dev/null
    wait "$sweep" 2>/dev/null
    if [ -s before ]; then
      # Complete rows are still there, with the same time of start and the same process.
      ask killed/sweep.db id,started,worker,seconds 'seconds IS NOT NULL' | sort >after
      [ -z "$(comm -23 before after)" ] || { echo 'finished cases have changed:'; diff before after; return 1; }
      mv after before
    elif [ -f killed/sweep.db ]; then
      ask killed/sweep.db id,started,worker,seconds 'seconds IS NOT NULL' 2>/dev/null | sort >before
    fi
    if [ -n "$(ask killed/sweep.db id "status = 'running'" 2>/dev/null)" ]; then
      amidst=$((amidst + 1))
    elif [ -z "$(ask killed/sweep.db id "status = 'planned'" 2>/dev/null)" ] && [ -s before ]; then
      break # all is done
    else
      scale=$(awk "BEGIN { print 1.5 * $scale }")
    fi
  done
  echo "killed amidst cases $amidst times (seed $$)"
  [ "$amidst" -ge 5 ] || return 1
  expect 0 "$flesh" sweep bar.yaml --out killed --jobs 2 --resume && has stdout.txt '^48 cases: 48 complete' || return 1
  figures whole/sweep.db >expected && figures killed/sweep.db >got && diff expected got &&
    [ "$(find killed -name '.sweep*' | wc -l)" -eq 0 ]
}

two_processes_share_the_work() {
  undisturbed || return 1
  "$flesh" sweep bar.yaml --out shared --jobs 1 --resume --quiet &
  one=$!
  "$flesh" sweep bar.yaml --out shared --jobs 1 --resume --quiet &
  two=$!
  wait "$one" && wait "$two" || return 1
  figures whole/sweep.db >expected && figures shared/sweep.db >got && diff expected got &&
    [ "$(ask shared/sweep.db 'count(DISTINCT worker)')" = 2 ]
}

# A case that a living process has begun is begun by no other.
a_living_process_keeps_its_claim() {
  "$flesh" sweep long.yaml --out living --jobs 1 --quiet &
  one=$!
  child "$one" >/dev/null || return 1
  expect 0 "$flesh" sweep long.yaml --out living --jobs 2 --resume || return 1
  wait "$one" && [ "$(ask living/sweep.db "worker LIKE '%:$one:%'" 'id = 1')" = 1 ] &&
    [ "$(ask living/sweep.db "worker LIKE '%:$one:%'" 'id = 2')" = 0 ] ||
      { ask living/sweep.db id,worker,status; return 1; }
}

second_runs() { [ "$(ask hung/sweep.db status 'id = 2')" = running ]; }
hangs_and_crashes_are_rows() {
  "$flesh" sweep long.yaml --out hung --jobs 1 --quiet &
  sweep=$!
  kill -STOP "$(child "$sweep")" || return 1
  # The next case runs after the budget of the first and the time that it is given to stop.
  wait_until "$sweep" second_runs || return 1
  kill -SEGV "$(child "$sweep")" || return 1
  wait "$sweep" || return 1
  [ "$(ask hung/sweep.db "status, message LIKE 'it did not stop by itself%'" 'id = 1')" = 'out of budget,1' ] &&
    [ "$(ask hung/sweep.db "status, message LIKE '%signal 11%' OR message LIKE '%without a result%'" 'id = 2')" = crashed,1 ] &&
    [ "$(ask hung/sweep.db "status, message LIKE 'the budget of 1.5 s%', t_end > 0" 'id = 3')" = 'out of budget,1,1' ] ||
    { ask hung/sweep.db id,status,message; return 1; }
}

a_signal_stops_it_and_resume_goes_on() {
  undisturbed || return 1
  "$flesh" sweep bar.yaml --out stopped --jobs 1 --quiet 2>stderr.txt &
  sweep=$!
  child "$sweep" >/dev/null
  kill -TERM "$sweep"
  wait "$sweep"
  [ $? -eq 143 ] && has stderr.txt 'resume goes on' && [ -z "$(ask stopped/sweep.db id "status = 'running'")" ] &&
    [ "$(ask stopped/sweep.db id "status = 'planned'" | wc -l)" -gt 0 ] &&
    expect 0 "$flesh" sweep bar.yaml --out stopped --resume && figures whole/sweep.db >expected &&
    figures stopped/sweep.db >got && diff expected got
}

# A signal before a scene is read, when no figure of a run is known yet, costs no column of the results.
a_signal_at_the_start_costs_no_column() {
  undisturbed || return 1
  library=$(preloadable "$STOP_AT") || return 1
  LD_PRELOAD=$library FLESH_STOP_SIGNAL=15 FLESH_STOP_AT=1 "$flesh" sweep bar.yaml --out early --quiet 2>/dev/null
  [ $? -eq 143 ] && [ "$(ask early/sweep.db 'count(*)')" = 48 ] && expect 0 "$flesh" sweep bar.yaml --out early --resume || return 1
  for name in whole early; do "$flesh" sweep export "$name/sweep.db" | sed 1q | tr , '\n' | sort >"$name.columns"; done
  diff whole.columns early.columns && figures whole/sweep.db >expected && figures early/sweep.db >got && diff expected got
}

# A limit of the files' size stands for a full disk.
a_full_disk_stops_it_and_resume_goes_on() {
  undisturbed || return 1
  (ulimit -f 150; "$flesh" sweep bar.yaml --out full --quiet) 2>stderr.txt
  code=$?
  [ "$code" -eq 3 ] || { echo "ended with $code"; cat stderr.txt; return 1; }
  has stderr.txt 'full/sweep.db' && expect 0 "$flesh" sweep bar.yaml --out full --resume &&
    figures whole/sweep.db >expected && figures full/sweep.db >got && diff expected got
}

# A sweep stops on a disk that is really full, and resumes when it has room; left out if this user may not mount a disk.
a_small_disk_stops_it_and_resume_goes_on() {
  undisturbed || return 1
  can_mount || { echo 'no mount for this user'; return 0; }
  cat >on_disk.sh <<'END'
mount -t tmpfs -o size=100k none disk || exit 9
"$1" sweep bar.yaml --out disk/sweep --quiet
code=$?
[ "$code" -eq 3 ] || { echo "ended with $code"; exit 1; }
mount -o remount,size=20m disk || exit 9
"$1" sweep bar.yaml --out disk/sweep --resume --quiet || exit 1
cp disk/sweep/sweep.db small.db
END
  unshare -m sh on_disk.sh "$flesh" 2>stderr.txt || { cat stderr.txt; return 1; }
  has stderr.txt 'full' && figures whole/sweep.db >expected && figures small.db >got && diff expected got
}

# When the power fails, the disk has the database of some moment, and a journal that ends in a part of a record, or rubbish.
# From these, complete cases are still there, and the rest is run.
without_power_nothing_is_lost() {
  undisturbed || return 1
  cuts=0
  for pause in $(awk -v seed="$$" 'BEGIN { srand(seed); for (k = 0; k < 5; k++) print 0.55 * rand() }'); do
    rm -rf live left
    mkdir left
    "$flesh" sweep bar.yaml --out live --jobs 2 --quiet 2>/dev/null &
    sweep=$!
    wait_until "$sweep" [ -f live/sweep.db-wal ] || return 1
    sleep "$pause"
    [ ! -f live/sweep.db ] || ask live/sweep.db id,started 'seconds IS NOT NULL' >before 2>/dev/null || :
    kill -STOP "$sweep"
    cp live/sweep.db left/ && { [ ! -f live/sweep.db-wal ] || cp live/sweep.db-wal left/; }
    kill -CONT "$sweep"
    kill -TERM "$sweep"
    wait "$sweep"
    if [ -f left/sweep.db-wal ]; then
      head -c "$(awk -v seed="$$$cuts" 'BEGIN { srand(seed); print int(9000 * rand()) }')" /dev/urandom >>left/sweep.db-wal
      cuts=$((cuts + 1))
    fi
    ask left/sweep.db id,started 'seconds IS NOT NULL' >after || return 1
    sort before >one && sort after >two
    [ -z "$(comm -23 one two)" ] || { echo 'finished cases are lost:'; diff one two; return 1; }
    expect 0 "$flesh" sweep bar.yaml --out left --resume && figures whole/sweep.db >expected &&
      figures left/sweep.db >got && diff expected got || return 1
  done
  echo "cut $cuts times (seed $$)"
  [ "$cuts" -ge 2 ]
}

run_tests killed_twenty_times_nothing_is_lost_or_done_again two_processes_share_the_work \
  a_living_process_keeps_its_claim hangs_and_crashes_are_rows a_signal_stops_it_and_resume_goes_on \
  a_signal_at_the_start_costs_no_column a_full_disk_stops_it_and_resume_goes_on \
  a_small_disk_stops_it_and_resume_goes_on without_power_nothing_is_lost
