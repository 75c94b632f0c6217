-- report_fit.sql: what a report has of a folder of `flesh fit` (drivers/report/studies.c), from the table
--   runs (number, folder, name, result)  the fit's result.json, NULL without

-- to verdict
SELECT CASE WHEN result IS NULL THEN 'The fit left no result.json: it is still going on, or it was killed.'
  WHEN result ->> 'status' <> 'complete' OR json_type(result, '$.parameters') IS NULL
    THEN printf('The fit is %s: %s', result ->> 'status', result ->> 'message')
  ELSE printf('%d measured numbers are fitted in %d iterations; the sum of squares is %s.',
    result ->> '$.residuals.measured_numbers', result ->> 'iterations', number('%.4g', result ->> '$.residuals.sum_of_squares'))
  END FROM runs;
CREATE TEMP VIEW parameters AS
SELECT p.key AS place, value ->> 'name' AS name, value ->> 'key' AS key, value ->> 'value' AS found,
  value ->> 'standard_error' AS error, value ->> 'low_95' AS low, value ->> 'high_95' AS high, value ->> 'start' AS start,
  value ->> 'at_bound' AS bound FROM runs, json_each(result, '$.parameters') p;
-- to verdict
SELECT printf('%s = %s%s', name, number('%.6g', found), CASE WHEN bound IS NOT NULL THEN printf(', at its %s bound', bound)
  WHEN error IS NULL THEN ', without an error' ELSE printf(' +/- %s (95 %%: %s to %s)', number('%.2g', error),
  number('%.6g', low), number('%.6g', high)) END) FROM parameters ORDER BY place;
-- to verdict
SELECT s.value FROM runs, json_each(result, '$.identifiability') s ORDER BY s.key;
-- to figures
SELECT 'Parameters', name, key, found AS value, error AS standard_error, low AS low_95, high AS high_95, start,
  coalesce(bound, '') AS at_bound FROM parameters ORDER BY place;
-- to figures
SELECT 'Experiments', value ->> 'name' AS experiment, value ->> 'measured_numbers' AS measured_numbers,
  value ->> 'residual_rms' AS residual_rms, value ->> 'derivatives' AS derivatives
FROM runs, json_each(result, '$.experiments') ORDER BY json_each.key;
-- to tables
SELECT 'fit.csv', 0;
-- to plots
SELECT column1, 'value', column2, '', 0, number, 'experiment' FROM tables, (VALUES ('Fitted against measured numbers', 'fitted'),
  ('Residuals over deviations', 'residual')) WHERE name = 'fit.csv';
-- to sources
SELECT column1, 'result.json', column2 FROM (VALUES ('correlation', 'correlation'), ('covariance', 'covariance'),
  ('provenance', 'program')) JOIN runs ON result IS NOT NULL;
