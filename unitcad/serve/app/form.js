// The spec as a form: a control for each field, its documented range, and why a value is refused with what would do.
(() => {
  "use strict";
  const { el, clear, number } = window.unitcad;
  const UNITS = { mm: "mm", hz: "Hz", um: "µm", g: "g", c: "°C", kpa: "kPa" };
  const OPEN = ["Unit", "Motor", "Circuit"];
  let serial = 0;

  const unitOf = (path) => UNITS[path.split(".").pop().split("_").pop()] || "";
  const wide = (field) => field.least > 0 && field.most / field.least > 50;

  // options: change(path, value, {toml, coalesce}), remove(path), table(path, present).
  function createForm(options) {
    const node = el("form", { className: "spec-form", autocomplete: "off", onsubmit: (event) => event.preventDefault() });
    const controls = new Map();
    const opened = new Map();
    let shape = "";

    // A number's field and its slider; a slider over a wide range is logarithmic.
    function numeric(field, id) {
      const state = { ...field };
      const input = el("input", { type: "number", id, step: field.kind === "integer" ? "1" : "any", inputmode: "decimal" });
      const slider = field.least !== undefined && field.most > field.least
        ? el("input", { type: "range", min: 0, max: 1000, step: 1, tabindex: "0", "aria-label": `${field.label}, slider` }) : null;
      const scale = (value) => (wide(state) ? Math.log(value / state.least) / Math.log(state.most / state.least) : (value - state.least) / (state.most - state.least));
      const value = (at) => {
        const raw = wide(state) ? state.least * (state.most / state.least) ** at : state.least + at * (state.most - state.least);
        const step = 10 ** Math.floor(Math.log10((state.most - state.least) / 100));
        return Number((Math.round(raw / step) * step).toPrecision(6));
      };
      const place = (now) => {
        if (!slider || typeof now !== "number") return;
        slider.value = String(Math.round(1000 * Math.min(1, Math.max(0, scale(now)))));
        slider.setAttribute("aria-valuetext", `${number(now)} ${unitOf(field.path)}`);
      };
      input.addEventListener("input", () => {
        if (input.value === "" || !Number.isFinite(input.valueAsNumber)) {
          // Not a change: the spec keeps what it had, and says so beside the field.
          options.unread(field.path, input.validity.badInput ? "is no number" : "is empty");
          return;
        }
        place(input.valueAsNumber);
        options.change(field.path, input.valueAsNumber, { coalesce: true });
      });
      if (slider) slider.addEventListener("input", () => {
        const now = value(Number(slider.value) / 1000);
        input.value = String(now);
        slider.setAttribute("aria-valuetext", `${number(now)} ${unitOf(field.path)}`);
        options.change(field.path, now, { coalesce: true });
      });
      return {
        main: input, others: slider ? [slider] : [],
        set(next) {
          if (document.activeElement !== input && document.activeElement !== slider) Object.assign(state, { least: next.least ?? state.least, most: next.most ?? state.most });
          const text = next.value === null || next.value === undefined ? "" : String(next.value);
          if (document.activeElement !== input || Number(input.value) !== next.value) input.value = text;
          input.placeholder = text ? "" : "default";
          place(next.value);
        },
      };
    }

    function word(field, id) {
      const select = el("select", { id, onchange: () => options.change(field.path, select.value) });
      const set = (next) => {
        const words = (next.choices || []).map(([name]) => name);
        const known = words.includes(next.value) ? next.choices : [[next.value ?? "", ""], ...(next.choices || [])];
        clear(select, known.map(([name, meaning]) => el("option", { value: name, title: meaning || undefined }, meaning ? `${name}: ${meaning}` : name || "default")));
        select.value = next.value ?? "";
      };
      return { main: select, others: [], set };
    }

    function typed(field, id) {
      const input = el("input", { type: "text", id, spellcheck: "false", onchange: () => options.change(field.path, input.value, { toml: field.kind === "toml" }) });
      return { main: input, others: [], set: (next) => {
        if (document.activeElement !== input) input.value = next.value ?? "";
        input.placeholder = next.value ? "" : "default";
      } };
    }

    function toggle(field, id) {
      const box = el("input", { type: "checkbox", id, onchange: () => options.change(field.path, box.checked) });
      return { main: box, others: [], set: (next) => { box.checked = Boolean(next.value); } };
    }

    function control(field) {
      const id = `field-${(serial += 1)}`;
      const make = { number: numeric, integer: numeric, word, switch: toggle }[field.kind] || typed;
      const made = make(field, id);
      const range = typeof field.low === "number" ? `${number(field.low)} to ${number(field.high)} ${unitOf(field.path)}`.trim() : "";
      const help = [field.meaning, range].filter(Boolean).join("; ");
      const fault = el("p", { className: "refusal", id: `${id}-fault`, role: "status" });
      const reset = el("button", { type: "button", className: "quiet reset", "aria-label": `${field.label}: back to the default`, title: "Back to the default", onclick: () => options.remove(field.path) }, "default");
      made.main.setAttribute("aria-describedby", `${id}-fault`);
      made.main.name = field.path;
      const row = el("div", { className: `field of-${field.kind}`, "data-path": field.path },
        el("label", { for: id, title: help || undefined }, field.label, unitOf(field.path) && el("span", { className: "unit" }, ` ${unitOf(field.path)}`)),
        made.main, made.others, reset, help && el("p", { className: "help" }, help), fault);
      const needed = /^(name|design|diameter_mm|layers\.\d+\.(material|wall_mm))$/.test(field.path);
      return {
        row,
        set(next) {
          made.set(next);
          reset.hidden = needed || !next.given;
          row.classList.toggle("by-default", !next.given);
        },
        // A refused value stays where it was typed, with the reason and what would be accepted.
        refuse(one) {
          made.main.setAttribute("aria-invalid", String(Boolean(one)));
          clear(fault, one && [one.message, one.nearest !== undefined && one.nearest !== null && el("button", { type: "button", onclick: () => {
            options.change(field.path, one.nearest);
            made.main.focus();
          } }, `Use ${typeof one.nearest === "number" ? number(one.nearest, 6) : one.nearest}`)]);
        },
      };
    }

    function group(each) {
      const summary = el("summary", {}, each.title);
      const body = el("div", { className: "fields" });
      const details = el("details", { "data-group": each.path || "unit", open: opened.get(each.path) ?? (OPEN.includes(each.title) || each.path.startsWith("layers.")) }, summary, body);
      details.addEventListener("toggle", () => opened.set(each.path, details.open));
      if (each.optional) body.append(el("label", { className: "present" }, el("input", { type: "checkbox", checked: each.present, onchange: (event) => options.table(each.path, event.target.checked) }), `with ${each.title.toLowerCase()}`));
      const layer = /^layers\.(\d+)$/.exec(each.path);
      for (const field of each.fields) {
        const made = control(field);
        controls.set(field.path, made);
        body.append(made.row);
      }
      if (layer && options.layers() > 1) body.append(el("button", { type: "button", className: "quiet", onclick: () => options.remove(each.path) }, `Remove layer ${Number(layer[1]) + 1}`));
      return details;
    }

    // Shows the groups of an answer; the controls stay where their fields do, so that focus stays too.
    function show(groups) {
      const next = JSON.stringify(groups.map((each) => [each.path, each.present !== false, each.fields.map((field) => [field.path, field.kind])]));
      const full = groups.map((each) => ({ present: true, optional: false, ...each }));
      if (next !== shape) {
        shape = next;
        const focused = node.contains(document.activeElement) ? document.activeElement.name : "";
        controls.clear();
        clear(node, full.flatMap((each) => {
          const made = group(each);
          const last = each.path === `layers.${options.layers() - 1}`;
          return last ? [made, el("button", { type: "button", className: "add-layer", onclick: options.addLayer }, "Add a layer outside")] : [made];
        }));
        if (focused && node.elements[focused]) node.elements[focused].focus({ preventScroll: true });
      }
      for (const each of full) for (const field of each.fields) controls.get(field.path).set(field);
    }

    // Puts each fault at its field; returns those that have none here.
    function refuse(faults) {
      const left = [];
      const at = new Map();
      for (const one of faults) {
        const place = controls.has(one.field) ? one.field : controls.has(one.field.replace(/\.\d+$/, "")) ? one.field.replace(/\.\d+$/, "") : "";
        if (place && !at.has(place)) at.set(place, one);
        else left.push(one);
      }
      for (const [path, made] of controls) {
        made.refuse(at.get(path));
        const details = at.has(path) && made.row.closest("details");
        if (details) details.open = true;
      }
      return left;
    }

    // A field that holds no value: the spec still has the one before.
    function unread(path, why) {
      const made = controls.get(path);
      if (made) made.refuse({ message: `The field ${why}; the spec keeps the value before.` });
    }

    return { node, show, refuse, unread };
  }

  Object.assign(window.unitcad, { createForm });
})();
