// TEST full seconds=300
/* test_orders.c: convergence of the elements, in the L2 norm of displacement, and of their pressures, to a large smooth
 * motion with the body force and the tractions that hold a body of form S in it (manufactured.h), on irregular
 * meshes. */
#include "manufactured.h"
#include "output/fields.h"

/* Given nodal forces: a dead load. */
typedef struct nodal_load {
  int n;
  const double *X;
  double force[];
} nodal_load;

static int load_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const nodal_load *self = effect->data;
  for (int d = 0; d < self->n; d++) r[d] -= point->load * self->force[d];
  return FLESH_OK;
}

static int load_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                          double *magnitude)
{
  const nodal_load *self = effect->data;
  for (int d = 0; d < self->n && shift->x != 0; d++) {
    const double term = point->load * self->force[d] * (point->x[d] - self->X[d]) / shift->x;
    *phi -= term;
    *magnitude += fabs(term);
  }
  return FLESH_OK;
}

static const flesh_effect_operations load_operations = {.name = "nodal load",
                                                        .role = FLESH_ROLE_LOAD,
                                                        .residual = load_residual,
                                                        .potential = load_potential,
                                                        .destroy = free};

/* Makes a cube of n cells per edge, with inner corners moved by up to a tenth of a cell. */
static flesh_mesh *irregular_cube(int n, flesh_element element)
{
  flesh_mesh *box = test_box(n, n, n, 1, 1, 1), *mesh = NULL, *raised = NULL;
  const int corners = flesh_mesh_node_count(box);
  double *X = malloc(3 * (size_t)corners * sizeof *X);
  memcpy(X, flesh_mesh_positions(box), 3 * (size_t)corners * sizeof *X);
  test_jitter(3 * corners, 0.1 / n, 7, X);
  for (int d = 0; d < 3 * corners; d++) {
    const double at = flesh_mesh_positions(box)[d];
    if (at < 1e-9 || at > 1 - 1e-9) X[d] = at < 0.5 ? 0 : 1;
  }
  CHECK_OK(flesh_mesh_create(corners, X, flesh_mesh_tet_count(box), flesh_mesh_tets(box), NULL, &mesh));
  free(X);
  flesh_mesh_destroy(&box);
  if (element == FLESH_ELEMENT_TET4) return mesh;
  CHECK_OK(flesh_mesh_raise_order(mesh, &raised));
  flesh_mesh_destroy(&mesh);
  return raised;
}

