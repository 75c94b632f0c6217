-- accuracy.sql: what `flesh accuracy` tells of its runs, from the tables of runs.sql: tables, the verdict, pictures.

-- to accuracy.csv
SELECT method, setting, steps, rejected, residual_evaluations, hessian_assemblies, newton, linear_iterations, cpu_s,
  wall_s_median, wall_s_min, error AS error_position_rms, error_position_max, error_tip, error_volume, energy_drift, status,
  error / (tolerance * length) AS error_over_tolerance, error / motion AS error_over_motion, price, value, difference,
  iif(price = 'work', coalesce(in_time, 0), NULL) AS front_time, iif(price = 'work', coalesce(in_residuals, 0),
    NULL) AS front_residuals
FROM runs JOIN reference LEFT JOIN fronts USING (number) ORDER BY number;
-- to orders.csv
SELECT method, against, points, slope AS "order", slope_error AS order_standard_error, low AS "from", high AS "to"
FROM orders ORDER BY first;

-- The runs as a table, the methods' work first.
CREATE TEMP VIEW heads (work, at, text) AS
SELECT price = 'work', -2, printf('%s%-18s %-30s %-15s %8s %6s %8s %8s %8s %8s %9s %8s %9s %9s', char(10), 'method',
  'setting', 'status',
    'steps', 'reject', 'residual', 'Hessian', 'linear', 'cpu', 'error', 'of the', 'energy', iif(price = 'work', 'error per',
      'off the'))
  FROM runs GROUP BY 1
UNION ALL SELECT price = 'work', -1, printf('%-18s %-30s %-15s %8s %6s %8s %8s %8s %8s %9s %8s %9s %9s', '', '', '', '', '',
  'evals',
    'assembl.', 'iter.', 's', 'rms m', 'motion %', 'drift %', iif(price = 'work', 'tolerance', 'tight, m')) FROM runs GROUP BY 1
UNION ALL VALUES (1, 1e9, '* nothing is as good in less time. error per tolerance: of the body''s length.')
UNION ALL SELECT 0, 1e9, 'off the tight: difference from the same run with every solve to rounding. Another mass matrix
makes another body: its difference is no error.' WHERE EXISTS (SELECT 1 FROM runs WHERE price <> 'work');
-- to stdout
SELECT text FROM (
  SELECT * FROM heads UNION ALL
  SELECT price = 'work', number, printf('%-18s %-30s %-15s %8s %6s %8s %8s %8s %8s %9s %8s %9s %9s%s', method, setting, status,
    number('%.0f', steps), number('%.0f', rejected), number('%.0f', residual_evaluations), number('%.0f', hessian_assemblies),
    number('%.0f', linear_iterations), number('%.3g', cpu_s), number('%.2e', error), number('%.3g', 100 * error / motion),
    number('%+.2g', 100 * energy_drift),
    iif(price = 'work', number('%.3g', error / (tolerance * length)), number('%.2e', difference)), iif(in_time, '  *', ''))
  FROM runs JOIN reference LEFT JOIN fronts USING (number))
ORDER BY work DESC, at;

-- to verdict.txt
SELECT printf('
reference: %s
  they differ by %s m rms, the last refinement changed the first by %s m, interpolation between its %d times adds %s m: ' ||
  'errors below %s m (%s %% of the motion) are not reported
  motion: %s m rms, node %d moves most, %s m', words, number('%.2e', apart), number('%.2e', "change"), times,
    number('%.2e', between_times), number('%.2e', known), number('%.2g', 100 * known / motion), number('%.3g', motion), tip,
    number('%.3g', tip_motion)) || iif(period IS NULL, '; too short to show a period', printf(', period %s s', number('%.3g',
      period))) ||
  iif(known > 0.01 * motion, '
  warning: this motion cannot be followed that far by any method: ' ||
  'nearby states part too fast. A shorter --set time.end, or more --reference-seconds, may help.', '')
FROM reference;
-- to verdict.txt
SELECT 'times: CPU time of the integration alone; times that differ by less than a tenth, ' ||
  'or by less than repeats do, count as equal' ||
  iif(total(wall_s_min) > 1.2 * total(cpu_s) AND total(cpu_s) > 0,
    printf('. The machine was busy: on the wall the runs took %s times that', number('%.1f',
      total(wall_s_min) / total(cpu_s))), '')
