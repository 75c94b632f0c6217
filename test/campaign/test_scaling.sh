# TEST full needs=mpirun,scaling ranks=1,2,3,4,8
# test_scaling.sh RANKS: RANKS ranks exchange in an iteration what the model says, and the page has the model's tables. Speaks
# TAP.
# SCALING names the program of scaling.c, MPIRUN the launcher.
set -u
python=$(command -v /usr/bin/python3 || command -v python3)
folder=$(CDPATH='' cd -- "$(dirname -- "$0")" && pwd)
echo 1..2
counts=$("${MPIRUN:?}" -n "$1" "${SCALING:?}" 10) && printf '%s\n' "$counts" | "$python" "$folder/scaling.py" --check &&
  echo 'ok 1 - counts are those of the model' || echo 'not ok 1 - counts are those of the model'
"$python" "$folder/scaling.py" --page "$folder/../../data/results/scaling.md" &&
  echo "ok 2 - the page has the model's tables" || echo "not ok 2 - the page has the model's tables"
