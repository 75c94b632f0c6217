/* describe.c: tells which bodies touch, which parts of surfaces are let apart and which never touch, and how hard surfaces
 * that start close are pushed apart; finds loads on single nodes, by the nodes that their residual touches; counts steps,
 * evaluated at their ends, within which loads and motions begin, turn or end more than once; and estimates how far
 * four-node tets lock: by a linear solve on the scene's mesh if that is cheap compared with the run, else from a table. */
#include "run/describe.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "base/error.h"
#include "effect/effect.h"
#include "effect/surface_contact.h"
#include "flesh/effects.h"
#include "flesh/system.h"
#include "material/form.h"
#include "mesh/edges.h"
#include "mesh/mesh.h"
#include "mesh/pieces.h"
#include "parallel/body_figures.h"
#include "run/start.h"
#include "scene/scene.h"

enum { MOST = 8 }; /* number of pairs of patches that are printed one by one */

/* Prints whether several bodies touch or pass through each other. */
static void describe_bodies(const flesh_scene *scene, FILE *stream)
{
  const flesh_system *system = flesh_scene_system(scene);
  const int bodies = flesh_scene_body(scene)->part_count;
  int pairs = bodies * (bodies - 1) / 2, touching = 0;
  if (bodies < 2) return;
  for (int a = 0; a < bodies; a++)
    for (int b = a + 1; b < bodies; b++) {
      int may = 0;
      for (int k = 0; k < flesh_system_effect_count(system); k++)
        may |= flesh_surface_contact_may_meet(flesh_system_effect(system, k), a, b);
      touching += may;
    }
  if (!touching) fprintf(stream, "bodies: %d, which do not touch each other: they pass through each other\n", bodies);
  else if (touching == pairs) fprintf(stream, "bodies: %d, which touch each other\n", bodies);
  else
    fprintf(stream, "bodies: %d; of their %d pairs %d may touch, the others pass through each other\n", bodies, pairs,
            touching);
}

static const char *name_of(const flesh_body *body, int part)
{
  return body->part_count > 1 && body->parts[part].name ? body->parts[part].name : "the body";
}

static void describe_ignored(const flesh_scene *scene, const flesh_effect *effect, const double *x, FILE *stream)
{
  const flesh_body *body = flesh_scene_body(scene);
  flesh_patch_pair *pairs;
  int count;
  if (flesh_surface_contact_ignored(effect, x, &count, &pairs)) return; /* the run will fail for the same reason */
  for (int k = 0; k < count && k < MOST; k++) {
    const flesh_patch_pair *pair = &pairs[k];
    const int itself = pair->bodies[0] == pair->bodies[1];
    fprintf(stream, "contact: %s goes through %s at (%.4g, %.4g, %.4g) m; %d and %d faces there do not touch each other "
            "until they are apart\n", name_of(body, pair->bodies[0]), itself ? "itself" : name_of(body, pair->bodies[1]),
            pair->place[0], pair->place[1], pair->place[2], pair->faces[0], pair->faces[1]);
  }
  if (count > MOST) fprintf(stream, "  and at %d more places\n", count - MOST);
  free(pairs);
}

static void describe_left_out(const flesh_scene *scene, const flesh_effect *effect, FILE *stream)
{
  const double *X = flesh_mesh_positions(flesh_scene_mesh(scene));
  flesh_left_out found;
  if (flesh_surface_contact_left_out(effect, &found) || !found.nodes) return;
  fprintf(stream, "contact: %d node%s faced across a gap that is smaller than the thickness at rest: %s not touch what is there "
          "(the narrowest is %.3g m, at node %d, (%.4g, %.4g, %.4g) m); a smaller `thickness` enables contact there\n",
          found.nodes, found.nodes == 1 ? " is" : "s are", found.nodes == 1 ? "it does" : "they do", found.gap, found.node,
          X[3 * (size_t)found.node], X[3 * (size_t)found.node + 1], X[3 * (size_t)found.node + 2]);
}

