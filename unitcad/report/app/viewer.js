// The 3D view: parts with edges, a cut that shows solid faces (stencil caps), parts moved apart. Drawn on demand.
(() => {
  "use strict";
  const { theme } = window.unitcad;
  const CREASE_DEG = 20;
  const VIEWS = { corner: [0.55, -1, 0.55], front: [0, -1, 0.001], above: [0, -0.001, 1], below: [0.45, -1, -0.7], side: [1, 0, 0.001] };
  // What a cut takes away faces the first view: the near side, the right one, the top.
  const CUTS = { y: [0, 1, 0], x: [-1, 0, 0], z: [0, 0, -1] };

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
    const state = { parts: [], apart: 0, cut: { on: false, axis: "y", at: 0 } };
    let waiting = false;

    function draw() {
      if (waiting) return;
      waiting = true;
      requestAnimationFrame(() => {
        waiting = false;
        renderer.render(scene, camera);
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

    function stencil(geometry, side, operation) {
      const material = new THREE.MeshBasicMaterial({
        side, depthWrite: false, depthTest: false, colorWrite: false, clippingPlanes: [plane],
        stencilWrite: true, stencilFunc: THREE.AlwaysStencilFunc,
        stencilFail: operation, stencilZFail: operation, stencilZPass: operation,
      });
      return new THREE.Mesh(geometry, material);
    }

    function makePart(description, order) {
      const { mesh, place = [0, 0, 0] } = description;
      const geometry = geometryOf(mesh);
      const colour = new THREE.Color(...mesh.colour);
      const group = new THREE.Group();
      const surface = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color: colour, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
      surface.renderOrder = 1000;
      const edges = new THREE.LineSegments(mesh.edges, new THREE.LineBasicMaterial());
      edges.renderOrder = 1001;
      const marks = [stencil(geometry, THREE.BackSide, THREE.IncrementWrapStencilOp), stencil(geometry, THREE.FrontSide, THREE.DecrementWrapStencilOp)];
      for (const mark of marks) mark.renderOrder = order + 1;
      group.add(surface, edges, ...marks);
      group.rotation.z = (place[2] * Math.PI) / 2;
      const cap = new THREE.Mesh(new THREE.PlaneGeometry(1000, 1000), new THREE.MeshBasicMaterial({
        color: colour, side: THREE.DoubleSide, stencilWrite: true, stencilRef: 0, stencilFunc: THREE.NotEqualStencilFunc,
        stencilFail: THREE.ReplaceStencilOp, stencilZFail: THREE.ReplaceStencilOp, stencilZPass: THREE.ReplaceStencilOp,
      }));
      cap.renderOrder = order + 1.1;
      cap.onAfterRender = () => renderer.clearStencil();
      scene.add(group, cap);
      return { ...description, group, surface, edges, marks, cap };
    }

    function free(part) {
      scene.remove(part.group, part.cap);
      part.cap.geometry.dispose();
      for (const thing of [part.surface, part.edges, part.cap, ...part.marks]) thing.material.dispose();
    }

    function arrange() {
      const { on, axis, at } = state.cut;
      plane.normal.set(...CUTS[axis]);
      plane.constant = -at * (plane.normal.x + plane.normal.y + plane.normal.z);
      const ink = theme.dark ? 0x0c0e10 : 0x23282d;
      for (const part of state.parts) {
        const [x, y] = part.place || [0, 0];
        const [dx, dy, dz] = part.offset || [0, 0, 0];
        part.group.position.set(x + dx * state.apart, y + dy * state.apart, dz * state.apart);
        part.group.visible = part.shown;
        part.surface.material.clippingPlanes = on ? [plane] : [];
        part.edges.material.clippingPlanes = on ? [plane] : [];
        part.edges.material.color.set(ink);
        for (const mark of part.marks) mark.visible = on;
        part.cap.visible = on && part.shown;
        plane.coplanarPoint(part.cap.position);
        part.cap.lookAt(part.cap.position.clone().sub(plane.normal));
      }
      draw();
    }

    function box(shownOnly) {
      const all = new THREE.Box3();
      for (const part of state.parts) {
        if (shownOnly && !part.shown) continue;
        part.group.updateMatrixWorld(true);
        all.union(part.mesh.geometry.boundingBox.clone().applyMatrix4(part.group.matrixWorld));
      }
      return all;
    }

    // The corners of the boxes of what is shown.
    function corners() {
      const found = [];
      for (const part of state.parts.filter((each) => each.shown)) {
        const { min, max } = part.mesh.geometry.boundingBox;
        part.group.updateMatrixWorld(true);
        for (const x of [min.x, max.x]) for (const y of [min.y, max.y]) for (const z of [min.z, max.z]) {
          found.push(new THREE.Vector3(x, y, z).applyMatrix4(part.group.matrixWorld));
        }
      }
      return found;
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
        state.parts.forEach(free);
        state.parts = parts.map(makePart);
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
        const all = box(false);
        return { x: [all.min.x, all.max.x], y: [all.min.y, all.max.y], z: [all.min.z, all.max.z] };
      },
      free() {
        state.parts.forEach(free);
        controls.dispose();
        renderer.dispose();
      },
    };
  }

  Object.assign(window.unitcad, { createViewer, views: Object.keys(VIEWS) });
})();
