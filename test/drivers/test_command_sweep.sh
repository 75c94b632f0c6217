# TEST full memory program seconds=180 needs=flesh
# test_command_sweep.sh: `flesh sweep`: its plans, rows and shards, its tables and pictures.
set -u
. "$(dirname -- "$0")/../shared/command.sh"
. "$source_folder/shared/sweep.sh"
bar_spec 1/2 >bar.yaml

a_plan_is_printed_and_nothing_is_done() {
  spec 'repeats: 2' 'axes:' '  - {key: body.material.young, from: 1e4, to: 1e6, count: 3, spacing: logarithmic}' \
    '  - zip:' '    - {key: time.step, values: [1/60, 1/120]}' \
    '    - {key: effects.gravity.acceleration, name: g, values: [[0, 0, -9.81], [0, 0, -1]]}' \
    '  - sample: {count: 4, axes: [{key: body.material.poisson, from: 0.1, to: 0.5}, {key: body.density, values: [1, 2]}]}'
  expect 0 "$flesh" sweep spec.yaml --dry-run --out plan || return 1
  has stdout.txt '^48 cases of flesh run' && has stdout.txt 'young.*3 values: 10000, 100000, 1000000' &&
    has stdout.txt 'with g .*: \[0, 0, -9.81\], \[0, 0, -1\]' &&
      has stdout.txt '^axis poisson .*: 0.3[0-9]*, 0.4, 0.2, ' &&
    has stdout.txt 'density.*: 2, 1, 2, 1$' && [ ! -e plan ] &&
    expect 0 "$flesh" sweep spec.yaml --dry-run --shard 48/48 && has stdout.txt '^1 case of'
}

# A row has the results of `flesh run` with the row's values.
a_row_is_what_a_run_gives() {
  probes='[{name: tip-end, point: [0.2, 0.2, 0.2], quantities: [position, J]}]'
  spec "set: {time.end: 1/30, output.probes: $probes}" 'axes:' '  - {key: body.material.young, values: [2e4, 1e5]}' \
    '  - {key: time.step, values: [1/60, 1/120]}' 'columns:' '  - {name: work, is: newton * tets}' \
    '  - {name: twice, is: 2 * work}' '  - {name: sag, is: 0.2 - tip_end_position_z_min}'
  expect 0 "$flesh" sweep spec.yaml --out rows --jobs 2 && has stdout.txt '^4 cases: 4 complete' || return 1
  [ "$(ask rows/sweep.db young,step,steps 'id = 2')" = 20000,0.008333333333333333,4 ] ||
    { ask rows/sweep.db '*'; return 1; }
  [ "$(ask rows/sweep.db 'twice - 2 * newton * tets' 'id = 2')" = 0 ] || return 1
  expect 0 "$flesh" run tiny.yaml --set time.end=1/30 --set body.material.young=2e4 --set time.step=1/120 --out run \
    --set "output.probes=$probes" || return 1
  python3 - "$(ask rows/sweep.db energy_total,energy_spring,residual,newton 'id = 2')" \
    "$(ask rows/sweep.db tip_end_position_z_final,tip_end_position_z_min,tip_end_J_max,sag 'id = 2')" <<'END'
import csv, json, sys
figures = json.load(open("run/result.json"))["figures"]
row = [float(word) for word in sys.argv[1].split(",")]
run = [figures["energies"]["total"], figures["energies"]["spring"], figures["residual"], figures["newton"]]
assert row == run, (row, run)
assert run[0] != 0
rows = list(csv.DictReader(open("run/probes.csv")))
z = [float(r["tip-end.position_z [m]"]) for r in rows]
of = figures["probes"]["tip-end.position_z"]
assert of == {"unit": "m", "final": z[-1], "min": min(z), "max": max(z)} and min(z) < max(z), (of, z)
J = max(float(r["tip-end.J [1]"]) for r in rows)
row = [float(word) for word in sys.argv[2].split(",")]
assert row == [z[-1], min(z), J, 0.2 - min(z)], (row, z, J)
END
}

