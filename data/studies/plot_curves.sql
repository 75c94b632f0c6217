-- plot_curves.sql: curves of columns of tables (`flesh plot`), from the tables of plot_columns.sql and `cells`: word and
-- number of row `row` of column `id`; without a number that is NULL, a word where the cell is one.

-- to error
SELECT printf('%s: %s of row %d is ''%s'', which is no number; --by makes a curve for each word', file, header, row + 1,
  substr(word, 1, 80))
FROM (SELECT place, 0 AS axis, x_id AS id FROM chosen UNION ALL SELECT place, 1, id FROM chosen) JOIN
  (SELECT id, row, word FROM cells WHERE typeof(number) = 'text') USING (id) JOIN headers USING (id)
ORDER BY place, row, axis LIMIT 1;

CREATE TEMP TABLE points AS
SELECT place, coalesce(g.word, '') AS word, y.row AS row, x.number AS x, y.number AS y,
  (SELECT sum(e.number) FROM bars b JOIN cells e USING (id) WHERE b.place = c.place AND e.row = y.row
    AND typeof(e.number) <> 'text') AS bar, x.number IS NOT NULL AND
  y.number IS NOT NULL AND NOT (log LIKE '%x%' AND x.number <= 0) AND NOT (log LIKE '%y%' AND y.number <= 0) AS drawn
FROM asked CROSS JOIN chosen c CROSS JOIN cells y ON y.id = c.id JOIN cells x ON x.id = x_id AND x.row = y.row
  LEFT JOIN cells g ON g.id = by_id AND g.row = y.row;

-- A curve for each column and group, told from the others by run, column and group.
CREATE TEMP TABLE curves AS
SELECT row_number() OVER (ORDER BY place, first) - 1 AS curve, count(*) OVER () AS curves, p.*,
  place IN (SELECT place FROM bars) AND log NOT LIKE '%y%' AS has_bars,
  substr(iif((SELECT count(DISTINCT source) FROM headers) > 1, ', ' || label, '') ||
    iif((SELECT count(DISTINCT name) FROM chosen) > 1, ', ' || name, '') || iif("by" IS NULL, '', ', ' || p.word), 3) AS title
FROM (SELECT place, word, min(row) AS first, count(*) AS count, total(drawn) AS drawn FROM points GROUP BY 1, 2) p
  JOIN chosen USING (place), asked;

-- The key names the curves that fit into half of the width, or a third of the height below, and counts the rest.
CREATE TEMP TABLE legend AS
SELECT longest, drawn, rows, rows * max(1, iif(longest > 28, width, width / 2) / (8 * longest + 60)) AS room
FROM (SELECT *, max(1, iif(longest > 28, height / 3, height - 75) / 21) AS rows
  FROM asked, (SELECT max(length(title)) AS longest, sum(drawn > 0) AS drawn FROM curves));

-- Several columns are named by the words that asked for them, where these are short.
CREATE TEMP TABLE labels AS
SELECT axis, iif(unit = '', name, ltrim(name || ' [' || unit || ']')) AS label, log LIKE '%' || axis || '%' AS is_log, low, high,
  max(pow(high / low, 0.04), 1.02) AS wider
FROM asked, (
  SELECT 'x' AS axis, h.name AS name, h.unit AS unit, min(x) AS low, max(x) AS high
  FROM chosen c JOIN headers h ON h.id = x_id AND c.place = 1 LEFT JOIN points p ON drawn
  UNION ALL
  SELECT 'y', iif((SELECT count(DISTINCT name) FROM chosen) = 1, name, (SELECT iif(total(length(word) + 2) < 64,
    group_concat(word, ', '), '') FROM (SELECT DISTINCT number, word FROM chosen WHERE source = 0 ORDER BY number))),
    unit, min(y), max(y)
  FROM chosen c LEFT JOIN points p ON drawn WHERE c.place = 1);

-- to error
SELECT printf('there is nothing to draw: %s over %s has no row with %s numbers', c.name, n.label,
  iif(log = '', 'finite', 'finite and, on logarithmic axes, positive'))
FROM asked, chosen c, labels n WHERE place = 1 AND n.axis = 'x' AND NOT EXISTS (SELECT 1 FROM points WHERE drawn);

