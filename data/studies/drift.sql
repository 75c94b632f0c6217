-- drift.sql: what `flesh drift` makes of its cases. Its statements go to the database of the cases, one after the other
-- (drivers/study/results.h): a SELECT below a line `-- to FILE` is written there.

-- The cases in the order of the command line; figures are NULL where there are none.
CREATE TEMP TABLE runs AS
SELECT number, scene_name AS scene, energy, poisson, constants, solver,
  energy || iif(constants = 'matched', '', ' ' || constants) AS title,
  CASE WHEN status IN ('planned', 'running') THEN 'not run' WHEN status_code IS NULL THEN 'crashed' ELSE status END AS status,
  coalesce(status_code, -1) AS code, status_code IS 0 AS ended, message,
  coalesce(tets, 0) AS tets, coalesce(nodes, 0) AS nodes, iif(element_kind = 0, 3, element_kind) AS kind,
  iif(tets, CASE element_kind WHEN 1 THEN 'tet4' WHEN 2 THEN 'tet10' ELSE 'tet10-mean' END, '') AS element,
  coalesce(steps, 0) AS steps, max_volume_drift, final_volume_drift, rest_volume_ratio, rest_volume_ratio_theory, J_min,
  coalesce(max_inverted, 0) AS max_inverted, final_inverted, 1.0 * newton / steps AS newton_per_step, linear_per_newton,
  wall_s, iif(status_code, coalesce(failed_at, t_end), NULL) AS failure_t,
  nullif(first_inverted_step, -1) AS first_inverted_step, J_bound, nullif(first_bound_step, -1) AS first_bound_step,
  distance_from_rest, coalesce(stressed_rest_J, 0) AS stressed_rest, point_load,
  coalesce(distance_from_rest < 0.01 AND abs(final_volume_drift) < 1e-3 AND NOT final_inverted, 0) AS back
FROM results JOIN wanted USING (id);

CREATE TEMP TABLE scenes AS
SELECT scene, min(number) AS first, max(kind) AS kind, max(nodes) AS nodes, max(tets) AS tets, max(point_load) AS point_load,
  scene || iif(max(tets), printf(' (%s, %d tets)', max(element), max(tets)), '') AS title
FROM runs GROUP BY scene;

-- Those that ran, the finest first: the most accurate element, then the most nodes. The verdict speaks of the first, and
-- the second judges it.
CREATE TEMP TABLE finest AS
SELECT *, row_number() OVER (ORDER BY kind DESC, nodes DESC, first) AS place FROM scenes WHERE tets;
CREATE TEMP VIEW best AS
SELECT * FROM scenes ORDER BY scene = (SELECT scene FROM finest WHERE place = 1) DESC, first LIMIT 1;

-- How far the finest figure may be off: as far as the next one is, and with the same element and cells smaller by r,
-- 1/(r - 1) times that where it is more, as if errors fell with the size of the cells and no faster (Roache, J. Fluids
-- Eng. 116, 1994, with order 1).
CREATE TEMP TABLE parts AS
SELECT a.number, a.poisson, a.title, a.solver, a.max_volume_drift AS value,
  iif(a.kind = b.kind AND a.nodes > b.nodes, max(1, 1 / (pow(1.0 * a.nodes / b.nodes, 1.0 / 3) - 1)), 1) *
    abs(a.max_volume_drift - b.max_volume_drift) AS unsure
FROM runs a LEFT JOIN runs b ON b.poisson = a.poisson AND b.title = a.title AND b.solver = a.solver AND b.ended
  AND b.scene = (SELECT scene FROM finest WHERE place = 2)
WHERE a.ended AND a.scene = (SELECT scene FROM finest WHERE place = 1);

