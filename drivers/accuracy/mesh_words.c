/* mesh_words.c: the errors of mesh and step side by side, as mesh.csv and in words: orders, and what reaches an error in the
 * least time. */
#include <math.h>
#include <string.h>

#include "accuracy/mesh.h"
#include "base/file.h"
#include "picture/plot.h"
#include "picture/plot_text.h"
#include "study/table.h"

const double flesh_accuracy_shares[3] = {0.1, 0.01, 0.001};

/* |f0-f1|/|f1-f2| where errors fall as h^p. */
static double ratio(const double h[3], double p)
{
  return (pow(h[0], p) - pow(h[1], p)) / (pow(h[1], p) - pow(h[2], p));
}

double flesh_accuracy_order(const double h[3], double first, double second)
{
  double low = 0.5, high = 4;
  const double wanted = first / second;
  if (!(second > 0) || !(first > 0) || !isfinite(wanted) || wanted < ratio(h, low)) return NAN;
  if (wanted > ratio(h, high)) return high;
  for (int k = 0; k < 60; k++) {
    const double middle = (low + high) / 2;
    if (ratio(h, middle) < wanted) low = middle;
    else high = middle;
  }
  return (low + high) / 2;
}

double flesh_accuracy_step_error(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row)
{
  if (row->group != FLESH_ACCURACY_WORK || !row->done || row->figures.status) return NAN;
  const double error = row->figures.below ? plan->reference.uncertainty.position_rms : row->figures.errors.position_rms;
  return error / plan->reference.scale.motion;
}

/* The row of the method and step that the meshes were run with. */
static const flesh_accuracy_row *shared_row(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes)
{
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_accuracy_row *row = &plan->rows[k];
    if (row->group == FLESH_ACCURACY_WORK && row->method == meshes->method && !*row->tolerance.text &&
        row->step.value == meshes->step.value)
      return row;
  }
  return NULL;
}

static void take(flesh_accuracy_choice *best, const flesh_accuracy_choice *other)
{
  if (!best->mesh || other->cpu_s < best->cpu_s) *best = *other;
}

flesh_accuracy_choice flesh_accuracy_choose(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes,
                                            double error)
{
  const flesh_accuracy_row *shared = meshes->method < 0 ? NULL : shared_row(plan, meshes);
  const double open = meshes->uncertainty / meshes->motion;
  flesh_accuracy_choice best = {.cpu_s = NAN};
  for (int m = 0; m < meshes->row_count; m++) {
    const flesh_accuracy_mesh_row *row = &meshes->rows[m];
    const double mesh_error = row->below ? open : row->error;
    if (!row->done || row->status || !(mesh_error <= error)) continue;
    if (meshes->method < 0) take(&best, &(flesh_accuracy_choice){row, NULL, mesh_error, 0, row->cpu_s, 1});
    for (int s = 0; shared && s < plan->row_count; s++) {
      const flesh_accuracy_row *step = &plan->rows[s];
      const double of_step = flesh_accuracy_step_error(plan, step);
      if (!(mesh_error + of_step <= error)) continue;
      const double factor = step == shared ? 1 : step->figures.cpu_s / shared->figures.cpu_s;
      take(&best, &(flesh_accuracy_choice){row, step, mesh_error, of_step, row->cpu_s * factor, step == shared});
    }
  }
  return best;
}

/* The element's run with the fewest tets above `tets`; NULL: there is none. */
static const flesh_accuracy_mesh_row *next_finer(const flesh_accuracy_meshes *meshes, int element, int tets)
{
  const flesh_accuracy_mesh_row *best = NULL;
  for (int k = 0; k < meshes->row_count; k++) {
    const flesh_accuracy_mesh_row *row = &meshes->rows[k];
    if (row->element != element || !row->done || row->status || isnan(row->error) || row->tets <= tets) continue;
    if (!best || row->tets < best->tets) best = row;
  }
  return best;
}

double flesh_accuracy_time_to(const flesh_accuracy_meshes *meshes, int element, double error, int *beyond)
{
  const flesh_accuracy_mesh_row *before = NULL, *row = next_finer(meshes, element, 0);
  *beyond = 0;
  if (row && row->error <= error) return row->cpu_s;
  for (; row && row->error > error; before = row, row = next_finer(meshes, element, row->tets))
    ;
  if (!row && before) {
    *beyond = 1;
    return before->cpu_s * pow(before->error / error, element == FLESH_ELEMENT_TET4 ? 3. / 2 : 3. / 3);
  }
  if (!row || !(row->error < before->error) || !(row->cpu_s > before->cpu_s)) return NAN;
  const double slope = log(row->cpu_s / before->cpu_s) / log(row->error / before->error);
  return row->cpu_s * exp(slope * log(error / row->error));
}

static const char *element_name(int element) { return flesh_element_name((flesh_element)element); }

