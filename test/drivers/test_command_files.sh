# TEST full memory program seconds=120 needs=flesh
# test_command_files.sh: a folder of results has one process at a time, no input is overwritten, pipes are not waited for,
# and killed processes leave nothing behind. FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

"$flesh" mesh box --cells 4,1,1 --size 4,1,1 --out bar.msh >/dev/null || exit 1
"$flesh" mesh surface bar.msh skin.obj >/dev/null || exit 1
cat >bar.yaml <<'END'
body:
  mesh: bar.msh
  material: {energy: S, constants: matched, young: 1e5, poisson: 0.45}
effects: [{inertia: {}}, {gravity: {}}, {pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}}]
time: {step: 1/60, end: 1/30}
END
cat >spec.yaml <<'END'
scene: bar.yaml
axes: [{key: body.material.poisson, name: nu, values: [0.3, 0.4]}]
END
cp bar.yaml precious.yaml
"$flesh" run bar.yaml --out run --quiet || exit 1
"$flesh" sweep spec.yaml --out sweep --quiet || exit 1
"$flesh" skin bind bar.msh skin.obj --out binding.txt >/dev/null || exit 1

# refused CODE WORDS COMMAND...: the command ends with CODE and one sentence that has WORDS.
refused() {
  refusal=$1 words=$2
  shift 2
  expect "$refusal" timeout -k 1 1800 "$@" && has stderr.txt "$words" && [ "$(lines stderr.txt)" -eq 1 ]
}

# ---- one process for each folder ----

two_runs_do_not_share_a_folder() {
  "$flesh" run bar.yaml --out shared --set time.end=1e5 --set output.frame_interval=1000 --quiet &
  run=$!
  wait_until "$run" [ -s shared/history.csv ] || return 1
  refused 3 'shared: another process writes its results there (flesh run, process' "$flesh" run precious.yaml --out shared
  bad=$?
  has stderr.txt "process $run on" || bad=1
  # The folder is refused by another name, too.
  ln -s shared link
  refused 3 'link: another process' "$flesh" run precious.yaml --out link || bad=1
  kill -KILL "$run"
  wait "$run" 2>/dev/null
  [ "$bad" -eq 0 ] && has shared/result.json running || return 1
  # A killed run does not block its folder, and a run that ends leaves no lock.
  [ -e shared/.flesh.lock ] && expect 0 "$flesh" run bar.yaml --out shared --quiet && [ ! -e shared/.flesh.lock ]
}

every_command_claims_its_folder() {
  mkdir -p taken && : >taken/.flesh.lock
  (exec 9>taken/.flesh.lock && flock -n 9 || exit 1
    refused 3 'taken: another process' "$flesh" run bar.yaml --out taken &&
      refused 3 'taken: another process' "$flesh" drift bar.yaml --out taken &&
      refused 3 'taken: another process' "$flesh" accuracy bar.yaml --out taken &&
      refused 3 'taken: another process' "$flesh" hardcases --cases 'twist*' --out taken &&
      refused 3 'taken: another process' "$flesh" bench --out taken &&
      refused 3 'taken: another process' "$flesh" material --out taken &&
      refused 3 'taken: another process' "$flesh" skin apply binding.txt skin.obj run --out taken &&
      refused 3 'taken: another process' "$flesh" film run --out taken) || return 1
  [ "$(ls -A taken)" = .flesh.lock ]
}

# A killed case holds its folder until its process has ended: a sweep waits for that, but not for another process.
a_sweep_waits_for_what_was_killed() {
  sed 's/^scene/keep: true\nscene/' spec.yaml >kept.yaml
  mkdir -p awaited/cases/000001 awaited/cases/000002
  (exec 9>awaited/cases/000001/.flesh.lock && flock 9 && exec sleep 1.5) &
  wait_until $! [ -e awaited/cases/000001/.flesh.lock ] || return 1
  expect 0 "$flesh" sweep kept.yaml --out awaited --quiet && "$flesh" sweep export awaited/sweep.db \
    --columns status,message >told.csv && [ "$(grep -c '^complete' told.csv)" -eq 2 ] || { cat told.csv; return 1; }
  [ -z "$(find awaited -name '.flesh*')" ] || return 1
  mkdir -p theirs/cases/000001
  (exec 9>theirs/cases/000001/.flesh.lock && flock 9 && exec sleep 30) &
  wait_until $! [ -e theirs/cases/000001/.flesh.lock ] || return 1
  expect 0 "$flesh" sweep kept.yaml --out theirs --quiet
  "$flesh" sweep export theirs/sweep.db --columns status,message >told.csv
  kill $!
  has told.csv '^failed,.*cases/000001: another process writes its results there' && has told.csv '^complete'
}

