// The casting procedure: numbered steps, a drawing and the figures of each pour, ready to print.
(() => {
  "use strict";
  const { el, duration, number, section, table, framed, partName } = window.unitcad;
  // The figures that are needed first, at the scale.
  const FIRST = [/^part A$/, /^part B$/, /^pot life/, /^cure/, /^rise of/];

  // Three digits: what a scale, a caliper or a clock on the bench shows.
  const shown = (value) => (typeof value === "number" ? number(value, 3) : value);
  const quantity = (figure) => `${number(figure.value, 3)} ${figure.unit || ""}`.trim();

  function figures(list, summary) {
    if (!list || !list.length) return null;
    const rows = list.map((figure) => [figure.name, quantity(figure), figure.source]);
    const sources = table(["Figure", "Value", "Source"], rows, { label: summary });
    return el("details", {}, el("summary", {}, summary), sources);
  }

  function cards(list) {
    const chosen = FIRST.map((pattern) => (list || []).find((figure) => pattern.test(figure.name))).filter(Boolean);
    return el("dl", { className: "cards" }, chosen.map((figure) => el("div", {}, el("dt", {}, figure.name), el("dd", {}, quantity(figure)))));
  }

  function times(data) {
    if (!data.time_line) return null;
    const rows = data.time_line.map((phase) => [phase.name, duration(phase.start_min), duration(phase.bench_min), duration(phase.wait_min)]);
    return [el("p", {}, el("strong", {}, duration(data.earliest_finish_min)), ` from the printed pieces to the ${data.makes || "unit"} out of the mould, of which ${duration(data.bench_min)} at the bench.`),
      table(["Item", "Begins after", "At the bench", "Then wait"], rows, { label: "Time line" })];
  }

  // What was weighed, timed and measured when this unit was cast; another spec's record is named as such.
  function casts(variant) {
    if (!variant.casts || !variant.casts.length) return null;
    const list = (values) => (values.length ? values.map((value) => number(value, 3)).join(", ") : "–");
    const cell = (value) => (value === null ? "–" : number(value, 3));
    return el("div", { id: "casts" }, el("h3", {}, "Cast"), variant.casts.map((cast) => [
      el("h4", {}, `${cast.cast_on} (${cast.file})`),
      cast.spec_hash !== variant.manifest.hash && el("p", { className: "verdict bad" }, `Cast from another spec: ${cast.spec_name}, ${cast.spec_hash}.`),
      cast.pours.length > 0 && table(["Pour", "Part A (g)", "Part B (g)", "Pot life used (min)", "Cure (h)", "Lot", "Notes"],
        cast.pours.map((pour) => [String(pour.index), cell(pour.part_a_g), cell(pour.part_b_g), cell(pour.pot_life_min), cell(pour.cure_h), pour.lot || "–", pour.notes.join(" ")]), { label: `Pours cast on ${cast.cast_on}` }),
      cast.units.length > 0 && table(["Unit", "Height (mm)", "Diameters (mm)", "Mass (g)", "Walls, layer by layer (mm)", "Notes"],
        cast.units.map((unit) => [`${unit.cavity.toString(16).toUpperCase()}${unit.usable ? "" : ", spoiled"}`, cell(unit.height_mm), list(unit.diameters_mm), cell(unit.mass_g), unit.walls.map((wall) => `${wall.layer}: ${list(wall.places_mm)}`).join("; ") || "–", unit.notes.join(" ")]), { label: `Units cast on ${cast.cast_on}` }),
      cast.notes.map((note) => el("p", {}, note))]));
  }

  // What a maker does with this result, in four lines.
  function make(variant) {
    const data = variant.casting, { warnings } = variant.manifest;
    if (!data) return null;
    const { plates, minutes, cm3, of, sizes } = data.printing;
    const grams = new Map();
    for (const item of data.bill.filter((each) => each.unit === "g")) {
      const name = item.item.replace(/ part [AB]$/, "");
      grams.set(name, (grams.get(name) || 0) + item.quantity);
    }
    const link = (path) => el("a", { href: besides(variant.folder, path) }, path);
    const takes = `about ${duration(minutes)}, at most ${number(cm3, 2)} cm³`;
    const assumed = sizes.filter((size) => size.assumed).map((size) => `${size.what} ${number(size.value_mm, 3)} mm (${size.assumed})`);
    return section("make", "Make it",
      (warnings || []).map((text) => el("p", { className: "verdict bad" }, `Warning: ${text}.`)),
      el("ol", {}, assumed.length > 0 && el("li", {}, `Measure first. Assumed: ${assumed.join("; ")}.`),
        el("li", {}, "Print ", plates.map((path, i) => [i ? ", " : "", link(path)]), `: ${takes} of ${of}.`),
        el("li", {}, `Mix ${[...grams].map(([name, mass]) => `${number(mass, 3)} g of ${name}`).join(", ")}.`),
        el("li", {}, "Cast by ", link("bench.html"), `: out of the mould ${duration(data.earliest_finish_min)} after the print, of which ${duration(data.bench_min)} at the bench.`)));
  }

  const besides = (folder, name) => [folder, name].filter(Boolean).join("/").split("/").map(encodeURIComponent).join("/");

  function procedure(variant) {
    const data = variant.casting;
    if (!data) return section("procedure", "Procedure", el("p", { className: "absent" }, "No procedure here. Make it with ", el("code", {}, "unitcad build SPEC --only casting")));
    let next = 1;
    const steps = (list) => {
      if (!list || !list.length) return null;
      const node = el("ol", { start: String(next) }, list.map((step) => {
        const picture = (variant.pictures || {})[step.picture];
        return el("li", {}, el("strong", {}, `${step.title}. `), step.short || step.text, picture && el("img", { className: "state", src: picture, alt: step.title, width: "540" }));
      }));
      next += list.length;
      return node;
    };
    const titled = (title, ...content) => content.some(Boolean) && [el("h3", {}, title), content];
    const pour = (each) => {
      const svg = variant.drawings[each.drawing];
      return el("div", { className: "pour" }, el("h3", {}, `Pour ${each.index}: ${partName(each.layer)}, ${each.material}`),
        svg && el("figure", {}, framed(svg, `Pour ${each.index} in section`, `Drawing of pour ${each.index}`)),
        cards(each.figures), steps(each.steps),
        figures(each.figures, `All figures of pour ${each.index}, with their sources`));
    };
    const print = el("button", { type: "button", className: "main", onclick: () => window.print() }, "Print the procedure");
    return section("procedure", "Procedure",
      el("div", { className: "tools" }, print, el("span", {}, `${data.label ? `mould set ${data.label}, ` : ""}${data.cells} ${data.cells === 1 ? "cavity" : "cavities"}`)),
      casts(variant),
      el("p", {}, "At the bench: ", el("a", { href: besides(variant.folder, "bench.html") }, "bench.html"), ", with timers, and fields for the cast record."),
      times(data),
      titled("Print", data.printing && el("ul", {}, data.printing.how.map((text) => el("li", {}, text)))),
      titled("Before the first pour", steps(data.preparation)),
      (data.pours || []).map(pour),
      titled("Out of the mould", steps(data.release)),
      titled(data.last, steps(data.assembly)),
      titled("Measure on the first part", data.measure && el("ul", {}, data.measure.map((text) => el("li", {}, text)))),
      titled("Needed", data.bill && table(["Item", "Quantity", "Made", "Note"], data.bill.map((row) => [partName(row.item), `${number(row.quantity, 3)} ${row.unit}`, row.made, row.note]), { label: "Bill of materials" })));
  }

  // A closed fold prints closed: the procedure's are opened for the printer, then put back.
  let opened = [];
  window.addEventListener("beforeprint", () => {
    opened = [...document.querySelectorAll("#procedure details:not([open])")];
    for (const fold of opened) fold.open = true;
  });
  window.addEventListener("afterprint", () => {
    for (const fold of opened) fold.open = false;
  });

  Object.assign(window.unitcad, { make, procedure });
})();
