/* fuzz_sweep.c: specifications of sweeps, and the cases they generate. */
#define _GNU_SOURCE
#include "fuzz.h"

#include "sweep/sweep.h"

int LLVMFuzzerInitialize(int *argc, char ***argv);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerInitialize(int *argc, char ***argv)
{
  (void)argc, (void)argv;
  fuzz_start();
  static const char mesh[] = "nodes 4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\ntets 1\n0 1 2 3\n";
  static const char scene[] =
      "body: {mesh: mesh, density: 1000, material: {energy: S, young: 1e5, poisson: 0.45}}\n"
      "effects: [inertia: {}, gravity: {acceleration: [0, 0, -9.81]}]\n"
      "time: {method: backward-euler, step: 1/60, end: 1/2}\n";
  fuzz_write("mesh", mesh, strlen(mesh));
  fuzz_write("a.yaml", scene, strlen(scene));
  fuzz_write("b.yaml", scene, strlen(scene));
  return 0;
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
  flesh_sweep sweep = {0};
  fuzz_write("spec.yaml", data, size);
  int status = flesh_sweep_read("spec.yaml", &sweep);
  fuzz_status(status);
  if (!status) {
    const flesh_study study = flesh_sweep_study(&sweep);
    fuzz_expect(study.case_count >= 1, "a sweep without a case");
    for (int k = 0; k < 3; k++) {
      flesh_study_case made;
      const int number = k == 0 ? 0 : k == 1 ? study.case_count - 1 : study.case_count / 2;
      fuzz_expect(!study.make(study.data, number, &made), "a case of a good sweep cannot be made");
      for (int c = 0; c < sweep.column_count; c++) fuzz_expect(made.values[c] != NULL, "a case without a value");
      flesh_study_case_free(&made);
    }
  }
  flesh_sweep_close(&sweep);
  return 0;
}
