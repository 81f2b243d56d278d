// Rows of a batch that were refused: they have no folder, but the values that were asked for.
(() => {
  "use strict";

  // The table of a batch's page with a name and a link in each refused row, and by that name {base, changes}: the name of what
  // the row starts from, and the changes of it that are refused.
  function refusedRows({ table, batch }) {
    const refused = new Map();
    const at = (name) => table.columns.indexOf(name) + 1;
    if (!batch || !at("index") || !at("status") || !at("name")) return { table, refused };
    const { bases = [] } = batch;
    const rows = table.rows.map((row) => {
      if (row[0] || row[at("status")] !== "refused") return row;
      const index = row[at("index")];
      const name = `variant ${index}`;
      // The bases run slowest.
      const base = bases[Math.floor((index * bases.length) / table.rows.length)];
      const values = table.swept.map((path) => [path, row[at(path)]]).filter(([, value]) => value !== null);
      const changes = values.map(([path, value]) => ({ path, value, ...(/^[[{]/.test(value) ? { toml: true } : {}) }));
      refused.set(name, { base, changes });
      return row.map((cell, i) => (i === 0 || i === at("name") ? name : cell));
    });
    return { table: { ...table, rows }, refused };
  }

  Object.assign(window.unitcad, { refusedRows });
})();
