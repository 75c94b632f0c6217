-- profiles.sql: what eigenvalue filters cost (`flesh hardcases --filters`), from the table `runs` of hardcases.sql:
-- performance and data profiles (Dolan & More, Math. Program. 91, 2002; More & Wild, SIAM J. Optim. 20, 2009) and what they
-- decide.

-- Loads, motions and solvers without techniques are judged apart, as if by other elements. Under a load or in motion a body
-- that is not back at rest is as it should be, unless it rests stressed though nothing loads it. gnuplot does not find names
-- with commas.
CREATE TEMP TABLE apart AS
SELECT number, name, seed, poisson, step, energy, constants, mesh, newton, linear, cpu_s, outcome, code,
  element || CASE WHEN grp IN ('load', 'motion') THEN ' ' || grp ELSE '' END || iif(solver LIKE '%-bare', ' bare', '')
    AS element,
  replace(solver, '-bare', '') AS solver,
  outcome = 'recovered' OR (grp IN ('load', 'motion') AND outcome = 'not recovered' AND inverted_end = 0) AS solved
FROM runs;
CREATE TEMP TABLE elements AS SELECT element, min(number) AS first FROM apart GROUP BY element;
CREATE TEMP TABLE ways AS SELECT solver, row_number() OVER (ORDER BY min(number)) AS way FROM apart GROUP BY solver;
CREATE TEMP VIEW measures (m, measure, title) AS
VALUES (1, 'newton', 'Newton iterations'), (2, 'linear', 'linear iterations'), (3, 'cpu', 'CPU time');
-- What no way can begin with is no problem: a form that is undefined for inverted tets, an element that knows no ratio of 1/2.
CREATE TEMP TABLE tried AS
SELECT * FROM (
  SELECT *, min(code IN ('FLESH_UNDEFINED', 'FLESH_ERR_ARGUMENT')) OVER (PARTITION BY problem) AS refused FROM (
    SELECT *, dense_rank() OVER (ORDER BY element, name, seed, poisson, step, energy, constants, mesh) AS problem
    FROM apart JOIN ways USING (solver)))
WHERE NOT refused;

-- Only problems that all ways were run on count. A run solves its problem by the filter alone; its cost is NULL else.
CREATE TEMP TABLE costs AS
SELECT element, poisson, problem, way, m, iif(solved,
  max(1e-6, 1.0 * CASE m WHEN 1 THEN newton WHEN 2 THEN linear ELSE cpu_s END), NULL) AS cost
FROM tried JOIN measures WHERE problem IN (SELECT problem FROM tried WHERE outcome <> 'not run' GROUP BY problem
  HAVING count(DISTINCT way) = (SELECT count(*) FROM ways));
CREATE INDEX costs_by ON costs (element, m, way, problem);
CREATE TEMP TABLE least AS SELECT element, m, problem, min(cost) AS least FROM costs GROUP BY problem, m;
CREATE INDEX least_by ON least (problem, m);

-- The share of the problems that a way solves at no more than tau times the least cost, up to 32 times, 16 to an octave.
CREATE TEMP TABLE taus AS
WITH RECURSIVE steps (k) AS (VALUES (0) UNION ALL SELECT k + 1 FROM steps WHERE k < 80) SELECT pow(2, k / 16.0) AS tau
  FROM steps;
CREATE TEMP VIEW shares AS
SELECT e.element AS element, e.first AS first, s.m AS m, measure, w.way AS way, solver, tau,
  avg(coalesce(cost <= tau * least, 0)) AS share
FROM elements e JOIN measures s JOIN ways w JOIN taus
LEFT JOIN costs c ON c.element = e.element AND c.m = s.m AND c.way = w.way
LEFT JOIN least l ON l.problem = c.problem AND l.m = c.m
GROUP BY e.element, s.m, w.way, tau;
-- The share that a way solves within a budget of linear iterations, from 8 to 131072, four to an octave.
CREATE TEMP VIEW budgets AS
SELECT e.element, e.first, 4 AS m, 'budget' AS measure, w.way, solver, 8 * pow(2, k / 4.0) AS budget,
  avg(coalesce(cost <= 8 * pow(2, k / 4.0), 0)) AS share
FROM elements e JOIN ways w JOIN (SELECT row_number() OVER () - 1 AS k FROM taus) LEFT JOIN costs c
  ON c.element = e.element AND c.m = 2 AND c.way = w.way