FROM runs WHERE wall_s_min IS NOT NULL;

-- Runs that reach a share of the motion: as accurate, or below the reference's uncertainty; and not by luck: all runs of
-- the method with smaller steps or tolerances are, too. `best` has of each method, and of all ('*'), the one of least CPU
-- time: of those that took the least time, or no more than times scatter, the one with the least counts.
CREATE TEMP TABLE shares AS
SELECT column1 AS share, column1 * motion AS target, column1 * motion > known AS is_known
FROM (VALUES (0.1), (0.01), (0.001), (0.0001)) JOIN reference;
CREATE TEMP TABLE reached AS
WITH within AS (SELECT share, number, method, value, below OR coalesce(error <= target, 0) AS good FROM done JOIN shares)
SELECT share, number, method FROM within w WHERE good AND NOT EXISTS (
  SELECT 1 FROM within o WHERE o.share = w.share AND o.method = w.method AND o.value < w.value AND NOT o.good);
CREATE TEMP TABLE best AS
WITH scopes AS (SELECT share, number, method AS scope FROM reached UNION ALL SELECT share, number, '*' FROM reached),
  quickest AS (SELECT share, scope, number FROM (
    SELECT *, row_number() OVER (PARTITION BY share, scope ORDER BY cpu_s, number) AS place FROM scopes
      JOIN done USING (number))
    WHERE place = 1)
SELECT share, scope, number FROM (
  SELECT s.share AS share, s.scope AS scope, s.number AS number, row_number() OVER (PARTITION BY s.share, s.scope
    ORDER BY residual_evaluations, linear_iterations, hessian_assemblies, steps, s.number) AS place
  FROM scopes s JOIN quickest q USING (share, scope) JOIN done d ON d.number = s.number
  JOIN pairs ON a = s.number AND b = q.number AND times = 0)
WHERE place = 1;
-- The most accurate run of each method; and where its curve passes a share, along straight lines in log-log.
CREATE TEMP VIEW most_accurate AS
SELECT method, number FROM (SELECT *, row_number() OVER (PARTITION BY method ORDER BY error, number) AS place FROM done
  WHERE error IS NOT NULL) WHERE place = 1;
CREATE TEMP TABLE passes AS
WITH curve AS (SELECT method, number, error, cpu_s, lag(error) OVER w AS error_before, lag(cpu_s) OVER w AS cpu_before FROM done
  WHERE error IS NOT NULL WINDOW w AS (PARTITION BY method ORDER BY number))
SELECT share, method, cpu_before * pow(cpu_s / cpu_before, ln(error_before / target) / ln(error_before / error)) AS cpu_s
FROM (SELECT *, row_number() OVER (PARTITION BY share, method ORDER BY number) AS place FROM curve JOIN shares
  WHERE error <= target)
WHERE place = 1;
CREATE TEMP VIEW described AS
SELECT number, cpu_s, method, printf('%s in %s s, %d steps, error ', setting, number('%.3g', cpu_s), steps) ||
  iif(below, 'below the reference''s uncertainty', number('%.3g', 100 * error / motion) || ' %') ||
  iif(energy_gain > 0.01, ', gains energy', '') AS words FROM done JOIN reference;
-- Backward Euler beside the best of all, where that is another method.
CREATE TEMP TABLE euler AS
SELECT b.share AS share, b.number AS best, s.number AS reached, a.number AS otherwise,
  (SELECT cpu_s FROM passes p WHERE p.share = b.share AND p.method = 'backward-euler') /
    (SELECT cpu_s FROM passes p WHERE p.share = b.share AND p.method = r.method) AS curve
FROM best b JOIN runs r USING (number) LEFT JOIN best s ON s.share = b.share AND s.scope = 'backward-euler'
LEFT JOIN most_accurate a ON a.method = 'backward-euler' WHERE b.scope = '*' AND r.method <> 'backward-euler';