/* Adds elasticity, the load, and constraints of the nodes on all faces but X = 1 to the motion. */
static void make(int n, flesh_element element, double poisson, const manufactured *m, test_body *b)
{
  CHECK_OK(test_body_create(irregular_cube(n, element), test_material(FLESH_ENERGY_S, poisson), 1000,
                            FLESH_MASS_CONSISTENT, 0, b));
  flesh_system_destroy(&b->system);
  b->body.element = element;
  const double *X = flesh_mesh_positions(b->mesh);
  nodal_load *load = malloc(sizeof *load + (size_t)b->n * sizeof *load->force);
  flesh_effect *effect = NULL;
  load->n = b->n;
  load->X = X;
  manufactured_load(m, &b->material, b->mesh, load->force);
  CHECK_OK(flesh_system_create(b->mesh, &b->system));
  CHECK_OK(flesh_effect_elasticity(&b->body, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  CHECK_OK(flesh_effect_create(&load_operations, b->mesh, load, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  for (int i = 0; i < b->n / 3; i++) {
    jet y[3];
    manufactured_place(m, X + 3 * i, y);
    flesh_keyframe key = {.t = 0};
    for (int c = 0; c < 3; c++) key.translation[c] = y[c].value - X[3 * i + c];
    for (int c = 0; c < 3; c++) b->state.x[3 * i + c] = y[c].value; /* near the equilibrium */
    const double *at = X + 3 * i;
    if (at[0] != 0 && at[1] != 0 && at[1] != 1 && at[2] != 0 && at[2] != 1) continue;
    CHECK_OK(flesh_system_add_prescribed_motion(b->system, 1, &i, FLESH_AXES_ALL,
                                                &(flesh_motion){.count = 1, .keyframes = &key}, -INFINITY, INFINITY));
  }
  CHECK_OK(flesh_system_finalize(b->system));
}

/* Returns the motion's pressure at X, Pa. */
static double exact_pressure(const manufactured *m, const flesh_material *material, const double X[3])
{
  jet y[3];
  double P[3][3], force[3], trace = 0;
  manufactured_place(m, X, y);
  const double J = manufactured_stress(material, y, P, force);
  for (int k = 0; k < 9; k++) trace += P[k / 3][k % 3] * y[k / 3].first[k % 3];
  return -trace / 3 / J;
}

enum { RAW, OF_TETS, AT_CORNERS, PRESSURES };

/* Computes root mean square errors over mu of a frame's pressures: of tets by their points, of tets, and at corners. */
static void find_pressure_errors(const manufactured *m, const test_body *b, double errors[PRESSURES])
{
  const flesh_mesh *mesh = b->mesh;
  const double *X = flesh_mesh_positions(mesh), *V = flesh_mesh_tet_volumes(mesh);
  flesh_fields fields;
  CHECK_OK(flesh_fields_open(&b->body, b->system, FLESH_METHOD_STATIC, FLESH_FIELD_PRESSURE,
                             FLESH_AT_NODES | FLESH_AT_TETS | FLESH_AT_POINTS, &fields));
  flesh_fields_find(&fields, &(flesh_step_record){.state = &b->state, .stage = &b->state});
  const double *at_nodes = fields.nodes.arrays[0].doubles, *of_tets = fields.tets.arrays[0].doubles;
  const double *at_points = fields.tets.arrays[1].doubles;
  double squares[PRESSURES] = {0};
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++) {
    const int *corner = flesh_mesh_tets(mesh) + 4 * t;
    double centre[3] = {0}, raw = 0;
    for (int a = 0; a < 4; a++) {
      raw += at_points[4 * t + a] / 4;
      for (int c = 0; c < 3; c++) centre[c] += X[3 * corner[a] + c] / 4;
      squares[AT_CORNERS] += V[t] / 4 * pow(at_nodes[corner[a]] - exact_pressure(m, &b->material, X + 3 * corner[a]), 2);
    }
    const double exact = exact_pressure(m, &b->material, centre);
    squares[RAW] += V[t] * pow(raw - exact, 2);
    squares[OF_TETS] += V[t] * pow(of_tets[t] - exact, 2);
  }
  for (int k = 0; k < PRESSURES; k++) errors[k] = sqrt(squares[k]) / b->material.mu;
  flesh_fields_clear(&fields);
}

/* Returns the distance of the equilibrium from the motion, root mean square, m; and, unless they are NULL, its
 * pressures. */
static double error_of(int n, flesh_element element, double poisson, double swell, double pressures[PRESSURES])
{
  test_body b;
  flesh_integrator *integrator = NULL;
  const flesh_solver_options options = test_options(1e-9);
  const flesh_material material = test_material(FLESH_ENERGY_S, poisson);
  const manufactured m = {.shear = 0.12, .swell = swell * material.mu / material.lambda};
  flesh_solve_stats stats = {0};
  make(n, element, poisson, &m, &b);
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_STATIC, &options, &integrator));
  CHECK_OK(flesh_integrator_step(integrator, &b.state, 0, &stats));
  const double error = manufactured_distance(&m, b.mesh, b.state.x);
  printf("# %s, nu %g, swell %g, %d cells an edge: %.4g m (%d Newton, %d linear)\n", flesh_element_name(element),
         poisson, swell, n, error, stats.newton, stats.linear);
  if (pressures) {
    find_pressure_errors(&m, &b, pressures);
    printf("# pressures off by %.4f, even ones by %.4f of tets and %.4f at corners, of mu\n", pressures[RAW],
           pressures[OF_TETS], pressures[AT_CORNERS]);
  }
  flesh_integrator_destroy(&integrator);
  test_body_destroy(&b);
  return error;
}

/* Returns the slope of log error over log size, by least squares. */
static double slope_of(const int cells[3], const double errors[3])
{
  double x[3], y[3], xx = 0, xy = 0;
  for (int k = 0; k < 3; k++) x[k] = -log(cells[k]), y[k] = log(errors[k]);
  const double middle = (x[0] + x[1] + x[2]) / 3;
  for (int k = 0; k < 3; k++) {
    xx += (x[k] - middle) * (x[k] - middle);
    xy += (x[k] - middle) * y[k];
  }
  return xy / xx;
}

/* Returns the order over three meshes, and the last error. */
static double order_of(flesh_element element, double poisson, double swell, const int cells[3], double *last)
{
  double errors[3];
  for (int k = 0; k < 3; k++) errors[k] = error_of(cells[k], element, poisson, swell, NULL);
  *last = errors[2];
  const double order = slope_of(cells, errors);
  printf("# %s, nu %g, swell %g: order %.2f\n", flesh_element_name(element), poisson, swell, order);
  return order;
}

static const int coarse[3] = {2, 4, 6}, fine[3] = {4, 8, 12};

/* J is between .74 and 1.08. */
static void orders_are_those_of_the_shape_functions(void)
{
  double error;
  CHECK_NEAR(order_of(FLESH_ELEMENT_TET4, 0.3, 0.1, fine, &error), 2, 0.15);
  CHECK_NEAR(order_of(FLESH_ELEMENT_TET10, 0.3, 0.1, coarse, &error), 3, 0.2);
  CHECK(order_of(FLESH_ELEMENT_TET10_MEAN, 0.3, 0.1, coarse, &error) >= 2.7);
}

/* If the motion preserves every volume, the means of J are as accurate as the motion at any Poisson's ratio. The other
 * elements lock: they have not reached their orders on these meshes. */
static void orders_stay_near_incompressibility(void)
{
  double mean, pointwise, linear;
  CHECK(order_of(FLESH_ELEMENT_TET10_MEAN, 0.3, 0, coarse, &mean) >= 2.7);
  CHECK(order_of(FLESH_ELEMENT_TET10_MEAN, 0.4999, 0, coarse, &mean) >= 2.7);
  CHECK_BELOW(order_of(FLESH_ELEMENT_TET10, 0.4999, 0, coarse, &pointwise), 2.5);
  CHECK_BELOW(order_of(FLESH_ELEMENT_TET4, 0.4999, 0, coarse, &linear), 1.7);
  CHECK_BELOW(4 * mean, pointwise);
  CHECK_BELOW(30 * mean, linear);
}

/* A pressure that is constant in each tet has an error of the order of the size of the tets, and displacements of its
 * square: if the pressure varies, here by .9 shear moduli, they are of second order, although their shape functions
 * could do better. The pressures computed for frames are of second order, too, where those of single tets have a
 * checkerboard. */
static void varying_pressures_cost_an_order(void)
{
  double errors[3], pressures[3][PRESSURES], of[PRESSURES][3];
  for (int k = 0; k < 3; k++) {
    errors[k] = error_of(coarse[k], FLESH_ELEMENT_TET10_MEAN, 0.4999, 0.1, pressures[k]);
    for (int j = 0; j < PRESSURES; j++) of[j][k] = pressures[k][j];
  }
  CHECK(slope_of(coarse, errors) >= 1.9);
  CHECK_BELOW(errors[2], 5e-4);
  printf("# orders of pressures %.2f, even %.2f and %.2f\n", slope_of(coarse, of[RAW]), slope_of(coarse, of[OF_TETS]),
         slope_of(coarse, of[AT_CORNERS]));
  CHECK(slope_of(coarse, of[OF_TETS]) >= 1.8 && slope_of(coarse, of[AT_CORNERS]) >= 1.8);
  CHECK_BELOW(of[OF_TETS][2], 0.25 * of[RAW][2]);
  CHECK_BELOW(of[AT_CORNERS][2], 0.5 * of[RAW][2]);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(orders_are_those_of_the_shape_functions), TEST(orders_stay_near_incompressibility),
                   TEST(varying_pressures_cost_an_order));
}
