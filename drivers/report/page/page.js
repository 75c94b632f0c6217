/* page.js: the report from top to bottom. */
function makeSource(source) {
  const text = typeof source.value === 'string' ? source.value : JSON.stringify(source.value, null, 2);
  return element('details', {}, element('summary', {}, source.title), element('pre', {}, text));
}

/* Lines that one command has laid out stay as they are; sentences are paragraphs. */
function makeVerdict(text) {
  return text.includes('\n') ? element('pre', { class: 'verdict' }, text.trim()) : element('p', {}, text);
}

/* A folded table is filled when it is opened. */
function makeFolded(table) {
  const rows = table.columns.length ? table.columns[0].values.length : 0;
  const folded = element(
    'details',
    {
      ontoggle: () => {
        if (folded.open && folded.childElementCount < 2) folded.append(makeTable(table, table.title));
      },
    },
    element('summary', {}, `${table.title}: ${rows} ${rows === 1 ? 'row' : 'rows'}`),
  );
  return folded;
}

/* The lead has the only part's first sentence. */
function makePart(part, k, parts) {
  const plots = part.plots.map((spec) => new Plot(spec, part.tables));
  const section = element(
    'section',
    { id: `part-${k}`, 'aria-labelledby': `part-${k}-title` },
    element('h2', { id: `part-${k}-title` }, part.title),
    part.path ? element('p', { class: 'faint' }, part.path) : null,
    ...part.verdict.slice(parts.length === 1 && !(part.verdict[0] || '\n').includes('\n') ? 1 : 0).map(makeVerdict),
    ...part.grids.flatMap((grid) => [element('h3', {}, grid.title), makeGrid(grid, part.tables[grid.table])]),
    ...part.tables
      .filter((table) => table.open)
      .flatMap((table) => [element('h3', {}, table.title), makeTable(table, table.title)]),
    element('div', { class: 'plots' }, ...plots.map((plot) => plot.root)),
    ...part.tables.filter((table) => !table.open).map(makeFolded),
    ...part.sources.map(makeSource),
    ...part.notes.map((note) => element('p', { class: 'note' }, note)),
  );
  return { section, plots };
}

function makeFooter(head, packed) {
  const program = head.program;
  return element(
    'footer',
    {},
    element(
      'p',
      { class: 'faint' },
      `Written by flesh ${program.flesh}${program.commit ? ` (${program.commit})` : ''} on ` +
        `${program.date}. The data take ${show(packed / 1e6, 3)} MB of this file, which loads nothing from elsewhere. ` +
        'The 3D view is drawn by three.js (MIT licence, in this file).',
    ),
    makeSource({ title: 'provenance of this report', value: program }),
  );
}

async function main() {
  const wait = document.getElementById('wait'),
    page = document.getElementById('main');
  try {
    const { report, bytes } = await unpack(),
      packed = document.getElementById('payload').textContent.length * 0.75;
    const parts = report.parts.map(makePart);
    const view = report.view && report.view.runs.length ? new View(report.view, bytes) : null;
    const links = [
      ...(view ? [['view', 'In three dimensions']] : []),
      ...report.parts.map((part, k) => [`part-${k}`, part.title]),
    ];
    page.replaceChildren(
      element('h1', {}, report.head.title),
      links.length > 1
        ? element(
            'nav',
            { 'aria-label': 'parts' },
            ...links.map(([id, text]) => element('a', { href: `#${id}` }, text)),
          )
        : '',
      document.getElementById('lead'),
      view ? view.root : '',
      ...(!view && report.view ? report.view.notes.map((note) => element('p', { class: 'note' }, note)) : []),
      ...parts.map((part) => part.section),
      makeFooter(report.head, packed),
    );
    parts.forEach((part) => part.plots.forEach((plot) => plot.draw()));
    if (view && view.stage) view.start();
    document.documentElement.dataset.ready = 'yes';
  } catch (error) {
    wait.textContent = `This report cannot be shown: ${error.message}`;
    console.error(error);
  }
}
main();