-- to verdict.txt
SELECT text FROM (
  SELECT share, 0 AS at, printf('%sFor %s %% of the motion (%s m rms):%s', char(10), number('%g', 100 * share), number('%.3g',
    target),
    iif(is_known, '', char(10) || '  the reference is less accurate than that.')) AS text FROM shares
  UNION ALL
  SELECT s.share, 1 + first, printf('  %-18s ', m.method) || CASE
    WHEN t.number = best.number THEN t.words || '  <- least CPU time'
    WHEN same THEN t.words || '; a tie: the same steps and errors'
    WHEN times = 0 THEN t.words || '; the same cost, within the noise of the clock'
    WHEN t.number IS NOT NULL THEN printf('%s; %s times as much', t.words, number('%.3g', t.cpu_s / best.cpu_s))
    ELSE coalesce('not reached; its best: ' || other.words, 'no run to judge by') END
  FROM shares s JOIN methods m LEFT JOIN best b ON b.share = s.share AND b.scope = m.method LEFT
    JOIN described t ON t.number = b.number
  LEFT JOIN best c ON c.share = s.share AND c.scope = '*' LEFT JOIN described best ON best.number = c.number
  LEFT JOIN pairs p ON p.a = t.number AND p.b = best.number
  LEFT JOIN most_accurate o ON o.method = m.method LEFT JOIN described other ON other.number = o.number WHERE is_known
  UNION ALL
  SELECT share, 1e6, '  no setting that was measured reaches it.' FROM shares
  WHERE is_known AND share NOT IN (SELECT share FROM best)
  UNION ALL
  SELECT share, 2e6, CASE
    WHEN reached IS NOT NULL THEN printf('  Backward Euler costs %s times as much in time and %s times the steps',
      number('%.3g', s.cpu_s / b.cpu_s),
      number('%.3g', 1.0 * s.steps / b.steps)) || iif(curve IS NULL, '',
      printf(' (%s times in time, interpolated between settings)', number('%.3g', curve))) || '.'
    WHEN o.cpu_s > b.cpu_s THEN printf('  Backward Euler would cost more than %s times as much: ' ||
      'its best run takes that and does not reach it.',
      number('%.3g', o.cpu_s / b.cpu_s))
    ELSE '  Backward Euler does not reach it at any step that was measured.' END
  FROM euler JOIN runs b ON b.number = best LEFT JOIN runs s ON s.number = reached LEFT JOIN runs o ON o.number = otherwise
  WHERE coalesce(reached, otherwise) IS NOT NULL
  UNION ALL SELECT share, 3e6, '  to repeat: ' || command FROM best JOIN runs USING (number) WHERE scope = '*'
  UNION ALL SELECT share, 4e6, '             ' || command FROM euler JOIN runs ON number = reached)
WHERE share IN (SELECT share FROM shares WHERE is_known) OR at = 0 ORDER BY share DESC, at;

-- to verdict.txt
SELECT '
Orders, fitted where they hold: over neighbouring runs whose slopes agree within 15 %, ' ||
  'with errors from ten times the reference''s uncertainty to a tenth of the motion:';
-- to verdict.txt
SELECT printf('  %-18s ', method) || CASE
  WHEN points THEN printf('error ~ %s^%s ± %s (%d runs)', against, number('%.3f', slope), number('%.3f', slope_error), points)
  WHEN candidates < 3 THEN printf('too few runs (%d) in that range', candidates)
  ELSE printf('no order yet: the slopes between its %d runs in that range differ', candidates) END
FROM orders ORDER BY first;

-- to verdict.txt
SELECT printf('%srefused: %s: %s', char(10), group_concat(method, ', '), message)
FROM (SELECT DISTINCT method, message FROM runs WHERE price = 'work' AND status = 'refused' ORDER BY number) GROUP BY message;

