-- bench.sql: what `flesh bench` makes of its cases: every row that they have measured, against the machine's ceilings.

-- The ceilings with each number of threads, the first ones first. Of the bytes that a kernel moves, a level holds as much as
-- was found with the first number of threads.
CREATE TEMP TABLE ceilings AS
SELECT row_number() OVER (ORDER BY w.number) AS place, threads,
  printf('%d thread%s', threads, iif(threads = 1, '', 's')) AS title,
  data ->> '$.read_bytes_per_s.L2' AS L2, data ->> '$.read_bytes_per_s.L3' AS L3, data ->> '$.read_bytes_per_s.memory' AS memory,
  data ->> '$.level_bytes.L2' AS L2_bytes, data ->> '$.level_bytes.L3' AS L3_bytes,
  (SELECT max(value) FROM json_each(data, '$.operations_per_s')) AS peak, data
FROM wanted w JOIN cases USING (id) JOIN table_rows ON case_id = id WHERE part = 'machine';

-- The measurements in the order of the command line. Time is CPU time of one thread, wall time of several; the floor of a
-- kernel is the time that its bytes and operations take at the ceilings.
CREATE TEMP TABLE measured AS
SELECT *, max(bytes / CASE level WHEN 'L2' THEN L2 WHEN 'L3' THEN L3 ELSE memory END, operations / peak) AS floor_s FROM (
  SELECT w.number AS number, r.number AS line, part, r.data AS data, r.data ->> 'group' AS grouping, r.data ->> 'name' AS name,
    energy, poisson, element, c.threads AS threads, coalesce(r.data ->> 'status', 0) AS code, r.data ->> 'tets' AS tets,
    r.data ->> 'nodes' AS nodes, r.data ->> 'wall_s' AS wall_s, r.data ->> 'cpu_s' AS cpu_s, r.data ->> 'scatter' AS scatter,
    r.data ->> 'repeats' AS repeats, r.data ->> 'bytes' AS bytes, r.data ->> 'operations' AS operations,
    r.data ->> 'steps' AS steps, r.data ->> 'newton' AS newton, r.data ->> 'linear' AS linear,
    r.data ->> 'projections' AS projections, iif(c.threads = 1, r.data ->> 'cpu_s', r.data ->> 'wall_s') AS seconds,
    CASE WHEN r.data ->> 'bytes' <= (SELECT L2_bytes FROM ceilings WHERE place = 1) THEN 'L2'
      WHEN r.data ->> 'bytes' <= (SELECT L3_bytes FROM ceilings WHERE place = 1) THEN 'L3'
      WHEN r.data ->> 'bytes' THEN 'memory' END AS level, L2, L3, memory, peak
  FROM wanted w JOIN cases c USING (id) JOIN table_rows r ON r.case_id = id LEFT JOIN ceilings m ON m.threads = c.threads
  WHERE part <> 'machine')
ORDER BY number, line;

-- How the steps of each case grow with the mesh: least squares in logarithms. Of time beyond the last cache, too; of
-- iterations where the bar of 48 672 tets takes part.
CREATE TEMP TABLE growth AS
SELECT part, energy, poisson, threads, what, least,
  (count(*) * total(x * y) - total(x) * total(y)) / (count(*) * total(x * x) - total(x) * total(x)) AS slope
FROM (SELECT part, energy, poisson, threads, tets, column1 AS what, column2 AS least, ln(tets) AS x,
    iif(column1 = 'time', ln(seconds / steps), ln(1.0 * linear / newton)) AS y
  FROM measured JOIN (VALUES ('time', 0), ('time', 200000), ('linear', 0), ('linear', 48000)) WHERE tets >= column2 AND NOT code)
