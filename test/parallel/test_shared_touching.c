// TEST full memory needs=ranks ranks=1,2,3,5,8
/* test_shared_touching.c: bodies that touch each other and themselves, with surfaces shared by ranks: runs compared
 * with one rank's, and exchanges of solves, which leave out ghosts that are far. */
#include "scene_files.h"

#include "ranks.h"

#include "crossings.h"
#include "effect/environment.h"
#include "effect/surface_contact.h"
#include "flesh/integrator.h"
#include "linear/block_matrix.h"
#include "linear/overlap_vectors.h"
#include "scene/ranks.h"
#include "system/feasible_step.h"
#include "system/internal.h"
#include "system/proximity.h"
#include "system/ranks.h"
#include "time/integrator.h"

#define MATERIAL "density: 1000, material: {energy: S, young: 1e6, poisson: 0.4}"

/* A block that slides along a track, from one end to the other. */
static const char slide[] =
    "body: {name: track, mesh: track.msh, " MATERIAL "}\n"
    "bodies: [{name: block, mesh: block.msh, translation: [0.05, 0.01, 0.26], velocity: [6, 0, 0], " MATERIAL "}]\n"
    "effects:\n"
    "  - inertia: {}\n"
    "  - gravity: {}\n"
    "  - pin: {box: [[-1, -1, -1], [9, 9, 1e-9]]}\n"
    "  - contact: {between: all, friction: 0.1, slip_speed: 0.1}\n"
    "time: {method: backward-euler, step: 1/100, end: 1}\n"
    "solver: {newton_tolerance: 1e-10}\n";

/* Two blocks, one of which moves by twelve times the thickness in a step. */
static const char impact[] =
    "body: {name: left, mesh: block.msh, " MATERIAL "}\n"
    "bodies: [{name: right, mesh: block.msh, translation: [0.9, 0.05, 0.03], rotation: [0.1, 0.2, 0.3], "
    "velocity: [-30, 0, 0], " MATERIAL "}]\n"
    "effects:\n"
    "  - inertia: {}\n"
    "  - contact: {between: all}\n"
    "time: {method: backward-euler, step: 1/200, end: 1}\n"
    "solver: {newton_tolerance: 1e-10, techniques: [-nonlinear_elimination, -untangle]}\n";

/* A strip whose ends are brought onto each other. */
static const char fold[] =
    "body: {mesh: strip.msh, " MATERIAL "}\n"
    "effects:\n"
    "  - inertia: {}\n"
    "  - viscosity: {shear: 1000, bulk: 1000}\n"
    "  - pin: {box: [[-1, -1, -1], [1e-6, 9, 9]]}\n"
    "  - prescribed_motion: {box: [[2.999, -1, -1], [9, 9, 9]], centre: [1.5, 0, 0], motion: [{time: 0}, "
    "{time: 0.6, rotation: [0, -3, 0], translation: [0, 0, 0.005]}]}\n"
    "  - contact: {between: all, thickness: 0.03, friction: 0.2, slip_speed: 0.1}\n"
    "time: {method: backward-euler, step: 1/20, end: 1}\n"
    "solver: {newton_tolerance: 1e-10}\n";

/* Two blocks welded face to face; the weld is broken by a pull, and the blocks are then pressed onto each other. */
static const char torn[] =
    "body: {name: lower, mesh: block.msh, " MATERIAL "}\n"
    "bodies: [{name: upper, mesh: block.msh, translation: [0, 0, 0.5], " MATERIAL "}]\n"
    "effects:\n"
    "  - inertia: {}\n"
    "  - viscosity: {shear: 1000, bulk: 1000}\n"
    "  - contact: {between: all, thickness: 0.004}\n"
    "  - weld: {bodies: [lower, upper], breaks_at: 3e4}\n"
    "  - pin: {box: [[-1, -1, -1], [9, 9, 1e-9]]}\n"
    "  - prescribed_motion: {box: [[-1, -1, 0.999], [9, 9, 9]], motion: [{time: 0}, "
    "{time: 0.2, translation: [0.02, 0, 0.06]}, {time: 0.4, translation: [0.02, 0, -0.03]}]}\n"
    "time: {method: backward-euler, step: 1/100, end: 1}\n"
    "solver: {newton_tolerance: 1e-10}\n";

