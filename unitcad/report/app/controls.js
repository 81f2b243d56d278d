// The controls of the 3D view: what stands on the bench, which parts are hidden, the cut, how far things stand apart.
(() => {
  "use strict";
  const { el, clear, createViewer, readGlb, spoken, views } = window.unitcad;
  const AXES = { y: "along the tail", x: "across the tail", z: "level" };
  let serial = 0;

  // A name that a person reads: layer1 as layer 1.
  function partName(name) {
    return name.replace(/(\d+)$/, " $1");
  }

  function hex(colour) {
    const channel = (c) => Math.round(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * c ** (1 / 2.4) - 0.055)).toString(16).padStart(2, "0");
    return `#${colour.map(channel).join("")}`;
  }

  // Parts with the offsets that lay the pieces of each name side by side, in rows on one level.
  function beside(parts) {
    const GAP = 7;
    const boxes = new Map();
    for (const { name, mesh, place: [x, y, turns] } of parts) {
      const box = boxes.get(name) || { low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity] };
      const [cos, sin] = [[1, 0, -1, 0][turns % 4], [0, 1, 0, -1][turns % 4]];
      for (let i = 0; i < mesh.position.length; i += 3) {
        const [a, b, c] = [mesh.position[i], mesh.position[i + 1], mesh.position[i + 2]];
        [x + cos * a - sin * b, y + sin * a + cos * b, c].forEach((value, k) => {
          if (value < box.low[k]) box.low[k] = value;
          if (value > box.high[k]) box.high[k] = value;
        });
      }
      boxes.set(name, box);
    }
    const sizes = [...boxes.values()].map(({ low, high }) => [high[0] - low[0] + GAP, high[1] - low[1] + GAP]);
    const across = Math.max(...sizes.map(([w]) => w), 1.4 * Math.sqrt(sizes.reduce((sum, [w, d]) => sum + w * d, 0)));
    let [x, y, deep] = [0, 0, 0];
    const offsets = new Map([...boxes].map(([name, { low }], i) => {
      const [w, d] = sizes[i];
      if (x + w > across && x) [x, y, deep] = [0, y - deep, 0];
      const offset = [x - low[0], y - d - low[1], -low[2]];
      [x, deep] = [x + w, Math.max(deep, d)];
      return [name, offset];
    }));
    return parts.map((part) => ({ ...part, offset: offsets.get(part.name) }));
  }

  // The scenes of a model: the unit, the whole set of moulds with the layers, and each moment of casting. A model
  // whose moulds are not there yet has the unit alone.
  function scenes(model, unit, tools) {
    const alone = unit.flatMap((mesh) => mesh.places.map((place) => ({ name: mesh.name, mesh, place, offset: model.unit_apart[mesh.name] })));
    const names = (parts) => [...new Set(parts.map((part) => part.name))];
    const ofUnit = [{ title: `The ${model.makes || "unit"}`, parts: alone, names: names(alone) }];
    if (!tools) return { unit: ofUnit, moulds: [] };
    const layers = unit.filter((mesh) => mesh.extras.made === "cast" && mesh.extras.step);
    const inMoulds = [
      ...tools.map((mesh) => ({ name: mesh.name, mesh, place: mesh.places[0], offset: model.moulds_apart[mesh.name] })),
      ...layers.flatMap((mesh) => model.cells.map((place) => ({ name: mesh.name, mesh, place, offset: model.moulds_apart[mesh.name] }))),
    ];
    const moments = model.moments.map((moment) => {
      const isUnit = moment.parts.some((name) => unit.some((mesh) => mesh.name === name && mesh.extras.made !== "cast"));
      return { title: moment.title, parts: isUnit ? alone : inMoulds, names: moment.parts };
    });
    return {
      unit: ofUnit,
      moulds: [{ title: "The pieces", parts: beside(inMoulds), names: names(inMoulds) }, ...moments],
    };
  }

  function range(label, attributes, oninput) {
    const id = `control-${(serial += 1)}`;
    const output = el("output", { for: id });
    const input = el("input", { type: "range", id, ...attributes, oninput: () => oninput(Number(input.value), output) });
    return { node: el("div", { className: "control" }, el("label", { for: id }, label), input, output), input, output };
  }

  // The view of a model. `update(model)` shows another one under the same controls, from the same side.
  async function createStage(host, first) {
    let model = first;
    const canvas = el("canvas", {
      tabindex: "0", role: "img",
      "aria-label": "3D view. Arrow keys turn it, plus and minus zoom, zero looks from the corner again.",
    });
    const panel = el("div", { className: "panel" });
    const frame = el("div", { className: "view" }, canvas);
    clear(host, el("div", { className: "stage" }, frame, panel));
    const viewer = createViewer(canvas);
    const read = async (from) => scenes(from, ...(await Promise.all([readGlb(from.unit), from.moulds && readGlb(from.moulds)])));
    let kinds = await read(model);
    const state = { kind: "unit", step: 0, hidden: new Set(), parts: null };
    const current = () => kinds[state.kind][Math.min(state.step, kinds[state.kind].length - 1)];

    const list = el("ul", { className: "parts" });
    const kindName = `kind-${(serial += 1)}`;
    const made = el("span", {});
    const ofMoulds = el("span", {});
    const radios = [["unit", made], ["moulds", ofMoulds]].map(([kind, label]) =>
      el("label", {}, el("input", { type: "radio", name: kindName, value: kind, checked: kind === state.kind, onchange: () => choose(kind) }), label));

    const step = range("Casting step", { min: 0, max: 0, step: 1, value: 0, name: "step" }, (value) => { state.step = value; update(true); });
    const before = el("button", { type: "button", onclick: () => move(-1), "aria-label": "Step back" }, "‹");
    const after = el("button", { type: "button", onclick: () => move(1), "aria-label": "Step on" }, "›");
    const stepRow = el("div", { className: "step" }, step.node, el("div", { className: "buttons" }, before, after));

    const apart = range("Taken apart", { min: 0, max: 100, step: 1, value: 0, name: "apart" }, (value, output) => {
      output.textContent = `${value} %`;
      viewer.apart(value / 100);
    });
    apart.input.addEventListener("change", () => viewer.look(state.view || "corner"));
    const at = range("Cut at", { min: 0, max: 1, step: 0.05, value: 0, name: "cut-at" }, () => { state.moved = true; cut(); });
    const cutOn = el("input", { type: "checkbox", name: "cut", checked: true, onchange: cut });
    const axis = el("select", { name: "axis", "aria-label": "Direction of the cut", onchange: () => { state.moved = false; limits(); cut(); } },
      Object.keys(AXES).map((value) => el("option", { value })));
    const buttons = el("div", { className: "buttons" }, views.map((name) =>
      el("button", { type: "button", onclick: () => { state.view = name; viewer.look(name); } }, spoken(name))));

    panel.append(
      el("fieldset", { className: "choice" }, el("legend", {}, "Show"), radios), stepRow,
      el("fieldset", {}, el("legend", {}, "Parts"), list),
      el("fieldset", {}, el("legend", {}, "Look"), apart.node,
        el("div", { className: "control" }, el("label", {}, cutOn, "Cut open"), axis), at.node, buttons));

    function cut() {
      const value = Number(at.input.value);
      at.output.textContent = `${value.toFixed(2)} mm`;
      at.input.disabled = axis.disabled = !cutOn.checked;
      // Slightly off the middle: a cut exactly in a face's plane shows false triangles.
      viewer.cut({ on: cutOn.checked, axis: axis.value, at: value + 1 / 1024 });
    }

    function limits() {
      const [low, high] = viewer.bounds()[axis.value];
      const stop = (value, round) => (round(value * 20) / 20).toFixed(2);
      at.input.min = stop(low, Math.floor);
      at.input.max = stop(high, Math.ceil);
      // Through the unit's axis; in a set of several, through the nearest row of cells; through an array's middle row.
      const row = model.row !== undefined ? model.row : kinds.moulds.length && state.parts === kinds.moulds[0].parts ? Math.min(...model.cells.map((cell) => cell[1])) : 0;
      const middle = { x: 0, y: row, z: (low + high) / 2 }[axis.value];
      if (!state.moved) at.input.value = stop(middle, Math.round);
    }

    function choose(kind) {
      state.kind = kind;
      state.step = 0;
      state.moved = false;
      step.input.value = 0;
      update(true);
    }

    function move(by) {
      state.step = Math.min(kinds.moulds.length - 1, Math.max(0, state.step + by));
      step.input.value = state.step;
      update(true);
    }

    // The pieces of a set lie side by side, whole; all else opens assembled and cut open.
    function lay(aside) {
      if (aside === state.aside) return;
      state.aside = aside;
      cutOn.checked = !aside;
      apart.input.value = aside ? 100 : 0;
      apart.output.textContent = `${apart.input.value} %`;
      viewer.apart(aside ? 1 : 0);
    }

    function update(lookAgain) {
      const scene = current();
      lay(state.kind === "moulds" && !state.step);
      if (state.parts !== scene.parts) {
        state.parts = scene.parts;
        viewer.show(scene.parts.map((part) => ({ ...part, shown: true })));
        limits();
      }
      stepRow.hidden = state.kind !== "moulds";
      step.input.max = Math.max(0, kinds.moulds.length - 1);
      step.output.textContent = state.step ? `${state.step} of ${kinds.moulds.length - 1}: ${scene.title}` : scene.title;
      step.input.setAttribute("aria-valuetext", scene.title);
      clear(list, scene.names.map((name) => {
        const mesh = scene.parts.find((part) => part.name === name).mesh;
        const swatch = el("span", { className: "swatch", "aria-hidden": "true" });
        swatch.style.background = hex(mesh.colour);
        const box = el("input", { type: "checkbox", name: `part-${name}`, checked: !state.hidden.has(name), onchange: () => {
          if (box.checked) state.hidden.delete(name);
          else state.hidden.add(name);
          shown();
        } });
        return el("li", {}, el("label", {}, box, swatch, partName(name)));
      }));
      shown();
      cut();
      if (lookAgain) viewer.look(state.view || "corner");
    }

    function shown() {
      const names = current().names.filter((name) => !state.hidden.has(name));
      viewer.visible((part) => names.includes(part.name));
      host.dataset.shown = names.join(" ");
    }

    apart.output.textContent = "0 %";
    offer();
    update(true);

    // What there is to show can be chosen, under the words of a unit or a patch.
    function offer() {
      for (const label of radios) label.querySelector("input").disabled = !kinds[label.querySelector("input").value].length;
      made.textContent = model.makes === "patch" ? "Patch" : "Unit";
      ofMoulds.textContent = kinds.moulds.length ? "Moulds" : model.moulds === undefined ? "Moulds (not made yet)" : "Moulds (none can be made)";
      for (const option of axis.options) option.textContent = (model.axes || AXES)[option.value];
    }

    async function replace(next) {
      const asked = (state.asked = (state.asked || 0) + 1);
      const fresh = await read(next);
      if (asked !== state.asked) return;
      const before = extent();
      model = next;
      kinds = fresh;
      if (!kinds[state.kind].length) state.kind = "unit";
      for (const label of radios) label.querySelector("input").checked = label.querySelector("input").value === state.kind;
      offer();
      state.step = Math.min(state.step, Math.max(0, kinds.moulds.length - 1));
      step.input.value = state.step;
      update(false);
      // Another patch or unit, which the look from before would show in part or tiny.
      if (Math.abs(Math.log(extent() / before)) > Math.log(1.5)) viewer.look(state.view || "corner");
    }

    // The length of the diagonal of all that stands there, mm.
    function extent() {
      return Math.hypot(...Object.values(viewer.bounds()).map(([low, high]) => high - low));
    }

    return { update: replace, free: () => viewer.free() };
  }

  Object.assign(window.unitcad, { createStage, partName });
})();
