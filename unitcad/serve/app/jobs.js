// Saving the text, the full build, and a sweep of one key: with progress, where the result lies, and a way to stop it.
(() => {
  "use strict";
  const { el, clear, section, number } = window.unitcad;
  const EVERY_MS = 400;
  // What a build's stages do, in words.
  const STAGES = {
    plan: "laying out the tools and the pours", meshes: "making the solids", drawing: "drawing the section", "step pictures": "drawing the steps of casting",
    step: "writing the STEP files", pictures: "drawing pictures", "mould checks": "checking the moulds", check: "checking the printable files", estimate: "estimating the edge level",
    patch: "making the patch", casting: "writing the casting procedure", "circuit and crosstalk": "drawing the circuit and the crosstalk", page: "writing the page",
  };
  const inWords = (stage) => {
    const [, of = "", name] = /^(unit: )?(.*)$/.exec(stage);
    return of + (STAGES[name] || name);
  };

  // options: server, text(), name, folder, numbers() gives [{path, kind, value, low, high}] of the form's numbers.
  // silicones() gives [{path, usual}] of the fields of silicones. `before` has the known content, as SHA-256, by file name:
  // a file that is still so is replaced without a question. keep() is told of a save.
  function createJobs({ server, text, name, folder, numbers, silicones, keep, before }) {
    const known = { ...before };
    let wrote = false;
    const progress = el("div", { className: "job", role: "status", tabindex: "-1" });
    // Beside what is written anew, so that it keeps the focus.
    const cancel = el("button", { type: "button", hidden: true, onclick: () => server.send("/cancel", { job: running }) }, "Cancel");
    const log = el("div", { className: "job" });
    const file = el("input", { type: "text", id: "file-name", value: name, spellcheck: "false", oninput: () => { typed = true; clear(said); } });
    let typed = false;
    const said = el("p", { className: "note", role: "status" });
    let running = null;

    // Another spec has another file, unless a person named one.
    function suggest(other) {
      if (!typed) file.value = other;
      clear(said);
    }

    async function save(replace) {
      const named = file.value.trim();
      file.value = named && !named.includes(".") ? `${named}.toml` : named;
      if (!/^[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}\.toml$/.test(file.value)) {
        clear(said, "A file's name has letters, digits, dots, dashes and blanks, begins with a letter or a digit and ends in .toml.");
        return;
      }
      const answer = await server.send("/save", { text: text(), name: file.value, replace, known: known[file.value] || "" });
      if (answer.path) {
        known[file.value] = answer.known;
        wrote = true;
        keep();
        clear(said, `Saved as ${answer.path}.`, answer.refused && el("span", { className: "refusal" }, ` It is refused, so nothing can be built from it yet: ${answer.refused}`));
      } else {
        const there = answer.faults[0].field === "name" && !replace;
        clear(said, answer.faults[0].message, " ", there && el("button", { type: "button", onclick: () => { file.focus(); save(true); } }, "Replace it"));
      }
    }

    // In the page's head, in sight from everywhere: how far the job is, then its result.
    const link = el("a", { href: "#do", onclick: (event) => { if (link.target) return; event.preventDefault(); toProgress("center"); } });
    const chip = el("span", { className: "chip", id: "job", role: "status", hidden: true }, link);
    const toProgress = (block) => progress.scrollIntoView({ block });

    function inHead(kind, words, page) {
      Object.assign(chip, { hidden: false, className: `chip ${kind}` });
      Object.assign(link, { href: page || "#do", target: page ? "_blank" : "", rel: "noopener" });
      if (link.textContent !== words) link.textContent = words;
    }

    function failed(words) {
      clear(progress, el("p", { className: "fault" }, words));
      toProgress("nearest");
    }

    async function follow(state) {
      if (!state.job) {
        if (cancel.hidden) clear(log);
        failed(state.faults[0].message);
        return;
      }
      running = state.job;
      let now = state;
      let written = "";
      while (running === state.job) {
        // What is read aloud is written anew only where it differs.
        if (JSON.stringify(now) !== written) show(now);
        written = JSON.stringify(now);
        if (now.ended) break;
        await new Promise((done) => setTimeout(done, EVERY_MS));
        const next = await server.send(`/job/${state.job}`);
        if (!next.job) {
          stopped();
          failed(next.faults[0].message);
          inHead("bad", "no answer");
          break;
        }
        now = next;
      }
    }

    function show(state) {
      const done = state.ended && (state.code === 0 || state.code === 1);
      // A count of variants is a length of the bar.
      const [, count, of] = /^(\d+) of (\d+) /.exec(state.stage) || [];
      const words = !state.ended ? `${state.title} is under way: ${state.stage ? inWords(state.stage) : "starting"}` : state.code === 0 ? `${state.title} is done.` : state.code === 1 ? `${state.title} is done, with findings.` : state.code === 130 || state.code < 0 ? `${state.title} was cancelled.` : `${state.title} failed.`;
      const page = done && state.page && `/files/${state.page.split("/").map(encodeURIComponent).join("/")}`;
      progress.dataset.ended = String(Boolean(state.ended));
      clear(progress, el("p", { className: "lead" }, words[0].toUpperCase() + words.slice(1)),
        !state.ended && el("progress", { "aria-label": state.title, ...(of ? { max: Number(of), value: Number(count) } : {}) }),
        done && state.folder && el("p", {}, "In ", el("code", {}, state.folder), ". ", page && el("a", { href: page, target: "_blank", rel: "noopener" }, "Open its page")));
      clear(log, state.lines.length > 0 && el("pre", { className: "scroll" }, state.lines.join("\n")));
      inHead(!state.ended ? "" : done ? "good" : "bad", !state.ended ? (of ? `${count} of ${of}` : "building") : done ? "open the result" : state.code === 130 || state.code < 0 ? "cancelled" : "failed", page);
      if (state.ended) {
        // Who changes the spec meanwhile stays there.
        if (!document.activeElement || !document.activeElement.closest("#spec")) toProgress("nearest");
        stopped();
      } else cancel.hidden = false;
    }

    function stopped() {
      if (document.activeElement === cancel) progress.focus({ preventScroll: true });
      cancel.hidden = true;
    }

    const key = el("select", { id: "sweep-key", onchange: () => offer() });
    const low = el("input", { type: "number", step: "any", id: "sweep-low" });
    const high = el("input", { type: "number", step: "any", id: "sweep-high" });
    const count = el("input", { type: "number", min: "2", max: "50", step: "1", value: "5", id: "sweep-count" });
    const words = el("input", { type: "text", id: "sweep-words", size: "48" });
    const offer = () => {
      const silicone = silicones().find((each) => each.path === key.value);
      for (const each of [low, high, count]) each.parentElement.hidden = Boolean(silicone);
      words.parentElement.hidden = !silicone;
      if (silicone) words.value = silicone.usual.join(", ");
      const one = numbers().find((each) => each.path === key.value);
      if (!one) return;
      const whole = one.kind === "integer";
      low.step = high.step = whole ? "1" : "any";
      if (whole) {
        low.value = String(Math.max(one.low ?? 0, one.value - 2));
        high.value = String(Math.min(one.high ?? Infinity, one.value + 2));
        count.value = String(Math.max(2, high.valueAsNumber - low.valueAsNumber + 1));
        return;
      }
      count.value = "5";
      low.value = String(Number(Math.max(one.low ?? -Infinity, one.value * 0.8).toPrecision(4)));
      high.value = String(Number(Math.min(one.high ?? Infinity, one.value * 1.2).toPrecision(4)));
    };

    function keys() {
      const chosen = key.value;
      // Silicones first: the level reads them, and no length.
      clear(key, [...silicones(), ...numbers()].map((each) => el("option", { value: each.path }, each.path)));
      key.value = chosen;
      if (!chosen || key.value !== chosen) {
        const usual = ["layout.pitch_mm", "layers.0.material"].find((path) => [...key.options].some((option) => option.value === path));
        if (usual) key.value = usual;
        offer();
      }
    }

    const build = async () => {
      clear(said);
      toProgress("center");
      follow(await server.send("/build", { text: text() }));
    };
    const sweep = async () => {
      clear(said);
      if (!words.parentElement.hidden) {
        const chosen = [...new Set(words.value.split(",").map((word) => word.trim()).filter(Boolean))];
        if (chosen.length < 2) clear(progress, el("p", { className: "fault" }, "A sweep needs two silicones or more, with commas between them."));
        else follow(await server.send("/sweep", { text: text(), key: key.value, words: chosen }));
        return;
      }
      if (![low, high, count].every((one) => one.value !== "" && one.checkValidity())) {
        clear(progress, el("p", { className: "fault" }, "A sweep needs its two ends, and from 2 to 50 values."));
        return;
      }
      const across = high.valueAsNumber - low.valueAsNumber;
      if (low.step === "1" && across > 0 && across % (count.valueAsNumber - 1)) {
        const counts = Array.from({ length: Math.min(across, 49) }, (_, i) => i + 1).filter((steps) => across % steps === 0).map((steps) => steps + 1);
        clear(progress, el("p", { className: "fault" }, `${key.value} is a whole number: from ${low.value} to ${high.value} there can be ${counts.join(" or ")} values.`));
        return;
      }
      follow(await server.send("/sweep", { text: text(), key: key.value, low: low.valueAsNumber, high: high.valueAsNumber, count: count.valueAsNumber }));
    };
    const field = (label, control) => el("label", {}, `${label} `, control);
    const node = section("do", "Save, build, sweep",
      el("div", { className: "tools" }, field(`Spec file in ${folder}`, file), el("button", { type: "button", onclick: () => save(false) }, "Save spec")), said,
      el("details", {}, el("summary", {}, "Sweep this"), el("div", { className: "tools" }, field("Key", key), field("from", low), field("to", high), field("values", count), field("silicones", words),
        el("button", { type: "button", onclick: sweep }, "Run the sweep"))),
      progress, cancel, log);
    return { node, keys, suggest, chip, known: () => known, saved: () => wrote, button: el("button", { type: "button", className: "main", onclick: build }, "Build this") };
  }

  Object.assign(window.unitcad, { createJobs });
})();