/* A plate that comes down on another one's rim by five times their distance in a step; they start 0.15 m apart. */
static const char plates[] =
    "body: {name: lower, mesh: plate.msh, " MATERIAL "}\n"
    "bodies: [{name: upper, mesh: plate.msh, translation: [0.3, 0.05, 0.2], velocity: [0, 0, -40], " MATERIAL "}]\n"
    "effects:\n"
    "  - inertia: {}\n"
    "  - contact: {between: all}\n"
    "time: {method: backward-euler, step: 1/50, end: 1}\n"
    "solver: {newton_tolerance: 1e-4}\n";

/* A block that lies half a thickness above another one, and a third one far from both. */
static const char resting[] =
    "body: {name: lower, mesh: block.msh, " MATERIAL "}\n"
    "bodies:\n"
    "  - {name: upper, mesh: block.msh, translation: [0.03, 0.02, 0.502], " MATERIAL "}\n"
    "  - {name: distant, mesh: block.msh, translation: [90, 0, 0], " MATERIAL "}\n"
    "effects: [{inertia: {}}, {contact: {between: all, thickness: 0.004}}]\n"
    "time: {method: backward-euler, step: 1/100, end: 1}\n";

/* Two blocks, far apart. */
static const char distant[] =
    "body: {name: left, mesh: block.msh, " MATERIAL "}\n"
    "bodies: [{name: right, mesh: block.msh, translation: [90, 0, 0], velocity: [-1, 0, 0], " MATERIAL "}]\n"
    "effects: [{inertia: {}}, {contact: {between: all}}]\n"
    "time: {method: backward-euler, step: 1/100, end: 1}\n";

/* A run of a scene on this rank alone, or of this rank's share. */
typedef struct run {
  flesh_scene *scene;
  flesh_scene_share *share; /* NULL: alone */
  const flesh_system *system;
  flesh_integrator *integrator;
  flesh_state state;
  int n;
} run;

static void open_run(const char *text, int shared, run *r)
{
  *r = (run){0};
  CHECK_OK(flesh_scene_read_text(text, file_path("scene.yaml"), 0, NULL, &r->scene));
  if (!r->scene) exit(1);
  if (shared) CHECK_OK(flesh_scene_share_create(r->scene, ranks, &r->share));
  r->system = shared ? flesh_scene_share_system(r->share) : flesh_scene_system(r->scene);
  r->n = flesh_system_unknowns(r->system);
  r->state.x = calloc((size_t)r->n + 1, sizeof(double));
  r->state.v = calloc((size_t)r->n + 1, sizeof(double));
  r->state.internal_count = flesh_system_internal_count(r->system);
  r->state.internal = calloc((size_t)r->state.internal_count + 1, sizeof(double));
  if (shared) flesh_scene_share_start(r->share, &r->state);
  else flesh_scene_start(r->scene, &r->state);
  CHECK_OK(flesh_integrator_create(r->system, flesh_scene_times(r->scene)->method, flesh_scene_solver(r->scene),
                                   &r->integrator));
}

static void close_run(run *r)
{
  flesh_integrator_destroy(&r->integrator);
  free(r->state.x), free(r->state.v), free(r->state.internal);
  flesh_scene_share_destroy(&r->share);
  flesh_scene_destroy(&r->scene);
}

static int advance(run *r) { return flesh_integrator_step(r->integrator, &r->state, flesh_scene_times(r->scene)->step, NULL); }

/* Returns the vector of the whole assembled from the ranks' `own`, allocated. */
static double *gather(const run *shared, int n, const double *own)
{
  double *whole = malloc((size_t)n * sizeof *whole);
  CHECK_OK(flesh_rank_part_gather(flesh_scene_share_part(shared->share), own, whole));
  return whole;
}

/* Whether any features of the whole touch at x. */
static int touches(const run *alone, const double *x)
{
  double values[4] = {0};
  int k = 0;
  while (!flesh_is_surface_contact(flesh_system_effect(alone->system, k))) k++;
  const flesh_effect *effect = flesh_system_effect(alone->system, k);
  flesh_point point = flesh_point_at(0, x, x, x);
  point.internal = flesh_internal_of(alone->system, k, alone->state.internal);
  effect->operations->figures->report(effect, &point, values);
  return values[1] > 0;
}

