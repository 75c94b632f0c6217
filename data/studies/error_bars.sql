-- error_bars.sql: bars by differences from companions, as data/results/error_bars.md says. `judges` (aspect, name, count,
-- factor, better, coarser, doubled, adds, data) has how a run is judged in each aspect, by so many companions.

-- Rows by their times; an equilibrium may be at the time of the start.
CREATE TEMP TABLE times AS
SELECT source, tab, row, number AS t, row_number() OVER (PARTITION BY id, number ORDER BY row) AS nth
FROM cells JOIN headers USING (id) WHERE "column" = 0;
CREATE INDEX times_by_nth ON times (source, tab, nth, t);
CREATE INDEX times_by_t ON times (source, tab, t, row);

-- The columns that are compared: the run's with those of companions, by their numbers; of two with a coarser mesh, what
-- another `element` changes there; and of the run's mesh and a coarser one what that changes with `twice` the step.
CREATE TEMP TABLE pairs (own INT, tab INT, of_place INT, of_force INT, aspect INT, number, first INT, first_source INT, second INT,
  second_source INT);
INSERT INTO pairs
SELECT q.id, q.tab, of_place, of_force, o.aspect, o.number, q.id, 0, o.id, o.source
FROM quantities q JOIN others o ON o.own = q.id
UNION ALL
SELECT q.id, q.tab, of_place, of_force, 0, 'element', a.id, a.source, b.id, b.source
FROM quantities q JOIN judges j ON j.aspect = 0 AND coarser JOIN others a ON a.own = q.id AND a.aspect = 0 AND a.number = 0
JOIN others b ON b.own = q.id AND b.aspect = 0 AND b.number = 1 + doubled
UNION ALL
SELECT q.id, q.tab, of_place, of_force, 0, 'twice', a.id, a.source, b.id, b.source
FROM quantities q JOIN judges j ON j.aspect = 0 AND doubled JOIN others a ON a.own = q.id AND
  a.aspect = (doubled = 1) AND a.number = 1
JOIN others b ON b.own = q.id AND b.aspect = 0 AND b.number = doubled;

-- Rows at the times of both.
CREATE TEMP TABLE meetings AS
SELECT DISTINCT p.first_source, p.second_source, p.tab, x.row AS first_row, y.row AS second_row
FROM (SELECT DISTINCT first_source, second_source, tab FROM pairs) p
JOIN times x ON x.source = p.first_source AND x.tab = p.tab
JOIN times y ON y.source = p.second_source AND y.tab = p.tab AND y.nth = x.nth AND
  y.t BETWEEN x.t - 1e-9 * abs(x.t) AND x.t + 1e-9 * abs(x.t);
CREATE INDEX meetings_by_row ON meetings (first_source, second_source, tab, first_row);

-- The largest difference up to each row, and up to three rows later: what is off later than the companion shows it was off a
-- little before. Mean places of nodes at rest depend on the mesh; how they have moved counts.
CREATE TEMP TABLE differences AS
SELECT own, aspect, number, row, coalesce(max(abs(value - x)) OVER (PARTITION BY own, aspect, number ORDER BY row
  ROWS BETWEEN UNBOUNDED PRECEDING AND 3 FOLLOWING), 0) AS most, value
FROM (SELECT p.*, a.row, iif(of_force AND NOT a.row, NULL, a.number) AS x,
    b.number - iif(of_place, coalesce(first_value(iif(a.row, NULL, b.number - a.number)) OVER (PARTITION BY p.own, p.aspect,
      p.number ORDER BY a.row), 0), 0) AS value
  FROM pairs p JOIN cells a ON a.id = first
  LEFT JOIN meetings m ON m.first_source = p.first_source AND m.second_source = p.second_source AND m.tab = p.tab AND
    first_row = a.row
  LEFT JOIN cells b ON b.id = second AND b.row = second_row);
CREATE INDEX differences_by_row ON differences (own, aspect, number, row);

-- Differences may be small by chance: a component's bar is at least a share of the widest among its vector's, and one from a
-- coarser mesh what that changes with twice the step, as waves that steps do not follow come out alike on two meshes, and a
-- share of what another element changes there, which stresses follow less. Errors of forces from a coarser mesh are so many
-- times larger beside the differences. In equilibria (`adds`) the bar is the sum of the difference and both shares, which are
-- seldom small at once, of forces too. On the mesh of four-node tets that are judged, moments of reactions err as much more.
-- Strains at points of ten-node tets err within a tet, as what smoothing changes them by shows, more than between meshes: their
-- bars are of that and half the difference.
CREATE TEMP TABLE parts (judge, pattern, factor, of_vector, of_element);
INSERT INTO parts VALUES ('motion', '*.stress_*', 1.2, 0.5, 0), ('motion', '*.reaction_*', 1.5, 0.3, 0.3),
  ('same mesh', '*.reaction_moment_*', 1.5, 0.3, 0.3), ('smooth', '*.stress_*', 1, 0.5, 0),
  ('smooth', '*.stretch_*', 1.2, 0.5, 0), ('smooth', '*.J ?1]', 1.5, 0.5, 0), ('smooth', '*.energy ?J/m^3]', 1.5, 0.5, 0);
