-- plot_same.sql: the lines of a picture that lie on each other, which are drawn as one, from tables that are made later:
--   curves (picture, line, point, x, y)  points of each line by their numbers, the first three of which are a key
--   lines (picture, line, kind)          lines by their numbers from 0; those of different kinds are told apart
--   ranges (picture, low, high, near)    what the picture shows, and from which difference on the eye tells lines apart

-- The first line that each lies on: itself, or one that lies on no other.
CREATE TEMP VIEW first_lines AS
WITH RECURSIVE
sizes AS MATERIALIZED (
  SELECT picture, line, kind, count(point) AS size FROM lines LEFT JOIN curves USING (picture, line) GROUP BY 1, 2),
alike AS MATERIALIZED (
  SELECT a.picture AS picture, b.line AS earlier, a.line AS line
  FROM sizes a JOIN sizes b ON b.picture = a.picture AND b.line < a.line AND b.kind = a.kind AND b.size = a.size
  WHERE NOT EXISTS (
    SELECT 1 FROM curves p JOIN ranges r ON r.picture = p.picture
    LEFT JOIN curves q ON q.picture = p.picture AND q.line = b.line AND q.point = p.point
    WHERE p.picture = a.picture AND p.line = a.line AND NOT (q.x IS p.x AND coalesce(abs(p.y - q.y) < near, p.y IS q.y)))),
walk (picture, line, firsts) AS (
  SELECT picture, 0, json_array(0) FROM lines WHERE line = 0
  UNION ALL
  SELECT l.picture, l.line, json_insert(firsts, '$[#]', coalesce((SELECT min(value) FROM json_each(firsts) JOIN alike p
    ON p.picture = l.picture AND p.earlier = value AND p.line = l.line), l.line))
  FROM walk w JOIN lines l ON l.picture = w.picture AND l.line = w.line + 1)
SELECT picture, line, json_extract(firsts, '$[#-1]') AS first FROM walk;