/* Nothing crosses; the ranks' run agrees with one rank to `limit` m, and has the same bits when repeated. Returns the
 * number of steps with contact. */
static int compare(const char *name, const char *text, int steps, double limit)
{
  run alone, shared, again;
  flesh_contact_surface surface;
  int touching = 0, crossings = 0, status = FLESH_OK, same = 1;
  double worst = 0;
  open_run(text, 0, &alone);
  open_run(text, 1, &shared);
  open_run(text, 1, &again);
  CHECK_OK(flesh_contact_surface_of_mesh(flesh_scene_mesh(alone.scene), NULL, &surface));
  for (int k = 0; k < steps && !status; k++) {
    status = flesh_communicator_agree(ranks, advance(&alone));
    if (!status) status = advance(&shared);
    if (!status) status = advance(&again);
    CHECK_OK(status);
    same &= !memcmp(shared.state.x, again.state.x, (size_t)shared.n * sizeof(double)) &&
            !memcmp(shared.state.v, again.state.v, (size_t)shared.n * sizeof(double));
    double *x = gather(&shared, alone.n, shared.state.x);
    for (int d = 0; d < alone.n; d++) worst = fmax(worst, fabs(x[d] - alone.state.x[d]));
    crossings += crossings_count(&surface, x);
    touching += touches(&alone, x);
    free(x);
  }
  if (flesh_communicator_rank(ranks) == 0)
    printf("# %s: touches in %d of %d steps, off by %.2g m\n", name, touching, steps, worst);
  CHECK(same);
  CHECK(crossings == 0);
  CHECK_BELOW(worst, limit);
  flesh_contact_surface_clear(&surface);
  close_run(&alone);
  close_run(&shared);
  close_run(&again);
  return touching;
}

/* Computes x [n] from the state with the parts above 0.5 m lowered by a thickness, more so at one side, and keeps its
 * gaps. Returns whether it has changed. */
static int come_down(const run *r, double *x)
{
  for (int d = 0; d < r->n; d++) {
    const double *at = r->state.x + d - d % 3;
    x[d] = r->state.x[d] - (at[2] > 0.501 && d % 3 == 2 ? 0.004 * (1 + at[0]) : 0);
  }
  const flesh_proximity *proximity = r->integrator->evaluation->environment.proximity;
  return flesh_system_keep_gaps(r->system, proximity, r->state.internal, r->state.x, x);
}

/* To the last bit, although each rank only knows the gaps of its own nodes. */
static void gaps_are_kept_as_by_one_rank(void)
{
  run alone, shared;
  open_run(resting, 0, &alone);
  open_run(resting, 1, &shared);
  double *x = malloc((size_t)alone.n * sizeof *x), *own = malloc(((size_t)shared.n + 1) * sizeof *own);
  CHECK(come_down(&alone, x) && come_down(&shared, own));
  double *all = gather(&shared, alone.n, own);
  CHECK(!memcmp(all, x, (size_t)alone.n * sizeof *x));
  free(all);
  free(own);
  free(x);
  close_run(&alone);
  close_run(&shared);
}

/* Ranks do not examine surfaces that are far apart: all of them know it, and none claims it of surfaces that are
 * near. */
static void ranks_know_what_is_far(void)
{
  const char *const texts[] = {distant, resting};
  for (int k = 0; k < 2; k++) {
    run shared;
    open_run(texts[k], 1, &shared);
    for (int s = 0; s < 3; s++) CHECK_OK(advance(&shared));
    CHECK(shared.integrator->evaluation->clearance.stays_far == !k);
    close_run(&shared);
  }
}

static void a_block_slides_from_rank_to_rank(void) { CHECK(compare("slide", slide, 40, 1e-7) > 20); }

static void a_fast_impact_is_seen(void) { CHECK(compare("impact", impact, 8, 1e-6) > 0); }

static void a_strip_touches_itself_across_a_cut(void) { CHECK(compare("fold", fold, 20, 1e-6) > 2); }

static void a_weld_breaks_and_its_faces_meet_again(void) { CHECK(compare("torn", torn, 40, 1e-6) > 2); }

/* Whether the share's upper plate, this far from its start and tilted, would have passed through the lower one on this
 * straight path. */