static const char *source_name(const flesh_accuracy_meshes *meshes, const flesh_accuracy_mesh_row *row)
{
  const char *path = meshes->sources[row->source], *slash = strrchr(path, '/');
  return slash ? slash + 1 : path;
}

static const char *status_word(const flesh_accuracy_mesh_row *row)
{
  if (!row->done) return "not run";
  if (row->crashed_by) return "crashed";
  if (row->status == FLESH_ERR_BUDGET) return "out of budget";
  if (row->status == FLESH_ERR_ARGUMENT) return row->source && row->cpu_s >= 0 ? "starts elsewhere" : "refused";
  if (row->status) return "failed";
  return row->below ? "below reference" : "complete";
}

/* The rows by element, then tets. */
static void sort(const flesh_accuracy_meshes *meshes, int order[FLESH_ACCURACY_MESH_ROWS])
{
  for (int k = 0; k < meshes->row_count; k++) {
    const flesh_accuracy_mesh_row *row = &meshes->rows[k];
    int place = k;
    for (; place > 0; place--) {
      const flesh_accuracy_mesh_row *other = &meshes->rows[order[place - 1]];
      if (other->element < row->element || (other->element == row->element && other->tets <= row->tets)) break;
      order[place] = order[place - 1];
    }
    order[place] = k;
  }
}

int flesh_accuracy_write_meshes(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes)
{
  flesh_file file;
  int order[FLESH_ACCURACY_MESH_ROWS], status = flesh_table_open(plan->out, "mesh.csv", &file);
  if (status) return status;
  sort(meshes, order);
  fputs("element,tets,nodes,refine,scene,poisson,method,step,cpu_s,error_over_motion,uncertainty_over_motion,"
        "step_error_over_motion,status\n",
        file.stream);
  for (int k = 0; k < meshes->row_count; k++) {
    const flesh_accuracy_mesh_row *row = &meshes->rows[order[k]];
    char name[64];
    snprintf(name, sizeof name, "%.60s", source_name(meshes, row));
    for (char *c = name; *c; c++)
      if (strchr(",\"\r\n", *c)) *c = '_';
    fprintf(file.stream, "%s,%d,%d,%d,%s", element_name(row->element), row->tets, row->nodes, row->refine, name);
    flesh_table_field(file.stream, row->poisson);
    fprintf(file.stream, ",%s", meshes->method < 0 ? "static" : flesh_accuracy_methods[meshes->method].name);
    flesh_table_field(file.stream, meshes->method < 0 ? NAN : meshes->step.value);
    flesh_table_field(file.stream, row->cpu_s);
    flesh_table_field(file.stream, row->below ? NAN : row->error);
    flesh_table_field(file.stream, meshes->uncertainty / meshes->motion);
    flesh_table_field(file.stream, meshes->step_error);
    fprintf(file.stream, ",%s\n", status_word(row));
  }
  return flesh_file_commit(&file);
}

/* "newmark at 1/60 s". */
static void print_step(FILE *stream, int method, const char *step)
{
  fprintf(stream, "%s at %s s", flesh_accuracy_methods[method].name, step);
}

static void print_share(FILE *stream, double share, int below)
{
  if (isnan(share)) fputs("-", stream);
  else fprintf(stream, share < 1 ? "%s%.2g %%" : "%s%.0f %%", below ? "under " : "", 100 * share);
}

static void say_reference(const flesh_accuracy_meshes *meshes, FILE *stream)
{
  for (int k = 0; k < 2; k++) {
    const int element = k ? meshes->second : meshes->first;
    const flesh_accuracy_limit *limit = &meshes->limits[element];
    if (!element) {
      fputs("  warning: no other element checks the reference; its error may be larger than stated\n", stream);
      continue;
    }
    fprintf(stream, "%s%s of %d and %d tets, extrapolated at order %.2g (%s)\n", k ? "    against " : "  reference: ",
            element_name(element), meshes->rows[limit->rows[1]].tets, meshes->rows[limit->rows[2]].tets, limit->order,
            limit->levels > 2 ? "measured over three meshes" : "assumed: two meshes");
  }
  fprintf(stream, "  they differ by %.2g %% of the motion (%.3g m rms); errors below %.2g %% are not reported\n",
          100 * meshes->apart / meshes->motion, meshes->motion, 100 * meshes->uncertainty / meshes->motion);
}

