/* command_material.c: `flesh material` tabulates and draws the energies along stretch, scaling,
 * flattening, shear and rotation, and says in words how each rests and where it breaks. */
#include "command_material.h"

#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "flesh/material.h"
#include "palette.h"

enum { EXIT_FINE = 0, EXIT_USAGE = 2, EXIT_FILE = 3 };
enum { CURVES_MAX = 9, STEPS = 300, QUANTITIES = 3 };

static const char usage[] =
    "usage: flesh material --out DIR [options]\n"
    "Tabulates and draws the energies along five paths: material.csv, one picture per path, and\n"
    "material.gp, the gnuplot script that drew them. Energies in J/m^3, stresses and eigenvalues\n"
    "in Pa; a field is empty where the energy has no value.\n"
    "  --out DIR           where to write; made if it is not there\n"
    "  --energies LIST     of Neo,A,B,C,M,D,E,S (default: all)\n"
    "  --young E           Young's modulus, Pa (default 1e5)\n"
    "  --poisson NU        Poisson's ratio (default 0.45)\n"
    "  --mu MU --lambda L  the Lame constants instead, Pa\n"
    "  --constants KIND    matched (default) or raw; M, C and D, which have no matched constants,\n"
    "                      are then shown raw, D as_e (with E's constants) as well\n";

/* One energy with one kind of constants: a curve in every plot. */
typedef struct curve {
  flesh_material material;
  char label[32];
  double rest_value;
} curve;

typedef struct options {
  const char *out;
  int chosen[FLESH_ENERGY_COUNT];
  flesh_constants constants;
  double young, poisson, mu, lambda; /* NaN where not given */
} options;

typedef struct path {
  const char *name, *title, *parameter, *stress;
  double start, end;
  void (*at)(double s, double F[9]);
  int row, column; /* of the stress shown; -1 for |P| */
} path;

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

static const path paths[] = {{"stretch", "Uniaxial stretch, sides held: F = diag(s, 1, 1)",
                              "stretch s", "P_{11}", 0, 3, stretch_at, 0, 0},
                             {"scale", "Uniform scaling through a point: F = s I", "scale s",
                              "P_{11}", 1.25, -0.25, scale_at, 0, 0},
                             {"flatten", "Flattening through zero to inversion: F = diag(1, 1, s)",
                              "thickness s", "P_{33}", 2, -1, flatten_at, 2, 2},
                             {"shear", "Simple shear: F = I + {/Symbol g} e_1 e_2^T",
                              "shear {/Symbol g}", "P_{12}", 0, 3, shear_at, 0, 1},
                             {"rotation", "Rigid rotation about z (everything must stay constant)",
                              "angle [degrees]", "|P|", 0, 180, rotation_at, -1, -1}};
enum { PATHS = sizeof paths / sizeof *paths };

/* Energy minus its rest value, stress and smallest eigenvalue at one place; NaN where undefined. */
static void sample(const curve *c, const path *p, double s, double *energy, double q[QUANTITIES])
{
  double F[9], P[9], values[9], vectors[81];
  p->at(s, F);
  *energy = q[0] = q[1] = q[2] = NAN;
  if (flesh_material_energy(&c->material, F, energy)) return;
  q[0] = *energy - c->rest_value;
  if (!flesh_material_stress(&c->material, F, P)) {
    double sum = 0;
    for (int k = 0; k < 9; k++) sum += P[k] * P[k];
    q[1] = p->row < 0 ? sqrt(sum) : P[3 * p->row + p->column];
  }
  if (!flesh_material_eigen(&c->material, F, values, vectors)) {
    q[2] = values[0];
    for (int k = 1; k < 9; k++) q[2] = fmin(q[2], values[k]);
  }
}

static double parameter_at(const path *p, int k)
{
  return p->start + (p->end - p->start) * k / STEPS;
}

/* ---- options ---- */

static int refuse(const char *format, ...)
{
  va_list args;
  va_start(args, format);
  fputs("flesh material: ", stderr);
  vfprintf(stderr, format, args);
  fputc('\n', stderr);
  va_end(args);
  return EXIT_USAGE;
}

