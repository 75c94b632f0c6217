# TEST full program needs=flesh builds=plain
# TEST name=test_bench_long full program needs=flesh builds=plain args: long
# TEST quick program needs=flesh builds=memory args: races
# TEST full seconds=180 needs=flesh builds=threads args: races
# test_command_bench.sh: `flesh bench`: its files, equal counters and answers of equal work, and its refusals. Nothing here
# depends on the machine's speed. `races` runs only the tests with threads, for the thread sanitizer; `long` only those of
# growth up to 60 000 tets and of elements.
set -u
. "$(dirname -- "$0")/../shared/command.sh"

# value NAME 'COLUMN=VALUE;...': prints the values of column NAME in the rows whose columns have these values.
value() {
  awk -F , -v name="$1" -v wanted="$(shift; echo "$*")" '
    NR == 1 { for (c = 1; c <= NF; c++) column[$c] = c; split(wanted, want, ";"); next }
    { for (w in want) { split(want[w], pair, "="); if ($column[pair[1]] != pair[2]) next } print $column[name] }' out/bench.csv
}

it_ends_well() {
  expect 0 "$flesh" bench --cells 300,9x3x3 --energies S,B --poisson 0.45 --threads 1,2 --steps 3 --repeats 2 --out out
  [ ! -s stderr.txt ] || { cat stderr.txt; return 1; }
  has stdout.txt 'multiply-add portable' && has stdout.txt '^element force .* ns/tet .* of the ceiling' &&
    has stdout.txt '^swing .* ms/step .* Newton' && has stdout.txt 'growth of twist S 0.45, 2 threads: time ~ tets^' &&
    has stdout.txt 'memory at 486 tets: integrator'
}

# All 10 kernels and 5 cases have a row for each number of threads; 13x2x2 is the bar nearest to 300 tets.
every_measurement_is_a_row() {
  has out/bench.csv '^group,name,energy,poisson,tets,nodes,threads,status,wall_s,cpu_s,scatter,repeats,ns_per_tet,bytes' &&
    [ "$(lines out/bench.csv)" -eq 121 ] && # (10*2 + 5*2) rows, two sizes, two energies, header
    [ "$(value tets 'name=swing;energy=S;threads=1' | tr '\n' ' ')" = '312 486 ' ] &&
    [ -z "$(value name 'status=FLESH_ERR_SOLVE')" ]
}

# The work does not depend on the number of threads, nor does the answer, to the last bit.
threads_do_the_same_work() {
  for column in newton linear assemblies projections answer; do
    for name in swing twist crush drop static; do
      one=$(value $column "name=$name;threads=1")
      two=$(value $column "name=$name;threads=2")
      [ -n "$one" ] && [ "$one" = "$two" ] || { echo "$name: $column $one and $two"; return 1; }
    done
  done
}

# Counters are plausible: steps take iterations, all bodies move, and a swinging and a twisted bar by different amounts.
cases_are_what_they_say() {
  awk -F , 'NR > 1 && $1 != "kernel" && !($18 >= 1 && $19 >= $18 && $20 >= $19 && $24 > 1e-4) { print; bad = 1 }
    NR > 1 && $1 == "kernel" && !($14 > 0 && $16 > 0) { print; bad = 1 } END { exit bad }' out/bench.csv &&
    [ "$(value answer 'name=swing;energy=S;threads=1')" != "$(value answer 'name=twist;energy=S;threads=1')" ]
}

the_json_says_the_same() {
  python3 - <<'END'
import json
d = json.load(open('out/bench.json'))
assert len(d['measurements']) == 120 and len(d['ceilings']) == 2, (len(d['measurements']), len(d['ceilings']))
assert all(c['read_bytes_per_s'][l] > 1e6 for c in d['ceilings'] for l in ('L2', 'L3', 'memory'))
assert 1e4 < d['level_bytes']['L2'] < d['level_bytes']['L3'] < 1e9, d['level_bytes']
assert d['peak_memory_kB'] > 1000, d['peak_memory_kB']
assert all(c['operations_per_s']['portable'] > 1e6 for c in d['ceilings'])
assert d['instructions'] in ('portable', 'avx2', 'avx512') and d['program']
assert {m['owner'] for m in d['memory']} == {'mesh', 'effects and pattern', 'integrator'}
if 'sanitizers none' in d['program']['build_options']:  # their allocator does not count the memory in use
    assert all(0 < m['bytes'] / m['tets'] < 3000 for m in d['memory']), d['memory']
END
}

