// TEST quick
/* test_members.c: states without positions or velocities, stages without a base or with invalid numbers, observers
 * without a function, pairs without an array, materials that were not initialised, and NULL overrides are refused
 * before anything of them is read. */
#include <nvector/nvector_serial.h>

#include "body.h"
#include "flesh/ida.h"
#include "flesh/kinsol.h"
#include "flesh/ode.h"
#include "flesh/probe.h"
#include "flesh/sensitivity.h"
#include "sundials/compatibility.h"
#include "test.h"

static void refused(int status, const char *part)
{
  CHECK(status == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), part);
}

/* A free cube; its parts outlive the objects made of it. */
static void make_cube(test_body *b)
{
  CHECK_OK(test_body_create(test_box(1, 1, 1, 1, 1, 1), test_material(FLESH_ENERGY_S, 0.4), 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(flesh_system_finalize(b->system));
}

static void states_have_arrays(void)
{
  test_body b;
  SUNContext context;
  flesh_integrator *integrator;
  flesh_ida_problem *ida;
  flesh_ode_problem *ode;
  flesh_sensitivity *sensitivity;
  const flesh_solver_options options = test_options(1e-6);
  const flesh_run_options run = {.h = 1, .end = 1};
  make_cube(&b);
  CHECK(!flesh_suncontext_create(&context));
  CHECK_OK(flesh_integrator_create(b.system, FLESH_METHOD_BDF2, &options, &integrator));
  CHECK_OK(flesh_ida_problem_create(b.system, &options, &ida));
  CHECK_OK(flesh_ode_problem_create(b.system, &options, &ode));
  CHECK_OK(flesh_sensitivity_create(b.system, &options, 1e-8, &sensitivity));
  N_Vector y, yp;
  CHECK_OK(flesh_ida_vector_create(ida, context, &y));
  yp = N_VClone(y);
  double *const x = b.state.x, *const v = b.state.v;
  const flesh_state states[] = {{.v = v}, {.x = x}, {.x = x, .v = x}, {.x = x, .v = v, .multiplier_count = 1},
                                {.x = x, .v = v, .internal_count = 1}};
  for (int k = 0; k < 5; k++) {
    static const char *const words[] = {"state->x is NULL", "state->v is NULL", "state->x and state->v are the same array",
                                        "state->multipliers is NULL", "state->internal is NULL"};
    const char *word = words[k];
    flesh_state state = states[k];
    refused(flesh_integrator_step(integrator, &state, 1, NULL), word);
    refused(flesh_run(b.system, integrator, &run, &state, NULL), word);
    refused(flesh_run_resume(b.system, integrator, &run, 0, 0, &state, NULL), word);
    refused(flesh_ida_start(ida, &state, y, yp), word);
    refused(flesh_ode_start(ode, &state, y), word);
    refused(flesh_state_read("state.txt", b.n / 3, &state), word);
    refused(flesh_state_write("state.txt", b.n / 3, &state), word);
    if (k == 0) refused(flesh_sensitivity_set(sensitivity, &state, NULL), word);
  }
  const flesh_run_options unseen = {.h = 1, .end = 1, .observer_count = 1, .observers = &(flesh_observer){NULL, NULL}};
  refused(flesh_run(b.system, integrator, &unseen, &b.state, NULL), "observers[0].observe is NULL");
  refused(flesh_run_resume(b.system, integrator, &run, 3, b.state.t, &b.state, NULL), "step 3 since 0 s cannot have led to 0 s");
  refused(flesh_run_resume(b.system, integrator, &run, 0, b.state.t - 1, &b.state, NULL), "step 0 since -1 s cannot have led");
  for (int k = 0; k < 2; k++) {
    b.state.t = k ? NAN : -INFINITY;
    refused(flesh_ida_start(ida, &b.state, y, yp), "it must be finite");
    refused(flesh_ode_start(ode, &b.state, y), "it must be finite");
  }
  N_VDestroy(y);
  N_VDestroy(yp);
  flesh_sensitivity_destroy(&sensitivity);
  flesh_ode_problem_destroy(&ode);
  flesh_ida_problem_destroy(&ida);
  flesh_integrator_destroy(&integrator);
  SUNContext_Free(&context);
  test_body_destroy(&b);
}

/* The numbers at the start of a struct of equations of motion. */
static void starts_are_finite_and_tolerances_positive(void)
{
  test_body b;
  SUNContext context;
  flesh_ida_problem *ida;
  flesh_ode_problem *ode;
  const flesh_solver_options options = test_options(1e-6);
  const double tolerances[] = {0, -1e-3, NAN, INFINITY};
  make_cube(&b);
  CHECK(!flesh_suncontext_create(&context));
  CHECK_OK(flesh_ida_problem_create(b.system, &options, &ida));
  CHECK_OK(flesh_ode_problem_create(b.system, &options, &ode));
  N_Vector y, other = N_VNew_Serial(b.n, context), vectors[] = {NULL, other};
  CHECK_OK(flesh_ida_vector_create(ida, context, &y));
  N_Vector yp = N_VClone(y);
  for (int k = 0; k < 2; k++) {
    double *number = &(k ? b.state.v : b.state.x)[4], kept = *number;
    *number = k ? NAN : INFINITY;
    CHECK(flesh_ida_start(ida, &b.state, y, yp) == FLESH_ERR_NONFINITE);
    CHECK_TEXT(flesh_error_text(), k ? "node 1 has v = (0, nan, 0) m/s" : "node 1 has x = (");
    CHECK(flesh_ode_start(ode, &b.state, y) == FLESH_ERR_NONFINITE);
    *number = kept;
  }
  for (int k = 0; k < 4; k++) {
    refused(flesh_ida_tolerances(ida, tolerances[k], y), "it must be positive and finite");
    refused(flesh_ode_tolerances(ode, tolerances[k], y), "it must be positive and finite");
  }
  CHECK_OK(flesh_ida_start(ida, &b.state, y, yp));
  CHECK_OK(flesh_ode_start(ode, &b.state, y));
  refused(flesh_ida_residual(NAN, y, yp, yp, ida), "t is nan s; it must be finite");
  refused(flesh_ode_rhs(-INFINITY, y, yp, ode), "t is -inf s; it must be finite");
  refused(flesh_ida_get_state(ida, NAN, y, &b.state), "t is nan s");
  refused(flesh_ode_get_state(ode, INFINITY, y, &b.state), "t is inf s");
  for (int k = 0; k < 2; k++) {
    const char *kind = k ? "the N_Vector has length 24; it must have 48" : "the N_Vector is NULL";
    refused(flesh_ida_tolerances(ida, 1e-3, vectors[k]), kind);
    refused(flesh_ode_tolerances(ode, 1e-3, vectors[k]), kind);
    refused(flesh_ida_get_state(ida, 0, vectors[k], &b.state), kind);
    refused(flesh_ode_get_state(ode, 0, vectors[k], &b.state), kind);
  }
  N_VDestroy(other);
  N_VDestroy(y);
  N_VDestroy(yp);
  flesh_ode_problem_destroy(&ode);
  flesh_ida_problem_destroy(&ida);
  test_body_destroy(&b);
  CHECK(!SUNContext_Free(&context));
}

static void stages_have_a_base_and_numbers(void)
{
  test_body b;
  flesh_problem *problem;
  const flesh_solver_options options = test_options(1e-6);
  make_cube(&b);
  CHECK_OK(flesh_problem_create(b.system, &options, &problem));
  const flesh_stage good = {.load = 1, .prescribed_fraction = 1, .shift = {.x = 1}, .x0 = b.state.x};
  flesh_stage stage = good;
  stage.x0 = NULL;
  refused(flesh_problem_set_stage(problem, &stage), "stage->x0 is NULL");
  for (int k = 0; k < 5; k++) {
    stage = good;
    *(k < 2 ? &stage.shift.x : k < 3 ? &stage.t : k < 4 ? &stage.load : &stage.prescribed_fraction) = k ? NAN : 0;
    refused(flesh_problem_set_stage(problem, &stage), k < 2 ? "it must be finite and not 0" : "they must be finite");
  }
  CHECK_OK(flesh_problem_set_stage(problem, &good));
  flesh_problem_destroy(&problem);
  test_body_destroy(&b);
}

static void numbers_have_a_meaning(void)
{
  test_body b;
  flesh_problem *problem = NULL;
  flesh_solver_options options = test_options(1e-6);
  make_cube(&b);
  refused(flesh_state_write("state.txt", -1, &b.state), "nodes is -1; it must not be negative");
  options.techniques = ~0u;
  refused(flesh_problem_create(b.system, &options, &problem), "techniques is 4294967295; it must be in 0 to 131071");
  flesh_contact_options contact;
  flesh_effect *effect = NULL;
  flesh_contact_options_default(&contact);
  for (int count = -1; count < 2; count += 2)
    refused(flesh_effect_surface_contact(&b.body, &contact, count, NULL, &effect), "pairs must be an array of as many");
  double psi;
  refused(flesh_material_energy(&(flesh_material){0}, (double[]){1, 0, 0, 0, 1, 0, 0, 0, 1}, &psi), "the material has no psi");
  test_body_destroy(&b);
}

static void probes_are_prepared(void)
{
  test_body b;
  flesh_probes *probes;
  flesh_probe probe = {.name = "p", .quantities = FLESH_PROBE_POSITION, .point = {0.5, 0.5, 0.5}};
  make_cube(&b);
  refused(flesh_probes_create("p.csv", &b.body, b.system, FLESH_METHOD_STATIC, 1, &probe, &probes), "probes[0] is not prepared");
  refused(flesh_probes_create("p.csv", &b.body, b.system, FLESH_METHOD_STATIC, -1, &probe, &probes), "count is -1");
  probe.quantities = 256;
  refused(flesh_probe_prepare(&probe, &b.body, b.system), "quantities are 0x100; valid bits are those of 0xff");
  test_body_destroy(&b);
}

static void overrides_are_texts(void)
{
  flesh_scene *scene;
  refused(flesh_scene_read_text("{}", "a.yaml", 1, NULL, &scene), "1 overrides, but overrides is NULL");
  refused(flesh_scene_read_text("{}", "a.yaml", 1, (const char *const[]){NULL}, &scene), "1 overrides, but one of them is NULL");
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(states_have_arrays), TEST(starts_are_finite_and_tolerances_positive),
                   TEST(stages_have_a_base_and_numbers), TEST(numbers_have_a_meaning),
                   TEST(probes_are_prepared), TEST(overrides_are_texts));
}
