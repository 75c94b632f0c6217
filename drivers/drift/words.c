/* words.c: the verdict: what the finest scene says, as far as the next finest bears it out, and what part of the other
 * figures is the mesh's. */
#include <math.h>
#include <string.h>

#include "base/error.h"
#include "drift/drift.h"
#include "flesh/body.h"
#include "study/table.h"

const flesh_drift_case *flesh_drift_find(const flesh_drift_plan *plan, int scene, int poisson, int variant,
                                         flesh_drift_solver solver)
{
  for (int k = 0; k < plan->case_count; k++) {
    const flesh_drift_case *c = &plan->cases[k];
    if (c->scene == scene && c->poisson == poisson && c->variant == variant && c->solver == solver) return c;
  }
  return NULL;
}

/* Element and nodes of a scene, from any of its cases that ran. */
static const struct flesh_drift_figures *figures_of(const flesh_drift_plan *plan, int scene)
{
  for (int k = 0; k < plan->case_count; k++)
    if (plan->cases[k].scene == scene && plan->cases[k].figures.tets) return &plan->cases[k].figures;
  return NULL;
}

/* Whether scene a is finer than b; of equals the first is. */
static int finer(const flesh_drift_plan *plan, int a, int b)
{
  const struct flesh_drift_figures *f = figures_of(plan, a), *g = figures_of(plan, b);
  if (!f || !g) return f && !g;
  if (f->element != g->element) return f->element > g->element; /* the enum rises with accuracy */
  return f->nodes != g->nodes ? f->nodes > g->nodes : a < b;
}

int flesh_drift_finest(const flesh_drift_plan *plan, int place)
{
  for (int s = 0; s < plan->scene_count; s++) {
    int before = 0;
    for (int other = 0; other < plan->scene_count; other++) before += other != s && finer(plan, other, s);
    if (before == place && figures_of(plan, s)) return s;
  }
  return -1;
}

/* How much of the difference of two meshes may be left on the finer one, 1 or more: with the same element and cells
 * smaller by r, 1/(r - 1), as if errors fell with the size of the cells and no faster (Roache, J. Fluids Eng. 116, 1994,
 * with order 1). */
static double left_over(const struct flesh_drift_figures *best, const struct flesh_drift_figures *next)
{
  const double r = cbrt((double)best->nodes / next->nodes);
  if (best->element != next->element || !(r > 1)) return 1;
  return fmax(1, 1 / (r - 1));
}

flesh_drift_part flesh_drift_mesh_part(const flesh_drift_plan *plan, int poisson, int variant,
                                       flesh_drift_solver solver)
{
  const int best = flesh_drift_finest(plan, 0), next = flesh_drift_finest(plan, 1);
  flesh_drift_part part = {.value = NAN, .unsure = NAN};
  if (best >= 0) part.best = flesh_drift_find(plan, best, poisson, variant, solver);
  if (next >= 0) part.next = flesh_drift_find(plan, next, poisson, variant, solver);
  if (part.best && part.best->figures.status) part.best = NULL;
  if (part.next && part.next->figures.status) part.next = NULL;
  if (part.best) part.value = part.best->figures.max_volume_drift;
  if (part.best && part.next)
    part.unsure = left_over(&part.best->figures, &part.next->figures) *
                  fabs(part.value - part.next->figures.max_volume_drift);
  return part;
}

enum { VARIANTS = 32 };

/* The variants that ended on the finest scene, by their figure there, least first; returns how many. */
static int rank(const flesh_drift_plan *plan, int poisson, flesh_drift_solver solver, int order[VARIANTS],
                flesh_drift_part parts[VARIANTS])
{
  int count = 0;
  for (int v = 0; v < plan->variant_count && count < VARIANTS; v++) {
    const flesh_drift_part part = flesh_drift_mesh_part(plan, poisson, v, solver);
    if (!part.best) continue;
    int place = count++;
    for (; place > 0 && parts[place - 1].value > part.value; place--)
      order[place] = order[place - 1], parts[place] = parts[place - 1];
    order[place] = v, parts[place] = part;
  }
  return count;
}

