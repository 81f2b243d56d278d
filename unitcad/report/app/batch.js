// A batch: its table with pins, two columns against each other, what is damaged, its properties.
(() => {
  "use strict";
  const U = window.unitcad;
  const { el, clear, number, section } = U;

  // References into the pool, undone. No data of unitcad has this key.
  function resolver(pool) {
    const known = new Map();
    const resolve = (node) => {
      if (Array.isArray(node)) return node.map(resolve);
      if (!node || typeof node !== "object") return node;
      if ("\0" in node) {
        const index = node["\0"];
        if (!known.has(index)) known.set(index, resolve(pool[index]));
        return known.get(index);
      }
      return Object.fromEntries(Object.entries(node).map(([key, value]) => [key, resolve(value)]));
    };
    return resolve;
  }

  // The folder in the address, "" where there is none or no sense in it.
  function variantAsked() {
    try {
      return decodeURIComponent(location.hash.slice(1));
    } catch {
      return "";
    }
  }

  // The variants of a page's data by folder; why(folder) says why a variant has no level.
  function records(data) {
    const resolve = resolver(data.pool);
    const variants = new Map(data.variants);
    const why = (folder) => {
      const { answer } = (variants.has(folder) && resolve(variants.get(folder)).estimate) || {};
      return answer && answer.reason;
    };
    return { variants, resolve, why, variant: (folder) => (variants.has(folder) ? resolve(variants.get(folder)) : null) };
  }

  // A variant's section, small; a picture that says nothing to who can't see it, since its row says all.
  const thumbnail = (variant) => {
    const svg = variant && variant.drawings && U.bodiesOf(variant.drawings["section.svg"]);
    return svg && el("img", { className: "thumbnail", src: `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`, alt: "", loading: "lazy" });
  };

  // {sections, chips, plot}: `plot` draws once the sections are on a page. why(folder) says why a level is missing,
  // variant(folder) gives a record.
  function batchOf(data, why, variant) {
    const { batch } = data;
    const table = U.readable(data.table);
    const nameColumn = table.columns.includes("name") ? "name" : table.columns[0];
    const varying = U.varyingIn(table);
    const named = U.namer(table, nameColumn, varying);
    const plotHost = el("div");
    const selects = {};
    let rows = [];
    const at = (name) => table.columns.indexOf(name) + 1;
    // The level is plotted against what it reads: a level that stays the same is no result of the sweep.
    const { unread = [], not_measured: alone = {} } = data.estimate || {};
    const reads = [...table.swept].some((name) => varying.includes(name) && !unread.includes(name));
    const blind = (x, y) => y === U.LEVEL && (unread.includes(x) || (unread.length > 0 && !reads));
    const notRead = el("p", { className: "unread", role: "status" });
    const plot = () => {
      const x = selects.x.value;
      const left = [...selects.y.options].filter((option) => (option.disabled = blind(x, option.value)));
      if (selects.y.selectedOptions[0].disabled) selects.y.value = best(x);
      const [y, group] = ["y", "group"].map((key) => selects[key].value);
      notRead.textContent = left.length ? `The level does not read ${x}: at most its range changes.` : "";
      const points = rows.map((row) => ({ x: row[at(x)], y: row[at(y)], range: table.range(y, row), group: group ? row[at(group)] : "", title: named(row), why: (column) => (column === U.LEVEL && why(row[0])) || row[at("reason")], open: row[0] && (() => { location.hash = encodeURIComponent(row[0]); }) }));
      clear(plotHost, U.scatterPlot(points, { xLabel: table.head(x), yLabel: table.head(y), columns: [x, y], label: `${y} against ${x}, ${points.length} variants` }),
        points.some((point) => point.range) && el("p", { className: "note" }, "Bars: the 80 % range."),
        y === U.LEVEL && x in alone && el("p", { className: "note unmeasured" }, `Every measured unit had ${number(alone[x])} mm for ${x}: no measurement shows how the level changes with it.`));
    };
    let ready = false;
    const pins = U.createPins(table, { nameOf: named, variant, shown: table.shown, head: table.head });
    const lead = (row) => [pins.pin(row), thumbnail(row[0] && variant(row[0]))];
    const made = U.createTable(table, { nameColumn, named, lead, changed: (shown) => { rows = shown; if (ready) plot(); } });
    const filled = (name) => table.rows.filter((row) => typeof row[at(name)] === "number").length;
    const numeric = varying.filter((name) => filled(name) > 0).sort((a, b) => filled(b) - filled(a));
    const choice = (key, label, names, value) => {
      selects[key] = el("select", { name: `plot-${key}`, onchange: plot }, names.map((name) => el("option", { value: name, selected: name === value }, name || "nothing")));
      return el("label", {}, `${label} `, selects[key]);
    };
    const names = varying.length ? varying : table.columns;
    const texts = varying.filter((name) => !numeric.includes(name) && name !== nameColumn);
    const preferred = (list, pattern) => list.find((name) => pattern.test(name) && (list === texts || filled(name) * 2 > table.rows.length));
    // The level, if it reads what goes across; otherwise a volume, or anything.
    const best = (x) => [U.LEVEL].find((name) => numeric.includes(name) && filled(name) * 2 > table.rows.length && !blind(x, name))
      || preferred(numeric.filter((name) => !blind(x, name)), /volume|mm3/) || numeric.find((name) => name !== x && !blind(x, name)) || names[names.length - 1];
    // Across goes a swept key that the level reads, or any swept one.
    const chosen = varying.filter((name) => table.swept.has(name) && name !== nameColumn);
    const across = chosen.find((name) => !unread.includes(name)) || preferred(numeric, /wall|thick|diameter/) || numeric[0] || names[0];
    const controls = el("div", { className: "tools" },
      choice("x", "Across", names, across),
      choice("y", "Up", names, best(across)),
      choice("group", "Colour", ["", ...texts], preferred(texts.filter((name) => name !== across), /design|material/) || ""));
    const geometries = Object.keys(data.models).length;
    // A batch of estimates alone has no folders.
    const failed = table.rows.filter((row) => !row[0] && !(table.columns.includes("status") && row[at("status")] === "ok")).length;
    const chips = [geometries > 0 && el("span", { className: "chip" }, `${geometries} ${geometries === 1 ? "geometry" : "geometries"}`), failed > 0 && el("span", { className: "chip bad" }, `${failed} failed`)];
    const sections = [section("variants", "Variants", made.node), pins.node, section("plot", "Two columns against each other", controls, notRead, plotHost)];
    if (data.damaged.length) sections.push(section("damaged", "Damaged", U.table(["Result", "Why"], data.damaged, { label: "Damaged results" })));
    if (batch) sections.push(section("batch", "The batch", el("details", {}, el("summary", {}, "Properties of the batch"), U.facts(batch))));
    ready = true;
    return { sections, chips, plot };
  }

  Object.assign(window.unitcad, { batch: batchOf, records, variantAsked });
})();
