/* results.c: the documentation of the files that a run writes. */
#include "schema/results.h"

#include <stdio.h>
#include <string.h>

typedef struct row {
  const char *name, *unit, *doc; /* a row without a name ends a table */
} row;

static const row result_rows[] = {
    {"status", "", "complete, failed, interrupted or out of budget; running while the run goes on or if it was killed"},
    {"exit_code", "", "of the program"},
    {"message", "", "the error; empty for a successful run"},
    {"warning", "", "of a successful run, such as spurious energy, or a step of more than 200 times the iterations of the "
                    "median step; also on stderr"},
    {"notes", "", "messages of effects (for example, a weld broke)"},
    {"failure", "", "of a step that failed: reason, advice, time, residual, the worst tet and node with their places"},
    {"effects", "", "of each effect: evaluations, memory, and cpu_s with --profile"},
    {"materials", "Pa", "of each material: the constants of its form and those of small strain, and its stress at rest"},
    {"inputs", "", "files with sha256; counts and volume of the mesh; seed"},
    {"program", "", "version, commit, compiler, libraries, arguments, threads, preconditioner, machine, date"},
    {"ranks", "", "on several ranks: nodes, tets, neighbours, messages and memory of each"},
    {"resumed", "", "of a run that went on from a checkpoint; same_bits: whether it has the bits of an uninterrupted one"},
    {"error_bars", "", "with --error: what the run was compared with, or why there is no bar; value and bars of each number "
                       "at the end; better: the number of a companion that is a better answer"},
    {"adapted_mesh", "", "with --to: the meshes, and the column's value and bar on each"},
    {"figures", "", "numbers of the whole run:"},
    {"steps, t_end", "1, s", "accepted steps; time reached"},
    {"max_volume_drift, final_volume_drift", "1", "V/V_rest - 1: its largest size over the run; signed, at the end"},
    {"J_min, J_min_t, J_bound", "1, s, 1", "least J at a point of quadrature over the run, and when; least lower bound of J"},
    {"max_inverted, final_inverted", "tets", "inverted tets: most over the run; at the end"},
    {"first_inverted_t", "s", "when a tet was first inverted"},
    {"work_put_in", "J", "work of loads, motions, moving obstacles and muscles; 0 in statics"},
    {"energy_released", "J", "dissipated by breaking"},
    {"energy_gain, energy_gain_J, energy_gain_t", "1, J, s", "largest spurious energy, over that of the motion; the same "
                                                             "energy; when"},
    {"stressed_rest_J", "J", "strain energy of a final state at rest that no load holds"},
    {"intersecting_at_start, intersecting_at_end, apart_t", "1, 1, s",
     "with intersecting: separate: places where surfaces intersect; when they came apart"},
    {"longest_step, longest_step_newton, longest_step_linear", "1", "number and iterations of the most expensive step"},
    {"longest_step_over_median", "1", "its cost over that of the median step"},
    {"internal_steps", "1", "steps of the integrator"},
    {"rejected_steps", "1", "steps rejected by their error or gain of energy"},
    {"convergence_failures", "1", "steps rejected because Newton's iteration failed"},
    {"impact_steps", "1", "steps that backward Euler took, as the method's own ended inside an obstacle"},
    {"damped_steps", "1", "steps that backward Euler took, as the method's own gained energy"},
    {"solves, residuals", "1", "nonlinear solves; evaluations of the residual"},
    {"solves_at_rounding, solves_unconverged", "1", "solves that ended at round-off; that were accepted unconverged"},
    {"multiplier_updates", "1", "corrections of the pressures of incompressible tets"},
    {"untanglings, untangled_nodes", "1", "times that a tangle was removed; nodes that were moved"},
    {"newton, linear, linear_single", "1", "Newton iterations; linear iterations; those of them in single precision"},
    {"direct", "1", "linear systems that a factorisation solved after the iteration failed"},
    {"assemblies, projections, backtracks", "1", "matrices assembled; those with filtered eigenvalues; reductions by the "
                                                 "line search"},
    {"subdomains, subdomain_newton", "1", "uses of nonlinear elimination; its Newton iterations"},
    {"watchdog_steps", "1", "longer steps that were kept (watchdog)"},
    {"unfinished_newton, unfinished_linear", "1", "iterations of a step that was not finished"},
    {"newton_per_step, linear_per_newton", "1", "means over the run"},
    {"residual, residual_target", "N", "2-norm at the end of the last solve; the norm that it had to reach"},
    {"energies", "J", "at the end, of each effect that has one, and their total"},
    {"probes", "", "of each column of probes.csv: unit, final, min and max"},
    {"wall_s, cpu_s, peak_memory_kB", "s, s, kB", "cost"},
    {0}};