/* Prints how hard surfaces that start closer than half of the thickness, as they seldom rest, are pushed apart. */
static void describe_push(const flesh_scene *scene, const flesh_effect *effect, FILE *stream)
{
  if (!flesh_is_surface_contact(effect)) return;
  const flesh_state *start = &scene->start;
  const double thickness = ((const flesh_surface_contact *)effect->data)->law.thickness;
  const flesh_point point = flesh_point_at(start->t, start->x, start->v, start->v);
  double values[4]; /* gap, pairs and force; where bodies separate, also how many do */
  effect->operations->figures->report(effect, &point, values);
  if (values[0] >= thickness / 2) return;
  fprintf(stream, "contact: surfaces start %.3g m from each other, within half of the thickness of %.3g m: its barrier pushes "
          "them apart with %.3g N; a smaller `thickness` avoids that\n", values[0], thickness, values[2]);
}

void flesh_describe_touching(const flesh_scene *scene, FILE *stream)
{
  const flesh_system *system = flesh_scene_system(scene);
  describe_bodies(scene, stream);
  for (int k = 0; k < flesh_system_effect_count(system); k++) {
    describe_left_out(scene, flesh_system_effect(system, k), stream);
    describe_push(scene, flesh_system_effect(system, k), stream);
    describe_ignored(scene, flesh_system_effect(system, k), scene->start.x, stream);
  }
}

/* Returns whether one tet has all marked nodes; 0 if none is marked. */
static int within_a_tet(const flesh_mesh *mesh, const char *marked)
{
  int count = 0;
  for (int i = 0; i < flesh_mesh_node_count(mesh); i++) count += marked[i];
  if (!count || count > 10) return 0;
  for (int t = 0; t < flesh_mesh_tet_count(mesh); t++) {
    int nodes[10], size = flesh_mesh_tet_nodes(mesh, t, nodes), inside = 0;
    for (int a = 0; a < size; a++) inside += marked[nodes[a]];
    if (inside == count) return 1;
  }
  return 0;
}

/* Marks the nodes on which the effect acts at time t. */
static int mark(const flesh_effect *effect, double t, const double *x, const double *zero, int n, double *r,
                char *marked)
{
  const flesh_point point = flesh_point_at(t, x, zero, zero);
  memset(r, 0, (size_t)n * sizeof *r);
  if (effect->operations->residual(effect, &point, r)) return 1;
  for (int d = 0; d < n; d++) marked[d / 3] |= (char)(r[d] != 0);
  return 0;
}

const char *flesh_point_load(const flesh_scene *scene)
{
  enum { TIMES = 16 };
  const flesh_system *system = flesh_scene_system(scene);
  const flesh_mesh *mesh = flesh_scene_mesh(scene);
  const int n = flesh_system_unknowns(system);
  const char *found = NULL;
  double *x = calloc((size_t)n, 3 * sizeof *x + 1);
  if (!x) return NULL;
  double *zero = x + n, *r = zero + n;
  char *marked = (char *)(r + n); /* the marks stand behind the doubles */
  /* The positions differ from the rest shape, so that springs are extended. */
  for (int d = 0; d < n; d++) x[d] = flesh_mesh_positions(mesh)[d] * 1.01 + 1e-3;
  for (int k = 0; !found && k < flesh_system_effect_count(system); k++) {
    const flesh_effect *effect = flesh_system_effect(system, k);
    if (effect->operations->role != FLESH_ROLE_LOAD || flesh_effect_spring_radius(effect, NULL) > 0) continue;
    memset(marked, 0, (size_t)n);
    double t = 0;
    int failed = mark(effect, t, x, zero, n, r, marked);
    for (int e = 0; e < TIMES && !failed; e++) {
      const double next = flesh_system_next_event(system, t);
      if (!(next < INFINITY)) break;
      failed = mark(effect, t + (next - t) / 2, x, zero, n, r, marked) || mark(effect, next, x, zero, n, r, marked);
      t = next;
    }
    if (!failed && within_a_tet(mesh, marked)) found = effect->operations->name;
  }
  free(x);
  return found;
}

int flesh_steps_over(const flesh_scene *scene, double until, double *first)
{
  const flesh_scene_time *time = flesh_scene_times(scene);
  const flesh_system *system = flesh_scene_system(scene);
  const double slack = 1e-6 * time->step;
  int count = 0;
  if (time->method != FLESH_METHOD_BACKWARD_EULER || time->adaptive.control) return 0;
  for (double t = flesh_system_next_event(system, slack), end; t < until; t = flesh_system_next_event(system, end + slack)) {
    end = time->step * ceil((t - slack) / time->step);
    const int over = t < end - slack && flesh_system_next_event(system, t + slack) < end - slack;
    if (over && !count++) *first = t;
  }
  return count;
}

