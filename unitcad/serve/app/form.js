// The spec as a form: a control for each field, its documented range, and why a value is refused with what would do.
(() => {
  "use strict";
  const { el, clear, number } = window.unitcad;
  const UNITS = { mm: "mm", hz: "Hz", um: "µm", g: "g", c: "°C", kpa: "kPa" };
  const OPEN = ["Unit", "Motor", "Circuit", "Array", "Layout", "Sheet"];
  let serial = 0;

  // The key of a list's entry is the list's.
  const keyOf = (path) => path.replace(/\.\d+$/, "");
  const unitOf = (path) => UNITS[keyOf(path).split(".").pop().split("_").pop()] || "";
  const STEPS = 200;

  // A slider's track over a range: evenly spaced if it is whole numbers or a range of use, and over many decades fine about
  // `middle`, the value that was there first, and coarse towards the ends. `at` gives the value at a place from 0 to 1, `place`
  // the place of a value.
  function track(low, high, middle, whole) {
    if (whole || high <= 20 * low || high <= 2) {
      const grain = whole ? 1 : 10 ** Math.floor(Math.log10((high - low) / STEPS));
      const at = (place) => Number((Math.round((low + place * (high - low)) / grain) * grain).toPrecision(6));
      return { at: (place) => Math.min(high, Math.max(low, at(place))), place: (value) => (value - low) / (high - low) };
    }
    const ratio = low > 0;
    const onto = (value) => (ratio ? Math.log(value) : value);
    const [from, centre, to] = [low, Math.min(high, Math.max(low, middle)), high].map(onto);
    const half = centre === from ? 0 : centre === to ? 1 : 0.5;
    const bent = (t) => 0.1 * t + 0.9 * t ** 3;
    const exact = (place) => {
      const value = place < half ? centre - bent((half - place) / half) * (centre - from) : centre + bent((place - half) / (1 - half || 1)) * (to - centre);
      return ratio ? Math.exp(value) : value;
    };
    const at = (place) => {
      const value = exact(place);
      const step = 10 ** Math.floor(Math.log10(Math.max(Math.abs(value), (high - low) / 1000) / 100));
      return Math.min(high, Math.max(low, Number((Math.round(value / step) * step).toPrecision(6))));
    };
    const place = (value) => {
      let [least, most] = [0, 1];
      for (let i = 0; i < 30; i += 1) {
        const between = (least + most) / 2;
        if (exact(between) < value) least = between;
        else most = between;
      }
      return least;
    };
    return { at, place };
  }

  // What an arrow key adds to a number: its second digit, or a hundredth of the range where it is 0.
  function arrowStep(value, low, high) {
    const size = Math.abs(value) || (high > low ? (high - low) / 10 : 1);
    return 10 ** (Math.floor(Math.log10(size)) - 1);
  }

  // options: change(path, value, {toml, coalesce}), remove(...paths), rename(from, to, value), table(group, present), layers(), addLayer(), unread(path, why).
  function createForm(options) {
    const node = el("form", { className: "spec-form", autocomplete: "off", onsubmit: (event) => event.preventDefault() });
    const controls = new Map();
    const opened = new Map();
    let shape = "";

    // A number's field and its slider.
    function numeric(field, id) {
      let way = null;
      const input = el("input", { type: "number", id, step: field.kind === "integer" ? "1" : "any", inputmode: "decimal" });
      const steps = field.kind === "integer" ? field.high - field.low : STEPS;
      const slider = typeof field.value === "number" && field.high > field.low
        ? el("input", { type: "range", min: 0, max: steps, step: 1, tabindex: "0", "aria-label": `${field.label}, slider` }) : null;
      const place = (now) => {
        // Focus stays, and the value goes on to the next multiple.
        if (field.kind !== "integer" && typeof now === "number") input.step = String(arrowStep(now, field.low, field.high));
        if (!slider || typeof now !== "number") return;
        way = way || track(field.low, field.high, now, field.kind === "integer");
        slider.value = String(Math.round(steps * way.place(now)));
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
        const now = way.at(Number(slider.value) / steps);
        input.value = String(now);
        slider.setAttribute("aria-valuetext", `${number(now)} ${unitOf(field.path)}`);
        options.change(field.path, now, { coalesce: true });
      });
      return {
        main: input, others: slider ? [slider] : [],
        set(next) {
          const text = next.value === null || next.value === undefined ? "" : String(next.value);
          if (document.activeElement !== input || Number(input.value) !== next.value) input.value = text;
          input.placeholder = text || next.required ? "" : "default";
          place(next.value);
        },
      };
    }

    function word(field, id) {
      const select = el("select", { id, onchange: () => options.change(field.path, select.value) });
      let offered = "";
      const set = (next) => {
        const now = JSON.stringify([next.choices, next.value]);
        if (now === offered && select.value === (next.value ?? "")) return;
        offered = now;
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
        input.placeholder = next.value || next.required ? "" : "default";
      } };
    }

    // A list of some of the choices, in their order.
    function several(field, id) {
      const boxes = field.choices.map(([name, meaning]) => [name, el("input", { type: "checkbox", name: `${field.path} ${name}`, title: meaning || undefined, onchange: () => options.change(field.path, boxes.filter(([, box]) => box.checked).map(([each]) => each)) })]);
      const main = el("span", { className: "several", id, role: "group", tabindex: "-1", "aria-label": field.label }, boxes.map(([name, box]) => el("label", {}, box, ` ${name}`)));
      return { main, others: [], set: (next) => { for (const [name, box] of boxes) box.checked = (next.value || []).includes(name); } };
    }

    function toggle(field, id) {
      const box = el("input", { type: "checkbox", id, onchange: () => options.change(field.path, box.checked) });
      return { main: box, others: [], set: (next) => { box.checked = Boolean(next.value); } };
    }

    // What would make a refused text accepted, as words, what they do and its name: a value in the field of `place`, one in another, none.
    function remedies(one, place) {
      const out = [one.field, ...(one.together || [])].sort();
      const use = (at, value) => value !== undefined && value !== null && [`Use ${at === place ? "" : `${at} = `}${typeof value === "number" ? number(value, 6) : Array.isArray(value) ? `[${value.join(", ")}]` : value}`, () => options.change(at, value), `${at} = ${value}`];
      return [
        one.at && use(one.at, one.at_nearest),
        use(one.field, one.nearest),
        one.rename && [`Rename it ${one.rename[0]}`, () => options.rename(one.field, ...one.rename), `${one.field} as ${one.rename[0]}`],
        one.leave_out && [out.length > 1 ? `Leave out ${out.join(" and ")}` : "Leave it out", () => options.remove(...out), `without ${out}`],
      ].filter(Boolean);
    }

    // The remedies of what is refused now that have a button: the same one has it once.
    let offered = new Set();

    // A refusal at the field of `place`, with its reason and a button for each remedy; `then` puts the focus where the button no longer is.
    function told(one, place, then) {
      const fresh = remedies(one, place).filter(([, , what]) => !offered.has(what));
      for (const [, , what] of fresh) offered.add(what);
      return [one.message, fresh.map(([words, act]) => el("button", { type: "button", onclick: () => {
        act();
        then();
      } }, words))];
    }

    function control(field) {
      const id = `field-${(serial += 1)}`;
      const make = { number: numeric, integer: numeric, word, words: several, switch: toggle }[field.kind] || typed;
      const made = make(field, id);
      const range = typeof field.low === "number" ? `${number(field.low)} to ${number(field.high)} ${unitOf(field.path)}`.trim() : "";
      const fault = el("p", { className: "refusal", id: `${id}-fault`, role: "status" });
      const reset = el("button", { type: "button", className: "quiet reset", "aria-label": `${field.label}: back to the default`, title: "Back to the default", onclick: () => { made.main.focus(); options.remove(keyOf(field.path)); } }, "default");
      made.main.setAttribute("aria-describedby", `${id}-range ${id}-meaning ${id}-fault`);
      made.main.name = field.path;
      const row = el("div", { className: `field of-${field.kind}`, "data-path": field.path },
        el("label", { for: id }, field.label, unitOf(field.path) && el("span", { className: "unit" }, ` ${unitOf(field.path)}`)),
        made.main, reset, el("span", { className: "range", id: `${id}-range` }, range), made.others, el("span", { className: "meaning", id: `${id}-meaning` }, field.meaning), fault);
      return {
        row,
        set(next) {
          made.set(next);
          reset.hidden = next.required || !next.given;
          row.classList.toggle("by-default", !next.given);
        },
        // A refused value stays where it was typed, with the reason and what would be accepted.
        refuse(one) {
          made.main.setAttribute("aria-invalid", String(Boolean(one)));
          clear(fault, one && told(one, field.path, () => made.main.focus()));
        },
      };
    }

    function group(each) {
      const summary = el("summary", {}, each.title);
      const body = el("div", { className: "fields" });
      const details = el("details", { "data-group": each.path || "unit", open: opened.get(each.path) ?? (OPEN.includes(each.title) || each.path.startsWith("layers.")) }, summary, body);
      details.addEventListener("toggle", () => opened.set(each.path, details.open));
      if (each.optional) body.append(el("label", { className: "present" }, el("input", { type: "checkbox", name: `with ${each.path}`, checked: each.present, onchange: (event) => options.table(each, event.target.checked) }), `with ${each.title.toLowerCase()}`));
      const layer = /^layers\.(\d+)$/.exec(each.path);
      for (const field of each.fields) {
        const made = control(field);
        controls.set(field.path, made);
        body.append(made.row);
      }
      if (layer && options.layers() > 1) body.append(el("button", { type: "button", name: `remove ${each.path}`, className: "quiet", onclick: () => options.remove(each.path) }, `Remove layer ${Number(layer[1]) + 1}`));
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
          return last ? [made, el("button", { type: "button", name: "add", className: "add-layer", onclick: options.addLayer }, "Add a layer outside")] : [made];
        }));
        // Of a layer that is taken away, the focus goes to where one is put in.
        const back = focused && (node.elements[focused] || node.elements.add);
        if (back) back.focus({ preventScroll: true });
      }
      for (const each of full) for (const field of each.fields) controls.get(field.path).set(field);
    }

    // Puts each fault at its field; returns those that have none here.
    function refuse(faults) {
      const left = [];
      const at = new Map();
      offered = new Set();
      for (const one of faults) {
        const field = one.field || "";
        const place = [one.at, field, field.replace(/\.\d+$/, "")].find((path) => controls.has(path));
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

    const row = (path) => controls.has(path) && controls.get(path).row;

    return { node, show, refuse, unread, told, row };
  }

  Object.assign(window.unitcad, { createForm });
})();