/* Whether two figures differ by more than the meshes leave open; not where that is not known. */
static int told_apart(const flesh_drift_part *a, const flesh_drift_part *b)
{
  return fabs(a->value - b->value) > a->unsure + b->unsure;
}

static void print_title(const flesh_drift_plan *plan, int variant, FILE *stream)
{
  char title[16];
  flesh_drift_variant_title(plan->variants[variant], title);
  fputs(title, stream);
}

/* A chain compares neighbours alone: says which others beyond a < of it are not apart. */
static void say_close(const flesh_drift_plan *plan, int count, const int *order, const flesh_drift_part *parts,
                      FILE *stream)
{
  for (int k = 0; k < count; k++)
    for (int l = k + 1, apart = 0; l < count; l++) {
      apart |= told_apart(&parts[l - 1], &parts[l]);
      if (l == k + 1 || !apart || told_apart(&parts[k], &parts[l])) continue;
      fputs("; ", stream);
      print_title(plan, order[k], stream);
      fputs(" ~ ", stream);
      print_title(plan, order[l], stream);
    }
}

/* How well the runs that ended keep the volume, best first, and how much of that order stands. */
static void say_drift(const flesh_drift_plan *plan, int poisson, flesh_drift_solver solver, FILE *stream)
{
  flesh_drift_part parts[VARIANTS];
  int order[VARIANTS], count = rank(plan, poisson, solver, order, parts), known = 0;
  fprintf(stream, "  poisson %g: largest change of volume", plan->poissons[poisson]);
  for (int k = 0; k < count; k++) {
    fputs(k ? ", " : " ", stream);
    print_title(plan, order[k], stream);
    fprintf(stream, " %.2f", 100 * parts[k].value);
    if (!isnan(parts[k].unsure)) fprintf(stream, " ± %.2g", 100 * parts[k].unsure), known++;
    fputs(" %", stream);
  }
  fputs(count ? ".\n" : ": none of the runs ended.\n", stream);
  if (!known) return;
  fputs("    of this order stands:", stream);
  for (int k = 0; k < count; k++) {
    if (k) fputs(told_apart(&parts[k - 1], &parts[k]) ? " <" : " ~", stream);
    fputc(' ', stream);
    print_title(plan, order[k], stream);
  }
  say_close(plan, count, order, parts, stream);
  fputs(" (~: closer than the meshes can tell).\n", stream);
}

static int comes_back(const struct flesh_drift_figures *f)
{
  return f->distance_from_rest < 0.01 && fabs(f->final_volume_drift) < 1e-3 && !f->final_inverted;
}

/* Since when tets are inverted; or, where none is, since when J may be <= 0 where no element sees it. */
static void say_inversion(const struct flesh_drift_figures *f, FILE *stream)
{
  if (f->first_inverted_step >= 0)
    fprintf(stream, "; tets are inverted (J <= 0) from step %d, %d at most", f->first_inverted_step, f->max_inverted);
  else if (f->first_bound_step >= 0)
    fprintf(stream, "; no tet is inverted (the lower bound of J near corners is <= 0 from step %d, %.2g at the least)",
            f->first_bound_step, f->J_bound);
}

/* Says how a case ended after the release. */
static void say_end(const flesh_drift_plan *plan, const flesh_drift_case *c, FILE *stream)
{
  const struct flesh_drift_figures *f = &c->figures;
  char title[16];
  flesh_drift_variant_title(plan->variants[c->variant], title);
  fprintf(stream, "    %-8s %-8s ", title, flesh_drift_solver_name(c->solver));
  if (!f->tets) {
    fprintf(stream, "%s%s%s.\n", flesh_drift_status_word(c), *f->message ? ": " : "", f->message);
    return;
  }
  if (f->status) {
    fprintf(stream, "ends at t = %.4g s, step %d: %s", f->failed_at, f->steps + 1, flesh_drift_status_word(c));
    say_inversion(f, stream);
    fprintf(stream, ".\n");
    return;
  }
  if (comes_back(f))
    fprintf(stream, "comes back to its rest shape (off by %.2g %% of its length, volume by %.1g %%)",
        100 * f->distance_from_rest, 100 * fabs(f->final_volume_drift));
  else
    fprintf(stream, "ends at %.4g of its volume, %.3g %% of its length off the rest shape", 1 + f->final_volume_drift,
        100 * f->distance_from_rest);
  if (fabs(f->rest_volume_ratio - 1) > 1e-3) {
    fprintf(stream, "; its own rest volume is %.4g", fabs(f->rest_volume_ratio) < 1e-6 ? 0 : f->rest_volume_ratio);
    if (isnan(f->rest_volume_ratio_theory)) fprintf(stream, " (a free body has none: it collapses)");
    else fprintf(stream, " (free body: %.4g)", f->rest_volume_ratio_theory);
  }
  say_inversion(f, stream);
  if (f->final_inverted) fprintf(stream, ", %d at the end", f->final_inverted);
  fprintf(stream, ".\n");
}

