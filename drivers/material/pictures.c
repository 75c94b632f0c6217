/* pictures.c: a picture per deformation: energy, stress and smallest eigenvalue of all
 * curves, with a legend. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/text.h"
#include "base/sort.h"
#include "material/curves.h"
#include "picture/plot.h"
#include "picture/plot_text.h"
#include "material/form.h"

/* The range of one panel: what all curves cover, without the few values next to a singularity. */
static void panel_range(const flesh_path *path, int quantity, const flesh_curves *all,
                        double range[2])
{
  double values[FLESH_CURVES_MAX * (FLESH_CURVE_STEPS + 1)];
  int n = 0;
  for (int c = 0; c < all->count; c++)
    for (int k = 0; k <= FLESH_CURVE_STEPS; k++) {
      double energy, q[FLESH_CURVE_QUANTITIES];
      flesh_curve_sample(&all->curves[c], path, flesh_path_parameter(path, k), &energy, q);
      if (isfinite(q[quantity])) values[n++] = q[quantity] / all->mu;
    }
  qsort(values, (size_t)n, sizeof *values, flesh_compare_double);
  /* Energies have a least value, worth seeing. */
  range[0] = n ? values[quantity == 0 ? 0 : n / 20] : 0;
  range[1] = n ? values[n - 1 - n / 20] : 0;
  double margin = fmax(0.08 * (range[1] - range[0]), 0.05);
  range[0] -= margin;
  range[1] += margin;
}

/* A panel's curves: those that lie on each other are drawn as one. */
typedef struct panel {
  int quantity, same_as[FLESH_CURVES_MAX]; /* the curve that it lies on, itself where it is the first */
  double range[2];
} panel;

/* The panel's value of a curve at every step. */
static void sample(const flesh_path *path, const flesh_curve *curve, const panel *p, double mu, double *values)
{
  for (int k = 0; k <= FLESH_CURVE_STEPS; k++) {
    double energy, q[FLESH_CURVE_QUANTITIES];
    flesh_curve_sample(curve, path, flesh_path_parameter(path, k), &energy, q);
    values[k] = fmin(fmax(q[p->quantity] / mu, p->range[0]), p->range[1]); /* outside is outside */
    if (isnan(q[p->quantity])) values[k] = NAN;
  }
}

/* Curves nowhere further apart than half the line's width, and with values at the same places. */
static void find_same(const flesh_path *path, const flesh_curves *all, panel *p)
{
  double one[FLESH_CURVE_STEPS + 1], other[FLESH_CURVE_STEPS + 1];
  for (int c = 0; c < all->count; c++) {
    p->same_as[c] = c;
    sample(path, &all->curves[c], p, all->mu, one);
    for (int b = 0; b < c && p->same_as[c] == c; b++) {
      if (p->same_as[b] != b) continue;
      sample(path, &all->curves[b], p, all->mu, other);
      int same = 1;
      for (int k = 0; k <= FLESH_CURVE_STEPS && same; k++)
        same = isnan(one[k]) ? isnan(other[k]) : fabs(one[k] - other[k]) < 3e-3 * (p->range[1] - p->range[0]);
      if (same) p->same_as[c] = b;
    }
  }
}

static const char *name_of(const flesh_curve *curve)
{
  int is_d = flesh_form_takes(curve->material.energy, FLESH_CONSTANTS_AS_E); /* stands twice */
  if (!is_d) return flesh_energy_name(curve->material.energy);
  return curve->label;
}

/* "one line: A, B; another: D raw, M", or nothing. */
static void list_same(const flesh_curves *all, const panel *p, char *text, size_t size)
{
  *text = 0;
  for (int c = 0; c < all->count; c++) {
    int lines = 0;
    for (int b = c + 1; b < all->count; b++) {
      if (p->same_as[b] != c) continue;
      if (!lines++) flesh_text_add(text, size, "%s: %s", *text ? "; another" : "one line", name_of(&all->curves[c]));
      flesh_text_add(text, size, ", %s", name_of(&all->curves[b]));
    }
  }
}

/* Solid where matched, dashed where raw, dotted as_e. */
static void put_style(FILE *stream, const flesh_curve *curve)
{
  static const char *const dash[] = {"(11,8)", "solid", "(2,6)"};
  fprintf(stream, "lc rgb '%s' dt %s lw 2.4", flesh_forms[curve->material.energy].colour,
          dash[curve->material.constants]);
}

