// The attenuation estimate: levels at the edge with spread and measured value, curves outwards, margins, errors.
(() => {
  "use strict";
  const { el, number, section, table, facts, theme, curvePlot } = window.unitcad;
  const NAMES = { rule: "Fitted rule", published: "Paper, as published", corrected: "Paper's path, corrected", baseline: "Baseline, four class means" };
  const nameOf = (model) => (NAMES[model] ? `${NAMES[model]} (${model})` : model);
  const known = (value) => typeof value === "number" && Number.isFinite(value);

  // Where a value lies on a logarithmic rule, in percent.
  function rule(values) {
    const from = Math.min(...values) / 1.5;
    const to = Math.max(...values) * 1.5;
    const at = (value) => (100 * Math.log(value / from)) / Math.log(to / from);
    const ticks = [];
    for (let decade = Math.floor(Math.log10(from)); decade <= Math.ceil(Math.log10(to)); decade += 1) {
      for (const step of [1, 2, 5]) {
        const value = step * 10 ** decade;
        if (value >= from && value <= to) ticks.push(value);
      }
    }
    return { at, ticks };
  }

  // Levels are fractions in the data and per cent on the page.
  const percent = (value) => (known(value) ? 100 * value : value);
  const percents = ({ value, low, high }) => ({ value: percent(value), low: percent(low), high: percent(high) });
  const list = (values) => values.map(percent);
  const three = (value) => (known(value) ? Number(value.toPrecision(3)) : value);

  const spoken = (entry) => {
    const spread = known(entry.low) && known(entry.high) && entry.low !== entry.high ? `${number(entry.low, 3)} to ${number(entry.high, 3)}` : "";
    if (known(entry.value)) return spread ? `${number(entry.value, 3)} (${spread})` : number(entry.value, 3);
    return spread || "not known";
  };

  const markClass = (name, mark) => (mark.dashed ? `${name} dashed` : name);

  // rows: [{name, entry: {value, low, high}, colour}]; marks: [{name, value, dashed}] stand as lines across all rows.
  function rangeChart(rows, marks, caption) {
    const values = [...rows.flatMap(({ entry }) => [entry.value, entry.low, entry.high]), ...marks.map((mark) => mark.value)].filter((v) => known(v) && v > 0);
    if (!values.length) return null;
    const { at, ticks } = rule(values);
    const placed = (className, left, width) => {
      const node = el("span", { className, "aria-hidden": "true" });
      node.style.left = `${left}%`;
      if (width !== undefined) node.style.width = `${width}%`;
      return node;
    };
    const line = ({ name, entry, colour }) => {
      const track = el("div", { className: "track" }, ticks.map((value) => placed("grid", at(value))), marks.map((mark) => placed(markClass("mark", mark), at(mark.value))));
      const bar = known(entry.low) && known(entry.high) && placed("bar", at(entry.low), Math.max(0.4, at(entry.high) - at(entry.low)));
      const dot = known(entry.value) && placed("dot", at(entry.value));
      for (const node of [bar, dot].filter(Boolean)) {
        theme.watch(node, () => { node.style.background = theme.colour(colour); });
        track.append(node);
      }
      return el("div", { className: "row" }, el("span", { className: "name" }, name), track, el("span", { className: "value" }, spoken(entry)));
    };
    const scale = el("div", { className: "row scale", "aria-hidden": "true" }, el("span"), el("div", { className: "track" }, ticks.map((value) => {
      const label = placed("tick", at(value));
      label.textContent = number(value);
      return label;
    })), el("span"));
    const legend = marks.map((mark) => el("li", {}, el("span", { className: markClass("swatch mark", mark), "aria-hidden": "true" }), `${mark.name}: ${number(mark.value)}`));
    return el("figure", { className: "ranges" }, el("figcaption", {}, caption), rows.map(line), scale, legend.length > 0 && el("ul", { className: "key" }, legend));
  }

  const COLOURS = { published: "series-1", corrected: "series-3", rule: "series-5" };

  const ownMarks = (data) => (data.own_measured || []).map((own) => ({ name: `Measured here (${own.unit})`, value: percent(own.value) }));

  function levels(data) {
    const { level, low, high, source } = data.answer || {};
    const rows = Object.entries(data.models || {}).map(([model, block]) => ({ name: `${nameOf(model)}${source && model === source.model ? ", all units alike" : ""}`, entry: percents(block.edge_level || {}), reason: (block.edge_level || {}).reason, colour: COLOURS[model] || "series-4" }));
    if (known(low)) rows.unshift({ name: `Level, 80 % range by ${source.model}`, entry: percents({ value: level, low, high }), colour: "series-6" });
    const found = data.measured || {};
    const measured = found.same_size ? found : {};
    const marks = [{ name: "Measured", value: percent(measured.level) }, { name: "Also printed", value: percent(measured.also_printed), dashed: true }, ...ownMarks(data)].filter(({ value }) => known(value));
    const fit = data.fit;
    const reasons = [...new Set(rows.map(({ reason }) => reason).filter(Boolean))];
    return [
      rangeChart(rows, marks, "Level at the unit's edge, % of the motor's amplitude; a model's bar is the spread from the inputs' ranges, not its error. The level has a share of the own errors of measured units near this one; 'all units alike' is without it."),
      reasons.map((reason) => el("p", { className: "note" }, reason)),
      fit && predicted(data, fit),
      known(found.level) ? el("p", { className: "note" }, found.same_size ? "" : `${number(percent(found.level), 3)} %: `, found.note) : el("p", { className: "note" }, "The paper measured no such unit."),
    ];
  }

  // What a lab's own fit expects of a new unit: 80 % ranges, and which fit it is.
  function predicted(data, fit) {
    const rows = Object.entries(data.models || {}).filter(([, block]) => block.predictive).map(([model, block]) => ({ name: nameOf(model), entry: percents({ value: block.edge_level.value, low: block.predictive.p10, high: block.predictive.p90 }), colour: COLOURS[model] || "series-4" }));
    return [rangeChart(rows, ownMarks(data), `80 % range of a new unit in the lab ${fit.name}, % of the motor's amplitude.`),
      el("p", { className: "note" }, `Constants: ${fit.file}, SHA-256 ${fit.sha256.slice(0, 12)}, ${fit.own_units} units of the lab's own.`),
      fitErrors(data)];
  }

  // How far a lab's fit is off, each unit left out; the table of errors beside it is by the stored constants.
  function fitErrors(data) {
    const rows = Object.entries(data.models || {}).filter(([, block]) => block.fit_error).map(([model, block]) => [model, block.fit_error]);
    if (!rows.length) return null;
    rows.sort(([, a], [, b]) => a.leave_one_out.geometric_mean - b.leave_one_out.geometric_mean);
    const one = (value) => (known(value) ? number(value, 3) : "–");
    const factor = (value) => (known(value) ? Number(value.toPrecision(3)) : "–");
    const cells = rows.map(([model, error]) => [nameOf(model), factor(error.leave_one_out.geometric_mean), `${one(error.leave_one_out.low)} to ${one(error.leave_one_out.high)}`, factor(error.own_leave_one_out), factor(error.own_by_stored), error.coverage || "–"]);
    const title = `Error by the fit of ${data.fit.name}`;
    return [el("h3", {}, title),
      table(["Model", "Leave-one-out", "5 to 95 %", "Own units", "Own, stored constants", "Coverage"], [...cells, [nameOf("baseline"), factor(rows[0][1].baseline), "–", "–", "–", "–"]], { label: title }),
      el("p", { className: "note" }, "Factors; 1 is exact. Each unit is predicted by constants fitted without it. The error against the measured table, below, is by the stored constants.")];
  }

  // Finite elements: a range for each drive and reading, from draws of what is not known; the dot is the median.
  function elements(block) {
    if (!block) return null;
    const place = { skin: "skin at D/2", edge: "the unit's own edge" };
    const row = (name, one, colour) => ({ name, entry: percents({ value: one.median, low: one.low, high: one.high }), colour });
    const rows = (block.levels || []).flatMap((one) => {
      const name = `${one.drive}, ${place[one.reading] || one.reading}`;
      return [row(name, one, "series-4"), ...Object.entries(one.by_contact || {}).map(([contact, group]) => row(`${name}: ${contact}`, group, "series-2"))];
    });
    const numbers = (block.levels || []).map((one) => [one.drive, place[one.reading] || one.reading, three(percent(one.median)), one.median_error === null ? "–" : three(one.median_error), three(percent(one.drawn_as))]);
    return [el("h3", {}, "By finite elements (fem)"),
      rangeChart(rows, [], `Amplitude along the drive, % of the motor's: median and ${(block.percent || [])[0]} to ${(block.percent || [])[2]} % of ${block.draws} draws, then separately with bonded and with resting skin.`),
      numbers.length > 0 && table(["Drive", "Read on", "Median, %", "Its error, times or divided by", "Unit as drawn, %"], numbers, { label: "Medians by finite elements" }),
      el("p", { className: "note" }, block.reason || `Not known, and drawn: ${block.not_known}. The level on the skin over that of the unit's own edge, as drawn: ${Object.entries(block.skin_over_edge || {}).map(([drive, ratio]) => `${three(percent(ratio))} % (${drive})`).join(", ")}.`)];
  }

  function ratios(data) {
    const controls = [...new Set(Object.values(data.models || {}).flatMap((block) => (block.hierarchical_over_control || []).map((entry) => entry.control)))];
    return controls.map((control) => {
      const rows = Object.entries(data.models).flatMap(([model, block]) => (block.hierarchical_over_control || []).filter((entry) => entry.control === control).map((entry) => ({ name: nameOf(model), entry: percents(entry), colour: COLOURS[model] || "series-4" })));
      const marks = (((data.measured || {}).same_size && data.measured.hierarchical_over_control) || []).filter((entry) => entry.control === control && known(entry.value)).map((entry) => ({ name: "Measured", value: percent(entry.value) }));
      return rangeChart(rows, marks, `Level over that of a control all of ${control}, %: below 100 it attenuates.`);
    });
  }

  const FORCES = { flat: "Force turning in the skin's plane", axial: "Force along the motor's axis" };

  function curves(layered) {
    if (!layered || !layered.r_mm) return el("p", { className: "absent" }, (layered && layered.reason) || "No curve.");
    const x = layered.r_mm;
    const drives = Object.entries(layered.drives || { axial: { u: layered.u_z } });
    const series = drives.map(([drive, block], i) => ({
      name: `${FORCES[drive] || drive}${drive === layered.drive ? " (this motor)" : ""}`, x, y: list(block.u.value), low: list(block.u.low), high: list(block.u.high), colour: i === 0 ? 0 : 2,
    }));
    const columns = [...series];
    if (layered.flat_over_axial_per_newton) columns.push({ name: "Flat over axial, per newton", y: list(layered.flat_over_axial_per_newton.value) });
    for (const [drive, block] of drives) {
      for (const key of ["u_r", "u_theta", "u_z"]) if (block[key]) columns.push({ name: `${drive}: |${key}|`, y: list(block[key].value) });
    }
    const print = layered.published_curves;
    if (print) {
      if (print.j0) series.push({ name: "Paper: |J0(kr)|", x, y: list(print.j0.map(Math.abs)), dash: true, colour: 1 });
      for (const [reading, values] of Object.entries(print.exponential || {})) series.push({ name: `Paper: exp, eta as ${reading.replace("_", " ")}`, x, y: list(values), dash: true, colour: reading === "loss_modulus" ? 3 : 4 });
    }
    columns.push(...series.slice(drives.length));
    const every = Math.max(1, Math.floor(x.length / 7));
    const rows = x.map((r, i) => [r, ...columns.map((curve) => curve.y[i])]).filter((row, i) => i % every === 0);
    return [
      curvePlot(series, { xLabel: "distance from the edge (mm)", yLabel: "% of |u| at the edge", log: true, label: "Decay from the unit's edge outwards" }),
      el("p", { className: "note" }, `At ${number(layered.frequency_hz)} Hz on ${layered.tissue}. ${layered.u_definition ? `Each curve over its own value at the edge; ${layered.u_definition}. ` : ""}The band is the spread: ${layered.spread}. No ratio to a control: ${layered.hierarchical_over_control_reason}.`),
      el("details", {}, el("summary", {}, "The curve as numbers, % of |u| at the edge"), table(["r (mm)", ...columns.map((curve) => curve.name)], rows, { label: "The curve as numbers" })),
    ];
  }

  function margins(models) {
    const { constraints: rows, coefficients: found, interfaces } = models.published || {};
    if (!rows || !rows.length) return null;
    const at = (block, key, i) => (known(block[key][i]) ? three(block[key][i]) : known((block[`${key}_low`] || [])[i]) ? `${three(block[`${key}_low`][i])} to ${three(block[`${key}_high`][i])}` : "not known");
    const waves = Object.keys(found);
    const passed = interfaces.map((name, i) => [name, ...waves.flatMap((wave) => ["k_t", "k_r"].map((key) => at(found[wave], key, i)))]);
    return [el("h3", {}, "The paper's equations 4 to 6"),
      table(["From a layer to the next", ...waves.flatMap((wave) => ["k_t", "k_r"].map((key) => `${key}, ${wave.toUpperCase()} wave`))], passed, { label: "Transmission and reflection" }), table(["Equation", "Inequality", "Control", "Left", "", "Right", "Margin", "Unit", "Holds"], rows.map((row) => ({
      className: row.holds === false ? "bad" : undefined,
      cells: [row.equation, row.text, row.control || "", row.left, row.relation, row.right, row.margin, row.unit || "", row.holds === true ? "holds" : row.holds === false ? "fails" : row.reason || "not known"],
    })), { label: "The paper's inequalities 5 and 6" })];
  }

  function errors(data) {
    const all = data.table_error || {};
    const compared = Object.entries(all).filter(([, entry]) => entry && entry.levels);
    if (!compared.length) return null;
    const order = all.order || [];
    compared.sort(([a], [b]) => order.indexOf(a) - order.indexOf(b));
    const chosen = all.chosen_without;
    const ends = (range) => (range ? `${number(range.low, 3)} to ${number(range.high, 3)}` : "–");
    const factor = (entry) => (entry ? entry.geometric_mean : "–");
    const out = (entry, key) => factor((entry.leave_one_out || {})[key]);
    return [el("h3", {}, "Error against the measured table"),
      table(["Model", "Nine levels", "Leave-one-out", "5 to 95 %", "Worst", "Twelve ratios", "Leave-one-out", "Directions"], compared.map(([model, entry]) => [
        nameOf(model), factor(entry.levels), out(entry, "levels"), ends(((entry.leave_one_out || {}).levels || {}).range), entry.levels.worst, factor(entry.ratios), out(entry, "ratios"),
        entry.directions ? `${entry.directions.right} of ${entry.directions.of}` : "–"]), { label: "Error against the measured table" }),
      el("p", { className: "note" }, `Factors; 1 is exact. ${all.note || ""}`),
      all.range && el("p", { className: "note" }, `Range: ${all.range}.`),
      chosen && el("p", { className: "note" }, `Rule with its form chosen among ${chosen.forms.length} without the unit too: ${number(chosen.geometric_mean, 3)} (${ends(chosen.range)}).`), classes(all)];
  }

  // What leaving out a whole class of units costs.
  function classes({ leave_one_class_out: out, order }) {
    if (!out) return null;
    return [table(["Class left out", ...order.map(nameOf)], Object.entries(out.by_class).map(([name, errors]) => [name, ...order.map((model) => errors[model])]), { label: "Leave-one-class-out error" }),
      el("p", { className: "note" }, `${out.note}.`)];
  }

  // A slope with its range, and how many measured pairs agree.
  function slope(seen, name) {
    if (!(name in seen.by)) return "not seen";
    const tested = (seen.tested || {})[name];
    return tested ? `${three(seen.by[name])} (${three(tested.low)} to ${three(tested.high)}; ${tested.of ? `${tested.agree} of ${tested.of} agree` : "untested"})` : three(seen.by[name]);
  }

  // What a percent more of each input does to each model's level, in percent; what no model reads is named below.
  function inputs(data) {
    const closed = Object.entries(data.models || {}).map(([model, block]) => [nameOf(model), block.sensitivities || {}]);
    const solved = ((data.fem || {}).sensitivities || []).map((one) => [`Finite elements, ${one.reading}`, one]);
    const reading = [...closed, ...solved].filter(([, seen]) => seen.by);
    if (!reading.length) return null;
    const names = [...Object.keys(reading[0][1].by), ...reading[0][1].no_effect];
    const most = (name) => Math.max(...reading.map(([, seen]) => Math.abs(seen.by[name] || 0)));
    const [read, unread] = [names.filter((name) => most(name) > 0), names.filter((name) => most(name) === 0)];
    read.sort((a, b) => most(b) - most(a));
    return [el("h3", {}, "Inputs with an effect on the level"),
      table(["Input + 1 %", ...reading.map(([model]) => model)], read.map((name) => [name, ...reading.map(([, seen]) => slope(seen, name))]), { label: "Inputs with an effect on the level" }),
      el("p", { className: "note" }, `Change of the level at the edge in percent, at the middle of the inputs' ranges; in brackets its range, and how many measured pairs of units agree.${unread.length ? ` No effect: ${unread.join(", ")}.` : ""}`)];
  }

  function assumptions(data) {
    const own = Object.entries(data.models || {}).map(([model, block]) => [el("h4", {}, nameOf(model)), el("p", {}, block.kind), el("ul", {}, (block.assumptions || []).map((text) => el("li", {}, text)))]);
    const layered = (data.layered && data.layered.assumptions) || [];
    return el("details", {}, el("summary", {}, "Assumptions and omissions"), el("ul", {}, (data.assumptions || []).map((text) => el("li", {}, text))),
      own, layered.length > 0 && [el("h4", {}, "Layered skin"), el("ul", {}, layered.map((text) => el("li", {}, text)))]);
  }

  // A level in per cent with two digits, as `words.percent` writes it.
  const said = (level) => {
    if (level < 1e-4) return "below 0.01 %";
    const shown = 100 * level;
    return `${shown < 99.5 ? shown.toPrecision(2) : Number(shown.toPrecision(2))} %`;
  };

  // One answer against another, as `words.compared` says it; "" without both.
  function compared(one, before) {
    if (!one || !before) return "";
    if (!known(one.level) || !known(before.level)) return "not compared: a level is not known";
    const within = (level, { low, high }) => low <= level && level <= high;
    const effect = within(one.level, before) || within(before.level, one) ? "within the range: no effect shown" : `a factor of ${number(one.level / before.level, 2)}`;
    return `${said(one.level)} against ${said(before.level)}: ${effect}`;
  }

  // The answer in the words of the command line.
  function lead({ lines }) {
    return lines.map((line, i) => el("p", { className: i ? undefined : "lead" }, line));
  }

  function estimate(variant) {
    const data = variant.estimate;
    if (!data) {
      return section("estimate", "Attenuation estimate", el("p", { className: "absent" }, "No estimate here. Make it with ", el("code", {}, "unitcad build SPEC --only estimate")));
    }
    return section("estimate", "Attenuation estimate", lead(data.answer), elements(data.fem),
      el("details", {}, el("summary", {}, "How sure?"), el("ul", { className: "lead-notes" }, data.answer.details.map((line) => el("li", {}, line))), levels(data), el("h3", {}, "Outwards from the edge"), curves(data.layered)),
      el("details", {}, el("summary", {}, "Tables: against controls, inputs, the paper's equations, errors"), ratios(data), inputs(data), margins(data.models || {}), errors(data)), assumptions(data),
      el("details", {}, el("summary", {}, "All numbers"), facts(data)));
  }

  Object.assign(window.unitcad, { estimate, compared, rule });
})();
