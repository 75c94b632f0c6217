# test_sweep_killed.sh: nothing of a sweep is lost when it is killed, shared, stopped, or out of disk.
set -u
. "$(dirname -- "$0")/command.sh"
. "$source_folder/sweep.sh"
sed 's|time.end: 1/2|time.end: 3/2|' bar.yaml >longer.yaml
cat >long.yaml <<END
scene: $data/scenes/twist.yaml
set: {time.end: 1000}
max_seconds: 1.5
axes: [{key: body.material.poisson, values: [0.3, 0.4, 0.45]}]
END

# child PID: waits for a process of it.
child() {
  for _ in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20; do
    found=$(grep -ls "^PPid:[[:space:]]*$1\$" /proc/[0-9]*/status | head -n 1 | tr -dc 0-9)
    [ -n "$found" ] && echo "$found" && return
    sleep 0.1
  done
  return 1
}

# Killed with all its children, twenty times at random: the rows finished before stay as they are.
killed_twenty_times_nothing_is_lost_or_done_again() {
  expect 0 "$flesh" sweep longer.yaml --out longer --jobs 2 || return 1
  amidst=0
  for pause in $(awk -v seed="$$" 'BEGIN { srand(seed); for (k = 0; k < 20; k++) print 0.02 + 0.15 * rand() }'); do
    setsid "$flesh" sweep longer.yaml --out killed --jobs 2 --resume --quiet &
    sweep=$!
    sleep "$pause"
    kill -9 "-$sweep" 2>/dev/null
    wait "$sweep" 2>/dev/null
    if [ -s before ]; then
      # Rows that were there are there still, with the same time of start and the same process.
      ask killed/sweep.db id,started,worker,seconds 'seconds IS NOT NULL' | sort >after
      [ -z "$(comm -23 before after)" ] || { echo 'finished cases have changed:'; diff before after; return 1; }
      mv after before
    elif [ -f killed/sweep.db ]; then
      ask killed/sweep.db id,started,worker,seconds 'seconds IS NOT NULL' 2>/dev/null | sort >before
    fi
    [ -z "$(ask killed/sweep.db id "status = 'running'" 2>/dev/null)" ] || amidst=$((amidst + 1))
  done
  echo "killed amidst cases $amidst times (seed $$)"
  [ "$amidst" -ge 5 ] || return 1
  expect 0 "$flesh" sweep longer.yaml --out killed --jobs 2 --resume && has stdout.txt '^48 cases: 48 complete' || return 1
  figures longer/sweep.db >expected && figures killed/sweep.db >got && diff expected got &&
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

# What one has begun no other begins while it lives.
a_living_process_keeps_its_claim() {
  "$flesh" sweep long.yaml --out living --jobs 1 --quiet &
  one=$!
  child "$one" >/dev/null || return 1
  expect 0 "$flesh" sweep long.yaml --out living --jobs 2 --resume || return 1
  wait "$one" && [ "$(ask living/sweep.db "worker LIKE '%:$one:%'" 'id = 1')" = 1 ] &&
    [ "$(ask living/sweep.db "worker LIKE '%:$one:%'" 'id = 2')" = 0 ] || { ask living/sweep.db id,worker,status; return 1; }
}

hangs_and_crashes_are_rows() {
  "$flesh" sweep long.yaml --out hung --jobs 1 --quiet &
  sweep=$!
  kill -STOP "$(child "$sweep")" || return 1
  sleep 3.6 # the budget and what is given to stop; then the next case runs
  for _ in 1 2 3 4 5 6 7 8 9 10; do
    [ "$(ask hung/sweep.db status 'id = 2')" = running ] && break
    sleep 0.2
  done
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

# Files that may not grow stand for a full disk.
a_full_disk_stops_it_and_resume_goes_on() {
  undisturbed || return 1
  (ulimit -f 150; "$flesh" sweep bar.yaml --out full --quiet) 2>stderr.txt
  code=$?
  [ "$code" -eq 3 ] || { echo "ended with $code"; cat stderr.txt; return 1; }
  has stderr.txt 'full/sweep.db' && expect 0 "$flesh" sweep bar.yaml --out full --resume &&
    figures whole/sweep.db >expected && figures full/sweep.db >got && diff expected got
}

run_tests killed_twenty_times_nothing_is_lost_or_done_again two_processes_share_the_work \
  a_living_process_keeps_its_claim hangs_and_crashes_are_rows a_signal_stops_it_and_resume_goes_on \
  a_full_disk_stops_it_and_resume_goes_on