WHERE k <= 56 GROUP BY e.element, w.way, k;
-- to profiles.csv
SELECT element, measure, solver AS filter, tau, share FROM (SELECT * FROM shares UNION ALL SELECT * FROM budgets)
ORDER BY first, m, way, tau;

-- to profiles.gp
SELECT plot('profiles', 1200, 40 + 330 * (SELECT count(*) FROM elements), NULL, NULL, NULL) || printf('set key default
set title noenhanced font '',11''
set logscale x 2
set yrange [0:102]
set ylabel ''problems solved [%%]'' font '',9''
set multiplot layout %d,3
%s
unset multiplot', (SELECT count(*) FROM elements), (SELECT group_concat(panel, char(10)) FROM (
  SELECT printf('set title %s
set xrange %s
set xtics %s
set xlabel ''%s'' font '',9''
%s
plot %s', quoted(element || ': ' || title), iif(m = 4, '[8:131072]', '[1:32]'),
    iif(m = 4, '8,8', 'autofreq'), iif(m = 4, 'linear iterations', 'times the least cost'),
    iif(first = (SELECT min(first) FROM elements) AND m = 1,
      'set key right bottom noenhanced font '',8'' spacing 0.9', 'unset key'),
    (SELECT group_concat(printf(
      '''profiles.csv'' using (strcol(''element'') eq ''%s'' && strcol(''measure'') eq ''%s'' && strcol(''filter'') eq ''%s'' ' ||
      '? column(''tau'') : NaN):(100*column(''share'')) with steps lw 2%s lc rgb ''%s'' title %s',
      element, measure, solver, iif(solver LIKE '%always%', ' dt 2', ''), column2, quoted(solver)), ', \
  ')
    FROM (SELECT * FROM ways JOIN (VALUES (0, '#1b6ca8'), (1, '#d1602f'), (2, '#3a8f4d'), (3, '#8c6bb1'), (4, '#111111'), (5,
      '#c2185b'),
      (6, '#8a7a2b'), (7, '#5f9ea0'), (8, '#777777'), (9, '#e0a030'), (10, '#2e3f8f'), (11,
        '#9acd32')) ON column1 = (way - 1) % 12
      ORDER BY way))) AS panel
  FROM elements JOIN (SELECT * FROM measures WHERE m < 3 UNION ALL SELECT 4, 'budget', 'solved within a budget')
  ORDER BY first, m)));

-- Two ways beside each other: a problem is won by who alone solved it, or by a cost lower by 5 % or more; a way beats the
-- other where chance would do so with a probability below 0.01 (sign test).
CREATE TEMP TABLE pairs AS
SELECT *, wins > losses AND sign_test(wins, losses) < 0.01 AS beats FROM (
  SELECT a.element, a.m, a.way AS way, b.way AS other, total(a.cost IS NOT b.cost) = 0 AS same,
    CAST(total(a.cost IS NOT NULL AND (b.cost IS NULL OR a.cost <= 0.95 * b.cost)) AS INT) AS wins,
    CAST(total(b.cost IS NOT NULL AND (a.cost IS NULL OR b.cost <= 0.95 * a.cost)) AS INT) AS losses,
    exp(avg(iif(a.cost IS NULL OR b.cost IS NULL, NULL, ln(a.cost / b.cost)))) AS ratio
  FROM costs a JOIN costs b ON a.element = b.element AND a.m = b.m AND a.problem = b.problem
  GROUP BY a.element, a.m, a.way, b.way);
-- The first of the ways that do the same in every problem stands for them, unless another decisively beats it.
CREATE TEMP TABLE leaders AS
SELECT *, (SELECT p.other FROM pairs p JOIN pairs q ON q.element = p.element AND q.m = p.m AND q.way = p.other
  AND q.other = p.way
    WHERE p.element = l.element AND p.m = l.m AND p.way = l.way AND q.beats ORDER BY q.wins DESC, p.other LIMIT 1) AS beaten_by,
  solver || coalesce((SELECT printf(' (the same in every run: %s)', group_concat(solver, ', ')) FROM
    (SELECT solver FROM pairs p JOIN ways ON ways.way = p.other WHERE p.element = l.element AND p.m = l.m AND p.way = l.way
     AND same AND p.other > p.way ORDER BY p.other) HAVING count(*)), '') AS names
FROM (SELECT element, m, way, solver FROM pairs JOIN ways USING (way) WHERE same GROUP BY element, m, way
  HAVING min(other) = way) l;
CREATE TEMP VIEW undecided AS
SELECT *, count(*) OVER (PARTITION BY element, m) AS count, row_number() OVER (PARTITION BY element, m ORDER BY way) AS place
FROM leaders WHERE beaten_by IS NULL;

CREATE TEMP VIEW solved AS
SELECT e.element, e.first, m, count(DISTINCT problem) AS problems, count(DISTINCT iif(least IS NULL, NULL, problem)) AS any
FROM elements e JOIN measures LEFT JOIN least USING (element, m) GROUP BY e.element, m;
CREATE TEMP VIEW verdicts AS
SELECT element, first, m, CASE
  WHEN any < 10 THEN printf('No verdict: %d problems that any filter solved are too few; it takes 10.', any)
  ELSE CASE
    WHEN (SELECT count(*) FROM leaders l WHERE l.element = s.element AND l.m = s.m) = 1 THEN 'All do the same in every run.'
    ELSE coalesce((SELECT iif(count > 1, 'No decision between ', '') ||
        group_concat(iif(place = 1, '', iif(place = count, ' and ', ', ')) || names, '') ||
        iif(count > 1, '.', ' is not beaten by any.')
      FROM (SELECT * FROM undecided u WHERE u.element = s.element AND u.m = s.m ORDER BY place) HAVING count(*)),
      'No decision: each is beaten by another.') END ||
    coalesce((SELECT group_concat(printf(' %s is beaten by %s in %d of %d problems that tell them apart%s.', names, b.solver,
        losses, wins + losses, iif(ratio IS NULL, '', printf(' and costs %s times as much where both solve',
        number('%.2f', ratio)))), '')
      FROM (SELECT l.names, b.solver, p.wins, p.losses, p.ratio FROM leaders l JOIN ways b ON b.way = l.beaten_by
        JOIN pairs p ON p.element = l.element AND p.m = l.m AND p.way = l.way AND p.other = l.beaten_by
        WHERE l.element = s.element AND l.m = s.m ORDER BY l.way) b), '')
  END AS verdict
FROM solved s;

CREATE TEMP VIEW poissons AS SELECT poisson, min(number) AS at FROM apart GROUP BY poisson;
-- to verdict.txt
SELECT text FROM (
  SELECT first, 0 AS m, 0 AS kind, 0 AS way, printf('%s%s: %d of %d problems run with all filters; %d solved by none', char(10),
    element, problems, (SELECT count(DISTINCT problem) FROM tried t WHERE t.element = s.element), problems - any) AS text
  FROM solved s WHERE m = 1
  UNION ALL
  SELECT first, 0, 1, 0, '  solved of        ' || (SELECT group_concat(printf(' nu %s: %d', number('%g', poisson), problems),
    ',')
    FROM (SELECT p.poisson, count(DISTINCT problem) AS problems FROM poissons p LEFT JOIN costs c ON c.poisson = p.poisson
      AND c.element = e.element GROUP BY p.poisson ORDER BY at)) FROM elements e
  UNION ALL
  SELECT first, 0, 2, way, printf('    %-22s', solver) || (SELECT group_concat(printf(' %7d', solved), '')
    FROM (SELECT count(cost) AS solved FROM poissons p LEFT JOIN costs c ON c.poisson = p.poisson AND c.element = e.element
      AND c.way = w.way AND c.m = 1 GROUP BY p.poisson ORDER BY at)) FROM elements e JOIN ways w
  UNION ALL
  SELECT first, m, 0, 0, printf('  %-24s solved    least   within 2 times   cost over %s''s', title,
    (SELECT solver FROM ways WHERE way = 1)) FROM elements JOIN measures
  UNION ALL
  SELECT first, m, 1, way, printf('    %-22s %6d   %s %%          %s %%%s', solver,
    (SELECT count(cost) FROM costs c WHERE c.element = e.element AND c.m = s.m AND c.way = w.way),
    (SELECT number('%5.1f', 100 * share) FROM shares h WHERE h.element = e.element AND h.m = s.m AND h.way = w.way AND tau = 1),
    (SELECT number('%5.1f', 100 * share) FROM shares h WHERE h.element = e.element AND h.m = s.m AND h.way = w.way AND tau = 2),
    coalesce((SELECT '   ' || number('%12.3f', ratio) FROM pairs p WHERE p.element = e.element AND p.m = s.m AND p.way = w.way
      AND other = 1 AND ratio IS NOT NULL), ''))
  FROM elements e JOIN measures s JOIN ways w
  UNION ALL
  SELECT first, m, 2, 0, '    ' || verdict FROM verdicts)
ORDER BY first, m, kind, way;