static int parse_number(const char *key, const char *text, double *value)
{
  char *end;
  *value = strtod(text, &end);
  if (end == text || *end || !isfinite(*value))
    return refuse("%s is '%s'; it must be a finite number", key, text);
  return EXIT_FINE;
}

static int parse_energies(const char *list, options *o)
{
  memset(o->chosen, 0, sizeof o->chosen);
  for (const char *at = list;;) {
    size_t length = strcspn(at, ",");
    char name[16];
    flesh_energy energy;
    snprintf(name, sizeof name, "%.*s", (int)(length < 15 ? length : 15), at);
    if (flesh_energy_from_name(name, &energy)) return refuse("--energies: %s", flesh_error_text());
    o->chosen[energy] = 1;
    if (!at[length]) return EXIT_FINE;
    at += length + 1;
  }
}

static int parse(int argc, char **argv, options *o)
{
  *o = (options){
      .constants = FLESH_CONSTANTS_MATCHED, .young = NAN, .poisson = NAN, .mu = NAN, .lambda = NAN};
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++) o->chosen[e] = 1;
  for (int a = 1; a < argc; a++) {
    char key[24];
    const char *equals = strchr(argv[a], '='), *value;
    size_t length = equals ? (size_t)(equals - argv[a]) : strlen(argv[a]);
    snprintf(key, sizeof key, "%.*s", (int)(length < 23 ? length : 23), argv[a]);
    static const char *const keys[] = {"--out", "--energies", "--young",    "--poisson",
                                       "--mu",  "--lambda",   "--constants"};
    int known = 0, status = EXIT_FINE;
    for (unsigned k = 0; k < sizeof keys / sizeof *keys; k++) known |= !strcmp(key, keys[k]);
    if (!known)
      return refuse("unknown argument '%s'; it must be one of --out, --energies, --young, "
                    "--poisson, --mu, --lambda, --constants, --help",
                    argv[a]);
    if (!equals && a + 1 >= argc) return refuse("%s lacks its value", key);
    value = equals ? equals + 1 : argv[++a];
    if (!strcmp(key, "--out")) o->out = value;
    if (!strcmp(key, "--energies")) status = parse_energies(value, o);
    if (!strcmp(key, "--young")) status = parse_number(key, value, &o->young);
    if (!strcmp(key, "--poisson")) status = parse_number(key, value, &o->poisson);
    if (!strcmp(key, "--mu")) status = parse_number(key, value, &o->mu);
    if (!strcmp(key, "--lambda")) status = parse_number(key, value, &o->lambda);
    if (!strcmp(key, "--constants") &&
        (flesh_constants_from_name(value, &o->constants) || o->constants == FLESH_CONSTANTS_AS_E))
      status = refuse("--constants is '%s'; it must be raw or matched", value);
    if (status) return status;
  }
  if (!o->out || !*o->out)
    return refuse("--out is missing; it must name a directory for the table and the plots");
  if (strpbrk(o->out, "\n\r"))
    return refuse("--out holds a line break; it must be a directory's name on one line");
  int lame = !isnan(o->mu) + !isnan(o->lambda), young = !isnan(o->young) + !isnan(o->poisson);
  if (lame && young)
    return refuse("--mu, --lambda and --young, --poisson were both given; choose one pair");
  if (lame == 1)
    return refuse("--%s is missing; --mu and --lambda go together", isnan(o->mu) ? "mu" : "lambda");
  if (lame) return EXIT_FINE;
  if (isnan(o->young)) o->young = 1e5;
  if (isnan(o->poisson)) o->poisson = 0.45;
  return EXIT_FINE;
}

/* ---- the curves ---- */

static int add_curve(const options *o, flesh_energy energy, flesh_constants constants,
                     curve *curves, int *count)
{
  static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  curve *c = &curves[*count];
  int status =
      isnan(o->mu)
          ? flesh_material_from_young(energy, constants, o->young, o->poisson, &c->material)
          : flesh_material_from_lame(energy, constants, o->mu, o->lambda, &c->material);
  if (status) return refuse("%s is left out: %s", flesh_energy_name(energy), flesh_error_text());
  snprintf(c->label, sizeof c->label, "%s %s", flesh_energy_name(energy),
           flesh_constants_name(constants));
  if (flesh_material_energy(&c->material, identity, &c->rest_value))
    return refuse("%s is left out: its energy at rest is too large for a number", c->label);
  (*count)++;
  return EXIT_FINE;
}

