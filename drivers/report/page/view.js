/* view.js: the 3D view with its controls: time, colours, runs, wireframe, section, and keys for all of them. */
const KEYS = [
  ['Space', 'play and stop'],
  ['← →', 'a frame back or on (also in the slider)'],
  ['Home End', 'first and last frame'],
  ['C', 'next colours'],
  ['W', 'wireframe'],
  ['L', 'light'],
  ['X', 'section on and off'],
  ['[ ]', 'move the section'],
  ['Shift ← → ↑ ↓', 'turn the camera'],
  ['+ −', 'come nearer, go away'],
  ['R', 'the camera as at first'],
];

class View {
  constructor(told, bytes) {
    this.told = told;
    this.bodies = told.runs.map((run) => new Body(run, bytes));
    this.times = [...new Set(told.runs.flatMap((run) => run.times))].sort((a, b) => a - b);
    this.state = { step: 0, field: 0, wireframe: false, clip: false, lit: true, axis: 0, place: 0.5, flip: false };
    this.shown = this.bodies.map(() => true);
    this.ranges = told.fields.map((field) => [field.low, field.high]);
    this.palettes = told.fields.map((field) => makeColours(field.palette));
    this.bounds = this.findBounds();
    this.state.step = Math.max(this.times.indexOf(told.start), 0);
    this.build();
  }

  /* The box about all that is ever taken. */
  findBounds() {
    const low = [Infinity, Infinity, Infinity],
      high = [-Infinity, -Infinity, -Infinity];
    for (const body of this.bodies)
      for (const frame of body.frames)
        for (let d = 0, k = 0; d < 3; d++)
          for (let i = 0; i < body.mesh.nodes; i++, k++) {
            const at = frame.values[k] * body.quantum;
            if (at < low[d]) low[d] = at;
            if (at > high[d]) high[d] = at;
          }
    return { low, high };
  }

