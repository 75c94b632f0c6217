/* decode.js: unpacks the payload: base 64, deflate, then JSON and numbers. report.h has the format. */
const LENGTH_DIGITS = 12;

async function unpack() {
  const text = atob(document.getElementById('payload').textContent.trim());
  const packed = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) packed[k] = text.charCodeAt(k);
  if (typeof DecompressionStream === 'undefined')
    throw new Error('this browser cannot unpack deflate (DecompressionStream)');
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  const all = new Uint8Array(await new Response(stream).arrayBuffer());
  const utf8 = new TextDecoder();
  const length = Number(utf8.decode(all.subarray(0, LENGTH_DIGITS)));
  const report = JSON.parse(utf8.decode(all.subarray(LENGTH_DIGITS, LENGTH_DIGITS + length)));
  return { report, bytes: all.subarray(LENGTH_DIGITS + length) };
}

/* Reads numbers one after the other. */
class Numbers {
  constructor(bytes, at) {
    this.bytes = bytes;
    this.at = at;
  }

  next() {
    let byte = this.bytes[this.at++],
      value = byte & 127;
    for (let factor = 128; byte & 128; factor *= 128) {
      byte = this.bytes[this.at++];
      value += (byte & 127) * factor;
    }
    return value % 2 ? -(value + 1) / 2 : value / 2;
  }
}

/* A list that stands at [at, count]: each number is told by its difference to the one before. */
function readList(bytes, place) {
  if (!place) return new Int32Array(0);
  const numbers = new Numbers(bytes, place[0]),
    list = new Int32Array(place[1]);
  for (let k = 0, last = 0; k < list.length; k++) list[k] = last += numbers.next();
  return list;
}

/* Frames of `total` numbers each, and of `flags` bytes: what a straight line through the two before does not tell. */
function readFrames(bytes, at, count, total, flagBytes) {
  const numbers = new Numbers(bytes, at),
    frames = [],
    none = new Int32Array(total);
  for (let k = 0; k < count; k++) {
    const one = k ? frames[k - 1].values : none,
      two = k > 1 ? frames[k - 2].values : one;
    const values = new Int32Array(total),
      flags = new Uint8Array(flagBytes);
    for (let i = 0; i < total; i++) values[i] = numbers.next() + (k ? 2 * one[i] - two[i] : i ? values[i - 1] : 0);
    for (let i = 0; i < flagBytes; i++) flags[i] = bytes[numbers.at++] ^ (k ? frames[k - 1].flags[i] : 0);
    frames.push({ values, flags });
  }
  return frames;
}