/* The runs of a scene; where `other` >= 0 those alone that end otherwise than there. */
static void say_ends(const flesh_drift_plan *plan, int scene, int poisson, int other, FILE *stream)
{
  int told = 0;
  for (int v = 0; v < plan->variant_count; v++)
    for (int g = 0; g < plan->solver_count; g++) {
      const flesh_drift_case *c = flesh_drift_find(plan, scene, poisson, v, plan->solvers[g]);
      const flesh_drift_case *o = other < 0 ? NULL : flesh_drift_find(plan, other, poisson, v, plan->solvers[g]);
      if (!c) continue;
      if (o && o->figures.status == c->figures.status && comes_back(&o->figures) == comes_back(&c->figures)) continue;
      if (o && !told++)
        fprintf(stream, "  poisson %g, on %s it ends otherwise:\n", plan->poissons[poisson], plan->scenes[scene].name);
      say_end(plan, c, stream);
    }
}

static void say_scene(const flesh_drift_plan *plan, int scene, FILE *stream)
{
  for (int k = 0; k < plan->case_count; k++) {
    const struct flesh_drift_figures *f = &plan->cases[k].figures;
    if (plan->cases[k].scene != scene || !f->tets) continue;
    fprintf(stream, "%s (%s, %d tets)", plan->scenes[scene].name, flesh_element_name((flesh_element)f->element), f->tets);
    return;
  }
  fputs(plan->scenes[scene].name, stream);
}

/* The figures of all scenes, each with what it is off the finest one. */
static void say_parts(const flesh_drift_plan *plan, int best, FILE *stream)
{
  const flesh_drift_solver solver = plan->solvers[0];
  fprintf(stream, "\nWhat part is the mesh's (largest change of volume, in %%, %s solver; in brackets what is off the finest):\n",
          flesh_drift_solver_name(solver));
  for (int p = 0; p < plan->poisson_count; p++)
    for (int v = 0; v < plan->variant_count; v++) {
      const flesh_drift_part part = flesh_drift_mesh_part(plan, p, v, solver);
      char title[16];
      flesh_drift_variant_title(plan->variants[v], title);
      fprintf(stream, "  poisson %-5g %-8s", plan->poissons[p], title);
      if (part.best) fprintf(stream, " %.3f", 100 * part.value);
      else fputs(" -", stream);
      for (int s = 0; s < plan->scene_count; s++) {
        if (s == best) continue;
        const flesh_drift_case *c = flesh_drift_find(plan, s, p, v, solver);
        fputs("; ", stream);
        say_scene(plan, s, stream);
        if (!c || c->figures.status) fputs(" -", stream);
        else fprintf(stream, " %.3f", 100 * c->figures.max_volume_drift);
        if (c && !c->figures.status && part.best)
          fprintf(stream, " (%+.3f)", 100 * (c->figures.max_volume_drift - part.value));
      }
      fputc('\n', stream);
    }
}

