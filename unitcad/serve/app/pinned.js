// One variant pinned beside the one that is changed: sections, answers, figures, and where the specs differ.
(() => {
  "use strict";
  const { el, clear, section, drawing, number, sideBySide, differences, flat, compared } = window.unitcad;

  // options: current() gives {name, spec, section, figures, answer, level, text, refused}; restore(text) goes back to a variant;
  // `before` is what was pinned before a reload, and keep() is told of each change.
  function createPinned({ current, restore, before, keep }) {
    let pinned = before;
    const host = el("div", {});
    const pin = el("button", { type: "button", onclick: () => set({ ...current() }) }, "Pin this variant");
    const back = el("button", { type: "button", hidden: true, onclick: () => restore(pinned.text) }, "Go back to it");
    const unpin = el("button", { type: "button", hidden: true, onclick: () => { set(null); pin.focus(); } }, "Unpin");
    const node = section("pinned", "Compare with a pinned variant", el("div", { className: "buttons" }, pin, back, unpin), host);

    function set(one) {
      pinned = one;
      show();
      keep();
    }

    function column(one) {
      return {
        section: one.section ? drawing(one.section, "The unit in section") : "–",
        answer: one.answer || "–",
        figures: new Map((one.figures || []).map(([name, value, unit]) => [name, `${number(value, 4)} ${unit}`])),
        spec: flat(one.spec || {}),
      };
    }

    function show() {
      pin.textContent = pinned ? "Pin this one instead" : "Pin this variant";
      back.hidden = unpin.hidden = !pinned;
      if (!pinned) {
        clear(host, el("p", { className: "absent" }, "Pin this variant, then change it: both are shown here side by side."));
        return;
      }
      const now = current();
      const columns = [pinned, now].map(column);
      const heads = [`Pinned: ${pinned.name}`, now.refused ? "The last valid variant; the current values are refused" : `Now: ${now.name}`];
      const names = [...new Set(columns.flatMap((one) => [...one.figures.keys()]))];
      const unlike = differences(columns.map((one) => one.spec));
      host.dataset.refused = String(now.refused);
      clear(host, sideBySide(heads, [
        ["Section and estimate", [["Section", columns.map((one) => one.section)], ["Estimate", columns.map((one) => one.answer)], ["Level against the pinned", ["–", compared(now.level, pinned.level) || "–"]]]],
        ["Figures", names.map((name) => [name, columns.map((one) => one.figures.get(name) || "–")])],
        ["Differences of the specs", unlike.map(([path, cells]) => [path.split(/(?<=[._])/).flatMap((piece) => [piece, el("wbr")]), cells])],
      ]), !now.refused && !unlike.length && el("p", { className: "note" }, "The specs are the same."));
    }

    show();
    return { node, show, held: () => pinned };
  }

  Object.assign(window.unitcad, { createPinned });
})();
