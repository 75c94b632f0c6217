/* scene.js: what WebGL draws: bodies, their sections and obstacles of every run, all seen by one camera. */
const VERTEX = `
attribute vec3 tint;
varying vec3 vTint, vNormal, vAt;
void main() {
  vTint = tint;
  vNormal = normal;
  vAt = position;
  gl_Position = projectionMatrix * viewMatrix * vec4(position, 1.0);
}`;

/* The light of flesh snap, without its shadows. */
const FRAGMENT = `
uniform vec3 sun, zenith, eye, middle;
uniform vec4 plane;
uniform bool clip, lit, valued;
uniform float fade, alpha;
varying vec3 vTint, vNormal, vAt;
void main() {
  if (clip && dot(plane.xyz, vAt) > plane.w) discard;
  vec3 rgb = vTint, n = normalize(vNormal), back = normalize(eye - vAt);
  bool inside = !gl_FrontFacing;
  if (inside) n = -n;
  if (lit) {
    float facing = max(dot(n, back), 0.0), light = max(dot(n, sun), 0.0);
    float sky = 0.5 + 0.5 * dot(n, zenith);
    float diffuse = 0.20 + 0.18 * sky + 0.13 * facing + 0.70 * light;
    float gloss = 0.10 * pow(max(dot(n, normalize(back + sun)), 0.0), 36.0);
    if (valued) rgb *= (inside ? 0.7 : 1.0) * (0.42 + 0.58 * min(diffuse, 1.0));
    else rgb = (inside ? 0.45 : 1.0) * (rgb * diffuse + gloss + 0.14 * pow(1.0 - facing, 4.0) * (0.4 + 0.6 * rgb));
  }
  float there = 1.0;
  if (fade > 0.0) {
    float part = clamp((1.0 - distance(vAt, middle) / fade) / 0.55, 0.0, 1.0);
    there = part * part * (3.0 - 2.0 * part);
  }
  gl_FragColor = vec4(min(rgb, 1.0), alpha * there);
  #include <colorspace_fragment>
}`;
const OBSTACLE = [168, 176, 188].map((value) => toLinear(value / 255)),
  GLASS = 0.26;

function makeMaterial(shared, options, uniforms) {
  return new THREE.ShaderMaterial({
    vertexShader: VERTEX,
    fragmentShader: FRAGMENT,
    side: THREE.DoubleSide,
    ...options,
    uniforms: { ...shared, fade: { value: 0 }, alpha: { value: 1 }, valued: { value: true }, ...uniforms },
  });
}

/* Geometry whose arrays may be replaced by ones of other lengths. */
function setArrays(geometry, arrays) {
  for (const [name, array] of Object.entries(arrays)) {
    const old = geometry.getAttribute(name);
    if (old && old.array === array) old.needsUpdate = true;
    else geometry.setAttribute(name, new THREE.BufferAttribute(array, 3));
  }
}

function repeat(colour, count) {
  const made = new Float32Array(3 * count);
  for (let k = 0; k < count; k++) made.set(colour, 3 * k);
  return made;
}

function flatNormals(x) {
  const normals = new Float32Array(x.length),
    p = new THREE.Vector3(),
    q = new THREE.Vector3(),
    r = new THREE.Vector3();
  for (let k = 0; k + 9 <= x.length; k += 9) {
    p.fromArray(x, k);
    q.fromArray(x, k + 3).sub(p);
    r.fromArray(x, k + 6).sub(p);
    q.cross(r).normalize();
    for (let c = 0; c < 9; c += 3) q.toArray(normals, k + c);
  }
  return normals;
}

