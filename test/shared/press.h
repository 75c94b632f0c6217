/* press.h: a ball pressed into a block at rest; the block's mesh is irregular, and finer near the contact. */
#ifndef FLESH_TEST_PRESS_H
#define FLESH_TEST_PRESS_H

#include "body.h"
#include "test.h"

/* Makes a grid of boxes: `place` moves its planes, then inner nodes are moved randomly by up to a tenth of the
 * spacing. */
static inline flesh_mesh *make_mesh(int nx, int ny, int nz, double (*place)(double s, int c))
{
  const int cells[3] = {nx, ny, nz};
  flesh_mesh *box = test_box(nx, ny, nz, 1, 1, 1), *mesh = NULL;
  const int n = 3 * flesh_mesh_node_count(box);
  double *x = malloc((size_t)n * sizeof *x), *random = calloc((size_t)n, sizeof *random);
  memcpy(x, flesh_mesh_positions(box), (size_t)n * sizeof *x);
  test_jitter(n, 1, 3, random);
  for (int d = 0; d < n; d++) {
    const int outer = x[d] < 1e-9 || x[d] > 1 - 1e-9;
    x[d] = place(x[d] + (outer ? 0 : 0.1 / cells[d % 3] * random[d]), d % 3);
  }
  CHECK_OK(flesh_mesh_create(n / 3, x, flesh_mesh_tet_count(box), flesh_mesh_tets(box), NULL, &mesh));
  flesh_mesh_destroy(&box);
  free(x);
  free(random);
  return mesh;
}

/* Returns the force of a ball on a layer bonded to a rigid base: Dimitriadis, Horkay, Maresca, Kachar & Chadwick 2002,
 * "Determination of elastic moduli of thin layers of soft material using the atomic force microscope". */
static inline double force_on_layer(double young, double poisson, double radius, double depth, double height)
{
  const double pi = 3.14159265358979, x = sqrt(radius * depth) / height;
  const double alpha = -(1.2876 - 1.4678 * poisson + 1.3442 * poisson * poisson) / (1 - poisson);
  const double beta = (0.6387 - 1.0277 * poisson + 1.5164 * poisson * poisson) / (1 - poisson);
  const double cube = pow(alpha, 3) + 4 * pi * pi / 15 * beta;
  const double fourth = alpha * (pow(alpha, 3) + 3 * pi * pi / 5 * beta);
  const double more = -2 * alpha / pi * x + 4 * alpha * alpha / (pi * pi) * x * x - 8 / pow(pi, 3) * cube * pow(x, 3) +
                      16 / pow(pi, 4) * fourth * pow(x, 4);
  return 4. / 3 * young / (1 - poisson * poisson) * sqrt(radius) * pow(depth, 1.5) * (1 + more);
}

/* Maps 0 to 1: six tenths of the cells are within a fifth, and grow smoothly beyond. */
static inline double graded(double s)
{
  const double near = 0.2, share = 0.6;
  if (s <= share) return near * s / share;
  const double u = (s - share) / (1 - share), slope = near / share * (1 - share);
  return near + slope * u + (1 - near - slope) * u * u;
}

/* Maps to [0,1] x [0,1] x [-1,0], finer towards the upper corner on the z axis. */
static inline double near_the_axis(double s, int c) { return c == 2 ? -graded(1 - s) : graded(s); }

