// Rows of a batch as people read them: named by what was swept, levels in per cent with their range, three digits.
(() => {
  "use strict";
  const { el, number, rule, theme } = window.unitcad;
  const [LEVEL, LOW, HIGH, MEASURED] = ["edge_level", "edge_low", "edge_high", "edge_measured"];
  const LONGEST = 28;
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
    // Two digits, as the command prints them: 4.0, 15.
    const two = (value) => (value > 0.0995 && value < 9.95 ? value.toPrecision(2) : number(value, 2));
    const shown = (column, value, row) => {
      const found = row && range(column, row);
      if (found) return [typeof value === "number" && two(value), `(${found.map(two).join(" to ")})`].filter(Boolean).join(" ");
      if (typeof value !== "number") return number(value);
      return column === MEASURED ? two(value) : number(value, Number.isInteger(value) ? 6 : digits(column));
    };
    const levels = percents.filter(Boolean).flatMap((i) => whole.map((row) => row[i])).filter((value) => typeof value === "number" && value > 0);
    const axis = levels.length ? rule(levels) : null;
    const measuredAt = columns.indexOf(MEASURED) + 1;
    // A row's level, range and measurement on the axis of all rows; null for a cell without.
    const picture = (column, row) => {
      if (column !== LEVEL || !axis) return null;
      const placed = (className, value, end) => {
        const node = el("span", { className });
        node.style.left = `${axis.at(value)}%`;
        if (end !== undefined) node.style.width = `${Math.max(0.6, axis.at(end) - axis.at(value))}%`;
        if (className !== "measured") theme.watch(node, () => { node.style.background = theme.colour(className === "grid" ? "line" : "series-1"); });
        return node;
      };
      const [value, ends, measured] = [row[columns.indexOf(LEVEL) + 1], ranges.get(row), measuredAt ? row[measuredAt] : null];
      return el("div", { className: "track", "aria-hidden": "true" }, axis.ticks.map((tick) => placed("grid", tick)),
        ends && placed("bar", ...ends), typeof value === "number" && value > 0 && placed("dot", value), typeof measured === "number" && measured > 0 && placed("measured", measured));
    };
    const legend = axis && `Dot: level. Bar: 80 % range. Diamond: measured. Lines: ${axis.ticks.map((tick) => number(tick)).join(", ")} %, logarithmic.`;
    const heads = { [LEVEL]: "level at the edge, % (80 % range)", [MEASURED]: "measured, %" };
    const head = (column) => heads[column] || column;
    return { ...table, columns, rows, digits, shown, range, head, swept, picture, legend };
  }

  // Text that tells a row from the others: its own name, or its swept values if names repeat or list them.
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
      // A long name made of the swept values says them less well than the values themselves.
      const made = told.some((name) => row[at(name)] !== null && own(row).includes(String(row[at(name)])));
      if (counts.get(own(row)) === 1 && !(made && own(row).length > LONGEST)) return own(row);
      const values = told.map((name) => value(row, name)).filter((text) => text !== null);
      return values.length ? values.join(", ") : own(row);
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
