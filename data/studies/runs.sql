-- runs.sql: the runs of `flesh accuracy` as tables (drivers/study/results.h says how), which accuracy.sql and mesh.sql go on
-- from.

-- The reference, and the runs in the order of the plan; figures are NULL where there are none.
CREATE TEMP TABLE reference AS
SELECT message AS words, times, apart, "change", "between" AS between_times, uncertainty_position_rms AS known, length, motion,
  tip_node AS tip, tip_motion, period, start_t, end_t
FROM results JOIN wanted USING (id) WHERE price = 'reference' AND status_code = 0;
CREATE TEMP TABLE runs AS
SELECT f.number AS number, data ->> 'method' AS method, data ->> 'setting' AS setting, data ->> 'price' AS price,
  data ->> 'value' AS value, data ->> 'step' AS step_text, data ->> 'tolerance' AS tolerance,
  data ->> 'max_order' AS max_order, data ->> 'adaptive' AS adaptive, data ->> 'colour' AS colour, data ->> 'mark' AS mark,
  data ->> 'own' AS own, data ->> 'other_body' AS other_body, data ->> 'steps_file' AS steps_file,
  (SELECT 'flesh run ' || shell_word(scene) || coalesce((SELECT group_concat(' --set ' || shell_word(value), '')
    FROM json_each(overrides)), '') FROM cases WHERE cases.id = r.id) AS command,
  CASE WHEN coalesce(r.status, 'planned') IN ('planned', 'running') THEN 'not run' ELSE r.status END AS status,
  coalesce(status_code = 0, 0) AS ended, steps, rejected, residual_evaluations, hessian_assemblies, newton,
  linear_iterations, cpu_s, wall_s_median, wall_s_min,
  iif(typeof(error_position_rms) = 'text', 9e999, error_position_rms) AS error, error_position_max, error_tip,
  error_volume, energy_drift, energy_gain, coalesce(below_reference, 0) AS below, difference, r.message AS message,
  min(max(0.1, coalesce(iif(wall_s_min > 0, wall_s_median / wall_s_min - 1, 0), 0)), 0.3) AS noise
FROM facts f LEFT JOIN wanted USING (number) LEFT JOIN results r ON r.id = wanted.id
WHERE data ->> 'price' IS NOT NULL ORDER BY f.number;
CREATE TEMP TABLE methods AS
SELECT method, min(number) AS first, max(adaptive) AS adaptive, max(max_order) AS max_order, max(colour) AS colour,
  max(mark) AS mark
FROM runs WHERE price = 'work' GROUP BY method ORDER BY 2;

-- Pairs of runs of the work that came to their end. `same`: the same run, as many steps, the same error; `times`: -1 where a
-- took less, 1 where b did, 0 where their times do not distinguish them; `counts`: by counts, which no machine changes.
CREATE TEMP TABLE done AS SELECT *, abs(error) < 9e999 AS judged FROM runs WHERE price = 'work' AND ended;
CREATE TEMP VIEW alike AS
SELECT a.number AS a, b.number AS b, coalesce(a.steps = b.steps AND a.rejected = b.rejected AND
    (abs(a.error - b.error) <= 1e-9 * a.error OR (a.below AND b.below)), 0) AS same,
  a.cpu_s / b.cpu_s AS ratio, 1 + max(a.noise, b.noise) AS least,
  ((a.residual_evaluations, a.linear_iterations, a.hessian_assemblies, a.steps) >
    (b.residual_evaluations, b.linear_iterations, b.hessian_assemblies, b.steps)) -
  ((a.residual_evaluations, a.linear_iterations, a.hessian_assemblies, a.steps) <
    (b.residual_evaluations, b.linear_iterations, b.hessian_assemblies, b.steps)) AS counts
FROM done a JOIN done b;
CREATE TEMP TABLE pairs AS
SELECT a, b, same, counts, iif(same, 0, coalesce((ratio > least) - (ratio * least < 1), 0)) AS times FROM alike;
CREATE UNIQUE INDEX temp.pairs_of ON pairs (a, b);

-- Of the judged runs those that none beats: another beats it that is as good for no more, and better in one; of two that
-- are alike the first stays. An error that is smaller by less than a twentieth is worth nothing more, and a run whose error
-- exceeds the motion is no answer at any price.
CREATE TEMP VIEW rivals AS
SELECT b AS number, same OR a.error = b.error AS alike, a.error < b.error AS better, a.error <= 1.05 * b.error AS as_good,
  times, iif(times, times, counts) AS costs, sign(a.residual_evaluations - b.residual_evaluations) AS residuals,
    a < b AS earlier