# Axes may have names that the database uses itself.
names_of_the_database_are_free() {
  spec 'set: {time.end: 1/60}' 'axes:' '  - {key: body.material.poisson, name: key, values: [0.3]}' \
    '  - {key: body.density, name: lock, values: [900]}' '  - {key: body.name, values: [arm]}'
  expect 0 "$flesh" sweep spec.yaml --out free --quiet && [ "$(ask free/sweep.db 'key, lock, name, newton > 0')" = 0.3,900,arm,1 ] ||
    { ask free/sweep.db '*'; return 1; }
}

failed_cases_are_rows() {
  spec 'set: {body.material.constants: matched, solver.max_newton: 1, solver.max_cutbacks: 0, solver.newton_tolerance: 1e-15}' \
    'axes: [{key: body.material.energy, values: [C, S]}]'
  expect 0 "$flesh" sweep spec.yaml --out failed || return 1
  [ "$(ask failed/sweep.db "status, exit_code, message LIKE '%matched%'" 'id = 1')" = refused,2,1 ] &&
    [ "$(ask failed/sweep.db "status, exit_code, reason LIKE 'FLESH_%', failed_at" 'id = 2')" = failed,4,1,0.016666666666666666 ] ||
    { ask failed/sweep.db '*'; return 1; }
}

# bad SENTENCE LINES...: the spec of these lines is refused with file, line, column and the sentence.
bad() {
  sentence=$1
  shift
  spec "$@"
  expect 2 "$flesh" sweep spec.yaml --out bad && has stderr.txt "spec.yaml:[0-9]*:[0-9]*: .*$sentence" && [ ! -e bad ]
}

bad_specs_are_refused() {
  bad 'body.material.poison is unknown; did you mean poisson' 'axes: [{key: body.material.poison, values: [1]}]' &&
    has stderr.txt 'spec.yaml:2:45:' &&
    bad 'poisson is 0.6; it must be a number in (-1, 0.5]' 'axes: [{key: body.material.poisson, values: [0.1, 0.6]}]' &&
    has stderr.txt 'spec.yaml:2:51:' &&
    bad 'step is -1' 'set: {time.step: -1}' &&
      bad 'vales is unknown; did you mean values' 'axes: [{key: time.step, vales: 1}]' &&
    bad 'either values or from and to' 'axes: [{key: time.step}]' &&
      bad 'count is missing' 'axes: [{key: time.step, from: 1, to: 2}]' &&
    bad 'must be > 0 when spacing' 'axes: [{key: time.end, from: 0, to: 2, count: 3, spacing: logarithmic}]' &&
    bad 'zip\[0\] has 2' 'axes: [{zip: [{key: time.step, values: [1, 2]}, {key: time.end, values: [1]}]}]' &&
    bad 'varies on two axes' 'axes: [{key: time.step, values: [1]}, {key: time.step, values: [1]}]' &&
    bad 'varies on two axes' 'axes: [{key: time.step, name: a, values: [1]}, {key: time.step, name: b, values: [1]}]' &&
    bad 'time.step is a part of time, which varies on an axis of its own' \
      'axes: [{key: time.step, values: [1]}, {key: time, values: [{step: 2}]}]' &&
    bad 'at least one value' 'axes: [{key: time.step, values: []}]' &&
    bad 'named like one of the results' 'axes: [{key: time.step, name: newton, values: [1]}]' &&
    bad 'the column tip_J_min would be named like one of the results' \
      'set: {output.probes: [{name: tip, point: [0.2, 0.2, 0.2], quantities: [J]}]}' \
      'axes: [{key: time.step, name: tip_J_min, values: [1/60]}]' &&
    bad 'no such column: foo; .flesh schema results. lists the figures' 'columns: [{name: a, is: foo + 1}]' &&
      bad 'no such column: newtn; did you mean newton?' 'columns: [{name: a, is: 2 * newtn}]' &&
      bad 'must be an expression of SQLite: it is more than one' 'columns: [{name: a, is: "1); DROP TABLE cases; --"}]' &&
    bad 'either values or from and to' 'axes: [{sample: {count: 2, axes: [{key: body.density}]}}]' &&
    bad 'niederreiter takes at most 12' 'axes: [{sample: {sequence: niederreiter, count: 2, axes: [{key: a, values: [1]}, {key: b, values: [1]}, {key: c, values: [1]}, {key: d, values: [1]}, {key: e, values: [1]}, {key: f, values: [1]}, {key: g, values: [1]}, {key: h, values: [1]}, {key: i, values: [1]}, {key: j, values: [1]}, {key: k, values: [1]}, {key: l, values: [1]}, {key: m, values: [1]}]}}]' &&
    bad 'more than 10000000 cases' 'axes: [{key: time.step, from: 1, to: 2, count: 3163}, {key: time.end, from: 1, to: 2, count: 3163}]' &&
    expect 2 "$flesh" sweep spec.yaml --shard 3/2 && has stderr.txt 'i/n' &&
      expect 3 "$flesh" sweep no_such_spec.yaml &&
    { echo 'scene: no_such.yaml' >spec.yaml; expect 3 "$flesh" sweep spec.yaml; } &&
      has stderr.txt 'spec.yaml:1:8: no_such.yaml'
}