WHERE y IS NOT NULL GROUP BY part, energy, poisson, threads, what, least HAVING max(tets) > min(tets);
-- A row for each of these cases.
CREATE TEMP TABLE moves AS
SELECT m.part AS part, m.energy AS energy, m.poisson AS poisson, m.threads AS threads, min(number) AS first,
  printf('%s %s %s, %d thread%s', m.part, m.energy, number('%g', m.poisson), m.threads, iif(m.threads = 1, '', 's')) AS title,
  a.slope AS time, b.slope AS time_far, c.slope AS linear, d.slope AS linear_far
FROM measured m
LEFT JOIN growth a ON (a.part, a.energy, a.poisson, a.threads, a.what, a.least) =
  (m.part, m.energy, m.poisson, m.threads, 'time', 0)
LEFT JOIN growth b ON (b.part, b.energy, b.poisson, b.threads, b.what, b.least) =
  (m.part, m.energy, m.poisson, m.threads, 'time', 200000)
LEFT JOIN growth c ON (c.part, c.energy, c.poisson, c.threads, c.what, c.least) =
  (m.part, m.energy, m.poisson, m.threads, 'linear', 0)
LEFT JOIN growth d ON (d.part, d.energy, d.poisson, d.threads, d.what, d.least) =
  (m.part, m.energy, m.poisson, m.threads, 'linear', 48000)
WHERE grouping <> 'kernel' GROUP BY m.part, m.energy, m.poisson, m.threads;

-- Memory by its owner, of the first case of each mesh.
CREATE TEMP TABLE owners AS
SELECT number, tets, key AS owner, value AS bytes, o.id AS place
FROM (SELECT *, min(number) FROM measured WHERE grouping <> 'kernel' GROUP BY tets) m, json_each(m.data, '$.memory') o;
CREATE TEMP VIEW most AS SELECT max(data ->> 'peak_memory_kB') AS kB FROM measured;

-- to bench.csv
SELECT grouping AS "group", name, energy, poisson, tets, nodes, threads, status_name(code) AS status, wall_s, cpu_s, scatter,
  repeats, 1e9 * seconds / tets / coalesce(steps, 1) AS ns_per_tet, coalesce(bytes, 0) AS bytes,
  coalesce(operations, 0) AS operations, coalesce(floor_s, 0) AS floor_s, level, coalesce(steps, 0) AS steps,
  coalesce(newton, 0) AS newton, coalesce(linear, 0) AS linear, coalesce(data ->> 'assemblies', 0) AS assemblies,
  coalesce(projections, 0) AS projections, coalesce(data ->> 'backtracks', 0) AS backtracks, data ->> 'answer_m' AS answer,
  element
FROM measured ORDER BY number, line;

-- to bench.json
SELECT json_object('program', f.data -> 'program', 'instructions', f.data ->> 'instructions',
  'newton_tolerance', f.data -> 'newton_tolerance',
  'ceilings', (SELECT json_group_array(json_set(json_remove(data, '$.group', '$.level_bytes'), '$.threads', threads))
    FROM (SELECT * FROM ceilings ORDER BY place)),
  'level_bytes', (SELECT data -> 'level_bytes' FROM ceilings WHERE place = 1),
  'measurements', (SELECT json_group_array(iif(grouping = 'kernel',
      json_set(row, '$.floor_s', floor_s, '$.level', level),
      json_set(row, '$.growth_time', time, '$.growth_time_from_200000', time_far, '$.growth_linear_from_48000', linear_far)))
    FROM (SELECT *, json_set(json_remove(data, '$.memory', '$.peak_memory_kB'), '$.energy', m.energy,
        '$.poisson', m.poisson, '$.element', element, '$.threads', m.threads, '$.status', status_name(code)) AS row
      FROM measured m LEFT JOIN moves USING (part, energy, poisson, threads) ORDER BY number, line)),
  'memory', (SELECT json_group_array(json_object('owner', owner, 'tets', tets, 'bytes', bytes))
    FROM (SELECT * FROM owners ORDER BY number, place)),
  'peak_memory_kB', (SELECT kB FROM most))
FROM facts f WHERE number = 0;

