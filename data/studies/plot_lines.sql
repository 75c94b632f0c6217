-- plot_lines.sql: a figure against an axis, of a sweep (`flesh sweep plot`), from the tables of plot_ticks.sql.

-- Words stand at their places. A logarithmic axis shows positive values only.
CREATE TEMP TABLE points AS
SELECT s_place, x_place, iif(words, x_place, 1.0 * p.x) AS x, mean, least, most, valued, bare,
  valued AND ((log LIKE '%x%' AND NOT words AND NOT p.x > 0) OR (log LIKE '%y%' AND NOT least > 0)) AS beyond
FROM placed p, asked, (SELECT words FROM axes WHERE axis = 'x');
CREATE TEMP VIEW shown AS SELECT * FROM points WHERE valued AND NOT beyond;
CREATE TEMP VIEW spread AS SELECT coalesce(max(valued) > 1, 0) AS spread FROM shown;

-- A block for each series. No block is empty: gnuplot would count the next in its place.
-- to *.dat
SELECT text FROM (
  SELECT place AS s, -1 AS x, iif(place > 0, char(10, 10), '') || 'NaN NaN NaN NaN' AS text FROM ticks WHERE axis = 's'
  UNION ALL SELECT s_place, x_place, printf('%s %s %s %s', number('%.17g', x), number('%.17g', mean), number('%.17g', least),
    number('%.17g', most)) FROM shown)
ORDER BY s, x;

-- to stdout
SELECT printf('%d cases without a value are not in the picture', bare) FROM (SELECT sum(bare) AS bare FROM points) WHERE bare;
-- to stdout
SELECT printf('%d cases are not in the picture: a logarithmic axis shows positive values only', beyond)
FROM (SELECT sum(valued) AS beyond FROM points WHERE beyond) WHERE beyond;

-- Many places along x are a sample's, where a line from one to the next would say nothing.
-- to *.gp
SELECT plot(name, 960, 600, coalesce(title, printf('%s against %s%s%s', substr(y, 1, 120), substr(x, 1, 120),
    coalesce(', by ' || "by", ''), iif(spread, ' (mean; bars: least and largest)', ''))), x, y, 0) ||
  iif(log LIKE '%x%' AND NOT words, 'set logscale x
set format x ''%g''
' || (SELECT log_ticks('x', min(value), max(value)) FROM ticks WHERE axis = 'x' AND value > 0), '') ||
  iif(log LIKE '%y%', 'set logscale y
set format y ''%g''
' || (SELECT log_ticks('y', min(least), max(most)) FROM shown), '') || iif(words, tics || char(10), '') ||
  'set autoscale xfix
set offsets graph 0.03, graph 0.03, 0, 0
plot ' || (SELECT group_concat(printf('%s index %d using 1:2 with %s pt 7 ps 0.7 lw 2 dt %d lc rgb ''%s'' %s',
    quoted_file(name, '.dat'), place, iif(count > 40, 'points', 'linespoints'), 1 + place / 8, colour(place),
    iif("by" IS NULL, 'notitle', 'title ' || quoted(label))) || iif(spread, printf(', \
     %s index %d using 1:2:3:4 with yerrorbars pt 7 ps 0.7 lw 1 lc rgb ''%s'' notitle', quoted_file(name, '.dat'), place,
    colour(place)), ''), ', \
     ') FROM (SELECT * FROM ticks WHERE axis = 's' ORDER BY place))
FROM asked, axes, spread WHERE axis = 'x';