static int is_tunnelled(const run *shared, double tilt, const double from[3], const double way[3])
{
  double *x[2] = {malloc((size_t)shared->n * sizeof **x), malloc((size_t)shared->n * sizeof **x)};
  for (int d = 0; d < shared->n; d++) {
    const double *at = shared->state.x + d - d % 3;
    const int moves = at[2] > 0.1;
    x[0][d] = shared->state.x[d] + (moves ? from[d % 3] + (d % 3 == 2 ? tilt * (at[0] - 0.3 + at[1] - 0.05) : 0) : 0);
    x[1][d] = x[0][d] + (moves ? way[d % 3] : 0);
  }
  const flesh_proximity *proximity = shared->integrator->evaluation->environment.proximity;
  const int passed = flesh_system_tunnelled(shared->system, proximity, shared->state.internal, 0, x[0], 1. / 50, x[1]);
  free(x[0]);
  free(x[1]);
  return passed;
}

/* The runs of nodes with which a rank bounds a piece contain no node of another piece, whatever nodes the rank owns. */
static void check_pieces(const run *shared)
{
  int k = 0;
  while (!flesh_is_surface_contact(flesh_system_effect(shared->system, k))) k++;
  const flesh_surface_near *near = flesh_proximity_of(shared->integrator->evaluation->environment.proximity, k);
  const flesh_contact_surface *s = &near->contact->surface;
  CHECK(near->pieces == 2);
  for (int r = 0; r < near->run_count; r++)
    for (int i = near->runs[r].begin; i < near->runs[r].end; i++)
      CHECK(s->node_place[i] < 0 || near->piece[s->node_place[i]] == near->runs[r].piece);
}

/* The plates push each other, as on one rank (test_far_bodies). A solve could lead around, as if each was alone. */
static void a_step_does_not_lead_around_what_is_in_its_way(void)
{
  run shared;
  open_run(plates, 1, &shared);
  check_pieces(&shared);
  const double start[3] = {0}, down[3] = {0, 0, -0.8}, past[3] = {1, 0, -0.8}, under[3] = {0, 0, -0.253},
               touching[3] = {-0.17, 0.02, -0.149},
               above[3] = {-0.17, 0.02, -0.14}, along[3] = {-0.33, -0.27, -0.504};
  CHECK(is_tunnelled(&shared, 0, start, down) && !is_tunnelled(&shared, 0, start, past));
  CHECK(is_tunnelled(&shared, 0, start, under)); /* and touches from below */
  CHECK(is_tunnelled(&shared, 0.5, above, down));
  CHECK(is_tunnelled(&shared, 0.5, touching, down));
  CHECK(!is_tunnelled(&shared, 0.5, touching, along)); /* at each end with one corner, which one rank owns */
  for (int s = 0; s < 2; s++) CHECK_OK(advance(&shared));
  const int n = flesh_system_unknowns(flesh_scene_system(shared.scene));
  double *v = gather(&shared, n, shared.state.v), lower = 0, upper = 0;
  for (int d = 2; d < n; d += 3) *(d < n / 2 ? &lower : &upper) += v[d] / (n / 6);
  if (flesh_communicator_rank(ranks) == 0) printf("# plates: %.3g and %.3g m/s\n", lower, upper);
  CHECK(lower < -0.3 && upper > -39.7 && upper < -20);
  free(v);
  close_run(&shared);
}

/* A matrix of the share and of the whole with the block `moved` along the track, and the ranks as solves see them. */
typedef struct matrices {
  run alone, shared;
  flesh_proximity proximity[2];
  flesh_block_matrix *K[2];
  const flesh_team *team, *narrow;
} matrices;

static void make_matrix(const run *r, const double *x, flesh_proximity *proximity, flesh_block_matrix **K)
{
  int grown;
  double *zeros = calloc((size_t)r->n + 1, sizeof *zeros);
  flesh_point point = flesh_point_at(0, x, zeros, zeros);
  point.environment = &(flesh_environment){.proximity = proximity};
  CHECK_OK(flesh_proximity_create(r->system, NULL, proximity));
  CHECK_OK(flesh_system_matrix_create(r->system, K));
  CHECK_OK(flesh_proximity_cover(proximity, &point, *K, &grown));
  CHECK(grown);
  CHECK_OK(flesh_system_jacobian(r->system, &point, &(flesh_shift){.x = 1, .v = 100, .a = 1e4}, *K));
  free(zeros);
}

