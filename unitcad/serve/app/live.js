// The live page: form and text on the left, unit, moulds, section and estimate on the right, in step.
(() => {
  "use strict";
  const U = window.unitcad;
  const { el, clear, section, theme, number } = U;
  const page = document.getElementById("page");
  const APART_MS = 900;
  const AFTER_MS = 120;
  const MOST_TOLD = 8;
  const UNWRITTEN = "A change is shown at once. Nothing is written until you save, build or sweep.";

  function start() {
    const packed = Uint8Array.from(atob(document.getElementById("data").textContent), (c) => c.charCodeAt(0));
    const data = JSON.parse(new TextDecoder().decode(packed));
    const server = U.createServer();
    const kept = U.keepText(data.text);
    const state = { text: kept.text, pending: [], past: kept.past, future: [], file: kept.file || data.name, last: { path: "", at: 0 }, layers: 0, model: null, unit: {}, moulds: {}, estimate: {}, groups: [], accepted: new Map(), changed: [], made: new Map(), unmade: [], opened: "", later: 0, asked: 0 };
    window.unitcad.timings = [];

    const form = U.createForm({
      change: (path, value, how = {}) => edit([...sizes(path), { path, value, ...(how.toml ? { toml: true } : {}) }], how.coalesce),
      remove: (...paths) => edit(paths.map((path) => ({ path, remove: true }))),
      rename: (from, to, value) => edit([{ path: from, remove: true }, { path: to, value }]),
      unread: (path, why) => form.unread(path, why),
      table: (group, present) => {
        const change = present ? { path: group.path, value: group.needs || {} } : { path: group.path, remove: true };
        edit([present && group.instead && { path: group.instead, remove: true }, change].filter(Boolean));
      },
      layers: () => state.layers,
      addLayer: () => {
        const last = `layers.${state.layers - 1}`;
        const held = (name) => (state.groups.find((group) => group.path === last).fields.find((field) => field.path === `${last}.${name}`) || {}).value;
        const layer = { material: held("material"), wall_mm: held("wall_mm") };
        if (held("cap_mm")) layer.cap_mm = held("cap_mm");
        edit({ path: `layers.${state.layers}`, value: layer });
      },
    });
    const text = el("textarea", { id: "text", name: "text", spellcheck: "false", rows: "26", "aria-describedby": "text-fault", oninput: () => typed() });
    const textFault = el("p", { className: "refusal", id: "text-fault", role: "status" });
    const undo = el("button", { type: "button", onclick: () => step(state.past, state.future) }, "Undo");
    const redo = el("button", { type: "button", onclick: () => step(state.future, state.past) }, "Redo");
    const template = el("select", { name: "template", "aria-label": "Start from a template", onchange: () => { if (template.value) startFrom(data.templates[template.value], `${template.value.split("/").pop()}.toml`); template.value = ""; } },
      el("option", { value: "" }, "Start from ..."), Object.entries(data.templates).map(([name, text]) => el("option", { value: name, disabled: text === null }, text === null ? `${name}: its code needs --allow-code` : name)));
    const title = el("h1", { tabindex: "-1" }, data.name);
    const opened = el("p", { className: "line" }, UNWRITTEN);
    const chip = el("span", { className: "chip", role: "status", id: "state" }, "starting");
    const also = el("p", { className: "note", id: "also", role: "status" });
    let pointerDown = false;
    const host = el("div", { className: "stage-host" });
    const figures = el("div", { className: "chips", id: "figures" });
    const glance = el("p", { id: "glance" });
    const others = el("div", { id: "faults", role: "status" });
    const drawn = el("div", { id: "drawn" });
    const judged = el("div", { id: "judged" });
    const estimated = el("div", { id: "estimated" });
    const head = el("div", { className: "buttons" }, template, undo, redo);
    const batch = data.batch && createBatch(data.batch);
    const view = section("view", "3D", figures, glance, others, host);
    const pinned = U.createPinned({ current, restore: replaceText, before: kept.pinned, keep });
    const jobs = U.createJobs({ server, text: now, name: data.name, folder: data.folder, numbers, silicones, keep, before: kept.known || { [data.name]: data.known } });
    const tabs = el("details", { className: "as-text" }, el("summary", {}, "As TOML text"), el("label", { for: "text", className: "hidden" }, "The spec as TOML"), text, textFault);
    clear(page,
      el("header", { className: "top" }, el("div", {}, title, opened), el("div", { className: "chips" }, chip, jobs.chip, jobs.button, theme.button())),
      kept.back && el("p", { className: "note", id: "kept" }, "Your changes from before the page was loaded again are back. ", el("button", { type: "button", onclick: () => startFrom(data.text) }, `Start from ${data.name} again`)),
      batch && batch.node,
      el("div", { className: "columns" },
        el("section", { id: "spec", "aria-label": "Spec", tabindex: "-1" }, head, form.node, tabs),
        el("div", { className: "shown" }, view, section("section", "Section", drawn), jobs.node, pinned.node, section("judgement", "Moulds", judged), estimated)),
      el("footer", {}, el("p", {}, `unitcad ${data.version}. This page contacts only its own server.`)));

    let stage = null;
    const firstModel = (model) => U.createStage(host, model).then((made) => { stage = made; }, (error) => clear(host, el("p", { className: "absent" }, `This browser draws no 3D (${error.message}); the section is below.`)));

    // A text that was not changed is the server's to give.
    function keep() {
      if (state.past.length || pinned.held() || jobs.saved()) kept.keep({ text: state.text, past: state.past, pinned: pinned.held(), file: state.file, known: jobs.known() });
    }

    // The text as the page knows it; edits that are under way are in the next one.
    function now() { return state.text; }

    function noun() { return state.groups.some((group) => group.title === "Array") ? "array" : "unit"; }

    function numbers() {
      return state.groups.flatMap((group) => group.fields).filter((field) => ["number", "integer"].includes(field.kind) && typeof field.value === "number");
    }

    // Keys of one word of several that a unit's silicones are: what the level reads. `usual` are the silicones whose
    // modulus is known, with the one that is there.
    function silicones() {
      const fields = state.groups.flatMap((group) => group.fields).filter((field) => field.kind === "word" && /(^|\.)layers\.\d+\.material$/.test(field.path));
      return fields.map((field) => ({ ...field, usual: field.choices.filter(([name, modulus]) => name === field.value || /^[\d.]+ kPa$/.test(modulus)).map(([name]) => name) }));
    }

    // Another motor brings its own size and drive: those of the text go.
    function sizes(path) {
      const own = ["motor.diameter_mm", "motor.thickness_mm", "motor.drive"];
      const given = state.groups.flatMap((group) => group.fields).filter((field) => field.given && own.includes(field.path));
      return path === "motor.part" ? given.map((field) => ({ path: field.path, remove: true })) : [];
    }

    // What is shown, each with the spec that it is of: of a refused text the last unit that could be made.
    function current() {
      const { unit } = state;
      const { moulds, estimate } = { moulds: state.moulds.of === unit.text ? state.moulds : {}, estimate: state.estimate.of === unit.text ? state.estimate : {} };
      const answer = estimate.estimate && estimate.estimate.answer ? estimate.estimate.answer.line : (estimate.lines || [])[0];
      const failed = (moulds.checks || []).filter((check) => !check.ok).length;
      const level = estimate.estimate && estimate.estimate.answer;
      const more = moulds.checks ? [["checks", moulds.checks.length - failed, `of ${moulds.checks.length}`]] : [];
      return { name: (unit.spec && unit.spec.name) || data.name, spec: unit.spec, section: unit.section, figures: [...(unit.figures || []), ...more], answer, level, text: unit.text || state.text, refused: page.dataset.stale === "true" };
    }

    // The spec as it is to a person: the last text, the changes of it that are not answered yet, and the file's name.
    function moment() { return { text: state.text, pending: [...state.pending], file: state.file }; }

    function remember(path, coalesce) {
      const at = performance.now();
      const same = coalesce && path === state.last.path && at - state.last.at < APART_MS;
      if (!same) {
        state.past.push(moment());
        if (state.past.length > 200) state.past.shift();
      }
      state.future = [];
      state.last = { path, at };
    }

    // One change, or several that are undone together.
    function edit(changes, coalesce = false) {
      const all = [changes].flat();
      const path = all[all.length - 1].path;
      if (!state.pending.length || path !== state.last.path) remember(path, coalesce);
      else state.last = { path, at: performance.now() };
      for (const change of all) {
        // Only the newest value of a key that is being dragged is worth sending.
        state.pending = state.pending.filter((one) => one.path !== change.path || one.remove || change.remove);
        state.pending.push(change);
        state.changed = U.newestFirst(change.path, state.changed);
        state.unmade = U.newestFirst(change.path, state.unmade);
      }
      ask();
    }

    // A default that follows from other values is not known while one of them is refused: the last one stays in its field.
    function held(field) {
      const before = state.accepted.get(field.path);
      return (field.value === undefined || field.value === null) && before && !field.required ? { ...field, value: before.value } : field;
    }

    function startFrom(text, file = data.name) {
      state.opened = "";
      replaceText(text, file);
    }

    function typed() {
      remember("text", true);
      state.text = text.value;
      state.pending = [];
      ask();
    }

    function replaceText(next, file = state.file) {
      remember("", false);
      state.from = state.unit.spec;
      state.text = next;
      state.pending = [];
      named(file);
      ask();
    }

    // Another spec has another file.
    function named(file) {
      if (file !== state.file) jobs.suggest(file);
      state.file = file;
    }

    function step(from, to) {
      if (!from.length) return;
      to.push(moment());
      const { file, ...rest } = from.pop();
      Object.assign(state, rest, { last: { path: "", at: 0 }, from: null });
      named(file);
      text.value = state.text;
      ask();
    }

    async function ask() {
      const begun = performance.now();
      const mine = (state.asked += 1);
      buttons();
      clearTimeout(state.later);
      clear(also);
      chip.textContent = "working";
      page.setAttribute("aria-busy", "true");
      const sent = state.pending.length;
      const answer = await server.ask("unit", state.text, state.pending, U.takenBack(state.changed, state.accepted));
      if (!answer || mine !== state.asked) return;
      if (answer.lost || answer.text === undefined) {
        said("bad", answer.faults[0].message);
        clear(others, unanswered(answer));
        page.dataset.stale = "true";
        page.setAttribute("aria-busy", "false");
        return;
      }
      state.text = answer.text;
      state.pending = state.pending.slice(sent);
      keep();
      const faults = answer.faults || [];
      // What undo or the text changed is known once its form is there.
      if (faults.length && answer.groups && !state.changed.length && document.activeElement !== text) {
        state.changed = U.unlike(answer.groups, state.accepted);
        if (state.changed.length) return ask();
      }
      state.layers = answer.layers || 0;
      if (answer.groups) {
        state.groups = faults.length ? answer.groups.map((group) => ({ ...group, fields: (group.fields || []).map(held) })) : answer.groups;
        form.show(state.groups);
      }
      if (document.activeElement !== text) text.value = answer.text;
      if (!faults.length) {
        state.accepted = new Map(answer.groups.flatMap((group) => group.fields || []).map((field) => [field.path, field]));
        state.changed = [];
      }
      // A newer answer takes away why there were no moulds.
      if (page.dataset.moulds === "none") clear(judged);
      // What is wrong with the text itself stands under it alone, a value's fault at its field; who types the text has all there.
      const unread = faults.filter((one) => !one.field);
      const homeless = form.refuse(faults.filter((one) => one.field));
      const typing = document.activeElement === text;
      textFault.textContent = !typing && !unread.length ? "" : faults.map((one) => (one.field && one.line ? `line ${one.line}: ${one.message}` : one.message)).join("\n");
      if (unread.length) tabs.open = true;
      clear(others, (typing ? [] : homeless).map((one) => el("p", { className: "refusal" }, form.told(one, "", toForm))), faults.length > 0 && el("p", { className: "note" }, state.unit.text ? `Shown: the last valid ${noun()}.` : "Nothing could be made yet."));
      page.dataset.stale = String(faults.length > 0);
      buttons();
      if (!faults.length) await shown(answer);
      pinned.show();
      toldAlso(answer);
      window.unitcad.timings.push({ what: "unit", ms: performance.now() - begun, processor: answer.processor_ms, faults: faults.length });
      document.documentElement.dataset.ready = "yes";
      if (faults.length) {
        said("bad", unread.length ? "the text can't be read" : faults.length === 1 ? "1 value is refused" : `${faults.length} values are refused`);
        reveal();
        page.setAttribute("aria-busy", "false");
        return;
      }
      // While a number is being dragged the moulds wait; the estimate and the moulds then come side by side.
      state.later = setTimeout(() => rest(mine, begun), AFTER_MS);
    }

    // The changes that came with a change: those that a picked design needed, or the values of another spec.
    function toldAlso(answer) {
      const { from } = state;
      state.from = null;
      const unlike = from && answer.spec ? U.differences([from, answer.spec].map((one) => U.flat(one))).map(([path]) => path) : [];
      const most = unlike.slice(0, MOST_TOLD).join(", ") + (unlike.length > MOST_TOLD ? ` and ${unlike.length - MOST_TOLD} more` : "");
      clear(also, answer.also || (unlike.length ? `Other values than before: ${most}.` : ""), (answer.also || unlike.length > 0) && " Undo brings the spec before back.");
      const host = answer.also && form.row(answer.picked);
      (host || head).append(also);
      if (answer.also) reveal();
    }

    async function shown(answer) {
      state.unit = answer;
      title.textContent = (answer.spec && answer.spec.name) || data.name;
      opened.textContent = state.opened ? `Opened from ${state.opened}. ${UNWRITTEN}` : UNWRITTEN;
      document.title = `${[state.opened, title.textContent].filter(Boolean).join(": ")} - unitcad`;
      clear(figures, (answer.figures || []).map(([name, value, unit]) => el("span", { className: "chip" }, `${name} ${number(value, 3)} ${unit}`.trim())));
      clear(drawn, answer.section ? U.framed(answer.section, "The unit cut along its tail, with its main dimensions", "Section drawing") : el("p", { className: "absent" }, "The patch's plan is below, with its crosstalk."));
      jobs.keys();
      // The moulds of before stay in view until the new ones are there, but not a unit's beside a patch.
      const before = state.model || {};
      state.model = { ...(before.makes === answer.model.makes ? before : {}), ...answer.model };
      if (stage) await stage.update(state.model).catch(() => {});
      else if (!host.firstChild) await firstModel(state.model);
      page.dataset.moulds = "old";
      glance.dataset.old = "true";
    }

    // The estimate, or a patch's crosstalk, and the casting in a line above the view: they stand whole further down.
    function showGlance() {
      const { estimate, moulds } = state;
      const answer = estimate.of === state.unit.text && estimate.estimate && estimate.estimate.answer;
      const crosstalk = estimate.of === state.unit.text && estimate.drawings && `${estimate.lines[0]} `;
      const change = answer && state.level && state.level.of !== estimate.of && U.compared(answer, state.level.answer);
      const level = crosstalk || answer && `${answer.line} ${change ? `Level against before: ${change}. ` : ""}`;
      const made = moulds.of === state.unit.text && moulds.model ? moulds : {};
      const lines = made.lines || [];
      const printed = lines.slice(0, lines.findIndex((line) => line.startsWith("print ")) + 1);
      const warned = (made.warnings || []).map((line) => `Warning: ${line}.`);
      clear(glance, level, [...printed.map((line) => line[0].toUpperCase() + line.slice(1)), ...warned].join(" "));
      glance.dataset.old = "false";
    }

    async function rest(mine, begun) {
      const time = (what, answer) => window.unitcad.timings.push({ what, ms: performance.now() - begun, processor: answer.processor_ms, faults: (answer.faults || []).length });
      chip.textContent = "judging the moulds";
      await Promise.all([
        server.ask("estimate", state.text).then((answer) => {
          if (!answer || mine !== state.asked) return;
          const { estimate: last, of } = state.estimate;
          if (last && of !== state.unit.text) state.level = { answer: last.answer, of };
          state.estimate = { ...answer, of: state.unit.text };
          time("estimate", answer);
          showEstimate(answer);
        }),
        server.ask("moulds", state.text, [], U.takenBack(state.unmade, state.made)).then(async (answer) => {
          if (!answer || mine !== state.asked) return;
          state.moulds = { ...answer, of: state.unit.text };
          await showMoulds(answer);
          time("moulds", answer);
        }),
      ]);
      if (mine !== state.asked) return;
      showGlance();
      pinned.show();
      page.setAttribute("aria-busy", "false");
    }

    // Nothing is wrong with the text, as far as is known: the same may be asked again.
    function unanswered(answer) {
      return el("p", { className: "refusal" }, answer.faults[0].message, " ", el("button", { type: "button", onclick: () => { toForm(); ask(); } }, "Try again"));
    }

    function showEstimate(answer) {
      const refused = answer.again || answer.lost ? unanswered(answer) : (answer.faults || []).map((one) => el("p", { className: "refusal" }, one.message));
      if (answer.estimate) clear(estimated, U.estimate({ estimate: answer.estimate, manifest: {} }));
      else if (answer.drawings) clear(estimated, section("estimate", "Crosstalk", answer.lines.map((line, i) => el("p", { className: i ? undefined : "lead" }, line)),
        answer.drawings.map(([caption, svg]) => el("figure", {}, U.framed(svg, caption, caption), el("figcaption", {}, caption)))));
      else clear(estimated, section("estimate", "Attenuation estimate", refused, (answer.lines || []).map((line) => el("p", { className: "absent" }, line))));
    }

    async function showMoulds(answer) {
      const faults = answer.faults || [];
      const failed = (answer.checks || []).filter((check) => !check.ok);
      const manifest = { mould_checks: answer.checks || [], warnings: [...(state.unit.warnings || []), ...(answer.warnings || [])] };
      if (answer.checks) {
        const list = U.parts.checks({ manifest });
        clear(judged, (answer.lines || []).map((line) => el("p", {}, line)), [...list.childNodes].slice(1));
      } else clear(judged, faults.map((one) => el("p", { className: "refusal" }, one.message)));
      if (!faults.length) [state.made, state.unmade] = [state.accepted, []];
      if (answer.model && state.model) {
        state.model = { ...state.model, ...answer.model };
        if (stage) await stage.update(state.model).catch(() => {});
      }
      const open = answer.again || answer.lost;
      page.dataset.moulds = open ? "old" : faults.length ? "none" : "new";
      if (open) {
        said("bad", "moulds not judged");
        clear(others, unanswered(answer));
      } else if (faults.length) {
        said("bad", "no moulds");
        const left = form.refuse(faults);
        clear(others, left.map((one) => el("p", { className: "refusal" }, form.told(one, "", toForm))), el("p", { className: "note" }, `This ${noun()} has no moulds; the view shows only the ${noun()}.`));
        reveal();
        state.model = { ...state.model, moulds: null };
        if (stage) await stage.update(state.model).catch(() => {});
      } else {
        const { length } = manifest.warnings;
        const warned = length ? `, ${length} warning${length > 1 ? "s" : ""}` : "";
        said(failed.length ? "bad" : length ? "" : "good", `checks: ${manifest.mould_checks.length - failed.length} of ${manifest.mould_checks.length}${warned}`);
      }
    }

    function toForm() { page.querySelector("#spec").focus({ preventScroll: true }); }

    // What it says is a link to its reasons: the refusals, or the list of the checks.
    function said(kind, words) {
      chip.className = `chip ${kind}`;
      clear(chip, el("a", { href: "#judgement", onclick: (event) => { event.preventDefault(); show(); } }, words));
    }

    const inSight = (node) => {
      const { top, bottom } = node.getBoundingClientRect();
      const { top: from, bottom: to } = [node.closest("#spec")].filter(Boolean).map((one) => one.getBoundingClientRect())[0] || { top: 0, bottom: innerHeight };
      return top >= Math.max(from, page.querySelector(".top").getBoundingClientRect().bottom) - 1 && bottom <= Math.min(to, innerHeight) + 1;
    };

    // Every refusal that is on the page, in its order, as far as it can be seen with its group open.
    const refusals = () => [...page.querySelectorAll(".refusal, #also")].filter((one) => one.textContent && one.checkVisibility());

    function show() {
      const [first] = refusals().filter((one) => one !== also);
      const node = first || page.querySelector("#judgement");
      node.scrollIntoView({ block: first ? "center" : "start" });
      const control = first && first.closest(".field") && first.closest(".field").querySelector("input, select, .several") || first && first.querySelector("button");
      if (control) control.focus({ preventScroll: true });
    }

    // The reason comes to the person: of a field that is being typed in or dragged only that field's own, and not before
    // the pointer is up, so that nothing moves away from under it.
    function reveal() {
      const at = document.activeElement;
      const field = at && at.closest && at.closest(".field");
      const typing = at === text || at && at.matches("input:not([type='checkbox'])");
      const all = refusals();
      const own = field && all.find((one) => field.contains(one));
      const node = own || (typing ? null : all[0]);
      if (pointerDown || !node || all.some((one) => (!typing || one === own) && inSight(one))) return;
      node.scrollIntoView({ block: "nearest" });
    }
    document.addEventListener("pointerdown", () => { pointerDown = true; });
    for (const end of ["pointerup", "pointercancel"]) document.addEventListener(end, () => { pointerDown = false; if (page.dataset.stale === "true" || page.dataset.moulds === "none") reveal(); });

    function buttons() {
      undo.disabled = !state.past.length;
      redo.disabled = !state.future.length;
    }

    document.addEventListener("keydown", (event) => {
      // A name that is typed elsewhere than in the spec has its browser's own undo.
      if (!(event.ctrlKey || event.metaKey) || event.altKey || (event.target.matches("input:not([type='checkbox'])") && !event.target.closest("#spec"))) return;
      const key = event.key.toLowerCase();
      if (key === "z" && !event.shiftKey) step(state.past, state.future);
      else if (key === "y" || (key === "z" && event.shiftKey)) step(state.future, state.past);
      else return;
      event.preventDefault();
    });
    function variant(folder) { return server.send(`/variant/${encodeURIComponent(folder)}`); }

    // What a refused row starts from: its base where that is a template, else the first variant that was made.
    async function startOf({ base }) {
      return data.templates[base] ? { text: data.templates[base] } : variant(batch.first);
    }

    // What the row starts from is accepted, so its values are refused where they stand, with what would do.
    async function openRefused(text, changes) {
      remember("", false);
      state.from = null;
      state.text = text;
      state.pending = [];
      await ask();
      edit(changes);
    }

    // A row of the batch that is opened: its spec becomes the one that is changed.
    async function openVariant() {
      const folder = U.variantAsked();
      if (!folder) return;
      const refused = batch.refused.get(folder);
      const answer = refused ? await startOf(refused) : await variant(folder);
      if (answer.text === undefined) {
        clear(others, el("p", { className: "refusal" }, answer.faults[0].message));
        return;
      }
      state.opened = folder;
      if (refused) await openRefused(answer.text, refused.changes);
      else replaceText(answer.text);
      // The same row may be opened again.
      history.replaceState(null, "", location.pathname);
      page.querySelector(".columns").scrollIntoView();
      toForm();
    }

    // A batch's page begins with its first variant.
    async function openFirst() {
      const folder = batch.first;
      const answer = folder ? await variant(folder) : {};
      if (answer.text !== undefined) [state.text, state.opened] = [answer.text, folder];
      text.value = state.text;
      ask();
    }

    text.value = state.text;
    if (state.file !== data.name) jobs.suggest(state.file);
    if (batch) {
      batch.plot();
      window.addEventListener("hashchange", openVariant);
    }
    if (batch && !kept.back) openFirst();
    else ask();
  }

  function createBatch(data) {
    const { variant, why } = U.records(data);
    const { table, refused } = data.table ? U.refusedRows(data) : { table: { rows: [] }, refused: new Map() };
    // A row begins with its folder.
    const [first] = table.rows.map(([folder]) => folder).filter((folder) => folder && !refused.has(folder));
    const made = U.batch({ ...data, table }, why, variant);
    return { plot: made.plot, refused, first, node: el("details", { id: "of-batch", open: true }, el("summary", {}, `${data.title}: a name opens the variant live`), made.sections) };
  }

  try {
    start();
  } catch (error) {
    clear(page, el("p", { className: "absent" }, `The page can't be drawn: ${error.message}`));
  }
})();
