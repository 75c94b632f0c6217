#!/bin/sh
# elements.sh: what 1 % of accuracy costs with tet10-mean and with tet4, in one run for each Poisson's ratio: the bar of
# 4 x 1 x 1 m that sags under its weight, on meshes of 192 tets and up, against extrapolated limits. On a machine that
# has nothing else to do some five minutes:
#
#   sh drivers/elements.sh [--quick]    --quick: small, to see that it works
#
# Prints the table of data/results/README.md; the runs are in out/elements.
set -eu
root=$(CDPATH='' cd -- "$(dirname -- "$0")/.." && pwd)
cd "$root"
flesh=${FLESH:-build/drivers/flesh} out=out/elements seconds=60
case ${1:-} in
  '') ;;
  --quick) seconds=1 ;;
  *)
    echo "elements.sh: '$1' is unknown; it takes --quick or nothing" >&2
    exit 2
    ;;
esac
rm -rf "$out" # no figures of an earlier run
mkdir -p "$out"
for cells in 4,1,1 8,2,2; do
  "$flesh" mesh box --cells $cells --size 4,1,1 --out "$out/bar_$cells.msh" >"$out/log.txt"
  cat >"$out/bar_$cells.yaml" <<END
body: {mesh: "bar_$cells.msh", density: 1000, material: {energy: S, young: 1e5, poisson: 0.3}}
effects:
  - gravity: {acceleration: [0, 0, -0.2]}
  - pin: {box: [[-1, -1, -1], [1e-9, 2, 2]]}
END
done
for poisson in 0.3 0.45 0.49; do
  "$flesh" accuracy "$out/bar_8,2,2.yaml" --mesh --coarser "$out/bar_4,1,1.yaml" --mesh-seconds $seconds \
    --set body.material.poisson=$poisson --out "$out/$poisson" >>"$out/log.txt"
done

echo '| ν | tet10-mean | tet4 | times |'
echo '|---|---|---|---|'
for poisson in 0.3 0.45 0.49; do
  # "To a mesh error of 1 %: tet10-mean 0.13 s, tet10 1.4 s, 11 times as much, tet4 at least 9 s, at least 70 times as much."
  sed -n 's/^To a mesh error of 1 %: //p' "$out/$poisson/mesh.txt" | awk -v nu=$poisson '
    { mean = $0; sub(/.*tet10-mean /, "", mean); sub(/ s.*/, " s", mean)
      four = $0; sub(/.*tet4 /, "", four); times = four; sub(/ s,.*/, " s", four)
      sub(/^[^,]*, /, "", times); sub(/ times as much.*/, "", times)
      print "| " nu " | " mean " | " four " | " times " |" }'
done
