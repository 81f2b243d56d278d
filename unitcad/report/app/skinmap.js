// The map of the skin's motion: units superposed by their radial tables, with the formula of unitcad/skin_map.py.
(() => {
  "use strict";
  const U = window.unitcad;
  const POINTS = 24_000, MOST = 1_500_000;
  const CYCLE_S = 2;
  const TURN = 2 * Math.PI;

  // Real and imaginary parts of u_r, u_theta and u_z at a radius (mm), over |u| at the unit's edge, into `out`.
  function radial(map, kind, r, out) {
    const { ends_mm: ends, terms } = kind;
    let [low, high] = [0, ends.length - 2];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (ends[middle] <= r) low = middle;
      else high = middle - 1;
    }
    const x = (2 * r - ends[low] - ends[low + 1]) / (ends[low + 1] - ends[low]);
    const first = low * map.terms;
    for (let part = 0; part < 6; part++) {
      let [one, two] = [0, 0];
      for (let k = first + map.terms - 1; k > first; k--) [one, two] = [terms[part][k] + 2 * x * one - two, one];
      out[part] = map.unit * (terms[part][first] + x * one - two);
    }
  }

  // Real and imaginary parts of the motion in x, y and z that a unit gives a point (mm), into `out`.
  function motion(map, place, x, y, out) {
    const kind = map.kinds[place.kind];
    let across = x - place.x;
    if (map.wrap_mm) across -= map.wrap_mm * Math.floor((across + map.wrap_mm / 2) / map.wrap_mm);
    const away = Math.hypot(across, y - place.y);
    const [cos, sin] = away ? [across / away, (y - place.y) / away] : [1, 0];
    radial(map, kind, away, out);
    if (kind.drive === "flat") {
      // e^(-i theta) (u_r, i u_theta, u_z): the force turns.
      [out[2], out[3]] = [-out[3], out[2]];
      for (let i = 0; i < 6; i += 2) [out[i], out[i + 1]] = [out[i] * cos + out[i + 1] * sin, out[i + 1] * cos - out[i] * sin];
    }
    const edge = absolute(map) ? kind.edge_um.value : 1;
    const [a, b, c, d] = out;
    [out[0], out[1]] = [edge * (a * cos - c * sin), edge * (b * cos - d * sin)];
    [out[2], out[3]] = [edge * (a * sin + c * cos), edge * (b * sin + d * cos)];
    [out[4], out[5]] = [edge * out[4], edge * out[5]];
  }

  const absolute = (map) => map.kinds.every((kind) => kind.edge_um);
  const frequencies = (map) => [...new Set(map.kinds.map((kind) => kind.frequency_hz))];

  // |u| of a kind over that at its edge.
  function size(map, kind, r) {
    const out = [];
    radial(map, kind, r, out);
    return Math.hypot(...out);
  }

  // The largest radius (mm) at which |u| is at least a share of that at the edge; 0: nowhere; null: beyond the table.
  function lastAbove(map, kind, share) {
    const ends = kind.ends_mm, radii = [];
    for (let i = 0; i + 1 < ends.length; i++) for (let k = 0; k < 8; k++) radii.push(ends[i] + (ends[i + 1] - ends[i]) * k / 8);
    radii.push(ends[ends.length - 1]);
    let i = radii.length - 1;
    while (i >= 0 && size(map, kind, radii[i]) < share) i--;
    if (i < 0) return 0;
    if (radii[i] >= 0.9 * ends[ends.length - 1]) return null; // a later crest may be above it
    let [low, high] = [radii[i], radii[i + 1]];
    for (let k = 0; k < 50; k++) {
      const middle = (low + high) / 2;
      if (size(map, kind, middle) >= share) low = middle;
      else high = middle;
    }
    return low;
  }

  // The threshold (um) of a kind: the typed one, or the published one; null if neither is known.
  const limit = (kind, typed) => typed || (kind.threshold ? kind.threshold.um.value : null);

  // A grid of points over the map, and each unit's motion there once it is on.
  function createField(map, points = Math.min(POINTS, MOST / map.places.length)) {
    const [x0, y0, x1, y1] = map.box_mm;
    const step = Math.sqrt((x1 - x0) * (y1 - y0) / points);
    const [columns, rows] = [Math.ceil((x1 - x0) / step) + 1, Math.ceil((y1 - y0) / step) + 1];
    const count = columns * rows, each = new Map(), out = new Float64Array(6);
    const at = (i) => [x0 + (x1 - x0) * (i % columns) / (columns - 1), y0 + (y1 - y0) * Math.floor(i / columns) / (rows - 1)];
    function of(number) {
      if (!each.has(number)) {
        const found = new Float32Array(6 * count);
        for (let i = 0; i < count; i++) {
          motion(map, map.places[number], ...at(i), out);
          found.set(out, 6 * i);
        }
        each.set(number, found);
      }
      return each.get(number);
    }
    // The complex sum of the units that are on, for each frequency: states[i] = { on, phase (degrees) }.
    function sums(states) {
      return frequencies(map).map((hertz) => {
        const total = new Float64Array(6 * count);
        states.forEach(({ on, phase }, number) => {
          if (!on || map.kinds[map.places[number].kind].frequency_hz !== hertz) return;
          const [own, re, im] = [of(number), Math.cos(phase * TURN / 360), Math.sin(phase * TURN / 360)];
          for (let i = 0; i < total.length; i += 2) {
            total[i] += re * own[i] - im * own[i + 1];
            total[i + 1] += re * own[i + 1] + im * own[i];
          }
        });
        return total;
      });
    }
    return { columns, rows, count, sums };
  }

  // |u| from the sums, each divided by a limit of its frequency.
  function amplitude(sums, limits = sums.map(() => 1)) {
    const found = new Float64Array(sums[0].length / 6);
    sums.forEach((total, k) => {
      for (let i = 0; i < total.length; i++) found[Math.floor(i / 6)] += (total[i] / limits[k]) ** 2;
    });
    return found.map(Math.sqrt);
  }

  // Ends of the segments on which values pass 1, as [column, row, column, row]: triangles around each cell's middle.
  function contour(values, columns, rows) {
    const found = [];
    const cut = (a, b) => { const t = (1 - a[2]) / (b[2] - a[2]); return [a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])]; };
    for (let row = 0; row + 1 < rows; row++) {
      for (let column = 0; column + 1 < columns; column++) {
        const corner = [[0, 0], [1, 0], [1, 1], [0, 1]].map(([i, j]) => [column + i, row + j, values[(row + j) * columns + column + i]]);
        const inside = corner.filter((one) => one[2] >= 1).length;
        if (inside === 0 || inside === 4) continue;
        const middle = [column + 0.5, row + 0.5, corner.reduce((sum, one) => sum + one[2], 0) / 4];
        corner.forEach((one, k) => {
          const three = [one, corner[(k + 1) % 4], middle];
          const ends = [];
          for (let i = 0; i < 3; i++) if ((three[i][2] >= 1) !== (three[(i + 1) % 3][2] >= 1)) ends.push(...cut(three[i], three[(i + 1) % 3]));
          if (ends.length === 4) found.push(ends);
        });
      }
    }
    return found;
  }

  // A colour between those of a scale, for a place from 0 to 1.
  function shade(scale, place) {
    const at = Math.min(Math.max(place, 0), 1) * (scale.length - 1), i = Math.min(Math.floor(at), scale.length - 2);
    return scale[i].map((channel, k) => channel + (at - i) * (scale[i + 1][k] - channel));
  }
  const MOVES = [[32, 82, 138], [246, 244, 238], [190, 74, 30]];

  const VIEWS = { amplitude: "Amplitude", z: "Out of the skin", x: "Along x", y: "Along y" };
  const COMPONENT = { x: 0, y: 2, z: 4 };

  // The section of a page: the map, its controls and its two figures.
  function createSkinMap(host, map) {
    const { el, clear, number } = U;
    const [x0, y0, x1, y1] = map.box_mm;
    const field = createField(map), several = map.places.length > 1;
    const unit = absolute(map) ? "µm" : "of the edge";
    const states = map.places.map(() => ({ on: true, phase: 0 }));
    const shown = { view: "amplitude", click: "on", cycle: 0, playing: false, typed: null, share: map.share };
    const canvas = el("canvas", { className: "skin-map", role: "img", tabindex: "0", "aria-label": "Map of the skin's motion" });
    const figures = el("ul", { className: "figures" });
    const cycle = el("input", { type: "range", min: "0", max: "360", step: "1", value: "0", name: "cycle", "aria-label": "Phase of the cycle", oninput: () => { shown.cycle = Number(cycle.value); paint(); } });
    const play = el("button", { type: "button", onclick: () => { shown.playing = !shown.playing; last = 0; settle(); if (shown.playing) requestAnimationFrame(tick); } }, "Play");
    const list = el("div", { className: "skin-units" });
    let sums = field.sums(states), values = null, last = 0;

    function summed() {
      sums = field.sums(states);
      settle();
    }

    function settle() {
      const component = shown.view !== "amplitude";
      for (const node of [cycle, play]) node.disabled = !component || sums.length > 1;
      play.textContent = shown.playing ? "Stop" : "Play";
      values = amplitude(sums);
      canvas.setAttribute("aria-label", `Map of the skin's motion: ${states.filter(({ on }) => on).length} of ${states.length} units on`);
      clear(figures, map.kinds.flatMap(told).map((line) => el("li", {}, line)));
      clear(list, several ? map.places.map(entry) : []);
      paint();
    }

    // The figures of a kind, with the range of the estimate as long as nothing else is typed.
    function told(kind) {
      const of = map.kinds.length > 1 ? `${kind.unit}: ` : "", lines = [];
      const length = (value, span) => (value === null ? "beyond the map" : `${number(value, 2)} mm`) +
        (span && span.low !== span.high ? ` (${[span.low, span.high].map((end) => (end === null ? "beyond the map" : number(end, 2))).join(" to ")})` : "");
      const um = limit(kind, shown.typed);
      if (!kind.edge_um) lines.push(`${of}No felt radius, since there is no level at the edge: ${kind.no_edge}.`);
      else if (!um) lines.push(`${of}No felt radius: ${kind.no_threshold}. Type a threshold.`);
      else {
        const own = shown.typed || !kind.threshold.site ? "typed" : `${kind.threshold.site}, level ${kind.threshold.status}`;
        const felt = shown.typed ? length(lastAbove(map, kind, um / kind.edge_um.value)) : length(kind.felt_mm.value, kind.felt_mm);
        lines.push(`${of}Felt radius of a unit: ${felt} from its middle. Threshold of touch at ${number(kind.frequency_hz)} Hz: ${number(um, 2)} µm (${own}).`);
      }
      const usual = shown.share === map.share, pitch = usual ? kind.pitch_mm.value : lastAbove(map, kind, shown.share);
      const least = pitch === null ? null : Math.max(pitch, kind.diameter_mm);
      lines.push(`${of}Least pitch at which a neighbour moves a unit's middle by less than ${number(100 * shown.share)} % of the motion at its own edge: ${length(least, usual && kind.pitch_mm)}.`);
      return lines;
    }

    function entry(place, i) {
      const phase = el("input", { type: "number", min: "-360", max: "360", step: "15", name: `phase-${place.name}`, "aria-label": `Phase of ${place.name}, degrees`, onchange: () => {
        states[i].phase = Number(phase.value) || 0;
        summed();
      } });
      phase.value = String(states[i].phase);
      const on = el("input", { type: "checkbox", name: `unit-${place.name}`, checked: states[i].on, onchange: () => { states[i].on = on.checked; summed(); } });
      return el("span", {}, el("label", {}, on, place.name), phase, "°");
    }

    const px = { left: 0, top: 0, scale: 1 };
    function paint() {
      const wide = Math.max(canvas.clientWidth || 640, 200), ratio = Math.min(window.devicePixelRatio || 1, 2);
      px.scale = (wide - 74) / (x1 - x0);
      const high = (y1 - y0) * px.scale;
      canvas.width = Math.round(wide * ratio);
      canvas.height = Math.round(high * ratio);
      canvas.style.height = `${high}px`;
      const pen = canvas.getContext("2d");
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      const largest = values.reduce((most, value) => Math.max(most, value), 0) || 1;
      const component = shown.view !== "amplitude" && sums.length === 1;
      const farthest = component ? reach() : largest;
      const place = component ? instant(farthest) : (i) => Math.log10(values[i] / largest) / map.decades + 1;
      const scale = component ? MOVES : map.scale;
      const pixels = new ImageData(field.columns, field.rows);
      for (let i = 0; i < field.count; i++) {
        const row = field.rows - 1 - Math.floor(i / field.columns);
        pixels.data.set([...shade(scale, place(i)), 255], 4 * (row * field.columns + i % field.columns));
      }
      const small = document.createElement("canvas");
      [small.width, small.height] = [field.columns, field.rows];
      small.getContext("2d").putImageData(pixels, 0, 0);
      const [dx, dy] = [(wide - 74) / (field.columns - 1), high / (field.rows - 1)]; // a pixel has its node in its middle
      pen.save();
      pen.beginPath();
      pen.rect(0, 0, wide - 74, high);
      pen.clip();
      pen.drawImage(small, -dx / 2, -dy / 2, wide - 74 + dx, high + dy);
      const limits = frequencies(map).map((hertz) => limit(map.kinds.find((kind) => kind.frequency_hz === hertz), shown.typed));
      if (absolute(map) && limits.every(Boolean)) {
        pen.strokeStyle = "#ff6a13";
        pen.lineWidth = 2;
        pen.lineCap = "round";
        pen.beginPath();
        for (const [a, b, c, d] of contour(amplitude(sums, limits), field.columns, field.rows)) {
          pen.moveTo(a * dx, high - b * dy);
          pen.lineTo(c * dx, high - d * dy);
        }
        pen.stroke();
      }
      drawUnits(pen, component);
      pen.restore();
      drawScale(pen, wide - 62, Math.min(high, 260), farthest, component);
    }

    // The largest amplitude of the component that is shown.
    function reach() {
      const part = COMPONENT[shown.view];
      let most = 0;
      for (let i = part; i < sums[0].length; i += 6) most = Math.max(most, Math.hypot(sums[0][i], sums[0][i + 1]));
      return most || 1;
    }

    // The place on the scale of a component at a moment of the cycle, e^(i omega t): a root, so that small motion shows.
    function instant(most) {
      const part = COMPONENT[shown.view], [cos, sin] = [Math.cos(shown.cycle * TURN / 360), Math.sin(shown.cycle * TURN / 360)];
      return (i) => {
        const moved = (sums[0][6 * i + part] * cos - sums[0][6 * i + part + 1] * sin) / most;
        return 0.5 + 0.5 * Math.sign(moved) * Math.sqrt(Math.abs(moved));
      };
    }

    function drawUnits(pen, component) {
      pen.lineJoin = "round";
      const ink = component ? "#1b1f23" : "#ffffff", halo = component ? "#ffffff" : "#102040";
      map.places.forEach((place, i) => {
        const radius = map.kinds[place.kind].diameter_mm / 2 * px.scale;
        const [x, y] = [(place.x - x0) * px.scale, (y1 - place.y) * px.scale];
        pen.strokeStyle = ink;
        pen.lineWidth = states[i].on ? 1.8 : 1;
        pen.setLineDash(states[i].on ? [] : [3, 3]);
        pen.beginPath();
        pen.arc(x, y, radius, 0, TURN);
        pen.stroke();
        pen.setLineDash([]);
        const text = place.name + (states[i].on && states[i].phase ? ` ${states[i].phase}°` : "");
        pen.font = `${Math.max(8, Math.min(13, 0.6 * radius))}px sans-serif`;
        pen.textAlign = "center";
        pen.textBaseline = "middle";
        pen.lineWidth = 3;
        pen.strokeStyle = halo;
        pen.strokeText(text, x, y);
        pen.fillStyle = ink;
        pen.fillText(text, x, y);
      });
      const bar = x1 - x0 < 200 ? 10 : 50;
      pen.fillStyle = ink;
      pen.fillRect(10, (y1 - y0) * px.scale - 12, bar * px.scale, 3);
      pen.font = "11px sans-serif";
      pen.textAlign = "left";
      pen.fillText(`${bar} mm`, 10, (y1 - y0) * px.scale - 22);
    }

    function drawScale(pen, left, tall, largest, component) {
      for (let i = 0; i < tall; i++) {
        pen.fillStyle = `rgb(${shade(component ? MOVES : map.scale, 1 - i / tall).map(Math.round).join(",")})`;
        pen.fillRect(left, i, 12, 1.5);
      }
      pen.fillStyle = U.theme.colour("ink");
      pen.font = "11px sans-serif";
      pen.textAlign = "left";
      pen.textBaseline = "middle";
      const marks = component ? [[largest, 0], [largest / 4, 0.25], [0, 0.5], [-largest / 4, 0.75], [-largest, 1]] : ticks(largest).map((value) => [value, -Math.log10(value / largest) / map.decades]);
      for (const [value, place] of marks) pen.fillText(number(value, 2), left + 16, Math.min(Math.max(place * tall, 6), tall - 6));
      pen.fillText(unit, left, tall + 12);
    }

    function ticks(largest) {
      const first = Math.floor(Math.log10(largest)) - map.decades, found = [];
      for (let d = first; d <= first + map.decades + 1; d++) for (const m of [1, 2, 5]) found.push(m * 10 ** d);
      return found.filter((value) => value <= largest && value >= largest * 10 ** -map.decades);
    }

    function tick(now) {
      if (!shown.playing || !canvas.isConnected) return;
      if (last) shown.cycle = (shown.cycle + 360 * (now - last) / (1000 * CYCLE_S)) % 360;
      last = now;
      cycle.value = String(Math.round(shown.cycle));
      paint();
      requestAnimationFrame(tick);
    }

    canvas.addEventListener("click", (event) => {
      const box = canvas.getBoundingClientRect();
      const [x, y] = [x0 + (event.clientX - box.left) / px.scale, y1 - (event.clientY - box.top) / px.scale];
      const hit = map.places.findIndex((place) => Math.hypot(x - place.x, y - place.y) <= map.kinds[place.kind].diameter_mm / 2);
      if (hit < 0) return;
      if (shown.click === "on") states[hit].on = !states[hit].on;
      else states[hit].phase = (states[hit].phase + 45) % 360;
      summed();
    });

    const all = (change) => () => { states.forEach(change); summed(); };
    const choice = (name, entries, chosen, act) => el("fieldset", { className: "choice" }, Object.entries(entries).map(([value, words]) =>
      el("label", {}, el("input", { type: "radio", name, value, checked: value === chosen, onchange: () => act(value) }), words)));
    const typedIn = (name, words, value, act) => {
      const input = el("input", { type: "number", min: "0", step: "any", name, oninput: () => act(Number(input.value)) });
      input.value = value;
      return el("label", {}, words, " ", input);
    };
    const published = map.kinds[0].threshold;
    clear(host,
      el("p", {}, several && el("span", { className: "screen" }, "Click a unit to switch it, or to turn its phase. "), "The orange line is the threshold of touch."),
      el("div", { className: "tools" },
        choice("skin-view", VIEWS, "amplitude", (value) => { shown.view = value; if (value === "amplitude") shown.playing = false; settle(); }),
        el("span", { className: "buttons" }, play, cycle)),
      several && el("div", { className: "tools" },
        choice("skin-click", { on: "A click switches", phase: "A click turns the phase by 45°" }, "on", (value) => { shown.click = value; }),
        el("span", { className: "buttons" },
          el("button", { type: "button", onclick: all((state) => { state.on = true; }) }, "All on"),
          el("button", { type: "button", onclick: all((state) => { state.on = false; }) }, "All off"),
          el("button", { type: "button", onclick: all((state) => { state.phase = 0; }) }, "One phase"))),
      el("div", { className: "tools" },
        typedIn("skin-threshold", "Threshold of touch, µm", published ? String(number(published.um.value, 3)) : "", (value) => { shown.typed = value > 0 ? value : null; settle(); }),
        typedIn("skin-share", "Share for the least pitch, %", String(100 * map.share), (value) => { shown.share = value > 0 ? value / 100 : map.share; settle(); })),
      canvas, figures,
      several && el("details", {}, el("summary", {}, "Units and their phases"), list),
      el("p", { className: "note" }, map.lines[map.lines.length - 1]));
    U.theme.watch(canvas, settle);
    new ResizeObserver(() => paint()).observe(host);
  }

  Object.assign(U, { createSkinMap, skinMap: { motion, lastAbove, createField, amplitude, contour } });
})();
