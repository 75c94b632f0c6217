/* curves.h: samples the energies of `flesh material` along simple deformations. */
#ifndef FLESH_MATERIAL_CURVES_H
#define FLESH_MATERIAL_CURVES_H

#include "flesh/material.h"
#include "picture/plot.h"

enum {
  FLESH_CURVES_MAX = 2 * FLESH_ENERGY_COUNT, /* some energies have two curves, as D raw and as_e */
  FLESH_CURVE_STEPS = 300,
  FLESH_CURVE_QUANTITIES = 3, /* energy above rest [J/m^3], stress, smallest eigenvalue [Pa] */
  FLESH_DEFORMATIONS = 5
};

/* A curve in every picture: an energy with one kind of constants. */
typedef struct flesh_curve {
  flesh_material material;
  char label[32]; /* "D raw" */
  double rest_value;
} flesh_curve;

/* A deformation F(s) for s from `start` to `end`. */
typedef struct flesh_deformation {
  const char *name, *title, *parameter, *stress; /* the last three in gnuplot's markup */
  double start, end;
  void (*at)(double s, double F[9]);
  int row, column; /* of the stress component that is drawn; row -1: |P| */
} flesh_deformation;

enum { FLESH_FLATTENING = 2 };
extern const flesh_deformation flesh_deformations[FLESH_DEFORMATIONS];
/* Deformations at constant volume, for incompressible materials. */
extern const flesh_deformation flesh_isochoric_deformations[FLESH_DEFORMATIONS];

/* Computes the curve's quantities at parameter s, and its energy [J/m^3] in *energy; NaN for those that are not
 * defined. The stress of an incompressible material is P - p cof F with the pressure p for which P_33 is 0; its
 * eigenvalue is the smallest over changes of F at constant volume. */
void flesh_curve_sample(const flesh_curve *curve, const flesh_deformation *deformation, double s, double *energy,
                        double quantities[FLESH_CURVE_QUANTITIES]);

/* The curves to draw. */
typedef struct flesh_curves {
  const flesh_deformation *deformations; /* [FLESH_DEFORMATIONS] */
  int count;
  flesh_curve curves[FLESH_CURVES_MAX];
  double mu, lambda;     /* small-strain constants, Pa; lambda is infinite at Poisson's ratio 1/2 */
  double young, poisson; /* NaN if the constants are given as mu and lambda */
} flesh_curves;

/* Writes material.csv and, for every deformation, NAME.gp into `folder`, and draws NAME.png. *outcome: outcome of the
 * drawing. */
int flesh_curves_write(const char *folder, const flesh_curves *all, flesh_plot_outcome *outcome);

#endif
