-- recovery.sql: the verdict of `flesh hardcases`, from the table `runs` of hardcases.sql.

-- Outcomes from best to worst.
CREATE TEMP VIEW outcomes (place, outcome) AS
VALUES (1, 'recovered'), (2, 'untangled'), (3, 'equilibrium'), (4, 'stressed at rest'), (5, 'not recovered'),
  (6, 'unconverged'), (7, 'stopped'), (8, 'out of budget'), (9, 'non-finite'), (10, 'crashed or hung'), (11, 'not run');
-- Of each run whether it has ended as it should, and whether it is promised to (`flesh hardcases --help`).
CREATE TEMP TABLE judged AS
SELECT *, place <= 3 AS passes, place > 3 AND place < 11 AS fails,
  energy IN ('S', 'E') AND element = 'tet4' AND solver = 'default' AND (poisson < 0.4951 OR NOT hardest) AS promised
FROM runs JOIN outcomes USING (outcome) LEFT JOIN end_names ON kind = end_kind;

-- to verdict.txt
SELECT '
Back at rest, or in the equilibrium that was to be kept';
-- to verdict.txt
SELECT printf('  %-28s %3d of %d', title, sum(passes), count(*)) ||
  iif(sum(place = 2), printf(' (%d of them untangled)', sum(place = 2)), '') ||
  coalesce((SELECT group_concat(printf(', %d %s', count, outcome), '') FROM
    (SELECT count(*) AS count, outcome FROM judged o WHERE o.title = j.title AND place > 3 GROUP BY place ORDER BY place)), '') ||
  printf('; %d Newton iterations, %d solves retried, %s s of CPU', sum(newton), sum(retried), number('%.1f', total(cpu_s))) ||
  iif(sum(rises) > 0, printf('; the incremental potential rose %d times', sum(rises)), '')
FROM judged j GROUP BY title ORDER BY min(number);

-- What there is to say of a run that fails.
CREATE TEMP VIEW failures AS
SELECT number, promised, printf('  %s, %s%s: %s', name, title, iif(random, ', seed ' || seed, ''), outcome) ||
  iif(outcome = 'unconverged', printf(' (%d solves; the potential rose %d times, by %s of its size)', unconverged, rises,
    number('%.2g', worst_rise)), '') ||
  iif(stressed_rest > 0, printf(', %s J of strain energy that no load holds', number('%.4g', stressed_rest)), '') ||
  iif(place BETWEEN 4 AND 6, iif(distance IS NULL, ', this form has no rest shape',
      printf(', %s of the length from rest, volume off by %s, %d tets inverted', number('%.2g', distance),
        number('%.2g', volume_error), inverted_end)) ||
    CASE end_kind
      WHEN 1 THEN printf('; a true local minimum (smallest eigenvalue %s N/m)', number('%.2g', smallest_eigenvalue))
      WHEN 3 THEN printf('; a saddle (%d negative eigenvalues)', negative_eigenvalues)
      WHEN 4 THEN '; a static solve from there leads back to rest' ELSE coalesce('; ' || end_is, '') END, '') ||
  iif(message <> '', ': ' || message, '') || printf('%s      flesh run %s/%s/scene.yaml', char(10), out, folder)
  AS words
FROM judged WHERE fails;
-- to verdict.txt
SELECT printf('%sPromised to come back (S and E, tet4, default solver; above nu = 0.495 not from scramble or point): ' ||
  '%d of %d do%s',
  char(10), total(passes), count(*), iif(sum(fails), '; these do not:', '.'))
FROM judged WHERE promised AND outcome <> 'not run';
-- to verdict.txt
SELECT words FROM failures WHERE promised ORDER BY number;
-- to verdict.txt
SELECT printf('%sThe others that do not: %d', char(10), count) FROM (SELECT count(*) AS count FROM failures WHERE NOT promised)
WHERE count;
-- to verdict.txt
SELECT words FROM failures WHERE NOT promised ORDER BY number;

-- to verdict.txt
SELECT '
The slowest runs (CPU)';
-- to verdict.txt
SELECT printf('  %6s s  %-18s %-24s %6d Newton %8d linear', number('%.2f', coalesce(cpu_s, 0)), name, title, newton, linear) ||
  coalesce(', worst step ' || iif(abs(newton_ratio) < 1e300, number('%.3g', newton_ratio), NULL) || ' times the median', '')
FROM runs ORDER BY coalesce(cpu_s, 0) DESC, number LIMIT 10;

-- Steps that stand far out from the others of their run.
CREATE TEMP VIEW long_steps AS SELECT * FROM runs WHERE longest_ratio > 100;
-- to verdict.txt
SELECT printf('%sRuns with a step that took more than 100 times the iterations of their median step: %d', char(10), count(*))
FROM long_steps;
-- to verdict.txt
SELECT printf('  %s: step %d (%s) took %d Newton and %d linear iterations, %s times the median step%s', folder, longest_step,
  iif(longest_t IS NULL, 'not finished', 'to t = ' || number('%.6g', longest_t) || ' s'), longest_newton, longest_linear,
  number('%.4g', longest_ratio), iif(longest_cuts > 0, printf(', with cuts: %d', longest_cuts), ''))
FROM long_steps ORDER BY number;
