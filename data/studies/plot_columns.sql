-- plot_columns.sql: the columns that `flesh plot` draws. `asked` has what the command line says, `headers` the columns of all
-- tables, of which a folder (source) may have several: column `column` of table `tab` in `file`, with its number of rows.

-- The columns that each word means: of --y by their number, of --x and --by. "probe." may stand before a name, NAME.x for
-- NAME.position_x, and * for any letters.
CREATE TEMP TABLE meant AS
WITH RECURSIVE split (number, word, rest) AS (
  SELECT 0, '', y || ',' FROM asked
  UNION ALL
  SELECT number + 1, substr(rest, 1, instr(rest, ',') - 1), substr(rest, instr(rest, ',') + 1) FROM split WHERE rest <> ''),
words AS (
  SELECT 'y' AS axis, number, word FROM split WHERE word <> ''
  UNION ALL SELECT 'x', 0, coalesce(x, 't') FROM asked
  UNION ALL SELECT 'by', 0, "by" FROM asked WHERE "by" IS NOT NULL),
short AS (SELECT *, iif(word GLOB 'probe.?*', substr(word, 7), word) AS short FROM words)
SELECT axis, number, word, h.* FROM short LEFT JOIN headers h ON header IN (word, short) OR name GLOB short OR
  (short GLOB '*.[xyz]' AND name = substr(short, 1, length(short) - 1) || 'position_' || substr(short, -1));
CREATE TEMP VIEW y_words AS
SELECT * FROM (SELECT DISTINCT source, path FROM headers), (SELECT DISTINCT number, word FROM meant WHERE axis = 'y');

-- The first column that a word means, or all of a pattern. Without a column of that name x is in another table of the
-- source with as many rows, or by default the first column.
CREATE TEMP TABLE chosen AS
SELECT *, row_number() OVER (ORDER BY source, number, id) AS place,
  coalesce(own_x, iif((SELECT x FROM asked) IS NULL, default_x, any_x)) AS x_id
FROM (SELECT *, row_number() OVER (PARTITION BY source, number ORDER BY id) AS nth,
    (SELECT min(id) FROM meant m WHERE axis = 'x' AND m.source = y.source AND m.tab = y.tab) AS own_x,
    (SELECT min(id) FROM meant m WHERE axis = 'x' AND m.source = y.source) AS any_x,
    (SELECT min(id) FROM headers h WHERE h.source = y.source AND h.tab = y.tab) AS default_x,
    (SELECT min(id) FROM meant m WHERE axis = 'by' AND m.source = y.source AND m.tab = y.tab) AS by_id
  FROM meant y WHERE axis = 'y' AND id IS NOT NULL)
WHERE nth = 1 OR word GLOB '*[*?]*';
-- Their error bars.
CREATE TEMP TABLE bars AS
SELECT place, h.id FROM chosen c JOIN headers h USING (source, tab)
WHERE h.name IN (c.name || '_error_mesh', c.name || '_error_step');
CREATE TEMP VIEW needed AS
SELECT id, source, tab, "column" FROM headers WHERE id IN (SELECT id FROM chosen UNION SELECT x_id FROM chosen
  UNION SELECT by_id FROM chosen UNION SELECT id FROM bars);

-- to error
WITH
lacks AS (
  SELECT source, path, word, number, 0 AS kind FROM y_words w
  WHERE NOT EXISTS (SELECT 1 FROM meant m WHERE axis = 'y' AND m.source = w.source AND m.number = w.number)
  UNION ALL SELECT source, path, x, number, 1 FROM asked, chosen WHERE x_id IS NULL
  UNION ALL SELECT source, path, "by", number, 3 FROM asked, chosen WHERE "by" IS NOT NULL AND by_id IS NULL)
SELECT sentence FROM (
  SELECT source, number, kind, printf('%s has no column %s; it has %s', path, word, (SELECT group_concat(name, ', ')
    FROM (SELECT name FROM headers h WHERE h.source = l.source AND (tab = 0 OR name <> 't') ORDER BY id))) AS sentence
  FROM lacks l
  UNION ALL
  SELECT y.source, number, 2, printf('%s is in %s, which has %d rows; %s has %d, so that the two do not make a curve', x, h.file,
    h.rows, y.file, y.rows) FROM asked, chosen y JOIN headers h ON h.id = x_id WHERE h.rows <> y.rows
  UNION ALL
  SELECT y.source, y.number, 4, printf('%s is in %s and %s in %s; one axis has one unit: plot them apart', f.name,
    iif(f.unit = '', 'numbers without a unit', f.unit), y.name, iif(y.unit = '', 'numbers without a unit', y.unit))
  FROM chosen y JOIN chosen f ON f.place = 1 WHERE y.unit <> f.unit)
ORDER BY source, number, kind LIMIT 1;