# All three sizes give the printed exponents of time and iterations; the exponent "from 48 000 tets" is of the larger two.
growth_is_fitted_from_where_it_says() {
  expect 0 "$flesh" bench --cells 700,48x13x13,60000 --poisson 0.45 --cases swing --steps 1 --repeats 1 --out growth ||
    return 1
  python3 - <<'END'
import json, math, re
rows = json.load(open('growth/bench.json'))['measurements']
assert [r['tets'] for r in rows] == [702, 48672, 59976], rows
def slope(rows, value):
    x, y = [math.log(r['tets']) for r in rows], [math.log(value(r)) for r in rows]
    mx, my = sum(x) / len(x), sum(y) / len(y)
    return sum((a - mx) * (b - my) for a, b in zip(x, y)) / sum((a - mx) ** 2 for a in x)
per_newton = lambda r: r['linear'] / r['newton']
large, all_sizes = slope(rows[1:], per_newton), slope(rows, per_newton)
assert abs(large - all_sizes) > 0.01, (large, all_sizes)
for r in rows:
    assert abs(r['growth_linear_from_48000'] - large) < 1e-9 and r['growth_time_from_200000'] is None, (r, large)
    assert abs(r['growth_time'] - slope(rows, lambda r: r['cpu_s'])) < 1e-9, r
said = re.search(r'^growth of swing .*: time ~ tets\^\S+, linear iterations ~ tets\^(\S+) \(from 48 000 tets: (\S+)\)$',
                 open('stdout.txt').read(), re.M)
assert said and abs(float(said[1]) - all_sizes) < 0.006 and abs(float(said[2]) - large) < 0.006, (said, all_sizes, large)
END
}

# A kernel's level is the smallest cache, or memory, that holds its data, and its floor the time for its bytes and operations
# there.
floors_are_those_of_the_ceilings() {
  python3 - <<'END'
import json
d = json.load(open('out/bench.json'))
ceilings = {c['threads']: c for c in d['ceilings']}
kernels = [m for m in d['measurements'] if m['group'] == 'kernel']
assert len(kernels) == 80
for m in kernels:
    c = ceilings[m['threads']]
    level = next((l for l in ('L2', 'L3') if m['bytes'] <= d['level_bytes'][l]), 'memory')
    floor = max(m['bytes'] / c['read_bytes_per_s'][level], m['operations'] / max(c['operations_per_s'].values()))
    assert m['level'] == level and abs(m['floor_s'] / floor - 1) < 1e-12, (m, floor)
END
}

# Measurements stay when sizes and cases are added; those with other settings are refused, not mixed with them.
sizes_can_be_added() {
  few='--poisson 0.45 --repeats 1 --out more'
  # shellcheck disable=SC2086
  expect 0 "$flesh" bench $few --cells 48 --cases swing,kernels --steps 1 && cp more/bench.csv before.csv &&
    expect 0 "$flesh" bench $few --cells 48,300 --cases swing,kernels,drop --steps 1 --resume &&
    [ "$(grep -cxFf before.csv more/bench.csv)" -eq 12 ] && [ "$(lines more/bench.csv)" -eq 25 ] &&
    expect 2 "$flesh" bench $few --cells 48 --steps 2 --resume && has stderr.txt 'there 1 steps, here 2 steps' &&
    expect 0 "$flesh" report more --out more.html
}

