// Reads the GLB files that unitcad writes: meshes with positions (mm), normals and indices, a colour each.
(() => {
  "use strict";
  const ARRAYS = { 5126: Float32Array, 5123: Uint16Array, 5125: Uint32Array };
  const WIDTH = { SCALAR: 1, VEC3: 3 };

  async function unpacked(text) {
    const packed = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
    return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer();
  }

  // A node's place: x and y (mm), quarter turns about z.
  function placed(node) {
    const [x, y] = node.translation || [0, 0];
    const [, , sine, cosine] = node.rotation || [0, 0, 0, 1];
    return [x, y, (4 / Math.PI) * Math.atan2(sine, cosine)];
  }

  // [{name, colour: [r, g, b] linear, extras, position, normal, index, places: one for each node of the mesh}]
  function parsed(buffer) {
    const view = new DataView(buffer);
    const length = view.getUint32(12, true);
    const document = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 20, length)));
    const start = 20 + length + 8;
    const array = (index) => {
      const accessor = document.accessors[index];
      const offset = start + document.bufferViews[accessor.bufferView].byteOffset;
      return new ARRAYS[accessor.componentType](buffer.slice(offset), 0, accessor.count * WIDTH[accessor.type]);
    };
    return document.meshes.map((mesh, number) => {
      const nodes = document.nodes.filter((node) => node.mesh === number);
      const primitive = mesh.primitives[0];
      return {
        name: mesh.name,
        places: nodes.map(placed),
        extras: nodes[0].extras || {},
        colour: document.materials[primitive.material].pbrMetallicRoughness.baseColorFactor.slice(0, 3),
        position: array(primitive.attributes.POSITION),
        normal: array(primitive.attributes.NORMAL),
        index: array(primitive.indices),
      };
    });
  }

  // Base 64 of a GLB file, compressed or not: "H4sI" is how a compressed one begins.
  async function readGlb(text) {
    return parsed(text.startsWith("H4sI") ? await unpacked(text) : Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
  }

  Object.assign(window.unitcad, { unpacked, readGlb });
})();
