# TEST full memory program seconds=180 needs=flesh
# test_foreign_results.sh: whatever is in a folder of results that somebody else made, commands read and write nothing
# outside of it, do not hang and do not crash. FLESH names the program.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
export PYTHONPATH="$source_folder/shared" PYTHONDONTWRITEBYTECODE=1

"$flesh" mesh box --cells 2,1,1 --size 2,1,1 --out bar.msh >/dev/null || exit 1
cat >bar.yaml <<'END'
body:
  mesh: bar.msh
  material: {energy: S, constants: matched, young: 1e5, poisson: 0.45}
effects:
  - inertia: {}
  - gravity: {}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
time: {step: 1/60, end: 1/20}
output: {probes: [{name: tip, point: [2, 0.5, 0.5], quantities: [position]}]}
END
"$flesh" run bar.yaml --out whole --quiet || exit 1

# Words of a result.json, which may have any length, are cut.
long_words_of_results_are_cut() {
  cp -r whole wordy || return 1
  for length in 100 650 1700 100000; do
    python3 - "$length" <<'END' || return 1
import json, sys
words = "é" + int(sys.argv[1]) * "€"
result = json.load(open("whole/result.json"))
result.update(status=words, message=words, warning=words, notes=words)
result["materials"] = [{"energy": words}]
json.dump(result, open("wordy/result.json", "w"))
END
    expect 0 "$flesh" report wordy --out wordy.html || { echo "words of $length letters"; return 1; }
    python3 - <<'END' || return 1
from report_file import Report
verdict = Report("wordy.html").json["parts"][0]["verdict"]
assert verdict[0].startswith("wordy is é€€€") and "no tet was inverted" in verdict[0], verdict[0][-300:]
END
  done
}

# A folder of results may be a link itself; links within it are not followed.
echo 'a secret,of nobody else' >secret
mkdir elsewhere

# refused TEXT COMMAND...: the command ends with 3 and one sentence that has the text, and prints nothing of the secret.
refused() {
  text=$1
  shift
  expect 3 timeout 1800 "$@" && has stderr.txt "$text" && [ "$(lines stderr.txt)" -eq 1 ] || { cat stderr.txt; return 1; }
  ! grep -q 'a secret' stdout.txt stderr.txt
}

links_are_not_followed_when_results_are_read() {
  ln -s whole alias && expect 0 "$flesh" report alias --out alias.html || return 1
  for name in history.csv probes.csv result.json scene.yaml; do
    cp -r whole linked && ln -sf ../secret "linked/$name" || return 1
    refused "linked/$name: cannot be used: it is a symbolic link" "$flesh" report linked --out out.html || return 1
    rm -r linked
  done
  cp -r whole linked && ln -sf ../secret linked/history.csv || return 1
  refused 'linked/history.csv: cannot be used: it is a symbolic link' "$flesh" plot linked --y t --out out.png || return 1
  rm -r linked && cp -r whole linked && mv linked/frames moved && ln -s ../moved linked/frames || return 1
  for command in snap:png film:mp4 report:html; do
    refused 'linked/frames/frames.pvd: cannot be used: it is a symbolic link, or lies behind one' \
      "$flesh" "${command%:*}" linked --out "out.${command#*:}" || return 1
  done
  [ -z "$(ls -d out* 2>/dev/null)" ]
}

# Names in the tables of a comparison do not lead out of its folder.
names_in_tables_do_not_lead_out() {
  mkdir -p compared/runs hard/cases private || return 1
  cp -r whole private/leak_S_matched_0.45_guarded
  printf '%s\n' 'scene,energy,constants,poisson,solver,element,max_volume_drift,status' \
    '../../private/leak,S,matched,0.45,guarded,tet4,0.1,complete' >compared/drift.csv
  refused "leads out of the folder of results by '..'" "$flesh" report compared --out out.html || return 1
  mkdir private/case && cp -r whole private/case/out && cp bar.msh private/case/body.mesh || return 1
  printf '%s\n' 'case,folder,outcome,newton,cpu_s' 'a,../private/case,not recovered,1,1' >hard/hardcases.csv
  refused "leads out of the folder of results by '..'" "$flesh" report hard --out out.html
}

