/* body.js: a run's body as triangles: its surface at a frame, coloured by a field, and its section by a plane. */
const SHARP = 0.64; /* cosine of the angle between faces that meet in an edge, in the rest shape */
const INVERTED = [0.002, 0.002, 0.0025],
  FLESH = [224, 164, 140].map((value) => toLinear(value / 255));
/* Ten nodes, corners 0 to 3, then those on 01, 12, 02, 03, 13, 23, as eight tets of four: the corners, and the middle
 * cut along the line from 4 to 9. */
const PARTS = [
  [0, 4, 6, 7],
  [4, 1, 5, 8],
  [6, 5, 2, 9],
  [7, 8, 9, 3],
  [4, 9, 5, 6],
  [4, 9, 6, 7],
  [4, 9, 7, 8],
  [4, 9, 8, 5],
];

function toLinear(value) {
  return value <= 0.04045 ? value / 12.92 : ((value + 0.055) / 1.055) ** 2.4;
}

/* The colour at a part of the scale: between the palette's in sRGB, then as linear light. */
function scaleColour(palette, part) {
  const at = 4 * Math.min(Math.max(part || 0, 0), 1),
    k = Math.min(Math.floor(at), 3);
  return palette[k].map((low, d) => toLinear(low + (at - k) * (palette[k + 1][d] - low)));
}

/* Table of colours: looking up is faster than mixing for every vertex. */
function makeColours(palette) {
  const colours = new Float32Array(3 * 1025);
  for (let k = 0; k <= 1024; k++) colours.set(scaleColour(palette, k / 1024), 3 * k);
  return colours;
}

const meshes = new Map();

/* The mesh that several runs share, by where it stands. */
function readMesh(bytes, told, quantum) {
  if (meshes.has(told.rest[0])) return meshes.get(told.rest[0]);
  const mesh = { nodes: told.nodes, tetCount: told.tet_count };
  for (const name of ['rest', 'tets', 'edges', 'corners', 'behind', 'hidden', 'six', 'eighths'])
    mesh[name] = readList(bytes, told[name]);
  mesh.triangles = mesh.corners.length / 3;
  mesh.vertices = mesh.nodes + mesh.six.length / 6;
  mesh.order = mesh.edges.length ? 2 : 1;
  const at = positionsOf(mesh, mesh.rest, quantum),
    faces = faceNormals(mesh, at);
  findNeighbours(mesh, faces);
  findEdges(mesh);
  meshes.set(told.rest[0], mesh);
  return mesh;
}

/* Vertices beyond the nodes from the six nodes of their faces, `components` values each. */
function extend(mesh, values, components) {
  for (let v = mesh.nodes, k = 0; v < mesh.vertices; v++, k += 6)
    for (let d = 0; d < components; d++) {
      let sum = 0;
      for (let a = 0; a < 6; a++) sum += mesh.eighths[k + a] * values[components * mesh.six[k + a] + d];
      values[components * v + d] = sum / 8;
    }
  return values;
}

function positionsOf(mesh, numbers, quantum) {
  const x = new Float64Array(3 * mesh.vertices),
    n = mesh.nodes;
  for (let i = 0; i < n; i++) for (let d = 0; d < 3; d++) x[3 * i + d] = numbers[d * n + i] * quantum;
  return extend(mesh, x, 3);
}

/* Cross products of two sides: twice the area along the normal. */
function faceNormals(mesh, x) {
  const normals = new Float64Array(3 * mesh.triangles),
    c = mesh.corners;
  for (let t = 0; t < mesh.triangles; t++) {
    const p = 3 * c[3 * t],
      q = 3 * c[3 * t + 1],
      r = 3 * c[3 * t + 2];
    const ax = x[q] - x[p],
      ay = x[q + 1] - x[p + 1],
      az = x[q + 2] - x[p + 2];
    const bx = x[r] - x[p],
      by = x[r + 1] - x[p + 1],
      bz = x[r + 2] - x[p + 2];
    normals[3 * t] = ay * bz - az * by;
    normals[3 * t + 1] = az * bx - ax * bz;
    normals[3 * t + 2] = ax * by - ay * bx;
  }
  return normals;
}

/* For every corner the triangles whose normals its own is the mean of: those at its vertex that meet at no sharp edge
 * at rest. Corner k's stand from first[k] to first[k+1]. */
