// Rows of a batch as people read them: named by what was swept, levels in per cent with their error, three digits.
(() => {
  "use strict";
  const { number } = window.unitcad;
  const LEVEL = /^edge_(.+)$/;
  const UNIT = /_(mm3|mm|g|hz|um|c|s|kpa)$/;
  const UNITS = { mm3: "mm³", mm: "mm", g: "g", hz: "Hz", um: "µm", c: "°C", s: "s", kpa: "kPa" };

  const modelOf = (column) => (LEVEL.exec(column) || [])[1];

  // A dotted path as a person reads it: "layers.0.wall_mm" is "layer 1 wall" in "mm".
  function spoken(path) {
    const unit = (UNIT.exec(path) || [])[1];
    const words = path.replace(UNIT, "").replace(/^layers\.(\d+)\./, (found, index) => `layer ${Number(index) + 1} `).replace(/^(fpcb|motor|estimate|moulds|casting)\./, "$1 ");
    return { words: words.replace(/[._]/g, " "), unit: unit ? UNITS[unit] : "" };
  }

  // Columns of levels become per cent; what was typed is shown whole, what came out to three digits.
  function readable(table, estimate) {
    const { typical_error: errors = {} } = estimate || {};
    const swept = new Set(table.swept || []);
    const levels = new Map(table.columns.map((name, i) => [i + 1, modelOf(name)]).filter(([, model]) => model));
    const rows = table.rows.map((row) => row.map((cell, i) => (levels.has(i) && typeof cell === "number" ? 100 * cell : cell)));
    const digits = (column) => (swept.has(column) ? 6 : 3);
    const error = (column) => errors[modelOf(column)];
    const range = (column, value) => (typeof value === "number" && error(column) ? [value / error(column), value * error(column)] : null);
    const shown = (column, value) => {
      if (typeof value !== "number") return number(value);
      const ends = range(column, value);
      if (ends) return `${number(value, 2)} (${ends.map((end) => number(end, 2)).join(" to ")})`;
      return number(value, Number.isInteger(value) ? 6 : digits(column));
    };
    const head = (column) => (modelOf(column) ? `${column}, %` : column);
    return { ...table, rows, digits, shown, range, head, swept };
  }

  // What tells a row from the others: its name, and where names repeat the values that were swept and vary.
  function namer(table, nameColumn, varying) {
    const at = (name) => table.columns.indexOf(name) + 1;
    const own = (row) => String(row[at(nameColumn)] ?? row[0] ?? "–");
    const counts = new Map();
    for (const row of table.rows) counts.set(own(row), (counts.get(own(row)) || 0) + 1);
    const told = varying.filter((name) => table.swept.has(name) && name !== nameColumn);
    const value = (row, name) => {
      const cell = row[at(name)];
      if (cell === null || cell === undefined) return null;
      const { words, unit } = spoken(name);
      if (typeof cell === "number") return [words, number(cell, 6), unit].filter(Boolean).join(" ");
      return name.endsWith("material") || name === "design" ? String(cell) : `${words} ${cell}`;
    };
    return (row) => {
      if (counts.get(own(row)) === 1) return own(row);
      const values = told.map((name) => value(row, name)).filter((text) => text !== null && text !== own(row));
      return values.length ? `${own(row)}: ${values.join(", ")}` : own(row);
    };
  }

  // The bodies of a section drawing without dimensions and words; "" for a drawing without bodies.
  function bodiesOf(svg) {
    const paths = ((svg || "").match(/<path [^>]*>/g) || []).map((path) => path.replace(/\/?>$/, "/>"));
    const points = [...paths.join(" ").matchAll(/(-?\d+(?:\.\d+)?)[ ,](-?\d+(?:\.\d+)?)/g)];
    if (!points.length) return "";
    const ends = [1, 2].map((i) => points.reduce(([low, high], point) => [Math.min(low, Number(point[i])), Math.max(high, Number(point[i]))], [Infinity, -Infinity]));
    const [[left, right], [top, bottom]] = ends;
    const [open] = svg.match(/<svg [^>]*>/) || [""];
    const cropped = open.replace(/ (width|height)="[^"]*"/g, "").replace(/viewBox="[^"]*"/, `viewBox="${left - 4} ${top - 4} ${right - left + 8} ${bottom - top + 8}"`);
    return `${cropped}<g stroke="#111" stroke-width="2">${paths.join("")}</g></svg>`;
  }

  Object.assign(window.unitcad, { readable, namer, modelOf, bodiesOf });
})();