/* Adds contact with the obstacle, which it takes, with this barrier thickness, as the last effect. */
static inline void add_contact(test_body *b, flesh_obstacle *obstacle, double thickness)
{
  flesh_contact_options options;
  flesh_effect *effect = NULL;
  flesh_contact_options_default(&options);
  options.thickness = thickness;
  CHECK_OK(flesh_effect_obstacle_contact(&b->body, &options, &obstacle, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
}

/* Returns the largest norm of an effect's nodal forces at the state with the accelerations a (NULL: none); for effects
 * that couple nodes, including their reactions. */
static inline double largest_force(const test_body *b, const double *a)
{
  double *r = malloc((size_t)b->n * sizeof *r), *zero = calloc((size_t)b->n, sizeof *zero), largest = 0;
  uint8_t *fixed = malloc((size_t)b->n);
  const flesh_state *s = &b->state;
  const flesh_point point = flesh_point_at(s->t, s->x, s->v, a ? a : zero);
  flesh_system_fixed(b->system, s->t, fixed);
  for (int k = 0; k < flesh_system_effect_count(b->system); k++) {
    const flesh_effect *effect = flesh_system_effect(b->system, k);
    memset(r, 0, (size_t)b->n * sizeof *r);
    CHECK_OK(effect->operations->residual(effect, &point, r));
    for (int d = 0; d < b->n; d++)
      if (!effect->operations->cells && fixed[d]) r[d] = 0;
    largest = fmax(largest, test_norm(b->n, r));
  }
  free(r);
  free(zero);
  free(fixed);
  return largest;
}

/* Returns the upward force of the last effect on the body. */
static inline double contact_force(const test_body *b)
{
  const flesh_effect *effect = flesh_system_effect(b->system, flesh_system_effect_count(b->system) - 1);
  double *r = calloc((size_t)b->n, sizeof *r), sum = 0;
  const flesh_state *s = &b->state;
  const flesh_point point = flesh_point_at(s->t, s->x, s->v, s->v);
  CHECK_OK(effect->operations->residual(effect, &point, r));
  for (int d = 2; d < b->n; d += 3) sum -= r[d];
  free(r);
  return sum;
}

/* Computes the equilibria at the full seconds up to `end`. */
static inline void solve_statics(test_body *b, double tolerance, int end, flesh_solve_stats *stats)
{
  const flesh_solver_options options = test_options(tolerance);
  flesh_integrator *integrator = NULL;
  CHECK_OK(flesh_integrator_create(b->system, FLESH_METHOD_STATIC, &options, &integrator));
  for (int step = 0; step < end; step++) CHECK_OK(flesh_integrator_step(integrator, &b->state, 1, stats));
  if (!stats->at_rounding) CHECK_BELOW(stats->residual_last, (1 + 1e-9) * tolerance * largest_force(b, NULL));
  flesh_integrator_destroy(&integrator);
}

/* Maps to [-1,1] x [-1,1] x [-1,0], finer towards the middle of its top. */
static inline double near_the_top(double s, int c)
{
  if (c == 2) return -pow(1 - s, 2);
  return 2 * s > 1 ? pow(2 * s - 1, 2) : -pow(1 - 2 * s, 2);
}

enum { DEPTHS = 2 };

/* Computes the forces of a ball of 1 m, on a block of this many cells along its sides: at 1 s it is `gap` above the
 * block, at 2 s pressed into it by `depth`. */
static inline void press(int cells, double tolerance, double gap, double depth, double force[DEPTHS])
{
  test_body b;
  flesh_solve_stats stats = {0};
  flesh_obstacle *ball = NULL;
  const double high = 2e-3;
  const flesh_keyframe keys[] = {{.t = 0}, {.t = 1, .translation = {0, 0, gap - high}},
                                 {.t = 2, .translation = {0, 0, -depth - high}}};
  const flesh_motion motion = {.count = 3, .keyframes = keys};
  CHECK_OK(test_body_create(make_mesh(cells, cells, (9 * cells + 8) / 16, near_the_top),
                            test_material(FLESH_ENERGY_S, 0.3), 1000, FLESH_MASS_LUMPED, 0, &b));
  CHECK_OK(test_body_hold(&b, 2, -1, FLESH_AXES_ALL, NULL, -INFINITY, INFINITY));
  CHECK_OK(flesh_obstacle_sphere((const double[]){0, 0, 1 + high}, 1, &ball));
  CHECK_OK(flesh_obstacle_move(ball, &motion));
  add_contact(&b, ball, 1e-4);
  CHECK_OK(flesh_system_finalize(b.system));
  for (int k = 0; k < DEPTHS; k++) {
    solve_statics(&b, tolerance, 1, &stats);
    force[k] = -contact_force(&b);
  }
  printf("# %d cells, tolerance %g, gap %g m: %.7g and %.7g N by %d Newton iterations\n", cells, tolerance, gap,
         force[0], force[1], stats.newton);
  test_body_destroy(&b);
}

#endif
