/* plot.js: plots of columns against columns, as SVG; the point next to the pointer, or chosen by arrow keys, is read
 * out. */
const COLOURS = ['#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00', '#56B4E9', '#8B4513', '#7A7A7A'];
const INSET = { left: 80, right: 14, top: 12, bottom: 44 };

/* Black is drawn in the page's own ink, so that it is seen on dark grounds. */
function ink(colour, k) {
  if (!colour) return COLOURS[k % COLOURS.length];
  return /^#0{6}$/.test(colour) ? 'var(--ink)' : colour;
}

/* Where colours come again, the lines of the second time are dashed and its points hollow; of further ones, dotted. */
const DASHES = ['none', '6 4', '2 3'];
function dashesOf(k) {
  return DASHES[Math.min(Math.floor(k / COLOURS.length), DASHES.length - 1)];
}

class Plot {
  constructor(spec, tables) {
    Object.assign(this, { spec, tables, hidden: new Set(), near: null });
    this.choice = { x: spec.x, y: spec.y, group: spec.group || '', logX: spec.log[0], logY: spec.log[1] };
    this.svg = svgElement('svg', { class: 'plot', tabindex: 0, role: 'img' });
    this.reading = element('div', { class: 'reading', 'aria-live': 'polite' });
    this.legend = element('div', { class: 'legend' });
    this.root = element(
      'figure',
      {},
      element('h3', {}, spec.title),
      this.makeChoices(),
      this.svg,
      this.reading,
      this.legend,
    );
    this.svg.addEventListener('pointermove', (event) => this.point(event));
    this.svg.addEventListener('pointerleave', () => this.choose(null));
    this.svg.addEventListener('keydown', (event) => this.key(event));
    new ResizeObserver(() => {
      if (Math.abs(this.svg.clientWidth - this.width) > 1) this.draw();
    }).observe(this.svg);
  }

  columnNames(numeric) {
    const names = new Set();
    for (const table of this.ownTables())
      for (const column of table.columns) if (!numeric || isNumeric(column)) names.add(column.name);
    return [...names];
  }

  ownTables() {
    return this.spec.table >= 0
      ? [this.tables[this.spec.table]]
      : this.spec.series.map((series) => this.tables[series.table]);
  }

  makeChoices() {
    if (!this.spec.choose) return null;
    const change = (key, value) => {
      this.choice[key] = value;
      this.hidden.clear();
      this.near = null;
      this.draw();
    };
    const select = (label, key, names, none) =>
      element(
        'label',
        {},
        label,
        element(
          'select',
          {
            onchange: (event) => change(key, event.target.value),
          },
          ...(none ? [element('option', { value: '' }, none)] : []),
          ...names.map((name) => element('option', { value: name, selected: name === this.choice[key] }, name)),
        ),
      );
    const check = (label, key) =>
      element(
        'label',
        {},
        element('input', {
          type: 'checkbox',
          checked: this.choice[key],
          onchange: (event) => change(key, event.target.checked),
        }),
        label,
      );
    const numeric = this.columnNames(true);
    return element(
      'div',
      { class: 'controls' },
      select('y', 'y', numeric),
      select('x', 'x', numeric),
      this.spec.table >= 0 ? select('series', 'group', this.columnNames(false), 'all in one') : null,
      check('log y', 'logY'),
      check('log x', 'logX'),
    );
  }