function findNeighbours(mesh, faces) {
  const c = mesh.corners,
    around = Array.from({ length: mesh.vertices }, () => []);
  for (let k = 0; k < c.length; k++) around[c[k]].push(Math.floor(k / 3));
  const size = (t) => Math.hypot(faces[3 * t], faces[3 * t + 1], faces[3 * t + 2]) || 1;
  const first = new Int32Array(c.length + 1),
    list = [];
  for (let k = 0; k < c.length; k++) {
    const t = Math.floor(k / 3);
    for (const u of around[c[k]]) {
      const dot =
        faces[3 * t] * faces[3 * u] + faces[3 * t + 1] * faces[3 * u + 1] + faces[3 * t + 2] * faces[3 * u + 2];
      if (u === t || dot > SHARP * size(t) * size(u)) list.push(u);
    }
    first[k + 1] = list.length;
  }
  mesh.firstNeighbour = first;
  mesh.neighbours = Int32Array.from(list);
}

/* Pairs of corners whose lines are edges of the mesh, each once. */
function findEdges(mesh) {
  const seen = new Set(),
    pairs = [],
    c = mesh.corners;
  for (let t = 0; t < mesh.triangles; t++)
    for (let k = 0; k < 3; k++) {
      if (mesh.hidden.length && (mesh.hidden[t] >> k) & 1) continue;
      const a = c[3 * t + ((k + 1) % 3)],
        b = c[3 * t + ((k + 2) % 3)];
      const key = Math.min(a, b) * mesh.vertices + Math.max(a, b);
      if (!seen.has(key)) {
        seen.add(key);
        pairs.push(3 * t + ((k + 1) % 3), 3 * t + ((k + 2) % 3));
      }
    }
  mesh.edgePairs = pairs;
}

class Body {
  constructor(told, bytes) {
    this.told = told;
    this.quantum = told.quantum;
    this.mesh = readMesh(bytes, told.mesh, told.quantum);
    this.obstacles = told.obstacles.map((obstacle) => ({ ...obstacle, triangles: readList(bytes, obstacle.corners) }));
    const obstacleNumbers = this.obstacles.reduce((sum, obstacle) => sum + 3 * obstacle.vertices, 0);
    this.fieldsAt = 3 * this.mesh.nodes + obstacleNumbers;
    this.frames = readFrames(
      bytes,
      told.at,
      told.times.length,
      this.fieldsAt + told.fields.length * this.mesh.nodes,
      Math.ceil(this.mesh.tetCount / 8),
    );
    const corners = this.mesh.corners.length;
    this.corner = {
      x: new Float32Array(3 * corners),
      normals: new Float32Array(3 * corners),
      colours: new Float32Array(3 * corners),
    };
    this.frame = -1;
  }

  /* The frame nearest in time. */
  frameAt(time) {
    let best = 0;
    this.told.times.forEach((own, k) => {
      if (Math.abs(own - time) < Math.abs(this.told.times[best] - time)) best = k;
    });
    return best;
  }

  isInverted(tet) {
    return (this.frames[this.frame].flags[tet >> 3] >> (tet & 7)) & 1;
  }

  /* Values of a field at the vertices; null: no field. */
  valuesOf(field) {
    if (field < 0) return null;
    const [low, step] = this.told.fields[field],
      values = new Float64Array(this.mesh.vertices);
    const from = this.fieldsAt + field * this.mesh.nodes,
      numbers = this.frames[this.frame].values;
    for (let i = 0; i < this.mesh.nodes; i++) values[i] = low + step * numbers[from + i];
    return extend(this.mesh, values, 1);
  }

  /* Moves to a frame. */
  move(frame) {
    const { mesh, corner } = this;
    this.frame = frame;
    this.x = positionsOf(mesh, this.frames[frame].values, this.quantum);
    const faces = faceNormals(mesh, this.x);
    for (let k = 0; k < mesh.corners.length; k++) {
      let nx = 0,
        ny = 0,
        nz = 0;
      for (let i = mesh.firstNeighbour[k]; i < mesh.firstNeighbour[k + 1]; i++) {
        const t = 3 * mesh.neighbours[i];
        nx += faces[t];
        ny += faces[t + 1];
        nz += faces[t + 2];
      }
      const size = Math.hypot(nx, ny, nz) || 1;
      corner.normals[3 * k] = nx / size;
      corner.normals[3 * k + 1] = ny / size;
      corner.normals[3 * k + 2] = nz / size;
      for (let d = 0; d < 3; d++) corner.x[3 * k + d] = this.x[3 * mesh.corners[k] + d];
    }
  }