static int make_curves(const options *o, curve curves[CURVES_MAX])
{
  int count = 0;
  for (int e = 0; e < FLESH_ENERGY_COUNT; e++) {
    if (!o->chosen[e]) continue;
    int stressed = e == FLESH_ENERGY_M || e == FLESH_ENERGY_C || e == FLESH_ENERGY_D;
    add_curve(o, (flesh_energy)e, stressed ? FLESH_CONSTANTS_RAW : o->constants, curves, &count);
    if (e == FLESH_ENERGY_D && o->constants == FLESH_CONSTANTS_MATCHED)
      add_curve(o, FLESH_ENERGY_D, FLESH_CONSTANTS_AS_E, curves, &count);
  }
  return count;
}

/* ---- words ---- */

static double flat_eigenvalue(const curve *c, double s)
{
  double energy, q[QUANTITIES];
  sample(c, &paths[2], s, &energy, q);
  return q[2];
}

/* The thickness below 1 at which the smallest eigenvalue first turns negative under flattening; NaN
 * when it stays positive as long as the energy has a value. */
static double softening(const curve *c)
{
  double above = 1;
  for (int k = 0; k <= STEPS; k++) {
    double below = 1 - 2. * k / STEPS, value = flat_eigenvalue(c, below);
    if (isnan(value)) return NAN;
    if (value < -1e-12 * c->material.mu) {
      for (int n = 0; n < 40; n++) {
        double middle = 0.5 * (above + below);
        if (flat_eigenvalue(c, middle) < -1e-12 * c->material.mu) below = middle;
        else above = middle;
      }
      return above;
    }
    above = below;
  }
  return NAN;
}

static void describe(const curve *c)
{
  static const double nothing[9] = {0}, mirror[9] = {1, 0, 0, 0, 1, 0, 0, 0, -1},
                      flat[9] = {1, 0, 0, 0, 1, 0, 0, 0, 0};
  const flesh_material *m = &c->material;
  double mu, lambda, stress, ratio, P[9], values[9], vectors[81];
  flesh_material_small_strain(m, &mu, &lambda, &stress);
  printf("%-12s mu %.6g Pa, lambda %.6g Pa", c->label, m->mu, m->lambda);
  if (m->alpha != 1) printf(", alpha %.6g", m->alpha);
  printf("\n             at rest: ");
  if (fabs(stress) <= 1e-12 * m->mu)
    printf("no stress; small strain mu %.6g, lambda %.6g Pa", mu, lambda);
  else printf("stress %.6g Pa", stress);
  if (flesh_material_rest_ratio(m, &ratio)) printf("; a free body has no rest volume");
  else printf("; a free body rests at %.6g of its volume", ratio);
  printf("\n             beyond: ");
  int inverts = !flesh_material_stress(m, mirror, P);
  double soft = softening(c);
  printf(inverts ? "never undefined" : "undefined for J <= 0");
  if (!flesh_material_stress(m, flat, P)) printf("; pressed flat by %.6g Pa", 0 - P[8]);
  else printf("; pressing it flat takes ever more");
  if (flat_eigenvalue(c, 1) < -1e-12 * m->mu) printf("; its Hessian is indefinite already at rest");
  else if (isnan(soft)) printf("; flattening keeps its Hessian definite");
  else if (soft > 0.999) printf("; the least flattening makes its Hessian indefinite");
  else printf("; its Hessian is indefinite below thickness %.4g", soft);
  if (!flesh_material_eigen(m, nothing, values, vectors)) {
    double smallest = values[0];
    for (int k = 1; k < 9; k++) smallest = fmin(smallest, values[k]);
    printf(smallest > 0 ? "; F = 0 is a local minimum"
                        : "; F = 0 is an equilibrium of zero stiffness");
  }
  printf("\n");
}

