-- fit_words.sql: what `flesh fit` says of its end, in result.json and on stdout, from a table found (data) with the object {result,
-- out, map}: result.json with the first sentences; the folder; of a map {low, high, unit, is_share, hardly_known, at_bounds}.

CREATE TEMP TABLE keys AS
SELECT key AS number, value ->> 'name' AS name, value ->> 'value' AS best, value ->> 'standard_error' AS error,
  value ->> 'low_95' AS low, coalesce(value ->> 'high_95', 9e999) AS high, value ->> 'at_bound' AS bound
FROM found, json_each(data, '$.result.parameters');
CREATE TEMP TABLE fits AS
SELECT data ->> '$.result.residuals.degrees_of_freedom' AS freedom, data ->> '$.result.residuals.scale' AS scale,
  number('%.3g', data ->> '$.result.residuals.scale') AS times, data -> '$.result.map' IS NOT NULL AS is_map,
  data ->> '$.result.map.weight_from' AS weight_from, json_array_length(data, '$.result.map.stages') AS stages,
  data ->> '$.result.map.tets' AS tets, data ->> '$.result.map.determined_numbers' AS determined,
  data ->> '$.result.map.median_deviation' AS median, data ->> '$.result.map.largest_deviation' AS largest,
  data ->> '$.map.is_share' AS is_share, data ->> '$.map.hardly_known' AS hardly_known, data ->> '$.map.at_bounds' AS at_bounds
FROM found;

CREATE TEMP TABLE sentences (kind, first, second, text);
INSERT INTO sentences SELECT 0, key, 0, value FROM found, json_each(data, '$.result.identifiability');
INSERT INTO sentences
SELECT 1, number, -1, iif(bound IS NOT NULL,
  printf('%s stays at its %s bound: it has no error, and the errors of the others assume that it stays there.', name, bound),
  printf('%s is hardly determined: its standard error is %s %% of it.', name,
    number('%.3g', coalesce(100 * error / abs(best), 9e999))))
FROM keys WHERE bound IS NOT NULL OR error > 0.3 * abs(best);
INSERT INTO sentences
SELECT 1, first, second, printf('%s and %s are hardly told apart: their errors have a correlation of %s.', b, a,
  number('%.4f', correlation))
FROM (SELECT a.number AS first, b.number AS second, a.name AS a, b.name AS b,
        data ->> printf('$.result.correlation[%d][%d]', a.number, b.number) AS correlation
      FROM found, keys a JOIN keys b ON b.number < a.number) WHERE abs(correlation) > 0.98;
-- If the residuals are too large, the search may have missed the best parameters.
INSERT INTO sentences
SELECT 2, 0, 0, iif((SELECT count(*) FROM keys) = 1, 'The parameter is', 'All parameters are') || ' determined.'
FROM fits WHERE NOT EXISTS (SELECT 1 FROM sentences) AND EXISTS (SELECT 1 FROM keys) AND coalesce(scale, 0) <= 1.5;
INSERT INTO sentences
SELECT 3, 0, 0, iif(freedom <= 0,
  'There are no more measured numbers than parameters: the errors rest on the stated deviations.',
  printf('The residuals are %s times the stated deviations, which the errors allow for: %s.', times, iif(scale > 1,
    'the deviations are too small, the scene leaves something out, or another start finds better parameters',
    'the deviations are too large')))
FROM fits WHERE NOT is_map AND (freedom <= 0 OR scale > 1.5 OR scale < 1 / 1.5);

INSERT INTO sentences
SELECT 3, 1, 0, CASE
  WHEN weight_from = 'spec' THEN printf('The residuals are %s times the stated deviations: the weight is %s, or the ' ||
    'deviations are not those of the measurements.', times, iif(scale > 1, 'too large', 'too small'))
  WHEN scale > 1 THEN printf('The residuals stay %s times the stated deviations, however rough the map may be: the deviations ' ||
    'are too small, or the scene leaves something out. This is the smoothest map that fits as well.', times)
  ELSE 'A nearly uniform value agrees with the measurements within their deviations: they say nothing of differences ' ||
    'between tets.' END
FROM fits WHERE is_map AND iif(weight_from = 'spec', scale > 1.5 OR scale < 1 / 1.5,
  scale * scale > 1.05 OR (scale * scale < 0.95 AND stages = 1));
INSERT INTO sentences
SELECT 3, 2, 0, iif(median IS NULL,
  'Deviations of tets, and of parameters beside them, are found for maps of 2500 tets and fewer.',
  printf('The measurements determine about %s numbers of the map; the penalty fills in the rest of its %d tets.',
    number('%.0f', determined), tets)) FROM fits WHERE is_map;
INSERT INTO sentences
SELECT 3, 3, 0, printf('The deviation of a tet''s value is %s %%%s (median), at most %s %%, where maps are as smooth as the ' ||
  'penalty says.', number('%.2g', 100 * median), iif(is_share, '', ' of start'), number('%.2g', 100 * largest))
FROM fits WHERE median IS NOT NULL;
INSERT INTO sentences
SELECT 3, 4, 0, printf('%d tets have a deviation above 50 %%: the measurements hardly say their values (tets.csv).', hardly_known)
FROM fits WHERE hardly_known > 0;
INSERT INTO sentences
SELECT 3, 5, 0, printf('%d tets lie at a bound (from, to): their values may be beyond it.', at_bounds)
FROM fits WHERE at_bounds > 0;
CREATE TEMP VIEW said AS SELECT text FROM sentences ORDER BY kind, first, second LIMIT 256;

-- to result.json
SELECT json_set(data -> '$.result', '$.identifiability', json((SELECT json_group_array(text) FROM said))) FROM found;

-- to stdout
SELECT printf('%s of %d tets from %s to %s', data ->> '$.result.map.constant', data ->> '$.result.map.tets',
  number('%.6g', data ->> '$.map.low'), number('%.6g', data ->> '$.map.high')) ||
  iif(data ->> '$.map.unit' = '', '', ' ' || (data ->> '$.map.unit')) FROM found, fits WHERE is_map;
-- to stdout
SELECT name || ' = ' || number('%.6g', best) || iif(error IS NULL, '', printf(' +/- %s (95 %%: %s to %s)',
  number('%.2g', error), number('%.6g', low), number('%.6g', high))) FROM keys ORDER BY number;
-- to stdout
SELECT text FROM said;
-- to stdout
SELECT data ->> '$.result.message' FROM found WHERE data ->> '$.result.message' <> '';
-- to stdout
SELECT printf('derivatives of %s are %s', value ->> 'name', value ->> 'derivatives')
FROM found, json_each(data, '$.result.experiments') WHERE value ->> 'derivatives' LIKE 'by differences: %';
-- to stdout
SELECT printf('%d measured numbers, ', data ->> '$.result.residuals.measured_numbers') || iif(is_map,
  printf('residuals %s times their deviations, weight %s, %d runs, %d linear solves',
    number('%.4g', scale), number('%.4g', data ->> '$.result.map.weight'), data ->> '$.result.runs.used',
    data ->> '$.result.runs.linear_solves'),
  printf('sum of squares %s, %d iterations, %d runs', number('%.6g', data ->> '$.result.residuals.sum_of_squares'),
    data ->> '$.result.iterations', data ->> '$.result.runs.used')) FROM found, fits;
-- to stdout
SELECT 'results: ' || (data ->> '$.out') FROM found;
