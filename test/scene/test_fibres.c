// TEST quick
/* test_fibres.c: the tets of a scene's muscle and the directions of its fibres: given by a vector, by a file, along
 * arcs; refusals, with file and line. */
#include "temporary.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "body.h"
#include "scene/fibres.h"
#include "test.h"

static char folder[256], path[512];

static flesh_tet_selection everything(void)
{
  flesh_tet_selection selection = {.body = NULL};
  for (int k = 0; k < 6; k++) selection.box[k] = NAN;
  return selection;
}

static flesh_fibre_field no_field(void)
{
  flesh_fibre_field field = {.file = NULL};
  for (int c = 0; c < 3; c++) field.direction[c] = field.along.from[c] = field.along.to[c] = NAN;
  return field;
}

static flesh_fibre_field along_x(void)
{
  flesh_fibre_field field = no_field();
  field.direction[0] = 2, field.direction[1] = field.direction[2] = 0;
  return field;
}

static void centre_of(const flesh_mesh *mesh, int tet, double centre[3])
{
  for (int c = 0; c < 3; c++) {
    centre[c] = 0;
    for (int a = 0; a < 4; a++) centre[c] += flesh_mesh_positions(mesh)[3 * flesh_mesh_tets(mesh)[4 * tet + a] + c] / 4;
  }
}

/* Makes a box of 4 x 2 x 2 cells with region 1 for x < 2 and 2 beyond, the halves two bodies. */
static void make(flesh_mesh **mesh, flesh_body *body, flesh_body_part parts[2])
{
  flesh_mesh *box = test_box(4, 2, 2, 4, 1, 1);
  const int tets = flesh_mesh_tet_count(box);
  int *regions = malloc((size_t)tets * sizeof *regions);
  for (int e = 0; e < tets; e++) {
    double centre[3];
    centre_of(box, e, centre);
    regions[e] = centre[0] < 2 ? 1 : 2;
  }
  CHECK_OK(flesh_mesh_create(flesh_mesh_node_count(box), flesh_mesh_positions(box), tets, flesh_mesh_tets(box), regions,
                             mesh));
  parts[0] = (flesh_body_part){"left", 0, 20};
  parts[1] = (flesh_body_part){"right", 20, tets - 20};
  *body = (flesh_body){.mesh = *mesh, .part_count = 2, .parts = parts};
  free(regions);
  flesh_mesh_destroy(&box);
}

static void tets_are_those_that_meet_all_conditions(void)
{
  flesh_mesh *mesh;
  flesh_body body;
  flesh_body_part parts[2];
  make(&mesh, &body, parts);
  int tag = 2;
  const double box[6] = {-1, -1, -1, 9, 0.5, 9};
  for (int conditions = 0; conditions < 8; conditions++) {
    flesh_tet_selection s = everything();
    flesh_chosen_fibres chosen;
    const flesh_fibre_field field = along_x();
    if (conditions & 1) s.regions = (flesh_integers){1, &tag};
    if (conditions & 2) memcpy(s.box, box, sizeof box);
    if (conditions & 4) s.body = (char *)"right";
    CHECK_OK(flesh_fibres_choose(&s, &field, &body, &chosen));
    int at = 0;
    for (int e = 0; e < flesh_mesh_tet_count(mesh); e++) {
      double centre[3];
      centre_of(mesh, e, centre);
      if ((conditions & 1 && centre[0] < 2) || (conditions & 2 && centre[1] > 0.5)) continue;
      if (conditions & 4 && e < 20) continue;
      CHECK(at < chosen.count && chosen.tets[at] == e && chosen.directions[3 * at] == 2);
      at++;
    }
    CHECK(at == chosen.count);
    flesh_fibres_free(&chosen);
  }
  flesh_mesh_destroy(&mesh);
}

/* Checks that a fibre is orthogonal to the radius of the circle through both points and the tet's centre, in their
 * plane, with equal angles at both ends. */
static void fibres_along_are_tangents_of_circles(void)
{
  flesh_mesh *mesh;
  flesh_body body;
  flesh_body_part parts[2];
  make(&mesh, &body, parts);
  const double a[3] = {-1, 0.4, 0.6}, b[3] = {5, 0.6, 0.5};
  flesh_fibre_field field = no_field();
  memcpy(field.along.from, a, sizeof a);
  memcpy(field.along.to, b, sizeof b);
  flesh_chosen_fibres chosen;
  const flesh_tet_selection s = everything();
  CHECK_OK(flesh_fibres_choose(&s, &field, &body, &chosen));
  double worst = 0, least = 1;
  for (int k = 0; k < chosen.count; k++) {
    double x[3], u[3], v[3], w[3], uu = 0, vv = 0, uv = 0, radius = 0, along = 0;
    const double *d = chosen.directions + 3 * k;
    centre_of(mesh, chosen.tets[k], x);
    for (int c = 0; c < 3; c++) {
      u[c] = b[c] - a[c], v[c] = x[c] - a[c];
      uu += u[c] * u[c], vv += v[c] * v[c], uv += u[c] * v[c];
    }
    /* The centre of the circle through 0, u and v: p u + q v with equal distances from them. */
    const double det = 2 * (uu * vv - uv * uv), p = vv * (uu - uv) / det, q = uu * (vv - uv) / det;
    for (int c = 0; c < 3; c++) {
      w[c] = v[c] - p * u[c] - q * v[c];
      radius += w[c] * w[c];
      along += w[c] * d[c];
    }
    const double normal[3] = {u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]};
    worst = fmax(worst, fabs(along) / sqrt(radius));
    worst = fmax(worst, fabs(normal[0] * d[0] + normal[1] * d[1] + normal[2] * d[2]));
    least = fmin(least, d[0]);
  }
  printf("# off by %.2g; the steepest has %.3f along x\n", worst, least);
  CHECK_BELOW(worst, 1e-12);
  CHECK(least > 0.7 && least < 0.999);
  flesh_fibres_free(&chosen);
  flesh_mesh_destroy(&mesh);
}

