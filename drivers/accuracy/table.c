/* table.c: accuracy.csv and orders.csv, and the table on stdout. */
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>

#include "accuracy/accuracy.h"
#include "base/file.h"
#include "study/table.h"

const char *flesh_accuracy_status_word(const flesh_accuracy_row *row)
{
  const flesh_accuracy_figures *f = &row->figures;
  if (!row->done) return "not run";
  if (f->crashed_by == SIGKILL) return "out of budget"; /* it did not stop by itself */
  if (f->crashed_by) return "crashed";
  switch (f->status) {
  case FLESH_OK:
    return f->below ? "below reference" : "complete";
  case FLESH_ERR_BUDGET:
    return "out of budget";
  case FLESH_NONFINITE:
  case FLESH_ERR_NONFINITE:
    return "non-finite";
  case FLESH_ERR_ARGUMENT:
    return "refused";
  default:
    return "failed";
  }
}

static double over_tolerance(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row)
{
  if (!*row->tolerance.text) return NAN;
  return row->figures.errors.position_rms / (row->tolerance.value * plan->reference.scale.length);
}

static void write_row(FILE *stream, const flesh_accuracy_plan *plan, const flesh_accuracy_row *row)
{
  const flesh_accuracy_figures *f = &row->figures;
  fprintf(stream, "%s,%s", flesh_accuracy_methods[row->method].name, row->setting);
  const long counts[] = {f->steps, f->rejected, f->residuals, f->assemblies, f->newton, f->linear};
  for (int c = 0; c < 6; c++) flesh_table_field(stream, row->done && !f->crashed_by ? (double)counts[c] : NAN);
  flesh_fields_print(stream, flesh_accuracy_fields, "cpu_s", "energy_drift", f);
  fprintf(stream, ",%s", flesh_accuracy_status_word(row));
  flesh_table_field(stream, over_tolerance(plan, row));
  flesh_table_field(stream, f->errors.position_rms / plan->reference.scale.motion);
  fprintf(stream, ",%s", flesh_accuracy_group_names[row->group]);
  flesh_table_field(stream, row->value);
  flesh_table_field(stream, f->difference);
  int work = row->group == FLESH_ACCURACY_WORK;
  flesh_table_field(stream, work ? row->on_front[0] : NAN);
  flesh_table_field(stream, work ? row->on_front[1] : NAN);
  putc('\n', stream);
}

static int write_orders(const flesh_accuracy_plan *plan)
{
  flesh_file file;
  int status = flesh_table_open(plan->out, "orders.csv", &file);
  if (status) return status;
  fputs("method,against,points,order,order_standard_error,from,to\n", file.stream);
  for (int m = 0; m < plan->method_count; m++) {
    const flesh_accuracy_method *method = &flesh_accuracy_methods[plan->methods[m]];
    flesh_accuracy_fit fit;
    flesh_accuracy_fit_order(plan, plan->methods[m], &fit);
    fprintf(file.stream, "%s,%s,%d", method->name, method->adaptive ? "tolerance" : "step",
            fit.points);
    flesh_table_field(file.stream, fit.slope);
    flesh_table_field(file.stream, fit.slope_error);
    flesh_table_field(file.stream, fit.low);
    flesh_table_field(file.stream, fit.high);
    putc('\n', file.stream);
  }
  return flesh_file_commit(&file);
}

static void print_row(const flesh_accuracy_plan *plan, const flesh_accuracy_row *row)
{
  const flesh_accuracy_figures *f = &row->figures;
  printf("%-18s %-30s %-15s", flesh_accuracy_methods[row->method].name, row->setting,
         flesh_accuracy_status_word(row));
  int counted = row->done && !f->crashed_by;
  const long counts[] = {f->steps, f->rejected, f->residuals, f->assemblies, f->linear};
  for (int c = 0; c < 5; c++) flesh_table_cell(counted ? (double)counts[c] : NAN, c == 1 ? 6 : 8, "%.0f");
  flesh_table_cell(f->cpu_s, 8, "%.3g");
  flesh_table_cell(f->errors.position_rms, 9, "%.2e");
  flesh_table_cell(100 * f->errors.position_rms / plan->reference.scale.motion, 8, "%.3g");
  flesh_table_cell(100 * f->errors.energy, 9, "%+.2g");
  if (row->group == FLESH_ACCURACY_WORK) flesh_table_cell(over_tolerance(plan, row), 9, "%.3g");
  else flesh_table_cell(f->difference, 9, "%.2e");
  printf("%s\n", row->on_front[0] ? "  *" : "");
}

static void print_head(const char *last, const char *last_unit)
{
  printf("\n%-18s %-30s %-15s %8s %6s %8s %8s %8s %8s %9s %8s %9s %9s\n", "method", "setting",
         "status", "steps", "reject", "residual", "Hessian", "linear", "cpu", "error", "of the",
         "energy", last);
  printf("%-18s %-30s %-15s %8s %6s %8s %8s %8s %8s %9s %8s %9s %9s\n", "", "", "", "", "", "evals",
         "assembl.", "iter.", "s", "rms m", "motion %", "drift %", last_unit);
}

static void print_table(const flesh_accuracy_plan *plan)
{
  print_head("error per", "tolerance");
  int others = 0;
  for (int k = 0; k < plan->row_count; k++)
    if (plan->rows[k].group == FLESH_ACCURACY_WORK) print_row(plan, &plan->rows[k]);
    else others++;
  printf("* nothing is as good in less time. error per tolerance: of the body's length.\n");
  if (!others) return;
  print_head("off the", "tight, m");
  for (int k = 0; k < plan->row_count; k++)
    if (plan->rows[k].group != FLESH_ACCURACY_WORK) print_row(plan, &plan->rows[k]);
  printf("off the tight: from the same run with every solve to rounding. Another mass matrix or "
         "mesh is\n"
         "another body: that is a difference, no error.\n");
}

int flesh_accuracy_write_csv(const void *data)
{
  const flesh_accuracy_plan *plan = data;
  flesh_file file;
  int status = flesh_table_open(plan->out, "accuracy.csv", &file);
  if (status) return status;
  fputs("method,setting,steps,rejected,residual_evaluations,hessian_assemblies,newton,"
        "linear_iterations,cpu_s,wall_s_median,wall_s_min,error_position_rms,error_position_max,"
        "error_tip,error_volume,energy_drift,status,error_over_tolerance,error_over_motion,price,"
        "value,difference,front_time,front_residuals\n",
        file.stream);
  for (int k = 0; k < plan->row_count; k++) write_row(file.stream, plan, &plan->rows[k]);
  status = flesh_file_commit(&file);
  if (!status) status = write_orders(plan);
  if (!status) print_table(plan);
  return status;
}