# ---- nothing that is read is overwritten ----

a_run_keeps_what_it_reads() {
  cp bar.yaml read.yaml && cp bar.msh read.msh
  refused 2 'read.yaml: is read by this command' "$flesh" run read.yaml --out new --save-state read.yaml || return 1
  refused 2 'read.msh: is read by' "$flesh" run bar.yaml --set body.mesh=read.msh --out new --save-state ./read.msh ||
    return 1
  [ ! -e new ] && cmp read.yaml precious.yaml && cmp read.msh bar.msh || return 1
  mkdir -p own && cp bar.yaml own/scene.yaml && cp bar.msh own || return 1
  refused 2 'own/scene.yaml: is read by' "$flesh" run own/scene.yaml --out own || return 1
  ln -s own/scene.yaml alias.yaml
  refused 2 'own/scene.yaml: is read by' "$flesh" run alias.yaml --set body.mesh=bar.msh --out own || return 1
  cmp own/scene.yaml precious.yaml && [ "$(ls -A own)" = 'bar.msh
scene.yaml' ]
}

a_run_keeps_what_others_wrote() {
  for name in scene.yaml history.csv state.txt result.json; do
    mkdir -p "own-$name" && echo 'by hand' >"own-$name/$name" || return 1
    refused 3 "own-$name/$name: no run has written this file" "$flesh" run bar.yaml --out "own-$name" || return 1
    [ "$(cat "own-$name/$name")" = 'by hand' ] && [ "$(ls -A "own-$name")" = "$name" ] || return 1
  done
  refused 2 'which the run writes itself' "$flesh" run bar.yaml --out run2 --save-state run2/result.json 2>/dev/null ||
    { mkdir run2 && refused 2 'which the run writes itself' "$flesh" run bar.yaml --out run2 --save-state run2/result.json; }
}

a_start_is_not_lost() {
  cp run/state.txt before.txt
  refused 2 'run/state.txt: is read by' "$flesh" run bar.yaml --start-state run/state.txt --set time.end=1/20 --out run ||
    return 1
  cmp run/state.txt before.txt || return 1
  mkdir -p skinned/skin && cp skin.obj skinned/skin/skin_000007.obj
  refused 2 'skinned/skin: a file in it is read by' "$flesh" run bar.yaml --out skinned \
    --set output.skin.surface=skinned/skin/skin_000007.obj && cmp skin.obj skinned/skin/skin_000007.obj
}

other_commands_keep_what_they_read() {
  mkdir -p mine && cp bar.msh mine && cp bar.yaml mine/scene.yaml && cp bar.yaml mine/accuracy.csv &&
    cp bar.yaml mine/drift.csv || return 1
  refused 2 'mine/accuracy.csv: is read by' "$flesh" accuracy mine/accuracy.csv --out mine || return 1
  refused 2 'mine/drift.csv: is read by' "$flesh" drift mine/drift.csv --out mine || return 1
  # The scene itself is not overwritten with the resolved one.
  expect 0 timeout 1800 "$flesh" accuracy mine/scene.yaml --out mine --quick --methods newmark --steps 1/60,1/120 \
    --reference-seconds 0.01 || return 1
  cmp mine/scene.yaml precious.yaml || return 1
  "$flesh" mesh convert bar.msh t.node >/dev/null || return 1
  refused 2 'bar.msh: is read by' "$flesh" mesh convert bar.msh bar.msh || return 1
  refused 2 't.ele: is read by' "$flesh" mesh convert t.node t.ele || return 1
  cp bar.msh odd.obj
  refused 2 'odd.obj: is read by' "$flesh" mesh surface odd.obj odd.obj || return 1
  refused 2 'skin.obj: is read by' "$flesh" skin bind bar.msh skin.obj --out skin.obj || return 1
  mkdir -p applied && cp skin.obj applied/skin_000000.obj || return 1
  refused 2 'applied/skin_000000.obj: is read' "$flesh" skin apply binding.txt applied/skin_000000.obj run --out applied ||
    return 1
  cp bar.yaml odd.png
  refused 2 'odd.png: is read by' "$flesh" snap odd.png --out odd.png || return 1
  refused 2 'sweep.db: is read by' "$flesh" sweep export sweep/sweep.db --out sweep/sweep.db || return 1
  cp sweep/sweep.db sweep/odd.dat
  refused 2 'odd.dat: is read by' "$flesh" sweep plot sweep/odd.dat --x nu --y newton --out sweep/odd.png || return 1
}

# ---- killed processes leave nothing behind ----

leftovers_are_cleared() {
  mkdir -p left/frames left/skin
  for file in scene.yaml.part-999999-0 state.txt.part-12-3 frames/frame_000001.vtu.part-999999-7 \
    skin/skin.pc2.part-4-4 .picture.part-99999999.png; do
    echo half >"left/$file"
  done
  # Files that stay: of a living writer, known by its lock or its number, and files that only look like leftovers.
  for file in living.part-999999-1 living.part-$$.png own.part own.part-x-1 .part-1-1; do echo kept >"left/$file"; done
  exec 9>>left/living.part-999999-1 && flock -n 9 || return 1
  expect 0 "$flesh" run bar.yaml --out left --quiet
  bad=$?
  exec 9>&-
  [ "$bad" -eq 0 ] && [ "$(find left -name '*part*' | LC_ALL=C sort | tr '\n' ' ')" = \
    "left/.part-1-1 left/living.part-$$.png left/living.part-999999-1 left/own.part left/own.part-x-1 " ] ||
    { find left -name '*part*'; return 1; }
  # A command that writes a single file clears only leftovers of this file's name.
  echo half >box.msh.part-999999-0 && echo half >other.msh.part-999999-0 &&
    "$flesh" mesh box --cells 1,1,1 --size 1,1,1 --out box.msh >/dev/null && [ ! -e box.msh.part-999999-0 ] &&
    [ -e other.msh.part-999999-0 ] && rm other.msh.part-999999-0
}

# Runs are killed until one leaves something behind; the next run clears it.
killed_runs_leave_nothing() {
  "$flesh" mesh box --cells 16,6,6 --size 4,1,1 --out large.msh >/dev/null
  for tries in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20; do
    "$flesh" run bar.yaml --out killed --set body.mesh=large.msh --set time.end=1e5 --quiet &
    run=$!
    wait_until "$run" [ -e killed/frames/frame_000001.vtu ] || return 1
    sleep "0.0$((tries % 10))"
    kill -KILL "$run"
    wait "$run" 2>/dev/null
    find killed -name '*.part*' | grep . && break
  done
  echo "killed $tries times"
  expect 0 "$flesh" run bar.yaml --out killed --quiet && ! find killed -name '*.part*' -o -name '.flesh*' | grep . &&
    has killed/result.json '"status": "complete"'
}

# A command that a signal ends while it draws leaves no file that it had begun, and ends the program that it called.
signals_leave_nothing_half_written() {
  mkdir -p tools
  printf '#!/bin/sh\necho $$ >"%s/gnuplot.pid"\nexec sleep 1800\n' "$work" >tools/gnuplot && chmod +x tools/gnuplot
  for number in TERM HUP; do
    rm -f gnuplot.pid
    ended=0
    until [ "$ended" -gt 128 ]; do # the status is 0 if the picture was complete before the signal
      rm -f snap.*
      env --default-signal=HUP "$flesh" snap run --out snap.png --width 8192 >/dev/null & # nohup ignores HUP
      drawing=$!
      wait_until "$drawing" sh -c 'ls snap.png.part-*' >/dev/null && kill "-$number" "$drawing"
      wait "$drawing" 2>/dev/null
      ended=$?
      [ "$ended" -eq 0 ] || [ "$ended" -gt 128 ] || return 1
    done
    ! ls snap.png* 2>/dev/null || return 1
    PATH=$work/tools:$PATH env --default-signal=HUP "$flesh" material --energies S --out killed_material >/dev/null &
    drawing=$!
    wait_until "$drawing" [ -s gnuplot.pid ] && kill "-$number" "$drawing"
    wait "$drawing" 2>/dev/null
    ! find killed_material -name '*.part-*-*' | grep . || return 1
    while kill -0 "$(cat gnuplot.pid)" 2>/dev/null; do sleep 0.05; done
  done
}

# Closed standard streams become /dev/null: else the next file that is opened would get the number, and the output, of one.
closed_streams_stay_closed() {
  "$flesh" run bar.yaml --out shut --set time.end=1e5 --set output.frame_interval=1000 <&- >&- 2>&- &
  run=$!
  wait_until "$run" [ -s shut/history.csv ] || return 1
  streams=$(readlink "/proc/$run/fd/0" "/proc/$run/fd/1" "/proc/$run/fd/2" | tr '\n' ' ')
  kill "$run"
  wait "$run" 2>/dev/null
  [ "$streams" = '/dev/null /dev/null /dev/null ' ] || { echo "$streams"; return 1; }
}

# ---- pipes, devices and folders are refused, not waited for ----

pipes_are_refused() {
  mkfifo pipe pipe.db pipe.yaml pipe.png || return 1
  refused 3 'pipe.yaml: not a regular file' "$flesh" run pipe.yaml &&
    refused 3 'pipe: not a regular file' "$flesh" run bar.yaml --set body.mesh=pipe &&
    refused 3 'pipe: not a regular file' "$flesh" run bar.yaml --set output.skin.surface=pipe &&
    refused 3 'pipe: not a regular file' "$flesh" check bar.yaml --set output.skin.surface=pipe &&
    refused 3 'pipe: not a regular file' "$flesh" run bar.yaml --start-state pipe &&
    refused 3 'pipe: not a regular file' "$flesh" mesh info pipe &&
    refused 3 'pipe: not a regular file' "$flesh" mesh convert pipe made.msh &&
    refused 3 'pipe: not a regular file' "$flesh" mesh surface pipe made.obj &&
    refused 3 'pipe: not a regular file' "$flesh" skin bind bar.msh pipe --out made.txt &&
    refused 3 'pipe: not a regular file' "$flesh" skin apply pipe skin.obj run --out made &&
    refused 3 'pipe: not a regular file' "$flesh" skin apply binding.txt skin.obj pipe --mesh bar.msh --out other &&
    refused 3 'pipe: not a regular file' "$flesh" snap run --surface pipe --out made.png &&
    refused 3 'pipe.yaml: not a regular file' "$flesh" snap pipe.yaml --out made.png &&
    refused 3 'pipe.yaml: not a regular file' "$flesh" sweep pipe.yaml --out made &&
    refused 3 'pipe.db: not a regular file' "$flesh" sweep export pipe.db &&
    refused 3 'pipe.db: not a regular file' "$flesh" sweep plot pipe.db --x nu --y newton &&
    refused 3 'pipe.db: not a regular file' "$flesh" sweep merge made.db pipe.db &&
    refused 3 'pipe.db: not a regular file' "$flesh" sweep merge made.db sweep/sweep.db pipe.db || return 1
  # A pipe for results is refused if nobody reads it.
  refused 3 'pipe: cannot be written: .*nobody reads this pipe' "$flesh" run bar.yaml --out new --save-state pipe &&
    refused 3 'nobody reads this pipe' "$flesh" snap run --out pipe.png || return 1
  mkdir -p piped && mkfifo piped/sweep.db piped/accuracy.db || return 1
  refused 3 'piped/sweep.db: not a regular file' "$flesh" sweep spec.yaml --out piped --resume &&
    refused 3 'accuracy.db: not a regular file' "$flesh" accuracy bar.yaml --out piped --resume || return 1
  ! find . -name 'made*' | grep .
}

devices_and_folders_are_refused() {
  for bad in /dev/zero run; do
    refused 3 "$bad: \(is a\|not a\)" "$flesh" run "$bad" &&
      refused 3 'not a regular file' "$flesh" run bar.yaml --set "body.mesh=$bad" &&
      refused 3 'not a regular file' "$flesh" run bar.yaml --set "output.skin.surface=$bad" &&
      refused 3 'not a regular file' "$flesh" run bar.yaml --start-state "$bad" &&
      refused 3 'not a regular file' "$flesh" sweep "$bad" --out made &&
      refused 3 'not a regular file' "$flesh" sweep export "$bad" &&
      refused 3 'not a regular file' "$flesh" skin apply "$bad" skin.obj run --out made || return 1
  done
  refused 3 'not a regular file but a directory' "$flesh" mesh info run
}

# ---- many jobs, and cases that are all refused ----

more_jobs_than_files_can_be_open() {
  cat >many.yaml <<'END'
scene: bar.yaml
axes: [{key: body.material.poisson, name: nu, from: 0.1, to: 0.4, count: 50}]
END
  # The limit of open files is raised if that is allowed; else fewer jobs run at a time.
  (ulimit -Sn 40 && expect 0 timeout -k 1 1800 "$flesh" sweep many.yaml --out soft --jobs 1000000 --quiet) || return 1
  (ulimit -n 40 && expect 0 timeout -k 1 1800 "$flesh" sweep many.yaml --out hard --jobs 1000000 --quiet) || return 1
  (ulimit -n 90 && expect 0 timeout -k 1 1800 "$flesh" sweep many.yaml --out some --jobs 1000000 --quiet) || return 1
  (ulimit -n 40 && expect 0 timeout -k 1 1800 "$flesh" drift bar.yaml --out few --jobs 1000000 --energies B,S \
    --poisson 0.3,0.4 --solvers guarded) || return 1
  for out in soft hard some; do
    "$flesh" sweep export $out/sweep.db --columns "status, count(*) AS n" >counted.csv && has counted.csv 'complete,50' ||
      return 1
  done
  (ulimit -n 40 && expect 0 timeout -k 1 1800 "$flesh" hardcases --quick --out battery --jobs 1000000 --cases jitter20 \
    --energies S --poisson 0.45)
}

all_refused_is_an_error() {
  echo '{scene: bar.yaml, set: {body.mesh: missing.msh}, axes: [{key: time.end, values: [1, 2, 3]}]}' >bad_all.yaml
  refused 3 'all 3 cases are refused; the first: .*missing.msh' "$flesh" sweep bad_all.yaml --out bad_all --quiet ||
    return 1
  [ ! -e bad_all ] || return 1 # so that the sweep can begin anew once the mesh is there
  echo '{scene: bar.yaml, axes: [{key: body.mesh, values: [missing.msh, bar.msh]}]}' >bad_half.yaml
  expect 0 "$flesh" sweep bad_half.yaml --out bad_half --quiet || return 1
  "$flesh" sweep export bad_half/sweep.db --columns "status" >counted.csv && has counted.csv refused &&
    has counted.csv complete || return 1
  # Cases that are refused only when they run, as their mesh is gone by then, are an error, too.
  cp bar.msh going.msh
  echo '{scene: bar.yaml, set: {body.mesh: going.msh}, axes: [{key: time.end, values: [1/60, 1/30]}]}' >going.yaml
  expect 0 "$flesh" sweep going.yaml --out going --quiet || return 1
  sqlite3 going/sweep.db "UPDATE cases SET status = 'planned'" || return 1
  rm going.msh
  refused 2 'all 2 cases are refused; the first: .*going.msh' "$flesh" sweep going.yaml --out going --quiet --resume
}

run_tests two_runs_do_not_share_a_folder every_command_claims_its_folder \
  a_sweep_waits_for_what_was_killed a_run_keeps_what_it_reads \
  a_run_keeps_what_others_wrote a_start_is_not_lost other_commands_keep_what_they_read leftovers_are_cleared \
  killed_runs_leave_nothing signals_leave_nothing_half_written closed_streams_stay_closed pipes_are_refused devices_and_folders_are_refused \
  more_jobs_than_files_can_be_open all_refused_is_an_error