pictures_are_drawn() {
  command -v gnuplot >/dev/null || { echo 'no gnuplot'; return 0; }
  for picture in roofline growth; do
    [ "$(head -c 8 out/$picture.png | od -An -tx1 | tr -d ' \n')" = 89504e470d0a1a0a ] || { echo "$picture"; return 1; }
  done
}

# Instruction sets differ by rounding: numbers of Newton iterations are equal, and answers nearly so.
instructions_agree() {
  expect 0 "$flesh" bench --cells 9x3x3 --poisson 0.45 --cases swing --steps 3 --repeats 1 --instructions portable \
    --json \
    --out portable || return 1
  python3 - <<'END'
import json
p = json.load(open('stdout.txt'))
assert p == json.load(open('portable/bench.json')) and p['instructions'] == 'portable'
a = [m for m in json.load(open('out/bench.json'))['measurements']
     if m['name'] == 'swing' and m['energy'] == 'S' and m['tets'] == 486][0]
b = p['measurements'][0]
assert a['newton'] == b['newton'] and abs(a['linear'] - b['linear']) <= 2, (a, b)
assert abs(a['answer_m'] / b['answer_m'] - 1) < 1e-6, (a, b)
END
}

# With ten-node tets only steps are measured, no kernels, and the body bends more.
elements_are_measured() {
  expect 0 "$flesh" bench --cells 12x2x2 --poisson 0.49 --cases kernels,swing --steps 3 --repeats 1 --out four || return 1
  expect 0 "$flesh" bench --cells 12x2x2 --poisson 0.49 --cases kernels,swing --steps 3 --repeats 1 --element tet10-mean \
    --out ten || return 1
  awk -F , 'FNR == 1 { for (c = 1; c <= NF; c++) at[$c] = c; next }
    { n[$at["element"], $at["group"]]++ } $at["name"] == "swing" { nodes[$at["element"]] = $at["nodes"]; sag[$at["element"]] = $at["answer"] }
    END { exit !(n["tet4", "kernel"] == 10 && n["tet10-mean", "kernel"] == 0 && n["tet10-mean", "step"] == 1 &&
                 nodes["tet4"] == 117 && nodes["tet10-mean"] == 625 && sag["tet10-mean"] > sag["tet4"]) }' four/bench.csv \
    ten/bench.csv || { cat four/bench.csv ten/bench.csv; return 1; }
  expect 2 "$flesh" bench --element tet5 && has stderr.txt "--element is 'tet5'; it must be tet4, tet10 or tet10-mean"
}

nonsense_is_refused() {
  expect 2 "$flesh" bench --cells 5 && has stderr.txt "'5' is neither" &&
    expect 2 "$flesh" bench --cells 0x1x1 && has stderr.txt 'at least one cell' &&
    expect 2 "$flesh" bench --energies Q && has stderr.txt 'must be one of' &&
    expect 2 "$flesh" bench --poisson 0.5 && has stderr.txt '0.5 needs --element tet10-mean' &&
    expect 2 "$flesh" bench --threads 1,1 && has stderr.txt 'has 1 twice' &&
    expect 2 "$flesh" bench --threads 0 && has stderr.txt 'a whole number from 1' &&
    expect 2 "$flesh" bench --threads 257 && has stderr.txt 'more than 256' &&
    expect 2 "$flesh" bench --cases swim && has stderr.txt 'some of kernels, swing' &&
    expect 2 "$flesh" bench --instructions mmx && has stderr.txt 'avx512' &&
    expect 2 "$flesh" bench here &&
    expect 3 "$flesh" bench --cells 6 --out /proc/nowhere && [ ! -s stdout.txt ]
}

case ${1-} in
races) run_tests it_ends_well threads_do_the_same_work ;;
long) run_tests growth_is_fitted_from_where_it_says elements_are_measured ;;
*)
  run_tests it_ends_well every_measurement_is_a_row threads_do_the_same_work cases_are_what_they_say \
    the_json_says_the_same floors_are_those_of_the_ceilings sizes_can_be_added pictures_are_drawn instructions_agree nonsense_is_refused
  ;;
esac
