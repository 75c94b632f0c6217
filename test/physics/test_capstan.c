// TEST full seconds=300
/* test_capstan.c: a band around half of a drum, held at one end and loaded at the other. The drum turns against the
 * load, and friction raises the tension along the band by the exponential of the angle (Euler 1769). Both are bodies;
 * nodes stay in their planes. The band is so light that it rests at the end of every step.
 *
 * The band's tension T acts at its middle, half of its thickness t beyond the drum's friction f per angle: T' r = f R
 * at the radius r = R + t/2, by the moments about the axis. The missing part of the friction is a shear Q = f t/(2r) of
 * the band, which contributes to the normal force N = T - Q'. So T grows by exp(k theta), k (1 + mu k t/(2r)) = mu (1 -
 * t/(2r)).
 *
 * The ends' torques about the axis are compared, not their forces: as the band stretches, straight parts of it come
 * onto the drum and bent ones leave it, and their bending moments shift the lines of the forces. Drum and band are
 * polygons, so normals are tilted by up to half an angle between two facets: the torques are means over a turn by one
 * facet. */
#include "grids.h"

static const double RADIUS = 1, BORE = 0.7, THICK = 0.05, TAIL = 0.3, WIDTH = 0.1, APART = 2e-3, GAP = 1e-3;
static const double YOUNG = 1e5, STRAIN = 2e-3, POISSON = 0.3, PI = 3.14159265358979;

/* An arc with straight ends; x of `bend` goes across it, along it, along the axis. */
typedef struct arc {
  double inner, outer, from, to, tail, low, high;
} arc;

static void bend(const void *data, double x[3])
{
  const arc *self = data;
  const double r = self->inner + (self->outer - self->inner) * x[0], turn = self->to - self->from;
  const double s = (turn + 2 * self->tail) * x[1] - self->tail, within = fmax(0, fmin(turn, s)),
               angle = self->from + within, beyond = s - within;
  x[0] = r * cos(angle) - beyond * sin(angle);
  x[1] = r * sin(angle) + beyond * cos(angle);
  x[2] = self->low + (self->high - self->low) * x[2];
}

typedef struct band {
  test_body b;
  flesh_body_part parts[2];
  flesh_material materials[2];
  int *tet_material, *nodes; /* nodes: for lists */
  int drum_nodes;
  double load; /* N */
} band;

static int is_any(const double X[3]) { return X[2] < 1; }
static int is_bore(const double X[3]) { return hypot(X[0], X[1]) < BORE + 1e-9; }
static int is_loaded(const double X[3]) { return X[0] > 0 && X[1] < -TAIL + 1e-9; }
static int is_held(const double X[3]) { return X[0] < 0 && X[1] < -TAIL + 1e-9; }

/* Lists nodes of the band, or of all, in self->nodes. */
static int list(const band *self, int all, int (*wanted)(const double X[3]))
{
  int found = 0;
  for (int k = all ? 0 : self->drum_nodes; k < self->b.n / 3; k++)
    if (wanted(flesh_mesh_positions(self->b.mesh) + 3 * k)) self->nodes[found++] = k;
  return found;
}

static void add(band *self, flesh_effect *effect) { CHECK_OK(flesh_system_add_effect(self->b.system, &effect)); }

/* The drum is a hundred times stiffer. */
static void make_bodies(int facets, int layers, int cells, band *self)
{
  const arc drum = {BORE, RADIUS, -TAIL, PI + TAIL, 0, -0.2 * WIDTH, 1.2 * WIDTH},
            around = {RADIUS + APART, RADIUS + APART + THICK, 0, PI, TAIL, 0, WIDTH};
  test_body *b = &self->b;
  flesh_mesh *first = grid_of(1, facets, layers, bend, &drum), *second = grid_of(1, cells, 1, bend, &around);
  self->drum_nodes = flesh_mesh_node_count(first);
  flesh_mesh *mesh = grids_join(first, second, self->parts);
  for (int k = 0; k < 2; k++)
    CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, k ? YOUNG : 100 * YOUNG, POISSON,
                                       &self->materials[k]));
  CHECK_OK(test_body_create(mesh, self->materials[1], 1e-5, FLESH_MASS_LUMPED, 1, b));
  flesh_system_destroy(&b->system);
  self->tet_material = malloc((size_t)flesh_mesh_tet_count(mesh) * sizeof *self->tet_material);
  self->nodes = malloc((size_t)b->n / 3 * sizeof *self->nodes);
  for (int e = 0; e < flesh_mesh_tet_count(mesh); e++) self->tet_material[e] = e >= self->parts[1].first_tet;
  b->body.materials = self->materials;
  b->body.tet_material = self->tet_material;
  b->body.parts = self->parts;
  b->body.part_count = 2;
}