/* ---- files ---- */

static int file_error(const char *name)
{
  fprintf(stderr, "flesh material: %s: %s\n", name, strerror(errno));
  return EXIT_FILE;
}

/* DIR/NAME with `suffix`; new. */
static char *name_in(const char *dir, const char *name, const char *suffix)
{
  size_t size = strlen(dir) + strlen(name) + strlen(suffix) + 2;
  char *joined = malloc(size);
  if (joined) snprintf(joined, size, "%s/%s%s", dir, name, suffix);
  return joined;
}

static int make_directory(const char *dir)
{
  char *part = strdup(dir);
  if (!part) return file_error(dir);
  for (char *at = part + 1; *at; at++)
    if (*at == '/') {
      *at = 0;
      mkdir(part, 0777); /* what is missing shows at the last one */
      *at = '/';
    }
  struct stat info;
  int failed = mkdir(part, 0777) && errno != EEXIST;
  if (!failed && (stat(part, &info) || !S_ISDIR(info.st_mode))) errno = ENOTDIR, failed = 1;
  if (failed) file_error(dir);
  free(part);
  return failed ? EXIT_FILE : EXIT_FINE;
}

/* Moves DIR/NAME.part to DIR/NAME. */
static int finish_file(const char *dir, const char *name)
{
  char *from = name_in(dir, name, ".part"), *to = name_in(dir, name, "");
  int failed = !from || !to || rename(from, to);
  if (failed) file_error(to ? to : dir);
  free(from);
  free(to);
  return failed ? EXIT_FILE : EXIT_FINE;
}

typedef void (*writer)(FILE *file, const curve *curves, int count, const options *o);

static int write_file(const char *name, writer write, const curve *curves, int count,
                      const options *o)
{
  char *part = name_in(o->out, name, ".part");
  FILE *file = part ? fopen(part, "w") : NULL;
  int status = EXIT_FINE;
  if (!file) status = file_error(part ? part : o->out);
  else {
    write(file, curves, count, o);
    int bad = ferror(file);
    if (fclose(file) || bad) {
      status = file_error(part);
      remove(part);
    }
  }
  free(part);
  return status ? status : finish_file(o->out, name);
}

static void put_number(FILE *file, double value)
{
  fputc(',', file);
  if (isfinite(value)) fprintf(file, "%.12g", value);
}

static void write_table(FILE *file, const curve *curves, int count, const options *o)
{
  (void)o;
  fputs("path,parameter,energy,constants,mu,lambda,psi,psi_minus_rest,stress,smallest_eigenvalue\n",
        file);
  for (int p = 0; p < PATHS; p++)
    for (int c = 0; c < count; c++)
      for (int k = 0; k <= STEPS; k++) {
        double energy, q[QUANTITIES], s = parameter_at(&paths[p], k);
        const flesh_material *m = &curves[c].material;
        sample(&curves[c], &paths[p], s, &energy, q);
        fprintf(file, "%s,%.6g,%s,%s", paths[p].name, s, flesh_energy_name(m->energy),
                flesh_constants_name(m->constants));
        put_number(file, m->mu);
        put_number(file, m->lambda);
        put_number(file, energy);
        for (int n = 0; n < QUANTITIES; n++) put_number(file, q[n]);
        fputc('\n', file);
      }
}

/* ---- plots ---- */

static int ascending(const void *a, const void *b)
{
  double x = *(const double *)a, y = *(const double *)b;
  return (x > y) - (x < y);
}

/* The range of one panel: what all curves cover, without the few values next to a singularity. */
static void panel_range(const path *p, int quantity, const curve *curves, int count, double unit,
                        double range[2])
{
  static double values[CURVES_MAX * (STEPS + 1)];
  int n = 0;
  for (int c = 0; c < count; c++)
    for (int k = 0; k <= STEPS; k++) {
      double energy, q[QUANTITIES];
      sample(&curves[c], p, parameter_at(p, k), &energy, q);
      if (isfinite(q[quantity])) values[n++] = q[quantity] / unit;
    }
  qsort(values, (size_t)n, sizeof *values, ascending);
  /* Energies have a least value, worth seeing. */
  range[0] = n ? values[quantity == 0 ? 0 : n / 20] : 0;
  range[1] = n ? values[n - 1 - n / 20] : 0;
  double margin = fmax(0.08 * (range[1] - range[0]), 0.05);
  range[0] -= margin;
  range[1] += margin;
}

