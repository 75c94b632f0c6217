// TEST quick seconds=60 needs=cvode,arkode
/* test_sunnonlinsol.c: flesh's Newton in the steps of IDA and CVODE and in the stages of ARKODE: motions against GSL's
 * and another code's, Coulomb's law, impacts and tangles that SUNDIALS' Newton fails at, failing solves. */
#include "owned_integrator.h"

#include <nvector/nvector_serial.h>

#include "busy_bar.h"
#include "motion_reference.h"

static SUNContext context;
static const double g = 9.81; /* m/s^2 */

/* Runs a copy of the body's state to the end. Returns the integrator's flag. */
static int run(owned_integrator *o, const test_body *b, double end, flesh_state *state)
{
  *state = state_copy(b->n, &b->state);
  o->context = context;
  o->y = N_VNew_Serial(2 * b->n, context);
  const int flag = owned_run(o, b->system, end, state);
  N_VDestroy(o->y);
  return flag;
}

/* Prescribed motions that turn, a roller that is released, a spring that is switched: the errors fall with the
 * tolerance down to GSL's motion. */
static void constraints_and_events(void)
{
  test_body b;
  make_busy_bar(FLESH_MASS_LUMPED, &b);
  flesh_state exact = motion_exact(&b, FLESH_MASS_LUMPED, 0, 0.5);
  for (int kind = 0; kind < OWNED_KINDS; kind++) {
    double off[2];
    for (int k = 0; k < 2; k++) {
      flesh_state state;
      owned_integrator o = owned_new((owned_kind)kind, k ? 1e-8 : 1e-6, context, NULL);
      CHECK(run(&o, &b, 0.5, &state) >= 0);
      off[k] = motion_distance(b.n, state.x, exact.x);
      printf("# %s, tolerance %g: %ld steps, %ld Newton iterations, off by %.3g m\n", owned_names[kind], o.tolerance, o.steps,
             o.newton, off[k]);
      CHECK(o.newton > 0 && o.failures == 0);
      state_free(&state);
    }
    CHECK_BELOW(off[1], 1e-5);
    CHECK_BELOW(off[1], off[0] / 5);
  }
  state_free(&exact);
  test_body_destroy(&b);
}

/* With the consistent mass, which couples prescribed nodes with the free ones. */
static void a_consistent_mass(void)
{
  test_body b;
  make_busy_bar(FLESH_MASS_CONSISTENT, &b);
  flesh_state exact = motion_exact(&b, FLESH_MASS_CONSISTENT, 4000, 0.5);
  for (int kind = 0; kind < OWNED_KINDS; kind++) {
    flesh_state state;
    owned_integrator o = owned_new((owned_kind)kind, 1e-7, context, NULL);
    CHECK(run(&o, &b, 0.5, &state) >= 0);
    const double off = motion_distance(b.n, state.x, exact.x);
    printf("# %s: off by %.3g m\n", owned_names[kind], off);
    CHECK_BELOW(off, 3e-4); /* of some 0.5 m */
    state_free(&state);
  }
  state_free(&exact);
  test_body_destroy(&b);
}

/* A bar that is released and swings, against another code's motion. In ARKODE's stages SUNDIALS' Newton takes several
 * times as many iterations. */
