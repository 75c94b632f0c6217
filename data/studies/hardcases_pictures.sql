-- hardcases_pictures.sql: the bodies that `flesh hardcases` draws (drivers/study/bodies.h), from the table `runs` of
-- hardcases.sql: frames_GROUP.png with start, first step, a tenth of the time and end of the group's cases, of one setting;
-- sheet_SETTING.png with the ends of all cases (rows) on all meshes (columns), and above them the meshes at rest.

CREATE TEMP TABLE settings AS
SELECT setting, min(number) AS number, energy, constants, solver, element, mesh, sheet, setting_poisson AS nu, setting_step AS h
FROM runs GROUP BY setting;
-- The first energy and solver at the largest Poisson's ratio up to 0.49, and cases with a ratio of their own.
CREATE TEMP TABLE strips AS
SELECT runs.*, row_number() OVER (PARTITION BY grp ORDER BY number) - 1 AS strip, count(*) OVER (PARTITION BY grp) AS strips
FROM runs JOIN (SELECT o.setting AS chosen, o.energy, o.solver, o.element
    FROM settings o JOIN (SELECT * FROM settings ORDER BY setting LIMIT 1) f USING (energy, constants, solver, element, h)
    WHERE o.setting = f.setting OR o.nu <= 0.49 AND o.nu > f.nu ORDER BY o.nu DESC, o.setting LIMIT 1)
  USING (energy, solver, element)
WHERE seed = 1 AND (setting = chosen OR first_of_own);
CREATE TEMP TABLE sheets AS
SELECT *, row_number() OVER (PARTITION BY sheet ORDER BY setting) - 1 AS at, count(*) OVER (PARTITION BY sheet) AS columns
FROM settings;
CREATE TEMP TABLE sheet_rows AS
SELECT name, row_number() OVER (ORDER BY min(number)) AS line FROM runs GROUP BY name;

CREATE TEMP TABLE pictures AS
SELECT DISTINCT 'frames_' || grp AS picture, iif(strips > 1, 8, 4) AS columns, 190 AS width, 130 AS height, 1 AS edges,
  0.5 AS low, 1.5 AS high, 1.5 AS view, 1 AS shows_scale FROM strips
UNION ALL
SELECT DISTINCT 'sheet_' || replace(sheet, ' ', '_'), columns, 112, 70, 0, 0.5, 1.5, 1.2, 0 FROM sheets WHERE columns > 1;
CREATE TEMP TABLE panels AS
WITH frames (frame, word, file, fallback) AS (VALUES (0, 'start', 'start.txt', NULL), (1, 'first step', 'frame_first.txt', NULL),
  (2, 'a tenth', 'frame_early.txt', NULL), (3, 'end', 'release/state.txt', 'out/state.txt'))
SELECT 'frames_' || grp AS picture, 4 * strip + frame AS position, number, iif(frame, '', name || ': ') || word AS title,
  iif(frame = 3, outcome, '') AS subtitle, held, folder || '/' || file AS file, folder || '/' || fallback AS fallback
FROM strips, frames
UNION ALL SELECT 'sheet_' || replace(sheet, ' ', '_'), at, number, iif(mesh = '', 'at rest', mesh), '', 0, NULL, NULL FROM sheets
-- A run that is back at rest keeps no state.
UNION ALL SELECT 'sheet_' || replace(s.sheet, ' ', '_'), line * columns + at, iif(outcome = 'not run', NULL, r.number), l.name,
  iif(outcome IN ('not run', 'recovered'), '', coalesce(outcome, '')), held,
  iif(outcome = 'recovered', NULL, folder || '/release/state.txt'), folder || '/out/state.txt'
FROM sheets s JOIN sheet_rows l LEFT JOIN runs r ON r.setting = s.setting AND r.name = l.name AND r.seed = 1;