links_of_comparisons_are_not_followed() {
  mkdir table && ln -s ../secret table/verdict.txt && echo scene >table/drift.csv || return 1
  refused "table/verdict.txt: cannot be used: it is a symbolic link" "$flesh" report table --out out.html || return 1
  rm table/* && ln -s ../secret table/drift.csv || return 1
  refused "table/drift.csv: cannot be used: it is a symbolic link" "$flesh" report table --out out.html || return 1
  printf '%s\n' 'scene: bar.yaml' 'axes: [{key: body.material.young, values: [1e4]}]' >spec.yaml
  expect 0 "$flesh" sweep spec.yaml --out sweep --quiet && mkdir swept && ln -s ../sweep/sweep.db swept || return 1
  cp sweep/sweep.db before.db
  refused 'swept/sweep.db: cannot be used: it is a symbolic link' "$flesh" sweep spec.yaml --out swept --resume || return 1
  refused 'swept/sweep.db: cannot be used: it is a symbolic link' "$flesh" report swept --out out.html || return 1
  cmp before.db sweep/sweep.db
}

runs_write_nothing_behind_links() {
  for name in frames skin; do
    rm -rf target linked && mkdir target linked && touch target/frame_000001.vtu target/skin_000001.obj target/frames.pvd &&
      ln -s ../target "linked/$name" || return 1
    refused "linked/$name: cannot be used: it is a symbolic link" "$flesh" run bar.yaml --out linked --quiet || return 1
    refused "linked/$name: cannot be used" "$flesh" run bar.yaml --out linked --quiet --no-frames || return 1
    [ "$(ls target)" = 'frame_000001.vtu
frames.pvd
skin_000001.obj' ] && [ "$(ls linked)" = "$name" ] || { ls target linked; return 1; }
  done
  for name in history.csv probes.csv result.json scene.yaml state.txt checkpoint.bin; do
    rm -rf linked && mkdir linked && ln -s ../secret "linked/$name" || return 1
    refused "linked/$name: cannot be used: it is a symbolic link" "$flesh" run bar.yaml --out linked --quiet || return 1
    [ "$(cat secret)" = 'a secret,of nobody else' ] && [ "$(ls linked)" = "$name" ] || return 1
  done
}

# Makes the folder of a run that was stopped and has a checkpoint.
stopped() {
  rm -rf stopped
  expect 6 "$flesh" run bar.yaml --out stopped --quiet --checkpoint 1steps --max-seconds 1e-9 && [ -f stopped/checkpoint.bin ]
}

what_is_no_file_is_not_gone_on_with() {
  stopped && expect 0 "$flesh" run --resume stopped --quiet --max-seconds 100 || return 1
  for name in checkpoint.bin history.csv probes.csv scene.yaml result.json; do
    stopped && rm "stopped/$name" && mkfifo "stopped/$name" || return 1
    refused "stopped/$name: not a regular file" "$flesh" run --resume stopped --quiet --max-seconds 100 || return 1
    stopped && cp "stopped/$name" there && cp there before && ln -sf ../there "stopped/$name" || return 1
    refused "stopped/$name: cannot be [a-z]*: it is a symbolic link" "$flesh" run --resume stopped --quiet --max-seconds 100 && cmp there before ||
      return 1
  done
  stopped && mv stopped/frames moved_frames && ln -s ../moved_frames stopped/frames && touch moved_frames/frame_000999.vtu &&
    refused 'stopped/frames: cannot be used: it is a symbolic link' "$flesh" run --resume stopped --quiet --max-seconds 100 &&
    [ -e moved_frames/frame_000999.vtu ]
}

comparisons_write_nothing_behind_links() {
  mkdir drifted hardened kept && ln -s ../elsewhere drifted/runs && ln -s ../elsewhere hardened/cases &&
    ln -s ../elsewhere kept/cases && { cat spec.yaml; echo 'keep: true'; } >kept.yaml || return 1
  "$flesh" drift bar.yaml --energies S --poisson 0.45 --solvers guarded --out drifted --jobs 1
  "$flesh" hardcases --quick --cases single_plane --energies S --poisson 0.45 --out hardened --jobs 1
  "$flesh" sweep kept.yaml --out kept --quiet
  [ -z "$(ls -A elsewhere)" ] || { ls -R elsewhere; return 1; }
}

# A database names the lock files of its workers, which are removed when the workers are gone, but only in its own folder.
locks_of_databases_are_in_their_folder() {
  cp -r sweep locked && touch precious .sweep-1-2.lock && python3 - <<'END' || return 1
import sqlite3
database = sqlite3.connect("locked/sweep.db")
database.execute("UPDATE workers SET lock = '../precious'")
database.execute("INSERT INTO workers (name, host, pid, lock, started, program) VALUES ('x', '', 1, '../.sweep-1-2.lock', '', '')")
database.execute("UPDATE cases SET status = 'running'")
database.commit()
END
  expect 0 "$flesh" sweep spec.yaml --out locked --resume --quiet && [ -e precious ] && [ -e .sweep-1-2.lock ]
}

# Bytes of names and titles that are not UTF-8 are question marks in a page.
names_that_are_no_text_are_shown() {
  odd=$(printf 'f\377ld')
  cp -r whole "$odd" && cp -r "$odd" "$odd-2" && expect 0 "$flesh" report "$odd" "$odd-2" --out odd.html || return 1
  expect 0 "$flesh" report "$odd" --frames 2 --title "$(printf 'a\303b \360\237')" --out "$(printf 'r\377.html')" &&
    mv "$(printf 'r\377.html')" titled.html || return 1
  python3 - <<'END'
from report_file import Report
report = Report("odd.html").json
assert [run["name"] for run in report["view"]["runs"]] == ["f?ld", "f?ld-2"] and "f?ld" in report["parts"][0]["verdict"][1]
titled = Report("titled.html")
assert titled.json["head"]["title"] == "a?b ??" and "<title>a?b ??</title>" in titled.html
assert titled.json["view"]["notes"] == ["Of the 4 frames of f?ld 2 are shown."], titled.json["view"]["notes"]
END
}

# The work is proportional to the rows. The limit is far above that, and far below the hundreds of seconds that all pairs of
# rows would take.
long_tables_are_read_in_one_go() {
  mkdir -p long many && awk 'BEGIN {
    print "scene,energy,constants,poisson,solver,element,max_volume_drift,status"
    for (k = 0; k < 100000; k++) print "s" k % 7 ",S,matched,0.45,guarded,tet4,0.1,complete" >"long/drift.csv"
  }' >head && cat head long/drift.csv >all && mv all long/drift.csv || return 1
  sed 's/^s[0-9]*,/s,/; 20001q' long/drift.csv >many/drift.csv && sed -i '1s/.*/scene,energy,constants,poisson,solver,element,max_volume_drift,status/' many/drift.csv || return 1
  for folder in long many; do
    (ulimit -t 60 && expect 0 "$flesh" report "$folder" --out long.html) || return 1
  done
}