/* ---- locking ---- */

static const double warns_from = 0.47 - 1e-9;

/* Returns whether some four-node tet has the material. */
static int has_four_nodes(const flesh_body *body, int material)
{
  const int *edges = flesh_mesh_tet_edges(body->mesh);
  if (!edges) return 1;
  for (size_t e = 0; e < (size_t)flesh_mesh_tet_count(body->mesh); e++)
    if (edges[6 * e] < 0 && (body->tet_material ? body->tet_material[e] : 0) == material) return 1;
  return 0;
}

/* Returns the largest Poisson's ratio at small strain among the materials of four-node tets; NaN if none is known. */
static double largest_ratio(const flesh_scene *scene)
{
  const flesh_body *body = flesh_scene_body(scene);
  double largest = NAN;
  for (int k = 0; body->materials && k < flesh_scene_material_count(scene); k++) {
    double mu, lambda;
    if (!has_four_nodes(body, k) || flesh_material_small_strain(&body->materials[k], &mu, &lambda, NULL)) continue;
    largest = fmax(largest, lambda / (2 * (lambda + mu))); /* fmax ignores NaN */
  }
  return largest;
}

/* A body of one kind of element, with its pins and its load. */
typedef struct trial {
  flesh_body body;
  flesh_mesh *raised; /* NULL: the scene's mesh is used */
  flesh_material *materials;
  flesh_system *system;
  flesh_integrator *integrator;
  flesh_state state;
  double *mass;
} trial;

static void close_trial(trial *t)
{
  flesh_integrator_destroy(&t->integrator);
  flesh_system_destroy(&t->system);
  flesh_mesh_destroy(&t->raised);
  free(t->materials);
  free(t->state.x);
  free(t->mass);
}

/* Makes the scene's materials with the form S, which is free of stress at rest, and with their small-strain
 * constants. */
static int make_materials(const flesh_scene *scene, trial *t)
{
  const int count = flesh_scene_material_count(scene);
  const flesh_body *body = flesh_scene_body(scene);
  t->materials = malloc((size_t)count * sizeof *t->materials);
  int status = t->materials ? FLESH_OK : flesh_no_memory();
  for (int k = 0; k < count && !status; k++) {
    double mu, lambda;
    status = flesh_material_small_strain(&body->materials[k], &mu, &lambda, NULL);
    if (!status)
      status = flesh_material_from_young(FLESH_ENERGY_S, FLESH_CONSTANTS_MATCHED, flesh_young_of_lame(mu, lambda),
                                         flesh_poisson_of_lame(mu, lambda), &t->materials[k]);
  }
  return status;
}

/* Pins the dofs that the scene constrains at the start; a mid-edge node is pinned if both ends of its edge are. */
static int add_pins(const flesh_scene *scene, trial *t)
{
  const flesh_mesh *mesh = t->body.mesh, *own = flesh_scene_mesh(scene);
  const int nodes = flesh_mesh_node_count(mesh), corners = flesh_mesh_node_count(own);
  uint8_t *fixed = calloc(3 * (size_t)nodes, 1);
  int *held = malloc((size_t)nodes * sizeof *held), any = 0;
  int status = fixed && held ? FLESH_OK : flesh_no_memory();
  if (!status) flesh_system_fixed(flesh_scene_system(scene), 0, fixed);
  for (int k = 0; t->raised && !status && k < 6 * flesh_mesh_tet_count(mesh); k++) {
    const int *n = flesh_mesh_tets(mesh) + 4 * (k / 6), middle = flesh_mesh_tet_edges(mesh)[k];
    for (int c = 0; middle >= corners && c < 3; c++)
      fixed[3 * middle + c] = fixed[3 * n[flesh_edge_corners[k % 6][0]] + c] && fixed[3 * n[flesh_edge_corners[k % 6][1]] + c];
  }
  for (int c = 0; c < 3 && !status; c++) {
    int count = 0;
    for (int i = 0; i < nodes; i++)
      if (fixed[3 * i + c] && flesh_mesh_node_used(mesh)[i]) held[count++] = i;
    any |= (count > 0) << c;
    if (count) status = flesh_system_add_pin(t->system, count, held, 1u << c, -INFINITY, INFINITY);
  }
  free(fixed);
  free(held);
  /* If the body can still rotate about its pins, the solve fails. */
  return status || any == 7 ? status : flesh_fail(FLESH_ERR_SOLVE, "nothing holds the body");
}