static void make(int facets, int layers, int cells, double friction, band *self)
{
  flesh_effect *effect = NULL;
  flesh_contact_options options;
  const flesh_keyframe keys[] = {{.t = 0}, {.t = 1, .rotation = {0, 0, -1}}};
  const flesh_motion turn = {.count = 2, .keyframes = keys};
  make_bodies(facets, layers, cells, self);
  test_body *b = &self->b;
  CHECK_OK(flesh_system_create(b->mesh, &b->system));
  CHECK_OK(flesh_effect_inertia(&b->body, &effect));
  add(self, effect);
  CHECK_OK(flesh_effect_elasticity(&b->body, &effect));
  add(self, effect);
  self->load = STRAIN * YOUNG * THICK * WIDTH;
  const int loaded = list(self, 0, is_loaded);
  CHECK_OK(flesh_effect_force(&b->body, loaded, self->nodes, (double[]){0, -self->load, 0}, NULL, &effect));
  add(self, effect);
  flesh_contact_options_default(&options);
  options.thickness = GAP;
  options.stiffness = STRAIN * YOUNG / 2;
  options.friction = friction;
  options.slip_speed = 1e-4;
  CHECK_OK(flesh_effect_surface_contact(&b->body, &options, 0, NULL, &effect));
  add(self, effect);
  const int bore = list(self, 1, is_bore);
  CHECK_OK(flesh_system_add_prescribed_motion(b->system, bore, self->nodes, FLESH_AXES_ALL, &turn, -INFINITY, INFINITY));
  const int held = list(self, 0, is_held);
  CHECK_OK(flesh_system_add_pin(b->system, held, self->nodes, FLESH_AXIS_Y, -INFINITY, INFINITY));
  const int any = list(self, 1, is_any);
  CHECK_OK(flesh_system_add_pin(b->system, any, self->nodes, FLESH_AXIS_Z, -INFINITY, INFINITY));
  CHECK_OK(flesh_system_finalize(b->system));
  CHECK_OK(flesh_system_check(b->system, 0, b->state.x));
}

/* Returns the torque about the axis at the held end over that of the load. */
static double ratio(band *self)
{
  const flesh_state *s = &self->b.state;
  double *r = calloc(2 * (size_t)self->b.n, sizeof *r), *still = r + self->b.n, holding = 0, loading = 0;
  const flesh_point point = flesh_point_at(s->t, s->x, s->v, still);
  CHECK_OK(flesh_system_residual(self->b.system, &point, r));
  const int held = list(self, 0, is_held);
  for (int k = 0; k < held; k++) holding += r[3 * self->nodes[k] + 1] * s->x[3 * self->nodes[k]];
  const int loaded = list(self, 0, is_loaded);
  for (int k = 0; k < loaded; k++) loading += self->load / loaded * s->x[3 * self->nodes[k]];
  free(r);
  return holding / loading;
}

static double exponent(double friction)
{
  const double share = THICK / 2 / (RADIUS + GAP + THICK / 2), shear = friction * share;
  return (sqrt(1 + 4 * shear * friction * (1 - share)) - 1) / (2 * shear);
}

/* Returns the measured exponent over the expected one; the drum turns until the band slips everywhere, and then by a
 * facet. */
static double draw(int facets, int layers, int cells, double friction)
{
  enum { BEFORE = 10, STEPS = 16 };
  band self = {0};
  flesh_solve_stats all = {0};
  flesh_integrator *integrator = NULL;
  const flesh_solver_options options = test_options(1e-6);
  const double stretch = 0.06, facet = (PI + 2 * TAIL) / facets, expected = PI * exponent(friction);
  double mean = 0, least = INFINITY, most = 0;
  make(facets, layers, cells, friction, &self);
  CHECK_OK(flesh_integrator_create(self.b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
  for (int step = 0; step < BEFORE + STEPS; step++) {
    flesh_solve_stats stats = {0};
    CHECK_OK(flesh_integrator_step(integrator, &self.b.state, step < BEFORE ? stretch / BEFORE : facet / STEPS, &stats));
    all.newton += stats.newton, all.linear += stats.linear;
    if (step < BEFORE) continue;
    const double now = ratio(&self);
    mean += now / STEPS;
    least = fmin(least, now);
    most = fmax(most, now);
  }
  printf("# friction %g, %d x %d facets, %d cells: %.5f (%.5f to %.5f), expected %.5f; of the exponent %.5f; "
         "%d Newton, %d linear iterations\n",
         friction, facets, layers, cells, mean, least, most, exp(expected), log(mean) / expected, all.newton,
         all.linear);
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&self.b);
  free(self.tet_material);
  free(self.nodes);
  return log(mean) / expected;
}

/* With one cell along the axis no node of the drum is beneath the band: crossing edges bear it. With three, nodes
 * do. */
static void tension_grows_by_the_exponential_of_the_angle(void)
{
  CHECK_NEAR(draw(20, 3, 32, 0.15), 1, 0.01);
  CHECK_NEAR(draw(20, 1, 32, 0.3), 1, 0.01);
}

static void the_exponent_converges(void)
{
  const double coarse = draw(20, 1, 32, 0.3), middle = draw(40, 1, 65, 0.3), fine = draw(80, 1, 129, 0.3);
  CHECK_NEAR(coarse, 1, 0.01);
  CHECK_NEAR(middle, 1, 0.0025);
  CHECK_NEAR(fine, 1, 0.0025);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(tension_grows_by_the_exponential_of_the_angle), TEST(the_exponent_converges));
}
