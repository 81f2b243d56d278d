// The page: a variant, or a batch with a table, a plot, and the variant that was opened.
(() => {
  "use strict";
  const U = window.unitcad;
  const { el, clear, number, section, theme } = U;
  const page = document.getElementById("page");
  let leave = () => {};

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

  function header(title, line, chips, back) {
    return el("header", { className: "top" },
      el("div", {}, back, el("h1", { tabindex: "-1" }, title), el("p", { className: "line" }, line)),
      el("div", { className: "chips" }, chips, theme.button()));
  }

  function navigation(sections) {
    const jump = (node) => (event) => {
      event.preventDefault();
      node.scrollIntoView();
      node.querySelector("h2").setAttribute("tabindex", "-1");
      node.querySelector("h2").focus({ preventScroll: true });
    };
    return el("nav", { "aria-label": "On this page" }, sections.map((node) => el("a", { href: `#${node.id}`, onclick: jump(node) }, node.querySelector("h2").textContent)));
  }

  function stage(variant, model) {
    const host = el("div", { className: "stage-host" });
    const node = section("view", "3D", host);
    const instead = (reason) => clear(host, el("p", { className: "absent" }, reason), variant.drawings["section.svg"] && U.drawing(variant.drawings["section.svg"], "The unit in section"));
    if (!model) {
      instead(variant.no_model || "No geometry here.");
      return { node, ready: Promise.resolve(null) };
    }
    const ready = new Promise((done) => requestAnimationFrame(done)).then(() => U.createStage(host, model)).catch((error) => {
      instead(`This browser draws no 3D (${error.message}); the section stands in.`);
      return null;
    });
    return { node, ready };
  }

  // An error in a damaged result stays in its own section.
  function guarded(id, title, make) {
    try {
      return make();
    } catch (error) {
      return section(id, title, el("p", { className: "absent" }, `The result is damaged here: ${error.message}`));
    }
  }

  function showVariant(variant, data, back) {
    const { manifest } = variant;
    const name = manifest.name || variant.folder || data.title;
    const view = stage(variant, variant.model && data.models[variant.model]);
    const sections = [
      view.node,
      guarded("section", "Section", () => U.parts.sectionDrawing(variant)),
      guarded("estimate", "Attenuation estimate", () => U.estimate(variant)),
      guarded("checks", "Mould checks and mesh checks", () => U.parts.checks(variant)),
      guarded("procedure", "Procedure", () => U.procedure(variant)),
      guarded("parts", "Parts", () => U.parts.parts(variant)),
      guarded("files", "Files", () => U.parts.files(variant)),
      guarded("spec", "Spec", () => U.parts.spec(variant)),
    ];
    if (variant.damaged.length) sections.push(section("damaged", "Damaged", el("ul", {}, variant.damaged.map((line) => el("li", {}, line)))));
    const { state, text } = U.verdict(manifest);
    const layers = ((variant.spec || {}).layers || []).map((layer) => layer.material).join(" / ");
    const line = [manifest.design, layers, manifest.hash].filter(Boolean).join(" · ");
    const chips = [el("span", { className: `chip ${state}` }, text), manifest.label && el("span", { className: "chip", title: "Engraved on the moulds" }, `label ${manifest.label}`)];
    document.title = name;
    clear(page, header(name, line, chips, back), navigation(sections), sections, footer(data));
    leave = () => view.ready.then((made) => made && made.free());
  }

  // A variant's section, small; a picture that says nothing to who can't see it, since its row says all.
  const thumbnail = (variant) => {
    const svg = variant && variant.drawings && U.bodiesOf(variant.drawings["section.svg"]);
    return svg && el("img", { className: "thumbnail", src: `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`, alt: "", loading: "lazy" });
  };

  // Made once: who comes back from a variant finds filters, order and axes as they were left. Returns what shows it.
  function batchPage(data, why, variant) {
    const { batch } = data;
    const table = U.readable(data.table, data.estimate);
    const nameColumn = table.columns.includes("name") ? "name" : table.columns[0];
    const varying = U.varyingIn(table);
    const named = U.namer(table, nameColumn, varying);
    const plotHost = el("div");
    const selects = {};
    let rows = [];
    const at = (name) => table.columns.indexOf(name) + 1;
    // A model's level is plotted against what it reads: a level that stays the same is no result of the sweep.
    const { not_read: unread = {}, typical_error: errors = {}, not_measured: alone = {} } = data.estimate || {};
    const blind = (x, y) => {
      const keys = unread[U.modelOf(y)] || [];
      const reads = [...table.swept].some((name) => varying.includes(name) && !keys.includes(name));
      return keys.includes(x) || (keys.length > 0 && !reads);
    };
    const notRead = el("p", { className: "unread", role: "status" });
    const plot = () => {
      const x = selects.x.value;
      const left = [...selects.y.options].filter((option) => (option.disabled = blind(x, option.value)));
      if (selects.y.selectedOptions[0].disabled) selects.y.value = best(x);
      const [y, group] = ["y", "group"].map((key) => selects[key].value);
      notRead.textContent = left.length ? `Not offered: ${left.map((option) => option.value).join(", ")}, whose model does not read ${x}.` : "";
      const points = rows.map((row) => ({ x: row[at(x)], y: row[at(y)], range: table.range(y, row[at(y)]), group: group ? row[at(group)] : "", title: named(row), why: (column) => why(row[0], column) || row[at("reason")], open: row[0] && (() => { location.hash = encodeURIComponent(row[0]); }) }));
      clear(plotHost, U.scatterPlot(points, { xLabel: table.head(x), yLabel: table.head(y), columns: [x, y], label: `${y} against ${x}, ${points.length} variants` }),
        points.some((point) => point.range) && el("p", { className: "note" }, `Bars: the level over and times ${number(errors[U.modelOf(y)], 3)}, the model's typical error with a measured unit left out, not an estimate's 80 % range.`),
        U.modelOf(y) && x in alone && el("p", { className: "note unmeasured" }, `Every measured unit had ${number(alone[x])} mm for ${x}: no measurement supports how the level changes with it, and the error there is not known.`));
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
    // The level of the best model that reads what goes across; else a volume, else anything.
    const levels = Object.keys(errors).map((model) => `edge_${model}`);
    const best = (x) => [...levels, ...numeric].find((name) => numeric.includes(name) && U.modelOf(name) && filled(name) * 2 > table.rows.length && !blind(x, name))
      || preferred(numeric.filter((name) => !blind(x, name)), /volume|mm3/) || numeric.find((name) => name !== x && !blind(x, name)) || names[names.length - 1];
    const across = preferred(numeric, /wall|thick|diameter/) || numeric[0] || names[0];
    const controls = el("div", { className: "tools" },
      choice("x", "Across", names, across),
      choice("y", "Up", names, best(across)),
      choice("group", "Colour", ["", ...texts], preferred(texts, /design|material/) || ""));
    const geometries = Object.keys(data.models).length;
    // A batch of estimates alone has no folders.
    const failed = table.rows.filter((row) => !row[0] && !(table.columns.includes("status") && row[at("status")] === "ok")).length;
    const chips = [geometries > 0 && el("span", { className: "chip" }, `${geometries} ${geometries === 1 ? "geometry" : "geometries"}`), failed > 0 && el("span", { className: "chip bad" }, `${failed} failed`)];
    const sections = [section("variants", "Variants", made.node), pins.node, section("plot", "Two columns against each other", controls, notRead, plotHost)];
    if (data.damaged.length) sections.push(section("damaged", "Damaged", U.table(["Result", "Why"], data.damaged, { label: "Damaged results" })));
    if (batch) sections.push(section("batch", "The batch", el("details", {}, el("summary", {}, "Properties of the batch"), U.facts(batch))));
    ready = true;
    const scrolled = made.node.querySelector(".scroll");
    let left = { page: 0, across: 0, down: 0, focus: null };
    return () => {
      document.title = data.title;
      clear(page, header(data.title, `unitcad ${data.version}`, chips), navigation(sections), sections, footer(data));
      plot();
      window.scrollTo(0, left.page);
      scrolled.scrollTo(left.across, left.down);
      if (left.focus && left.focus.isConnected) left.focus.focus({ preventScroll: true });
      leave = () => { left = { page: window.scrollY, across: scrolled.scrollLeft, down: scrolled.scrollTop, focus: document.activeElement }; };
    };
  }

  function footer(data) {
    return el("footer", {}, el("p", {}, `Made by unitcad ${data.version}. This page contacts nothing.`),
      el("details", {}, el("summary", {}, "Licences of what is in it"), el("pre", {}, document.getElementById("licences").textContent)));
  }

  // The folder in the address, "" where there is none or no sense in it.
  function variantAsked() {
    try {
      return decodeURIComponent(location.hash.slice(1));
    } catch {
      return "";
    }
  }

  async function start() {
    const text = document.getElementById("data").textContent;
    const data = JSON.parse(new TextDecoder().decode(await U.unpacked(text)));
    const resolve = resolver(data.pool);
    const variants = new Map(data.variants);
    // Why a variant has no level by some model.
    const why = (folder, column) => {
      const model = column.startsWith("edge_") && variants.has(folder) && column.slice("edge_".length);
      const { models } = (model && resolve(variants.get(folder)).estimate) || {};
      return models && models[model] && models[model].edge_level && models[model].edge_level.reason;
    };
    const variant = (folder) => (variants.has(folder) ? resolve(variants.get(folder)) : null);
    const showBatch = data.table && batchPage(data, why, variant);
    const route = () => {
      leave();
      const wanted = variantAsked();
      window.scrollTo(0, 0);
      if (!data.table) showVariant(resolve(data.variants[0][1]), data);
      else if (variants.has(wanted) && wanted) showVariant(resolve(variants.get(wanted)), data, el("a", { className: "back", href: "#" }, "‹ All variants"));
      else showBatch();
    };
    if (data.table) {
      history.scrollRestoration = "manual";
      window.addEventListener("hashchange", route);
    }
    route();
    document.documentElement.dataset.ready = "yes";
  }

  start().catch((error) => clear(page, el("p", { className: "absent" }, `The page can't be drawn: ${error.message}`)));
})();