an_older_sweep_is_not_overwritten() {
  spec 'axes: [{key: time.step, values: [1/60]}]'
  expect 0 "$flesh" sweep spec.yaml --out older && expect 2 "$flesh" sweep spec.yaml --out older &&
    has stderr.txt resume &&
    expect 0 "$flesh" sweep spec.yaml --out older --resume || return 1
  spec 'set: {time.end: 1/15}' 'axes: [{key: time.step, values: [1/60]}]'
  expect 2 "$flesh" sweep spec.yaml --out older --resume && has stderr.txt 'of another sweep' || return 1
  printf 'CREATE TABLE meta (key TEXT PRIMARY KEY, value TEXT); INSERT INTO meta VALUES ("format", "1");' |
    python3 -c 'import sqlite3, sys; sqlite3.connect("older/sweep.db.1").executescript(sys.stdin.read())' &&
    mkdir first && mv older/sweep.db.1 first/sweep.db || return 1
  spec 'axes: [{key: time.step, values: [1/60]}]'
  expect 3 "$flesh" sweep spec.yaml --out first --resume && has stderr.txt 'its layout is number 1'
}

# If an axis gets more values, only the new cases run; cases that have folders, named by their numbers, refuse that.
an_axis_may_grow() {
  spec 'axes: [{key: time.step, values: [1/60, 1/80]}, {key: body.density, values: [900, 1000]}]'
  expect 0 "$flesh" sweep spec.yaml --out grown && ask grown/sweep.db id,started,step,density 1 >before || return 1
  spec 'axes: [{key: time.step, values: [1/120, 1/60]}, {key: body.density, values: [900, 1000, 1100]}]'
  expect 0 "$flesh" sweep spec.yaml --out grown --resume && has stdout.txt '^6 cases: 6 complete' || return 1
  ask grown/sweep.db id,started,step,density 'id <= 4' >after && cmp before after &&
    [ "$(ask grown/sweep.db 'count(*), count(DISTINCT id)' 1)" = 8,8 ] || return 1
  spec 'keep: true' 'axes: [{key: time.step, values: [1/60]}]'
  expect 0 "$flesh" sweep spec.yaml --out kept || return 1
  spec 'keep: true' 'axes: [{key: time.step, values: [1/60, 1/70]}]'
  expect 2 "$flesh" sweep spec.yaml --out kept --resume && has stderr.txt 'cases that keep folders cannot get further'
}

# No case runs again because of another derived column, title or comment, even if cases keep folders.
derived_columns_may_change() {
  for keep in false true; do
    axes='axes: [{key: time.step, values: [1/60, 1/80]}]'
    spec "keep: $keep" "$axes" 'columns: [{name: work, is: newton * tets}, {name: old, is: 1}]'
    expect 0 "$flesh" sweep spec.yaml --out "derived_$keep" && ask "derived_$keep/sweep.db" id,started >before || return 1
    spec "keep: $keep" 'title: the same' "$axes  # the same" 'columns: [{name: work, is: newton + tets}, {name: next, is: 2 * work}]'
    expect 0 "$flesh" sweep spec.yaml --out "derived_$keep" --resume || return 1
    ask "derived_$keep/sweep.db" id,started >after && cmp before after &&
      [ "$(ask "derived_$keep/sweep.db" 'next = 2 * (newton + tets)' 'id = 2')" = 1 ] &&
      expect 2 "$flesh" sweep export "derived_$keep/sweep.db" --columns old || return 1
  done
}