-- to drift.csv
SELECT scene, energy, r.poisson AS poisson, constants, tets, status, max_volume_drift, final_volume_drift,
  rest_volume_ratio, rest_volume_ratio_theory, J_min, max_inverted, newton_per_step, linear_per_newton, wall_s,
  failure_t AS failed_at, r.solver AS solver, first_inverted_step, J_bound, first_bound_step, distance_from_rest,
  stressed_rest AS stressed_rest_J, element, nodes,
  scene IS (SELECT scene FROM finest WHERE place = 1) AS finest, iif(ended, max_volume_drift - value, NULL) AS mesh_part,
  unsure AS mesh_unsure
FROM runs r LEFT JOIN parts p ON p.poisson = r.poisson AND p.title = r.title AND p.solver = r.solver ORDER BY r.number;

-- to stdout
SELECT '' UNION ALL SELECT printf('%-*s %-8s %6s %-8s %-13s %9s %9s %8s %8s %8s %5s %8s %8s', max(20, max(length(scene))),
  'scene', 'energy', 'poisson', 'solver', 'status', 'max', 'final', 'rest', 'theory', 'J_min', 'inv', 'shape', 'wall')
FROM runs;
-- to stdout
SELECT printf('%-*s %-8s %6s %-8s %-13s %9s %9s %8s %8s %8s %5s %8s %8s', max(20, max(length(scene))), '', '', '', '', '',
  'drift %', 'drift %', 'volume', 'volume', '', '', 'off %', 's') FROM runs;
-- to stdout
SELECT printf('%-*s %-8s %6s %-8s %-13s', (SELECT max(20, max(length(scene))) FROM runs), scene, title,
  number('%g', poisson), solver, status) || cell('%.3f', 9, 100 * max_volume_drift) ||
  cell('%.3f', 9, 100 * final_volume_drift) || cell('%.5f', 8, rest_volume_ratio) ||
  cell('%.5f', 8, rest_volume_ratio_theory) || cell('%.3f', 8, J_min) || printf(' %5d', max_inverted) ||
  cell('%.2f', 8, 100 * distance_from_rest) || cell('%.2f', 8, wall_s)
FROM runs ORDER BY number;
-- to stdout
SELECT 'max/final drift: of the body''s volume, over the run and at its end; rest volume: of its equilibrium with
the pins alone, theory: of a free body; J_min: least det F at a point of quadrature; inv: most inverted
tets (J_min <= 0) at a time; shape off: largest distance from the rest shape at the end, of the body''s
length.';
-- to stdout
SELECT printf('stressed rest: %d run%s ended at rest in a stressed state that no load holds (stressed_rest_J in drift.csv).',
  count, iif(count = 1, '', 's')) FROM (SELECT count(*) AS count FROM runs WHERE stressed_rest > 0) WHERE count;

-- to verdict.txt
SELECT '' UNION ALL
SELECT title || coalesce((SELECT printf(', the finest of %d; ±: estimated error, by comparison with %s',
  (SELECT count(*) FROM scenes), title) FROM finest WHERE place = 2), '') FROM best;

-- The variants that ended there, by their figures, least first, each apart from the one before or not; `leaps`
-- counts those that are.
CREATE TEMP TABLE ranks AS
SELECT *, sum(apart) OVER (PARTITION BY poisson ORDER BY place) AS leaps FROM (
  SELECT *, coalesce(value - lag(value) OVER w > unsure + lag(unsure) OVER w, 0) AS apart, row_number() OVER w AS place
  FROM parts WHERE solver = (SELECT solver FROM runs WHERE number = (SELECT min(number) FROM runs))
  WINDOW w AS (PARTITION BY poisson ORDER BY value, number));
CREATE TEMP VIEW pairs AS
SELECT a.poisson AS poisson, a.place AS low_place, b.place AS high_place, a.title AS low, b.title AS high,
  a.value AS low_value, b.value AS high_value, b.leaps > a.leaps AS chained,
  coalesce(b.value - a.value > a.unsure + b.unsure, 0) AS apart
FROM ranks a JOIN ranks b ON a.poisson = b.poisson AND a.place < b.place;