FROM pairs JOIN done a ON a.number = a JOIN done b ON b.number = b WHERE a <> b AND a.judged AND b.judged;
CREATE TEMP TABLE beaten AS
SELECT number,
  max(iif(alike, costs < 0 OR (costs = 0 AND earlier), (better AND (costs <= 0 OR times = 0)) OR (as_good
    AND times < 0))) AS in_time,
  max(iif(alike, residuals < 0 OR (residuals = 0 AND earlier), (better AND residuals <= 0) OR (as_good AND residuals < 0)))
    AS in_residuals
FROM rivals GROUP BY number;
CREATE TEMP TABLE fronts AS
SELECT number, judged AND error < motion AND NOT coalesce(in_time, 0) AS in_time,
  judged AND error < motion AND NOT coalesce(in_residuals, 0) AS in_residuals
FROM done JOIN reference LEFT JOIN beaten USING (number);

-- Orders: a line through log(error) over log(value) of runs that are neither too coarse to be of use (error above a tenth of
-- the motion) nor near the reference's uncertainty (ten times), over the longest row of neighbours whose slopes agree within
-- 15 % and are above 0.25, which would be a floor; of equally long ones that of the smallest values.
CREATE TEMP TABLE points AS
SELECT *, (y - lag(y) OVER w) / (x - lag(x) OVER w) AS rise, row_number() OVER w AS k
FROM (SELECT method, number, value, ln(value) AS x, ln(error) AS y FROM done JOIN reference
      WHERE judged AND error <= 0.1 * motion AND error >= 10 * known)
WINDOW w AS (PARTITION BY method ORDER BY number);
CREATE TEMP TABLE spans AS
SELECT method, first, last FROM (
  SELECT *, row_number() OVER (PARTITION BY method ORDER BY last - first DESC, first DESC) AS place FROM (
    SELECT f.method AS method, f.k AS first, l.k AS last, min(p.rise) AS low, max(p.rise) AS high FROM points f
    JOIN points l ON l.method = f.method AND l.k >= f.k + 2 JOIN points p ON p.method = f.method AND p.k > f.k AND p.k <= l.k
    GROUP BY f.method, f.k, l.k)
  WHERE low > 0.25 AND high - low <= 0.15 * high)
WHERE place = 1;
CREATE TEMP TABLE fitted AS SELECT points.* FROM spans JOIN points USING (method) WHERE k BETWEEN first AND last;
CREATE TEMP TABLE sums AS
SELECT method, count(*) AS points, min(value) AS low, max(value) AS high, mx, my, sum((x - mx) * (x - mx)) AS xx,
  sum((x - mx) * (y - my)) / sum((x - mx) * (x - mx)) AS slope
FROM fitted JOIN (SELECT method, avg(x) AS mx, avg(y) AS my FROM fitted GROUP BY method) USING (method) GROUP BY method;
CREATE TEMP TABLE orders AS
SELECT m.*, iif(adaptive, 'tolerance', 'step') AS against, coalesce(points, 0) AS points, slope, low, high,
  my - slope * mx AS constant,
  (SELECT sqrt(sum((y - my - slope * (x - mx)) * (y - my - slope * (x - mx))) / (points - 2) / xx) FROM fitted f
   WHERE f.method = m.method) AS slope_error,
  (SELECT count(*) FROM points p WHERE p.method = m.method) AS candidates
FROM methods m LEFT JOIN sums USING (method);

-- The errors of steps, where what is below the reference's uncertainty counts as that; and the run whose method and step
-- meshes are compared by: of those with fixed steps the one of least CPU time whose error is a hundredth of the motion at
-- most, else the most accurate.
CREATE TEMP TABLE steps AS
SELECT done.*, iif(below, known, error) / motion AS step_error FROM done JOIN reference;
CREATE TEMP TABLE shared AS
SELECT number, step_error, cpu_s FROM steps WHERE tolerance IS NULL AND step_error IS NOT NULL
ORDER BY iif(step_error <= 0.01, cpu_s, 1e6 * (1 + step_error)), number LIMIT 1;