static void open_matrices(double moved, matrices *m)
{
  open_run(slide, 0, &m->alone);
  open_run(slide, 1, &m->shared);
  const int *nodes = flesh_rank_part_nodes(flesh_scene_share_part(m->shared.share));
  const double *X = flesh_mesh_positions(flesh_scene_mesh(m->alone.scene));
  for (int d = 0; d < m->alone.n; d += 3)
    if (X[d + 2] > 0.255) m->alone.state.x[d] += moved; /* the block, which starts above the track */
  for (int d = 0; d < m->shared.n; d++) m->shared.state.x[d] = m->alone.state.x[3 * nodes[d / 3] + d % 3];
  make_matrix(&m->alone, m->alone.state.x, &m->proximity[0], &m->K[0]);
  make_matrix(&m->shared, m->shared.state.x, &m->proximity[1], &m->K[1]);
  m->team = flesh_system_team(m->shared.system);
  uint8_t *needed = calloc((size_t)m->K[1]->rows + 1, 1);
  CHECK(needed != NULL);
  CHECK_OK(flesh_overlap_narrow(m->K[1], m->team, FLESH_OK, needed, &m->narrow));
  free(needed);
  CHECK(m->team->ranks == 1 || m->narrow != m->team);
}

static void close_matrices(matrices *m)
{
  flesh_team_narrow_end(&m->narrow);
  for (int k = 0; k < 2; k++) {
    flesh_block_matrix_destroy(&m->K[k]);
    flesh_proximity_clear(&m->proximity[k]);
  }
  close_run(&m->alone);
  close_run(&m->shared);
}

/* Ghosts without an exchange keep their values; all others get their owners'. */
static void check_share(const matrices *m)
{
  const int *nodes = flesh_rank_part_nodes(flesh_scene_share_part(m->shared.share)), count = m->team->overlap;
  double *x = malloc(3 * (size_t)count * sizeof *x);
  for (int d = 0; d < 3 * count; d++) x[d] = d < 3 * m->team->own ? 3 * nodes[d / 3] + d % 3 : -1;
  m->narrow->operations->update_ghosts(m->narrow->data, &(flesh_team_vector){3, 3, NULL, x, 1});
  for (int d = 0; d < 3 * count; d++)
    CHECK(x[d] == (m->narrow->left_out && m->narrow->left_out[d / 3] ? -1 : 3 * nodes[d / 3] + d % 3));
  free(x);
}

/* The matrix of a rank's overlap is that of the whole, including contact, and the identity at ghosts left out. */
static void check_overlap(const matrices *m)
{
  const flesh_block_matrix *whole = m->K[0];
  const int *nodes = flesh_rank_part_nodes(flesh_scene_share_part(m->shared.share));
  int *place = malloc((size_t)whole->rows * sizeof *place), left_out = 0;
  double worst = 0, size = 0;
  flesh_overlap overlap;
  CHECK_OK(flesh_overlap_create(m->K[1], m->narrow, NULL, &overlap));
  const flesh_block_matrix *A = flesh_overlap_update(&overlap, m->K[1]);
  memset(place, -1, (size_t)whole->rows * sizeof *place);
  for (int i = 0; i < A->rows; i++) {
    const int out = m->narrow->left_out && m->narrow->left_out[i];
    place[nodes[i]] = out ? -1 : i;
    left_out += out;
    for (int e = 0; e < 9 && out; e++) CHECK(A->values[9 * A->row_start[i] + e] == (e % 4 == 0));
    CHECK(!out || A->row_end[i] == A->row_start[i] + 1);
  }
  for (int i = 0; i < whole->rows; i++)
    for (int k = whole->row_start[i]; k < whole->row_end[i]; k++) {
      const int row = place[i], column = place[whole->column[k]], flipped = row > column;
      for (int e = 0; e < 9; e++) size = fmax(size, fabs(whole->values[9 * k + e]));
      if (row < 0 || column < 0) continue;
      const int at = flesh_block_find(A, flipped ? column : row, flipped ? row : column);
      for (int e = 0; e < 9; e++) {
        const double found = at < 0 ? 0 : A->values[9 * at + (flipped ? 3 * (e % 3) + e / 3 : e)];
        worst = fmax(worst, fabs(found - whole->values[9 * k + e]));
      }
    }
  CHECK_BELOW(worst, 1e-13 * size);
  CHECK(left_out > 0 || m->team->ranks == 1);
  flesh_overlap_clear(&overlap);
  free(place);
}