static void a_swing(void)
{
  test_body b;
  flesh_mesh *mesh = NULL;
  flesh_material material;
  CHECK_OK(flesh_mesh_read("reference/oracle/bar_8x2x2.mesh", &mesh));
  CHECK_OK(flesh_material_from_lame(FLESH_ENERGY_B, FLESH_CONSTANTS_RAW, 5e5, 2e6, &material));
  CHECK_OK(test_body_create(mesh, material, 1000, FLESH_MASS_LUMPED, 1, &b));
  CHECK_OK(test_body_gravity(&b, 0, 0, -9.8));
  CHECK_OK(test_body_clamp(&b, 1e-9));
  CHECK_OK(flesh_system_finalize(b.system));
  flesh_state exact = state_copy(b.n, &b.state);
  motion_read_states("grav_lumped_ref_states.txt", 1, b.n / 3, &exact);
  for (int kind = 0; kind < OWNED_KINDS; kind++) {
    long newton[2];
    for (int plain = 0; plain < 2; plain++) {
      flesh_state state;
      owned_integrator o = owned_new((owned_kind)kind, 1e-5, context, NULL);
      o.plain = plain;
      CHECK(run(&o, &b, 1, &state) >= 0);
      const double off = motion_distance(b.n, state.x, exact.x);
      printf("# %s, %s: %ld steps, %ld failures, %ld Newton iterations, off by %.3g m\n", owned_names[kind],
             plain ? "SUNDIALS' Newton" : "flesh's", o.steps, o.failures, o.newton, off);
      newton[plain] = o.newton;
      CHECK_BELOW(off, 4 * 1e-3);
      state_free(&state);
    }
    if (kind == OWNED_ARKODE) CHECK_BELOW((double)newton[0], 0.5 * (double)newton[1]);
  }
  state_free(&exact);
  test_body_destroy(&b);
}

/* Solves are as accurate as the integrator asks for: with a thousandth of its tolerance they take more iterations, in
 * about as many steps. */
static void solves_are_as_exact_as_is_asked(void)
{
  test_body b;
  make_busy_bar(FLESH_MASS_LUMPED, &b);
  for (int kind = 0; kind < OWNED_KINDS; kind++) {
    double iterations[2];
    for (int exact = 0; exact < 2; exact++) {
      flesh_state state;
      owned_integrator o = owned_new((owned_kind)kind, 1e-5, context, NULL);
      o.coefficient = exact ? 1e-4 : 0.1;
      CHECK(run(&o, &b, 0.5, &state) >= 0);
      iterations[exact] = (double)o.newton / o.steps;
      state_free(&state);
    }
    printf("# %s: %.2f Newton iterations a step, %.2f where exact\n", owned_names[kind], iterations[0], iterations[1]);
    CHECK(iterations[1] > 1.2 * iterations[0]);
  }
  test_body_destroy(&b);
}

/* Makes a cube above a floor, a plane or a `sheet` of two triangles, that it meets with `velocity`. */
static void make_faller(double height, int sheet, const double velocity[3], const flesh_contact_options *contact,
                        test_body *b)
{
  const double corners[] = {-2, -2, -height, 3, -2, -height, 3, 3, -height, -2, 3, -height};
  flesh_material material;
  flesh_obstacle *floor = NULL;
  flesh_effect *effect = NULL;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &material));
  CHECK_OK(test_body_create(test_box(2, 2, 2, 0.2, 0.2, 0.2), material, 1000, FLESH_MASS_LUMPED, 1, b));
  if (sheet) CHECK_OK(flesh_obstacle_mesh(4, corners, 2, (int[]){0, 1, 2, 0, 2, 3}, &floor));
  else CHECK_OK(flesh_obstacle_plane((double[]){0, 0, -height}, (double[]){0, 0, 1}, &floor));
  CHECK_OK(flesh_effect_obstacle_contact(&b->body, contact, &floor, &effect));
  CHECK_OK(flesh_system_add_effect(b->system, &effect));
  for (int d = 0; d < b->n; d++) b->state.v[d] = velocity[d % 3];
}

/* Extreme values over the steps of a body that meets a floor. */
typedef struct fall {
  const test_body *b;
  double floor, deepest, most, first; /* m; J, largest energy and that at the start */
  double *energies, *zero;
} fall;

static double energy(const fall *f, double t, const double *x, const double *v)
{
  const flesh_point point = flesh_point_at(t, x, v, f->zero);
  double sum = 0;
  if (flesh_system_energies(f->b->system, &point, f->energies)) return INFINITY;
  for (int k = 0; k < flesh_system_effect_count(f->b->system); k++) sum += f->energies[k];
  return sum;
}

