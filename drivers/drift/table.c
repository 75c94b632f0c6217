/* table.c: the comparison as drift.csv and as a table on stdout. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "drift/drift.h"
#include "base/file.h"
#include "study/table.h"

static int write_csv(const flesh_drift_plan *plan)
{
  flesh_file file;
  int status = flesh_table_open(plan->out, "drift.csv", &file);
  if (status) return status;
  fputs("scene,energy,poisson,constants,tets,status,max_volume_drift,final_volume_drift,"
        "rest_volume_ratio,rest_volume_ratio_theory,J_min,max_inverted,newton_per_step,"
        "linear_per_newton,wall_s,failed_at,solver,first_inverted_step,J_bound,first_bound_step,distance_from_rest,stressed_rest_J,element,nodes,finest,"
        "mesh_part,mesh_unsure\n",
        file.stream);
  for (int k = 0; k < plan->case_count; k++) {
    const flesh_drift_case *c = &plan->cases[k];
    const flesh_drift_variant *v = &plan->variants[c->variant];
    const struct flesh_drift_figures *f = &c->figures;
    fprintf(file.stream, "%s,%s,", plan->scenes[c->scene].name, flesh_energy_name(v->energy));
    flesh_number_print(file.stream, plan->poissons[c->poisson]);
    fprintf(file.stream, ",%s,%d,%s", flesh_constants_name(v->constants), f->tets,
            flesh_drift_status_word(c));
    flesh_fields_print(file.stream, flesh_drift_fields, "max_volume_drift", "failure_t", f);
    fprintf(file.stream, ",%s,", flesh_drift_solver_name(c->solver));
    if (f->first_inverted_step >= 0) fprintf(file.stream, "%d", f->first_inverted_step);
    flesh_table_field(file.stream, f->J_bound);
    putc(',', file.stream);
    if (f->first_bound_step >= 0) fprintf(file.stream, "%d", f->first_bound_step);
    flesh_fields_print(file.stream, flesh_drift_fields, "distance_from_rest", "stressed_rest", f);
    const flesh_drift_part part = flesh_drift_mesh_part(plan, c->poisson, c->variant, c->solver);
    fprintf(file.stream, ",%s,%d,%d", f->tets ? flesh_element_name((flesh_element)f->element) : "", f->nodes,
            c->scene == flesh_drift_finest(plan, 0));
    flesh_table_field(file.stream, part.best && !f->status ? f->max_volume_drift - part.value : NAN);
    flesh_table_field(file.stream, part.unsure);
    putc('\n', file.stream);
  }
  return flesh_file_commit(&file);
}

/* With no more digits than can be read. */
static void cell(double value, int width, const char *format)
{
  flesh_table_cell(value, width, fabs(value) >= 1e5 ? "%.0e" : format);
}

int flesh_drift_write_table(const void *data)
{
  const flesh_drift_plan *plan = data;
  int status = write_csv(plan), width = 20;
  for (int s = 0; s < plan->scene_count; s++)
    if ((int)strlen(plan->scenes[s].name) > width) width = (int)strlen(plan->scenes[s].name);
  printf("\n%-*s %-8s %6s %-8s %-13s %9s %9s %8s %8s %8s %5s %8s %8s\n", width, "scene", "energy", "poisson",
         "solver", "status", "max", "final", "rest", "theory", "J_min", "inv", "shape", "wall");
  printf("%-*s %-8s %6s %-8s %-13s %9s %9s %8s %8s %8s %5s %8s %8s\n", width, "", "", "", "", "", "drift %",
         "drift %", "volume", "volume", "", "", "off %", "s");
  for (int k = 0; k < plan->case_count; k++) {
    const flesh_drift_case *c = &plan->cases[k];
    const struct flesh_drift_figures *f = &c->figures;
    char title[16];
    flesh_drift_variant_title(plan->variants[c->variant], title);
    printf("%-*s %-8s %6g %-8s %-13s", width, plan->scenes[c->scene].name, title, plan->poissons[c->poisson],
           flesh_drift_solver_name(c->solver), flesh_drift_status_word(c));
    cell(100 * f->max_volume_drift, 9, "%.3f");
    cell(100 * f->final_volume_drift, 9, "%.3f");
    cell(f->rest_volume_ratio, 8, "%.5f");
    cell(f->rest_volume_ratio_theory, 8, "%.5f");
    cell(f->J_min, 8, "%.3f");
    printf(" %5d", f->max_inverted);
    cell(100 * f->distance_from_rest, 8, "%.2f");
    cell(f->wall_s, 8, "%.2f");
    putchar('\n');
  }
  printf("max/final drift: of the body's volume, over the run and at its end; rest volume: of its equilibrium with\n"
         "the pins alone, theory: of a free body; J_min: least det F at a point of quadrature; inv: most inverted\n"
         "tets (J_min <= 0) at a time; shape off: largest distance from the rest shape at the end, of the body's\n"
         "length.\n");
  int rests = 0;
  for (int k = 0; k < plan->case_count; k++) rests += plan->cases[k].figures.stressed_rest > 0;
  if (rests)
    printf("stressed rest: %d run%s ended at rest in a stressed state that no load holds (stressed_rest_J in "
           "drift.csv).\n",
           rests, rests == 1 ? "" : "s");
  return status;
}
