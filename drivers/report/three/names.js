// names.js: what the report uses of three.js; make.sh bundles it into three.min.js, as the global THREE.
export {
  BufferAttribute, BufferGeometry, DoubleSide, LineBasicMaterial, LineSegments, Mesh, OrthographicCamera,
  PerspectiveCamera, Plane, Scene, ShaderMaterial, Vector3, WebGLRenderer
} from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
