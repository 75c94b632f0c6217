-- sweep.sql: what `flesh sweep` says of its cases (drivers/study/results.h says how).

CREATE TEMP VIEW ends AS SELECT number, status, message FROM wanted JOIN cases USING (id);
-- to stdout
SELECT printf('%d case%s:', total(count), iif(total(count) = 1, '', 's')) ||
  coalesce(group_concat(printf(' %d %s', count, status)), '')
FROM (SELECT status, count(*) AS count FROM ends GROUP BY status ORDER BY count DESC, status);
-- to stdout
SELECT 'results: ' || path();
-- to error
SELECT printf('all %d cases are refused; the first: %s', count, coalesce(message, '(no words)'))
FROM (SELECT count(*) AS count, min(number), message FROM ends)
WHERE count AND NOT EXISTS (SELECT 1 FROM ends WHERE status <> 'refused');
