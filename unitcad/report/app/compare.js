// Two or three pinned variants side by side: section, what was swept and came out, where their specs differ.
(() => {
  "use strict";
  const U = window.unitcad;
  const { el, clear, section, drawing, facts, number } = U;
  const MOST = 3;

  // Values by dotted path; text of files is left out.
  function flat(node, path = "", found = new Map()) {
    if (node !== null && typeof node === "object") {
      for (const [key, value] of Object.entries(node)) flat(value, path ? `${path}.${key}` : key, found);
    } else if (!path.endsWith("_source")) found.set(path, node);
    return found;
  }

  const differing = (cells) => cells.some((cell) => cell !== cells[0]);

  // [path, cells] of what differs between specs, each flat; their names may.
  function differences(specs) {
    const paths = [...new Set(specs.flatMap((spec) => [...spec.keys()]))];
    return paths.filter((path) => path !== "name" && differing(specs.map((spec) => spec.get(path))))
      .map((path) => [path, specs.map((spec) => (spec.has(path) ? facts(spec.get(path)) : "–"))]);
  }

  // A table of variants side by side: their heads, and parts [title, [[name, cells]]].
  function sideBySide(heads, parts) {
    const line = ([name, cells]) => el("tr", {}, el("th", { scope: "row" }, name), cells.map((cell) => el("td", {}, cell)));
    const part = ([title, lines]) => lines.length > 0 && el("tbody", {}, el("tr", {}, el("th", { scope: "rowgroup", colspan: String(heads.length + 1), className: "part" }, title)), lines.map(line));
    return el("div", { className: "scroll compare", tabindex: "0", role: "group", "aria-label": "Variants side by side" },
      el("table", {}, el("thead", {}, el("tr", {}, el("td"), heads.map((head) => el("th", { scope: "col" }, head)))), parts.map(part)));
  }

  // options: {nameOf(row), variant(folder), shown(column, value), head(column)}; `pin(row)` makes a row's box.
  function createPins(table, { nameOf, variant, shown, head }) {
    let pinned = [];
    const boxes = new Map();
    const host = el("div", { "aria-live": "polite" });
    const node = section("compare", "Side by side", host);

    function set(row, on) {
      pinned = on ? [...pinned, row].slice(0, MOST) : pinned.filter((other) => other !== row);
      paint();
    }

    // Who unpins by keys stays where the others are, or goes to the row's box.
    function unpin(row) {
      set(row, false);
      (host.querySelector("button") || boxes.get(row)).focus();
    }

    function paint() {
      for (const [row, box] of boxes) {
        box.checked = pinned.includes(row);
        box.disabled = !box.checked && pinned.length >= MOST;
      }
      if (pinned.length < 2) {
        clear(host, el("p", { className: "absent" }, pinned.length ? "Pin one more variant." : `Pin two or three variants in the table to see them side by side.`));
        return;
      }
      clear(host, comparison());
    }

    function comparison() {
      const rows = pinned;
      const variants = rows.map((row) => variant(row[0]));
      const specs = variants.map((each) => flat((each && each.spec) || {}));
      const heads = rows.map((row) => [row[0] ? el("a", { href: `#${encodeURIComponent(row[0])}` }, nameOf(row)) : nameOf(row), " ",
        el("button", { type: "button", className: "quiet", "aria-label": `Unpin ${nameOf(row)}`, onclick: () => unpin(row) }, "Unpin")]);
      const sections = variants.map((each) => (each && each.drawings["section.svg"] ? drawing(each.drawings["section.svg"], "The unit in section") : "–"));
      const found = variants.map((each) => each && each.estimate && each.estimate.answer);
      const answers = found.map((answer) => (answer && answer.line) || "–");
      const against = found.map((answer, i) => (i && U.compared(answer, found[0])) || "–");
      const columns = table.columns.map((name, i) => [name, rows.map((row) => row[i + 1])]).filter(([name]) => !["index", "status", "reason", "name"].includes(name));
      const figures = columns.filter(([name, cells]) => !table.swept.has(name) && differing(cells)).map(([name, cells]) => [head(name), cells.map((cell, i) => shown(name, cell, rows[i]))]);
      const unlike = differences(specs);
      const own = unlike.length > 0 || specs.some((spec) => spec.size);
      const chosen = own ? unlike
        : columns.filter(([name, cells]) => table.swept.has(name) && differing(cells)).map(([name, cells]) => [name, cells.map((cell) => number(cell, 6))]);
      return sideBySide(heads, [
        ["Section and estimate", [["Section", sections], ["Estimate", answers], ["Level against the first", against]].filter(([, cells]) => cells.some((cell) => cell !== "–"))],
        ["Differences of the specs", chosen], ["Differences of the results", figures]]);
    }

    function pin(row) {
      if (!boxes.has(row)) {
        const box = el("input", { type: "checkbox", name: `pin-${table.rows.indexOf(row)}`, className: "pin", "aria-label": `Pin ${nameOf(row)} to compare`, onchange: () => set(row, box.checked) });
        boxes.set(row, box);
      }
      return boxes.get(row);
    }

    paint();
    return { node, pin };
  }

  Object.assign(window.unitcad, { createPins, sideBySide, differences, flat });
})();