numbers_of_a_range_are_round() {
  spec 'axes: [{key: body.density, from: 0.1, to: 0.8, count: 3}, {key: body.material.young, from: 0.1, to: 0.9, count: 9}]'
  expect 0 "$flesh" sweep spec.yaml --dry-run && has stdout.txt 'density.*: 0.1, 0.45, 0.8$' &&
    has stdout.txt 'young.*: 0.1, 0.2, 0.3, 0.4, \.\.\., 0.9$'
}

shards_join_to_the_same_bits() {
  undisturbed || return 1
  for shard in 1 2 3; do
    expect 0 "$flesh" sweep bar.yaml --out "shard$shard" --shard "$shard/3" --quiet || return 1
  done
  expect 0 "$flesh" sweep merge part.db shard1/sweep.db shard3/sweep.db && has stdout.txt '32 of 48 cases are done' &&
    expect 0 "$flesh" sweep merge all.db shard2/sweep.db part.db && has stdout.txt '48 of 48' && [ ! -s stderr.txt ] &&
    figures whole/sweep.db >expected && figures all.db >got && diff expected got &&
    expect 3 "$flesh" sweep merge all.db part.db && has stderr.txt 'is there already' || return 1
  expect 2 "$flesh" sweep bar.yaml --out shard2 --resume && has stderr.txt 'holds shard 2/3' || return 1
  spec 'axes: [{key: time.step, values: [1/60]}]'
  "$flesh" sweep spec.yaml --out other --quiet && expect 2 "$flesh" sweep merge no.db all.db other/sweep.db &&
    has stderr.txt 'of another sweep' && [ ! -e no.db ] || return 1
  mkdir -p joined && cp part.db joined/sweep.db && expect 0 "$flesh" sweep bar.yaml --out joined --resume &&
    figures joined/sweep.db >got && diff expected got
}

tables_are_exported() {
  spec 'axes: [{key: effects.gravity.acceleration, name: g, values: [[0, 0, -9.81], [0, 0, 1]]}, {key: title, values: ["say \"a, b\"", c]}]'
  "$flesh" sweep spec.yaml --out exported --quiet || return 1
  expect 0 "$flesh" sweep export exported/sweep.db --format jsonl --out results.jsonl &&
    expect 0 "$flesh" sweep export exported/sweep.db --out results.csv || return 1
  python3 - <<'END' || return 1
import csv, json
lines = [json.loads(line) for line in open("results.jsonl")]
rows = list(csv.DictReader(open("results.csv")))
assert len(lines) == len(rows) == 4
assert [line["title"] for line in lines] == [row["title"] for row in rows] == ['say "a, b"', "c"] * 2
for line, row in zip(lines, rows):
    assert list(line) == list(row)
    for key, value in line.items():
        assert (row[key] == "") if value in (None, "") else (type(value)(row[key]) == value), (key, value, row[key])
END
  expect 0 "$flesh" sweep export exported/sweep.db --format markdown --columns "title, '|' || char(10) AS bar, id" &&
    [ "$(sed -n 3p stdout.txt)" = '| say "a, b" | \|  | 1 |' ] && [ "$(lines stdout.txt)" -eq 6 ] || return 1
  expect 2 "$flesh" sweep export exported/sweep.db --columns max_volume_drifts && has stderr.txt 'no such column: max_volume_drifts; did you mean max_volume_drift?' &&
    expect 2 "$flesh" sweep export exported/sweep.db --where nonsense && has stderr.txt ', --where nonsense: no such' &&
    expect 2 "$flesh" sweep export exported/sweep.db --format xml && expect 3 "$flesh" sweep export tiny.yaml
}

