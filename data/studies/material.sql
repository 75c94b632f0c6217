-- material.sql: the table and the pictures of `flesh material`, from the tables
--   given (mu, lambda, young, poisson)  the constants, Pa; NULL where they were not given
--   paths (path, name, title, parameter, stress, low, high)  deformations, with words as gnuplot writes them
--   materials (line, energy, constants, label, colour, mu, lambda, twice)  twice: its form stands with other constants, too
--   samples (path, line, point, s, psi, psi_minus_rest, stress, smallest_eigenvalue)  NULL where there is no value

-- to material.csv
SELECT name AS path, number('%.6g', s) AS parameter, energy, constants, mu, lambda, psi, psi_minus_rest, s.stress AS stress,
  smallest_eigenvalue
FROM samples s JOIN materials USING (line) JOIN paths USING (path) ORDER BY s.path, line, point;

-- What the panels show, over mu: all that the curves cover without the few values next to a singularity, while energies have
-- a least value that is worth seeing.
CREATE TEMP TABLE panels AS
SELECT path, column1 AS quantity, 3 * path + column1 AS picture, column2 AS title, iif(column1 = 1, stress, column3) AS symbol
FROM paths, (VALUES (0, 'Energy above rest', '({/Symbol y} - {/Symbol y}_{rest})'), (1, 'Stress', ''),
  (2, 'Smallest eigenvalue of the Hessian', 'smallest eigenvalue'));
CREATE TEMP TABLE quantities AS
SELECT picture, line, point, CASE quantity WHEN 0 THEN psi_minus_rest WHEN 1 THEN stress ELSE smallest_eigenvalue END /
  (SELECT mu FROM given) AS y FROM samples JOIN panels USING (path);
CREATE TEMP TABLE ranges AS
SELECT picture, low - margin AS low, high + margin AS high, 3e-3 * (high - low + 2 * margin) AS near FROM (
  SELECT picture, coalesce(low, 0) AS low, coalesce(high, 0) AS high, max(0.08 * coalesce(high - low, 0), 0.05) AS margin FROM (
    SELECT picture, max(iif(place = iif(picture % 3, count / 20, 0), y, NULL)) AS low,
      max(iif(place = count - 1 - count / 20, y, NULL)) AS high
    FROM (SELECT picture, y, row_number() OVER (PARTITION BY picture ORDER BY y IS NULL, y) - 1 AS place,
            count(y) OVER (PARTITION BY picture) AS count FROM quantities) GROUP BY picture));

-- Curves nowhere further apart than half the line's width, and with values at the same places, are one line.
CREATE TEMP TABLE lines AS SELECT picture, line, 0 AS kind FROM panels, materials;
CREATE TEMP TABLE curves (picture, line INTEGER, point INTEGER, x, y, PRIMARY KEY (picture, line, point)) WITHOUT ROWID;
INSERT INTO curves SELECT picture, line, point, 0, min(max(y, low), high) FROM quantities JOIN ranges USING (picture);
CREATE TEMP TABLE same AS
SELECT picture, line, first, iif(twice, label, energy) AS name, label, energy, constants,
  printf('lc rgb ''%s'' dt %s lw 2.4', colour, CASE constants WHEN 'raw' THEN '(11,8)' WHEN 'matched' THEN 'solid' ELSE '(2,6)'
    END) AS style
FROM first_lines JOIN materials USING (line);
CREATE TEMP TABLE shared AS
SELECT picture, group_concat(names, '; another: ') AS names FROM (
  SELECT picture, group_concat(name, ', ') AS names FROM (SELECT * FROM same ORDER BY line) GROUP BY picture, first
  HAVING count(*) > 1 ORDER BY picture, first) GROUP BY picture;

-- to each.gp
SELECT name, plot(name, 1200, 860, NULL, NULL, NULL, NULL) || printf('set datafile separator '',''
unit = %s
pick(path, energy, constants, column) = (strcol(1) eq path && strcol(3) eq energy && strcol(4) eq constants) ? column / unit : NaN
set multiplot layout 2,2 margins 0.075,0.975,0.075,0.875 spacing 0.085,0.145 title "%s\n" font '',15''
set border 3 lc rgb ''#404040''
set tics nomirror
set grid lc rgb ''#DDDDDD'' lt 1
set key off
set xrange [%s:%s]
set xlabel ''%s'' offset 0,0.3
set xzeroaxis lc rgb ''#404040'' lt 1
', number('%.17g', mu), p.title, number('%g', p.low), number('%g', p.high), parameter) || (
    SELECT group_concat(printf('set title ''%s'' font '',12'' offset 0,0.6
set label 1 %s noenhanced at graph 0.5,1.035 center font '',9'' tc rgb ''#505050''
set ylabel ''%s / {/Symbol m}  [-]'' offset 1,0
set yrange [%s:%s]
plot \
%s  NaN notitle
unset label 1
', q.title, quoted(coalesce('one line: ' || names, '')), symbol, number('%g', r.low), number('%g', r.high), (
        SELECT group_concat(printf('  ''material.csv'' skip 1 using 2:(pick(''%s'',''%s'',''%s'',$%d)) with lines %s notitle, \
', p.name, energy, constants, 8 + quantity, style), '') FROM (SELECT * FROM same s WHERE s.picture = q.picture AND first = line
          ORDER BY line))), '')
    FROM (SELECT * FROM panels WHERE path = p.path ORDER BY quantity) q JOIN ranges r USING (picture)
    LEFT JOIN shared USING (picture)) ||
  'unset border
unset tics
unset grid
unset xlabel
unset ylabel
unset xzeroaxis
set title ''Energies and their constants'' font '',12''
set key at graph 0.5,0.56 center center samplen 6 spacing 1.5 font '',12'' Left reverse width 2
set xrange [0:1]
set yrange [0:1]
' || printf('set label 1 ''{/Symbol m} = %s Pa, {/Symbol l} = %s Pa%s'' at graph 0.5,0.03 center font '',11''
set label 2 "A curve ends where its energy has no value.\n' ||
  'Curves that lie on each other are one line, listed above the panel." at graph 0.5,-0.04 center font '',9'' tc rgb ''#606060''
plot NaN notitle, \
', number('%.4g', mu), number('%.4g', lambda), iif(young IS NULL, '', printf('  (E = %s Pa, {/Symbol n} = %s)',
      number('%.4g', young), number('%.6g', poisson)))) || (
    SELECT group_concat(printf('  keyentry with lines %s title ''%s''', style, iif(constants = 'as_e', 'D as\_e', label)), ', \
') FROM (SELECT * FROM same WHERE picture = 0 ORDER BY line)) || '
unset multiplot'
FROM paths p, given;
