// Two plots, by uPlot: curves with their spread, and any two columns of a table against each other.
(() => {
  "use strict";
  const { el, number, theme } = window.unitcad;
  const COLOURS = ["series-1", "series-2", "series-3", "series-4", "series-5", "series-6"];
  // More names than this are counted: of points that are absent, of groups in the key.
  const NAMED = 8;
  const KEYED = 40;

  const tick = (value) => (value === null || value === undefined ? "" : number(value, 4));

  function axes(xLabel, yLabel, xValues, yValues) {
    const look = { stroke: theme.colour("ink-2"), grid: { stroke: theme.colour("line"), width: 1 }, ticks: { stroke: theme.colour("line"), width: 1 }, font: "12px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif" };
    const plain = (u, splits) => splits.map(tick);
    return [
      { ...look, label: xLabel, values: xValues || plain, size: 36, labelSize: 20 },
      { ...look, label: yLabel, values: yValues || plain, size: 58, labelSize: 20 },
    ];
  }

  // A plot as wide as its host, made again when the width or the colours change.
  function hosted(height, make) {
    const host = el("div", { className: "plot" });
    let plot = null;
    let width = 0;
    const paint = () => {
      // A plot that is hidden or has left the page has no width; uPlot keeps it, and all round it, until it is destroyed.
      if (plot) plot.destroy();
      plot = width ? make(host, width, height) : null;
    };
    new ResizeObserver(() => {
      const now = Math.floor(host.clientWidth);
      if (now === width) return;
      width = now;
      paint();
    }).observe(host);
    theme.watch(host, paint);
    return { host, paint };
  }

  // curves: [{name, x: [], y: [], low: [], high: [], points: bool, dash: bool}]
  function curvePlot(curves, { xLabel, yLabel, log = false, label }) {
    const tip = el("p", { className: "tip", "aria-live": "polite" }, "Point at the curves to read them.");
    const { host } = hosted(320, (node, width, height) => {
      const tables = [];
      const series = [{ label: xLabel }];
      const bands = [];
      const positive = (values) => (log ? values.map((v) => (v > 0 ? v : null)) : values);
      curves.forEach((curve, i) => {
        const colour = theme.colour(COLOURS[(curve.colour ?? i) % COLOURS.length]);
        const columns = [curve.x, positive(curve.y)];
        series.push({
          label: curve.name, stroke: colour, width: curve.points ? 0 : 2, dash: curve.dash ? [6, 4] : undefined, spanGaps: !curve.points,
          paths: curve.points ? () => null : undefined,
          points: curve.points ? { show: true, size: 11, fill: colour, stroke: theme.colour("paper"), width: 2 } : { show: false },
        });
        if (curve.low && curve.high) {
          const at = series.length;
          columns.push(positive(curve.high), positive(curve.low));
          for (const edge of ["high", "low"]) series.push({ label: `${curve.name}, ${edge}`, stroke: "transparent", width: 0, points: { show: false }, spanGaps: true });
          bands.push({ series: [at, at + 1], fill: `${colour}33` });
        }
        tables.push(columns);
      });
      const options = {
        width, height, series, bands, axes: axes(xLabel, yLabel),
        scales: { x: { time: false }, y: log ? { distr: 3 } : {} }, legend: { show: false }, cursor: { drag: { x: false, y: false } },
        hooks: { setCursor: [(u) => {
          const i = u.cursor.idx;
          if (i === null || i === undefined || u.cursor.left < 0) return;
          const read = u.series.map((each, at) => [each, u.data[at][i]]).filter(([each, v], at) => at > 0 && each.stroke && !/, (high|low)$/.test(each.label) && v !== null && v !== undefined);
          tip.textContent = `${xLabel} ${tick(u.data[0][i])} — ${read.map(([each, v]) => `${each.label} ${tick(v)}`).join("; ")}`;
        }] },
      };
      return new uPlot(options, uPlot.join(tables), node);
    });
    host.setAttribute("role", "img");
    host.setAttribute("aria-label", label);
    return el("div", {}, host, keyOf(curves.map((curve, i) => [curve.name, curve.colour ?? i, curve.dash ? "dash" : "line"])), tip);
  }

  // entries: [name, colour index, "round" | "line" | "dash"]
  function keyOf(entries) {
    return el("ul", { className: "key" }, entries.map(([name, colour, kind]) => {
      const swatch = el("span", { className: `swatch ${kind}`, "aria-hidden": "true" });
      theme.watch(swatch, () => { swatch.style.color = theme.colour(COLOURS[colour % COLOURS.length]); });
      return el("li", {}, swatch, name);
    }));
  }

  // Numbers stay numbers; texts get places 0, 1, ... in their order.
  function scaleOf(values) {
    const known = values.filter((v) => v !== null && v !== undefined);
    if (known.every((v) => typeof v === "number")) return { of: (v) => (typeof v === "number" ? v : null), names: null };
    const names = [...new Set(known.map(String))].sort((a, b) => a.localeCompare(b, undefined, { numeric: true }));
    const place = new Map(names.map((name, i) => [name, i]));
    return { of: (v) => (v === null || v === undefined ? null : place.get(String(v))), names };
  }

  const groupOf = (point) => (point.group === null || point.group === undefined ? "none" : String(point.group));

  const short = (text) => (text.length > 14 ? `${text.slice(0, 13)}…` : text);

  // Which of some points have no value in a column, a line for each reason that is known.
  function lacking(points, column) {
    const reasons = new Map();
    for (const point of points) {
      const why = point.why(column) || "";
      if (!reasons.has(why)) reasons.set(why, []);
      reasons.get(why).push(point);
    }
    return [...reasons].map(([why, mine]) => {
      const counts = new Map();
      for (const point of mine) {
        const name = [point.title, groupOf(point)].filter(Boolean).join(", ");
        counts.set(name, (counts.get(name) || 0) + 1);
      }
      const names = [...counts].map(([name, count]) => (count > 1 ? `${name} (${count} times)` : name));
      const more = names.length > NAMED ? `; ${names.length - NAMED} more names` : "";
      return el("p", { className: "note" }, `${mine.length} ${mine.length === 1 ? "has" : "have"} no ${column}: ${names.slice(0, NAMED).join("; ")}${more}.${why ? ` Why: ${why}.` : ""}`);
    });
  }

  // points: [{x, y, range, group, title, open, why(column)}], `range` the ends of y's bar or null; a click or a tap opens the nearest one.
  function scatterPlot(points, { xLabel, yLabel, columns: [xColumn, yColumn], label }) {
    const xs = scaleOf(points.map((p) => p.x));
    const ys = scaleOf(points.map((p) => p.y));
    const drawn = points.map((p) => ({ ...p, px: xs.of(p.x), py: ys.of(p.y) })).filter((p) => p.px !== null && p.py !== null);
    const notes = [lacking(points.filter((p) => xs.of(p.x) === null), xColumn), xColumn !== yColumn && lacking(points.filter((p) => ys.of(p.y) === null), yColumn)];
    if (!drawn.length) return el("div", {}, el("p", { className: "tip" }, `0 of ${points.length} points.`), notes);
    const groups = [...new Set(points.map(groupOf))].sort();
    const tip = el("p", { className: "tip", "aria-live": "polite" });
    const { host } = hosted(360, (node, width, height) => {
      const tables = groups.map((group) => {
        const mine = drawn.filter((p) => groupOf(p) === group).sort((a, b) => a.px - b.px);
        return [mine.map((p) => p.px), mine.map((p) => p.py), mine.map((p) => p.range)];
      });
      const names = (scale) => scale.names && ((u, splits) => splits.map((v) => (Number.isInteger(v) && scale.names[v] !== undefined ? short(scale.names[v]) : "")));
      const bars = drawn.flatMap((p) => p.range || []);
      const range = (scale) => (u, least, most) => {
        if (scale.names) return [-0.5, scale.names.length - 0.5];
        const [low, high] = scale === ys ? [Math.min(least, ...bars), Math.max(most, ...bars)] : [least, most];
        const pad = (high - low) * 0.06 || Math.abs(high) * 0.1 || 1;
        return [low - pad, high + pad];
      };
      const nearest = (u) => {
        const { left, top } = u.cursor;
        let best = null;
        let least = 24;
        for (const p of drawn) {
          const distance = Math.hypot(u.valToPos(p.px, "x") - left, u.valToPos(p.py, "y") - top);
          if (distance < least) [best, least] = [p, distance];
        }
        return best;
      };
      const dots = (u, index) => {
        const colour = theme.colour(COLOURS[(index - 1) % COLOURS.length]);
        const { ctx } = u;
        // Smaller from group to group: of points that coincide each is seen.
        const radius = Math.max(3, 6 - 1.2 * (index - 1)) * devicePixelRatio;
        ctx.save();
        ctx.fillStyle = colour;
        ctx.strokeStyle = theme.colour("paper");
        ctx.lineWidth = devicePixelRatio;
        u.data[index][2].forEach((ends, i) => {
          if (!ends) return;
          const [x, ...y] = [u.valToPos(u.data[index][0][i], "x", true), ...ends.map((end) => u.valToPos(end, "y", true))];
          ctx.strokeStyle = colour;
          ctx.globalAlpha = 0.5;
          ctx.lineWidth = 2 * devicePixelRatio;
          ctx.beginPath();
          ctx.moveTo(x, y[0]);
          ctx.lineTo(x, y[1]);
          ctx.stroke();
        });
        ctx.globalAlpha = 1;
        ctx.lineWidth = devicePixelRatio;
        ctx.strokeStyle = theme.colour("paper");
        u.data[index][0].forEach((x, i) => {
          ctx.beginPath();
          ctx.arc(u.valToPos(x, "x", true), u.valToPos(u.data[index][1][i], "y", true), radius, 0, 2 * Math.PI);
          ctx.fill();
          ctx.stroke();
        });
        ctx.restore();
        return null;
      };
      const options = {
        width, height, mode: 2, axes: axes(xLabel, yLabel, names(xs), names(ys)),
        scales: { x: { time: false, range: range(xs) }, y: { range: range(ys) } },
        series: [{}, ...groups.map((group, i) => ({ label: group, stroke: theme.colour(COLOURS[i % COLOURS.length]), paths: dots }))],
        legend: { show: false }, cursor: { drag: { x: false, y: false }, points: { show: false } },
        hooks: {
          setCursor: [(u) => {
            const p = u.cursor.left >= 0 ? nearest(u) : null;
            u.over.classList.toggle("hit", Boolean(p));
            if (p) tip.textContent = `${p.title}: ${xLabel} ${tick(p.x)}, ${yLabel} ${p.range ? `${number(p.y, 2)} (${p.range.map((end) => number(end, 2)).join(" to ")})` : tick(p.y)}`;
          }],
          ready: [(u) => u.over.addEventListener("click", () => { const p = nearest(u); if (p && p.open) p.open(); })],
        },
      };
      return new uPlot(options, [null, ...tables], node);
    });
    host.setAttribute("role", "img");
    host.setAttribute("aria-label", label);
    const seen = new Set(drawn.map(groupOf));
    const key = groups.length > 1 && keyOf(groups.slice(0, KEYED).map((group, i) => [seen.has(group) ? group : `${group} (no point)`, i, "round"]));
    if (groups.length > KEYED) key.append(el("li", {}, `and ${groups.length - KEYED} more`));
    tip.textContent = `${drawn.length} of ${points.length} points. Point at one to read it, click to open it.`;
    return el("div", {}, host, key, tip, notes);
  }

  Object.assign(window.unitcad, { curvePlot, scatterPlot });
})();