# A finished database can be read where nothing can be written beside it: its header asks for no log of SQLite's, which a 2 in
# bytes 18 and 19 would. A damaged one is called damaged, not "no database of a study".
a_finished_sweep_needs_no_log() {
  undisturbed || return 1
  [ "$(od -An -tu1 -j18 -N2 whole/sweep.db | tr -d ' \n')" = 11 ] && [ "$(find whole -name 'sweep.db*' | wc -l)" -eq 1 ] ||
    { od -An -tu1 -j18 -N2 whole/sweep.db; ls -a whole; return 1; }
  head -c 4096 whole/sweep.db >torn.db && head -c 20000 /dev/zero | tr '\0' '\377' >>torn.db
  expect 3 "$flesh" sweep export torn.db && has stderr.txt 'torn.db: is damaged: .*malformed' || return 1
  cp whole/sweep.db cases.db && python3 -c 'import sqlite3
read = sqlite3.connect("cases.db").execute
size, = read("PRAGMA page_size").fetchone()
root, = read("SELECT rootpage FROM sqlite_master WHERE name = \"cases\"").fetchone()
with open("cases.db", "r+b") as file: file.seek((root - 1) * size), file.write(b"\377" * size)' || return 1
  for order in 'cases.db whole/sweep.db' 'whole/sweep.db cases.db'; do
    # shellcheck disable=SC2086 # two names
    expect 3 "$flesh" sweep merge merged.db $order && has stderr.txt 'merge: cases.db: is damaged' || return 1
  done
  mkdir torn && cp torn.db torn/sweep.db
  expect 3 "$flesh" sweep spec.yaml --out torn --resume && has stderr.txt 'torn/sweep.db: is damaged'
}

# Values that agree to four digits are distinct values all the same.
near_values_are_told_apart() {
  command -v gnuplot >/dev/null || { echo 'no gnuplot'; return 0; }
  spec 'set: {time.end: 1/60}' 'axes: [{key: body.material.poisson, values: [0.49991, 0.49992, 0.3]}, {key: body.density, values: [1, 2]}]'
  "$flesh" sweep spec.yaml --out near --quiet || return 1
  expect 0 "$flesh" sweep plot near/sweep.db --x density --y poisson --by poisson --out near.png &&
    has near.gp 'title "0.49991"' && has near.gp 'title "0.49992"' && has near.gp 'title "0.3"' || return 1
  [ "$(grep -c '0.4999[12]' near.dat)" -eq 4 ] && awk '/NaN/ { block++ } !/NaN/ && NF { if ($2 in at && at[$2] != block) exit 1; at[$2] = block }
    END { exit !(at["0.29999999999999999"] == 1 && block == 3) }' near.dat || { cat near.dat; return 1; }
  expect 0 "$flesh" sweep plot near/sweep.db --x density --y poisson --z poisson --out heat.png &&
    [ "$(grep -c '^[01] [012] 0' heat.gp)" -eq 6 ] && [ "$(grep '^[01] [012] 0' heat.gp | cut -d ' ' -f 1,2 | sort -u | wc -l)" -eq 6 ]
}

# The labels beside and below a heat map fit between the picture's edges and the map.
words_beside_a_heat_map_have_room() {
  command -v gnuplot >/dev/null || { echo 'no gnuplot'; return 0; }
  spec 'axes: [{key: time.method, values: [generalized-alpha, bdf2]}, {key: body.density, values: [1, 2]}]'
  "$flesh" sweep spec.yaml --out words --quiet || return 1
  expect 0 "$flesh" sweep plot words/sweep.db --x density --y method --z newton --out words.png &&
    expect 0 "$flesh" sweep plot words/sweep.db --x method --y density --z newton --out turned.png || return 1
  python3 - <<'END'
import re
def canvas(name):
    text = open(name + ".gp").read()
    width, height = map(int, re.search(r"size (\d+),(\d+)", text).groups())
    left, right, low, top = map(float, re.search(r"margins ([\d.,]+)", text)[1].split(","))
    return width * left, height * low, "rotate by 60" in text
left, low, turned = canvas("words")
assert left >= 30 + 7.5 * len("generalized-alpha") and not turned, (left, turned)
left, low, turned = canvas("turned")
assert turned and low >= 30 + 0.87 * 7.5 * len("generalized-alpha"), (low, turned)
END
}

pictures_are_drawn() {
  command -v gnuplot >/dev/null || { echo 'no gnuplot'; return 0; }
  undisturbed || return 1
  expect 0 "$flesh" sweep plot whole/sweep.db --x density --y newton --by poisson --log x --out lines.png &&
    expect 0 "$flesh" sweep plot whole/sweep.db --x density --y poisson --z max_volume_drift --log z &&
    [ "$(wc -c <lines.png)" -gt 5000 ] && [ "$(wc -c <whole/max_volume_drift_density_poisson.png)" -gt 5000 ] &&
    expect 2 "$flesh" sweep plot whole/sweep.db --x density &&
      expect 2 "$flesh" sweep plot whole/sweep.db --x density --y nonsense && has stderr.txt 'no such column' &&
      ! grep -q -e --where stderr.txt &&
      expect 2 "$flesh" sweep plot whole/sweep.db --x density --y newton --by density,poisson &&
      has stderr.txt "; --by is one expression, as printf('%s, %s', nu, eta)"
}

