-- report_drift.sql: what a report has of a folder of `flesh drift` (drivers/report/studies.c).

CREATE TABLE drift (number INTEGER PRIMARY KEY, scene, energy, constants, solver, element, poisson REAL, status,
  max_volume_drift REAL);
-- to tables
SELECT 'drift.csv', 1;

-- Pictures and words are of the last scene, at the greatest ratio, with its own solver.
CREATE VIEW chosen AS
SELECT *, abs(max_volume_drift) AS drift, printf('%.20s%s', energy, CASE constants WHEN 'matched' THEN ''
    WHEN 'as_e' THEN ' with the constants of E' ELSE printf(' with %.20s constants', constants) END) AS name,
  printf('runs/%s_%s_%s_%s_%s', scene, energy, constants, number('%g', poisson), solver) AS folder
FROM drift d, (SELECT scene AS last_scene, element AS last_element, max(number) FROM drift)
WHERE scene IS last_scene AND element IS last_element AND poisson = (SELECT max(poisson) FROM drift)
  AND solver IS (SELECT solver FROM drift WHERE number = 0);
CREATE VIEW last AS
SELECT printf('%.100s', scene) AS scene, (SELECT number('%g', max(poisson)) FROM drift) AS ratio,
  (SELECT printf('%.50s', solver) FROM drift WHERE number = 0) AS solver
FROM drift WHERE number = (SELECT max(number) FROM drift);

-- to verdict
SELECT printf('%s at Poisson''s ratio %s: ', scene, ratio) || CASE WHEN best IS NULL THEN 'no run has a volume to be compared.'
    WHEN best = worst THEN printf('%s changes its volume by at most %s %%.', best, number('%.2g', 100 * most))
    ELSE printf('%s keeps its volume best, within %s %%, and %s worst, within %s %%.', best, number('%.2g', 100 * least), worst,
      number('%.2g', 100 * most)) END ||
  (SELECT iif(total(status IS NOT 'complete'), printf(' %d of %d runs did not complete.',
    total(status IS NOT 'complete'), count(*)), '') FROM drift)
FROM last, (SELECT (SELECT name FROM chosen WHERE drift IS NOT NULL ORDER BY drift, number LIMIT 1) AS best,
  (SELECT name FROM chosen WHERE drift IS NOT NULL ORDER BY drift DESC, number LIMIT 1) AS worst,
  (SELECT min(drift) FROM chosen) AS least, (SELECT max(drift) FROM chosen) AS most);
-- to texts
SELECT 'verdict.txt';
-- to failure
SELECT 'drift.csv: it has no rows: the comparison has not begun' FROM tables WHERE NOT EXISTS (SELECT 1 FROM drift);

-- to plots
SELECT printf('Volume against time: %s, Poisson''s ratio %s, %s', scene, ratio, solver), 't', 'volume_ratio', '', 1, -1 FROM last;
-- to histories
SELECT folder, 'history.csv', name, iif(constants = 'as_e', '#8B4513', colour_of(energy)) FROM chosen ORDER BY number;
-- to plots
SELECT 'Largest change of volume, ' || solver, 'poisson', 'max_volume_drift', 'y', 0, number, 'energy', 'solver', solver
FROM last, tables;
-- to grids
SELECT json_object('title', 'How the runs ended', 'table', number, 'row', 'poisson',
  'columns', json_array('scene', 'energy', 'constants', 'solver'), 'value', 'status') FROM tables;
-- to runs
SELECT folder, printf('%s, %.100s', name, scene), 1 FROM chosen ORDER BY number;
-- to sources
SELECT 'scene of the first run shown', folder || '/scene.yaml', NULL FROM chosen ORDER BY number LIMIT 1;
-- to sources
SELECT 'provenance of that run', folder || '/result.json', '' FROM chosen ORDER BY number LIMIT 1;
