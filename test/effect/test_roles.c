// TEST quick
/* test_roles.c: effects are recognised by their roles: a user-defined mass and elasticity, under their own names, are
 * treated by every part of the library like the built-in ones, and so is a load with the minimum that an effect
 * needs. */
#include <math.h>
#include <stdlib.h>

#include "body.h"
#include "flesh/ida.h"
#include "flesh/ode.h"
#include "mesh/mesh.h"
#include "test.h"
#include "time/rigid_guess.h"

/* A mass per node, kg: diagonal blocks only. */
typedef struct masses {
  int nodes;
  double *mass; /* [nodes] */
} masses;

static int mass_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const masses *self = effect->data;
  CHECK(point->lagged.x && point->lagged.v); /* effects never receive NULL */
  for (int d = 0; d < 3 * self->nodes; d++) r[d] += self->mass[d / 3] * point->a[d];
  return FLESH_OK;
}

static int mass_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                         flesh_block_matrix *K, const int *slots)
{
  const masses *self = effect->data;
  (void)point, (void)slots;
  for (int i = 0; i < self->nodes; i++)
    for (int c = 0; c < 3; c++) K->values[9 * K->row_start[i] + 4 * c] += shift->a * self->mass[i];
  return FLESH_OK;
}

static double half_square(const masses *self, const double *u)
{
  double sum = 0;
  for (int d = 0; d < 3 * self->nodes; d++) sum += self->mass[d / 3] * u[d] * u[d] / 2;
  return sum;
}

static int mass_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                          double *magnitude)
{
  if (shift->a == 0) return FLESH_OK;
  const double value = half_square(effect->data, point->a) / shift->a;
  *phi += value;
  *magnitude += value;
  return FLESH_OK;
}

static int mass_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  *energy = half_square(effect->data, point->v);
  return FLESH_OK;
}

static void mass_destroy(void *data)
{
  free(((masses *)data)->mass);
  free(data);
}

static const flesh_effect_operations mass_operations = {.name = "my mass",
                                                        .role = FLESH_ROLE_INERTIA,
                                                        .traits = FLESH_IS_PASSIVE,
                                                        .residual = mass_residual,
                                                        .jacobian = mass_jacobian,
                                                        .potential = mass_potential,
                                                        .energy = mass_energy,
                                                        .destroy = mass_destroy};

/* The library's elasticity under another name, through its public functions only. */
static const flesh_cells *tissue_cells(const flesh_effect *effect)
{
  const flesh_effect *inner = effect->data;
  return inner->operations->cells(inner);
}

static int tissue_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const flesh_effect *inner = effect->data;
  return inner->operations->residual(inner, point, r);
}

static int tissue_jacobian(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift,
                           flesh_block_matrix *K, const int *slots)
{
  const flesh_effect *inner = effect->data;
  return inner->operations->jacobian(inner, point, shift, K, slots);
}

static int tissue_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                            double *magnitude)
{
  const flesh_effect *inner = effect->data;
  return inner->operations->potential(inner, point, shift, phi, magnitude);
}

static int tissue_energy(const flesh_effect *effect, const flesh_point *point, double *energy)
{
  const flesh_effect *inner = effect->data;
  return inner->operations->energy(inner, point, energy);
}

static void tissue_destroy(void *data)
{
  flesh_effect *inner = data;
  flesh_effect_destroy(&inner);
}

static const flesh_effect_operations tissue_operations = {.name = "my tissue",
                                                          .role = FLESH_ROLE_ELASTICITY,
                                                          .traits = FLESH_IS_PASSIVE,
                                                          .cells = tissue_cells,
                                                          .residual = tissue_residual,
                                                          .jacobian = tissue_jacobian,
                                                          .potential = tissue_potential,
                                                          .energy = tissue_energy,
                                                          .destroy = tissue_destroy};