-- to stdout
SELECT title || printf(': read L2 %.1f L3 %.1f memory %.1f GB/s; a = b + s c L2 %.1f L3 %.1f memory %.1f GB/s; multiply-add',
  L2 / 1e9, L3 / 1e9, memory / 1e9, (data ->> '$.triad_bytes_per_s.L2') / 1e9, (data ->> '$.triad_bytes_per_s.L3') / 1e9,
  (data ->> '$.triad_bytes_per_s.memory') / 1e9) || (SELECT group_concat(printf(' %s %.1f', key, value / 1e9), '')
  FROM json_each(data, '$.operations_per_s')) || ' Gflop/s' FROM ceilings ORDER BY place;
-- to stdout
SELECT printf('L2 serves up to %s MB, L3 up to %s MB', number('%.3g', L2_bytes / 1048576), number('%.3g', L3_bytes / 1048576))
FROM ceilings WHERE place = 1;
-- to stdout
SELECT printf('%-24s %-4s %-5s %8d %3d ', name, energy, number('%g', poisson), tets, threads) || CASE
  WHEN code THEN printf('%12s', 'failed')
  WHEN grouping = 'kernel' THEN printf('%s ns/tet  +-%s %%  %s %% of the ceiling (%s)', number('%9.2f', 1e9 * seconds / tets),
    number('%4.1f', 100 * scatter), number('%5.1f', 100 * floor_s / seconds), coalesce(level, 'not known'))
  ELSE printf('%s ms/step +-%s %%  %s Newton, %s linear, %s projected', number('%9.2f', 1e3 * seconds / steps),
    number('%4.1f', 100 * scatter), number('%6.1f', 1.0 * newton / steps), number('%7.1f', 1.0 * linear / steps),
    number('%5.1f', 1.0 * projections / steps)) END
FROM measured ORDER BY number, line;
-- to stdout
SELECT 'growth of ' || title || ': time ~ tets^' || number('%.2f', time) ||
  iif(time_far IS NULL, '', printf(' (from 200 000 tets: %s)', number('%.2f', time_far))) || ', linear iterations ~ tets^' ||
  number('%.2f', linear) || iif(linear_far IS NULL, '', printf(' (from 48 000 tets: %s)', number('%.2f', linear_far)))
FROM moves WHERE time IS NOT NULL ORDER BY first;
-- to stdout
SELECT printf('memory at %d tets: %s %.0f bytes/tet', tets, owner, bytes / tets) FROM owners ORDER BY number, place;
-- to stdout
SELECT printf('most memory resident at a time: %.0f MB', 1.024e-3 * kB) FROM most WHERE kB;

CREATE TEMP VIEW colours (k, colour) AS
VALUES (0, '#0072b2'), (1, '#d55e00'), (2, '#009e73'), (3, '#cc79a7'), (4, '#e69f00'), (5, '#56b4e9'), (6, '#7f4f24'),
  (7, '#8f2d9c'), (8, '#000000');
-- Types of points of gnuplot.
CREATE TEMP VIEW shapes (k, filled, hollow) AS VALUES (0, 7, 6), (1, 5, 4), (2, 9, 8), (3, 13, 12), (4, 11, 10), (5, 15, 14);

-- The roofline of Williams, Waterman & Patterson (Commun. ACM 52, 2009) of the first number of threads, with the kernels of
-- the first energy under it, which are marked on their largest mesh.
CREATE TEMP TABLE under_roof AS
SELECT name, tets, 100 * floor_s / seconds AS share, iif(operations / floor_s > 0.999 * peak, 'multiply-add', level) AS roof,
  (row_number() OVER (ORDER BY min(number), line)) - 1 AS k
FROM (SELECT * FROM measured ORDER BY tets DESC) WHERE grouping = 'kernel' AND operations > 0
  AND threads = (SELECT threads FROM ceilings WHERE place = 1)
  AND energy = (SELECT energy FROM measured WHERE grouping = 'kernel' ORDER BY number LIMIT 1)