static void say_table(const flesh_accuracy_meshes *meshes, FILE *stream)
{
  const int in_time = meshes->method >= 0;
  int order[FLESH_ACCURACY_MESH_ROWS];
  sort(meshes, order);
  fprintf(stream, "  %-11s %8s %8s %12s %12s %9s\n", "element", "tets", "nodes", "mesh, % off",
          in_time ? "step, % off" : "", "CPU s");
  for (int k = 0; k < meshes->row_count; k++) {
    const flesh_accuracy_mesh_row *row = &meshes->rows[order[k]];
    char error[32] = "-", step[32] = "";
    if (row->below) snprintf(error, sizeof error, "< %.2g", 100 * meshes->uncertainty / meshes->motion);
    else if (!isnan(row->error)) snprintf(error, sizeof error, "%.3g", 100 * row->error);
    if (in_time) snprintf(step, sizeof step, "%.2g", 100 * meshes->step_error);
    fprintf(stream, "  %-11s %8d %8d %12s %12s", element_name(row->element), row->tets, row->nodes, error, step);
    if (row->done && !row->status) fprintf(stream, " %9.3g\n", row->cpu_s);
    else fprintf(stream, "   %s\n", status_word(row));
  }
}

/* The scene as it stands: its mesh and element, and its own method and step. */
static const flesh_accuracy_mesh_row *own_mesh(const flesh_accuracy_meshes *meshes)
{
  for (int k = 0; k < meshes->row_count; k++) {
    const flesh_accuracy_mesh_row *row = &meshes->rows[k];
    if (!row->source && !row->refine && row->element == meshes->own_element && row->done && !row->status) return row;
  }
  return NULL;
}

static void say_own(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes, FILE *stream)
{
  const flesh_accuracy_mesh_row *own = own_mesh(meshes);
  const flesh_accuracy_row *step = NULL;
  for (int k = 0; k < plan->row_count; k++) {
    const flesh_accuracy_row *row = &plan->rows[k];
    if (row->group == FLESH_ACCURACY_WORK && row->method == plan->representative && row->done && !row->figures.status &&
        row->step.value == plan->representative_step.value)
      step = row;
  }
  if (!own) {
    fputs("Your mesh: its run failed.\n", stream);
    return;
  }
  if (isnan(own->poisson)) fputs("Y", stream);
  else fprintf(stream, "At a Poisson's ratio of %g y", own->poisson);
  fprintf(stream, "our %d tets (%s) are ", own->tets, element_name(own->element));
  print_share(stream, own->below ? meshes->uncertainty / meshes->motion : own->error, own->below);
  fputs(" off", stream);
  if (!step) {
    fputs(".\n", stream);
    return;
  }
  const double of_step = flesh_accuracy_step_error(plan, step);
  fputs("; the step (", stream);
  print_step(stream, step->method, step->step.text);
  fputs(") adds ", stream);
  print_share(stream, of_step, step->figures.below);
  fputs(".\n", stream);
  const double of_mesh = own->below ? 0 : own->error, open = meshes->uncertainty / meshes->motion;
  if (of_mesh > 3 * of_step)
    fputs("The mesh makes the error: a shorter step gains nothing, another element or finer mesh does.\n", stream);
  else if (of_step > 3 * fmax(of_mesh, own->below ? open : 0))
    fputs("The step makes the error: a finer mesh gains nothing, a shorter step or another method does.\n", stream);
  else if (!own->below && !step->figures.below) fputs("Mesh and step make errors of like size.\n", stream);
}

static void say_choice(const flesh_accuracy_meshes *meshes, double share, const flesh_accuracy_choice *choice, FILE *stream)
{
  fprintf(stream, "For %g %% in all: ", 100 * share);
  if (share < meshes->uncertainty / meshes->motion) {
    fputs("the reference is less accurate than that; more --mesh-seconds may help.\n", stream);
    return;
  }
  if (!choice->mesh) {
    fputs("no run reaches it.\n", stream);
    return;
  }
  fprintf(stream, "%s, %d tets, ", element_name(choice->mesh->element), choice->mesh->tets);
  if (choice->step && *choice->step->tolerance.text)
    fprintf(stream, "%s at a tolerance of %s", flesh_accuracy_methods[choice->step->method].name,
            choice->step->tolerance.text);
  else if (choice->step) print_step(stream, choice->step->method, choice->step->step.text);
  fprintf(stream, "%s%s%.2g s (mesh ", choice->step ? ", " : "", choice->measured ? "" : "about ", choice->cpu_s);
  print_share(stream, choice->mesh_error, choice->mesh->below);
  if (choice->step) {
    fputs(", step ", stream);
    print_share(stream, choice->step_error, choice->step->figures.below);
  }
  fputs(").\n", stream);
}