static void given_lame(const options *o, double *mu, double *lambda)
{
  *mu = o->mu, *lambda = o->lambda;
  if (!isnan(o->mu)) return;
  *mu = o->young / (2 * (1 + o->poisson));
  *lambda = o->young * o->poisson / ((1 + o->poisson) * (1 - 2 * o->poisson));
}

/* Solid where matched, dashed where raw, dotted as_e; the later ones thinner, so that coinciding
 * curves all show. */
static void put_style(FILE *file, const curve *c, int index)
{
  static const char *const dash[] = {"(12,5)", "solid", "(3,4)"};
  fprintf(file, "lc rgb '%s' dt %s lw %.1f", flesh_palette_colour(c->material.energy),
          dash[c->material.constants], 6.5 - 0.55 * index);
}

static void write_script(FILE *file, const curve *curves, int count, const options *o)
{
  static const char *const titles[QUANTITIES] = {"Energy above rest", "Stress",
                                                 "Smallest eigenvalue of the Hessian"};
  double mu, lambda;
  given_lame(o, &mu, &lambda);
  fprintf(file,
          "# Draws material.csv: run gnuplot on this script in its folder.\n"
          "if (!exists('suffix')) suffix = ''\n"
          "set datafile separator ','\n"
          "set terminal pngcairo size 1200,860 font 'Sans,11' background '#FFFFFF'\n"
          "unit = %.17g\n"
          "set encoding utf8\n"
          "pick(path, energy, constants, column) = (strcol(1) eq path && strcol(3) eq energy && "
          "strcol(4) eq constants) ? column / unit : NaN\n",
          mu);
  for (int p = 0; p < PATHS; p++) {
    const path *q = &paths[p];
    fprintf(file,
            "\nset output '%s.png'.suffix\n"
            "set multiplot layout 2,2 margins 0.075,0.975,0.075,0.885 spacing 0.085,0.115 "
            "title \"%s\\n\" font 'Sans,15'\n"
            "set border 3 lc rgb '#404040'\nset tics nomirror\nset grid lc rgb '#DDDDDD' lt 1\n"
            "set key off\nset xrange [%g:%g]\nset xlabel '%s' offset 0,0.3\n"
            "set xzeroaxis lc rgb '#404040' lt 1\n",
            q->name, q->title, fmin(q->start, q->end), fmax(q->start, q->end), q->parameter);
    for (int n = 0; n < QUANTITIES; n++) {
      static const char *const symbols[] = {"({/Symbol y} - {/Symbol y}_{rest})", NULL,
                                            "smallest eigenvalue"};
      double range[2];
      panel_range(q, n, curves, count, mu, range);
      fprintf(file, "set title '%s' font 'Sans,12'\nset ylabel '%s / {/Symbol m}' offset 1,0\n",
              titles[n], symbols[n] ? symbols[n] : q->stress);
      fprintf(file, "set yrange [%g:%g]\nplot \\\n", range[0], range[1]);
      for (int c = 0; c < count; c++) {
        fprintf(file, "  'material.csv' skip 1 using 2:(pick('%s','%s','%s',$%d)) with lines ",
                q->name, flesh_energy_name(curves[c].material.energy),
                flesh_constants_name(curves[c].material.constants), 8 + n);
        put_style(file, &curves[c], c);
        fputs(c + 1 < count ? " notitle, \\\n" : " notitle\n", file);
      }
    }
    /* The fourth cell holds the legend. */
    fprintf(file,
            "unset border\nunset tics\nunset grid\nunset xlabel\nunset ylabel\nunset xzeroaxis\n"
            "set title 'Energies and their constants' font 'Sans,12'\n"
            "set key center center samplen 6 spacing 1.5 font 'Sans,12' "
            "Left reverse width 2\nset xrange [0:1]\nset yrange [0:1]\n");
    fprintf(file, "set label 1 '{/Symbol m} = %.4g Pa, {/Symbol l} = %.4g Pa", mu, lambda);
    if (isnan(o->mu)) fprintf(file, "  (E = %.4g Pa, {/Symbol n} = %.6g)", o->young, o->poisson);
    fprintf(file, "' at graph 0.5,0.03 center font 'Sans,11'\n"
                  "set label 2 'A curve ends where its energy has no value; of coinciding ones the "
                  "later is thinner' at graph 0.5,-0.05 center "
                  "font 'Sans,9' tc rgb '#606060'\nplot NaN notitle, \\\n");
    for (int c = 0; c < count; c++) {
      fputs("  keyentry with lines ", file);
      put_style(file, &curves[c], c);
      fprintf(file, " title '%s'%s\n",
              curves[c].material.constants == FLESH_CONSTANTS_AS_E ? "D as\\_e" : curves[c].label,
              c + 1 < count ? ", \\" : "");
    }
    fprintf(file, "unset label\nunset multiplot\nset output\n");
  }
}

