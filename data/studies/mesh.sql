-- mesh.sql: the errors of meshes of `flesh accuracy --mesh` as tables, with what reaches an error in the least time;
-- mesh_words.sql tells of them. The tables of runs.sql are there.

-- The one row of all runs on meshes (shared_method NULL: in equilibrium), and what was found of them, lengths in m.
CREATE TEMP TABLE about AS
SELECT number AS limits, data ->> 'shared' AS shared, data ->> 'shared_method' AS shared_method,
  data ->> 'shared_step' AS shared_step,
  data ->> 'point_load' AS point_load FROM facts WHERE data ->> 'shared' IS NOT NULL;
CREATE TEMP TABLE found AS
SELECT table_rows.number AS place, data FROM table_rows JOIN wanted ON id = case_id JOIN about ON wanted.number = limits;
CREATE TEMP TABLE known AS
SELECT data ->> 'first' AS first, nullif(data ->> 'second', '') AS second, (data ->> 'apart') / (data ->> 'motion') AS apart,
  (data ->> 'uncertainty') / (data ->> 'motion') AS open, data ->> 'motion' AS motion
FROM (SELECT 1) LEFT JOIN found ON data ->> 'motion' IS NOT NULL;
CREATE TEMP TABLE limits AS
SELECT place, data ->> 'element' AS element, data ->> 'levels' AS levels, data ->> 'order' AS "order",
  data ->> 'coarse' AS coarse,
  data ->> 'fine' AS fine FROM found WHERE data ->> 'levels' IS NOT NULL;
CREATE TEMP TABLE meshes AS
SELECT f.data ->> 'mesh' AS mesh, f.data ->> 'element' AS element, f.data ->> 'kind' AS kind, f.data ->> 'refine' AS refine,
  f.data ->> 'source' AS source, f.data ->> 'own' AS own, tet_count AS tets, node_count AS nodes, largest_poisson AS poisson,
    cpu_s,
  CASE WHEN coalesce(status, 'planned') IN ('planned', 'running') THEN 'not run'
    WHEN e.data ->> 'elsewhere' THEN 'starts elsewhere' WHEN e.data ->> 'below' THEN 'below reference' ELSE status END AS status,
  coalesce(status_code = 0, 0) AND NOT coalesce(e.data ->> 'elsewhere', 0) AS ended, e.data ->> 'error' AS error,
  coalesce(e.data ->> 'below', 0) AS below, iif(e.data ->> 'below', open, e.data ->> 'error') AS mesh_error
FROM facts f JOIN known LEFT JOIN wanted w ON w.number = f.number LEFT JOIN results USING (id)
LEFT JOIN found e ON e.data ->> 'mesh' = f.data ->> 'mesh' WHERE f.data ->> 'mesh' IS NOT NULL;

-- The mesh and step of least CPU time whose errors add up to a share of the motion at most: measured, or from what the two
-- cost beside what they were run with.
CREATE TEMP TABLE choices AS
SELECT * FROM (
  SELECT *, row_number() OVER (PARTITION BY share ORDER BY cpu_s, mesh, step) AS place FROM (
    SELECT share, mesh, s.number AS step, mesh_error, s.step_error AS step_error,
      m.cpu_s * iif(s.number = h.number, 1, s.cpu_s / h.cpu_s) AS cpu_s, s.number = h.number AS measured
    FROM (SELECT column1 AS share FROM (VALUES (0.1), (0.01), (0.001))) JOIN meshes m JOIN about JOIN shared h JOIN steps s
    WHERE shared >= 0 AND m.ended AND mesh_error + s.step_error <= share
    UNION ALL
    SELECT share, mesh, NULL, mesh_error, 0, cpu_s, 1
    FROM (SELECT column1 AS share FROM (VALUES (0.1), (0.01), (0.001))) JOIN meshes m JOIN about
    WHERE shared < 0 AND ended AND mesh_error <= share))
WHERE place = 1;