CREATE TEMP TABLE judged AS
SELECT id, kind, of_probe, rows, tab, aspect, coalesce(p.of_element, 0.3) AS of_element, coalesce(p.of_vector, 0.3) AS of_vector,
  iif(smooth, 0.62, m.factor) * coalesce(p.factor, 1) AS factor, adds AND NOT smooth AS sums, adds OR smooth AS adds,
  smooth
FROM (SELECT q.*, j.*, NOT aspect AND coarser AND smoothed IS NOT NULL AS smooth
  FROM quantities q JOIN judges j ON count AND iif(aspect, no_step_bar, no_mesh_bar) IS NULL) m
LEFT JOIN parts p ON header GLOB p.pattern AND p.judge = CASE WHEN smooth THEN 'smooth' WHEN coarser AND NOT adds THEN 'motion'
  WHEN NOT aspect AND EXISTS (SELECT * FROM same_mesh) THEN 'same mesh' END;

-- The last row of a companion that another is compared with, up to each of the run's.
CREATE TEMP TABLE latest AS
SELECT number, tab, row, coalesce((SELECT y.row FROM times y WHERE y.source = first_source AND y.tab = x.tab AND
  y.t <= x.t * (1 + 1e-9) ORDER BY y.t DESC, y.row DESC LIMIT 1), 0) AS other_row
FROM times x JOIN (SELECT DISTINCT number, first_source FROM pairs WHERE first_source) WHERE x.source = 0;
CREATE INDEX latest_by_row ON latest (tab, row);
CREATE TEMP TABLE bars AS
SELECT *, iif(sums, most + other, max(most, other)) AS bar
FROM (SELECT j.id, j.kind, of_probe, j.aspect, d.row, factor, of_vector, adds, sums,
    iif(smooth, s.most + 0.5 * d.most, d.most) AS most, coalesce(
  (SELECT max(iif(l.number = 'twice', 1, of_element) * e.most) FROM latest l JOIN differences e ON e.own = j.id AND
    e.aspect = j.aspect AND e.number = l.number AND e.row = other_row WHERE l.tab = j.tab AND l.row = d.row), 0) AS other
FROM judged j JOIN differences d ON d.own = j.id AND d.aspect = j.aspect AND d.number = 0
LEFT JOIN differences s ON s.own = j.id AND s.aspect = j.aspect AND s.number = 'smooth' AND s.row = d.row);

-- Twice the step must change a quantity by 1.6 times what half the step does, as an order of convergence would: 2 for the
-- first. Changes of less than a share of 1e-4 of its range are let pass, as solves leave them.
CREATE TEMP TABLE orders AS
SELECT kind, change, by_twice, change <= 1e-4 * (SELECT max(high - low) FROM (SELECT max(number) AS high, min(number) AS low
    FROM quantities k JOIN cells USING (id) WHERE k.kind = o.kind GROUP BY id)) OR by_twice / change >= 1.6 AS has_order
FROM (SELECT q.kind, max(b.bar) AS change, max(d.most) AS by_twice
  FROM quantities q JOIN bars b ON b.id = q.id AND b.aspect = 1 AND b.row = rows - 1
  JOIN differences d ON d.own = q.id AND d.aspect = 1 AND d.number = 1 AND d.row = b.row GROUP BY q.kind) o
WHERE (SELECT count > 1 FROM judges WHERE aspect = 1);
UPDATE quantities SET no_step_bar = (
  SELECT printf('not asymptotic: half the step changes %s by %s%s, and twice the step by %s times that only',
    iif((SELECT count(*) FROM quantities k WHERE k.kind = quantities.kind) > 1, 'these', 'it'), number('%.2g', change),
    iif(unit = '', '', ' ' || unit), number('%.2g', by_twice / change)) FROM orders WHERE orders.kind = quantities.kind)
WHERE id IN (SELECT id FROM bars WHERE aspect = 1) AND kind IN (SELECT kind FROM orders WHERE has_order IS NOT 1);
DELETE FROM bars WHERE aspect = 1 AND kind IN (SELECT kind FROM orders WHERE has_order IS NOT 1);

CREATE TEMP TABLE made AS
SELECT id, aspect, row, iif(adds, bar + widest, max(bar, widest)) * factor AS bar
FROM (SELECT *, of_vector * coalesce(max(iif(of_probe, iif(sums, most, bar), NULL)) OVER (PARTITION BY kind, aspect, row),
  iif(sums, most, bar)) AS widest FROM bars);
CREATE INDEX made_by_row ON made (id, aspect, row);

-- Further fields of the tables, with their header as row -1. Forces at the start have no bar, as it need not be in balance.
CREATE TEMP VIEW fields AS
SELECT tab, -1 AS row, id, aspect, iif(header LIKE '% [%', replace(header, ' [', '_error_' || j.name || ' ['), header || '_error_'
  || j.name) AS text
FROM quantities JOIN (SELECT DISTINCT id, aspect FROM made) USING (id) JOIN judges j USING (aspect)
UNION ALL SELECT tab, row, id, aspect, iif(of_force AND NOT row, '', number(bar)) FROM made JOIN quantities USING (id);
