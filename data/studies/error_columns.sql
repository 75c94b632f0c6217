-- error_columns.sql: the quantities of a run that can have error bars, and the columns that their bars are made of. `headers`
-- has the columns of all tables (plot_columns.sql): of source 0, the run, and of its companions, of which `companions`
-- (source, aspect, number) says what they judge: aspect 0 the mesh, 1 the steps. `points` (probe, is_pinned) has the probes at
-- points, and those in tets with a held node, and `same_mesh` (is_stiff) a row of four-node tets that are judged on their own
-- mesh.

-- Columns of the history that are quantities of the whole body; the others count work. An extreme need not settle.
CREATE TEMP TABLE whole_body (pattern, extreme);
INSERT INTO whole_body VALUES ('energy_*', 0), ('volume', 0), ('volume_ratio', 0), ('contact*_force', 0), ('weld*_broken', 0),
  ('weld*_released', 0), ('J_min', 1), ('J_bound', 1), ('contact*_gap', 1), ('weld*_traction', 1);

-- Quantities of one kind are components of one quantity of a probe, or energies: alike in their unit and up to the first _
-- behind the dot. `kind` is the first one's id, `smoothed` that of the column that smooths it.
CREATE TEMP TABLE quantities AS
SELECT id, tab, header, name, unit, rows, dot > 0 AS of_probe, min(id) OVER (PARTITION BY tab, unit, stem) AS kind,
  instr(header, '.position_') > 0 AS of_place,
  instr(header, '.reaction_') OR instr(header, '.contact_') AS of_force, -- the start need not be in balance
  CASE WHEN extreme THEN 'an extreme over the body, which need not settle as mesh and steps get finer'
    WHEN is_pinned THEN 'a strain beside a pin, which grows without end as the mesh gets finer'
    WHEN lacks_smooth THEN 'a strain at a point, for which a run must begin with --error or output.error_bars'
    WHEN dot AND part = 'J' AND (SELECT is_stiff FROM same_mesh) THEN 'J of nearly incompressible four-node tets, which ten-node '
      || 'tets on the same mesh do not tell; body.refine of 1 or more does' END AS no_mesh_bar,
  iif(extreme, 'an extreme over the body, which need not settle as mesh and steps get finer', NULL) AS no_step_bar, smoothed
FROM (
  SELECT *, substr(name, 1, dot) || substr(part, 1, instr(part || '_', '_') - 1) AS stem,
    is_pinned, NOT is_pinned AND smoothed IS NULL AND (SELECT coarser FROM judges WHERE aspect = 0) AS lacks_smooth
  FROM (SELECT *, substr(name, dot + 1) AS part, (SELECT s.id FROM headers s WHERE s.source = 0 AND s.tab = h.tab AND
      s.id <> h.id AND s.header = replace(h.header, ' [', '_smooth [')) AS smoothed FROM (
    SELECT *, length(rtrim(name, replace(name, '.', ''))) AS dot FROM headers WHERE source = 0) h)
  LEFT JOIN points ON probe = substr(name, 1, dot - 1) AND
    (part GLOB 'stress*' OR part GLOB 'stretch*' OR part GLOB 'energy*' OR part GLOB 'J*')
  LEFT JOIN whole_body ON file GLOB '*/history.csv' AND name GLOB pattern)
WHERE "column" > 0 AND (extreme IS NOT NULL OR file GLOB '*/probes.csv') AND
  NOT instr(header, '_error_mesh') AND NOT instr(header, '_error_step') AND NOT instr(header, '_smooth [');

-- Their columns in the tables of companions; and what is smoothed in the run's own.
CREATE TEMP TABLE others AS
SELECT q.id AS own, h.id, c.* FROM quantities q JOIN headers h USING (header, tab) JOIN companions c USING (source)
UNION ALL
SELECT id, smoothed, 0, 0, 'smooth' FROM quantities JOIN judges ON aspect = 0 AND coarser WHERE smoothed;

CREATE TEMP VIEW needed AS
SELECT id, source, tab, "column" FROM headers
WHERE "column" = 0 OR id IN (SELECT id FROM quantities UNION SELECT id FROM others);