  build() {
    this.canvas = element('canvas', {
      tabindex: 0,
      role: 'img',
      'aria-label': 'The bodies in three dimensions; keys are listed below',
    });
    this.names = this.told.runs.map((run) => element('div', { class: 'name' }, run.name));
    this.frameBox = element('div', { class: 'stage' }, this.canvas, ...this.names);
    const notes = this.told.notes.map((note) => element('p', { class: 'note' }, note)),
      title = element('h2', { id: 'view-title' }, 'In three dimensions');
    this.root = element('section', { id: 'view', 'aria-labelledby': 'view-title' }, title);
    try {
      this.stage = new Stage(this.canvas, this.told.camera, this.bodies);
    } catch (error) {
      const words = `The 3D view needs WebGL 2 (${error.message.replace(/\.$/, '')}). A still picture stands in its place.`;
      this.root.append(element('p', { class: 'note' }, words), document.getElementById('still'), ...notes);
      return;
    }
    this.root.append(this.frameBox, this.makeTime(), this.makeScale(), this.makeSwitches(), this.makeKeys(), ...notes);
    this.stage.controls.addEventListener('change', () => this.ask());
    new ResizeObserver(() => this.ask()).observe(this.frameBox);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.ask());
    document.addEventListener('keydown', (event) => this.key(event));
  }

  makeTime() {
    this.play = element('button', { type: 'button', 'aria-label': 'play', onclick: () => this.toggle() }, '▶ play');
    this.slider = element('input', {
      type: 'range',
      id: 'time',
      min: 0,
      max: this.times.length - 1,
      step: 1,
      'aria-label': 'time',
      oninput: () => {
        this.stop();
        this.go(Number(this.slider.value));
      },
    });
    this.clock = element('output', { for: 'time' });
    return element(
      'div',
      { class: 'controls' },
      this.play,
      element('label', { class: 'time' }, this.slider),
      this.clock,
    );
  }

  makeScale() {
    this.colours = element(
      'select',
      {
        id: 'colours',
        onchange: () => {
          this.state.field = this.colours.selectedIndex - 1;
          this.recolour();
        },
      },
      element('option', {}, 'none'),
      ...this.told.fields.map((field) => element('option', {}, field.quantity)),
    );
    const end = (k) =>
      element('input', {
        type: 'number',
        step: 'any',
        'aria-label': k ? 'upper end of the colours' : 'lower end of the colours',
        onchange: (event) => {
          const range = this.ranges[this.state.field],
            value = event.target.valueAsNumber * this.told.fields[this.state.field].unit;
          if (k ? value > range[0] : value < range[1]) range[k] = value;
          this.recolour();
        },
      });
    this.ends = [end(0), end(1)];
    this.bar = element('div', { class: 'bar', role: 'img', 'aria-label': 'scale of the colours' });
    this.words = element('div', { class: 'words faint' });
    this.scale = element('div', { class: 'scale' }, this.ends[0], this.bar, this.ends[1], this.words);
    return element('div', { class: 'controls' }, element('label', {}, 'colours', this.colours), this.scale);
  }

  makeSwitches() {
    const check = (key, text) => {
      const box = element('input', {
        type: 'checkbox',
        id: key,
        checked: this.state[key],
        onchange: () => {
          this.state[key] = box.checked;
          this.refresh();
        },
      });
      this[key + 'Box'] = box;
      return element('label', {}, box, text);
    };
    this.axis = element(
      'select',
      {
        'aria-label': 'normal of the section',
        onchange: () => {
          this.state.axis = this.axis.selectedIndex;
          this.refresh();
        },
      },
      ...['x', 'y', 'z'].map((name) => element('option', {}, name)),
    );
    this.place = element('input', {
      type: 'range',
      min: 0,
      max: 1,
      step: 0.005,
      value: 0.5,
      'aria-label': 'place of the section',
      oninput: () => {
        this.state.place = Number(this.place.value);
        this.refresh();
      },
    });
    const runs =
      this.told.runs.length < 2
        ? []
        : this.told.runs.map((run, k) =>
            element(
              'label',
              {},
              element('input', {
                type: 'checkbox',
                checked: true,
                onchange: (event) => {
                  this.shown[k] = event.target.checked;
                  this.refresh();
                },
              }),
              run.name,
            ),
          );
    this.cutWords = element('span', { class: 'faint' });
    return element(
      'div',
      {},
      element(
        'div',
        { class: 'controls' },
        check('wireframe', 'wireframe'),
        check('lit', 'light'),
        check('clip', 'section'),
        this.axis,
        this.place,
        check('flip', 'other side'),
        this.cutWords,
        element('button', { type: 'button', onclick: () => this.reset() }, 'reset camera'),
      ),
      runs.length ? element('div', { class: 'controls', role: 'group', 'aria-label': 'runs' }, ...runs) : null,
    );
  }

  makeKeys() {
    return element(
      'details',
      {},
      element('summary', {}, 'Keys and mouse'),
      element(
        'dl',
        { class: 'keys' },
        ...KEYS.flatMap(([keys, what]) => [
          element('dt', {}, ...keys.split(' ').flatMap((key) => [element('kbd', {}, key), ' '])),
          element('dd', {}, what),
        ]),
      ),
      element(
        'p',
        { class: 'faint' },
        'Drag to turn, with the right button or two fingers to shift; the wheel or a pinch comes nearer.',
      ),
    );
  }

  /* All cells have one shape; as many columns as make them largest. */
  layout() {
    const width = this.frameBox.clientWidth,
      shown = this.bodies.map((_, k) => k).filter((k) => this.shown[k]);
    const count = Math.max(shown.length, 1),
      wanted = Math.min(2, Math.max(0.6, this.told.camera.aspect));
    const most = Math.max(280, Math.min(0.75 * window.innerHeight, 720));
    let best = { size: 0 };
    for (let columns = 1; columns <= count; columns++) {
      const rows = Math.ceil(count / columns),
        size = Math.min(width / columns / wanted, most / rows);
      if (size > best.size) best = { size, columns, rows };
    }
    const cellHeight = Math.floor(Math.min(best.size, (width / best.columns / wanted) * 1.4)),
      cellWidth = width / best.columns;
    const height = cellHeight * best.rows;
    const cells = shown.map((k, i) => ({
      k,
      stand: this.stage.stands[k],
      x: Math.round((i % best.columns) * cellWidth),
      y: Math.floor(i / best.columns) * cellHeight,
      width: Math.round(cellWidth),
      height: cellHeight,
    }));
    return { width, height, cells, aspect: cellWidth / cellHeight };
  }

  start() {
    this.lay(true);
    this.go(this.state.step);
  }

  lay(anew) {
    const layout = this.layout();
    this.frameBox.style.height = layout.height + 'px';
    if (anew || !this.laid || Math.abs(layout.aspect / this.laid.aspect - 1) > 0.02) this.stage.reset(layout.aspect);
    else this.stage.shape(layout.aspect);
    this.laid = layout;
    this.names.forEach((name) => {
      name.hidden = true;
    });
    for (const cell of layout.cells)
      Object.assign(this.names[cell.k], { hidden: false }).style.cssText = `left:${cell.x}px;top:${cell.y}px`;
  }

  reset() {
    this.stage.reset(this.laid.aspect);
    this.ask();
  }

  /* A picture at the next chance, one for all that has changed until then. */
  ask() {
    if (this.asked || !this.stage) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.render();
    });
  }

  render() {
    if (this.laid && this.frameBox.clientWidth !== this.laid.width) this.lay(false);
    this.stage.render(this.laid.cells, this.laid.width, this.laid.height);
    document.documentElement.dataset.drawn = this.state.step;
  }

  go(step) {
    this.state.step = Math.min(Math.max(step, 0), this.times.length - 1);
    const time = this.times[this.state.step];
    this.bodies.forEach((body) => {
      const frame = body.frameAt(time);
      if (frame !== body.frame) body.move(frame);
    });
    this.bodies.forEach((body, k) => {
      const own = body.told.times[body.frame];
      this.names[k].textContent = body.told.name + (own === time ? '' : `, at t = ${show(own, 4)} s`);
    });
    this.slider.value = this.state.step;
    const text = `t = ${show(time, 4)} s`;
    this.slider.setAttribute('aria-valuetext', text);
    this.clock.textContent = `${text} (${this.state.step + 1} of ${this.times.length})`;
    this.recolour();
  }

  recolour() {
    const { field } = this.state,
      told = this.told.fields[field];
    const scale =
      field < 0 ? {} : { low: this.ranges[field][0], high: this.ranges[field][1], colours: this.palettes[field] };
    this.bodies.forEach((body) => body.colour(field, scale));
    this.colours.selectedIndex = field + 1;
    this.scale.hidden = field < 0;
    if (field >= 0) {
      this.ends.forEach((end, k) => {
        end.value = Number((this.ranges[field][k] / told.unit).toPrecision(6));
      });
      const css = told.palette.map((rgb) => `rgb(${rgb.map((part) => Math.round(255 * part)).join(',')})`);
      this.bar.style.background = `linear-gradient(to right, ${css.join(',')})`;
      this.words.textContent =
        told.quantity +
        (told.most ? `; there is ${show(told.most[0] / told.unit, 4)} to ${show(told.most[1] / told.unit, 4)}` : '') +
        '; inverted tets are black';
    }
    this.refresh();
  }

  refresh() {
    const { state, stage, bounds } = this;
    if (!stage) return;
    const sign = state.flip ? -1 : 1,
      place = bounds.low[state.axis] + state.place * (bounds.high[state.axis] - bounds.low[state.axis]);
    const normal = [0, 0, 0];
    normal[state.axis] = sign;
    Object.assign(stage.shared.plane.value, { x: normal[0], y: normal[1], z: normal[2], w: sign * place });
    stage.shared.clip.value = state.clip;
    stage.shared.lit.value = state.lit;
    this.cutWords.textContent = state.clip ? `${'xyz'[state.axis]} = ${show(place, 4)} m` : '';
    this.bodies.forEach((_, k) => {
      if (this.shown[k]) stage.stands[k].update({ ...state, normal, offset: sign * place });
    });
    this.lay(false);
    this.ask();
  }

  /* Plays in real time, between two and ten seconds. */
  toggle() {
    if (this.timer) return this.stop();
    const span = this.times[this.times.length - 1] - this.times[0],
      first = this.times[0];
    if (this.state.step === this.times.length - 1) this.go(0);
    const begin = performance.now(),
      from = this.times[this.state.step],
      speed = span / Math.min(10, Math.max(2, span)) / 1000;
    const tick = (now) => {
      const time = from + (now - begin) * speed;
      let step = this.state.step;
      while (step + 1 < this.times.length && this.times[step + 1] <= Math.max(time, first)) step++;
      if (step !== this.state.step) this.go(step);
      if (step === this.times.length - 1) return this.stop();
      this.timer = requestAnimationFrame(tick);
    };
    this.play.textContent = '■ stop';
    this.play.setAttribute('aria-label', 'stop');
    this.timer = requestAnimationFrame(tick);
  }

  stop() {
    cancelAnimationFrame(this.timer);
    this.timer = 0;
    this.play.textContent = '▶ play';
    this.play.setAttribute('aria-label', 'play');
  }

  flick(key) {
    this[key + 'Box'].checked = this.state[key] = !this.state[key];
    this.refresh();
  }

  key(event) {
    if (!this.stage || event.ctrlKey || event.altKey || event.metaKey || event.defaultPrevented) return;
    const within = event.target.closest('input:not([type=checkbox]), select, textarea, summary, .scroll');
    if (within || (event.target.closest('button, input') && event.key === ' ')) return;
    const turn = 0.12,
      actions = {
        ' ': () => this.toggle(),
        Home: () => this.go(0),
        End: () => this.go(this.times.length - 1),
        ArrowLeft: () => this.go(this.state.step - 1),
        ArrowRight: () => this.go(this.state.step + 1),
        c: () => {
          this.state.field = ((this.state.field + 2) % (this.told.fields.length + 1)) - 1;
          this.recolour();
        },
        w: () => this.flick('wireframe'),
        l: () => this.flick('lit'),
        x: () => this.flick('clip'),
        '[': () => this.slide(-0.02),
        ']': () => this.slide(0.02),
        r: () => this.reset(),
        '+': () => this.stage.turn(0, 0, 0.9),
        '=': () => this.stage.turn(0, 0, 0.9),
        '-': () => this.stage.turn(0, 0, 1 / 0.9),
      };
    const turns = {
      ArrowLeft: () => this.stage.turn(-turn, 0, 1),
      ArrowRight: () => this.stage.turn(turn, 0, 1),
      ArrowUp: () => this.stage.turn(0, -turn, 1),
      ArrowDown: () => this.stage.turn(0, turn, 1),
    };
    const act =
      (event.shiftKey && turns[event.key]) || actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    event.preventDefault();
    if (/^(Arrow|Home|End)/.test(event.key)) this.stop();
    act();
    this.ask();
  }

  slide(by) {
    this.state.place = Math.min(1, Math.max(0, this.state.place + by));
    this.place.value = this.state.place;
    this.refresh();
  }
}