/* Products collected in this way are those of the whole's matrix. */
static void check_product(const matrices *m)
{
  double *a = malloc((size_t)m->alone.n * sizeof *a), *y = malloc((size_t)m->alone.n * sizeof *y),
         *b = malloc((size_t)m->shared.n * sizeof *b), *z = malloc((size_t)m->shared.n * sizeof *z), worst = 0, size = 0;
  const int *nodes = flesh_rank_part_nodes(flesh_scene_share_part(m->shared.share));
  unsigned long long seed = 3;
  for (int d = 0; d < m->alone.n; d++) a[d] = test_uniform(&seed) - 0.5;
  for (int d = 0; d < m->shared.n; d++) b[d] = a[3 * nodes[d / 3] + d % 3];
  flesh_block_multiply(m->K[0], a, y);
  flesh_block_multiply(m->K[1], b, z);
  m->narrow->operations->add_ghosts(m->narrow->data, &(flesh_team_vector){3, 3, NULL, z, 0});
  double *found = gather(&m->shared, m->alone.n, z);
  for (int d = 0; d < m->alone.n; d++) worst = fmax(worst, fabs(found[d] - y[d])), size = fmax(size, fabs(y[d]));
  CHECK_BELOW(worst, 1e-13 * size);
  free(a), free(y), free(b), free(z), free(found);
}

/* When the block has moved to another rank's end of the track, other ghosts are left out. */
static void solves_exchange_what_is_near(void)
{
  double left_out[2] = {0}, ghosts = 0, others = 0;
  uint8_t *before = NULL;
  for (int k = 0; k < 2; k++) {
    matrices m;
    open_matrices(k ? 2.3 : 0, &m);
    check_share(&m);
    check_overlap(&m);
    check_product(&m);
    const int nodes = m.team->nodes;
    ghosts = nodes - m.team->own;
    for (int i = m.team->own; i < nodes && m.narrow->left_out; i++) {
      left_out[k] += m.narrow->left_out[i];
      others += k && m.narrow->left_out[i] != before[i];
    }
    if (k == 0) before = malloc((size_t)nodes + 1);
    if (k == 0 && m.narrow->left_out) memcpy(before, m.narrow->left_out, (size_t)nodes);
    close_matrices(&m);
  }
  free(before);
  double all[4] = {left_out[0], left_out[1], ghosts, others};
  flesh_communicator_sum(ranks, 4, all);
  if (flesh_communicator_rank(ranks) == 0) printf("# %g and %g of %g ghosts are left out\n", all[0], all[1], all[2]);
  if (flesh_communicator_size(ranks) > 1) CHECK(all[0] > all[2] / 4 && all[1] > all[2] / 4 && all[3] > 0);
}

static void make_box(const char *name, const int cells[3], const double size[3])
{
  flesh_mesh *mesh = NULL;
  CHECK_OK(flesh_mesh_box(cells, size, (double[]){0, 0, 0}, &mesh));
  CHECK_OK(flesh_mesh_write(mesh, file_path(name)));
  flesh_mesh_destroy(&mesh);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  make_box("track.msh", (int[]){12, 2, 1}, (double[]){3, 0.5, 0.25});
  make_box("block.msh", (int[]){2, 2, 2}, (double[]){0.5, 0.48, 0.5});
  make_box("plate.msh", (int[]){4, 4, 1}, (double[]){0.4, 0.4, 0.05});
  make_box("strip.msh", (int[]){24, 2, 1}, (double[]){3, 0.4, 0.1});
  const int failed = RUN_TESTS_ON_RANKS(argc, argv, TEST(solves_exchange_what_is_near),
                                        TEST(a_block_slides_from_rank_to_rank), TEST(a_fast_impact_is_seen),
                                        TEST(gaps_are_kept_as_by_one_rank), TEST(ranks_know_what_is_far),
                                        TEST(a_step_does_not_lead_around_what_is_in_its_way),
                                        TEST(a_strip_touches_itself_across_a_cut),
                                        TEST(a_weld_breaks_and_its_faces_meet_again));
  test_folder_remove(folder);
  return failed;
}