static void look(void *data, double t, N_Vector y)
{
  fall *f = data;
  const double *x = N_VGetArrayPointer(y);
  for (int d = 2; d < f->b->n; d += 3) f->deepest = fmin(f->deepest, x[d] - f->floor);
  f->most = fmax(f->most, energy(f, t, x, x + f->b->n));
}

/* A cube hits a sheet obliquely, after steps that have grown in the free flight: no node is below the sheet at any
 * accepted step, it bounces, its momentum along the sheet is conserved, and no energy is gained. SUNDIALS' Newton does
 * not notice a sheet that a step jumps over: the cube ends below it, and the integrator reports success. */
static void impacts_keep_above_the_floor(void)
{
  const double height = 0.05, velocity[3] = {0.7, -0.4, -5};
  flesh_contact_options contact;
  test_body b;
  flesh_contact_options_default(&contact);
  contact.thickness = 1e-3;
  make_faller(height, 1, velocity, &contact, &b);
  CHECK_OK(flesh_system_finalize(b.system));
  double *mass = malloc((size_t)b.n * sizeof *mass);
  flesh_mesh_lumped_mass(b.mesh, b.density, mass);
  for (int kind = 0; kind < OWNED_KINDS; kind++)
    for (int plain = 0; plain < 2; plain++) {
      flesh_state state;
      owned_integrator o = owned_new((owned_kind)kind, 3e-3, context, NULL);
      fall f = {.b = &b, .floor = -height, .deepest = INFINITY, .most = -INFINITY, .energies = calloc(8, sizeof(double)),
                .zero = calloc((size_t)b.n, sizeof(double))};
      o.plain = plain;
      o.look = look, o.data = &f;
      f.first = energy(&f, 0, b.state.x, b.state.v);
      const int flag = run(&o, &b, 0.05, &state);
      double p[3] = {0}, total = 0;
      for (int d = 0; d < b.n; d++) p[d % 3] += mass[d / 3] * state.v[d], total += d % 3 ? 0 : mass[d / 3];
      const double kinetic = total * 12.825, gain = (f.most - f.first) / kinetic; /* |v|^2/2 */
      printf("# %s, %s: flag %d at %.3g s, %ld steps, %ld Newton iterations, %ld failures, lowest node at %.3g m, gain %.3g, "
             "ends at %.3g m/s\n",
             owned_names[kind], plain ? "SUNDIALS' Newton" : "flesh's", flag, state.t, o.steps, o.newton, o.failures,
             f.deepest, gain, p[2] / total);
      if (plain) {
        CHECK(flag < 0 || f.deepest < 0);
      } else {
        CHECK(flag >= 0 && f.deepest > 0 && f.deepest < contact.thickness);
        CHECK_BELOW(gain, 0.02);
        CHECK(p[2] / total > 1);
        for (int c = 0; c < 2; c++) CHECK_NEAR(p[c] / total, velocity[c], 1e-3);
      }
      free(f.energies);
      free(f.zero);
      state_free(&state);
    }
  free(mass);
  test_body_destroy(&b);
}

/* A block slides on a floor: its loss of velocity is friction times the velocity that the floor gives it across, mu (g
 * t + dv_n), except for the first step of an impact. */
