// TEST quick seconds=60
/* test_tight_tube.c: a plug in a tube with a narrower bore is held by the pressure of Lamé's thick-walled tubes, and is
 * pushed through it against the resulting friction. A quarter of both is solved for; no cross-section leaves its plane,
 * so that the ends are like the middle. Plug and tube are so light that they rest at the end of every step. */
#include "barrier_gap.h"
#include "grids.h"

/* Dimensions at rest; the plug, which has a hole, is wider than the bore by FIT. */
static const double BORE = 1, OUTER = 2, HOLE = 0.5, FIT = 2e-3, LENGTH = 0.5;
static const double YOUNG = 1e5, POISSON = 0.3, FRICTION = 0.3, SLIP = 1e-5, THICKNESS = 2e-4, PI = 3.14159265358979;

typedef struct ring {
  double inner, outer;
} ring;

/* Makes a quarter: along the radius, around, along the axis. */
static void bend(const void *data, double x[3])
{
  const ring *self = data;
  const double r = self->inner + (self->outer - self->inner) * x[0], angle = PI / 2 * x[1];
  x[0] = r * cos(angle);
  x[1] = r * sin(angle);
  x[2] *= LENGTH;
}

/* Returns the pressure, Pa, between two tubes whose surfaces have to give way by FIT and by the gap that the barrier
 * keeps at that pressure (Lamé's tubes in plane strain; Timoshenko & Goodier 1970, section 28). */
static double pressure_of_lame(double stiffness)
{
  const double young = YOUNG / (1 - POISSON * POISSON), a = BORE * BORE, b = OUTER * OUTER, c = HOLE * HOLE,
               compliance = BORE / young * ((b + a) / (b - a) + (a + c) / (a - c));
  double pressure = FIT / compliance;
  for (int k = 0; k < 50; k++) pressure = (FIT + barrier_gap(pressure, stiffness, THICKNESS)) / compliance;
  return pressure;
}

typedef struct fit {
  test_body b;
  flesh_body_part parts[2];
  double *x0; /* [n] where the step began */
  int tube_nodes;
} fit;

/* Computes the forces of the contact on the plug, N: outwards from the axis and against the motion. */
static void forces(const fit *self, double *pressing, double *rubbing)
{
  const flesh_state *s = &self->b.state;
  const flesh_effect *contact = flesh_system_effect(self->b.system, flesh_system_effect_count(self->b.system) - 1);
  double *r = calloc((size_t)self->b.n, sizeof *r);
  flesh_point point = flesh_point_at(s->t, s->x, s->v, s->v);
  point.lagged.x = self->x0;
  CHECK_OK(contact->operations->residual(contact, &point, r));
  *pressing = *rubbing = 0;
  for (int d = 3 * self->tube_nodes; d < self->b.n; d += 3) {
    *pressing += (r[d] * s->x[d] + r[d + 1] * s->x[d + 1]) / hypot(s->x[d], s->x[d + 1]);
    *rubbing += r[d + 2];
  }
  free(r);
}

/* Prescribes all nodes' positions along the axis: the tube stays, the plug moves. */
static void drive(fit *self)
{
  test_body *b = &self->b;
  const int nodes = b->n / 3, plug = nodes - self->tube_nodes;
  const flesh_keyframe keys[] = {{.t = 0}, {.t = 1, .translation = {0, 0, 20 * SLIP}}};
  const flesh_motion motion = {.count = 2, .keyframes = keys};
  int *all = malloc((size_t)nodes * sizeof *all);
  for (int k = 0; k < nodes; k++) all[k] = k;
  CHECK_OK(flesh_system_add_pin(b->system, self->tube_nodes, all, FLESH_AXIS_Z, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_add_prescribed_motion(b->system, plug, all + self->tube_nodes, FLESH_AXIS_Z, &motion, -INFINITY,
                                              INFINITY));
  free(all);
  CHECK_OK(test_body_hold(b, 0, 0, FLESH_AXIS_X, NULL, -INFINITY, INFINITY));
  CHECK_OK(test_body_hold(b, 1, 0, FLESH_AXIS_Y, NULL, -INFINITY, INFINITY));
}

/* Compresses the plug initially to fit into the tube. */
static void make(int around, double stiffness, fit *self)
{
  const ring tube = {BORE, OUTER}, plug = {HOLE, BORE + FIT};
  const int radial = 3 * around / 4;
  flesh_mesh *first = grid_of(radial, around, 2, bend, &tube), *second = grid_of(radial, around, 3, bend, &plug);
  flesh_contact_options options;
  flesh_effect *contact = NULL;
  test_body *b = &self->b;
  self->tube_nodes = flesh_mesh_node_count(first);
  CHECK_OK(test_body_create(grids_join(first, second, self->parts), test_material(FLESH_ENERGY_S, POISSON), 1,
                            FLESH_MASS_LUMPED, 1, b));
  b->body.parts = self->parts;
  b->body.part_count = 2;
  drive(self);
  flesh_contact_options_default(&options);
  options.thickness = THICKNESS;
  options.stiffness = stiffness;
  options.friction = FRICTION;
  options.slip_speed = SLIP;
  CHECK_OK(flesh_effect_surface_contact(&b->body, &options, 0, NULL, &contact));
  CHECK_OK(flesh_system_add_effect(b->system, &contact));
  CHECK_OK(flesh_system_finalize(b->system));
  for (int d = 3 * self->tube_nodes; d < b->n; d++)
    if (d % 3 < 2) b->state.x[d] *= 1 - FIT - 2 * THICKNESS;
  CHECK_OK(flesh_system_check(b->system, 0, b->state.x));
  self->x0 = malloc((size_t)b->n * sizeof *self->x0);
}

/* Computes the normal force over Lamé's, and the friction over the normal force and the coefficient. */
static void push(int around, double *pressing, double *rubbing)
{
  const double stiffness = YOUNG, area = PI / 2 * BORE * LENGTH;
  const flesh_solver_options options = test_options(1e-8);
  fit self = {0};
  flesh_integrator *integrator = NULL;
  make(around, stiffness, &self);
  CHECK_OK(flesh_integrator_create(self.b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  for (int step = 0; step < 8; step++) {
    memcpy(self.x0, self.b.state.x, (size_t)self.b.n * sizeof *self.x0);
    CHECK_OK(flesh_integrator_step(integrator, &self.b.state, 0.05, NULL));
  }
  forces(&self, pressing, rubbing);
  printf("# %d cells around: %.6g N outwards, %.6g N along", around, *pressing, *rubbing);
  *rubbing /= FRICTION * *pressing;
  *pressing /= area * pressure_of_lame(stiffness);
  printf("; %.5f of Lamé's, friction %.5f of its coefficient\n", *pressing, *rubbing);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&self.b);
  free(self.x0);
}

/* Circles are polygons: the error of the pressure is of second order and vanishes in its limit, and normals are tilted
 * by up to half an angle between two facets, so friction may be off by .5 and .12 %. */
static void a_plug_is_pushed_against_the_friction_of_its_fit(void)
{
  double pressing[2], rubbing[2];
  for (int k = 0; k < 2; k++) push(k ? 16 : 8, &pressing[k], &rubbing[k]);
  CHECK_NEAR(pressing[0], 1, 0.02);
  CHECK_NEAR((4 * pressing[1] - pressing[0]) / 3, 1, 2e-3);
  CHECK_NEAR(rubbing[0], 1, 0.01);
  CHECK_NEAR(rubbing[1], 1, 0.0025);
}

int main(int argc, char **argv) { return RUN_TESTS(argc, argv, TEST(a_plug_is_pushed_against_the_friction_of_its_fit)); }