static void add(test_body *b, const flesh_effect_operations *operations, void *data)
{
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_effect_create(operations, b->mesh, data, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
}

static void add_masses(test_body *b, double share)
{
  masses *own = malloc(sizeof *own);
  *own = (masses){b->n / 3, malloc(sizeof(double) * (size_t)b->n)};
  flesh_mesh_lumped_mass(b->mesh, b->density, own->mass);
  for (int i = 0; i < own->nodes; i++) own->mass[i] *= share;
  add(b, &mass_operations, own);
}

enum { BUILT_IN, OWN, TWO_MASSES, KINDS };

/* A block of 2 m x 1 m x 1 m. */
static void open_body(int kind, flesh_energy energy, test_body *b)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(energy, FLESH_CONSTANTS_MATCHED, 1e5, 0.3, &material));
  CHECK_OK(test_body_create(test_box(4, 2, 2, 2, 1, 1), material, 1000, FLESH_MASS_LUMPED, 1, b));
  if (kind == BUILT_IN) return;
  flesh_effect *inner = NULL;
  flesh_system_destroy(&b->system);
  CHECK_OK(flesh_system_create(b->mesh, &b->system));
  CHECK_OK(flesh_effect_elasticity(&b->body, &inner));
  add(b, &tissue_operations, inner);
  add_masses(b, kind == OWN ? 1 : 0.25);
  if (kind == TWO_MASSES) add_masses(b, 0.75);
}

/* E's energy has a minimum at F = 0: a body that collapses into it is untangled. */
static void untangling_finds_them(void)
{
  for (int kind = 0; kind < KINDS; kind++) {
    test_body b;
    flesh_integrator *integrator = NULL;
    flesh_solver_options options;
    flesh_solve_stats stats = {0};
    open_body(kind, FLESH_ENERGY_E, &b);
    CHECK_OK(flesh_system_finalize(b.system));
    for (int d = 0; d < b.n; d++) b.state.x[d] *= 0.01;
    flesh_solver_options_default(&options);
    options.line_search = FLESH_LINE_SEARCH_RESIDUAL; /* with a line search on the potential no step falls into it */
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    for (int k = 0; k < 60; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.2, &stats));
    CHECK(stats.untanglings == 1);
    CHECK_BELOW(flesh_mesh_distance_from_rest(b.mesh, b.state.x), 1e-6);
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

/* The masses with which first guesses fit a rigid motion. */
static void first_guesses_weigh_them(void)
{
  for (int kind = 0; kind < KINDS; kind++) {
    test_body b;
    flesh_rigid_parts parts;
    open_body(kind, FLESH_ENERGY_S, &b);
    CHECK_OK(flesh_system_finalize(b.system));
    CHECK_OK(flesh_rigid_parts_create(b.system, FLESH_OK, &parts));
    double sum = 0, *mass = malloc(sizeof(double) * (size_t)b.n);
    flesh_mesh_lumped_mass(b.mesh, b.density, mass);
    for (int i = 0; i < b.n / 3; i++) {
      CHECK_NEAR(parts.mass[i], mass[i], 1e-12 * mass[i]);
      sum += parts.mass[i];
    }
    CHECK_NEAR(sum, 2000, 1e-9);
    free(mass);
    flesh_rigid_parts_clear(&parts);
    test_body_destroy(&b);
  }
}

/* A body thrown at 3 m/s without gravity: its initial energy is its kinetic energy, mv^2/2 = 9 kJ; afterwards it has
 * lost and gained nothing. By stepping and by IDA. */
static void the_energy_balance_knows_their_motion(void)
{
  const flesh_method methods[] = {FLESH_METHOD_BACKWARD_EULER, FLESH_METHOD_MIDPOINT, FLESH_METHOD_IDA};
  for (int kind = 0; kind < KINDS; kind++)
    for (int m = 0; m < 3; m++) {
      test_body b;
      flesh_integrator *integrator = NULL;
      flesh_solver_options options;
      open_body(kind, FLESH_ENERGY_S, &b);
      CHECK_OK(flesh_system_finalize(b.system));
      for (int i = 0; i < b.n; i += 3) b.state.v[i] = 3;
      flesh_solver_options_default(&options);
      CHECK_OK(flesh_integrator_create(b.system, methods[m], &options, &integrator));
      for (int k = 0; k < 5; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.01, NULL));
      const flesh_energy_balance *balance = flesh_integrator_energy_balance(integrator);
      CHECK_NEAR(balance->scale, 9000, 0.01);
      CHECK_NEAR(b.state.x[0], 0.15, 1e-6);
      flesh_integrator_destroy(&integrator);
      test_body_destroy(&b);
    }
}

