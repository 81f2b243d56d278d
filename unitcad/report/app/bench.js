// The bench page: a procedure's steps in large, timers by absolute times, fields, and the cast record that they make.
(() => {
  "use strict";
  const { el, clear, duration, number, section, table, theme } = window.unitcad;
  const page = document.getElementById("page");
  const MINUTE = 60000;
  // Of two printed pages in mm²: all, a letter, a step's title, a pour's lines to write on, a unit's, head and schedule; and in mm a column and pictures' widths.
  const PAPER = { mm2: 2 * 190 * 277 * 0.84, letter: 5, title: 220, pour: 1500, unit: 900, page: 5000, column: 60, most: 58, least: 20 };
  const LIMITS = { grams: [1e-4, 1e5], mm: [0.01, 1000] };
  // How far from what is asked a measured length or mass may lie: beyond it a digit or a point is wrong.
  const FACTOR = 3;
  let data, key, state;

  // What a person has entered, kept in the browser: a reload and a locked screen lose nothing, since every time is absolute.
  const fresh = () => ({ done: {}, began: {}, fields: {}, ready: "", motor: false });
  let keeps = true;
  function restore() {
    try {
      return { ...fresh(), ...JSON.parse(localStorage.getItem(key) || "{}") };
    } catch {
      keeps = false;
      return fresh();
    }
  }
  function keep() {
    try {
      localStorage.setItem(key, JSON.stringify(state));
    } catch {
      keeps = false;
    }
  }

  const two = (value) => String(value).padStart(2, "0");
  function remaining(ms) {
    const seconds = Math.floor(Math.abs(ms) / 1000);
    return `${Math.floor(seconds / 3600)}:${two(Math.floor(seconds / 60) % 60)}:${two(seconds % 60)}`;
  }
  const clock = (time) => new Date(time).toLocaleString("en-GB", { weekday: "short", day: "numeric", month: "short", hour: "2-digit", minute: "2-digit" });
  const day = (time) => { const at = new Date(time); return `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())}`; };
  function iso(time) {
    const at = new Date(time), off = -at.getTimezoneOffset(), size = Math.abs(off);
    return `${day(time)}T${two(at.getHours())}:${two(at.getMinutes())}:${two(at.getSeconds())}${off < 0 ? "-" : "+"}${two(Math.floor(size / 60))}:${two(size % 60)}`;
  }

  // What a field's value should be, where the spec says it.
  function asked(name) {
    const [, what, layer] = name.match(/^u\d+\.(height|mass|d|w)(\d*)/) || [];
    const known = { height: data.asked.height_mm, mass: data.asked.mass_g, d: data.asked.diameter_mm, w: (data.asked.walls_mm || [])[layer - 1] };
    return known[what] || null;
  }

  function limits(name, kind) {
    const [least, most] = LIMITS[kind], near = asked(name);
    return near ? [Math.max(least, near / FACTOR), Math.min(most, near * FACTOR)] : [least, most];
  }

  // A decimal comma is a point. Nothing is null, what is no number within the limits undefined.
  function value(name, kind) {
    const text = (state.fields[name] || "").trim().replace(",", ".");
    if (!text) return null;
    const given = Number(text), [least, most] = limits(name, kind);
    return Number.isFinite(given) && given >= least && given <= most ? given : undefined;
  }

  function wrongWords(name, kind, unit) {
    const [least, most] = limits(name, kind), near = asked(name);
    return `must be ${number(least, 3)} to ${number(most, 3)} ${unit}${near ? `: ${number(near, 3)} ${unit} is asked` : ""}`;
  }

  // As the scale shows them.
  const grams = (mass) => mass.toFixed(Math.max(0, Math.min(4, Math.ceil(-Math.log10(data.scale_g || 0.01) - 1e-9))));

  function field(name, label, unit, kind) {
    const said = el("span", { className: "limit" });
    const judge = () => {
      const wrong = value(name, kind) === undefined;
      input.setAttribute("aria-invalid", String(wrong));
      said.textContent = wrong ? wrongWords(name, kind, unit) : "";
    };
    const input = el("input", { type: "text", inputmode: "decimal", name, autocomplete: "off", value: state.fields[name] || "", oninput: () => {
      state.fields[name] = input.value;
      judge();
      keep();
    } });
    judge();
    return el("label", { className: "field" }, el("span", {}, label), el("span", { className: "value" }, input, ` ${unit}`), said);
  }

  function words(name, label) {
    const input = el("textarea", { name, rows: 2, oninput: () => { state.fields[name] = input.value; keep(); } });
    input.value = state.fields[name] || "";
    return el("label", { className: "field wide" }, el("span", {}, label), input);
  }

  const lines = (name) => (state.fields[name] || "").split(/[\r\n]+/).map((line) => line.replace(/[^\P{C}]/gu, " ").trim().slice(0, 1000)).filter(Boolean).slice(0, 200);

  // Timers: each counts to an absolute time, and is painted anew every second and when the page is seen again.
  const timers = [];
  function timer(name, label, minutes) {
    const shown = el("output", { className: "clock", "aria-live": "off" });
    const ends = el("p", { className: "ends" });
    const paint = () => {
      const began = state.began[name];
      shown.textContent = began ? `${Date.now() > began + minutes * MINUTE ? "over by " : ""}${remaining(began + minutes * MINUTE - Date.now())}` : duration(minutes);
      shown.classList.toggle("over", Boolean(began) && Date.now() > began + minutes * MINUTE);
      ends.textContent = began ? `Ends ${clock(began + minutes * MINUTE)}. Set the phone's own alarm for it: a page makes no sound under a locked screen.` : "";
      start.textContent = began ? "Start again from now" : `Start ${label}`;
    };
    const start = el("button", { type: "button", onclick: () => { state.began[name] = Date.now(); keep(); paint(); } });
    timers.push({ name, label, minutes, paint });
    return el("div", { className: "timer" }, el("span", {}, label), shown, start, ends);
  }

  function paintTimers() {
    for (const { paint } of timers) paint();
    const end = ({ name, minutes }) => state.began[name] + minutes * MINUTE;
    const open = ({ name }) => state.began[name] && [...document.querySelectorAll("li.bench-step:not(.done)")].some((node) => node.dataset.timer === name);
    const [next] = timers.filter(open).sort((one, other) => end(one) - end(other));
    const over = Boolean(next) && Date.now() > end(next);
    ahead.textContent = next ? `${next.label} ${over ? "over by " : ""}${remaining(end(next) - Date.now())}` : "";
    ahead.classList.toggle("over", over);
  }

  // At the lower edge, for the thumb of the hand that holds the phone: the step to do, the timer that ends first, and a
  // large button. `at` is the step's place in the list.
  const ahead = el("output", { className: "clock", "aria-live": "off" });
  const doing = el("button", { type: "button", className: "quiet", onclick: () => toStep() });
  const back = el("button", { type: "button", onclick: () => tick(last()) }, "Back");
  const done = el("button", { type: "button", className: "main", onclick: () => tick(current()) }, "Done");
  const bar = el("div", { id: "now", className: "screen", role: "region", "aria-label": "The step to do" }, el("div", { className: "step-line" }, doing, ahead), el("div", { className: "presses" }, back, done));
  const current = () => document.querySelector("li.bench-step[aria-current]");
  const last = () => [...document.querySelectorAll("li.bench-step.done")].pop();
  const toStep = () => (current() || document.getElementById("measure")).scrollIntoView({ block: "start" });

  function tick(step) {
    if (step) step.querySelector("input").click();
    toStep();
  }

  function card(step, at, pour) {
    const own = [], before = timers.length;
    if (step.kind === "weigh") {
      const partB = el("p", { className: "part-b", role: "status" });
      const weigh = () => {
        const weighed = value(`p${pour.index}.a`, "grams");
        partB.textContent = weighed ? `A is ${grams(weighed)} g: weigh B to ${grams(weighed * pour.part_b_g / pour.part_a_g)} g.` : "";
      };
      own.push(el("div", { className: "fields", oninput: weigh }, field(`p${pour.index}.a`, `Part A weighed (${number(pour.part_a_g, 3)} g asked)`, "g", "grams"),
        field(`p${pour.index}.b`, `Part B weighed (${number(pour.part_b_g, 3)} g asked)`, "g", "grams")), partB);
      weigh();
    }
    if (step.kind === "mix" && pour.pot_life_min) own.push(timer(`p${pour.index}.mix`, "pot life", pour.pot_life_min));
    if (step.kind === "rest" && step.wait_min) own.push(timer(`s${at}`, "wait", step.minutes + step.wait_min));
    if (step.kind === "cure") own.push(timer(pour ? `p${pour.index}.cure` : `s${at}`, "cure", step.wait_min));
    const ticked = el("input", { type: "checkbox", checked: Boolean(state.done[at]), "aria-label": `Step ${at + 1} done`, onchange: () => {
      if (ticked.checked) state.done[at] = Date.now();
      else delete state.done[at];
      // The next step's timer begins: pot life with the mixing, cure with the last strike.
      const next = data.steps[at + 1];
      if (ticked.checked && next && ["mix", "rest", "cure"].includes(next.step.kind)) {
        const name = next.pour && next.step.kind !== "rest" ? `p${next.pour.index}.${next.step.kind}` : `s${at + 1}`;
        if (!state.began[name]) state.began[name] = Date.now();
      }
      keep();
      mark();
      paintTimers();
    } });
    const picture = data.pictures[step.picture];
    return el("li", { className: `bench-step${step.short ? " repeated" : ""}`, value: at + 1, "data-step": String(at), "data-timer": timers.length > before ? timers[before].name : undefined },
      el("h3", {}, el("label", {}, ticked, el("span", { className: "count" }, `${at + 1}`), ` ${step.title}`)),
      picture && el("img", { className: again(at) ? "again" : undefined, src: picture, alt: step.title, width: "540" }),
      el("p", { className: "whole" }, step.text), step.short && el("p", { className: "as" }, step.short), own);
  }

  // The first step that is not done is the one to do.
  function mark() {
    const cards = [...document.querySelectorAll("li.bench-step")];
    const now = cards.find((node) => !state.done[node.dataset.step]);
    for (const node of cards) {
      node.classList.toggle("done", Boolean(state.done[node.dataset.step]));
      if (node === now) node.setAttribute("aria-current", "step");
      else node.removeAttribute("aria-current");
    }
    doing.textContent = now ? now.querySelector("h3").textContent : "All steps done: measure";
    done.disabled = !now;
    back.disabled = !last();
  }

  function plan() {
    const { casting } = data;
    const out = el("div");
    const ready = el("input", { type: "datetime-local", name: "ready", value: state.ready });
    const motor = el("input", { type: "checkbox", name: "motor", checked: state.motor });
    const total = () => (state.motor ? casting.time_line[casting.time_line.length - 1] : null);
    const draw = () => {
      const withMotor = (phase) => phase.start_min >= casting.earliest_finish_min - 1e-6;
      const phases = casting.time_line;
      const finish = total() ? total().start_min + total().bench_min + total().wait_min : casting.earliest_finish_min;
      const end = state.ready ? new Date(state.ready).getTime() : NaN;
      const start = end - finish * MINUTE;
      // On paper the motor's row is there either way.
      const rows = phases.map((phase) => ({ className: withMotor(phase) && !state.motor ? "unasked" : undefined, cells: [phase.name, Number.isFinite(start) ? clock(start + phase.start_min * MINUTE) : `after ${duration(phase.start_min)}`, duration(phase.bench_min), duration(phase.wait_min)] }));
      const late = Number.isFinite(start) && start < Date.now();
      clear(out, Number.isFinite(start) && el("p", { className: late ? "verdict bad" : "verdict good" }, late
        ? `Too late by ${duration((Date.now() - start) / MINUTE)}: begun now, it is ready ${clock(Date.now() + finish * MINUTE)}.`
        : `Begin by ${clock(start)}, the pieces printed.`),
      table(["Item", "Begin", "At the bench", "Then wait"], rows, { label: "Schedule" }));
    };
    for (const input of [ready, motor]) input.addEventListener("change", () => { state.ready = ready.value; state.motor = motor.checked; keep(); draw(); });
    draw();
    return section("plan", "Time",
      el("p", {}, el("strong", {}, duration(casting.earliest_finish_min)), ` from the printed pieces to the ${casting.makes} out of the mould, of which ${duration(casting.bench_min)} at the bench.`),
      el("div", { className: "fields screen" }, el("label", { className: "field" }, el("span", {}, "Must be ready"), ready),
        casting.assembly.length > 0 && el("label", { className: "field" }, motor, el("span", {}, `with the ${casting.last.toLowerCase()}`))), out);
  }

  // Step 0: the lengths of bought parts, and the command that builds with those that were measured.
  function first() {
    const { sizes, source } = data.casting.printing;
    if (!sizes.length) return null;
    const command = el("code", {}), now = (size) => value(size.keys[0], "mm") || size.value_mm;
    const draw = () => {
      const off = sizes.filter((size) => Math.abs(now(size) - size.value_mm) > data.measured_mm);
      const sets = (list) => list.flatMap((size) => size.keys.map((key) => ` --set ${key}=${number(now(size), 4)}`)).join("");
      clear(said, off.length > 0 && `${off.map((size) => size.what).join(", ")} differ${off.length > 1 ? "" : "s"}: build again in this folder before you print.`);
      command.textContent = `unitcad build ${source}${sets(off.length ? off : sizes)}`;
    };
    const said = el("p", { className: "verdict bad", role: "status" });
    const rows = sizes.map((size) => field(size.keys[0], `${size.what}: ${number(size.value_mm, 3)} mm${size.assumed ? ` (assumed; ${size.assumed})` : ""}`, "mm", "mm"));
    const paper = sizes.map((size) => `${size.what} ${number(size.value_mm, 3)} mm${size.assumed ? " (assumed)" : ""}: ______ mm`).join("; ");
    const node = section("first", "0. Measure first", el("div", { className: "fields", oninput: draw }, rows), el("p", { className: "paper" }, paper), said,
      el("p", {}, `A size that differs by more than ${data.measured_mm} mm needs other moulds: `, command));
    draw();
    return node;
  }

  function printing() {
    return section("print", "Print", el("ul", {}, data.casting.printing.how.map((text) => el("li", {}, text))));
  }

  const GROUPS = { Buy: (item) => item.made === "bought", Have: (item) => item.made !== "bought" && !item.made.startsWith("printed") };

  function needed() {
    return Object.entries(GROUPS).map(([title, belongs]) => {
      const rows = data.casting.bill.filter(belongs).map((item) => ({ className: / part [AB]$/.test(item.item) ? "plain" : undefined, cells: [item.item, `${number(item.quantity, 3)} ${item.unit}`, item.note] }));
      return rows.length > 0 && section(title.toLowerCase(), title, table(["Item", "How much", "Note"], rows, { label: title }));
    });
  }

  function troubles() {
    const rows = data.casting.troubles.map((each) => [each.sign, each.cause, each.now, each.spec]);
    return section("troubles", "Troubleshooting", table(["Sign", "Cause", "Now", "In the spec"], rows, { label: "Troubleshooting" }));
  }

  const engraved = (cavity) => (data.casting.cells > 1 ? ` ${cavity.toString(16).toUpperCase()}` : "");

  function measure() {
    const { casting } = data;
    const cavities = Array.from({ length: casting.cells }, (_, i) => i + 1);
    const cells = cavities.map((cavity) => {
      const name = `u${cavity}`;
      const spoiled = el("input", { type: "checkbox", name: `${name}.spoiled`, checked: Boolean(state.fields[`${name}.spoiled`]), onchange: () => { state.fields[`${name}.spoiled`] = spoiled.checked ? "yes" : ""; keep(); } });
      return el("fieldset", {}, el("legend", {}, `Unit${engraved(cavity)}`),
        el("div", { className: "fields" }, field(`${name}.height`, "Height", "mm", "mm"), field(`${name}.mass`, "Mass of silicone, trimmed", "g", "grams"),
          [1, 2].map((i) => field(`${name}.d${i}`, `Diameter ${i}`, "mm", "mm"))),
        casting.pours.map((pour) => el("div", { className: "fields" }, [1, 2, 3, 4].map((i) => field(`${name}.w${pour.index}.${i}`, `Wall of layer ${pour.index}, place ${i}`, "mm", "mm")))),
        el("label", { className: "field" }, spoiled, el("span", {}, "spoiled: not to be measured further")), words(`${name}.notes`, "Notes"));
    });
    return section("measure", "Measure", el("ul", {}, casting.measure.map((text) => el("li", {}, text))), el("div", { className: "screen" }, cells));
  }

  // The record of what is entered, and the names of fields that hold no number.
  function record() {
    const wrong = [];
    const given = (name, kind) => {
      const found = value(name, kind);
      if (found === undefined) wrong.push(name);
      return found ?? null;
    };
    const minutes = (from, to) => (from && to && to > from ? Number(((to - from) / MINUTE).toPrecision(4)) : null);
    const pours = data.casting.pours.map((pour) => {
      const own = data.steps.map((each, at) => ({ ...each, at })).filter((each) => each.pour === pour);
      const cure = own.findIndex((each) => each.step.kind === "cure");
      const began = state.began[`p${pour.index}.mix`], struck = state.began[`p${pour.index}.cure`];
      const opened = own.slice(cure + 1).map((each) => state.done[each.at]).find(Boolean);
      const [life, cured] = [minutes(began, struck), minutes(struck, opened)];
      return { index: pour.index, material: pour.material.slice(0, 200), lot: (state.fields[`p${pour.index}.lot`] || "").trim().slice(0, 200) || null,
        part_a_g: given(`p${pour.index}.a`, "grams"), part_b_g: given(`p${pour.index}.b`, "grams"), mixed_at: began ? iso(began) : null,
        pot_life_min: life === null || life < 0.1 || life > 10000 ? null : life, cure_h: cured === null || cured < 0.6 || cured > 60000 ? null : Number((cured / 60).toPrecision(4)), notes: lines(`p${pour.index}.notes`) };
    });
    const units = Array.from({ length: data.casting.cells }, (_, i) => i + 1).map((cavity) => {
      const name = `u${cavity}`;
      const several = (names) => names.map((each) => given(each, "mm")).filter((each) => each !== null);
      const walls = data.casting.pours.map((pour) => ({ layer: pour.index, places_mm: several([1, 2, 3, 4].map((i) => `${name}.w${pour.index}.${i}`)) }));
      return { cavity, usable: !state.fields[`${name}.spoiled`], height_mm: given(`${name}.height`, "mm"), diameters_mm: several([`${name}.d1`, `${name}.d2`]),
        mass_g: given(`${name}.mass`, "grams"), walls: walls.filter((wall) => wall.places_mm.length), notes: lines(`${name}.notes`) };
    });
    const first = Math.min(...Object.values(state.began), Date.now());
    const made = { format: data.record.format, version: data.record.version, spec_name: data.casting.name.slice(0, 200), spec_hash: data.hash, cast_on: day(first), label: data.casting.label,
      spec: data.spec, room_c: data.room_c, scale_resolution_g: data.scale_g, pours, units, notes: lines("notes") };
    return { made, wrong };
  }

  function saving() {
    const said = el("p", { role: "status" });
    const save = () => {
      const { made, wrong } = record();
      if (wrong.length) {
        const node = document.querySelector(`[name="${wrong[0]}"]`);
        node.setAttribute("aria-invalid", "true");
        node.focus();
        said.textContent = `Not saved: ${wrong.length} field${wrong.length === 1 ? " has" : "s have"} no number within the limits; the first one is selected.`;
        return;
      }
      const slug = made.spec_name.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-+|-+$/g, "").slice(0, 50) || "unit";
      const name = `${slug}-${made.cast_on}${data.record.ending}`;
      const url = URL.createObjectURL(new Blob([`${JSON.stringify(made, null, 1)}\n`], { type: "application/json" }));
      const link = el("a", { href: url, download: name });
      document.body.append(link);
      link.click();
      link.remove();
      setTimeout(() => URL.revokeObjectURL(url), MINUTE);
      said.textContent = `${name} is saved. Put it into this result's folder and run unitcad report: the page shows it.`;
    };
    const anew = () => {
      if (!window.confirm("Delete all entries and begin a new casting?")) return;
      state = fresh();
      keep();
      draw();
    };
    return section("save", "Cast record",
      el("p", {}, "Grams, times, walls and masses in one JSON file, for unitcad report, fit and measure."), words("notes", "Notes on this casting"),
      el("div", { className: "tools" }, el("button", { type: "button", className: "main", onclick: save }, "Save the cast record"), el("button", { type: "button", onclick: anew }, "New casting")),
      said, !keeps && el("p", { className: "verdict bad" }, "This browser stores nothing: save before you close the page."));
  }

  // What only paper has: lines to write on.
  function written() {
    const blank = "__________";
    const rows = data.casting.pours.map((pour) => [`Pour ${pour.index}`, `A ${blank} of ${number(pour.part_a_g, 3)} g`, `B ${blank} of ${number(pour.part_b_g, 3)} g`, `mixed at ${blank}`, `struck at ${blank}`, `opened at ${blank}`, `lot ${blank}`]);
    const short = "______";
    const walls = data.casting.pours.map((pour) => `layer ${pour.index} ${short} ${short} ${short} ${short} mm`).join("; ");
    const units = Array.from({ length: data.casting.cells }, (_, i) => el("p", { className: "unit" },
      `Unit${engraved(i + 1)}: height ${short} mm, diameters ${short} ${short} mm, mass ${short} g; walls: ${walls}`));
    return el("div", { className: "paper" }, el("h2", {}, `Cast record, date ${blank}`), table(["", "", "", "", "", "", ""], rows, { label: "To write down" }), units);
  }

  function draw() {
    const { casting } = data;
    timers.length = 0;
    let at = 0;
    const list = (id, title, steps, pour, ...more) => steps.length > 0 && section(id, title, el("ol", {}, steps.map((step) => card(step, at++, pour))), more);
    const cavities = `${casting.cells} ${casting.cells === 1 ? "cavity" : "cavities"}`;
    const cells = casting.makes === "patch" ? `${casting.cells} units in one patch` : cavities;
    clear(page,
      el("header", { className: "top" }, el("div", {}, el("h1", {}, casting.name), el("p", { className: "line" }, `Mould set ${casting.label}, ${cells} · ${data.hash}`)), el("div", { className: "chips" }, theme.button())),
      casting.warnings.map((text) => el("p", { className: "verdict bad" }, `Warning: ${text}.`)),
      plan(), first(), printing(), needed(),
      list("preparation", "Before the first pour", casting.preparation, null),
      casting.pours.map((pour) => list(`pour${pour.index}`, `Pour ${pour.index}: ${(pour.layer || `layer${pour.index}`).replace(/(\d+)$/, " $1")}, ${pour.material}`, pour.steps, pour,
        el("div", { className: "screen" }, el("label", { className: "field" }, el("span", {}, "Lot on the bottles"), lot(pour)), words(`p${pour.index}.notes`, "Notes on this pour")))),
      list("release", "Out of the mould", casting.release, null),
      list("assembly", casting.last, casting.assembly, null),
      measure(), written(), troubles(), saving(),
      el("footer", {}, el("p", {}, `Made by unitcad ${data.version}. This page contacts nothing; what you enter stays in this browser.`)),
      data.steps.length > 0 && bar);
    mark();
    paintTimers();
  }

  function lot(pour) {
    const name = `p${pour.index}.lot`;
    const input = el("input", { type: "text", name, value: state.fields[name] || "", oninput: () => { state.fields[name] = input.value; keep(); } });
    return input;
  }

  // The printed sheet has letters of 8 pt; what two pages of A4 leave beside them, the pictures get.
  function paperSize() {
    const { casting } = data, { how, sizes } = casting.printing;
    const words = [...data.steps.map(({ step }) => step.short || step.text), ...how, ...casting.measure, ...casting.troubles.flatMap((each) => [each.sign, each.now])];
    const listed = [...casting.bill.map((item) => `${item.item} ${item.note}`), ...sizes.map((size) => size.what + size.assumed)];
    const letters = words.join(" ").length + listed.join("").length + 12 * listed.length;
    const high = data.steps.filter((each, at) => data.pictures[each.step.picture] && !each.step.short && !again(at))
      .reduce((sum, each) => sum + shape(data.pictures[each.step.picture]), 0);
    const fixed = PAPER.page + data.steps.length * PAPER.title + casting.pours.length * PAPER.pour + casting.cells * PAPER.unit;
    const room = PAPER.mm2 - letters * PAPER.letter - fixed;
    const tall = Math.max(PAPER.least, Math.min(PAPER.most, room / PAPER.column / Math.max(high, 1)));
    document.documentElement.style.setProperty("--paper-picture", `${tall.toFixed(1)}mm`);
  }

  // Whether a step has the picture of the one before: paper shows it once.
  const again = (at) => at > 0 && data.steps[at].step.picture === data.steps[at - 1].step.picture;

  // The height of a PNG over its width, as its header says.
  function shape(picture) {
    const bytes = Uint8Array.from(atob(picture.slice(picture.indexOf(",") + 1).slice(0, 32)), (letter) => letter.charCodeAt(0));
    const header = new DataView(bytes.buffer);
    return header.getUint32(20) / header.getUint32(16);
  }

  async function start() {
    data = JSON.parse(new TextDecoder().decode(await window.unitcad.unpacked(document.getElementById("data").textContent)));
    const { casting } = data;
    const of = (steps, pour) => steps.map((step) => ({ step, pour }));
    data.steps = [...of(casting.preparation, null), ...casting.pours.flatMap((pour) => of(pour.steps, pour)), ...of(casting.release, null), ...of(casting.assembly, null)];
    key = `unitcad bench ${data.hash} ${casting.label}`;
    state = restore();
    paperSize();
    draw();
    setInterval(paintTimers, 1000);
    document.addEventListener("visibilitychange", paintTimers);
    document.documentElement.dataset.ready = "yes";
  }

  start().catch((error) => clear(page, el("p", { className: "absent" }, `The page can't be drawn: ${error.message}`)));
})();
