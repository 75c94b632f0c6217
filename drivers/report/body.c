/* body.c: rounds positions and values to whole numbers, and leaves of each frame what the two
 * before do not tell. */
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
  const double PARTS = 65536, LEVELS = 1024; /* of the body's diagonal, and of the colours */
  const flesh_mesh *mesh = panel->body->mesh;
  *b = (flesh_report_body){.nodes = flesh_mesh_node_count(mesh),
                           .tets = flesh_mesh_tet_count(mesh),
                           .obstacle_count = flesh_picture_obstacle_count(panel),
                           .view = frames[0].view};
  b->quantum = diagonal(mesh) / PARTS;
  for (int f = 0; f < FLESH_REPORT_FIELDS; f++) {
    b->low[f] = frames[f].low;
    b->steps[f] = frames[f].high > frames[f].low ? (frames[f].high - frames[f].low) / LEVELS : 1;
  }
  b->total = (3 + FLESH_REPORT_FIELDS) * (size_t)b->nodes;
  for (int k = 0; k < b->obstacle_count; k++) {
    flesh_picture_obstacle o;
    const int status = flesh_picture_obstacle_make(panel, k, &b->view, &o);
    if (status) return status;
    b->total += 3 * (size_t)o.vertices;
    flesh_picture_obstacle_free(&o);
  }
  b->flag_bytes = ((size_t)b->tets + 7) / 8;
  b->now = calloc(b->total + 1, sizeof *b->now);
  b->last = calloc(b->total + 1, sizeof *b->last);
  b->before = calloc(b->total + 1, sizeof *b->before);
  b->flags = calloc(b->flag_bytes + 1, 1);
  b->last_flags = calloc(b->flag_bytes + 1, 1);
  return b->now && b->last && b->before && b->flags && b->last_flags ? FLESH_OK : flesh_report_no_memory();
}

void flesh_report_body_close(flesh_report_body *b)
{
  free(b->now);
  free(b->last);
  free(b->before);
  free(b->flags);
  free(b->last_flags);
  *b = (flesh_report_body){0};
}

/* The nearest multiple of the step; what is not finite, or beyond 2^30 of them, is put there. */
static int round_to(double value, double step)
{
  const double MOST = 1 << 30, at = value / step;
  return isnan(at) ? 0 : (int)lrint(fmin(fmax(at, -MOST), MOST));
}

/* Positions [3*count] as all x, all y, all z. */
static int *round_positions(int count, const double *x, double quantum, int *to)
{
  for (int d = 0; d < 3; d++)
    for (int i = 0; i < count; i++) *to++ = round_to(x[3 * (size_t)i + (size_t)d], quantum);
  return to;
}

/* One number in as few bytes as it needs: 0, -1, 1, -2, ... become 0, 1, 2, 3, ..., seven bits a byte, the lowest first,
 * all but the last with the eighth bit set. */
static void add_number(FILE *numbers, int64_t value)
{
  uint64_t rest = value < 0 ? 2 * (uint64_t)(-(value + 1)) + 1 : 2 * (uint64_t)value;
  for (; rest > 127; rest >>= 7) putc((int)(rest & 127) | 128, numbers);
  putc((int)rest, numbers);
}

/* Adds numbers as differences, each to the one before it, the first to 0. Returns "at" and "count" of them. */
static json_t *add_list(FILE *numbers, size_t count, const int *values)
{
  json_t *place = json_pack("[II]", (json_int_t)ftell(numbers), (json_int_t)count);
  for (size_t k = 0; k < count; k++) add_number(numbers, (int64_t)values[k] - (k ? values[k - 1] : 0));
  return place;
}

/* Vertices beyond the nodes that triangles of curved faces have: six nodes each, and eighths of
 * these. Renumbers the corners. */
static int add_curved(const flesh_mesh *mesh, FILE *numbers, json_t *made)
{
  flesh_curved_surface curved;
  int status = flesh_curved_surface_make(mesh, &curved), further = 0;
  if (status) return status;
  const int nodes = flesh_mesh_node_count(mesh);
  const size_t triangles = (size_t)curved.triangles, vertices = (size_t)curved.vertices;
  int *places = calloc(13 * vertices + triangles + 1, sizeof *places);
  int *six = places + vertices, *eighths = six + 6 * vertices, *hidden = eighths + 6 * vertices;
  if (!places) status = flesh_report_no_memory();
  for (size_t c = 0; c < 3 * triangles && !status; c++) {
    int *v = &curved.corners[c];
    if (*v < nodes) continue;
    if (!places[*v]) {
      for (int a = 0; a < 6; a++)
        six[6 * further + a] = curved.rows[*v].nodes[a], eighths[6 * further + a] = curved.rows[*v].eighths[a];
      places[*v] = nodes + further++;
    }
    *v = places[*v];
  }
  for (size_t t = 0; t < triangles && !status; t++) hidden[t] = curved.hidden[t];
  if (!status) {
    json_object_set_new(made, "corners", add_list(numbers, 3 * triangles, curved.corners));
    json_object_set_new(made, "behind", add_list(numbers, triangles, curved.tets));
    json_object_set_new(made, "hidden", add_list(numbers, triangles, hidden));
    json_object_set_new(made, "six", add_list(numbers, 6 * (size_t)further, six));
    json_object_set_new(made, "eighths", add_list(numbers, 6 * (size_t)further, eighths));
  }
  free(places);
  free(curved.rows);
  return status;
}