static void motions_need_a_mass_of_any_name(void)
{
  for (int kind = -1; kind < KINDS; kind++) {
    test_body b;
    flesh_solver_options options;
    flesh_ida_problem *ida = NULL;
    flesh_ode_problem *ode = NULL;
    open_body(kind < 0 ? BUILT_IN : kind, FLESH_ENERGY_S, &b);
    if (kind < 0) { /* a name alone is no mass */
      static const flesh_effect_operations name_only = {.name = "inertia"};
      flesh_system_destroy(&b.system);
      CHECK_OK(flesh_system_create(b.mesh, &b.system));
      add(&b, &name_only, NULL);
    }
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_solver_options_default(&options);
    CHECK(flesh_system_has_role(b.system, FLESH_ROLE_INERTIA) == (kind >= 0));
    CHECK(flesh_ida_problem_create(b.system, &options, &ida) == (kind < 0 ? FLESH_ERR_ARGUMENT : FLESH_OK));
    CHECK(flesh_ode_problem_create(b.system, &options, &ode) == (kind < 0 ? FLESH_ERR_ARGUMENT : FLESH_OK));
    if (kind < 0) CHECK_TEXT(flesh_error_text(), "inertia");
    flesh_ida_problem_destroy(&ida);
    flesh_ode_problem_destroy(&ode);
    test_body_destroy(&b);
  }
}

static int keep_rest(void *data, const flesh_step_record *record)
{
  double *sum = data;
  for (int e = 0; e < flesh_system_effect_count(record->system); e++) *sum += record->rest_energies[e];
  return FLESH_OK;
}

/* S has an energy in the mesh's shape, which histories subtract for elasticity of any name. */
static void energies_are_told_from_rest(void)
{
  double sums[2] = {0, 0};
  for (int kind = 0; kind < 2; kind++) {
    test_body b;
    flesh_integrator *integrator = NULL;
    flesh_solver_options options;
    const flesh_observer keeper = {.observe = keep_rest, .data = &sums[kind]};
    const flesh_run_options run = {.h = 0.01, .end = 0.01, .observer_count = 1, .observers = &keeper};
    open_body(kind, FLESH_ENERGY_S, &b);
    CHECK_OK(flesh_system_finalize(b.system));
    flesh_solver_options_default(&options);
    CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BACKWARD_EULER, &options, &integrator));
    CHECK_OK(flesh_run(b.system, integrator, &run, &b.state, NULL));
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
  CHECK(sums[0] != 0 && sums[0] == sums[1]);
}

static void roles_that_do_not_exist_and_names_of_no_column_are_refused(void)
{
  static const flesh_effect_operations odd[] = {{.name = "odd", .role = FLESH_ROLE_COUNT}, {.role = FLESH_ROLE_LOAD},
                                                {.name = ""}, {.name = "a,b"}, {.name = "two\nlines"}};
  flesh_effect *effect = NULL;
  flesh_mesh *mesh = test_box(1, 1, 1, 1, 1, 1);
  for (int k = 0; k < 5; k++) {
    CHECK(flesh_effect_create(&odd[k], mesh, NULL, &effect) == FLESH_ERR_ARGUMENT && !effect);
    CHECK_TEXT(flesh_error_text(), k ? "the name of an effect is '" : "role 6 of an effect does not exist");
    flesh_effect_destroy(&effect);
  }
  flesh_mesh_destroy(&mesh);
}

