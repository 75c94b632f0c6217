/* body.c: rounds positions and values to whole numbers, and writes of each frame only the differences from what the two
 * frames before predict. */
#include "report/body.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "picture/picture_body.h"

static double diagonal(const flesh_mesh *mesh)
{
  flesh_mesh_info info;
  double sum = 0;
  flesh_mesh_inspect(mesh, &info);
  for (int d = 0; d < 3; d++) sum += (info.high[d] - info.low[d]) * (info.high[d] - info.low[d]);
  return sqrt(sum);
}

int flesh_report_body_open(const flesh_picture_panel *panel, const flesh_picture_frame *frames,
                           flesh_report_body *b)
{
  const double PARTS = 65536, LEVELS = 1024; /* of the body's diagonal, and of the range of colours */
  const flesh_mesh *mesh = panel->body->mesh;
  *b = (flesh_report_body){.nodes = flesh_mesh_node_count(mesh),
                           .tets = flesh_mesh_tet_count(mesh),
                           .view = frames[0].view};
  b->quantum = diagonal(mesh) / PARTS;
  for (int f = 0; f < FLESH_REPORT_FIELDS; f++) {
    b->low[f] = frames[f].low;
    b->steps[f] = frames[f].high > frames[f].low ? (frames[f].high - frames[f].low) / LEVELS : 1;
  }
  b->total = (3 + FLESH_REPORT_FIELDS) * (size_t)b->nodes;
  flesh_picture_scene obstacles;
  const int status = flesh_picture_obstacles(panel, &b->view, &obstacles);
  for (int k = 1; k < obstacles.count && !status; k++) b->total += 3 * (size_t)obstacles.surfaces[k].vertices;
  flesh_arena_free(&obstacles.arena);
  if (status) return status;
  b->flag_bytes = ((size_t)b->tets + 7) / 8;
  for (int k = 0; k < 3; k++) b->numbers[k] = flesh_arena_take(&b->memory, b->total * sizeof **b->numbers);
  for (int k = 0; k < 2; k++) b->flags[k] = flesh_arena_take(&b->memory, b->flag_bytes);
  b->J = flesh_arena_take(&b->memory, (size_t)b->tets * sizeof *b->J);
  return b->numbers[0] && b->numbers[1] && b->numbers[2] && b->flags[0] && b->flags[1] && b->J ? FLESH_OK
                                                                                              : flesh_report_no_memory();
}

/* Returns the nearest multiple of the step, in steps: NaN becomes 0, and others are limited to 2^30 of them. */
static int round_to(double value, double step)
{
  const double MOST = 1 << 30, at = value / step;
  return isnan(at) ? 0 : (int)lrint(fmin(fmax(at, -MOST), MOST));
}

/* Writes positions [3*count], rounded, as all x, all y, all z. Returns the end. */
static int *round_positions(int count, const double *x, double quantum, int *to)
{
  for (int d = 0; d < 3; d++)
    for (int i = 0; i < count; i++) *to++ = round_to(x[3 * (size_t)i + (size_t)d], quantum);
  return to;
}

/* Writes a number in as few bytes as it needs: 0, -1, 1, -2, ... become 0, 1, 2, 3, ..., written seven bits per byte,
 * the lowest first, with the eighth bit set in all bytes but the last. */
static void add_number(FILE *numbers, int64_t value)
{
  uint64_t rest = value < 0 ? 2 * (uint64_t)(-(value + 1)) + 1 : 2 * (uint64_t)value;
  for (; rest > 127; rest >>= 7) putc((int)(rest & 127) | 128, numbers);
  putc((int)rest, numbers);
}

/* Writes numbers as differences, each from the one before it, the first from 0. Returns their place as [at, count]. */
static json_t *add_list(FILE *numbers, size_t count, const int *values)
{
  json_t *place = json_pack("[II]", (json_int_t)ftell(numbers), (json_int_t)count);
  for (size_t k = 0; k < count; k++) add_number(numbers, (int64_t)values[k] - (k ? values[k - 1] : 0));
  return place;
}

/* Writes the triangles of curved faces, and the vertices beyond the nodes that they have: six nodes for each, and their
 * weights in eighths. */
static int add_curved(const flesh_mesh *mesh, FILE *numbers, json_t *made)
{
  flesh_curved_surface curved;
  flesh_arena arena = {0};
  int status = flesh_curved_surface_make(mesh, &arena, &curved);
  const size_t triangles = (size_t)curved.triangles, further = (size_t)(curved.vertices - curved.nodes);
  int *hidden = flesh_arena_take(&arena, triangles * sizeof *hidden);
  if (!status && !hidden) status = flesh_report_no_memory();
  for (size_t t = 0; t < triangles && !status; t++) hidden[t] = curved.hidden[t];
  if (!status) {
    json_object_set_new(made, "corners", add_list(numbers, 3 * triangles, curved.corners));
    json_object_set_new(made, "behind", add_list(numbers, triangles, curved.tets));
    json_object_set_new(made, "hidden", add_list(numbers, triangles, hidden));
    json_object_set_new(made, "six", add_list(numbers, 6 * further, curved.six));
    json_object_set_new(made, "eighths", add_list(numbers, 6 * further, curved.eighths));
  }
  flesh_arena_free(&arena);
  return status;
}

