-- ablation.sql: what each technique of the solver is worth (`flesh hardcases --ablation`), from the table `runs` of
-- hardcases.sql.

-- Each run without a technique beside the one by default; costs are of those that pass both ways.
CREATE TEMP TABLE compared AS
SELECT a.number AS number, substr(b.solver, 9) AS technique, min(b.number) OVER (PARTITION BY b.solver) AS place, a.element,
  a.poisson, a.grp, NOT a.passes AS failed_default, NOT b.passes AS failed_without, a.passes AND b.passes AS both,
  a.newton AS newton_default, b.newton AS newton_without, a.linear AS linear_default, b.linear AS linear_without,
  a.cpu_s AS cpu_default, b.cpu_s AS cpu_without
FROM (SELECT *, outcome IN ('recovered', 'untangled', 'equilibrium') AS passes FROM runs) a
JOIN (SELECT *, outcome IN ('recovered', 'untangled', 'equilibrium') AS passes FROM runs) b
  USING (name, seed, poisson, step, energy, constants, element, mesh)
WHERE a.solver = 'default' AND b.solver LIKE 'without-%' AND a.outcome <> 'not run' AND b.outcome <> 'not run';

-- Runs that are compared with each other: an element, a Poisson's ratio and a group of cases.
CREATE TEMP TABLE sets AS
SELECT technique, place, element, poisson, grp, min(number) AS first, count(*) AS runs, sum(failed_default) AS failed_default,
  sum(failed_without) AS failed_without, total(newton_default * both) AS newton_default,
  total(newton_without * both) AS newton_without, total(linear_default * both) AS linear_default,
  total(linear_without * both) AS linear_without, total(cpu_default * both) AS cpu_default,
  total(cpu_without * both) AS cpu_without
FROM compared GROUP BY technique, element, poisson, grp;
-- to ablation.csv
SELECT technique, element, number('%g', poisson) AS poisson, grp AS "group", runs, failed_default, failed_without,
  CAST(newton_default AS INT) AS newton_default, CAST(newton_without AS INT) AS newton_without,
  CAST(linear_default AS INT) AS linear_default, CAST(linear_without AS INT) AS linear_without,
  number('%.3f', cpu_default) AS cpu_s_default, number('%.3f', cpu_without) AS cpu_s_without
FROM sets ORDER BY place, first;

-- The excess without it, and in which set it saves most: of Newton iterations, or of CPU time where that is 2 s or more.
CREATE TEMP VIEW saved AS
SELECT technique, place, first, element, poisson, grp,
  max(coalesce(iif(newton_default > 0, newton_without / newton_default - 1, NULL), cpu),
    coalesce(cpu, newton_without / newton_default - 1)) AS most
FROM (SELECT *, iif(cpu_default >= 2, cpu_without / cpu_default - 1, NULL) AS cpu FROM sets);
CREATE TEMP TABLE worth AS
SELECT s.technique, s.place, sum(failed_default) AS failed_default, sum(failed_without) AS failed_without,
  sum(newton_without) / sum(newton_default) - 1 AS newton, sum(linear_without) / sum(linear_default) - 1 AS linear,
  sum(cpu_without) / sum(cpu_default) - 1 AS cpu, m.most, m.element, m.poisson, m.grp
FROM sets s LEFT JOIN (SELECT *, row_number() OVER (PARTITION BY technique ORDER BY most DESC, first) AS rank FROM saved
  WHERE most IS NOT NULL) m ON m.technique = s.technique AND m.rank = 1
GROUP BY s.technique;

-- to verdict.txt
SELECT printf('%sThe default: %d runs, %d of them do not come back, %d Newton and %d linear iterations, %s s of CPU%s', char(10),
  count(*), total(NOT passes), total(newton * passes), total(linear * passes), number('%.1f', total(cpu_s * passes)), char(10))
FROM (SELECT *, outcome IN ('recovered', 'untangled', 'equilibrium') AS passes FROM runs
  WHERE solver = 'default' AND outcome <> 'not run');
-- to verdict.txt
SELECT 'Changes without each technique, over the runs that come back with and without it. A technique earns its place
where it saves a run, or 5 % of the Newton iterations of a set (an element, a Poisson''s ratio, a group of
cases), or of its CPU time where that is 2 s or more.

| without | failed with, without | Newton | linear | CPU | most, in a set | earns its place |
|---|---|---|---|---|---|---|';
-- to verdict.txt
SELECT printf('| %s | %d, %d | %s | %s | %s | %s | %s |', technique, failed_default, failed_without,
  iif(newton IS NULL, '-', printf('%+.1f %%', 100 * newton)),
  iif(linear IS NULL, '-', printf('%+.1f %%', 100 * linear)), iif(cpu IS NULL, '-', printf('%+.1f %%', 100 * cpu)),
  iif(most IS NULL, '-', printf('%+.1f %% (%s, %s, %s)', 100 * most, element, number('%g', poisson), grp)),
  iif(failed_without > failed_default OR most >= 0.05, 'yes', 'no'))
FROM worth ORDER BY place;