-- How each case ended, after the release.
CREATE TEMP VIEW inversions AS
SELECT number, CASE
  WHEN first_inverted_step IS NOT NULL
  THEN printf('; tets are inverted (J <= 0) from step %d, %d at most', first_inverted_step, max_inverted)
  WHEN first_bound_step IS NOT NULL
  THEN printf('; no tet is inverted (the lower bound of J near corners is <= 0 from step %d, %s at the least)',
    first_bound_step, number('%.2g', J_bound))
  ELSE '' END AS inversion
FROM runs;
CREATE TEMP VIEW ends AS
SELECT *, printf('    %-8s %-8s ', title, solver) || CASE
  WHEN NOT tets THEN status || iif(message <> '', ': ' || message, '')
  WHEN NOT ended THEN printf('ends at t = %s s, step %d: %s', number('%.4g', failure_t), steps + 1, status) || inversion
  ELSE iif(back,
    printf('comes back to its rest shape (off by %s %% of its length, volume by %s %%)',
      number('%.2g', 100 * distance_from_rest), number('%.1g', 100 * abs(final_volume_drift))),
    printf('ends at %s of its volume, %s %% of its length from the rest shape', number('%.4g', 1 + final_volume_drift),
      number('%.3g', 100 * distance_from_rest))) ||
    iif(abs(rest_volume_ratio - 1) > 1e-3,
      '; its own rest volume is ' || iif(abs(rest_volume_ratio) < 1e-6, '0', number('%.4g', rest_volume_ratio)) ||
      iif(rest_volume_ratio_theory IS NULL, ' (a free body has none: it collapses)',
        printf(' (free body: %s)', number('%.4g', rest_volume_ratio_theory))), '') ||
    inversion || iif(final_inverted, printf(', %d at the end', final_inverted), '')
  END || '.' AS words
FROM runs JOIN inversions USING (number);

-- The order at each ratio, how much of it stands, which others beyond a < of it are not apart, and the ends.
CREATE TEMP VIEW poissons AS SELECT poisson, number('%g', poisson) AS ratio, min(number) AS first FROM runs GROUP BY poisson;
-- to verdict.txt
SELECT text FROM (
  SELECT p.first AS at, 0 AS kind, 0 AS number, printf('  poisson %s: largest change of volume%s.', ratio,
    coalesce((SELECT ' ' || group_concat(printf('%s %s%s %%', title, number('%.2f', 100 * value),
      coalesce(' ± ' || iif(unsure IS NULL, NULL, number('%.2g', 100 * unsure)), '')), ', ')
      FROM (SELECT * FROM ranks r WHERE r.poisson = p.poisson ORDER BY place)), ': none of the runs ended')) AS text
  FROM poissons p
  UNION ALL
  SELECT p.first, 1, 0, '    confirmed order: ' ||
    (SELECT group_concat(iif(place = 1, '', iif(apart, '< ', '~ ')) || title, ' ')
      FROM (SELECT * FROM ranks r WHERE r.poisson = p.poisson ORDER BY place)) ||
    coalesce((SELECT group_concat('; ' || low || ' ~ ' || high, '')
      FROM (SELECT * FROM pairs q WHERE q.poisson = p.poisson AND high_place > low_place + 1 AND chained AND NOT apart
            ORDER BY low_place, high_place)), '') || ' (~: closer than the meshes can tell).'
  FROM poissons p WHERE EXISTS (SELECT 1 FROM ranks r WHERE r.poisson = p.poisson AND unsure IS NOT NULL)
  UNION ALL
  SELECT p.first, 2, number, words FROM ends JOIN poissons p USING (poisson) WHERE scene = (SELECT scene FROM best))
ORDER BY at, kind, number;

-- to verdict.txt
SELECT '
One mesh and one element: the error of the mesh in these figures is not known. ' ||
  'A second mesh, --refine 0,1 or --elements tet4,tet10-mean shows it.'
WHERE (SELECT count(*) FROM finest) < 2;

-- The figures of all scenes, each with what it is off the finest one.
-- to verdict.txt
SELECT printf('%sError of the mesh (largest change of volume, in %%, %s solver; in brackets the difference from the finest):',
  char(10), (SELECT solver FROM runs ORDER BY number LIMIT 1)) WHERE (SELECT count(*) FROM finest) > 1;
