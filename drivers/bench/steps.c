/* steps.c: measures whole steps of a bar that swings, is twisted, is crushed, is dropped, or comes to rest under its
 * weight. */
#define _GNU_SOURCE
#include <malloc.h>
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

#include "base/error.h"
#include "bench/bench.h"
#include "cli/interrupt.h"
#include "material/form.h"
#include "run/start.h"

const char *const flesh_bench_parts[] = {"kernels", "swing", "twist", "crush", "drop", "static", NULL};

/* Returns the number of bytes that are allocated now. */
static double held(void)
{
  struct mallinfo2 info = mallinfo2();
  return (double)info.uordblks + (double)info.hblkhd;
}

int flesh_bench_bar_open(const flesh_bench_plan *plan, const flesh_bench_case *c, flesh_bench_bar *bar)
{
  const int *cells = c->cells;
  double edge = 1.0 / cells[0], extent[3] = {1, cells[1] * edge, cells[2] * edge};
  *bar = (flesh_bench_bar){0};
  double before = held();
  int status =
      flesh_material_from_young(c->energy, flesh_form_default_constants(c->energy), 1e5, c->poisson, &bar->material);
  if (!status) status = flesh_mesh_box(cells, extent, (double[]){0, 0, 0}, &bar->mesh);
  if (!status && plan->element != FLESH_ELEMENT_TET4) {
    flesh_mesh *raised;
    status = flesh_mesh_raise_order(bar->mesh, &raised);
    flesh_mesh_destroy(&bar->mesh);
    bar->mesh = raised;
  }
  if (status) return status;
  bar->mesh_bytes = held() - before;
  int tets = flesh_mesh_tet_count(bar->mesh);
  bar->density = malloc((size_t)tets * sizeof *bar->density);
  if (!bar->density) return flesh_no_memory();
  for (int e = 0; e < tets; e++) bar->density[e] = 1000;
  bar->body = (flesh_body){.mesh = bar->mesh,
                           .density = bar->density,
                           .materials = &bar->material,
                           .instructions = plan->instructions,
                           .element = plan->element};
  return FLESH_OK;
}

void flesh_bench_bar_close(flesh_bench_bar *bar)
{
  flesh_mesh_destroy(&bar->mesh);
  free(bar->density);
  bar->density = NULL;
}

/* A case: its system and its state. */
typedef struct run {
  const flesh_bench_plan *plan;
  const flesh_bench_bar *bar;
  const char *name;
  int threads, is_static;
  flesh_system *system;
  flesh_integrator *integrator;
  flesh_state state;
  flesh_solve_stats stats;
  double system_bytes;
} run;

/* Lists the nodes of a face, x <= 0 or (`far`) x >= 1; returns their number. */
static int face(const flesh_mesh *mesh, int far, int *nodes)
{
  const double *X = flesh_mesh_positions(mesh);
  int count = 0;
  for (int i = 0; i < flesh_mesh_node_count(mesh); i++)
    if (far ? X[3 * i] >= 1 - 1e-9 : X[3 * i] <= 0) nodes[count++] = i;
  return count;
}

static int add(run *r, int status, flesh_effect **effect)
{
  return status ? status : flesh_system_add_effect(r->system, effect);
}

static int hold(run *r)
{
  int *nodes = malloc((size_t)flesh_mesh_node_count(r->bar->mesh) * sizeof *nodes);
  if (!nodes) return flesh_no_memory();
  int status = FLESH_OK, twist = !strcmp(r->name, "twist"), crush = !strcmp(r->name, "crush");
  if (strcmp(r->name, "drop"))
    status = flesh_system_add_pin(r->system, face(r->bar->mesh, 0, nodes), nodes, FLESH_AXES_ALL,
                                  -INFINITY, INFINITY);
  if (!status && (twist || crush)) {
    /* The motion of the face: half a turn, or 0.4 of the length, in half a second. */
    flesh_keyframe keys[2] = {{.t = 0}, {.t = 0.5}};
    if (twist) keys[1].rotation[0] = 3.14159265358979;
    else keys[1].translation[0] = -0.4;
    flesh_mesh_info info;
    flesh_mesh_inspect(r->bar->mesh, &info);
    flesh_motion motion = {2, keys, {1, info.high[1] / 2, info.high[2] / 2}, 0};
    status = flesh_system_add_prescribed_motion(r->system, face(r->bar->mesh, 1, nodes), nodes, FLESH_AXES_ALL,
                                     &motion, -INFINITY, INFINITY);
  }
  free(nodes);
  return status;
}

/* Makes contact with a plane 5 cm below the bar. */
static int make_ground(const flesh_body *body, flesh_effect **effect)
{
  flesh_obstacle *plane = NULL;
  flesh_contact_options options;
  flesh_contact_options_default(&options);
  int status = flesh_obstacle_plane((double[]){0, 0, -0.05}, (double[]){0, 0, 1}, &plane);
  return status ? status : flesh_effect_obstacle_contact(body, &options, &plane, effect);
}