/* Finds a load per mass along the shortest side of the body's box that strains it by about 1e-5. */
static void find_load(const trial *t, double load[3])
{
  const flesh_mesh *mesh = t->body.mesh;
  int axis = 2;
  double soft = INFINITY, heavy = 0, box[6];
  flesh_body_rest_box(mesh, NULL, box);
  for (int c = 1; c >= 0; c--)
    if (box[3 + c] - box[c] < box[3 + axis] - box[axis]) axis = c;
  for (int e = 0; e < flesh_mesh_tet_count(mesh); e++) {
    soft = fmin(soft, t->materials[t->body.tet_material ? t->body.tet_material[e] : 0].young);
    heavy = fmax(heavy, t->body.density[e]);
  }
  memset(load, 0, 3 * sizeof *load);
  load[axis] = -1e-6 * soft / (heavy * flesh_body_longest_side(mesh, NULL));
}

static int make_trial(const flesh_scene *scene, flesh_element element, int max_linear, const double load[3], trial *t)
{
  flesh_effect *effect = NULL;
  int status = flesh_system_create(t->body.mesh, &t->system);
  t->body.element = element;
  t->body.material_elements = NULL;
  t->body.mass = FLESH_MASS_LUMPED;
  if (!status) status = flesh_effect_elasticity(&t->body, &effect);
  if (!status) status = flesh_system_add_effect(t->system, &effect);
  if (!status) status = flesh_effect_gravity(&t->body, load, &effect);
  if (!status) status = flesh_system_add_effect(t->system, &effect);
  if (!status) status = add_pins(scene, t);
  if (!status) status = flesh_system_finalize(t->system);
  const int nodes = flesh_mesh_node_count(t->body.mesh);
  if (!status) status = flesh_state_make(nodes, 0, 0, &t->state);
  if (status) return status;
  t->mass = calloc((size_t)nodes, sizeof *t->mass);
  if (!t->mass) return flesh_no_memory();
  memcpy(t->state.x, flesh_mesh_positions(t->body.mesh), 3 * (size_t)nodes * sizeof(double));
  flesh_mesh_lumped_mass(t->body.mesh, t->body.density, t->mass);
  flesh_solver_options options = *flesh_scene_solver(scene);
  options.newton_tolerance = 0.1, options.linear_tolerance = 0.01;
  options.max_newton = 3, options.max_linear = max_linear, options.max_cutbacks = 0;
  options.techniques &= ~(unsigned)(FLESH_TECHNIQUE_NEGATIVE_CURVATURE | FLESH_TECHNIQUE_LONGER_STEPS |
                                    FLESH_TECHNIQUE_NONLINEAR_ELIMINATION | FLESH_TECHNIQUE_WATCHDOG |
                                    FLESH_TECHNIQUE_UNTANGLE);
  options.linear_solver = FLESH_LINEAR_PCG;
  return flesh_integrator_create(t->system, FLESH_METHOD_STATIC, &options, &t->integrator);
}

/* Computes the work of the load, J. */
static int find_work(const flesh_scene *scene, flesh_element element, int max_linear, double *work)
{
  trial t = {.body = *flesh_scene_body(scene)};
  double load[3];
  int status = make_materials(scene, &t);
  if (!status && element != FLESH_ELEMENT_TET4) status = flesh_mesh_raise_order(t.body.mesh, &t.raised);
  if (t.raised) t.body.mesh = t.raised;
  t.body.materials = t.materials;
  if (!status) find_load(&t, load);
  if (!status) status = make_trial(scene, element, max_linear, load, &t);
  if (!status) status = flesh_integrator_step(t.integrator, &t.state, 1, NULL);
  *work = 0;
  for (int i = 0; !status && i < flesh_mesh_node_count(t.body.mesh); i++)
    for (int c = 0; c < 3; c++)
      *work += t.mass[i] * load[c] * (t.state.x[3 * i + c] - flesh_mesh_positions(t.body.mesh)[3 * i + c]);
  close_trial(&t);
  return status > 0 ? flesh_fail(FLESH_ERR_SOLVE, "the linear solve did not converge") : status;
}

