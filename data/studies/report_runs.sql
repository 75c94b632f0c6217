-- report_runs.sql: what a report has of folders of `flesh run` (drivers/report/studies.c), from the table
--   runs (number, folder, name, result)  result.json, NULL without

CREATE TABLE figures (number, key, value REAL);
INSERT INTO figures SELECT number, key, value FROM runs, json_each(result, '$.figures') WHERE type IN ('integer', 'real');

CREATE VIEW told AS
SELECT r.*, result ->> 'status' AS status, coalesce(result ->> 'message', '') AS message, result ->> 'warning' AS warning,
  result ->> 'notes' AS notes, coalesce(result ->> '$.materials[0].energy', '') AS energy,
  max(iif(key = 'steps', value, NULL)) AS steps, max(iif(key = 't_end', value, NULL)) AS t_end,
  max(iif(key = 'max_volume_drift', value, NULL)) AS drift, max(iif(key = 'final_volume_drift', value, NULL)) AS final_drift,
  max(iif(key = 'J_min', value, NULL)) AS J_min, max(iif(key = 'J_bound', value, NULL)) AS J_bound,
  max(iif(key = 'max_inverted', value, NULL)) AS inverted, max(iif(key = 'first_inverted_t', value, NULL)) AS first_inverted_t,
  max(iif(key = 'solves', value, NULL)) AS solves, max(iif(key = 'solves_unconverged', value, NULL)) AS unconverged
FROM runs r LEFT JOIN figures f USING (number) GROUP BY r.number;

-- to verdict
SELECT printf('Of %d runs %s changed its volume least, by %s %%, and %s most, by %s %%.', (SELECT count(*) FROM runs), a.name,
  number('%.3g', 100 * a.drift), b.name, number('%.3g', 100 * b.drift))
FROM (SELECT * FROM told WHERE drift IS NOT NULL ORDER BY drift, number LIMIT 1) a,
  (SELECT * FROM told WHERE drift IS NOT NULL ORDER BY drift DESC, number LIMIT 1) b
WHERE a.number <> b.number;

-- How each ended, and what became of its volume and its tets.
-- to verdict
SELECT text FROM (
  SELECT number, 0 AS at, iif(result IS NULL, printf('%s left no result.json: it is still going on, or it was killed.', name),
    printf('%.300s is %.200s', name, status) ||
    iif(steps >= 0 AND t_end IS NOT NULL, printf(' after %d steps, at t = %s s', steps, number('%.4g', t_end)), '') ||
    iif(message <> '', printf(': %.1200s', message), '') ||
    iif(drift IS NULL, '.', printf('. Its volume changed by at most %s %%, at the end by %s %%; %s.', number('%.3g', 100 * drift),
      number('%.2g', 100 * abs(final_drift)), CASE
        WHEN inverted > 0 THEN printf('up to %d tets were inverted (J <= 0 at a point of quadrature), first at t = %s s',
          inverted, number('%.4g', first_inverted_t))
        WHEN J_bound <= 0 THEN printf('no tet was inverted (least J %s at a point of quadrature; its lower bound near corners ' ||
          'is %s)', number('%.4g', J_min), number('%.2g', J_bound))
        ELSE printf('no tet was inverted (least J %s)', number('%.4g', J_min)) END))) AS text FROM told
  UNION ALL SELECT number, 1, printf('%s: %s', name, warning) FROM told WHERE warning <> ''
  UNION ALL SELECT number, 2, printf('%s: %s.', name, notes) FROM told WHERE notes <> ''
  UNION ALL SELECT number, 3, printf('%s: %d of %d solves did not reach the tolerance.', name, unconverged, solves) FROM told
    WHERE unconverged > 0)
ORDER BY number, at;

-- to figures
SELECT iif((SELECT count(*) FROM runs) > 1, 'Figures of the runs', 'Figures of the run') AS title, name AS run, energy,
  iif(result IS NULL, 'no result', coalesce(status, '')) AS status, steps, t_end AS "t_end [s]", drift AS max_volume_drift,
  final_drift AS final_volume_drift, J_min, J_bound, inverted AS max_inverted, max(iif(key = 'newton_per_step', value, NULL)) AS
  newton_per_step, max(iif(key = 'linear_per_newton', value, NULL)) AS linear_per_newton,
  max(iif(key = 'residual', value, NULL)) AS "residual [N]", max(iif(key = 'work_put_in', value, NULL)) AS "work_put_in [J]",
  max(iif(key = 'energy_gain', value, NULL)) AS energy_gain, max(iif(key = 'cpu_s', value, NULL)) AS "cpu [s]",
  max(iif(key = 'peak_memory_kB', value, NULL)) AS "peak memory [kB]"
FROM told t LEFT JOIN figures f USING (number) GROUP BY t.number ORDER BY t.number;

-- to plots
SELECT 'History', 't', '', '', 1, -1;
-- to histories
SELECT folder, 'history.csv', name, colour_of(energy) FROM told ORDER BY number;
-- to plots
SELECT 'Probes', 't [s]', '', '', 1, -1 FROM runs WHERE is_there(folder || '/probes.csv') LIMIT 1;
-- to histories
SELECT folder, 'probes.csv', name, colour_of(energy) FROM told WHERE is_there(folder || '/probes.csv') ORDER BY number;
-- to runs
SELECT folder, name, 0 FROM runs ORDER BY number;
-- to sources
SELECT printf('%s: %s', name, title), folder || file, key
FROM runs, (SELECT 0 AS at, 'scene' AS title, '/scene.yaml' AS file, NULL AS key
            UNION ALL SELECT 1, 'result and provenance', '/result.json', '')
ORDER BY number, at;