GROUP BY name HAVING max(tets);
-- to roofline.gp
SELECT plot('roofline', 1200, 640, 'What the kernels take of the machine, ' || title || ' (filled: the largest mesh)',
  'operations per byte that must be moved [flop/B]', 'speed [Gflop/s]') || printf('set logscale xy
set format xy ''%%g''
set samples 1000
set xrange [0.05:10]
set yrange [1:%s]
set dummy i
under_roof(name) = strcol(''group'') eq ''kernel'' && strcol(''name'') eq name && ' ||
  'strcol(''energy'') eq ''%s'' && column(''threads'') == %d
intensity = ''column("operations")/column("bytes")''
speed = ''1e-9*column("operations")/column("%s")''
plot ', number('%g', 2e-9 * peak), coalesce((SELECT energy FROM measured WHERE grouping = 'kernel' ORDER BY number LIMIT 1), ''),
  threads, iif(threads = 1, 'cpu_s', 'wall_s')) || (
  SELECT group_concat(printf('(i*%s < %s ? i*%s : %s) with lines lw %d lc rgb ''%s'' title ''read from %s, %.0f GB/s'', \
  ', number('%g', 1e-9 * rate), number('%g', 1e-9 * peak), number('%g', 1e-9 * rate), number('%g', 1e-9 * peak), width, grey,
    level, 1e-9 * rate), '')
  FROM (SELECT column1 AS level, column2 AS width, column3 AS grey,
    CASE column1 WHEN 'L2' THEN L2 WHEN 'L3' THEN L3 ELSE memory END AS rate
    FROM (VALUES ('L2', 5, '#b0b0b0'), ('L3', 3, '#707070'), ('memory', 1, '#202020')))) || (
  SELECT group_concat(printf('%s with lines lw 1 dt %d lc rgb ''#909090'' title ''multiply-add %s, %.0f Gflop/s'', \
  ', number('%g', 1e-9 * value), dash, key, 1e-9 * value), '')
  FROM (SELECT *, 1 + row_number() OVER (ORDER BY id) AS dash FROM json_each(data, '$.operations_per_s'))) || coalesce((
  SELECT group_concat(printf('''bench.csv'' using (under_roof(''%s'') ? @intensity : NaN):(@speed) with linespoints lw 1 ' ||
      'pt %d ps 1.6 lc rgb ''%s'' notitle, \
  ', name, hollow, colour) || printf('''bench.csv'' using (under_roof(''%s'') && column(''tets'') == %d ? @intensity : NaN):' ||
      '(@speed) with points pt %d ps 1.6 lc rgb ''%s'' title ''%s, %.0f %% of %s'', \
  ', name, tets, filled, colour, name, share, roof), '')
  FROM (SELECT u.*, colour, filled, hollow FROM under_roof u JOIN colours c ON c.k = u.k % 9 JOIN shapes s ON s.k = u.k % 6
    ORDER BY u.k)), '') || '1/0 notitle'
FROM ceilings WHERE place = 1;

-- The curves of growth: colour by move and energy, shape by ratio, dashes by threads.
CREATE TEMP TABLE curves AS
WITH parts AS (SELECT part, row_number() OVER (ORDER BY min(first)) - 1 AS c FROM moves GROUP BY part),
  energies AS (SELECT energy, row_number() OVER (ORDER BY min(first)) - 1 AS e FROM moves GROUP BY energy),
  ratios AS (SELECT poisson, row_number() OVER (ORDER BY min(first)) - 1 AS r FROM moves GROUP BY poisson)