static void write_rows(int rows, const char *end)
{
  FILE *file = fopen(path, "w");
  CHECK(file != NULL);
  fprintf(file, "# x y z\n");
  for (int k = 0; k < rows; k++) fprintf(file, "%d %g 0\n", k, 0.5 * k);
  CHECK(fputs(end, file) >= 0 && !fclose(file));
}

static void files_have_a_row_for_each_tet(void)
{
  flesh_mesh *mesh;
  flesh_body body;
  flesh_body_part parts[2];
  make(&mesh, &body, parts);
  const int tets = flesh_mesh_tet_count(mesh);
  flesh_chosen_fibres chosen;
  flesh_fibre_field field = no_field();
  field.file = path;
  int tag = 2;
  for (int of_body = 0; of_body < 2; of_body++) {
    flesh_tet_selection s = everything();
    s.regions = (flesh_integers){1, &tag};
    if (of_body) s.body = (char *)"right";
    const int first = of_body ? 20 : 0;
    write_rows(tets - first, "");
    CHECK_OK(flesh_fibres_choose(&s, &field, &body, &chosen));
    CHECK(chosen.count > 10);
    for (int k = 0; k < chosen.count; k++) {
      CHECK(chosen.directions[3 * k] == chosen.tets[k] - first);
      CHECK(chosen.directions[3 * k + 1] == 0.5 * (chosen.tets[k] - first));
    }
    flesh_fibres_free(&chosen);
  }
  const flesh_tet_selection s = everything();
  const struct {
    int rows;
    const char *end, *words;
  } cases[] = {{3, "", "fibres.txt:5: the file has 3 rows; a fibre's direction is needed for each of the 96 tets"},
               {3, "1 2\n", "fibres.txt:5:"},
               {3, "1 2 three\n", "three"},
               {3, "1 2 nan\n", "nan"},
               {3, "1 2 3 4\n", "fibres.txt:5:"},
               {96, "1 2 3\n", "fibres.txt:98: the file has more rows than the mesh has tets (96)"}};
  for (int k = 0; k < 6; k++) {
    write_rows(cases[k].rows, cases[k].end);
    CHECK(flesh_fibres_choose(&s, &field, &body, &chosen) == FLESH_ERR_FILE);
    CHECK_TEXT(flesh_error_text(), cases[k].words);
    flesh_fibres_free(&chosen);
  }
  remove(path);
  CHECK(flesh_fibres_choose(&s, &field, &body, &chosen) == FLESH_ERR_FILE);
  flesh_fibres_free(&chosen);
  flesh_mesh_destroy(&mesh);
}

static void refuse(const flesh_tet_selection *s, const flesh_fibre_field *field, const flesh_body *body,
                   const char *words)
{
  flesh_chosen_fibres chosen;
  CHECK(flesh_fibres_choose(s, field, body, &chosen) == FLESH_ERR_ARGUMENT);
  CHECK_TEXT(flesh_error_text(), words);
  flesh_fibres_free(&chosen);
}

static void nonsense_is_refused(void)
{
  flesh_mesh *mesh;
  flesh_body body;
  flesh_body_part parts[2];
  make(&mesh, &body, parts);
  flesh_tet_selection s = everything();
  flesh_fibre_field field = no_field();
  refuse(&s, &field, &body, "0 kinds of fibres are given; one of direction, file or along is needed");
  field = along_x();
  field.file = path;
  refuse(&s, &field, &body, "2 kinds of fibres are given");
  field = along_x();
  field.direction[0] = 0;
  refuse(&s, &field, &body, "fibres.direction is [0, 0, 0]; it must point somewhere");
  field = no_field();
  for (int c = 0; c < 3; c++) field.along.from[c] = field.along.to[c] = c;
  refuse(&s, &field, &body, "the same point");
  field = along_x();
  int tag = 7;
  s.regions = (flesh_integers){1, &tag};
  refuse(&s, &field, &body, "no tet of the mesh meets all of the given regions, box, set and body");
  s = everything();
  s.body = (char *)"middle";
  refuse(&s, &field, &body, "body is 'middle'; the scene has no body of that name, but left");
  s = everything();
  const double box[6] = {2, 0, 0, 1, 1, 1};
  memcpy(s.box, box, sizeof box);
  refuse(&s, &field, &body, "box has low x = 2 above high x = 1");
  flesh_mesh_destroy(&mesh);
}

int main(int argc, char **argv)
{
  if (test_folder_make(folder, sizeof folder)) return 1;
  snprintf(path, sizeof path, "%s/fibres.txt", folder);
  const int failed = RUN_TESTS(argc, argv, TEST(tets_are_those_that_meet_all_conditions),
                               TEST(fibres_along_are_tangents_of_circles), TEST(files_have_a_row_for_each_tet),
                               TEST(nonsense_is_refused));
  test_folder_remove(folder);
  return failed;
}