-- Spurious energy is worse than energy that is lost: it can grow. Runs that it has ended count, too.
-- to verdict.txt
SELECT printf('%swarning: %s gains energy, in %% of the motion''s:', char(10), method) || group_concat(
    printf(' %s at %s', number('%.2g', 100 * energy_gain), setting), ',') || '.' || iif(max(max_order) > 2, '
  Orders above 2 are not stable for fast oscillations, which grow: take order 2 (ida) or a tighter tolerance.', '')
FROM (SELECT * FROM runs WHERE price = 'work' AND status <> 'not run' AND energy_gain > 0.01 ORDER BY number)
GROUP BY method ORDER BY min(number);

-- to verdict.txt
SELECT coalesce((SELECT printf('%sOther settings, one at a time, with %s at a step of %s s:', char(10), method, step_text)
  FROM runs
  WHERE price <> 'work' ORDER BY number LIMIT 1), '
Other settings are not measured: --methods names no method of fixed steps.');
-- to verdict.txt
SELECT printf('  %-32s ', setting) || iif(NOT ended, status, printf('%s s, %d Hessians, %d linear iterations; ',
  number('%.3g', cpu_s),
  hessian_assemblies, linear_iterations) || CASE
  WHEN other_body THEN printf('another body: differs by %s m rms (%s %% of the motion)', number('%.2e', difference),
    number('%.2g', 100 * difference / motion))
  ELSE printf('adds %s m rms', number('%.2e', difference)) END)
FROM runs JOIN reference WHERE price <> 'work' ORDER BY number;
-- to verdict.txt
SELECT '  the mesh                         not measured here: --mesh measures its error'
WHERE EXISTS (SELECT 1 FROM runs WHERE price <> 'work');

-- Pictures: columns of accuracy.csv by method, with the method's fitted order as far as one shows.
CREATE TEMP VIEW legends AS
SELECT *, method || iif(points, printf(': error ~ %s^%s ± %s', against, number('%.2f', slope), number('%.2f', slope_error)),
  '') AS legend,
  printf('''accuracy.csv'' using (strcol(''method'') eq ''%s'' && strcol(''price'') eq ''work'' ? ', method) AS rows
FROM orders WHERE method IN (SELECT method FROM done WHERE judged AND error <> 0) ORDER BY first;
CREATE TEMP VIEW works (name, cost, label, front) AS
VALUES ('work_time', 'cpu_s', 'CPU time of the integration [s]', 'front_time'),
  ('work_residuals', 'residual_evaluations', 'number of residual evaluations', 'front_residuals');
-- Far below every run the line of what is known would only squeeze the picture.
CREATE TEMP VIEW work_scripts AS
SELECT name, plot(name, 1040, 640, 'What accuracy costs', label,
  'error: mass-weighted rms, worst over time [% of the motion]') ||
  'set logscale xy
set format xy ''%g''
set yrange [*:200]
' || (SELECT group_concat(printf('set arrow %d from graph 0, first %g to graph 1, first %g nohead dt 3 lc rgb ''#909090''',
  column1,
    column2, column2), char(10)) FROM (VALUES (1, 1), (2, 0.1), (3, 0.01))) || '
plot ' ||
  (SELECT group_concat(printf('%scolumn(''%s'') : NaN):(100*column(''error_over_motion'')) ' ||
    'with linespoints lw 2 pt %d ps 0.9 lc rgb ''%s'' title %s, \
     ', rows, cost, mark, colour, quoted(legend)), '') FROM legends) ||
  printf('''accuracy.csv'' using (column(''%s'') == 1 ? column(''%s'') : NaN):(100*column(''error_over_motion'')) ' ||
    'with points pt 6 ps 2.4 lw 1.5 lc rgb ''#202020'' title ''nothing better for less'', \
     %s with lines dt 2 lc rgb ''#909090'' title ''reference known to %s %%''', front, cost,
    iif(known > (SELECT min(error) FROM done) / 100, number('%.17g', 100 * known / motion), 'NaN'), number('%.1g',
      100 * known / motion)) AS text
FROM works JOIN reference WHERE EXISTS (SELECT 1 FROM legends);
-- to work_time.gp
SELECT text FROM work_scripts WHERE name = 'work_time';
-- to work_residuals.gp
SELECT text FROM work_scripts WHERE name = 'work_residuals';

-- to orders.gp
SELECT plot('orders', 1040, 640, 'Error against step and tolerance, with orders where they hold',
  'step [s]; of adaptive methods and ida the tolerance',
    'error: mass-weighted rms, worst over time [m]') || 'set logscale xy
set format xy ''%g''
' || printf('set yrange [*:%s]
plot ', number('%g', 2 * motion)) || (SELECT group_concat(
    printf('%scolumn(''value'') : NaN):(column(''error_position_rms'')) with points pt %d ps 1.1 lc rgb ''%s'' title %s',
      rows, mark,
      colour, quoted(legend)) || iif(points, printf(', \
     [%s:%s] exp(%s)*x**%s with lines lw 1.5 lc rgb ''%s'' notitle', number('%.17g', low), number('%.17g', high),
      number('%.17g', constant), number('%.17g', slope), colour), ''), ', \
     ') FROM legends)
FROM reference WHERE EXISTS (SELECT 1 FROM legends);