# A database whose view never ends is given up.
views_without_an_end_are_given_up() {
  cp -r sweep endless && python3 - <<'END' || return 1
import sqlite3
database = sqlite3.connect("endless/sweep.db")
database.execute("DROP VIEW results")
database.execute("CREATE VIEW results AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 FROM n) SELECT id, 1 AS young, 'complete' AS status FROM n")
database.commit()
END
  for command in 'report endless --out out.html' ${long:+'report endless/sweep.db --out out.html' 'sweep export endless/sweep.db'} \
    'sweep plot endless/sweep.db --x id --y young --out out.png'; do
    # shellcheck disable=SC2086
    expect 3 timeout 1800 "$flesh" $command && has stderr.txt 'endless/sweep.db: .*one of its views may never end' || return 1
  done
}

# A limit of the stack is raised if that is allowed, else the run is refused: one kernel alone takes 350 kB.
small_stacks_are_enlarged_or_refused() {
  (ulimit -Ss 128 && expect 0 "$flesh" run bar.yaml --out stack --quiet --set solver.threads=2) &&
    cmp stack/state.txt whole/state.txt || return 1
  (ulimit -s 128 && expect 1 "$flesh" run bar.yaml --out never --quiet) &&
    has stderr.txt 'the stack is limited to 128 kB (ulimit -s); it must be at least 1024 kB' && [ ! -e never ]
}

run_tests long_words_of_results_are_cut links_are_not_followed_when_results_are_read names_in_tables_do_not_lead_out \
  links_of_comparisons_are_not_followed runs_write_nothing_behind_links what_is_no_file_is_not_gone_on_with \
  comparisons_write_nothing_behind_links locks_of_databases_are_in_their_folder \
  names_that_are_no_text_are_shown long_tables_are_read_in_one_go views_without_an_end_are_given_up \
  small_stacks_are_enlarged_or_refused
