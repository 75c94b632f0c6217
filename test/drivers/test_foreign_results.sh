# test_foreign_results.sh: folders of results that others made: whatever is in them, commands read and write nothing
# outside of them, do not wait and do not crash. FLESH names the program.
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

# The words of a result.json are as long as its writer likes.
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

run_tests long_words_of_results_are_cut
