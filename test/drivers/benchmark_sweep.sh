#!/bin/sh
# benchmark_sweep.sh: measures the cost of a sweep beside that of its cases. Takes some two minutes on an otherwise idle
# machine:
#
#   FLESH=build/drivers/flesh sh test/drivers/benchmark_sweep.sh
#
# Prints, each with its target: the time of a sweep beyond that of its cases, at about 1 s a case; how much faster two jobs
# are than one; the time to plan 10 000 tiny cases, and that of the last thousand of them over that of the first.
set -eu
case ${FLESH:?FLESH must name the flesh program} in
  */*) FLESH=$(CDPATH='' cd -- "$(dirname -- "$FLESH")" && pwd)/${FLESH##*/} ;;
esac
export FLESH
. "$(dirname -- "$0")/../shared/command.sh"
. "$source_folder/shared/sweep.sh"
echo "load before: $(cut -d' ' -f1-3 /proc/loadavg), $(nproc) processors"

now() { date +%s.%N; }
# calculate FORMAT EXPRESSION: prints the value of awk's EXPRESSION.
calculate() { awk "BEGIN { printf \"$1\", $2 }"; }
median() { sort -g | awk '{ x[NR] = $1 } END { print x[int((NR + 1) / 2)] }'; }

# Finds the end time with which a case takes one second on this machine.
end=20
for _ in 1 2; do
  "$flesh" run "$data/scenes/bar_gravity.yaml" --set body.material='{energy: S, young: 1e5, poisson: 0.45}' \
    --set "body.mesh=$data/meshes/bar_8x2x2.mesh" --set output.frame_interval=0 --set "time.end=$end" --quiet --out one
  end=$(python3 -c "import json; print($end / json.load(open('one/result.json'))['figures']['wall_s'])")
done
cat >second.yaml <<END
scene: $data/scenes/bar_gravity.yaml
set: {body.material: {energy: S, young: 1e5, poisson: 0.45}, body.mesh: $data/meshes/bar_8x2x2.mesh, time.end: $end}
repeats: 12
END

# run_sweep JOBS FOLDER: writes the wall and CPU seconds of a sweep into FOLDER.wall and FOLDER.cpu.
run_sweep() {
  python3 - "$flesh" sweep second.yaml --out "$2" --jobs "$1" --quiet <<'END'
import resource, subprocess, sys, time
begin = time.monotonic()
subprocess.run(sys.argv[1:], check=True)
wall, used = time.monotonic() - begin, resource.getrusage(resource.RUSAGE_CHILDREN)
folder = sys.argv[sys.argv.index("--out") + 1]
print(wall, file=open(folder + ".wall", "w"))
print(used.ru_utime + used.ru_stime, file=open(folder + ".cpu", "w"))
END
}
for pair in 1 2 3; do
  run_sweep 1 "one$pair"
  run_sweep 2 "two$pair"
  own=$(ask "one$pair/sweep.db" 'sum(wall_s)')
  used=$(ask "one$pair/sweep.db" 'sum(cpu_s)')
  calculate '%.2f\n' "100 * ($(cat "one$pair.wall") / $own - 1)" >>overheads
  calculate '%.2f\n' "100 * ($(cat "one$pair.cpu") / $used - 1)" >>used
  calculate '%.3f\n' "$(cat "one$pair.wall") / $(cat "two$pair.wall")" >>gains
  calculate '%.3f s a case\n' "$own / 12"
done
echo "a sweep's own time: $(median <overheads) % of its cases' (wanted: below 2 %), $(median <used) % of their CPU time"
echo "two jobs: $(median <gains) times as fast as one (wanted: at least 1.8 on two processors)"

spec 'axes: [{key: body.material.young, from: 1e4, to: 1e6, count: 100}, {key: body.density, from: 1, to: 2, count: 100}]'
begin=$(now)
"$flesh" sweep spec.yaml --out many --jobs 2 --quiet
echo "10 000 tiny cases: $(calculate '%.1f s' "$(now) - $begin") in all"
ask many/sweep.db 'julianday(started) * 86400' | sort -g | awk -v begin="$begin" '
  { t[NR] = $1 }
  END {
    printf "planned in %.2f s (wanted: below 1 s)\n", t[1] - 2440587.5 * 86400 - begin
    printf "the last thousand take %.2f times the first (wanted: 1)\n", (t[NR] - t[NR - 999]) / (t[1000] - t[1])
  }'
echo "load after: $(cut -d' ' -f1-3 /proc/loadavg)"
