#!/bin/sh
# speed.sh: repeats the measurements of speed in data/results/README.md. Takes some 15 minutes on an otherwise idle
# machine, and 2 GB of memory:
#
#   sh drivers/speed.sh [--quick]    --quick: small cases, run once, to check that it works
#
# Prints that page's tables last; all other results, with roofline.png and growth.png, are in out/speed.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
cd "$root"
flesh=${FLESH:-build/drivers/flesh} out=out/speed
bar='--cells 48x13x13 --steps 30 --repeats 5'
growth='--cells 6000,48x13x13,100000,200000,400000,1000000 --poisson 0.3,0.45,0.49,0.499 --repeats 3'
case ${1:-} in
  '') ;;
  --quick)
    bar='--cells 6x2x2 --steps 2 --repeats 1'
    growth='--cells 100,300 --poisson 0.45 --steps 2 --repeats 1'
    ;;
  *)
    echo "speed.sh: '$1' is unknown; it takes --quick or nothing" >&2
    exit 2
    ;;
esac
rm -rf "$out" # no figures of an earlier run
mkdir -p "$out"
# shellcheck disable=SC2086
{
  "$flesh" bench $bar --threads 1,2 --out "$out/bar"
  "$flesh" bench $bar --energies B --poisson 0.45 --cases static --out "$out/static"
  "$flesh" bench $growth --cases kernels,swing,static --out "$out/growth"
} | tee "$out/log.txt"
cp "$out/growth/roofline.png" "$out/growth/growth.png" "$out" 2>/dev/null || echo 'no pictures without gnuplot' >&2

# Awk's code that makes c["name"] the column of this name in a bench.csv.
columns='BEGIN { FS = "," } NR == 1 { for (k = 1; k <= NF; k++) c[$k] = k; next }'
printf '\n| swing, ν | Newton, linear iterations | one thread, CPU | two threads, wall | times faster |\n'
echo '|---|---|---|---|---|'
awk "$columns"' $c["name"] == "swing" && $c["threads"] == 1 { wall = $c["wall_s"]; cpu = $c["cpu_s"] }
  $c["name"] == "swing" && $c["threads"] == 2 {
    n = $c["steps"]
    printf "| %s | %.1f, %.0f | %.1f ms | %.1f ms | %.2f |\n", $c["poisson"], $c["newton"] / n, $c["linear"] / n,
      1e3 * cpu / n, 1e3 * $c["wall_s"] / n, wall / $c["wall_s"] }' "$out/bar/bench.csv"
awk "$columns"' $c["name"] == "static" { printf "\nstatic, B, 0.45: %.3f s of CPU\n", $c["cpu_s"] }
  ' "$out/static/bench.csv"
printf '\nns per tet, share of the ceiling\n'
awk "$columns"' $c["group"] == "kernel" {
    if (!($c["name"] in row)) name[++names] = $c["name"]
    if (!($c["tets"] in seen)) { seen[$c["tets"]] = 1; head = head " | " $c["tets"]; rule = rule "---|" }
    row[$c["name"]] = row[$c["name"]] sprintf(" | %.1f, %.0f %%", $c["ns_per_tet"], 100 * $c["floor_s"] / $c["cpu_s"]) }
  END { print "| kernel" head " |\n|---|" rule; for (k = 1; k <= names; k++) print "| " name[k] row[name[k]] " |" }
  ' "$out/growth/bench.csv"
echo
grep -E '^(growth|memory|most memory)' "$out/log.txt"