static const row history_rows[] = {
    {"t, step, h", "s, 1, s", "time at the end of the step; its number; its length"},
    {"newton, linear", "1", "Newton iterations and linear iterations of the step"},
    {"assemblies, projections, backtracks", "1", "matrices assembled; those with filtered eigenvalues; reductions by the "
                                                 "line search"},
    {"residual, residual_target", "N", "2-norm at the end of the last solve; the norm that it had to reach"},
    {"energy_EFFECT, energy_total", "J", "energy of each effect that has one, elasticity relative to rest; their sum"},
    {"volume, volume_ratio", "m^3, 1", "of the body; over that at rest"},
    {"J_min, J_min_tet", "1", "least J at a point of quadrature; its tet, from 0"},
    {"J_bound, inverted", "1, tets", "lower bound of J anywhere; tets with J <= 0 at a point of quadrature"},
    {"contact_gap, contact_force", "m, N", "least distance, at most the thickness; size of the sum of the normal forces"},
    {"contact_nodes, contact_pairs", "1", "nodes near an obstacle; pairs of features of bodies within the thickness"},
    {"contact_ignored", "1", "with intersecting: separate: pairs of surfaces that still ignore contact"},
    {"weld_broken, weld_released, weld_traction", "1, J, Pa", "broken fraction of the weld's area; energy that breaking "
                                                              "released; largest effective traction in what holds"},
    {"muscle_activation", "1", "activation of the muscle"},
    {0}};

static const row probes_rows[] = {
    {"position, velocity", "m, m/s", "of the point, or the mean of the nodes; _x, _y, _z"},
    {"reaction, reaction_moment", "N, N m", "force of pins and prescribed motions on the body, and its moment about `about`"},
    {"contact_force, contact_moment", "N, N m", "the same of contact; of a weld or joint those on its first side"},
    {"J, J_mean", "1", "J at the point; its mean over the rest volume of the tets all of whose nodes are chosen"},
    {"stretch", "1", "principal ones, descending, _1, _2, _3: at the point, or means like J_mean"},
    {"stress", "Pa", "Cauchy, _xx, _yy, _zz, _xy, _yz, _xz: at the point, or the mean over the volume of these tets"},
    {"energy", "J", "of strain, from rest, the sum over these tets; at a point J/m^3, per volume at rest"},
    {0}};

static const row frame_rows[] = {
    {"displacement, velocity", "m, m/s", "at nodes; the points of a frame are the deformed positions"},
    {"J_mean, J_min, region", "1", "of tets: the mean of J over the points of quadrature; the least; the mesh's region"},
    {"J, stretch", "1", "det F; principal stretches, descending"},
    {"stress", "Pa", "Cauchy, XX, YY, ZZ, XY, YZ, XZ; with the mean of J in the volume term of tet10-mean, and the "
                     "pressures of incompressible bodies; that of fibres is W' f f^T/(J |f|), f = F a; viscous stress and "
                     "that of contact are not included"},
    {"von_mises, pressure", "Pa", "of this stress; pressure is minus a third of its trace"},
    {"energy_density", "J/m^3", "of strain, from rest, per volume at rest"},
    {"reaction, contact_force", "N", "at nodes: of pins and prescribed motions, and of contact, on the body"},
    {0}};

static const struct {
  const char *name, *doc, *column;
  const row *rows;
} tables[] = {
    {"result.json", "How a run ended and its figures. Units are SI. What does not exist is null.", "field", result_rows},
    {"history.csv",
     "A row for each step; the first (step 0) is the start. A second effect of a name is NAME_2, as in energy_spring_2 and "
     "contact_2_gap.",
     "columns", history_rows},
    {"probes.csv",
     "A row for each step, and columns PROBE.QUANTITY [unit] of every probe (output.probes), such as tip.position_z [m].",
     "quantity", probes_rows},
    {"frames",
     "Fields of frames/*.vtu, with their units as VTK's UNITS_LABEL. A value that does not exist (the stress of Neo where "
     "J <= 0)\nis NaN. `output.fields` adds fields, at the places that `output.fields_at` names:\n\n"
     "- tets: stress is the mean over the tet's volume, other fields are means over its volume at rest.\n"
     "- nodes: the mean over the tets around the node, weighted by their volume at rest; it hides jumps between materials.\n"
     "  In ten-node tets stress and stretch are first extrapolated from the points of quadrature.\n"
     "- points: cell arrays of the values at the points of quadrature, one in a four-node tet, four in a ten-node tet.\n"
     "  stress_at_points has the components XX_1 to XZ_4; point q lies next to corner q.",
     "field", frame_rows},
};

int flesh_results_print(const char *section)
{
  const int all = !strcmp(section, "results");
  int printed = 0;
  if (all) printf("# What a run writes\n\n");
  for (size_t k = 0; k < sizeof tables / sizeof *tables; k++) {
    if (!all && strcmp(section, tables[k].name)) continue;
    printf("%s## %s\n\n%s\n\n| %s | unit | meaning |\n|---|---|---|\n", printed ? "\n" : "", tables[k].name, tables[k].doc,
           tables[k].column);
    for (const row *r = tables[k].rows; r->name; r++) printf("| %s | %s | %s |\n", r->name, r->unit, r->doc);
    printed = 1;
  }
  return printed;
}