-- to energy.gp
SELECT plot('energy', 1040, 640, 'Energy lost (open) and gained (filled) against the time it takes',
  'CPU time of the integration [s]',
    'largest difference of energy [% of the largest kinetic energy]') || 'set logscale xy
set format xy ''%g''
set yrange [*:1000]
plot ' || text
FROM (SELECT group_concat(printf('%s(100*abs(column(''energy_drift''))) with lines lw 2 lc rgb ''%s'' title ''%s'', \
     %s(column(''energy_drift'') > 0 ? 100*column(''energy_drift'') : NaN) with points pt 7 ps 1.4 lc rgb ''%s'' notitle, \
     %s(column(''energy_drift'') < 0 ? -100*column(''energy_drift'') : NaN) with points pt 6 ps 1.4 lw 2 lc rgb ''%s'' notitle',
    rows, colour, method, rows, colour, rows, colour), ', \
     ') AS text FROM (
  SELECT *,
    printf('''accuracy.csv'' using (strcol(''method'') eq ''%s'' && strcol(''price'') eq ''work'' ? column(''cpu_s'') : NaN):',
    method) AS rows
  FROM methods WHERE method IN (SELECT method FROM done WHERE abs(energy_drift) < 9e999 AND energy_drift <> 0) ORDER BY first))
WHERE text IS NOT NULL;

-- The adaptive methods' own steps beside the motion's period, and their orders: a column each, the tighter the darker.
CREATE TEMP VIEW shades AS
SELECT method, first, number, tolerance_text, steps_file,
  iif(count(*) OVER w > 1, (row_number() OVER (PARTITION BY method ORDER BY number) - 1.0) / (count(*) OVER w - 1), 1) AS shade
FROM (SELECT *, substr(setting, length('tolerance=') + 1) AS tolerance_text FROM runs WHERE steps_file <> ''
  AND status <> 'not run')
JOIN (SELECT method, first FROM methods) USING (method) WINDOW w AS (PARTITION BY method);
CREATE TEMP VIEW step_curves AS
SELECT method, first, y,
  group_concat(printf('%s using ''t'':''%s'' with steps lw 1.6 lc rgb ''#%02x%02x%02x'' title %s', quoted('./' || steps_file),
    y,
    CAST(240 * (1 - shade) AS INTEGER), CAST(176 - 128 * shade AS INTEGER), CAST(80 + 48 * shade AS INTEGER),
      quoted(tolerance_text)), ', \
     ') AS curves
FROM (SELECT * FROM shades JOIN (SELECT 'h' AS y UNION ALL SELECT 'order') ORDER BY number) GROUP BY method, y;
-- to steps.gp
SELECT plot('steps', width, 760, NULL, NULL, NULL) ||
  printf('set multiplot layout 2,%d title ''Steps and orders that the adaptive methods chose, by tolerance'' font '',13'' ' ||
    'margins screen %.4f,%.4f,0.08,0.88 spacing screen %.4f,0.1
set xrange [%s:%s]
set xlabel ''t [s]''
unset key
set logscale y
set format y ''%%g''
set ylabel ''step [s]''
', columns, 100.0 / width, 1 - 190.0 / width, 110.0 / width, number('%.17g', start_t), number('%.17g', end_t)) ||
  (SELECT group_concat(iif(first = last, 'set key at screen 0.99,0.88 right top vertical Left reverse noenhanced samplen 2
', '') || printf('set title ''%s'' noenhanced
plot %s', method, curves) || iif(period IS NULL, '', printf(', \
     %s with lines dt 2 lw 2 lc rgb ''#202020'' title ''motion''''s period'', \
     %s with lines dt 3 lw 2 lc rgb ''#202020'' title ''a 20th of it''', number('%.17g', period), number('%.17g',
       period / 20))) ||
    char(10), '') FROM (SELECT * FROM step_curves WHERE y = 'h' ORDER BY first)) ||
  'unset logscale y
unset title
set yrange [0.5:5.5]
set ytics 1
set ylabel ''order''
unset key
' || (SELECT group_concat('plot ' || curves, char(10)) FROM (SELECT * FROM step_curves WHERE y = 'order' ORDER BY first)) || '
unset multiplot'
FROM reference JOIN (SELECT count(*) AS columns, 350 * count(*) + 280 AS width, max(first) AS last FROM step_curves
  WHERE y = 'h')
WHERE columns;
