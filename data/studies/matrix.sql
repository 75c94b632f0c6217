-- matrix.sql: the picture of cases x settings of `flesh hardcases`, coloured by outcome, from the table `runs` of hardcases.sql.

-- Outcomes from best to worst. The colours are distinguishable with any colour vision.
CREATE TEMP TABLE colours AS SELECT column1 AS o, column2 AS outcome, column3 AS colour FROM (VALUES
  (0, 'recovered', '#8fd0a8'), (1, 'untangled', '#c5dc7a'), (2, 'equilibrium', '#d3ecdb'), (3, 'stressed at rest', '#f7e3a1'),
  (4, 'not recovered', '#f2cf63'), (5, 'unconverged', '#e08a2e'), (6, 'stopped', '#8fb3d9'), (7, 'out of budget', '#8c6bb1'),
  (8, 'non-finite', '#c2185b'), (9, 'crashed or hung', '#7a0c0c'), (10, 'not run', '#f4f4f4'));
CREATE TEMP TABLE matrix_rows AS
SELECT name, max(grp) AS grp, max(own_poisson) AS own_poisson, row_number() OVER (ORDER BY min(number)) - 1 AS c
  FROM runs GROUP BY name;
CREATE TEMP TABLE matrix_columns AS
SELECT title, row_number() OVER (ORDER BY min(number)) - 1 AS s FROM runs GROUP BY title;
-- Sizes in pixels; the width is that of the legend at least.
CREATE TEMP TABLE sizes AS
SELECT columns, rows, max(300 + 62 * columns, 1180) AS width, 300 + 18 * rows AS height, 190.0 + 62 * columns AS right
FROM (SELECT count(*) AS columns FROM matrix_columns) JOIN (SELECT count(*) AS rows FROM matrix_rows);

-- Of the seeds of a cell, which stand side by side, the worst.
CREATE TEMP TABLE cells AS
SELECT * FROM (
  SELECT c, s, runs.*, o, colour, count(*) OVER (PARTITION BY c, s) AS count, sum(o <= 2) OVER (PARTITION BY c, s) AS good,
    row_number() OVER (PARTITION BY c, s ORDER BY o DESC, number) AS place,
    CASE end_kind WHEN 1 THEN ' min' WHEN 3 THEN ' saddle' WHEN 4 THEN ' untan.' ELSE '' END AS mark
  FROM runs JOIN matrix_rows USING (name) JOIN matrix_columns USING (title) JOIN colours USING (outcome))
WHERE place = 1;
CREATE TEMP VIEW cell_texts AS
SELECT c, s, o, CASE
  WHEN count > 1 THEN printf('%d of %d', good, count)
  WHEN o = 2 THEN CASE rank WHEN 0 THEN 'point' WHEN 1 THEN 'line' WHEN 2 THEN 'plane' WHEN 3 THEN 'body' END || mark
  WHEN o < 2 AND static THEN printf('%d it.', newton)
  WHEN o < 2 THEN iif(recovered_at IS NULL, NULL, number('%.2g', recovered_at) || ' s')
  WHEN o = 4 AND distance IS NULL THEN 'no rest'
  WHEN o IN (3, 4) THEN iif(inverted_end, printf('%d inv', inverted_end), number('%.2g', distance)) || mark
  WHEN o = 5 THEN iif(rises, printf('%d rises', rises), printf('%d unconv.', unconverged))
  WHEN o = 6 THEN printf('exit %d', exit_code) END AS text
FROM cells;

-- to matrix.gp
SELECT text FROM (
  SELECT 0 AS at, 0 AS line, plot('matrix', width, height, NULL, NULL, NULL) || printf('set lmargin at screen %s
set rmargin at screen %s
set tmargin at screen %s
set bmargin at screen %s
set xrange [0:%d]
set yrange [%d:0]
unset tics
unset border
unset grid
unset key', number('%.6f', 190.0 / width), number('%.6f', right / width), number('%.6f', 1 - 230.0 / height),
    number('%.6f', 70.0 / height), columns, rows) AS text FROM sizes
  UNION ALL
  SELECT 1, c, printf('set object rectangle from %d,%d to %d,%d fc rgb ''%s'' fs solid border lc rgb ''#ffffff''', s, c,
    s + 1, c + 1,
    coalesce(cells.colour, '#f4f4f4'))
  FROM matrix_rows JOIN matrix_columns LEFT JOIN cells USING (c, s)
  UNION ALL
  SELECT 2, c, printf('set label %s at %s,%s center noenhanced font '',7'' textcolor rgb ''%s'' front', quoted(coalesce(text,
    '')),
    number('%g', s + 0.5), number('%g', c + 0.5), iif(o BETWEEN 7 AND 9, '#ffffff', '#404040')) FROM cell_texts
  UNION ALL
  SELECT 3, c, printf('set label %s at screen %s, first %s right noenhanced font '',9'' textcolor rgb ''#303030''',
    quoted(name || iif(own_poisson > 0, printf(' (%s)', number('%g', own_poisson)), '')), number('%.6f', 182.0 / width),
    number('%g', c + 0.5)) FROM matrix_rows JOIN sizes
  UNION ALL
  SELECT 4, a.c, printf('set arrow from screen %s, first %d to screen %s, first %d nohead lc rgb ''#606060'' front',
    number('%.6f', 10.0 / width), a.c, number('%.6f', right / width), a.c)
  FROM matrix_rows a JOIN matrix_rows b ON b.c = a.c - 1 AND b.grp <> a.grp JOIN sizes
  UNION ALL
  SELECT 5, s, printf('set label %s at first %s, screen %s left rotate by 55 noenhanced font '',9'' textcolor rgb ''#303030''',
    quoted(title), number('%g', s + 0.4), number('%.6f', 1 - 222.0 / height)) FROM matrix_columns JOIN sizes
  UNION ALL
  SELECT 6, 0, printf('set label ''Hard cases: what became of them'' at screen %s,%s left font '',13''
set label "Recovered: simulated time until at rest for good (statics: Newton iterations); ' ||
    'untangled: after tangles in equilibrium were left through softer materials.\n' ||
    'Not recovered: distance from rest in body lengths, or inverted tets;\nmin: the end is a true local minimum. ' ||
    'Several seeds: how many recovered.\nColumns: energy, Poisson''s ratio, solver." ' ||
    'at screen %s,%s left noenhanced font '',9'' textcolor rgb ''#606060''',
    number('%.6f', 10.0 / width), number('%.6f', 1 - 20.0 / height), number('%.6f', 10.0 / width), number('%.6f',
      1 - 44.0 / height))
  FROM sizes
  UNION ALL
  SELECT 7, o, printf('set object rectangle from screen %s,%s to screen %s,%s fc rgb ''%s'' fs solid noborder
set label %s at screen %s,%s left noenhanced font '',9'' textcolor rgb ''#303030''', number('%.5f', (x - 170) / width),
    number('%.5f', 22.0 / height), number('%.5f', (x - 156) / width), number('%.5f', 36.0 / height), colour, quoted(outcome),
    number('%.5f', (x - 150) / width), number('%.5f', 29.0 / height))
  FROM (SELECT *, 190 + 34 * o + 7.2 * coalesce((SELECT sum(length(p.outcome)) FROM colours p WHERE p.o < colours.o), 0) AS x
    FROM colours)
  JOIN sizes
  UNION ALL SELECT 8, 0, 'plot NaN')
ORDER BY at, line;
