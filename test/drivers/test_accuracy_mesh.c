// TEST quick sources=accuracy/mesh_words.c,picture/plot_text.c,cli/safe_text.c,study/table.c
/* test_accuracy_mesh.c: what is said of the errors of mesh and step: orders, choices and words, on made-up figures. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "accuracy/mesh.h"
#include "picture/plot.h"
#include "test.h"

int flesh_plot_draw(const char *folder, const char *name) /* nothing is drawn here */
{
  (void)folder, (void)name;
  return FLESH_OK;
}

#define METHOD(name, scene, adaptive, order, colour, mark, doc) {name, scene, adaptive, order, colour, mark},
const flesh_accuracy_method flesh_accuracy_methods[] = {FLESH_ACCURACY_METHOD_LIST(METHOD){0}};

static int method(const char *name)
{
  int m = 0;
  while (strcmp(flesh_accuracy_methods[m].name, name)) m++;
  return m;
}

/* f = 3 + c h^p on any three sizes. */
static void orders_are_found(void)
{
  const double sizes[][3] = {{1, 0.5, 0.25}, {1, 0.7, 0.4}, {0.3, 0.15, 0.1}};
  for (int s = 0; s < 3; s++)
    for (double p = 0.75; p < 4; p += 0.5) {
      const double *h = sizes[s];
      const double first = fabs(pow(h[0], p) - pow(h[1], p)), second = fabs(pow(h[1], p) - pow(h[2], p));
      CHECK_NEAR(flesh_accuracy_order(h, 7 * first, 7 * second), p, 1e-9);
    }
  const double h[3] = {1, 0.5, 0.25};
  CHECK(flesh_accuracy_order(h, 32, 1) == 4);
  CHECK(isnan(flesh_accuracy_order(h, 1, 1)) && isnan(flesh_accuracy_order(h, 1, 2)) && isnan(flesh_accuracy_order(h, 1, 0)));
}

enum { ROWS = 4, STEPS = 3 };

/* A scene of 5000 tets: errors of meshes and of steps over the motion, and CPU times. */
typedef struct made_up {
  flesh_accuracy_plan plan;
  flesh_accuracy_meshes meshes;
  flesh_accuracy_row steps[STEPS];
} made_up;

static void make(made_up *m, const double mesh_errors[ROWS], const double step_errors[STEPS], double uncertainty)
{
  static const int tets[ROWS] = {5000, 600, 5000, 40000}, elements[ROWS] = {FLESH_ELEMENT_TET4, FLESH_ELEMENT_TET10_MEAN,
                                                                            FLESH_ELEMENT_TET10_MEAN, FLESH_ELEMENT_TET4};
  static const double cpu[ROWS] = {0.01, 0.02, 0.3, 0.1}, steps_cpu[STEPS] = {0.005, 0.01, 0.02};
  static const char *const steps[STEPS] = {"1/30", "1/60", "1/120"};
  *m = (made_up){0};
  m->plan.reference.scale.motion = 2, m->plan.rows = m->steps, m->plan.row_count = STEPS;
  m->plan.representative = method("newmark");
  for (int s = 0; s < STEPS; s++) {
    flesh_accuracy_row *row = &m->steps[s];
    *row = (flesh_accuracy_row){.group = FLESH_ACCURACY_WORK, .method = method("newmark"), .done = 1};
    snprintf(row->step.text, sizeof row->step.text, "%s", steps[s]);
    row->step.value = 1. / atoi(steps[s] + 2);
    row->figures.cpu_s = steps_cpu[s];
    row->figures.errors.position_rms = 2 * step_errors[s];
  }
  m->plan.representative_step = m->steps[1].step;
  m->meshes.method = method("newmark"), m->meshes.step = m->steps[1].step, m->meshes.step_error = step_errors[1];
  m->meshes.own_element = FLESH_ELEMENT_TET4;
  m->meshes.first = FLESH_ELEMENT_TET10_MEAN, m->meshes.second = FLESH_ELEMENT_TET10;
  m->meshes.motion = 2, m->meshes.uncertainty = m->meshes.apart = 2 * uncertainty;
  m->meshes.row_count = ROWS;
  for (int r = 0; r < ROWS; r++) {
    m->meshes.rows[r] = (flesh_accuracy_mesh_row){.source = r == 1, .element = elements[r], .refine = r == 3, .done = 1,
                                                  .tets = tets[r], .nodes = tets[r] / 5, .poisson = 0.49, .cpu_s = cpu[r],
                                                  .error = mesh_errors[r], .below = mesh_errors[r] <= uncertainty};
    m->meshes.rows[r].status = isnan(mesh_errors[r]) ? FLESH_ERR_SOLVE : FLESH_OK;
  }
  for (int e = FLESH_ELEMENT_TET10; e < FLESH_ELEMENT_COUNT; e++)
    m->meshes.limits[e] = (flesh_accuracy_limit){3, {1, 1, 2}, 1.5, 0.001};
}

static char *words(const made_up *m)
{
  flesh_accuracy_choice timed[3];
  char *text = NULL;
  size_t size;
  FILE *stream = open_memstream(&text, &size);
  for (int s = 0; s < 3; s++) timed[s] = flesh_accuracy_choose(&m->plan, &m->meshes, flesh_accuracy_shares[s]);
  flesh_accuracy_say_meshes(&m->plan, &m->meshes, timed, stream);
  fclose(stream);
  return text;
}

static void lacks(const char *text, const char *what)
{
  CHECK(!strstr(text, what));
  if (strstr(text, what)) printf("# it says: %s\n", what);
}