SELECT moves.*, place,
  printf('with linespoints lw 1.5 dt %d pt %d ps 1.4 lc rgb ''%s''', place, iif(e % 2, hollow, filled),
    colour) AS style,
  printf('''bench.csv'' using (is_case(''%s'', ''%s'', %s, %d) ? column(''tets'') : NaN):', part, energy,
    number('%.17g', poisson), threads) AS points
FROM moves JOIN parts USING (part) JOIN energies USING (energy) JOIN ratios USING (poisson)
JOIN (SELECT threads, place FROM ceilings) USING (threads)
JOIN colours c ON c.k = (c + e * (SELECT count(*) FROM parts)) % 9 JOIN shapes s ON s.k = r % 6;
-- The legend stands below the panels in two columns, a row of 17 pixels for each curve.
CREATE TEMP VIEW canvas AS
SELECT rows, 540 + 17 * rows AS height, 0.8 * least AS low, 1.25 * most AS high, least
FROM (SELECT (1 + count(*)) / 2 AS rows FROM moves), (SELECT min(tets) AS least, max(tets) AS most FROM measured);
-- A tick at every size, as long as they leave each other room.
CREATE TEMP VIEW ticks AS
WITH RECURSIVE sizes (tets) AS (SELECT least FROM canvas UNION ALL
  SELECT (SELECT min(m.tets) FROM measured m WHERE m.tets > s.tets * pow(high / low, 0.1)) AS next FROM sizes s, canvas
  WHERE next IS NOT NULL)
SELECT group_concat(printf('''%s'' %d', iif(tets < 10000, tets, number('%.3g', tets / 1e3) || ' k'), tets), ', ') AS text
FROM sizes;
-- to growth.gp
SELECT plot('growth', 1200, height, NULL, NULL, NULL) || printf('set logscale xy
set title noenhanced font '',13''
is_case(name, energy, poisson, threads) = strcol(''name'') eq name && strcol(''energy'') eq energy && ' ||
  'column(''poisson'') == poisson && column(''threads'') == threads && strcol(''status'') eq ''FLESH_OK''
set xtics (%s)
set xlabel ''number of tets''
set xrange [%s:%s]
set key off
set multiplot layout 1,3 margins 0.07,0.98,%.3f,%.3f spacing 0.09,0
set title ''Exponents from 200 000 tets (*: over all sizes)''
set lmargin at screen 0.07
set rmargin at screen 0.48
set ylabel ''time of a step [ms]''
set format y ''%%g''
plot ', text, number('%g', low), number('%g', high), (100.0 + 17 * rows) / height, 1 - 40.0 / height) || (
  SELECT group_concat(printf('%s(1e3*column(''%s'')/column(''steps'')) %s notitle, \
  ', points, iif(threads = 1, 'cpu_s', 'wall_s'), style), '') FROM (SELECT * FROM curves ORDER BY first)) || '1/0 notitle
set title ''Exponents from 48 000 tets (*: over all sizes)''
set lmargin at screen 0.57
set rmargin at screen 0.98
set ylabel ''linear iterations per Newton iteration''
unset logscale y
set yrange [0:*]
plot ' || (SELECT group_concat(printf('%s(column(''linear'')/column(''newton'')) %s notitle, \
  ', points, style), '') FROM (SELECT * FROM curves WHERE place = 1 ORDER BY first)) || printf('1/0 notitle
unset border
unset tics
unset grid
unset xlabel
unset ylabel
unset title
unset logscale
set lmargin at screen 0.01
set rmargin at screen 0.99
set xrange [0:1]
set yrange [0:1]
set key on at screen 0.52,0.005 center bottom vertical maxrows %d font '',10''
plot 1/0 notitle', rows) || (SELECT group_concat(printf(', \
  keyentry %s title %s', style, quoted(printf('%s: time ~ tets^%s, iterations ~ tets^%s', title,
    iif(time_far IS NULL, iif(time IS NULL, '?', number('%.2f', time) || '*'), number('%.2f', time_far)),
    iif(linear_far IS NULL, iif(linear IS NULL, '?', number('%.2f', linear) || '*'), number('%.2f', linear_far))))), '')
  FROM (SELECT * FROM curves ORDER BY first)) || '
unset multiplot'
FROM canvas, ticks WHERE rows;