/* Orders that stand on the finest scenes and are the other way round on another: returns how many. */
static int say_turned(const flesh_drift_plan *plan, int scene, int poisson, FILE *stream)
{
  flesh_drift_part parts[VARIANTS];
  int order[VARIANTS], count = rank(plan, poisson, plan->solvers[0], order, parts), turned = 0;
  for (int k = 0; k < count; k++)
    for (int l = k + 1; l < count; l++) {
      const flesh_drift_case *low = flesh_drift_find(plan, scene, poisson, order[k], plan->solvers[0]);
      const flesh_drift_case *high = flesh_drift_find(plan, scene, poisson, order[l], plan->solvers[0]);
      if (!told_apart(&parts[k], &parts[l]) || !low || !high || low->figures.status || high->figures.status) continue;
      if (low->figures.max_volume_drift <= high->figures.max_volume_drift) continue;
      turned++;
      fputs("On ", stream);
      say_scene(plan, scene, stream);
      fprintf(stream, " at poisson %g ", plan->poissons[poisson]);
      print_title(plan, order[k], stream);
      fputs(" changes more than ", stream);
      print_title(plan, order[l], stream);
      fprintf(stream, " (%.2f and %.2f %%), on the finest less (%.2f and %.2f %%): that is the mesh's doing.\n",
              100 * low->figures.max_volume_drift, 100 * high->figures.max_volume_drift, 100 * parts[k].value,
              100 * parts[l].value);
    }
  return turned;
}

/* Says whether the other scenes agree, and whether the figures are to be believed. */
static void say_others(const flesh_drift_plan *plan, int best, int next, FILE *stream)
{
  int turned = 0;
  if (next < 0) {
    fputs("\nOne mesh and one element: what part of these figures is the mesh's is not known. A second mesh, --refine 0,1 or "
          "--elements tet4,tet10-mean would tell.\n",
          stream);
    return;
  }
  say_parts(plan, best, stream);
  fputc('\n', stream);
  for (int s = 0; s < plan->scene_count; s++)
    for (int p = 0; s != best && p < plan->poisson_count; p++) turned += say_turned(plan, s, p, stream);
  if (!turned) fputs("No other mesh or element turns an order that stands.\n", stream);
  for (int s = 0; s < plan->scene_count; s++)
    for (int p = 0; s != best && p < plan->poisson_count; p++) say_ends(plan, s, p, best, stream);
}

/* Two locked meshes differ by less than either is off. */
static void say_locking(const flesh_drift_plan *plan, int best, FILE *stream)
{
  const double locks_from = 0.47;
  double largest = 0;
  for (int p = 0; p < plan->poisson_count; p++) largest = fmax(largest, plan->poissons[p]);
  for (int k = 0; k < plan->case_count && largest >= locks_from; k++) {
    const flesh_drift_case *c = &plan->cases[k];
    if (c->scene != best || !c->figures.tets || c->figures.element != FLESH_ELEMENT_TET4) continue;
    fprintf(stream, "Four-node tets lock at poisson %g: how far they are off is more than two meshes of them differ by. "
                    "--elements tet4,tet10-mean would tell.\n", largest);
    return;
  }
}

void flesh_drift_say(const flesh_drift_plan *plan, FILE *stream)
{
  int best = flesh_drift_finest(plan, 0), next = flesh_drift_finest(plan, 1);
  if (best < 0) best = 0; /* nothing ran: its cases say so */
  fputc('\n', stream);
  say_scene(plan, best, stream);
  if (next >= 0) {
    fprintf(stream, ", the finest of %d; ±: how far it may be off, from what ", plan->scene_count);
    say_scene(plan, next, stream);
    fputs(" says", stream);
  }
  fputc('\n', stream);
  for (int p = 0; p < plan->poisson_count; p++) {
    say_drift(plan, p, plan->solvers[0], stream);
    say_ends(plan, best, p, -1, stream);
  }
  say_others(plan, best, next, stream);
  say_locking(plan, best, stream);
  for (int s = 0; s < plan->scene_count; s++)
    if (plan->scenes[s].point_load) {
      fprintf(stream, "%s has a load at single nodes: under refinement it digs a dent, so that no mesh is fine enough; let it "
                      "act on an area or a radius.\n",
              plan->scenes[s].name);
      break;
    }
}

static void say(const void *plan, FILE *stream) { flesh_drift_say(plan, stream); }

int flesh_drift_write_verdict(const void *plan)
{
  return flesh_table_say(((const flesh_drift_plan *)plan)->out, "verdict.txt", say, plan);
}