static void a_mesh_that_dominates_is_told(void)
{
  made_up m;
  make(&m, (const double[]){0.51, 0.004, 0.002, 0.2}, (const double[]){0.02, 0.0001, 0.00003}, 0.001);
  char *text = words(&m);
  CHECK_TEXT(text, "At a Poisson's ratio of 0.49 your 5000 tets (tet4) are 51 % off; the step (newmark at 1/60 s) adds 0.01 %.");
  CHECK_TEXT(text, "The mesh makes the error: a shorter step gains nothing");
  lacks(text, "The step makes");
  CHECK_TEXT(text, "For 1 % in all: tet10-mean, 600 tets, newmark at 1/60 s, 0.02 s (mesh 0.4 %, step 0.01 %).");
  /* At 10 % the long step serves, at half the time that was measured with the other. */
  CHECK_TEXT(text, "For 10 % in all: tet10-mean, 600 tets, newmark at 1/30 s, about 0.01 s (mesh 0.4 %, step 2 %).");
  CHECK_TEXT(text, "For 0.1 % in all: no run reaches it.");
  free(text);
  /* A run at another step, or one that failed, is not offered. */
  m.meshes.rows[1].status = FLESH_ERR_SOLVE;
  text = words(&m);
  CHECK_TEXT(text, "For 1 % in all: tet10-mean, 5000 tets, newmark at 1/60 s, 0.3 s");
  free(text);
}

static void a_step_that_dominates_is_told(void)
{
  made_up m;
  make(&m, (const double[]){0.01, 0.004, 0.0005, 0.002}, (const double[]){0.4, 0.2, 0.1}, 0.001);
  char *text = words(&m);
  CHECK_TEXT(text, "are 1 % off; the step (newmark at 1/60 s) adds 20 %.");
  CHECK_TEXT(text, "The step makes the error: a finer mesh gains nothing");
  lacks(text, "The mesh makes");
  CHECK_TEXT(text, "For 10 % in all: no run reaches it."); /* 10 % of the step leaves nothing to the mesh */
  free(text);
  make(&m, (const double[]){0.05, 0.004, 0.0005, 0.002}, (const double[]){0.4, 0.04, 0.01}, 0.001);
  text = words(&m);
  CHECK_TEXT(text, "Mesh and step make errors of like size.");
  /* 5 + 4 % are 9 %. */
  CHECK_TEXT(text, "For 10 % in all: tet4, 5000 tets, newmark at 1/60 s, 0.01 s (mesh 5 %, step 4 %).");
  free(text);
}

/* Between runs errors fall as a power of the time; beyond the finest, which is 20 times too far off for tet4, they fall by
 * order 2 at best, for 20^(3/2) times the tets. */
static void times_to_an_error_are_interpolated(void)
{
  made_up m;
  int beyond;
  make(&m, (const double[]){0.51, 0.02, 0.005, 0.2}, (const double[]){0.02, 0.0001, 0.00003}, 0.001);
  const double tet4 = flesh_accuracy_time_to(&m.meshes, FLESH_ELEMENT_TET4, 0.01, &beyond);
  CHECK(beyond);
  CHECK_NEAR(tet4, 0.1 * pow(20, 1.5), 1e-9 * tet4);
  const double mean = flesh_accuracy_time_to(&m.meshes, FLESH_ELEMENT_TET10_MEAN, 0.01, &beyond);
  CHECK(!beyond);
  CHECK_NEAR(mean, sqrt(0.02 * 0.3), 1e-12); /* half-way, in logarithms, from 2 to 0.5 % */
  CHECK_NEAR(flesh_accuracy_time_to(&m.meshes, FLESH_ELEMENT_TET10_MEAN, 0.1, &beyond), 0.02, 0);
  CHECK(isnan(flesh_accuracy_time_to(&m.meshes, FLESH_ELEMENT_TET10, 0.1, &beyond)));
  char *text = words(&m);
  CHECK_TEXT(text, "To a mesh error of 1 %: tet10-mean 0.077 s, tet4 at least 8.9 s, at least 115 times as much.");
  free(text);
  m.meshes.rows[3].error = 0.005;
  CHECK(flesh_accuracy_time_to(&m.meshes, FLESH_ELEMENT_TET4, 0.01, &beyond) < 0.1 && !beyond);
}

static void what_the_reference_leaves_open_is_not_told(void)
{
  made_up m;
  make(&m, (const double[]){0.51, 0.01, 0.01, 0.2}, (const double[]){0.02, 0.0001, 0.00003}, 0.02);
  char *text = words(&m);
  CHECK_TEXT(text, "errors below 2 % are not reported");
  CHECK_TEXT(text, "For 1 % in all: the reference is less accurate than that");
  CHECK_TEXT(text, "For 10 % in all: tet10-mean, 600 tets");
  CHECK_TEXT(text, "(mesh under 2 %, step");
  free(text);
  m.meshes.second = 0;
  m.meshes.point_load = "spring";
  text = words(&m);
  CHECK_TEXT(text, "no other element checks the reference");
  CHECK_TEXT(text, "warning: spring acts at single nodes");
  free(text);
  m.meshes.first = 0;
  text = words(&m);
  CHECK_TEXT(text, "No reference");
  lacks(text, "in all");
  free(text);
}

int main(int argc, char **argv)
{
  return RUN_TESTS(argc, argv, TEST(orders_are_found), TEST(a_mesh_that_dominates_is_told),
                   TEST(a_step_that_dominates_is_told), TEST(times_to_an_error_are_interpolated),
                   TEST(what_the_reference_leaves_open_is_not_told));
}