static int make_system(run *r)
{
  const flesh_body *body = &r->bar->body;
  flesh_effect *effect = NULL;
  double before = held();
  int status = flesh_system_create(r->bar->mesh, &r->system);
  if (!status && !r->is_static) status = add(r, flesh_effect_inertia(body, &effect), &effect);
  if (!status) status = add(r, flesh_effect_elasticity(body, &effect), &effect);
  int drop = !strcmp(r->name, "drop");
  if (!status && drop) status = add(r, make_ground(body, &effect), &effect);
  if (!status && (r->is_static || drop || !strcmp(r->name, "swing"))) {
    const double g[3] = {0, 0, r->is_static ? -0.5 : -9.81};
    status = add(r, flesh_effect_gravity(body, g, &effect), &effect);
  }
  if (!status) status = hold(r);
  if (!status) status = flesh_system_finalize(r->system);
  r->system_bytes = held() - before;
  return status;
}

/* Makes a new integrator and sets the state to the start. */
static int prepare(void *data)
{
  run *r = data;
  const size_t bytes = 3 * (size_t)flesh_mesh_node_count(r->bar->mesh) * sizeof(double);
  flesh_solver_options options;
  flesh_solver_options_default(&options);
  options.newton_tolerance = r->is_static ? 1e-8 : r->plan->tolerance;
  options.threads = r->threads;
  flesh_integrator_destroy(&r->integrator);
  memset(&r->stats, 0, sizeof r->stats);
  memcpy(r->state.x, flesh_mesh_positions(r->bar->mesh), bytes);
  memset(r->state.v, 0, bytes);
  r->state.t = 0;
  return flesh_integrator_create(
      r->system, r->is_static ? FLESH_METHOD_STATIC : FLESH_METHOD_BACKWARD_EULER, &options,
      &r->integrator);
}

static int all_steps(void *data)
{
  run *r = data;
  int status = FLESH_OK, steps = r->is_static ? 1 : r->plan->steps;
  double h = r->is_static ? 1 : 1.0 / 60;
  for (int k = 0; k < steps && !status; k++) {
    status = flesh_integrator_step(r->integrator, &r->state, h, &r->stats);
    if (flesh_interrupt_signal())
      return flesh_fail(FLESH_ERR_INTERRUPTED, "stopped by %s", flesh_interrupt_name());
  }
  return status;
}

/* Returns the 2-norm of the displacement at the end, m; it is equal when the same work was done. */
static double answer_of(const run *r)
{
  const double *X = flesh_mesh_positions(r->bar->mesh);
  double sum = 0;
  for (int d = 0; d < 3 * flesh_mesh_node_count(r->bar->mesh); d++) sum += (r->state.x[d] - X[d]) * (r->state.x[d] - X[d]);
  return sqrt(sum);
}

/* Returns a new row: counters over all steps, memory of each part in bytes, and the peak of the process's memory. */
static json_t *row_of(const run *r, int status, const flesh_bench_time *time, double integrator_bytes)
{
#define COUNT(name) {#name, FLESH_FIELD_INT, offsetof(flesh_solve_stats, name)}
  static const flesh_study_field counts[] = {COUNT(newton), COUNT(linear), COUNT(assemblies), COUNT(projections),
                                             COUNT(backtracks), {0}};
  struct rusage usage = {0};
  getrusage(RUSAGE_SELF, &usage);
  json_t *row = flesh_bench_row(r->is_static ? "static" : "step", r->name, r->bar->mesh, time), *more = json_pack(
      "{si si sf s{sf sf sf} si}", "status", status, "steps", r->is_static ? 1 : r->plan->steps, "answer_m", answer_of(r),
      "memory", "mesh", r->bar->mesh_bytes, "effects and pattern", r->system_bytes, "integrator", integrator_bytes,
      "peak_memory_kB", (int)usage.ru_maxrss);
  json_object_update_new(row, more);
  json_object_update_new(row, flesh_fields_json(counts, &r->stats));
  return row;
}

int flesh_bench_steps(const flesh_bench_plan *plan, const flesh_bench_bar *bar, const char *name, int threads, json_t *rows)
{
  run r = {.plan = plan, .bar = bar, .name = name, .threads = threads, .is_static = !strcmp(name, "static")};
  flesh_bench_time time = {0};
  int status = flesh_state_make(flesh_mesh_node_count(bar->mesh), 0, 0, &r.state);
  if (!status) status = make_system(&r);
  double before = held();
  if (!status) {
    status = flesh_bench_measure(prepare, all_steps, &r, plan->repeats, &time);
    if (status == FLESH_ERR_SOLVE) time = (flesh_bench_time){NAN, NAN, NAN, NAN, NAN, 0};
    if (!status || status == FLESH_ERR_SOLVE) json_array_append_new(rows, row_of(&r, status, &time, held() - before));
  }
  flesh_integrator_destroy(&r.integrator);
  flesh_system_destroy(&r.system);
  free(r.state.x);
  return status;
}
