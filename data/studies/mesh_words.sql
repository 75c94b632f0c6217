-- mesh_words.sql: what `flesh accuracy --mesh` tells, from the tables of mesh.sql.

-- to mesh.csv
SELECT element, tets, nodes, refine, source AS scene, poisson, coalesce(shared_method, 'static') AS method,
  (SELECT value FROM runs WHERE number = shared) AS step, cpu_s, iif(below, NULL, error) AS error_over_motion,
  open AS uncertainty_over_motion, iif(shared < 0, 0.0, (SELECT step_error FROM shared)) AS step_error_over_motion, status
FROM meshes JOIN about JOIN known ORDER BY kind, tets, mesh;

CREATE TEMP VIEW of_element AS
SELECT element, printf('%s of %d and %d tets, extrapolated at order %s (%s)', element, coarse, fine, number('%.2g', "order"),
  iif(levels > 2, 'measured over three meshes', 'assumed: two meshes')) AS words FROM limits;
-- A share of the motion as people read it.
CREATE TEMP VIEW percents AS
SELECT mesh, own, iif(mesh_error IS NULL, '-', iif(below, 'under ', '') || number(iif(mesh_error < 1, '%.2g', '%.0f'),
  100 * mesh_error) ||
  ' %') AS text FROM meshes;
CREATE TEMP VIEW step_percents AS
SELECT number, iif(below, 'under ', '') || number(iif(step_error < 1, '%.2g', '%.0f'), 100 * step_error) || ' %' AS text
  FROM steps;

-- to mesh.txt
SELECT iif(shared < 0, '
The error of the mesh in equilibrium (rms over the motion):', printf('
The error of the mesh beside that of the step (rms over the motion, worst over time; all by %s at %s s):', shared_method,
  shared_step))
FROM about;
-- to mesh.txt
SELECT '  reference: ' || a.words || char(10) || coalesce('    against ' || b.words,
    '  warning: no other element checks the reference; its error may be larger than stated') || char(10) ||
  printf('  they differ by %s %% of the motion (%s m rms); errors below %s %% are not reported', number('%.2g', 100 * apart),
    number('%.3g', motion), number('%.2g', 100 * open))
FROM known JOIN of_element a ON a.element = first LEFT JOIN of_element b ON b.element = second;
-- to mesh.txt
SELECT printf('  %-11s %8s %8s %12s %12s %9s', 'element', 'tets', 'nodes', 'mesh, % off', iif(shared < 0, '', 'step, % off'),
  'CPU s')
FROM about;
-- to mesh.txt
SELECT printf('  %-11s %8d %8d %12s %12s', element, tets, nodes, iif(below, '< ' || number('%.2g', 100 * open), number('%.3g',
  100 * error)),
    iif(shared < 0, '', (SELECT number('%.2g', 100 * step_error) FROM shared))) ||
  iif(ended, printf(' %9s', number('%.3g', cpu_s)), '   ' || status)
FROM meshes JOIN known JOIN about ORDER BY kind, tets, mesh;
-- to mesh.txt
SELECT 'No reference: no element has two meshes that ran to the end.' FROM known WHERE first IS NULL;

-- The scene as it stands: its mesh and element, and its own method and step.
CREATE TEMP VIEW own AS
SELECT m.mesh AS mesh, poisson, tets, element, p.text AS text, m.below AS below, iif(m.below, 0, m.error) AS of_mesh, open,
  s.number AS step,
  s.method AS method, s.step_text AS step_text, s.step_error AS of_step, q.text AS step_words, s.below AS step_below
FROM known LEFT JOIN (SELECT * FROM meshes WHERE own AND ended ORDER BY mesh LIMIT 1) m LEFT JOIN percents p ON p.mesh = m.mesh
LEFT JOIN (SELECT * FROM steps WHERE own ORDER BY number DESC LIMIT 1) s LEFT JOIN step_percents q ON q.number = s.number
WHERE first IS NOT NULL;
-- to mesh.txt
SELECT iif(mesh IS NULL, 'Your mesh: its run failed.', iif(poisson IS NULL, 'Y', printf('At a Poisson''s ratio of %s y',
  number('%g', poisson))) ||
  printf('our %d tets (%s) are %s off', tets, element, text) ||
  iif(step IS NULL, '.', printf('; the step (%s at %s s) adds %s.', method, step_text, step_words)))
FROM own;
-- to mesh.txt
SELECT words FROM (SELECT CASE
  WHEN of_mesh > 3 * of_step THEN 'The mesh makes the error: a shorter step gains nothing, another element or finer mesh does.'
  WHEN of_step > 3 * max(of_mesh, iif(below, open, 0))
  THEN 'The step makes the error: a finer mesh gains nothing, a shorter step or another method does.'
  WHEN NOT below AND NOT step_below THEN 'Mesh and step make errors of like size.' END AS words
  FROM own WHERE mesh IS NOT NULL AND step IS NOT NULL) WHERE words IS NOT NULL;