-- Of more rows than show, the first, the last, the least and the largest of each stretch within a quarter of a pixel across
-- draw the same picture. Rows without numbers are stretches of their own.
CREATE TEMP TABLE stretches (curve, stretch, row, y, PRIMARY KEY (curve, stretch, row)) WITHOUT ROWID;
INSERT INTO stretches
SELECT curve, sum(begins) OVER (PARTITION BY curve ORDER BY row ROWS UNBOUNDED PRECEDING), row, y
FROM (SELECT *, place_x IS NOT lag(place_x) OVER (PARTITION BY curve ORDER BY row) AS begins
  FROM (SELECT curve, row, p.y AS y, iif(p.drawn, coalesce(CAST(4 * width * iif(is_log, ln(p.x / low) / ln(high / low),
      (p.x - low) / (high - low)) AS INTEGER), 0), -1) AS place_x
    FROM asked, labels l, points p JOIN curves c ON c.place = p.place AND c.word = p.word
    WHERE l.axis = 'x' AND c.count > 16 * width AND NOT points));
CREATE TEMP TABLE shown AS
SELECT curve, min(row) AS row FROM stretches GROUP BY curve, stretch
UNION SELECT curve, max(row) FROM stretches GROUP BY curve, stretch
UNION SELECT curve, row FROM (SELECT curve, row, min(y) FROM stretches GROUP BY curve, stretch)
UNION SELECT curve, row FROM (SELECT curve, row, max(y) FROM stretches GROUP BY curve, stretch);

-- Bands reach from a value less its error bars, of the mesh and of the steps together, to one with them.
-- The data stand in the script, so that it can be restyled and drawn again wherever it is. Lines beneath are wider, so that
-- they show beside the lines that cover them; the key stands beside the curves where its words are short, else below.
-- to *.gp
SELECT text FROM (
  SELECT curve, -1 AS row, printf('$curve_%d << END', curve + 1) AS text FROM curves
  UNION ALL SELECT curve, row, coalesce(number(p.x), 'NaN') || ' ' || coalesce(number(p.y), 'NaN') ||
    iif(has_bars, ' ' || coalesce(number(p.bar), 'NaN'), '')
  FROM points p JOIN curves c ON c.place = p.place AND c.word = p.word, asked
  WHERE c.count <= 16 * width OR points OR (curve, row) IN shown
  UNION ALL SELECT curve, 1e99, 'END' FROM curves
  UNION ALL
  SELECT 1e99, 0, plot(picture, width, height, NULL, NULL, NULL, 0, suffix) || 'set autoscale xfix
set offsets 0, 0, graph 0.04, graph 0.04
' || (SELECT group_concat(printf('set %slabel noenhanced
set %slabel %s
', axis, axis, quoted(label)) || iif(is_log, printf('set logscale %s
', axis) || iif(axis = 'y', printf('set yrange [%s:%s]
', number('%.6g', low / wider), number('%.6g', high * wider)), '') || iif(high / low > 1e3, printf('set format %s ''10^{%%L}''
', axis), log_ticks(axis, low, high)), ''), '') FROM (SELECT * FROM labels ORDER BY axis)) || iif(log LIKE '%y%', 'unset offsets
', '') || iif(title IS NULL, '', 'set title noenhanced font '',13''
set title ' || quoted(title) || char(10)) || (SELECT CASE WHEN longest > 28 THEN
      printf('set key outside bottom center vertical maxrows %d Left reverse noenhanced spacing 1.2', rows)
    WHEN longest THEN 'set key outside right top Left reverse noenhanced spacing 1.2' ELSE 'unset key' END
  FROM legend) || '
plot ' || coalesce((SELECT group_concat(printf(
      '$curve_%d using 1:($2 - $3):($2 + $3) with filledcurves fs transparent solid 0.2 noborder lc rgb ''%s'' notitle, \
     ', curve + 1, colour(curve)), '') FROM (SELECT * FROM curves WHERE drawn AND has_bars ORDER BY curve)), '') ||
  (SELECT group_concat(printf('$curve_%d using 1:2 with %s lw %s%s lc rgb ''%s'' %s', curve + 1,
    iif(points OR count <= 40, 'linespoints pt 7 ps 0.6', 'lines'), number('%.3g', iif(curves > 1,
      3.4 - 1.8 * curve / (curves - 1), 2)), iif(curve / 8 % 2, ' dt 2', ''), colour(curve),
    iif(legend.drawn <= room OR entry < room, 'title ' || quoted(title), 'notitle')), ', \
     ') || iif(legend.drawn <= room, '', printf(', \
     keyentry with dots lc rgb ''#ffffff'' title ''and %d more''', legend.drawn - room + 1))
    FROM (SELECT *, row_number() OVER (ORDER BY curve) AS entry FROM curves WHERE drawn ORDER BY curve), legend)
  FROM asked)
ORDER BY curve, row;

-- to stderr
SELECT printf('flesh plot: %s has no point that can be drawn', title) FROM curves WHERE NOT drawn ORDER BY curve;
