-- report_accuracy.sql: what a report has of a folder of `flesh accuracy` (drivers/report/studies.c).

CREATE TABLE accuracy (number INTEGER PRIMARY KEY, method, setting, price, cpu_s REAL, error_over_motion REAL);
-- to tables
SELECT 'accuracy.csv', 1;
-- The run of least CPU time within an error of the motion.
CREATE VIEW within AS
SELECT share, method, setting, cpu_s, row_number() OVER (ORDER BY share, cpu_s, number) AS place
FROM accuracy JOIN (SELECT 0.01 AS share UNION ALL SELECT 0.1) ON price = 'work' AND error_over_motion <= share;
-- to verdict
SELECT coalesce((SELECT printf('With an error of at most %s %% of the motion, %s (%s) takes the least CPU time, %s s.',
    number('%g', 100 * share), method, setting, number('%.2g', cpu_s)) FROM within WHERE place = 1),
  'No run has an error of at most 10 % of the motion.') WHERE EXISTS (SELECT 1 FROM accuracy);
-- to texts
SELECT 'verdict.txt';
-- to tables
SELECT 'orders.csv', 1;
-- to plots
SELECT column1, column2, 'error_position_rms', 'xy', 1, number, 'method', 'price', 'work' FROM tables, (VALUES
  ('Error against CPU time', 'cpu_s'), ('Error against residual evaluations', 'residual_evaluations'),
  ('Error against step or tolerance', 'value')) WHERE name = 'accuracy.csv';
-- to texts
SELECT 'mesh.txt' WHERE is_there('mesh.csv');
-- to tables
SELECT 'mesh.csv', 1 WHERE is_there('mesh.csv');
-- to plots
SELECT 'Error of the mesh against CPU time', 'cpu_s', 'error_over_motion', 'xy', 1, number, 'element' FROM tables
WHERE name = 'mesh.csv';
-- to sources
SELECT 'the reference', 'accuracy.json', 'reference';
-- to sources
SELECT 'provenance', 'accuracy.json', 'program';
-- to notes
SELECT 'The comparison keeps no motion of its runs: the commands of the verdict repeat them.';