int flesh_report_body_mesh(const flesh_report_body *b, const flesh_picture_panel *panel,
                           FILE *numbers, json_t **made)
{
  const flesh_mesh *mesh = panel->body->mesh;
  int triangles, status = FLESH_OK, *rest = b->numbers[0]; /* until the first frame is there */
  const int *corners = flesh_mesh_surface(mesh, &triangles);
  *made = json_pack("{sisi}", "nodes", b->nodes, "tet_count", b->tets);
  if (!*made) return flesh_report_no_memory();
  round_positions(b->nodes, flesh_mesh_positions(mesh), b->quantum, rest);
  json_object_set_new(*made, "rest", add_list(numbers, 3 * (size_t)b->nodes, rest));
  json_object_set_new(*made, "tets", add_list(numbers, 4 * (size_t)b->tets, flesh_mesh_tets(mesh)));
  if (flesh_mesh_order(mesh) == 2) {
    json_object_set_new(*made, "edges",
                        add_list(numbers, 6 * (size_t)b->tets, flesh_mesh_tet_edges(mesh)));
    status = add_curved(mesh, numbers, *made);
  } else {
    json_object_set_new(*made, "corners", add_list(numbers, 3 * (size_t)triangles, corners));
    json_object_set_new(*made, "behind",
                        add_list(numbers, (size_t)triangles, flesh_mesh_surface_tets(mesh)));
  }
  return ferror(numbers) ? flesh_report_no_memory() : status;
}

int flesh_report_body_obstacles(const flesh_report_body *b, const flesh_picture_panel *panel,
                                FILE *numbers, json_t **made)
{
  flesh_picture_scene obstacles;
  const int status = flesh_picture_obstacles(panel, &b->view, &obstacles);
  *made = json_array();
  for (int k = 1; k < obstacles.count && !status; k++) {
    const flesh_render_surface *s = &obstacles.surfaces[k];
    json_array_append_new(*made, json_pack("{sisfso}", "vertices", s->vertices, "fade", s->fade, "corners",
                                           add_list(numbers, 3 * (size_t)s->triangles, s->corners)));
  }
  flesh_arena_free(&obstacles.arena);
  return ferror(numbers) ? flesh_report_no_memory() : status;
}

/* Computes the numbers of a frame: positions of the body and of the obstacles, and the values of the fields. */
static int gather(flesh_report_body *b, const flesh_picture_panel *panel)
{
  flesh_picture_scene obstacles;
  int status = flesh_picture_obstacles(panel, &b->view, &obstacles);
  int *to = round_positions(b->nodes, panel->x, b->quantum, b->numbers[b->frames % 3]);
  for (int k = 1; k < obstacles.count && !status; k++) /* the number of vertices does not change */
    to = round_positions(obstacles.surfaces[k].vertices, obstacles.surfaces[k].x, b->quantum, to);
  flesh_arena_free(&obstacles.arena);
  for (int f = 0; f < FLESH_REPORT_FIELDS && !status; f++) {
    double *values;
    status = flesh_picture_values(panel, (flesh_picture_field)(FLESH_PICTURE_J + f), &values, NULL);
    for (int i = 0; i < b->nodes && !status; i++) *to++ = round_to(values[i] - b->low[f], b->steps[f]);
    free(values);
  }
  return status;
}

static void flag_inverted(flesh_report_body *b, const flesh_picture_panel *panel)
{
  uint8_t *flags = b->flags[b->frames % 2];
  flesh_mesh_jacobians(panel->body->mesh, panel->x, b->J, NULL, NULL);
  memset(flags, 0, b->flag_bytes);
  for (int t = 0; t < b->tets; t++)
    if (!(b->J[t] > 0)) flags[t / 8] |= (uint8_t)(1 << t % 8);
}

int flesh_report_body_frame(flesh_report_body *b, const flesh_picture_panel *panel,
                            FILE *numbers)
{
  const int f = b->frames, *now = b->numbers[f % 3], *last = b->numbers[(f + 2) % 3], *before = b->numbers[(f + 1) % 3];
  const int status = gather(b, panel);
  if (status) return status;
  flag_inverted(b, panel);
  for (size_t k = 0; k < b->total; k++) {
    const int64_t one = last[k], two = before[k];
    const int64_t predicted = b->frames > 1 ? 2 * one - two : b->frames ? one : k ? now[k - 1] : 0;
    add_number(numbers, now[k] - predicted);
  }
  for (size_t k = 0; k < b->flag_bytes; k++) putc(b->flags[0][k] ^ b->flags[1][k], numbers);
  b->frames++;
  return ferror(numbers) ? flesh_report_no_memory() : FLESH_OK;
}