/* Says how much CPU time each element takes for the same error. */
static void say_times(const flesh_accuracy_meshes *meshes, double share, FILE *stream)
{
  int beyond, count = 0;
  const double open = meshes->uncertainty / meshes->motion;
  const double best = flesh_accuracy_time_to(meshes, meshes->first, share, &beyond);
  if (share < open) return;
  fprintf(stream, "To a mesh error of %g %%:", 100 * share);
  for (int e = FLESH_ELEMENT_COUNT - 1; e >= FLESH_ELEMENT_TET4; e--) {
    const double time = flesh_accuracy_time_to(meshes, e, share, &beyond);
    if (isnan(time)) continue;
    const char *least = beyond ? "at least " : "";
    fprintf(stream, time < 100 ? "%s %s %s%.2g s" : "%s %s %s%.0f s", count++ ? "," : "", element_name(e), least, time);
    if (e != meshes->first && !isnan(best))
      fprintf(stream, time / best < 100 ? ", %s%.2g times as much" : ", %s%.0f times as much", least, time / best);
  }
  fputs(count ? ".\n" : " no run tells.\n", stream);
}

static void say_orders(const flesh_accuracy_meshes *meshes, FILE *stream)
{
  int count = 0;
  for (int e = 0; e < FLESH_ELEMENT_COUNT; e++) {
    if (meshes->limits[e].levels < 3) continue;
    fprintf(stream, "%s%s %.2g", count++ ? ", " : "Order of convergence in the size of the cells: ", element_name(e),
            meshes->limits[e].order);
  }
  if (count) fputs(" (corners and edges that are held lower it).\n", stream);
}

void flesh_accuracy_say_meshes(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes,
                               const flesh_accuracy_choice timed[3], FILE *stream)
{
  if (meshes->method < 0) {
    fputs("\nThe error of the mesh in equilibrium (rms over the motion):\n", stream);
  } else {
    fputs("\nThe error of the mesh beside that of the step (rms over the motion, worst over time; all by ", stream);
    print_step(stream, meshes->method, meshes->step.text);
    fputs("):\n", stream);
  }
  if (meshes->first) say_reference(meshes, stream);
  say_table(meshes, stream);
  if (!meshes->first) {
    fputs("No reference: no element has two meshes that ran to the end.\n", stream);
    return;
  }
  say_own(plan, meshes, stream);
  for (int s = 0; s < 3; s++) say_choice(meshes, flesh_accuracy_shares[s], &timed[s], stream);
  say_times(meshes, 0.01, stream);
  say_orders(meshes, stream);
  if (meshes->point_load)
    fprintf(stream, "warning: %s acts at single nodes: its dent deepens with every refinement, and these errors do not "
                    "converge; let it act on an area or a radius.\n",
            meshes->point_load);
}

/* Data of the words. */
typedef struct told {
  const flesh_accuracy_plan *plan;
  const flesh_accuracy_meshes *meshes;
  const flesh_accuracy_choice *timed;
} told;

static void say(const void *data, FILE *stream)
{
  const told *t = data;
  flesh_accuracy_say_meshes(t->plan, t->meshes, t->timed, stream);
}

int flesh_accuracy_write_mesh_verdict(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes,
                                      const flesh_accuracy_choice timed[3])
{
  const told all = {plan, meshes, timed};
  return flesh_table_say(plan->out, "mesh.txt", say, &all);
}

int flesh_accuracy_draw_meshes(const flesh_accuracy_plan *plan, const flesh_accuracy_meshes *meshes)
{
  static const char *const colours[FLESH_ELEMENT_COUNT] = {"", "#d55e00", "#56b4e9", "#0072b2"};
  static const int marks[FLESH_ELEMENT_COUNT] = {0, 7, 5, 9};
  flesh_file file;
  int status = flesh_plot_open(plan->out, "work_mesh", ".gp", &file);
  if (status) return status;
  FILE *stream = file.stream;
  flesh_plot_begin(stream, "work_mesh", 900, 560);
  flesh_plot_style(stream, 1);
  flesh_plot_title(stream, "What the accuracy of the mesh costs");
  flesh_plot_label(stream, "x", "CPU time [s]");
  flesh_plot_label(stream, "y", "error of the mesh: rms, worst over time [% of the motion]");
  fputs("set logscale xy\nset format xy '%g'\nplot ", stream);
  for (int e = FLESH_ELEMENT_TET4; e < FLESH_ELEMENT_COUNT; e++)
    fprintf(stream,
            "'mesh.csv' using (strcol('element') eq '%s' ? column('cpu_s') : NaN):(100*column('error_over_motion')) "
            "with linespoints lw 2 pt %d lc rgb '%s' title '%s', \\\n     ",
            element_name(e), marks[e], colours[e], element_name(e));
  const double known = 100 * meshes->uncertainty / meshes->motion;
  fprintf(stream, "%.17g with lines dt 2 lc rgb '#909090' title 'reference known to %.1g %%'", known, known);
  if (meshes->step_error > 0)
    fprintf(stream, ", \\\n     %.17g with lines dt 3 lc rgb '#202020' title 'error of the step'", 100 * meshes->step_error);
  putc('\n', stream);
  status = flesh_file_commit(&file);
  return status ? status : flesh_plot_draw(plan->out, "work_mesh");
}