  /* Points of a table's columns; `keep`: of which rows. */
  pointsOf(table, keep) {
    const find = (name) => table.columns.find((column) => column.name === name);
    const x = find(this.choice.x),
      y = find(this.choice.y);
    if (!x || !y) return [];
    const bars = ['mesh', 'step']
      .map((of) => find(this.choice.y.replace(/( \[[^\]]*\])?$/, `_error_${of}$1`)))
      .filter((column) => column);
    const points = [];
    for (let k = 0; k < x.values.length; k++) {
      const a = x.values[k],
        b = y.values[k];
      if (typeof a !== 'number' || typeof b !== 'number' || (keep && !keep(k))) continue;
      if ((this.choice.logX && a <= 0) || (this.choice.logY && b <= 0)) continue;
      points.push({ x: a, y: b, row: k, bar: bars.reduce((sum, column) => sum + (+column.values[k] || 0), 0) });
    }
    return points;
  }

  makeSeries() {
    if (this.spec.table < 0)
      return this.spec.series.map((series, k) => ({
        name: series.name,
        colour: ink(series.colour, k),
        points: this.pointsOf(this.tables[series.table]),
        lined: this.spec.lines,
      }));
    const table = this.tables[this.spec.table],
      find = (name) => table.columns.find((column) => column.name === name);
    const where = this.spec.where && find(this.spec.where),
      group = this.choice.group && find(this.choice.group);
    const fits = (k) => !where || where.values[k] === this.spec.is;
    if (!group)
      return [
        { name: this.choice.y, colour: ink(null, 0), points: this.pointsOf(table, fits), lined: this.spec.lines },
      ];
    const names = [...new Set(group.values.filter((_, k) => fits(k)))].sort(compare);
    return names.slice(0, 40).map((name, k) => {
      const points = this.pointsOf(table, (row) => fits(row) && group.values[row] === name);
      if (this.spec.lines) points.sort((a, b) => a.x - b.x);
      /* A line through several cases at one place would show what is not there. */
      const lined = this.spec.lines && new Set(points.map((point) => point.x)).size === points.length;
      return { name: show(name), colour: ink(null, k), dashes: dashesOf(k), points, lined };
    });
  }

  extent(key, log) {
    let low = Infinity,
      high = -Infinity;
    for (const series of this.series)
      if (!this.hidden.has(series.name))
        for (const point of series.points) {
          const bar = key === 'y' && !log ? point.bar : 0;
          low = Math.min(low, point[key] - bar);
          high = Math.max(high, point[key] + bar);
        }
    if (!(low <= high)) return log ? [1, 10] : [0, 1];
    if (log) return low === high ? [low / 2, high * 2] : [low / (high / low) ** 0.04, high * (high / low) ** 0.04];
    const room = low === high ? Math.abs(low) * 0.1 || 1 : 0.04 * (high - low);
    return [low - room, high + room];
  }

  scale(key, log, from, to) {
    const [low, high] = this.extent(key, log),
      of = log ? Math.log : (value) => value;
    const at = (value) => from + ((of(value) - of(low)) / (of(high) - of(low))) * (to - from);
    return { low, high, at, ticks: ticks(low, high, Math.abs(to - from) / (key === 'x' ? 80 : 45), log) };
  }

  draw() {
    this.series = this.makeSeries();
    this.width = this.svg.clientWidth || 480;
    const height = Math.round(Math.min(360, Math.max(240, 0.6 * this.width)));
    const right = this.width - INSET.right,
      bottom = height - INSET.bottom;
    this.svg.setAttribute('viewBox', `0 0 ${this.width} ${height}`);
    const total = this.series.reduce((sum, series) => sum + series.points.length, 0);
    this.svg.setAttribute(
      'aria-label',
      `${this.spec.title}: ${this.choice.y} against ${this.choice.x}, ` +
        `${this.series.length} series, ${total} points; arrow keys read them`,
    );
    this.x = this.scale('x', this.choice.logX, INSET.left, right);
    this.y = this.scale('y', this.choice.logY, bottom, INSET.top);
    this.svg.replaceChildren();
    this.drawAxes(right, bottom, height);
    for (const series of this.series) if (!this.hidden.has(series.name)) this.drawSeries(series);
    if (!total)
      this.svg.append(
        svgElement(
          'text',
          { x: (INSET.left + right) / 2, y: bottom / 2, 'text-anchor': 'middle' },
          'no values of both columns',
        ),
      );
    this.marks = svgElement('g');
    this.svg.append(this.marks);
    this.drawLegend();
    this.choose(null);
  }

  drawAxes(right, bottom, height) {
    for (const tick of this.x.ticks) {
      const x = this.x.at(tick);
      this.svg.append(
        svgElement('line', { class: 'mesh', x1: x, x2: x, y1: INSET.top, y2: bottom }),
        svgElement('text', { x, y: bottom + 16, 'text-anchor': 'middle' }, show(tick)),
      );
    }
    const texts = this.y.ticks.map((tick) => show(tick, 8));
    this.y.ticks.forEach((tick, k) => {
      const y = this.y.at(tick);
      this.svg.append(
        svgElement('line', { class: 'mesh', x1: INSET.left, x2: right, y1: y, y2: y }),
        svgElement('text', { x: INSET.left - 6, y: y + 4, 'text-anchor': 'end' }, texts[k]),
      );
    });
    this.svg.append(
      svgElement('path', { class: 'axis', d: `M${INSET.left} ${INSET.top}V${bottom}H${right}` }),
      svgElement('text', { x: (INSET.left + right) / 2, y: height - 8, 'text-anchor': 'middle' }, this.choice.x),
      svgElement(
        'text',
        {
          transform: `translate(13 ${(INSET.top + bottom) / 2}) rotate(-90)`,
          'text-anchor': 'middle',
        },
        this.choice.y,
      ),
    );
  }

  /* Error bars, of mesh and steps together, as a band beneath the line. */
  drawBand(series) {
    const points = series.points.filter((point) => point.bar > 0);
    const edge = (sign) =>
      points.map((point) => `${this.x.at(point.x).toFixed(1)} ${this.y.at(point.y + sign * point.bar).toFixed(1)}`);
    if (!this.spec.lines || this.choice.logY || points.length < 2) return;
    this.svg.append(
      svgElement('path', {
        d: 'M' + [...edge(1), ...edge(-1).reverse()].join('L') + 'Z',
        style: `fill:${series.colour}`,
        'fill-opacity': 0.2,
      }),
    );
  }

  drawSeries(series) {
    this.drawBand(series);
    const at = series.points.map((point) => `${this.x.at(point.x).toFixed(1)} ${this.y.at(point.y).toFixed(1)}`);
    const hollow = series.dashes && series.dashes !== 'none';
    if (series.lined && at.length > 1)
      this.svg.append(
        svgElement('path', {
          d: 'M' + at.join('L'),
          fill: 'none',
          style: `stroke:${series.colour}`,
          'stroke-width': 1.6,
          'stroke-dasharray': series.dashes || 'none',
        }),
      );
    if (series.lined && at.length > 60) return;
    for (const point of series.points)
      this.svg.append(
        svgElement('circle', {
          cx: this.x.at(point.x),
          cy: this.y.at(point.y),
          r: 3.2,
          style: hollow ? `fill:none;stroke:${series.colour};stroke-width:1.4` : `fill:${series.colour}`,
        }),
      );
  }

  drawLegend() {
    this.legend.replaceChildren(
      ...(this.series.length < 2
        ? []
        : this.series.map((series) => {
            const mark = element('i');
            const [on, off] = (series.dashes || 'none').split(' ');
            mark.style.background = off
              ? `repeating-linear-gradient(90deg, ${series.colour} 0 ${on}px, transparent ${on}px ${+on + +off}px)`
              : series.colour;
            return element(
              'button',
              {
                type: 'button',
                'aria-pressed': !this.hidden.has(series.name) ? 'true' : 'false',
                onclick: () => {
                  if (!this.hidden.delete(series.name)) this.hidden.add(series.name);
                  this.draw();
                },
              },
              mark,
              series.name,
            );
          })),
    );
  }

  point(event) {
    const box = this.svg.getBoundingClientRect();
    const px = ((event.clientX - box.left) * this.width) / box.width,
      py = ((event.clientY - box.top) * this.width) / box.width;
    let best = null,
      least = 40 ** 2;
    this.series.forEach((series, s) => {
      if (this.hidden.has(series.name)) return;
      series.points.forEach((point, k) => {
        const away = (this.x.at(point.x) - px) ** 2 + 0.25 * (this.y.at(point.y) - py) ** 2;
        if (away < least) {
          least = away;
          best = { s, k };
        }
      });
    });
    this.choose(best);
  }

  key(event) {
    const move = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] }[event.key];
    if (!move) return;
    event.preventDefault();
    event.stopPropagation();
    const open = this.series
      .map((_, s) => s)
      .filter((s) => this.series[s].points.length && !this.hidden.has(this.series[s].name));
    if (!open.length) return;
    const now = this.near || { s: open[0], k: -move[1] };
    const s = open[(Math.max(0, open.indexOf(now.s)) + move[0] + open.length) % open.length];
    this.choose({ s, k: Math.min(this.series[s].points.length - 1, Math.max(0, now.k + move[1])) });
  }

  choose(near) {
    this.near = near;
    this.marks.replaceChildren();
    this.reading.textContent = '';
    if (!near) return;
    const series = this.series[near.s],
      point = series.points[near.k];
    const x = this.x.at(point.x),
      y = this.y.at(point.y);
    this.marks.append(
      svgElement('line', { class: 'guide', x1: x, x2: x, y1: y, y2: this.y.at(this.y.low) }),
      svgElement('line', { class: 'guide', x1: this.x.at(this.x.low), x2: x, y1: y, y2: y }),
      svgElement('circle', { class: 'near', cx: x, cy: y, r: 4.5 }),
    );
    const bar = point.bar > 0 ? ` ± ${show(point.bar, 2)}` : '';
    this.reading.textContent =
      `${series.name}: ${this.choice.x} = ${show(point.x, 6)}, ` + `${this.choice.y} = ${show(point.y, 6)}${bar}`;
  }
}
