// The page: a variant, or a batch with a table, a plot, and the variant that was opened.
(() => {
  "use strict";
  const U = window.unitcad;
  const { el, clear, section, theme } = U;
  const page = document.getElementById("page");
  let leave = () => {};

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
      instead(`This browser draws no 3D (${error.message}); the section replaces it.`);
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
      guarded("make", "Make it", () => U.make(variant)),
      view.node,
      guarded("section", "Section", () => U.parts.sectionDrawing(variant)),
      guarded("estimate", "Attenuation estimate", () => U.estimate(variant)),
      guarded("checks", "Mould checks and mesh checks", () => U.parts.checks(variant)),
      guarded("procedure", "Procedure", () => U.procedure(variant)),
      guarded("parts", "Parts", () => U.parts.parts(variant)),
      guarded("files", "Files", () => U.parts.files(variant)),
      guarded("spec", "Spec", () => U.parts.spec(variant)),
    ].filter(Boolean);
    if (variant.damaged.length) sections.push(section("damaged", "Damaged", el("ul", {}, variant.damaged.map((line) => el("li", {}, line)))));
    const { state, text } = U.verdict(manifest);
    const layers = ((variant.spec || {}).layers || []).map((layer) => layer.material).join(" / ");
    const line = [manifest.design, layers, manifest.hash].filter(Boolean).join(" · ");
    const chips = [el("span", { className: `chip ${state}` }, text), manifest.label && el("span", { className: "chip", title: "Engraved on the moulds" }, `label ${manifest.label}`)];
    document.title = name;
    clear(page, header(name, line, chips, back), navigation(sections), sections, footer(data));
    leave = () => view.ready.then((made) => made && made.free());
  }

  // Made once: who comes back from a variant finds filters, order and axes as they were left. Returns what shows it.
  function batchPage(data, why, variant) {
    const batch = U.batch(data, why, variant);
    const scrolled = batch.sections[0].querySelector(".scroll");
    let left = { page: 0, across: 0, down: 0, focus: null };
    return () => {
      document.title = data.title;
      clear(page, header(data.title, `unitcad ${data.version}`, batch.chips), navigation(batch.sections), batch.sections, footer(data));
      batch.plot();
      window.scrollTo(0, left.page);
      scrolled.scrollTo(left.across, left.down);
      if (left.focus && left.focus.isConnected) left.focus.focus({ preventScroll: true });
      leave = () => { left = { page: window.scrollY, across: scrolled.scrollLeft, down: scrolled.scrollTop, focus: document.activeElement }; };
    };
  }

  function footer(data) {
    return el("footer", {}, el("p", {}, `Made by unitcad ${data.version}. This page contacts nothing.`),
      el("details", {}, el("summary", {}, "Licences of its parts"), el("pre", {}, document.getElementById("licences").textContent)));
  }

  async function start() {
    const text = document.getElementById("data").textContent;
    const data = JSON.parse(new TextDecoder().decode(await U.unpacked(text)));
    const { variants, resolve, variant, why } = U.records(data);
    const showBatch = data.table && batchPage(data, why, variant);
    const route = () => {
      leave();
      const wanted = U.variantAsked();
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