static void put_panel(FILE *stream, const flesh_path *path, int quantity, const flesh_curves *all)
{
  static const char *const titles[] = {"Energy above rest", "Stress",
                                       "Smallest eigenvalue of the Hessian"};
  const char *symbols[] = {"({/Symbol y} - {/Symbol y}_{rest})", path->stress,
                           "smallest eigenvalue"};
  char same[400];
  panel p = {.quantity = quantity};
  panel_range(path, quantity, all, p.range);
  find_same(path, all, &p);
  list_same(all, &p, same, sizeof same);
  fprintf(stream, "set title '%s' font ',12' offset 0,0.6\nset label 1 ", titles[quantity]);
  flesh_plot_quote(stream, same);
  fprintf(stream,
          " noenhanced at graph 0.5,1.035 center font ',9' tc rgb '#505050'\n"
          "set ylabel '%s / {/Symbol m}  [-]' offset 1,0\nset yrange [%g:%g]\nplot \\\n",
          symbols[quantity], p.range[0], p.range[1]);
  for (int c = 0; c < all->count; c++) {
    const flesh_material *material = &all->curves[c].material;
    if (p.same_as[c] != c) continue;
    fprintf(stream, "  'material.csv' skip 1 using 2:(pick('%s','%s','%s',$%d)) with lines ",
            path->name, flesh_energy_name(material->energy),
            flesh_constants_name(material->constants), 8 + quantity);
    put_style(stream, &all->curves[c]);
    fputs(" notitle, \\\n", stream);
  }
  fputs("  NaN notitle\nunset label 1\n", stream);
}

static void put_legend(FILE *stream, const flesh_curves *all)
{
  fputs("unset border\nunset tics\nunset grid\nunset xlabel\nunset ylabel\nunset xzeroaxis\n"
        "set title 'Energies and their constants' font ',12'\n"
        "set key at graph 0.5,0.56 center center samplen 6 spacing 1.5 font ',12' Left reverse width 2\n"
        "set xrange [0:1]\nset yrange [0:1]\n",
        stream);
  fprintf(stream, "set label 1 '{/Symbol m} = %.4g Pa, {/Symbol l} = %.4g Pa", all->mu,
          all->lambda);
  if (!isnan(all->young))
    fprintf(stream, "  (E = %.4g Pa, {/Symbol n} = %.6g)", all->young, all->poisson);
  fputs("' at graph 0.5,0.03 center font ',11'\n"
        "set label 2 \"A curve ends where its energy has no value.\\n"
        "Curves that lie on each other are one line, listed above the panel.\" at graph 0.5,-0.04 center font ',9' "
        "tc rgb '#606060'\n"
        "plot NaN notitle, \\\n",
        stream);
  for (int c = 0; c < all->count; c++) {
    const flesh_curve *curve = &all->curves[c];
    fputs("  keyentry with lines ", stream);
    put_style(stream, curve);
    fprintf(stream, " title '%s'%s\n",
            curve->material.constants == FLESH_CONSTANTS_AS_E ? "D as\\_e" : curve->label,
            c + 1 < all->count ? ", \\" : "");
  }
}

int flesh_curves_draw(const char *folder, const flesh_path *path, const flesh_curves *all)
{
  flesh_file file;
  int status = flesh_plot_open(folder, path->name, ".gp", &file);
  if (status) return status;
  flesh_plot_begin(file.stream, path->name, 1200, 860);
  fprintf(file.stream,
          "set datafile separator ','\n"
          "unit = %.17g\n"
          "pick(path, energy, constants, column) = (strcol(1) eq path && strcol(3) eq energy && "
          "strcol(4) eq constants) ? column / unit : NaN\n"
          "set multiplot layout 2,2 margins 0.075,0.975,0.075,0.875 spacing 0.085,0.145 "
          "title \"%s\\n\" font ',15'\n"
          "set border 3 lc rgb '#404040'\nset tics nomirror\nset grid lc rgb '#DDDDDD' lt 1\n"
          "set key off\nset xrange [%g:%g]\nset xlabel '%s' offset 0,0.3\n"
          "set xzeroaxis lc rgb '#404040' lt 1\n",
          all->mu, path->title, fmin(path->start, path->end), fmax(path->start, path->end),
          path->parameter);
  for (int q = 0; q < FLESH_CURVE_QUANTITIES; q++) put_panel(file.stream, path, q, all);
  put_legend(file.stream, all); /* in the fourth cell */
  fputs("unset multiplot\n", file.stream);
  status = flesh_file_commit(&file);
  return status ? status : flesh_plot_draw(folder, path->name);
}
