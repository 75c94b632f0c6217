/* table.js: tables that sort, and grids of outcomes. */
const FIRST_ROWS = 200;

function isNumeric(column) {
  return column.values.some((value) => typeof value === 'number');
}

function compare(a, b) {
  if (a === b) return 0;
  if (a === null || a === '') return 1;
  if (b === null || b === '') return -1;
  return typeof a === 'number' && typeof b === 'number'
    ? a - b
    : String(a).localeCompare(String(b), 'en', { numeric: true });
}

/* What an outcome's word means: good, soft (worth a look) or bad; '' for other words. */
function judge(word) {
  if (/^(complete|recovered|done)$/.test(word)) return 'good';
  if (/^(untangled|equilibrium|stressed|planned|running|out of budget|interrupted|below|not run|no result)/.test(word))
    return 'soft';
  return /fail|crash|undefined|non-finite|refused|converged|not recovered|stopped/.test(word) ? 'bad' : '';
}

/* A cell's class: only words of columns that tell an outcome are coloured. */
function cellClass(column, value) {
  if (typeof value === 'number') return 'number';
  return /^(status|outcome)$/.test(column.name) ? judge(String(value)) : '';
}

function makeTable(table, title) {
  const columns = table.columns,
    count = columns.length ? columns[0].values.length : 0;
  const order = Array.from({ length: count }, (_, k) => k),
    body = element('tbody');
  let most = FIRST_ROWS,
    sorted = -1,
    down = false;
  const more = element('button', {
    type: 'button',
    onclick: () => {
      most = count;
      fill();
    },
  });

  function fill() {
    body.replaceChildren(
      ...order.slice(0, most).map((row) =>
        element(
          'tr',
          {},
          ...columns.map((column) => {
            const value = column.values[row];
            return element(
              'td',
              { class: cellClass(column, value) || null, title: value === null ? null : String(value) },
              show(value),
            );
          }),
        ),
      ),
    );
    more.hidden = count <= most;
    more.textContent = `show all ${count} rows`;
  }

  function sort(k) {
    down = sorted === k ? !down : false;
    sorted = k;
    const values = columns[k].values;
    order.sort((a, b) => (down ? -1 : 1) * compare(values[a], values[b]) || a - b);
    heads.forEach((head, i) => head.setAttribute('aria-sort', i === k ? (down ? 'descending' : 'ascending') : 'none'));
    fill();
  }

  const heads = columns.map((column, k) =>
    element(
      'th',
      {
        scope: 'col',
        'aria-sort': 'none',
        class: isNumeric(column) ? 'number' : null,
      },
      element('button', { type: 'button', onclick: () => sort(k) }, column.name),
    ),
  );
  fill();
  return element(
    'div',
    {},
    element(
      'div',
      { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': title },
      element('table', {}, element('thead', {}, element('tr', {}, ...heads)), body),
    ),
    more,
  );
}

/* What a setting is called at the head of a column. */
const settings = {
  poisson: (value) => `ν = ${show(value)}`,
  step: (value) => `step ${show(value)} s`,
  constants: (value) => ({ matched: '', as_e: 'constants of E' })[value] ?? `${value} constants`,
  solver: (value) => `${value} solver`,
};
const setting = (column, k) => (settings[column.name] || show)(column.values[k]);

/* Rows against settings; a cell says what came of it, several of them the worst. */
function makeGrid(grid, table) {
  const column = (name) => table.columns.find((own) => own.name === name);
  const rows = column(grid.row),
    value = column(grid.value);
  if (!rows || !value) return element('p', { class: 'note' }, `There is no column ${grid.row} or ${grid.value}.`);
  const used = grid.columns.map(column).filter((own) => own && new Set(own.values).size > 1);
  const names = used.length ? used : [column(grid.columns[0]) || rows];
  const label = (k) => names.map((own) => setting(own, k)).filter(Boolean).join(', ');
  const cells = new Map(),
    heads = [...new Set(rows.values.map((_, k) => label(k)))];
  rows.values.forEach((row, k) => {
    if (!cells.has(row)) cells.set(row, new Map());
    const own = cells.get(row);
    if (!own.has(label(k))) own.set(label(k), []);
    own.get(label(k)).push(String(value.values[k]));
  });
  const rank = { bad: 3, soft: 2, '': 1, good: 0 };
  const cell = (words) => {
    if (!words) return element('td', {}, '');
    const worst = words.reduce((a, b) => (rank[judge(b)] > rank[judge(a)] ? b : a));
    const alike = words.filter((word) => word === worst).length;
    return element(
      'td',
      { class: judge(worst) || null, title: words.join(', ') },
      words.length > 1 ? `${worst} (${alike} of ${words.length})` : worst,
    );
  };
  return element(
    'div',
    { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': grid.title },
    element(
      'table',
      {},
      element(
        'thead',
        {},
        element(
          'tr',
          {},
          element('th', { scope: 'col' }, grid.row),
          ...heads.map((head) => element('th', { scope: 'col' }, head)),
        ),
      ),
      element(
        'tbody',
        {},
        ...[...cells].map(([row, own]) =>
          element('tr', {}, element('th', { scope: 'row' }, show(row)), ...heads.map((head) => cell(own.get(head)))),
        ),
      ),
    ),
  );
}