static void friction_is_that_of_the_accepted_state(void)
{
  const double friction = 0.3, speed = 0.6, end = 0.12;
  flesh_contact_options contact;
  flesh_effect *viscosity = NULL;
  test_body b;
  flesh_contact_options_default(&contact);
  contact.thickness = 1e-3, contact.friction = friction, contact.slip_speed = 1e-3;
  make_faller(7e-4, 0, (double[]){speed, 0, 0}, &contact, &b);
  CHECK_OK(test_body_gravity(&b, 0, 0, -g));
  CHECK_OK(flesh_effect_viscosity(&b.body, 100, 100, &viscosity));
  CHECK_OK(flesh_system_add_effect(b.system, &viscosity));
  CHECK_OK(flesh_system_finalize(b.system));
  double *mass = malloc((size_t)b.n * sizeof *mass);
  flesh_mesh_lumped_mass(b.mesh, b.density, mass);
  for (int kind = 0; kind < OWNED_KINDS; kind++) {
    flesh_state state;
    owned_integrator o = owned_new((owned_kind)kind, 1e-5, context, NULL);
    CHECK(run(&o, &b, end, &state) >= 0);
    double p[3] = {0}, total = 0;
    for (int d = 0; d < b.n; d++) p[d % 3] += mass[d / 3] * state.v[d], total += d % 3 ? 0 : mass[d / 3];
    const double expected = speed - friction * (g * end + p[2] / total);
    printf("# %s: %ld steps, slides at %.5f m/s, by Coulomb's law at %.5f\n", owned_names[kind], o.steps, p[0] / total,
           expected);
    CHECK_NEAR(p[0] / total, expected, 0.03 * (speed - expected));
    state_free(&state);
  }
  /* ARKODE without calls that announce its steps is refused; otherwise the lagged state would remain the start. */
  flesh_state state;
  owned_integrator o = owned_new(OWNED_ARKODE, 1e-5, context, NULL);
  o.untold = 1;
  CHECK(run(&o, &b, end, &state) < 0);
  CHECK(state.t < end);
  CHECK_TEXT(flesh_error_text(), "flesh_ode_accept");
  state_free(&state);
  free(mass);
  test_body_destroy(&b);
}

/* A bar of 1 m that is held at one end. */
static void make_short_bar(test_body *b)
{
  flesh_material material;
  CHECK_OK(flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, 1e5, 0.45, &material));
  CHECK_OK(test_body_create(test_box(4, 1, 1, 1, 0.25, 0.25), material, 1000, FLESH_MASS_LUMPED, 1, b));
  CHECK_OK(test_body_clamp(b, 1e-9));
  CHECK_OK(flesh_system_finalize(b->system));
}

/* Nodes of a bar in a random heap return to a bar. First steps of a tenth of a second fail; the integrator shortens
 * them and continues. */
static void what_fails_is_tried_in_a_shorter_step(void)
{
  test_body b;
  make_short_bar(&b);
  for (int d = 0; d < b.n; d++) b.state.v[d] = 20 * sin(7 * d);
  for (int kind = 0; kind < OWNED_KINDS; kind++) {
    flesh_state state;
    owned_integrator o = owned_new((owned_kind)kind, 1e-4, context, NULL);
    o.options.max_newton = 2;
    o.first_step = 0.02;
    const int flag = run(&o, &b, 0.05, &state);
    printf("# %s: flag %d, %ld steps, %ld failed solves, %ld rejected\n", owned_names[kind], flag, o.steps, o.failures,
           o.rejected);
    CHECK(flag >= 0 && o.failures > 0 && o.steps > o.failures);
    CHECK_NEAR(state.t, 0.05, 1e-12);
    state_free(&state);
  }
  test_body_destroy(&b);
}

/* A bar in a random heap recovers if only errors of positions are judged. If velocities count, steps follow every mode:
 * a tenth of the time takes more of them. */
static void tangles_are_undone_by_the_norm_of_positions(void)
{
  test_body b;
  make_short_bar(&b);
  test_jitter(b.n, 0.3, 4, b.state.x);
  for (int kind = 0; kind < OWNED_KINDS; kind++) {
    long steps[2];
    for (int positions = 0; positions < 2; positions++) {
      int worst, inverted = 0;
      flesh_state state;
      owned_integrator o = owned_new((owned_kind)kind, 1e-3, context, NULL);
      o.positions = positions;
      CHECK(run(&o, &b, positions ? 4 : 0.2, &state) >= 0);
      flesh_mesh_jacobians(b.mesh, state.x, NULL, &worst, &inverted);
      printf("# %s%s: %ld steps to %.1f s, %ld Newton iterations, %d inverted tets\n", owned_names[kind],
             positions ? ", norm of positions" : "", o.steps, state.t, o.newton, inverted);
      steps[positions] = o.steps;
      if (positions) CHECK(inverted == 0);
      state_free(&state);
    }
    CHECK(steps[1] < steps[0]);
  }
  test_body_destroy(&b);
}

