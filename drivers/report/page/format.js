/* format.js: elements of the page, numbers as text, and ticks of axes. */

/* A new element: element('a', {href: '#'}, 'text', child, ...). */
function element(name, attributes, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {}))
    if (key.startsWith('on')) made.addEventListener(key.slice(2), value);
    else if (value !== null && value !== undefined && value !== false)
      made.setAttribute(key, value === true ? '' : value);
  made.append(...children.filter((child) => child !== null && child !== undefined));
  return made;
}

function svgElement(name, attributes, text) {
  const made = document.createElementNS('http://www.w3.org/2000/svg', name);
  for (const [key, value] of Object.entries(attributes || {})) made.setAttribute(key, value);
  if (text !== undefined) made.textContent = text;
  return made;
}

/* A number with `digits` significant ones. */
function show(value, digits = 5) {
  if (value === null || value === undefined) return '–';
  if (typeof value !== 'number') return String(value);
  if (Number.isInteger(value) && Math.abs(value) < 1e9) return String(value);
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e7)) {
    const [front, back] = value.toExponential(digits - 1).split('e');
    return (front.includes('.') ? front.replace(/\.?0+$/, '') : front) + 'e' + Number(back);
  }
  return String(Number(value.toPrecision(digits)));
}

function niceStep(span, count) {
  const raw = span / count,
    power = 10 ** Math.floor(Math.log10(raw));
  return power * ([1, 2, 5].find((factor) => factor * power >= raw * 0.999) || 10);
}

/* Ticks between the ends; of logarithmic axes powers of ten, or parts of them where there are few. */
function ticks(low, high, count, log) {
  const list = [];
  if (log) {
    const from = Math.floor(Math.log10(low)),
      to = Math.ceil(Math.log10(high));
    const every = Math.max(1, Math.ceil((to - from) / count)),
      parts = to - from > 2 ? [1] : to - from > 1 ? [1, 2, 5] : [1, 2, 3, 4, 5, 6, 8];
    for (let power = from; power <= to; power += every) for (const part of parts) list.push(part * 10 ** power);
    return list.filter((tick) => tick >= low * 0.9999 && tick <= high * 1.0001);
  }
  const step = niceStep(high - low, count);
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++)
    list.push(Number((k * step).toPrecision(12)));
  return list;
}