/* One run's objects. */
class Stand {
  constructor(body, shared) {
    this.body = body;
    this.scene = new THREE.Scene();
    this.skin = makeMaterial(shared, { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
    this.line = makeMaterial(shared, { transparent: true }, { alpha: { value: 0.45 }, lit: { value: false } });
    /* The plane would take its own section away. */
    this.face = makeMaterial(
      shared,
      { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 },
      { clip: { value: false } },
    );
    this.faceLine = makeMaterial(
      shared,
      { transparent: true },
      { alpha: { value: 0.25 }, lit: { value: false }, clip: { value: false } },
    );
    this.surface = this.add(new THREE.Mesh(new THREE.BufferGeometry(), this.skin));
    this.edges = this.add(new THREE.LineSegments(this.surface.geometry.clone(), this.line));
    this.cut = this.add(new THREE.Mesh(new THREE.BufferGeometry(), this.face));
    this.cutEdges = this.add(new THREE.LineSegments(new THREE.BufferGeometry(), this.faceLine));
    this.obstacles = body.obstacles.map((obstacle) => {
      const geometry = new THREE.BufferGeometry();
      const uniforms = { fade: { value: obstacle.fade }, valued: { value: false }, clip: { value: false } };
      const front = makeMaterial(shared, { side: 0, transparent: obstacle.fade > 0 }, uniforms);
      const back = makeMaterial(
        shared,
        { side: 1, transparent: true, depthWrite: false },
        { ...uniforms, alpha: { value: GLASS } },
      );
      this.add(new THREE.Mesh(geometry, front));
      const glass = this.add(new THREE.Mesh(geometry, back));
      glass.renderOrder = 2;
      return geometry;
    });
  }

  add(object) {
    object.frustumCulled = false;
    object.matrixAutoUpdate = false;
    this.scene.add(object);
    return object;
  }

  /* Brings the objects up to the body's frame and colours. */
  update(state) {
    const { body } = this,
      { corner, mesh } = body;
    setArrays(this.surface.geometry, { position: corner.x, normal: corner.normals, tint: corner.colours });
    this.skin.uniforms.valued.value = this.face.uniforms.valued.value = state.field >= 0;
    this.edges.visible = this.cutEdges.visible = state.wireframe;
    if (state.wireframe) {
      const pairs = mesh.edgePairs,
        x = new Float32Array(3 * pairs.length);
      pairs.forEach((c, k) => {
        for (let d = 0; d < 3; d++) x[3 * k + d] = corner.x[3 * c + d];
      });
      setArrays(this.edges.geometry, {
        position: x,
        normal: new Float32Array(x.length),
        tint: new Float32Array(x.length),
      });
    }
    this.cut.visible = state.clip;
    this.cutEdges.visible = state.clip && state.wireframe;
    if (state.clip) {
      const made = body.section(state.normal, state.offset),
        count = made.x.length / 3;
      setArrays(this.cut.geometry, { position: made.x, normal: repeat(state.normal, count), tint: made.colours });
      const none = new Float32Array(made.lines.length);
      setArrays(this.cutEdges.geometry, { position: made.lines, normal: none, tint: none });
    }
    this.obstacles.forEach((geometry, k) => {
      const x = body.obstacleAt(k);
      setArrays(geometry, { position: x, normal: flatNormals(x), tint: repeat(OBSTACLE, x.length / 3) });
    });
  }
}

class Stage {
  constructor(canvas, camera, bodies) {
    this.told = camera;
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.setClearColor(0, 0);
    this.renderer.autoClear = false;
    const vector = (from) => new THREE.Vector3(...from);
    this.shared = {
      sun: { value: vector([0, 0, 1]) },
      zenith: { value: vector(camera.zenith) },
      eye: { value: vector([0, 0, 1]) },
      middle: { value: vector(camera.target) },
      plane: { value: { x: 1, y: 0, z: 0, w: 0, isVector4: true } },
      clip: { value: false },
      lit: { value: true },
    };
    this.stands = bodies.map((body) => new Stand(body, this.shared));
    this.camera = camera.distance > 0 ? new THREE.PerspectiveCamera() : new THREE.OrthographicCamera();
    this.camera.up.copy(vector(camera.zenith));
    this.controls = new THREE.OrbitControls(this.camera, canvas);
    this.controls.enableDamping = false;
  }

  /* Looks as the first picture does, in cells of this shape. */
  reset(aspect) {
    const { told, camera } = this,
      height = told.height * Math.max(1, told.aspect / aspect);
    const far = told.distance > 0 ? (told.distance * height) / told.height : 4 * height;
    const target = new THREE.Vector3(...told.target),
      back = new THREE.Vector3(...told.back);
    this.seen = height;
    camera.position.copy(target).addScaledVector(back, far);
    camera.zoom = 1;
    camera.near = far / 200;
    camera.far = far * 50;
    if (camera.isPerspectiveCamera) camera.fov = (2 * Math.atan(told.height / 2 / told.distance) * 180) / Math.PI;
    this.controls.target.copy(target);
    this.shape(aspect);
    this.controls.update();
  }

  shape(aspect) {
    const { camera } = this;
    if (camera.isPerspectiveCamera) camera.aspect = aspect;
    else
      Object.assign(camera, {
        top: this.seen / 2,
        bottom: -this.seen / 2,
        left: (-aspect * this.seen) / 2,
        right: (aspect * this.seen) / 2,
      });
    camera.updateProjectionMatrix();
  }

  /* Turns by angles about the zenith and sideways, in radians; comes nearer by a factor. */
  turn(across, up, nearer) {
    const { camera, controls } = this,
      from = camera.position.clone().sub(controls.target);
    from.applyAxisAngle(camera.up, across);
    const side = new THREE.Vector3().crossVectors(camera.up, from).normalize(),
      tilted = from.clone().applyAxisAngle(side, up);
    if (Math.abs(tilted.clone().normalize().dot(camera.up)) < 0.998) from.copy(tilted);
    if (camera.isPerspectiveCamera) from.multiplyScalar(nearer);
    else camera.zoom /= nearer;
    camera.position.copy(controls.target).add(from);
    camera.updateProjectionMatrix();
    controls.update();
  }

  /* Draws stands into cells: [{stand, x, y, width, height}] in pixels of the page from the upper left. */
  render(cells, width, height) {
    const { renderer, camera, shared } = this,
      ratio = Math.min(window.devicePixelRatio || 1, 2);
    renderer.setPixelRatio(ratio);
    renderer.setSize(width, height, false);
    camera.updateMatrixWorld();
    const m = camera.matrixWorld.elements,
      axis = (k) => new THREE.Vector3(m[4 * k], m[4 * k + 1], m[4 * k + 2]);
    shared.sun.value.copy(axis(2)).addScaledVector(axis(1), 0.9).addScaledVector(axis(0), -0.65).normalize();
    shared.eye.value.copy(camera.position);
    renderer.setScissorTest(true);
    for (const cell of cells) {
      renderer.setViewport(cell.x, height - cell.y - cell.height, cell.width, cell.height);
      renderer.setScissor(cell.x, height - cell.y - cell.height, cell.width, cell.height);
      renderer.clear();
      renderer.render(cell.stand.scene, camera);
    }
  }
}