/* gnuplot draws into NAME.png.part, so that a failure leaves no half a picture. */
static int draw(const options *o)
{
  FILE *gnuplot = popen("gnuplot", "w");
  int status = 0;
  if (gnuplot) {
    fputs("cd '", gnuplot);
    for (const char *at = o->out; *at; at++) fputs(*at == '\'' ? "''" : (char[]){*at, 0}, gnuplot);
    fputs("'\nsuffix = '.part'\nload 'material.gp'\n", gnuplot);
    status = pclose(gnuplot);
  }
  if (!gnuplot || status) {
    for (int p = 0; p < PATHS; p++) {
      char *part = name_in(o->out, paths[p].name, ".png.part");
      if (part) remove(part);
      free(part);
    }
    fprintf(stderr,
            "flesh material: no pictures: gnuplot is not installed or failed; the table "
            "%s/material.csv is complete\n",
            o->out);
    return EXIT_FILE;
  }
  for (int p = 0; p < PATHS; p++) {
    char name[32];
    snprintf(name, sizeof name, "%s.png", paths[p].name);
    if (finish_file(o->out, name)) return EXIT_FILE;
  }
  return EXIT_FINE;
}

int flesh_command_material(int argc, char **argv)
{
  for (int a = 1; a < argc; a++)
    if (!strcmp(argv[a], "--help") || !strcmp(argv[a], "-h")) {
      fputs(usage, stdout);
      return EXIT_FINE;
    }
  options o;
  int status = parse(argc, argv, &o);
  if (status) return status;
  /* What no form takes is said once; M has no limits of its own. */
  flesh_material any;
  if (isnan(o.mu)
          ? flesh_material_from_young(FLESH_ENERGY_M, FLESH_CONSTANTS_RAW, o.young, o.poisson, &any)
          : flesh_material_from_lame(FLESH_ENERGY_M, FLESH_CONSTANTS_RAW, o.mu, o.lambda, &any))
    return refuse("%s", flesh_error_text());
  curve curves[CURVES_MAX];
  int count = make_curves(&o, curves);
  if (!count) return refuse("no energy is left to show");
  status = make_directory(o.out);
  if (!status) status = write_file("material.csv", write_table, curves, count, &o);
  if (!status) status = write_file("material.gp", write_script, curves, count, &o);
  if (status) return status;

  double mu, lambda;
  given_lame(&o, &mu, &lambda);
  printf("Given: mu %.6g Pa, lambda %.6g Pa", mu, lambda);
  if (isnan(o.mu)) printf(" (E %.6g Pa, nu %.15g)", o.young, o.poisson);
  printf("\n");
  for (int c = 0; c < count; c++) describe(&curves[c]);
  fflush(stdout);
  status = draw(&o);
  if (!status) {
    printf("Table: %s/material.csv\nPictures:", o.out);
    for (int p = 0; p < PATHS; p++) printf(" %s/%s.png", o.out, paths[p].name);
    printf("\n");
  }
  return status;
}