/* A weight of the nodes with only name, role, residual, potential and destroy. */
static int weight_residual(const flesh_effect *effect, const flesh_point *point, double *r)
{
  const masses *self = effect->data;
  for (int i = 0; i < self->nodes; i++) r[3 * i + 2] += point->load * 9.81 * self->mass[i];
  return FLESH_OK;
}

static int weight_potential(const flesh_effect *effect, const flesh_point *point, const flesh_shift *shift, double *phi,
                            double *magnitude)
{
  const masses *self = effect->data;
  for (int i = 0; i < self->nodes && shift->x != 0; i++) {
    const double value = point->load * 9.81 * self->mass[i] * point->x[3 * i + 2] / shift->x;
    *phi += value;
    *magnitude += fabs(value);
  }
  return FLESH_OK;
}

static const flesh_effect_operations weight_operations = {.name = "weight", .role = FLESH_ROLE_LOAD,
                                                          .residual = weight_residual,
                                                          .potential = weight_potential, .destroy = mass_destroy};

/* A body of 2000 kg that falls for 0.1 s: its weight is the load that tolerances refer to, and its work is the kinetic
 * energy; by IDA as well, there is no spurious energy. */
static void five_members_are_a_load(void)
{
  const flesh_method methods[] = {FLESH_METHOD_MIDPOINT, FLESH_METHOD_IDA};
  for (int m = 0; m < 2; m++) {
    test_body b;
    flesh_integrator *integrator = NULL;
    flesh_solver_options options;
    flesh_derivative_report report;
    open_body(BUILT_IN, FLESH_ENERGY_S, &b);
    add_masses(&b, 1);
    flesh_effect *last = (flesh_effect *)flesh_system_effect(b.system, flesh_system_effect_count(b.system) - 1);
    last->operations = &weight_operations;
    CHECK_OK(flesh_system_finalize(b.system));
    CHECK_OK(flesh_effect_check_derivatives(last, b.mesh, 0, b.state.x, 1, &report));
    CHECK(flesh_derivative_report_passes(&report, 1e-6) && report.potential[0] < 1e-6 && report.potential[1] < 1e-6);
    double *r = malloc(sizeof *r * (size_t)b.n), sum = 0;
    flesh_point point = flesh_point_at(0, b.state.x, b.state.v, b.state.v);
    point.load = 0.5;
    CHECK_OK(flesh_system_load(b.system, &point, r));
    for (int i = 2; i < b.n; i += 3) sum += r[i];
    CHECK_NEAR(sum, 0.5 * 2000 * 9.81, 1e-8);
    free(r);
    flesh_solver_options_default(&options);
    options.newton_tolerance = 1e-6;
    CHECK_OK(flesh_integrator_create(b.system, methods[m], &options, &integrator));
    for (int k = 0; k < 5; k++) CHECK_OK(flesh_integrator_step(integrator, &b.state, 0.02, NULL));
    CHECK_NEAR(b.state.v[2], -0.981, 1e-6);
    const flesh_energy_balance *balance = flesh_integrator_energy_balance(integrator);
    CHECK(balance->gain == 0);
    if (m == 0) CHECK_NEAR(balance->supplied, 2000 * 0.981 * 0.981 / 2, 1e-3); /* exact for the midpoint rule */
    flesh_integrator_destroy(&integrator);
    test_body_destroy(&b);
  }
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(untangling_finds_them), TEST(first_guesses_weigh_them),
                   TEST(the_energy_balance_knows_their_motion), TEST(motions_need_a_mass_of_any_name),
                   TEST(energies_are_told_from_rest), TEST(roles_that_do_not_exist_and_names_of_no_column_are_refused),
                   TEST(five_members_are_a_load));
}
