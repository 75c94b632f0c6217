-- report_sweep.sql: what a report has of the database of a sweep (drivers/report/studies.c): it is the database that is asked.

-- to verdict
SELECT printf('%d case%s: %s.', sum(number), iif(sum(number) = 1, '', 's'),
  group_concat(printf('%d %.40s', number, status), ', '))
FROM (SELECT status, count(*) AS number FROM cases GROUP BY status ORDER BY 2 DESC);

-- to results
SELECT 'Results', * FROM results ORDER BY id;
CREATE TEMP TABLE cells AS
SELECT c.value ->> 'name' AS name, v.key AS row, v.value AS value, v.type IN ('integer', 'real') AS is_number
FROM tables, json_each(columns) c, json_each(c.value, '$.values') v;
CREATE TEMP VIEW numeric AS SELECT DISTINCT name FROM cells WHERE is_number;

-- A figure over the first axis of numbers, a series for each value of another axis.
CREATE TEMP VIEW drawn AS
SELECT x, y, (SELECT name FROM parameters WHERE name IN (SELECT name FROM cells) AND name IS NOT x
  ORDER BY number LIMIT 1) AS series
FROM (SELECT (SELECT name FROM parameters WHERE name IN numeric ORDER BY number LIMIT 1) AS x,
  (SELECT name FROM (SELECT 0 AS kind, number, name FROM derived UNION ALL VALUES (1, 0, 'max_volume_drift'),
    (1, 1, 'error_position_rms'), (1, 2, 'newton'), (1, 3, 'seconds'))
   WHERE name IN numeric ORDER BY kind, number LIMIT 1) AS y);

-- The least and the greatest of the figure, and whose they are.
-- to verdict
WITH found AS (SELECT c.row AS row, c.value AS value, i.value AS id, count(*) OVER () AS count
  FROM drawn JOIN cells c ON c.name = y AND c.is_number JOIN cells i ON i.name = 'id' AND i.row = c.row)
SELECT printf('%s is from %s (case %d) to %s (case %d).', y, number('%.4g', a.value), a.id, number('%.4g', b.value), b.id)
FROM drawn, (SELECT * FROM found ORDER BY value, row LIMIT 1) a, (SELECT * FROM found ORDER BY value DESC, row LIMIT 1) b
WHERE a.count > 1;
-- to plots
SELECT 'Cases', coalesce(x, 'id'), y, '', 1, 0, series FROM drawn WHERE y IS NOT NULL;

-- to folded
SELECT 'Rows of the cases', * FROM rows LIMIT 5000;
-- to given
SELECT 'the sweep''s spec', value, 0 FROM meta WHERE key = 'spec';
-- to given
SELECT 'provenance', program, 1 FROM workers ORDER BY started LIMIT 1;
-- to notes
SELECT 'A sweep''s database holds no motion; `keep: true` in its spec leaves the cases'' folders, which a report can be given ' ||
  'beside it.';
