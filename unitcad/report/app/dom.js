// Elements from data. Text is set as text, never as markup: a name in a spec may hold anything.
window.unitcad = {};
(() => {
  "use strict";

  function el(tag, props, ...children) {
    const node = document.createElement(tag);
    for (const [key, value] of Object.entries(props || {})) {
      if (value === undefined || value === null || value === false) continue;
      if (key.startsWith("on")) node.addEventListener(key.slice(2), value);
      else if (key in node && !["list", "form", "width", "height"].includes(key) && typeof value !== "string") node[key] = value;
      else node.setAttribute(key === "className" ? "class" : key, value === true ? "" : value);
    }
    fill(node, children);
    return node;
  }

  function fill(node, children) {
    for (const child of children.flat(Infinity)) {
      if (child === undefined || child === null || child === false) continue;
      node.append(child instanceof Node ? child : document.createTextNode(String(child)));
    }
  }

  function clear(node, ...children) {
    node.replaceChildren();
    fill(node, children);
    return node;
  }

  // At most `digits` significant digits, no zeros at the end.
  function number(value, digits = 4) {
    if (typeof value !== "number" || !Number.isFinite(value)) return value === null || value === undefined ? "–" : String(value);
    if (value === 0) return "0";
    const size = Math.abs(value);
    if (size >= 1e6 || size < 1e-4) return value.toExponential(Math.max(0, digits - 2)).replace(/\.?0+e/, "e");
    return String(Number(value.toPrecision(digits)));
  }

  // 20 h 40 min; beyond two days 3 days 20 h.
  function duration(minutes) {
    const all = Math.round(Math.abs(minutes));
    const [hours, rest] = [Math.floor(all / 60), all % 60];
    if (all > 48 * 60) {
      const whole = Math.round(all / 60);
      return whole % 24 ? `${Math.floor(whole / 24)} days ${whole % 24} h` : `${whole / 24} days`;
    }
    return hours && rest ? `${hours} h ${rest} min` : hours ? `${hours} h` : `${rest} min`;
  }

  function bytes(count) {
    return count < 1e3 ? `${count} B` : count < 1e6 ? `${number(count / 1e3, 3)} kB` : `${number(count / 1e6, 3)} MB`;
  }

  // snake_case with a unit at its end, as a person reads it.
  function spoken(key) {
    const units = { mm: "mm", mm2: "mm²", mm3: "mm³", hz: "Hz", um: "µm", g: "g", c: "°C", s: "s", h: "h", min: "min", pa: "Pa", kpa: "kPa", db: "dB" };
    const words = String(key).split("_");
    const unit = words.length > 1 ? units[words[words.length - 1]] : undefined;
    const text = (unit ? words.slice(0, -1) : words).join(" ");
    return unit ? `${text} (${unit})` : text;
  }

  function section(id, title, ...children) {
    return el("section", { id, "aria-labelledby": `${id}-title` }, el("h2", { id: `${id}-title` }, title), children);
  }

  function table(head, rows, options = {}) {
    const numeric = head.map((name, i) => rows.some((row) => typeof (row.cells || row)[i] === "number") ? "number" : undefined);
    const body = rows.map((row) =>
      el("tr", { className: row.className }, (row.cells || row).map((cell, i) =>
        el("td", { className: numeric[i] }, typeof cell === "number" ? number(cell) : cell))));
    const caption = options.caption && el("caption", {}, options.caption);
    const names = el("tr", {}, head.map((name, i) => el("th", { scope: "col", className: numeric[i] }, name)));
    return el("div", { className: "scroll", tabindex: "0", role: "group", "aria-label": options.label || options.caption || "table" },
      el("table", {}, caption, el("thead", {}, names), el("tbody", {}, body)));
  }

  // Anything that JSON can hold, for parts of a result that this page has no better picture for.
  function facts(data) {
    if (data === null || data === undefined) return "–";
    if (typeof data === "boolean") return data ? "yes" : "no";
    if (typeof data !== "object") return number(data);
    if (Array.isArray(data)) {
      if (data.every((item) => typeof item !== "object" || item === null)) {
        return data.every((item) => typeof item === "number") || data.length < 3 ? data.map((item) => number(item)).join(", ")
          : el("ul", {}, data.map((item) => el("li", {}, number(item))));
      }
      const rows = data.every((item) => item && typeof item === "object" && !Array.isArray(item));
      if (!rows) return el("ul", {}, data.map((item) => el("li", {}, facts(item))));
      const names = [...new Set(data.flatMap((item) => Object.keys(item)))];
      return table(names.map(spoken), data.map((item) => names.map((name) => typeof item[name] === "number" ? item[name] : facts(item[name]))));
    }
    return el("dl", { className: "facts" }, Object.entries(data).map(([key, value]) =>
      el("div", {}, el("dt", {}, spoken(key)), el("dd", {}, facts(value)))));
  }

  const dark = matchMedia("screen and (prefers-color-scheme: dark)");
  const printed = matchMedia("print");
  const watchers = new Set();

  const theme = {
    get dark() {
      if (printed.matches) return false;
      const forced = document.documentElement.dataset.theme;
      return forced ? forced === "dark" : dark.matches;
    },
    // Calls `paint` now and whenever the colours change, until `node` has left the page.
    watch(node, paint) {
      paint();
      for (const watcher of watchers) {
        if (watcher.node.isConnected) watcher.shown = true;
        else if (watcher.shown) watchers.delete(watcher);
      }
      watchers.add({ node, paint, shown: false });
    },
    colour(name) {
      return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
    },
    button() {
      const label = () => (theme.dark ? "Light" : "Dark");
      const button = el("button", { type: "button", className: "quiet", "aria-label": "Switch between light and dark", onclick: () => {
        document.documentElement.dataset.theme = theme.dark ? "light" : "dark";
        repaint();
      } }, label());
      theme.watch(button, () => { button.textContent = label(); });
      return button;
    },
  };

  function repaint() {
    for (const watcher of [...watchers]) {
      if (watcher.node.isConnected) watcher.paint();
      else watchers.delete(watcher);
    }
  }
  for (const query of [dark, printed]) query.addEventListener("change", repaint);

  Object.assign(window.unitcad, { el, clear, number, duration, bytes, spoken, section, table, facts, theme });
})();
