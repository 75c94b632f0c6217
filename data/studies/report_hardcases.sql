-- report_hardcases.sql: what a report has of a folder of `flesh hardcases` (drivers/report/studies.c).

CREATE TABLE hardcases (number INTEGER PRIMARY KEY, "case", folder, energy, constants, poisson REAL, solver, element, seed REAL,
  outcome);
-- to tables
SELECT 'hardcases.csv', 0;
-- Cases with what is not by default; what recovered leaves no mesh.
CREATE VIEW cases AS
SELECT *, printf('%.80s: %.20s%s, Poisson''s ratio %s%s%s%s', "case", energy, CASE constants WHEN 'matched' THEN ''
    WHEN 'as_e' THEN ' with the constants of E' ELSE printf(' with %.20s constants', constants) END, number('%g', poisson),
    iif(solver = 'default', '', printf(', solver %.40s', solver)), iif(element = 'tet4', '', printf(', %.20s', element)),
    iif(seed > 1, printf(', seed %d', seed), '')) AS name,
  outcome IS NOT 'recovered' AND is_there(folder || '/body.mesh') AND is_there(folder || '/out/state.txt') AS has_mesh
FROM hardcases;
CREATE VIEW others AS SELECT * FROM cases WHERE outcome NOT IN ('recovered', 'untangled', 'equilibrium');

-- to verdict
SELECT printf('%d of %d cases are back at rest, or in the equilibrium that was to be kept%s%s.', count(*) - others, count(*),
    coalesce((SELECT printf('; not so %s (%.60s)', name, outcome) FROM others ORDER BY number LIMIT 1), ''),
    iif(others > 1, printf(' and %d more', others - 1), ''))
FROM hardcases, (SELECT count(*) AS others FROM others) GROUP BY others;
-- to texts
SELECT 'verdict.txt';
-- to grids
SELECT json_object('title', 'What became of the cases', 'table', number, 'row', 'case',
  'columns', json_array('energy', 'constants', 'poisson', 'step', 'solver', 'element'), 'value', 'outcome') FROM tables;
-- to plots
SELECT 'Work of the cases', 'newton', 'cpu_s', 'xy', 0, number, 'outcome' FROM tables;
-- to tables
SELECT 'profiles.csv', 0 WHERE is_there('profiles.csv') AND EXISTS (SELECT 1 FROM tables);
-- to runs
SELECT folder || '/out', name, 1 FROM cases WHERE has_mesh ORDER BY number LIMIT 6;
-- to notes
SELECT iif(failed, printf('Of %d cases that did not recover %d are shown.', failed, shown),
    'Cases that recover leave no mesh behind: there is nothing to be seen in three dimensions. `flesh run` repeats each from ' ||
    'the scene in its folder.')
FROM (SELECT total(outcome IS NOT 'recovered') AS failed, min(6, total(has_mesh)) AS shown FROM cases), tables
WHERE name = 'hardcases.csv' AND (NOT failed OR shown < failed);
-- to sources
SELECT 'provenance of the first case', folder || '/out/result.json', '' FROM hardcases WHERE number = 0;
