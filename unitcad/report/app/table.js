// A sortable, filterable table of variants, a page at a time.
(() => {
  "use strict";
  const { el, clear, filterOf, containing, kindsOf, LEVEL } = window.unitcad;
  const PAGE = 100;

  // Numbers before texts, nothing last whichever way.
  function compare(a, b, direction) {
    const absent = (v) => v === null || v === undefined;
    if (absent(a) || absent(b)) return absent(a) - absent(b);
    if (typeof a === "number" && typeof b === "number") return direction * (a - b);
    if (typeof a !== typeof b) return typeof a === "number" ? -1 : 1;
    return direction * String(a).localeCompare(String(b), undefined, { numeric: true });
  }

  // Columns that say the same of every row.
  function constants(columns, rows) {
    return new Set(columns.filter((name, i) => rows.length > 1 && rows.every((row) => row[i + 1] === rows[0][i + 1])));
  }

  // table: {columns, rows: [[folder, ...cells]]}; changed(rows) is called whenever other rows are shown.
  // `table` is made `readable`; `lead(row)` stands before a row's name, `named(row)` is that name.
  function createTable(table, { changed, nameColumn, lead, named }) {
    const same = constants(table.columns, table.rows);
    const kinds = table.columns.map((name, i) => ({ ...kindsOf(table.rows.map((row) => row[i + 1])), digits: table.digits(name) }));
    const fault = el("p", { className: "fault", id: "filters-fault", role: "status" });
    const levelAt = table.columns.indexOf(LEVEL) + 1;
    const state = { sort: levelAt && !same.has(LEVEL) ? levelAt : null, direction: 1, filters: new Map(), search: "", page: 0, all: false };
    const columns = () => table.columns.map((name, i) => ({ name, at: i + 1 })).filter(({ name }) => state.all || !same.has(name) || name === nameColumn || name === LEVEL);
    const body = el("tbody");
    const heads = el("tr");
    const filters = el("tr", { className: "filters" });
    const grid = el("table", {}, el("thead", {}, heads, filters), body);
    const count = el("p", { className: "count", "aria-live": "polite" });
    const pager = el("div", { className: "buttons" });
    const search = el("input", { type: "search", name: "search", placeholder: "Search all columns", "aria-label": "Search all columns", oninput: () => { state.search = search.value; state.page = 0; update(); } });
    const all = el("input", { type: "checkbox", name: "all-columns", onchange: () => { state.all = all.checked; layout(); update(); } });

    function chosen() {
      const read = [...state.filters].map(([at, text]) => ({ at, text, ...filterOf(text, kinds[at - 1]) }));
      complain(read.filter((filter) => filter.fault));
      const tests = read.filter((filter) => filter.test).map((filter) => [filter.at, filter.test]);
      const anywhere = containing(state.search);
      const rows = table.rows.filter((row) => tests.every(([at, test]) => test(row[at])) && (!anywhere || row.some((cell, i) => i > 0 && anywhere(cell))));
      if (state.sort === null) return rows;
      return rows.map((row, i) => [row, i]).sort(([a, i], [b, j]) => compare(a[state.sort], b[state.sort], state.direction) || i - j).map(([row]) => row);
    }

    // A filter that is not understood holds nothing back, and says so.
    function complain(faults) {
      const wrong = new Set(faults.map(({ at }) => at));
      for (const input of filters.querySelectorAll("input")) {
        const mine = wrong.has(Number(input.dataset.at));
        input.setAttribute("aria-invalid", String(mine));
        if (mine) input.setAttribute("aria-describedby", fault.id);
        else input.removeAttribute("aria-describedby");
      }
      fault.textContent = faults.map(({ at, text, fault: forms }) => `Not understood, so left out: "${text.trim()}" under ${table.columns[at - 1]}. It takes ${forms}.`).join(" ");
    }

    function sortBy(at) {
      state.direction = state.sort === at ? -state.direction : 1;
      state.sort = at;
      state.page = 0;
      update();
    }

    function layout() {
      grid.style.setProperty("--columns", columns().length);
      clear(heads, columns().map(({ name, at }) => el("th", { scope: "col", "data-at": at }, el("button", { type: "button", onclick: () => sortBy(at) },
        table.head(name).split(/(?<=[._])/).flatMap((piece) => [piece, el("wbr")])))));
      clear(filters, columns().map(({ name, at }) => {
        const input = el("input", { type: "text", name: `filter-${name}`, "data-at": at, placeholder: "filter", "aria-label": `Filter ${name}: text, > 1, > 1 < 2, 1..2, !1`, oninput: () => { state.filters.set(at, input.value); state.page = 0; update(); } });
        input.value = state.filters.get(at) || "";
        return el("td", {}, input);
      }));
    }

    function update() {
      const rows = chosen();
      const pages = Math.max(1, Math.ceil(rows.length / PAGE));
      state.page = Math.min(state.page, pages - 1);
      for (const head of heads.children) {
        const mine = Number(head.dataset.at) === state.sort;
        head.setAttribute("aria-sort", mine ? (state.direction > 0 ? "ascending" : "descending") : "none");
      }
      const first = state.page * PAGE;
      clear(body, rows.slice(first, first + PAGE).map((row) => el("tr", {}, columns().map(({ name, at }) => {
        const value = row[at];
        if (name === nameColumn) return el("th", { scope: "row" }, el("div", { className: "lead-in" }, lead(row), row[0] ? el("a", { href: `#${encodeURIComponent(row[0])}` }, named(row)) : named(row)));
        const picture = table.picture(name, row);
        return el("td", { className: picture ? "level" : typeof value === "number" ? "number" : undefined }, table.shown(name, value, row), picture);
      }))));
      count.textContent = `${rows.length} of ${table.rows.length} variants`;
      const step = (by, text) => el("button", { type: "button", disabled: state.page + by < 0 || state.page + by >= pages, onclick: () => { state.page += by; update(); } }, text);
      clear(pager, pages > 1 && [step(-1, "‹ Before"), el("span", {}, `page ${state.page + 1} of ${pages}`), step(1, "Next ›")]);
      changed(rows);
    }

    const known = [...same].filter((name) => name !== nameColumn && name !== LEVEL).map((name) => {
      const value = table.rows[0][table.columns.indexOf(name) + 1];
      return value === null || value === undefined ? null : el("li", {}, `${table.head(name)} = ${table.shown(name, value)}`);
    }).filter(Boolean);
    const node = el("div", { className: "variants" },
      el("div", { className: "tools" }, search, el("label", {}, all, "columns that don't vary, too"), count),
      fault,
      known.length > 0 && el("details", {}, el("summary", {}, `The same everywhere: ${known.length} columns`), el("ul", { className: "chips" }, known)),
      el("div", { className: "scroll tall", tabindex: "0", role: "group", "aria-label": "Variants" }, grid),
      table.legend && el("p", { className: "note" }, table.legend),
      pager);
    layout();
    update();
    return { node };
  }

  const varyingIn = (table) => table.columns.filter((name) => !constants(table.columns, table.rows).has(name));

  Object.assign(window.unitcad, { createTable, varyingIn });
})();
