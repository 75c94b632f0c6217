-- fit.sql: the table and the picture of `flesh fit`, from the table
--   numbers (file, experiment, measured, row, place, quantity, unit, t, value, deviation, fitted, residual)
-- of all measured numbers in their order: file: the number of what was `measured`, from 0; place: that of the quantity in it;
-- t: s, NULL at the end of a run; residual: over the deviation.

-- to fit.csv
SELECT experiment, measured, row, quantity, unit, t AS "t [s]", value, deviation, fitted, residual FROM numbers ORDER BY rowid;

-- A row of the picture for each of the first files, with the fit at the left and the residuals at the right; a block of data
-- for each quantity in it.
CREATE TEMP TABLE drawn AS
SELECT rowid AS number, *, dense_rank() OVER (ORDER BY file, place) - 1 AS block, min(t IS NOT NULL) OVER (PARTITION BY file) AS timed
FROM numbers WHERE file < 6 AND place < 8;

-- to fit.dat
SELECT iif(block > 0 AND number = min(number) OVER (PARTITION BY block), char(10, 10), '') ||
  printf('%s %s %s %s %s', number('%.9g', iif(timed, t, row)), number('%.9g', value), number('%.9g', deviation),
    number('%.9g', fitted), number('%.9g', residual))
FROM drawn ORDER BY block, number;

CREATE TEMP VIEW quantities AS
SELECT file, block, place, quantity, unit, experiment, timed, quoted(quantity) AS title, colour(place) AS colour
FROM drawn GROUP BY block;

-- to fit.gp
SELECT plot('fit', 1200, 340 * count(*), NULL, NULL, NULL, 0) || printf('set multiplot layout %d,2
', count(*)) || group_concat(printf('set title noenhanced font '',13''
set title %s
set xlabel noenhanced
set xlabel %s
set ylabel noenhanced
set ylabel %s
plot %s
set title ''residuals''
set ylabel ''(fitted - measured) / deviation''
plot 0 lc rgb ''#606060'' notitle, %s
', quoted(substr(experiment, 1, 80) || ': measured (points) and fitted (lines)'), quoted(iif(timed, 't [s]', 'row')),
    quoted(label), fits, residuals), '') || 'unset multiplot'
FROM (
  SELECT experiment, timed, ltrim(iif(count(*) = 1, quantity, '') || iif(min(unit) = max(unit) AND unit <> '', ' [' || unit || ']', ''))
      AS label,
    group_concat(printf('''fit.dat'' index %d using 1:2:3 with yerrorbars pt 7 ps 0.6 lc rgb ''%s'' title %s, '''' index %d '
      || 'using 1:4 with %s lc rgb ''%s'' notitle', block, colour, title, block, iif(timed, 'lines lw 2', 'points pt 4 ps 1'),
      colour), ', ') AS fits,
    group_concat(printf('''fit.dat'' index %d using 1:5 with points pt 7 ps 0.6 lc rgb ''%s'' notitle', block, colour), ', ')
      AS residuals
  FROM (SELECT * FROM quantities ORDER BY block) GROUP BY file ORDER BY file);