ten_thousand_cases_are_planned_before_the_first_begins() {
  spec 'axes: [{key: body.material.young, from: 1e4, to: 1e6, count: 100}, {key: body.density, from: 1, to: 2, count: 100}]'
  "$flesh" sweep spec.yaml --out planned --jobs 1 --quiet 2>/dev/null &
  sweep=$!
  wait_until "$sweep" has_begun planned/sweep.db || return 1
  kill -TERM "$sweep"
  wait "$sweep"
  [ $? -eq 143 ] && [ "$(ask planned/sweep.db 'count(*)')" = 10000 ]
}
has_begun() { [ -f "$1" ] && [ -n "$(ask "$1" id 'started IS NOT NULL')" ]; }

ten_thousand_cases_are_planned() {
  spec 'axes: [{key: body.material.young, from: 1e4, to: 1e6, count: 100}, {key: body.density, from: 1, to: 2, count: 100}]'
  expect 0 "$flesh" sweep spec.yaml --out many --shard 1/500 --quiet || return 1
  [ "$(ask many/sweep.db 'count(*), min(id), max(id), sum(density)')" = 20,1,9501,20 ] ||
    { ask many/sweep.db 'count(*), min(id), max(id), sum(density)'; return 1; }
}

the_shipped_sweeps_are_valid() {
  for file in "$data"/sweeps/*.yaml; do
    expect 0 "$flesh" sweep "$file" --dry-run || return 1
  done
}

gnu_parallel_runs_the_shards() {
  command -v parallel >/dev/null || { echo 'GNU parallel is not installed'; return 0; }
  undisturbed || return 1
  FLESH=$flesh expect 0 sh "$data/sweeps/parallel.sh" bar.yaml parallel 4 --jobs 2 || return 1
  figures whole/sweep.db >expected && figures parallel/sweep.db >got && diff expected got
}

# The array's jobs, here one after another, run the shards; a requeued job finds its cases complete.
slurm_runs_the_shards() {
  undisturbed || return 1
  for task in 1 2 3 2; do
    FLESH=$flesh SLURM_ARRAY_TASK_ID=$task SLURM_ARRAY_TASK_COUNT=3 SLURM_CPUS_PER_TASK=2 \
      expect 0 sh "$data/sweeps/slurm.sh" bar.yaml slurm || return 1
  done
  [ "$(ask slurm/shard2/sweep.db 'count(DISTINCT worker)')" = 1 ] || return 1
  expect 0 "$flesh" sweep merge slurm/sweep.db slurm/shard*/sweep.db && has stdout.txt '48 of 48' &&
    figures whole/sweep.db >expected && figures slurm/sweep.db >got && diff expected got
}

snakemake_runs_the_shards() {
  command -v snakemake >/dev/null || { echo 'Snakemake is not installed'; return 0; }
  undisturbed || return 1
  expect 0 snakemake --snakefile "$data/sweeps/Snakefile" --cores 2 \
    --config spec=bar.yaml 'out=by snakemake' shards=3 "flesh=$flesh" &&
    figures whole/sweep.db >expected && figures 'by snakemake/sweep.db' >got && diff expected got &&
    [ "$(lines 'by snakemake/results.csv')" -eq 49 ]
}

run_tests a_plan_is_printed_and_nothing_is_done a_row_is_what_a_run_gives names_of_the_database_are_free \
  failed_cases_are_rows bad_specs_are_refused an_older_sweep_is_not_overwritten an_axis_may_grow derived_columns_may_change \
  numbers_of_a_range_are_round shards_join_to_the_same_bits tables_are_exported a_finished_sweep_needs_no_log \
  near_values_are_told_apart words_beside_a_heat_map_have_room pictures_are_drawn \
  ten_thousand_cases_are_planned_before_the_first_begins ten_thousand_cases_are_planned the_shipped_sweeps_are_valid \
  gnu_parallel_runs_the_shards slurm_runs_the_shards snakemake_runs_the_shards
