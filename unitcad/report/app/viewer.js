// The 3D view: parts with edges, a cut that shows solid faces (stencil caps), parts moved apart. Drawn on demand.
(() => {
  "use strict";
  const { theme } = window.unitcad;
  const CREASE_DEG = 20;
  const VIEWS = { corner: [0.55, -1, 0.55], front: [0, -1, 0.001], above: [0, -0.001, 1], below: [0.45, -1, -0.7], side: [1, 0, 0.001] };
  // What a cut takes away faces the first view: the near side, the right one, the top.
  const CUTS = { y: [0, 1, 0], x: [-1, 0, 0], z: [0, 0, -1] };
  // A cap's turns about x and y, and which lengths of the box then are its width and its height.
  const CAPS = { y: [Math.PI / 2, 0, "x", "z"], x: [0, Math.PI / 2, "z", "y"], z: [0, 0, "x", "y"] };
  const INVERT = 5386; // GL_INVERT, which three.js calls InvertStencilOp

  function createViewer(canvas) {
    const renderer = new THREE.WebGLRenderer({ canvas, antialias: true, alpha: true, stencil: true, preserveDrawingBuffer: true });
    renderer.localClippingEnabled = true;
    const scene = new THREE.Scene();
    const camera = new THREE.PerspectiveCamera(24, 1, 0.5, 2000);
    camera.up.set(0, 0, 1);
    scene.add(camera, new THREE.HemisphereLight(0xffffff, 0xb8b4ac, 1.6));
    const key = new THREE.DirectionalLight(0xffffff, 1.7);
    key.position.set(-0.5, 0.8, 1);
    camera.add(key);
    const controls = new THREE.OrbitControls(camera, canvas);
    controls.enableZoom = false;
    controls.addEventListener("change", draw);
    const plane = new THREE.Plane(new THREE.Vector3(0, 1, 0), 0);
    const sheet = new THREE.PlaneGeometry(1, 1);
    const state = { parts: [], gone: [], apart: 0, cut: { on: false, axis: "y", at: 0 } };
    let waiting = false;

    function draw() {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        renderer.render(scene, camera);
        // Their materials are let go once the new ones are drawn, which so need no new shaders.
        state.gone.splice(0).forEach(dispose);
      });
    }

    function resize() {
      const { clientWidth: width, clientHeight: height } = canvas.parentElement;
      if (!width || !height) return;
      renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
      renderer.setSize(width, height, false);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
      draw();
    }
    new ResizeObserver(resize).observe(canvas.parentElement);

    // A mesh's GPU objects, made once however often it is placed.
    function geometryOf(mesh) {
      if (!mesh.geometry) {
        mesh.geometry = new THREE.BufferGeometry();
        mesh.geometry.setAttribute("position", new THREE.BufferAttribute(mesh.position, 3));
        mesh.geometry.setAttribute("normal", new THREE.BufferAttribute(mesh.normal, 3));
        mesh.geometry.setIndex(new THREE.BufferAttribute(mesh.index, 1));
        mesh.geometry.computeBoundingBox();
        mesh.edges = new THREE.EdgesGeometry(mesh.geometry, CREASE_DEG);
      }
      return mesh.geometry;
    }

    // Marks the pixels behind which the cut solid is open: there an odd number of its faces is left.
    function stencil() {
      return new THREE.MeshBasicMaterial({
        side: THREE.DoubleSide, depthWrite: false, depthTest: false, colorWrite: false, clippingPlanes: [plane],
        stencilWrite: true, stencilFunc: THREE.AlwaysStencilFunc,
        stencilFail: INVERT, stencilZFail: INVERT, stencilZPass: INVERT,
      });
    }

    // All copies of a mesh, which do not overlap: one cap closes the cut through them all, and clears their marks.
    function makePart(copies, order) {
      const [{ name, mesh, offset = [0, 0, 0], shown }] = copies;
      const geometry = geometryOf(mesh);
      const colour = new THREE.Color(...mesh.colour);
      const surface = new THREE.MeshLambertMaterial({ color: colour, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 });
      const edges = new THREE.LineBasicMaterial();
      const mark = stencil();
      const group = new THREE.Group();
      for (const { place: [x, y, turns] = [0, 0, 0] } of copies) {
        const copy = new THREE.Group();
        copy.position.set(x, y, 0);
        copy.rotation.z = (turns * Math.PI) / 2;
        copy.add(new THREE.Mesh(geometry, surface), new THREE.LineSegments(mesh.edges, edges), new THREE.Mesh(geometry, mark));
        [1000, 1001, order + 1].forEach((rank, i) => { copy.children[i].renderOrder = rank; });
        group.add(copy);
      }
      const cap = new THREE.Mesh(sheet, new THREE.MeshBasicMaterial({
        color: colour, side: THREE.DoubleSide, stencilWrite: true, stencilRef: 0, stencilFunc: THREE.NotEqualStencilFunc,
        stencilFail: THREE.ReplaceStencilOp, stencilZFail: THREE.ReplaceStencilOp, stencilZPass: THREE.ReplaceStencilOp,
      }));
      cap.renderOrder = order + 1.1;
      scene.add(group, cap);
      return { name, mesh, offset, shown, group, surface, edges, mark, cap };
    }

    function dispose({ surface, edges, mark, cap }) {
      for (const material of [surface, edges, mark, cap.material]) material.dispose();
    }

    // The box of each copy of a part, where it stands.
    function boxes(part) {
      part.group.updateMatrixWorld(true);
      return part.group.children.map((copy) => part.mesh.geometry.boundingBox.clone().applyMatrix4(copy.matrixWorld));
    }

    function around(found) {
      return found.reduce((whole, one) => whole.union(one), new THREE.Box3());
    }

    function arrange() {
      const { on, axis, at } = state.cut;
      plane.normal.set(...CUTS[axis]);
      plane.constant = -at * (plane.normal.x + plane.normal.y + plane.normal.z);
      const ink = theme.dark ? 0x0c0e10 : 0x23282d;
      for (const part of state.parts) {
        const [dx, dy, dz] = part.offset;
        part.group.position.set(dx * state.apart, dy * state.apart, dz * state.apart);
        part.group.visible = part.shown;
        part.surface.clippingPlanes = part.edges.clippingPlanes = on ? [plane] : [];
        part.edges.color.set(ink);
        placeCap(part);
      }
      draw();
    }

    // Every pixel costs time where there is no graphics card: what the cut does not meet has no marks, what it takes
    // away is not drawn, and a cap is as large as what it closes.
    function placeCap(part) {
      const { on, axis, at } = state.cut;
      const found = boxes(part);
      const met = found.filter((box) => box.min[axis] <= at && box.max[axis] >= at);
      part.group.children.forEach((copy, i) => {
        copy.visible = !on || (CUTS[axis].includes(-1) ? found[i].min[axis] <= at : found[i].max[axis] >= at);
        copy.children[2].visible = on && met.includes(found[i]);
      });
      part.cap.visible = on && part.shown && met.length > 0;
      if (!part.cap.visible) return;
      const size = around(met).getSize(new THREE.Vector3());
      const [aboutX, aboutY, width, height] = CAPS[axis];
      around(met).getCenter(part.cap.position)[axis] = at;
      part.cap.rotation.set(aboutX, aboutY, 0);
      part.cap.scale.set(1.02 * size[width] + 0.02, 1.02 * size[height] + 0.02, 1);
    }

    function corners() {
      return state.parts.filter((part) => part.shown).flatMap(boxes).flatMap(({ min, max }) =>
        [min.x, max.x].flatMap((x) => [min.y, max.y].flatMap((y) => [min.z, max.z].map((z) => new THREE.Vector3(x, y, z)))));
    }

    // Look from a side at all that is shown, as near as it fits.
    function look(name) {
      const points = corners();
      if (!points.length) return;
      const sphere = new THREE.Box3().setFromPoints(points).getBoundingSphere(new THREE.Sphere());
      const side = new THREE.Vector3(...VIEWS[name]).normalize();
      const target = sphere.center.clone();
      let distance = sphere.radius * 6;
      const tangent = Math.tan((camera.fov * Math.PI) / 360);
      for (let round = 0; round < 6; round += 1) {
        camera.position.copy(side).multiplyScalar(distance).add(target);
        camera.near = distance / 50;
        camera.far = distance * 20;
        camera.lookAt(target);
        camera.updateProjectionMatrix();
        camera.updateMatrixWorld(true);
        const seen = new THREE.Box3().setFromPoints(points.map((point) => point.clone().project(camera)));
        const middle = seen.getCenter(new THREE.Vector3());
        const size = seen.getSize(new THREE.Vector3());
        const right = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 0);
        const up = new THREE.Vector3().setFromMatrixColumn(camera.matrixWorld, 1);
        target.addScaledVector(right, middle.x * distance * tangent * camera.aspect).addScaledVector(up, middle.y * distance * tangent);
        distance *= Math.max(size.x, size.y) / 1.8;
      }
      camera.position.copy(side).multiplyScalar(distance).add(target);
      controls.target.copy(target);
      controls.update();
      draw();
    }

    // Turn by angles (radians) about the target; move nearer by a factor.
    function turn(left, up, factor = 1) {
      const arm = camera.position.clone().sub(controls.target);
      const radius = arm.length() * factor;
      const azimuth = Math.atan2(arm.y, arm.x) + left;
      const height = Math.min(Math.PI / 2 - 0.01, Math.max(-Math.PI / 2 + 0.01, Math.asin(arm.z / arm.length()) + up));
      arm.set(Math.cos(height) * Math.cos(azimuth), Math.cos(height) * Math.sin(azimuth), Math.sin(height)).multiplyScalar(radius);
      camera.position.copy(controls.target).add(arm);
      controls.update();
      draw();
    }

    const keys = {
      ArrowLeft: () => turn(-0.12, 0), ArrowRight: () => turn(0.12, 0), ArrowUp: () => turn(0, 0.12), ArrowDown: () => turn(0, -0.12),
      "+": () => turn(0, 0, 0.9), "=": () => turn(0, 0, 0.9), "-": () => turn(0, 0, 1.1), 0: () => look("corner"), Home: () => look("corner"),
    };
    canvas.addEventListener("keydown", (event) => {
      if (!keys[event.key] || event.ctrlKey || event.metaKey) return;
      keys[event.key]();
      event.preventDefault();
    });
    // The wheel scrolls the page until somebody works in the view.
    canvas.addEventListener("focus", () => { controls.enableZoom = true; });
    canvas.addEventListener("blur", () => { controls.enableZoom = false; });
    canvas.addEventListener("pointerdown", () => canvas.focus({ preventScroll: true }));
    theme.watch(canvas, () => state.parts.length && arrange());

    return {
      // parts: [{name, mesh, place: [x, y, quarter turns], offset: [x, y, z], shown}]
      show(parts) {
        state.gone.push(...state.parts);
        for (const part of state.parts) scene.remove(part.group, part.cap);
        const meshes = [...new Set(parts.map((part) => part.mesh))];
        state.parts = meshes.map((mesh) => parts.filter((part) => part.mesh === mesh)).map(makePart);
        arrange();
      },
      visible(isShown) {
        for (const part of state.parts) part.shown = isShown(part);
        arrange();
      },
      cut(cut) { Object.assign(state.cut, cut); arrange(); },
      apart(share) { state.apart = share; arrange(); },
      look,
      bounds() {
        const all = around(state.parts.flatMap(boxes));
        return { x: [all.min.x, all.max.x], y: [all.min.y, all.max.y], z: [all.min.z, all.max.z] };
      },
      free() {
        [...state.gone, ...state.parts].forEach(dispose);
        sheet.dispose();
        controls.dispose();
        renderer.dispose();
      },
    };
  }

  Object.assign(window.unitcad, { createViewer, views: Object.keys(VIEWS) });
})();