-- to verdict.txt
SELECT printf('  poisson %-5s %-8s %s', ratio, r.title, coalesce(number('%.3f', 100 * value), '-')) || (
  SELECT group_concat(printf('; %s %s%s', title, iif(ended, number('%.3f', 100 * drift), '-'),
    coalesce(iif(ended, ' (' || number('%+.3f', 100 * (drift - p.value)) || ')', ''), '')), '')
  FROM (SELECT s.title, o.ended, o.max_volume_drift AS drift FROM scenes s LEFT JOIN runs o ON o.scene = s.scene
        AND o.poisson = r.poisson AND o.title = r.title AND o.solver = r.solver
        WHERE s.scene <> (SELECT scene FROM best) ORDER BY s.first))
FROM runs r JOIN poissons USING (poisson) LEFT JOIN parts p ON p.number = r.number
WHERE r.scene = (SELECT scene FROM best) AND r.solver = (SELECT solver FROM runs ORDER BY number LIMIT 1)
  AND (SELECT count(*) FROM finest) > 1 ORDER BY r.number;

-- Orders that stand on the finest scenes and are the other way round on another.
CREATE TEMP TABLE turned AS
SELECT s.first, p.first AS at, q.low_place, q.high_place,
  printf('On %s at poisson %s %s changes more than %s (%s and %s %%), on the finest less (%s and %s %%): an error of the mesh.',
    s.title, p.ratio, low, high, number('%.2f', 100 * a.max_volume_drift), number('%.2f', 100 * b.max_volume_drift),
    number('%.2f', 100 * low_value), number('%.2f', 100 * high_value)) AS text
FROM pairs q JOIN poissons p USING (poisson) JOIN scenes s ON s.scene <> (SELECT scene FROM best)
JOIN runs a ON a.scene = s.scene AND a.poisson = q.poisson AND a.title = low AND a.ended
JOIN runs b ON b.scene = s.scene AND b.poisson = q.poisson AND b.title = high AND b.ended AND b.solver = a.solver
WHERE apart AND a.solver = (SELECT solver FROM ranks) AND a.max_volume_drift > b.max_volume_drift;
-- to verdict.txt
SELECT '' WHERE (SELECT count(*) FROM finest) > 1;
-- to verdict.txt
SELECT text FROM turned ORDER BY first, at, low_place, high_place;
-- to verdict.txt
SELECT 'No other mesh or element reverses an order that the verdict claims.'
WHERE (SELECT count(*) FROM finest) > 1 AND NOT EXISTS (SELECT 1 FROM turned);
-- to verdict.txt
SELECT iif(row_number() OVER (PARTITION BY c.scene, c.poisson ORDER BY c.number) = 1,
  printf('  poisson %s, on %s it ends otherwise:%s', ratio, c.scene, char(10)), '') || c.words
FROM ends c JOIN poissons USING (poisson) JOIN scenes s ON s.scene = c.scene JOIN runs o ON o.scene = (SELECT scene FROM best)
  AND o.poisson = c.poisson AND o.title = c.title AND o.solver = c.solver
WHERE c.scene <> o.scene AND NOT (c.code = o.code AND c.back = o.back) AND (SELECT count(*) FROM finest) > 1
ORDER BY s.first, c.number;

-- Two locked meshes differ by less than either is off.
-- to verdict.txt
SELECT printf('Four-node tets lock at poisson %s: ' ||
  'their error exceeds the difference of two meshes. --elements tet4,tet10-mean shows it.',
  (SELECT number('%g', max(poisson)) FROM runs)) FROM best WHERE tets AND kind = 1 AND (SELECT max(poisson) FROM runs) >= 0.47;
-- to verdict.txt
SELECT scene || ' has a load at single nodes: its dent deepens with every refinement, ' ||
  'and figures do not converge; let it act on an area or a radius.'
FROM scenes WHERE point_load ORDER BY first LIMIT 1;
