-- plot_heat.sql: a figure of a sweep over two axes as heat maps (`flesh sweep plot --z`), from the tables of plot_ticks.sql.

-- A rectangle for each place: its number, or in grey why there is none.
CREATE TEMP TABLE cells AS
SELECT *, valued AND abs(mean) < 9e999 AS has_value, number('%.3g', mean) AS text FROM placed;
CREATE TEMP TABLE map AS
SELECT *, iif(most > least, most, least + 1) AS high, log LIKE '%z%' AND least > 0 AS is_log,
  (SELECT count FROM axes WHERE axis = 's') AS panels, (SELECT count FROM axes WHERE axis = 'x') AS along,
  (SELECT count FROM axes WHERE axis = 'y') AS up, (SELECT letters FROM axes WHERE axis = 'x') AS x_letters,
  (SELECT letters FROM axes WHERE axis = 'y') AS y_letters
FROM asked, (SELECT min(mean) AS least, max(mean) AS most, max(length(text)) AS letters FROM cells WHERE has_value);

-- Panels side by side, and below one another where they are many; sizes in pixels. A cell is as wide as its number. A letter
-- of a tic takes 8 pixels; tics of x that are many or long are turned by 60 degrees.
CREATE TEMP TABLE canvas AS
SELECT *, at_left + columns * panel_width + (columns - 1) * 24 + 135 AS width, 40 + rows * (panel_height + 34) + below AS height
FROM (
  SELECT *, (panels + columns - 1) / columns AS rows, max(220, (54 + 7 * max(0, letters - 6)) * min(along, 40)) AS panel_width,
    max(180, 34 * min(up, 30)) AS panel_height, max(90, 44 + 8 * y_letters, iif(is_turned, 5 * x_letters, 0)) AS at_left,
    iif(is_turned, max(60, 40 + 7 * x_letters), 60) AS below
  FROM (SELECT *, iif(panels <= 3, panels, CAST(ceil(sqrt(panels)) AS INT)) AS columns, along > 12 OR x_letters > 6 AND
    (8 * x_letters + 8) * along > 220 AS is_turned FROM map));
CREATE TEMP TABLE frame AS
SELECT *, 1.0 * at_left / width AS left, 1 - 135.0 / width AS right, 1.0 * below / height AS low, 1 - 74.0 / height AS top FROM canvas;

-- The labels of x and y are written once for all panels, the tics at the left and below only. Dark cells get light numbers.
-- to *.gp
SELECT text FROM (
  SELECT 0 AS kind, place AS s, printf('$panel%d << end_of_data
%s
end_of_data', place, (SELECT group_concat(printf('%d %d %s', x_place, y_place, iif(has_value, printf('%s "%s"',
      number('%.17g', mean), text), 'NaN ' || quoted(iif(why = 'complete', 'none', coalesce(why, 'none'))))), char(10))
    FROM (SELECT * FROM cells WHERE s_place = place ORDER BY x_place, y_place))) AS text
  FROM ticks WHERE axis = 's'
  UNION ALL
  SELECT 1, 0, plot(name, width, height, NULL, NULL, NULL, NULL) || 'set style fill solid noborder
set border 0
set tics scale 0 textcolor rgb ''#303030''
unset key
set palette defined (0 ''#fff7ec'', 0.2 ''#fdd49e'', 0.45 ''#fc8d59'', 0.7 ''#d7301f'', 1 ''#6a0000'')
' || iif(is_log, 'set logscale cb
set format cb ''%g''
' || log_ticks('cb', least, high), '') || printf('set cbrange [%s:%s]
set cblabel noenhanced
set cblabel %s
set xrange [-0.5:%s]
set yrange [-0.5:%s]
dark = %s
set title noenhanced
', number('%.17g', least), number('%.17g', high), quoted(z), number('%g', along - 0.5), number('%g', up - 0.5),
    number('%.17g', iif(is_log, exp(ln(least) + 0.6 * ln(high / least)), least + 0.6 * (high - least)))) ||
    printf('set multiplot layout %d,%d margins %.5f,%.5f,%.5f,%.5f spacing %.5f,%.5f title %s noenhanced font '',13''
', rows, columns, left, right, low, top, 24.0 / width, 34.0 / height, quoted(coalesce(title,
      printf('%s over %s and %s', substr(z, 1, 120), substr(x, 1, 100), substr(y, 1, 100))))) ||
    printf('set colorbox user origin %.5f,%.5f size %.5f,%.5f
set label 1 %s at screen %.5f,%.5f center noenhanced
set label 2 %s at screen %.5f,%.5f center rotate noenhanced', right + 20.0 / width, low, 16.0 / width, top - low, quoted(x),
      (left + right) / 2, 16.0 / height, quoted(y), 18.0 / width, (low + top) / 2)
  FROM frame
  UNION ALL
  SELECT 2, place, iif("by" IS NULL, '', 'set title ' || quoted(iif("by" GLOB '*[^A-Za-z0-9_]*', ltrim(label),
      substr("by", 1, 100) || ' = ' || label)) || char(10)) ||
    iif(place % columns, 'set ytics ('''' 0)', (SELECT tics FROM axes WHERE axis = 'y')) || char(10) ||
    iif(place + columns < panels, 'set xtics ('''' 0)', (SELECT tics FROM axes WHERE axis = 'x')) || char(10) ||
    iif(place + columns >= panels AND is_turned, 'set xtics rotate by 60 right' || char(10), '') ||
    iif(place = 1, 'unset colorbox
unset label
', '') || printf('plot $panel%d using 1:2:(0.49):(0.49) with boxxyerror lc rgb ''#d8d8d8'', \
     $panel%d using 1:2:(0.49):(0.49):3 with boxxyerror lc palette', place, place) || iif(along * up <= 150, printf(', \
     $panel%d using 1:2:(stringcolumn(4)):($3 > dark ? 0xffffff : 0x202020) with labels noenhanced font '',9'' tc rgb variable',
      place), '')
  FROM ticks, canvas WHERE axis = 's'
  UNION ALL SELECT 3, 0, 'unset multiplot')
ORDER BY kind, s;
