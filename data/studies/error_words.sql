-- error_words.sql: what is told of error bars, in result.json and in words. `asked` (result) has that file as it is.

CREATE TEMP TABLE ends AS
SELECT q.id AS id, tab, name, unit, iif(unit = '', '', ' ' || unit) AS in_unit, c.number AS value, no_mesh_bar, no_step_bar,
  m.bar AS mesh, s.bar AS step, (SELECT value FROM differences JOIN judges j USING (aspect)
    WHERE own = q.id AND no_mesh_bar IS NULL AND value IS NOT NULL AND (better AND differences.number = 0 OR
      differences.number = 'smooth' AND (header LIKE '%.stress_%' OR header LIKE '%.J [%'))
    ORDER BY row DESC LIMIT 1) AS better, (SELECT better FROM judges WHERE aspect = 0) AS by_element
FROM quantities q JOIN cells c USING (id)
LEFT JOIN made m ON m.id = q.id AND m.row = rows - 1 AND m.aspect = 0
LEFT JOIN made s ON s.id = q.id AND s.row = rows - 1 AND s.aspect = 1
WHERE c.row = rows - 1;

-- What JSON has of each: numbers with all their digits, and a point.
CREATE TEMP TABLE members AS
SELECT id, place, '"' || key || '":' || coalesce(digits || iif(digits GLOB '*[.e]*', '', '.0'), 'null') AS text
FROM (SELECT id, 2 AS place, 'value' AS key, number(value) AS digits FROM ends
  UNION ALL SELECT id, 3, 'error_mesh', number(mesh) FROM ends UNION ALL SELECT id, 5, 'error_step', number(step) FROM ends
  UNION ALL SELECT id, 7, 'better', number(better) FROM ends WHERE better IS NOT NULL)
UNION ALL SELECT id, 0, '"name":' || json_quote(name) FROM ends UNION ALL SELECT id, 1, '"unit":' || json_quote(unit) FROM ends
UNION ALL SELECT id, 4, '"no_mesh_bar":' || json_quote(no_mesh_bar) FROM ends WHERE no_mesh_bar IS NOT NULL
UNION ALL SELECT id, 6, '"no_step_bar":' || json_quote(no_step_bar) FROM ends WHERE no_step_bar IS NOT NULL;

-- to result.json
SELECT json_set(result, '$.error_bars', json(printf('{%s"quantities":[%s]}',
  (SELECT group_concat(json_quote(name) || ':' || data || ',', '') FROM judges),
  (SELECT group_concat(text) FROM (SELECT '{' || group_concat(text) || '}' AS text FROM (SELECT * FROM members ORDER BY id, place)
    GROUP BY id))))) FROM asked;

-- to stdout
SELECT 'error bars of the ' || name || ': ' || iif(count, 'by ', 'none, as ') ||
  coalesce(data ->> '$.compared_with', data ->> '$.no_bar') || coalesce('; ' || (data ->> '$.left_out'), '') FROM judges;

-- Of probes, or of the whole body where there are none; values have digits down to a tenth of the bar.
-- to stdout
SELECT name || ' = ' || number(shown, value) || in_unit || iif(mesh IS NULL, '', ' +/- ' || number('%.2g', mesh) || ' (mesh)') ||
  iif(step IS NULL, '', ' +/- ' || number('%.2g', step) || ' (step)') ||
  iif(better IS NULL, '', iif(by_element, '; tet10-mean gives ', '; smoothed ') || number(shown, better) || in_unit) ||
  coalesce('; no bar (mesh): ' || no_mesh_bar, '') || coalesce('; no bar (step): ' || no_step_bar, '')
FROM (SELECT *, printf('%%.%dg', coalesce(max(5, min(17, 1 + length(CAST(
  abs(value) / min(coalesce(mesh, step), coalesce(step, mesh)) AS INTEGER)))), 5)) AS shown FROM ends)
WHERE tab = (SELECT max(tab) FROM ends) ORDER BY id;