/* Computes how much less the body yields to a small transverse load with four-node tets than with tet10-mean on the
 * same mesh: 1 - the ratio of the works of the load. The scene's pins and small-strain constants are used.
 * FLESH_ERR_SOLVE if the body could move as a rigid body, or if a solve takes more than `max_linear` iterations. */
static int find_locking(const flesh_scene *scene, int max_linear, double *missing)
{
  double stiff, soft;
  int status = find_work(scene, FLESH_ELEMENT_TET10_MEAN, max_linear, &soft);
  if (!status) status = find_work(scene, FLESH_ELEMENT_TET4, max_linear, &stiff);
  if (!status && !(soft > 0 && stiff > 0)) status = flesh_fail(FLESH_ERR_SOLVE, "the body does not yield");
  if (!status) *missing = 1 - stiff / soft;
  return status;
}

/* Prints by how much linear tets bend too little according to a table: a clamped bar of 4 x 1 x 1 m of the form S that
 * bends under its weight, compared with the limit of fine meshes. */
static void say_table(double ratio, const char *why, FILE *stream)
{
  static const struct {
    double from, poisson;
    int coarse, fine; /* % */
  } locking[] = {{0.4995, 0.4999, 91, 88}, {0.495, 0.499, 84, 64}, {0, 0.49, 51, 22}};
  int k = 0;
  while (ratio < locking[k].from) k++;
  fprintf(stream, "from a table: at %g a bar of 5 000 tets bends %d %% too little, one of 53 000 %d %%; a linear solve on "
                  "this mesh %s",
          locking[k].poisson, locking[k].coarse, locking[k].fine, why);
}

/* Limits on the cost of the two solves, in steps of four-node tets. The two cost as much as 63 and 73 steps at nu =
 * 0.49 with 1536 and 5184 tets of a bar, and 23 and 27 at 0.4999, where steps cost more. The limits are counts, so that
 * the printed words do not depend on the machine. */
enum { TRIAL_STEPS = 75, ITERATIONS_A_STEP = 5, MOST_ITERATIONS = 5000 };

/* Returns the number of linear iterations allowed for a solve so that both cost at most a fifth of the run; 0 if they
 * would cost more. */
static int affordable(const flesh_scene *scene)
{
  const flesh_scene_time *time = flesh_scene_times(scene);
  if (time->method == FLESH_METHOD_STATIC || !(time->step > 0)) return 0;
  const double steps = 0.2 * time->end / time->step;
  return steps >= TRIAL_STEPS ? (int)fmin(ITERATIONS_A_STEP * steps, MOST_ITERATIONS) : 0;
}

void flesh_warn_of_locking(const flesh_scene *scene, FILE *stream)
{
  const double ratio = largest_ratio(scene);
  const int mixed = flesh_mesh_order(flesh_scene_mesh(scene)) == 2;
  double missing;
  if (!(ratio >= warns_from)) return;
  fprintf(stream, "warning: four-node tets are too stiff in bending at a Poisson's ratio of %g (", ratio);
  const int split = flesh_scene_mesh(scene)->split != NULL; /* no rank has the whole mesh, so no solve is possible */
  const int most = mixed || split ? 0 : affordable(scene);
  if (most && !find_locking(scene, most, &missing))
    fprintf(stream, "by a linear solve on this mesh, the body yields %.0f %% less to a small transverse load than with "
                    "tet10-mean",
            100 * missing);
  else if (split) say_table(ratio, "is not made of split meshes", stream);
  else if (mixed) say_table(ratio, "is made only of scenes with one element", stream);
  else say_table(ratio, most ? "gave no estimate" : "would cost more than a fifth of the run", stream);
  fprintf(stream, "); set %s: tet10-mean\n", mixed ? "their body's element" : "body.element");
}
