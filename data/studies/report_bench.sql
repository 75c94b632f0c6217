-- report_bench.sql: what a report has of a folder of `flesh bench` (drivers/report/studies.c).

-- to tables
SELECT 'bench.csv', 1;
-- to plots
SELECT 'Time of a tet against the number of tets', 'tets', 'ns_per_tet', 'xy', 1, number, 'name' FROM tables;
-- to sources
SELECT 'the machine''s ceilings', 'bench.json', 'ceilings';
-- to sources
SELECT 'provenance', 'bench.json', 'program';
