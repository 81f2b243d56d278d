// Rows of a batch as people read them: named by what was swept, levels in per cent with their range, three digits.
(() => {
  "use strict";
  const { number } = window.unitcad;
  const [LEVEL, LOW, HIGH, MEASURED] = ["edge_level", "edge_low", "edge_high", "edge_measured"];
  const UNIT = /_(mm3|mm|g|hz|um|c|s|kpa)$/;
  const UNITS = { mm3: "mm³", mm: "mm", g: "g", hz: "Hz", um: "µm", c: "°C", s: "s", kpa: "kPa" };

  // A dotted path as a person reads it: "layers.0.wall_mm" is "layer 1 wall" in "mm".
  function spoken(path) {
    const unit = (UNIT.exec(path) || [])[1];
    const words = path.replace(UNIT, "").replace(/^layers\.(\d+)\./, (found, index) => `layer ${Number(index) + 1} `).replace(/^(fpcb|motor|estimate|moulds|casting)\./, "$1 ");
    return { words: words.replace(/[._]/g, " "), unit: unit ? UNITS[unit] : "" };
  }

  // Columns of levels become per cent, the range's ends one column with the level; what was typed is shown whole, what came
  // out to three digits.
  function readable(table) {
    const swept = new Set(table.swept || []);
    const at = (name) => table.columns.indexOf(name) + 1;
    const ends = [LOW, HIGH].map(at);
    const percents = [LEVEL, LOW, HIGH, MEASURED].map(at);
    const whole = table.rows.map((row) => row.map((cell, i) => (i && percents.includes(i) && typeof cell === "number" ? 100 * cell : cell)));
    const columns = table.columns.filter((name) => name !== LOW && name !== HIGH);
    const ranges = new Map();
    const rows = whole.map((row) => {
      const kept = row.filter((cell, i) => !i || !ends.includes(i));
      const range = ends.every((i) => i && typeof row[i] === "number") ? ends.map((i) => row[i]) : null;
      ranges.set(kept, range);
      return kept;
    });
    const range = (column, row) => (column === LEVEL ? ranges.get(row) || null : null);
    const digits = (column) => (swept.has(column) ? 6 : 3);
    const shown = (column, value, row) => {
      const found = row && range(column, row);
      if (found) return [typeof value === "number" && number(value, 2), `(${found.map((end) => number(end, 2)).join(" to ")})`].filter(Boolean).join(" ");
      if (typeof value !== "number") return number(value);
      return number(value, Number.isInteger(value) ? 6 : column === MEASURED ? 2 : digits(column));
    };
    const heads = { [LEVEL]: "level at the edge, % (80 % range)", [MEASURED]: "measured, %" };
    const head = (column) => heads[column] || column;
    return { ...table, columns, rows, digits, shown, range, head, swept };
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

  Object.assign(window.unitcad, { readable, namer, bodiesOf, LEVEL });
})();