  /* Colours the surface; `field` -1: as flesh. Keeps what a section needs. */
  colour(field, scale) {
    const { mesh, corner } = this,
      values = this.valuesOf(field);
    this.paint = { values, ...scale };
    for (let k = 0; k < mesh.corners.length; k++) {
      const black = values && this.isInverted(mesh.behind[Math.floor(k / 3)]);
      this.put(corner.colours, k, black, values ? values[mesh.corners[k]] : 0);
    }
  }

  put(colours, k, black, value) {
    if (black || !this.paint.values) return colours.set(black ? INVERTED : FLESH, 3 * k);
    const part = (value - this.paint.low) / (this.paint.high - this.paint.low);
    const at = 3 * Math.round(1024 * Math.min(Math.max(part || 0, 0), 1));
    for (let d = 0; d < 3; d++) colours[3 * k + d] = this.paint.colours[at + d];
  }

  /* Positions of an obstacle's corners at the frame. */
  obstacleAt(k) {
    let from = 3 * this.mesh.nodes;
    for (let i = 0; i < k; i++) from += 3 * this.obstacles[i].vertices;
    const { vertices, triangles } = this.obstacles[k],
      numbers = this.frames[this.frame].values;
    const x = new Float32Array(3 * triangles.length);
    triangles.forEach((v, c) => {
      for (let d = 0; d < 3; d++) x[3 * c + d] = numbers[from + d * vertices + v] * this.quantum;
    });
    return x;
  }

  /* Where the plane n·x = d cuts the tets: triangles with colours, and the lines around each tet's part. */
  section(n, d) {
    const { mesh, x } = this,
      out = { x: [], colours: [], lines: [], normal: n };
    const away = new Float64Array(mesh.nodes),
      local = new Int32Array(10);
    for (let i = 0; i < mesh.nodes; i++) away[i] = n[0] * x[3 * i] + n[1] * x[3 * i + 1] + n[2] * x[3 * i + 2] - d;
    for (let t = 0; t < mesh.tetCount; t++) {
      for (let k = 0; k < 4; k++) local[k] = mesh.tets[4 * t + k];
      if (mesh.order === 1 || mesh.edges[6 * t] < 0) {
        this.cut(local, away, t, out);
        continue;
      }
      for (let k = 0; k < 6; k++) local[4 + k] = mesh.edges[6 * t + k];
      for (const part of PARTS)
        this.cut(
          part.map((k) => local[k]),
          away,
          t,
          out,
        );
    }
    return {
      x: Float32Array.from(out.x),
      colours: Float32Array.from(out.colours),
      lines: Float32Array.from(out.lines),
    };
  }

  cut(tet, away, number, out) {
    const below = [],
      above = [];
    for (let k = 0; k < 4; k++) (away[tet[k]] > 0 ? above : below).push(tet[k]);
    if (!below.length || !above.length) return;
    /* In a ring: of two and two nodes the ends of edges that share a node follow each other. */
    const pairs =
      below.length === 2
        ? [
            [below[0], above[0]],
            [below[0], above[1]],
            [below[1], above[1]],
            [below[1], above[0]],
          ]
        : below.flatMap((b) => above.map((a) => [b, a]));
    const black = this.paint.values && this.isInverted(number);
    const ring = pairs.map(([b, a]) => {
      const part = away[b] / (away[b] - away[a]),
        point = [];
      for (let d = 0; d < 3; d++) point.push(this.x[3 * b + d] + part * (this.x[3 * a + d] - this.x[3 * b + d]));
      const v = this.paint.values,
        colour = [0, 0, 0];
      this.put(colourBuffer, 0, black, v ? v[b] + part * (v[a] - v[b]) : 0);
      for (let d = 0; d < 3; d++) colour[d] = colourBuffer[d];
      return { point, colour };
    });
    const [p, q, r] = ring.map((corner) => corner.point),
      a = q.map((at, d) => at - p[d]),
      b = r.map((at, d) => at - p[d]);
    const facing = out.normal.reduce(
      (sum, nd, d) => sum + nd * (a[(d + 1) % 3] * b[(d + 2) % 3] - a[(d + 2) % 3] * b[(d + 1) % 3]),
      0,
    );
    if (facing < 0) ring.reverse();
    for (let k = 1; k + 1 < ring.length; k++)
      for (const corner of [ring[0], ring[k], ring[k + 1]]) {
        out.x.push(...corner.point);
        out.colours.push(...corner.colour);
      }
    ring.forEach((corner, k) => out.lines.push(...corner.point, ...ring[(k + 1) % ring.length].point));
  }
}
const colourBuffer = new Float32Array(3);
