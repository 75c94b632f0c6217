-- hardcases.sql: what `flesh hardcases` makes of its runs: the table of all (drivers/study/results.h says how); ablation.sql
-- and battery.sql go on from it.

-- The runs in the order of the plan; figures are NULL where there are none.
CREATE TEMP TABLE runs AS
SELECT f.number AS number, data ->> 'case' AS name, data ->> 'group' AS grp, data ->> 'seed' AS seed, data ->> 'energy' AS energy,
  data ->> 'constants' AS constants, data ->> 'poisson' AS poisson, data ->> 'step' AS step, data ->> 'static' AS static,
  data ->> 'random' AS random, data ->> 'hardest' AS hardest, data ->> 'solver' AS solver, data ->> 'element' AS element,
  data ->> 'mesh' AS mesh, data ->> 'own_poisson' AS own_poisson, data ->> 'title' AS title,
  data ->> 'folder' AS folder, data ->> 'out' AS out, data ->> 'setting' AS setting, data ->> 'sheet' AS sheet,
  data ->> 'setting_poisson' AS setting_poisson, data ->> 'setting_step' AS setting_step, data ->> 'held' AS held,
  data ->> 'first_of_own' AS first_of_own,
  CASE WHEN coalesce(status, 'planned') IN ('planned', 'running') THEN 'not run' WHEN status_code IS NULL THEN 'crashed or hung'
    ELSE status END AS outcome,
  CASE WHEN coalesce(status, 'planned') IN ('planned', 'running') THEN 'FLESH_ERR_INTERRUPTED'
    WHEN status_code IS NULL THEN 'FLESH_ERR_SOLVE' ELSE status_name(status_code) END AS code,
  iif(status_code IS NULL AND exit_code IS NOT NULL, 1, coalesce(exit_code, 130)) AS exit_code,
  replace(coalesce(message, ''), char(10), ' ') AS message, coalesce(tets, 0) AS tets, steps, solves, retried, unconverged,
  at_rounding, untanglings, untangled_nodes, rises, rises_checked, worst_rise, finite, max_inverted, inverted_end, distance,
  volume_error, recovered_at, rank, end_kind, gradient, smallest_eigenvalue, negative_eigenvalues, newton, linear, direct,
  projections, backtracks, newton_ratio, time_ratio, wall_s, cpu_s, simulated_s, coalesce(stressed_rest, 0) AS stressed_rest,
  longest_step, longest_newton, longest_linear, longest_cuts, longest_ratio, longest_t
FROM facts f LEFT JOIN wanted USING (number) LEFT JOIN results r ON r.id = wanted.id;
CREATE TEMP VIEW end_names (kind, end_is) AS
VALUES (1, 'minimum'), (2, 'degenerate'), (3, 'saddle'), (4, 'untangles'), (5, 'no equilibrium found');

-- to hardcases.csv
SELECT name AS "case", grp AS "group", seed, energy, constants, number('%g', poisson) AS poisson, iif(static, NULL, step) AS step,
  solver, tets, outcome, code AS status, exit_code, steps, solves, retried, unconverged, at_rounding, untanglings,
  untangled_nodes, rises AS potential_rises, rises_checked AS potential_checked, worst_rise, finite, max_inverted, inverted_end,
  distance AS distance_from_rest, volume_error, recovered_at,
  CASE rank WHEN 0 THEN 'point' WHEN 1 THEN 'line' WHEN 2 THEN 'plane' WHEN 3 THEN 'body' END AS end_shape, end_is, gradient,
  smallest_eigenvalue, negative_eigenvalues, newton, linear, direct, projections, backtracks,
  newton_ratio AS newton_worst_over_median, time_ratio AS time_worst_over_median, wall_s, cpu_s, simulated_s,
  stressed_rest AS stressed_rest_J, longest_step, longest_newton AS longest_step_newton, longest_linear AS longest_step_linear,
  longest_ratio AS longest_step_over_median, element, mesh, folder, message
FROM runs LEFT JOIN end_names ON kind = end_kind ORDER BY number;