/* Meaningless calls are reported. */
static void misuse_is_refused(void)
{
  test_body b;
  flesh_ida_problem *ida = NULL;
  flesh_ode_problem *ode = NULL;
  SUNNonlinearSolver solver = NULL;
  flesh_solver_options options = test_options(1e-8);
  make_busy_bar(FLESH_MASS_LUMPED, &b);
  CHECK_OK(flesh_ida_problem_create(b.system, &options, &ida));
  CHECK_OK(flesh_ode_problem_create(b.system, &options, &ode));
  CHECK(flesh_arkode_sunnonlinsol_create(ode, NULL, context, &solver) == FLESH_ERR_ARGUMENT);
  CHECK(flesh_cvode_sunnonlinsol_create(ode, NULL, context, &solver) == FLESH_ERR_ARGUMENT && !solver);
  CHECK_OK(flesh_ida_sunnonlinsol_create(ida, context, &solver));
  CHECK(SUNNonlinSolGetType(solver) == SUNNONLINEARSOLVER_ROOTFIND);
  N_Vector y = N_VNew_Serial(2 * b.n, context);
  /* Not started. */
  CHECK(flesh_ode_accept(0, y, ode) == FLESH_ERR_ARGUMENT);
  CHECK(SUNNonlinSolSolve(solver, y, y, y, 1, 0, NULL) < 0);
  CHECK_TEXT(flesh_error_text(), "has not been started");
  CHECK(flesh_sunnonlinsol_position_norm(solver, y) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), "flesh_ida_vector_create");
  SUNNonlinSolFree(solver);
  SUNNonlinearSolver another = SUNNonlinSolNewEmpty(context);
  CHECK(flesh_sunnonlinsol_position_norm(another, y) == FLESH_ERR_ARGUMENT);
  SUNNonlinSolFreeEmpty(another);
  /* A motion backwards in time is no minimisation. */
  N_VConst(1e-6, y);
  CHECK_OK(flesh_ode_start(ode, &b.state, y));
  void *cvode = CVodeCreate(CV_BDF, context);
  double t = 0;
  CHECK_OK(flesh_cvode_sunnonlinsol_create(ode, CVodeGetNonlinearSystemData, context, &solver));
  CHECK(!CVodeInit(cvode, flesh_ode_rhs, 0, y) && !CVodeSStolerances(cvode, 1e-4, 1e-4) && !CVodeSetUserData(cvode, ode));
  CHECK(!CVodeSetNonlinearSolver(cvode, solver));
  owned_silence(&(owned_integrator){.kind = OWNED_CVODE, .context = context, .memory = cvode});
  CHECK(CVode(cvode, -0.1, y, &t, CV_NORMAL) < 0);
  CHECK_TEXT(flesh_error_text(), "back in time");
  CVodeFree(&cvode);
  SUNNonlinSolFree(solver);
  N_VDestroy(y);
  flesh_ida_problem_destroy(&ida);
  flesh_ode_problem_destroy(&ode);
  test_body_destroy(&b);
}

int main(int argc, char **argv)
{
  if (flesh_suncontext_create(&context)) return 99;
  const int failed = RUN_TESTS(argc, argv, TEST(constraints_and_events), TEST(a_consistent_mass), TEST(a_swing),
                               TEST(solves_are_as_exact_as_is_asked),
                               TEST(impacts_keep_above_the_floor), TEST(friction_is_that_of_the_accepted_state),
                               TEST(what_fails_is_tried_in_a_shorter_step),
                               TEST(tangles_are_undone_by_the_norm_of_positions), TEST(misuse_is_refused));
  SUNContext_Free(&context);
  return failed;
}
