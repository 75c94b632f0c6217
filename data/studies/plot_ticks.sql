-- plot_ticks.sql: the places along the axes of `flesh sweep plot` and its series. `asked` has what the command line says,
-- `drawn` the cases by series s and place x, y: mean, least and most of their values, how many have one (valued), how many
-- have none (bare), and why.

-- to error
SELECT CASE
    WHEN series = 0 THEN path || ': ' || coalesce('no case fits --where ' || "where", 'there are no cases')
    WHEN series > 2000 AND "by" IS NOT NULL THEN "by" || ' has more than 2000 values; narrow it by --where'
    WHEN along > 2000 THEN x || ' has more than 2000 values; narrow it by --where'
    WHEN up > 2000 AND z IS NOT NULL THEN y || ' has more than 2000 values; narrow it by --where'
    WHEN series > 36 AND z IS NOT NULL THEN
      printf('--by %s has %d values; there is room for 36 maps; narrow it by --where', "by", series)
    WHEN z IS NOT NULL AND NOT EXISTS (SELECT 1 FROM drawn WHERE valued AND abs(mean) < 9e999) THEN
      printf('%s: no complete case has a value of %s', path, z)
    WHEN z IS NULL AND NOT EXISTS (SELECT 1 FROM drawn d WHERE valued AND NOT (log LIKE '%y%' AND NOT least > 0) AND
      NOT (log LIKE '%x%' AND NOT d.x > 0 AND (SELECT min(typeof(x) IN ('integer', 'real')) FROM drawn))) THEN
      printf('%s: no case has a value of %s that could be drawn', path, y)
  END AS sentence
FROM asked, (SELECT count(*) AS series FROM (SELECT DISTINCT s FROM drawn)), (SELECT count(*) AS along FROM
  (SELECT DISTINCT x FROM drawn)), (SELECT count(*) AS up FROM (SELECT DISTINCT y FROM drawn)) WHERE sentence IS NOT NULL;

CREATE TEMP TABLE placed AS
SELECT *, dense_rank() OVER (ORDER BY s) - 1 AS s_place, dense_rank() OVER (ORDER BY x) - 1 AS x_place,
  dense_rank() OVER (ORDER BY y) - 1 AS y_place FROM drawn;

-- Labels in SQLite's order: numbers have as many digits as tell them from their neighbours, four at least; of a word that
-- is longer, 44 bytes are left.
CREATE TEMP TABLE ticks AS
WITH RECURSIVE lengths (n) AS (VALUES (0) UNION ALL SELECT n + 1 FROM lengths WHERE n < 44),
all_places AS (SELECT 's' AS axis, s_place AS place, s AS value FROM placed UNION SELECT 'x', x_place, x FROM placed
  UNION SELECT 'y', y_place, y FROM placed),
neighbours AS (SELECT *, typeof(value) IN ('integer', 'real') AS is_number,
  lag(value) OVER w AS before, lead(value) OVER w AS after FROM all_places WINDOW w AS (PARTITION BY axis ORDER BY place))
SELECT axis, place, value, is_number, iif(is_number,
  (SELECT number(format, value) FROM (SELECT n, printf('%%.%dg', n) AS format FROM lengths WHERE n BETWEEN 4 AND 17)
   WHERE n = 17 OR ((typeof(before) NOT IN ('integer', 'real') OR number(format, before) <> number(format, value)) AND
     (typeof(after) NOT IN ('integer', 'real') OR number(format, after) <> number(format, value))) ORDER BY n LIMIT 1),
  iif(length(CAST(value AS BLOB)) > 44, substr(value, 1, (SELECT max(n) FROM lengths
    WHERE length(CAST(substr(value, 1, n) AS BLOB)) <= 44)) || '...', coalesce(value, 'none'))) AS label
FROM neighbours;

CREATE TEMP TABLE axes AS
SELECT axis, count(*) AS count, max(NOT is_number) AS words, max(length(label)) AS letters, printf('set %stics noenhanced (', axis) ||
  group_concat(printf('%s %d', quoted_tick(label), place), ', ') || ')' AS tics
FROM (SELECT * FROM ticks ORDER BY axis, place) GROUP BY axis;
