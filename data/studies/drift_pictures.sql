-- drift_pictures.sql: what `flesh drift` draws: the volume against time, a plot for each scene and Poisson's ratio, and the
-- bodies, from the tables of drift.sql and the facts {folder, colour, history: [[t, volume over that of the mesh], ...]}.

CREATE TEMP TABLE drawn AS
SELECT r.*, printf('%s_%s', r.scene, number('%g', r.poisson)) AS picture, data ->> 'folder' AS folder,
  data ->> 'colour' AS colour, c.exit_code, c.worst_t, c.worst_drift, c.event_t, c.event_drift
FROM runs r JOIN facts USING (number) JOIN wanted USING (number) JOIN results c USING (id);

-- A run that the scene refuses has no line, nor has one without a history.
CREATE TEMP TABLE lines AS
SELECT picture, row_number() OVER (PARTITION BY picture ORDER BY number) - 1 AS line, number, ended AS kind
FROM drawn JOIN facts USING (number) WHERE exit_code IS NOT 2 AND data -> 'history' IS NOT NULL;
CREATE TEMP TABLE curves (picture, line INTEGER, point INTEGER, x, y, PRIMARY KEY (picture, line, point)) WITHOUT ROWID;
INSERT INTO curves SELECT picture, line, key, value ->> 0, value ->> 1
FROM lines JOIN facts USING (number), json_each(data, '$.history');
-- The runs that reach the end; one that blows up leaves the picture instead of flattening the others.
CREATE TEMP TABLE ranges AS
SELECT picture, low - 0.06 * (high - low) AS low, high + 0.06 * (high - low) AS high, 1e-3 * 1.12 * (high - low) AS near FROM (
  SELECT picture, min(0.98, coalesce(min(iif(kind, y, NULL)), 1)) AS low, max(1.02, coalesce(max(iif(kind, y, NULL)), 1)) AS high
  FROM lines LEFT JOIN curves USING (picture, line) GROUP BY picture);

-- The last visible point of a run that stops: on its line, or where it crosses the picture's edge.
CREATE TEMP TABLE stops AS
SELECT picture, line, edge, coalesce(before_x + iif(edge = y, 1, (edge - before_y) / (y - before_y)) * (x - before_x), x) AS x
FROM (
  SELECT c.*, min(max(c.y, low), high) AS edge, b.x AS before_x, b.y AS before_y
  FROM (SELECT picture, line, coalesce(min(iif(y BETWEEN low AND high, NULL, point)), max(point)) AS point
        FROM lines JOIN curves USING (picture, line) JOIN ranges USING (picture) WHERE NOT kind GROUP BY picture, line)
  JOIN curves c USING (picture, line, point) JOIN ranges USING (picture)
  LEFT JOIN curves b ON b.picture = c.picture AND b.line = c.line AND b.point = c.point - 1)
WHERE y IS NOT NULL;

CREATE TEMP TABLE same AS SELECT * FROM first_lines;
CREATE TEMP TABLE titles AS
SELECT picture, first AS line, group_concat(title || ', ' || solver, '; ') AS names
FROM (SELECT * FROM same JOIN lines USING (picture, line) JOIN drawn USING (picture, number) ORDER BY line) GROUP BY 1, 2;
-- to each.gp
SELECT 'volume_' || picture, plot('volume_' || picture, 960, 600, printf('%s: volume against time, Poisson''s ratio %s', scene,
    number('%g', poisson)), 'time t [s]', 'volume / volume of the mesh') ||
  printf('set yrange [%s:%s]
plot ', number('%.6g', low), number('%.6g', high)) || group_concat(
    printf('%s using "t":"volume_ratio" with lines lw 2%s lc rgb ''%s'' title %s', quoted_file(folder, '/history.csv'),
      iif(solver = 'plain', ' dt 2', ''), colour, quoted(names || iif(kind, '', printf(' (stops at %s s)', number('%.3g',
        failure_t))))) || iif(edge IS NULL, '', printf(', \
     ''+'' every ::::0 using (%s):(%s) with points pt 2 ps 1.8 lw 3 lc rgb ''%s'' notitle', number('%.17g', x),
      number('%.17g', edge), colour)), ', \
     ')
FROM (SELECT * FROM lines JOIN titles USING (picture, line) JOIN drawn USING (picture, number) JOIN ranges USING (picture)
      LEFT JOIN stops USING (picture, line) ORDER BY number) GROUP BY picture;

-- Bodies: all energies side by side at each ratio, before the scene's last event (the release) above and at the end below;
-- and the frame of the largest change of volume of each energy, at every ratio with every solver. All of a scene have a body.
CREATE TEMP TABLE panels AS
WITH solvers AS (SELECT solver, min(number) AS solver_at FROM runs GROUP BY solver),
  frames (frame, file) AS (VALUES (0, 'worst_state.txt'), (1, 'event_state.txt'), (2, 'state.txt'))
SELECT iif(frame, printf('shapes_%s_%s', picture, solver), printf('worst_%s_%s_%s', scene, energy, constants)) AS picture,
  iif(frame, frame, solver_at) AS at, row_number() OVER (ORDER BY iif(frame, frame, solver_at), number) AS position,
  scenes.first AS number, NULL AS held, folder || '/' || file AS file, NULL AS fallback,
  printf('%s, ν = %s, %s', drawn.title, number('%g', poisson), solver) AS title,
  CASE WHEN frame < 2 THEN printf('t = %s s: volume %s %%%s', number('%.3g', iif(frame, event_t, worst_t)),
      number('%+.2f', 100 * iif(frame, event_drift, worst_drift)), iif(ended, '', '; later ' || status))
    WHEN ended THEN printf('at the end: volume %s %%', number('%+.3f', 100 * final_volume_drift))
    ELSE printf('%s at t = %s s', status, number('%.3g', failure_t)) END AS subtitle
FROM drawn JOIN solvers USING (solver) JOIN scenes USING (scene), frames;
CREATE TEMP TABLE pictures AS
SELECT picture, count(*) / count(DISTINCT at) AS columns, 300 AS width, 0 AS height, 0 AS edges, NULL AS low, NULL AS high,
  NULL AS view, 0 AS shows_scale FROM panels GROUP BY picture;