int flesh_report_body_mesh(const flesh_report_body *b, const flesh_picture_panel *panel,
                           FILE *numbers, json_t **made)
{
  const flesh_mesh *mesh = panel->body->mesh;
  int triangles, status = FLESH_OK, *rest = malloc((3 * (size_t)b->nodes + 1) * sizeof *rest);
  const int *corners = flesh_mesh_surface(mesh, &triangles);
  *made = rest ? json_pack("{sisi}", "nodes", b->nodes, "tet_count", b->tets) : NULL;
  if (!*made) {
    free(rest);
    return flesh_report_no_memory();
  }
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
  free(rest);
  return ferror(numbers) ? flesh_report_no_memory() : status;
}

int flesh_report_body_obstacles(const flesh_report_body *b, const flesh_picture_panel *panel,
                                FILE *numbers, json_t **made)
{
  *made = json_array();
  for (int k = 0; k < b->obstacle_count; k++) {
    flesh_picture_obstacle o;
    const int status = flesh_picture_obstacle_make(panel, k, &b->view, &o);
    if (status) return status;
    const double fade = o.is_plane ? flesh_picture_plane_extent(&b->view) : 0;
    json_array_append_new(*made, json_pack("{sisfso}", "vertices", o.vertices, "fade", fade, "corners",
                                           add_list(numbers, 3 * (size_t)o.triangles, o.corners)));
    flesh_picture_obstacle_free(&o);
  }
  return ferror(numbers) ? flesh_report_no_memory() : FLESH_OK;
}

/* The numbers of a frame: positions of the body, of the obstacles, and the fields' values. */
static int gather(flesh_report_body *b, const flesh_picture_panel *panel)
{
  int *to = round_positions(b->nodes, panel->x, b->quantum, b->now);
  for (int k = 0; k < b->obstacle_count; k++) {
    flesh_picture_obstacle o;
    const int status = flesh_picture_obstacle_make(panel, k, &b->view, &o);
    if (status) return status;
    to = round_positions(o.vertices, o.x, b->quantum, to); /* their number does not change */
    flesh_picture_obstacle_free(&o);
  }
  for (int f = 0; f < FLESH_REPORT_FIELDS; f++) {
    double *values;
    int status =
        flesh_picture_values(panel, (flesh_picture_field)(FLESH_PICTURE_J + f), &values, NULL);
    if (status) return status;
    for (int i = 0; i < b->nodes; i++) *to++ = round_to(values[i] - b->low[f], b->steps[f]);
    free(values);
  }
  return FLESH_OK;
}

static int flag_inverted(flesh_report_body *b, const flesh_picture_panel *panel)
{
  double *J = malloc(sizeof *J * ((size_t)b->tets + 1));
  if (!J) return flesh_report_no_memory();
  flesh_mesh_jacobians(panel->body->mesh, panel->x, J, NULL, NULL);
  memset(b->flags, 0, b->flag_bytes);
  for (int t = 0; t < b->tets; t++)
    if (!(J[t] > 0)) b->flags[t / 8] |= (uint8_t)(1 << t % 8);
  free(J);
  return FLESH_OK;
}

int flesh_report_body_frame(flesh_report_body *b, const flesh_picture_panel *panel,
                            FILE *numbers)
{
  int status = gather(b, panel);
  if (!status) status = flag_inverted(b, panel);
  if (status) return status;
  for (size_t k = 0; k < b->total; k++) {
    const int64_t one = b->last[k], two = b->before[k];
    const int64_t told = b->frames > 1 ? 2 * one - two : b->frames ? one : k ? b->now[k - 1] : 0;
    add_number(numbers, b->now[k] - told);
  }
  for (size_t k = 0; k < b->flag_bytes; k++) putc(b->flags[k] ^ b->last_flags[k], numbers);
  int *free_one = b->before;
  uint8_t *free_flags = b->last_flags;
  b->before = b->last;
  b->last = b->now;
  b->now = free_one;
  b->last_flags = b->flags;
  b->flags = free_flags;
  b->frames++;
  return ferror(numbers) ? flesh_report_no_memory() : FLESH_OK;
}