-- The choices, with the times of those that were run again as they are.
CREATE TEMP TABLE timings AS
SELECT data ->> 'timed_mesh' AS mesh, data ->> 'timed_by' AS step, cpu_s AS took FROM facts JOIN wanted USING (number)
JOIN results USING (id) WHERE data ->> 'timed_mesh' IS NOT NULL AND status_code = 0;
-- to mesh.txt
SELECT printf('For %s %% in all: ', number('%g', 100 * share)) || CASE
  WHEN share < open THEN 'the reference is less accurate than that; more --mesh-seconds may help.'
  WHEN m.mesh IS NULL THEN 'no run reaches it.'
  ELSE printf('%s, %d tets, ', element, tets) || iif(s.number IS NULL, '', s.method || iif(s.tolerance IS NULL,
      printf(' at %s s, ', s.step_text), ' at a tolerance of ' || substr(s.setting, length('tolerance=') + 1) || ', ')) ||
    printf('%s%s s (mesh %s', iif(measured OR took IS NOT NULL, '', 'about '), number('%.2g', coalesce(took, c.cpu_s)),
      p.text) ||
    iif(s.number IS NULL, '', ', step ' || q.text) || ').' END
FROM (SELECT column1 AS share FROM (VALUES (0.1), (0.01), (0.001))) JOIN known LEFT JOIN choices c USING (share)
LEFT JOIN meshes m ON m.mesh = c.mesh LEFT JOIN percents p ON p.mesh = c.mesh LEFT JOIN steps s ON s.number = c.step
LEFT JOIN step_percents q ON q.number = c.step LEFT JOIN timings t ON t.mesh = c.mesh AND t.step = c.step
WHERE first IS NOT NULL ORDER BY share DESC;

-- The CPU time at which an element's runs pass an error of 1 %, along straight lines in log-log; that of its coarsest where
-- it is as good already. Beyond its finest it is the least that it can take: with errors that fall as well as they can, by
-- order 2 with linear and 3 with quadratic displacements, and time that grows with the tets alone.
CREATE TEMP VIEW curves AS
SELECT *, lag(error) OVER w AS error_before, lag(cpu_s) OVER w AS cpu_before, row_number() OVER w AS place,
  count(*) OVER (PARTITION BY kind) AS runs
FROM (SELECT *, row_number() OVER (PARTITION BY kind, tets ORDER BY mesh) AS copy FROM meshes WHERE ended AND error IS NOT NULL)
WHERE copy = 1 WINDOW w AS (PARTITION BY kind ORDER BY tets);
CREATE TEMP TABLE times_to AS
SELECT kind, element, 0 AS beyond, iif(error_before IS NULL, cpu_s, iif(error < error_before AND cpu_s > cpu_before,
    cpu_s * exp(ln(cpu_s / cpu_before) / ln(error / error_before) * ln(0.01 / error)), NULL)) AS time
FROM (SELECT *, row_number() OVER (PARTITION BY kind ORDER BY place) AS first FROM curves WHERE error <= 0.01) WHERE first = 1
UNION ALL
SELECT kind, element, 1, cpu_s * pow(error / 0.01, iif(element = 'tet4', 1.5, 1.0)) FROM curves c
WHERE place = runs AND NOT EXISTS (SELECT 1 FROM curves o WHERE o.kind = c.kind AND o.error <= 0.01);
-- to mesh.txt
SELECT 'To a mesh error of 1 %:' || coalesce(group_concat(printf(' %s %s%s s', element, least,
    number(iif(time < 100, '%.2g', '%.0f'), time)) || iif(element <> first AND best IS NOT NULL,
      printf(', %s%s times as much', least,
    number(iif(time / best < 100, '%.2g', '%.0f'), time / best)), ''), ',') || '.', ' no run shows it.')
FROM (SELECT *, iif(beyond, 'at least ', '') AS least FROM known LEFT JOIN (SELECT element AS e, time AS best
  FROM times_to) ON e = first
  LEFT JOIN (SELECT * FROM times_to WHERE time IS NOT NULL) WHERE 0.01 >= open ORDER BY kind DESC)
HAVING count(*);
-- to mesh.txt
SELECT 'Order of convergence in the size of the cells: ' || words || ' (corners and edges that are held lower it).'
FROM (SELECT group_concat(printf('%s %s', element, number('%.2g', "order")), ', ') AS words
  FROM (SELECT * FROM limits WHERE levels > 2 ORDER BY place DESC)) WHERE words IS NOT NULL;
-- to mesh.txt
SELECT printf('warning: %s acts at single nodes: its dent deepens with every refinement, ' ||
  'and these errors do not converge; let it act on an area or a radius.', point_load)
FROM about JOIN known WHERE point_load <> '' AND first IS NOT NULL;

-- to work_mesh.gp
SELECT plot('work_mesh', 900, 560, 'What the accuracy of the mesh costs', 'CPU time [s]',
    'error of the mesh: rms, worst over time [% of the motion]') || 'set logscale xy
set format xy ''%g''
plot ' ||
  (SELECT group_concat(printf('''mesh.csv'' using (strcol(''element'') eq ''%s'' ' ||
    '? column(''cpu_s'') : NaN):(100*column(''error_over_motion'')) with linespoints lw 2 pt %d lc rgb ''%s'' title ''%s'', \
     ', column1, column2, column3, column1), '') FROM (VALUES ('tet4', 7, '#d55e00'), ('tet10', 5, '#56b4e9'), ('tet10-mean',
       9, '#0072b2'))) ||
  printf('%s with lines dt 2 lc rgb ''#909090'' title ''reference known to %s %%''', number('%.17g', 100 * open),
    number('%.1g', 100 * open)) ||
  iif(step_error > 0, printf(', \
     %s with lines dt 3 lc rgb ''#202020'' title ''error of the step''', number('%.17g', 100 * step_error)), '')
FROM known LEFT JOIN (SELECT step_error FROM shared) WHERE first IS NOT NULL;
