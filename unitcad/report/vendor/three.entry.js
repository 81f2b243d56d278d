export {
  AmbientLight, AlwaysStencilFunc, BackSide, Box3, BufferAttribute, BufferGeometry, Color, DecrementWrapStencilOp, DirectionalLight, DoubleSide,
  EdgesGeometry, FrontSide, Group, HemisphereLight, IncrementWrapStencilOp, LineBasicMaterial, LineSegments, Mesh,
  MeshBasicMaterial, MeshLambertMaterial, MeshStandardMaterial, NotEqualStencilFunc, OrthographicCamera, PerspectiveCamera, Plane,
  PlaneGeometry, ReplaceStencilOp, Scene, Sphere, Vector3, Vector2, WebGLRenderer, Raycaster, NoToneMapping,
} from "three";
export { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
