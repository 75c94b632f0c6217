/* curves.c: the deformations of `flesh material` and what the energies do along them. */
#include "material/curves.h"

#include <assert.h>
#include <math.h>
#include <string.h>

static void diagonal(double a, double b, double c, double F[9])
{
  memset(F, 0, 9 * sizeof *F);
  F[0] = a, F[4] = b, F[8] = c;
}

static void stretch_at(double s, double F[9]) { diagonal(s, 1, 1, F); }
static void scale_at(double s, double F[9]) { diagonal(s, s, s, F); }
static void flatten_at(double s, double F[9]) { diagonal(1, 1, s, F); }

static void shear_at(double s, double F[9])
{
  diagonal(1, 1, 1, F);
  F[1] = s;
}

static void rotation_at(double degrees, double F[9])
{
  double c = cos(degrees * M_PI / 180), s = sin(degrees * M_PI / 180);
  diagonal(c, c, 1, F);
  F[1] = -s, F[3] = s;
}

const flesh_path flesh_paths[] = {
    [FLESH_PATH_STRETCH] = {"stretch", "Uniaxial stretch, sides held: F = diag(s, 1, 1)",
                            "stretch s", "P_{11}", 0, 3, stretch_at, 0, 0},
    [FLESH_PATH_SCALE] = {"scale", "Uniform scaling through a point: F = s I", "scale s", "P_{11}",
                          1.25, -0.25, scale_at, 0, 0},
    [FLESH_PATH_FLATTEN] = {"flatten", "Flattening through zero to inversion: F = diag(1, 1, s)",
                            "thickness s", "P_{33}", 2, -1, flatten_at, 2, 2},
    [FLESH_PATH_SHEAR] = {"shear", "Simple shear: F = I + {/Symbol g} e_1 e_2^T",
                          "shear {/Symbol g}", "P_{12}", 0, 3, shear_at, 0, 1},
    [FLESH_PATH_ROTATION] = {"rotation", "Rigid rotation about z (everything must stay constant)",
                             "angle [degrees]", "|P|", 0, 180, rotation_at, -1, -1}};
static_assert(sizeof flesh_paths / sizeof *flesh_paths == FLESH_PATHS, "a row of every path");

double flesh_path_parameter(const flesh_path *path, int k)
{
  return path->start + (path->end - path->start) * k / FLESH_CURVE_STEPS;
}

void flesh_curve_sample(const flesh_curve *curve, const flesh_path *path, double s, double *energy,
                        double quantities[FLESH_CURVE_QUANTITIES])
{
  double F[9], P[9], values[9], vectors[81];
  path->at(s, F);
  *energy = quantities[0] = quantities[1] = quantities[2] = NAN;
  if (flesh_material_energy(&curve->material, F, energy)) return;
  quantities[0] = *energy - curve->rest_value;
  if (!flesh_material_stress(&curve->material, F, P)) {
    double sum = 0;
    for (int k = 0; k < 9; k++) sum += P[k] * P[k];
    quantities[1] = path->row < 0 ? sqrt(sum) : P[3 * path->row + path->column];
  }
  if (!flesh_material_eigen(&curve->material, F, values, vectors)) {
    quantities[2] = values[0];
    for (int k = 1; k < 9; k++) quantities[2] = fmin(quantities[2], values[k]);
  }
}
