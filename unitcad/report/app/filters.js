// Filters of a table's cells, text to find, numbers to compare, `!` for all others.
(() => {
  "use strict";
  const { number } = window.unitcad;
  const NUMBER = "[-+]?(?:\\d+\\.?\\d*|\\.\\d+)(?:[eE][-+]?\\d+)?";
  const COMPARED = `(<=|>=|<|>|=|≤|≥)\\s*(${NUMBER})`;
  const ONE = new RegExp(`^${NUMBER}$`);
  const RANGE = new RegExp(`^(${NUMBER})?\\s*\\.\\.\\s*(${NUMBER})?$`);
  const COMPARISONS = new RegExp(`^${COMPARED}(?:\\s*(?:,|and|&)?\\s*${COMPARED})?$`);
  const FORMS = "1.2, > 1, > 1 < 2, 1..2, !1.2";

  const isNumber = (value) => typeof value === "number";
  const isAbsent = (value) => value === null || value === undefined;
  const SIGNS = {
    "<": (v, limit) => v < limit, "<=": (v, limit) => v <= limit, "≤": (v, limit) => v <= limit,
    ">": (v, limit) => v > limit, ">=": (v, limit) => v >= limit, "≥": (v, limit) => v >= limit,
  };

  // A test of a number, or null where the text is no number, no comparison and no range. What a cell shows with so
  // many digits as the same number is the same.
  function ofNumbers(text, digits) {
    const equal = (value, limit) => value === limit || number(value, digits) === number(limit, digits);
    const holds = (sign, value, limit) => (sign === "=" ? equal(value, limit) : SIGNS[sign](value, limit));
    if (ONE.test(text)) return (value) => equal(value, Number(text));
    const range = text.match(RANGE);
    if (range && (range[1] || range[2])) {
      const ends = [range[1] ? Number(range[1]) : -Infinity, range[2] ? Number(range[2]) : Infinity];
      return (value) => value >= Math.min(...ends) && value <= Math.max(...ends);
    }
    const found = text.match(COMPARISONS);
    if (!found) return null;
    const [, first, low, second, high] = found;
    return (value) => holds(first, value, Number(low)) && (!second || holds(second, value, Number(high)));
  }

  // A test of whether a cell holds a text; null for no text.
  function containing(text) {
    const wanted = text.trim().toLowerCase();
    if (!wanted) return null;
    const limit = ONE.test(wanted) ? Number(wanted) : null;
    return (value) => !isAbsent(value) && (String(value).toLowerCase().includes(wanted) || (limit !== null && value === limit));
  }

  // What a column holds: `numbers`, `texts`.
  function kindsOf(values) {
    return { numbers: values.some(isNumber), texts: values.some((value) => !isNumber(value) && !isAbsent(value)) };
  }

  // {test} of a cell, {} for no filter, or {fault} where a filter is not understood.
  function filterOf(text, { numbers, texts, digits = 6 }) {
    const wanted = text.trim();
    if (!wanted) return {};
    if (wanted.startsWith("!")) {
      const { test } = filterOf(wanted.slice(1), { numbers, texts, digits });
      return test ? { test: (value) => !test(value) } : { fault: numbers ? FORMS : "text, = text, !text" };
    }
    const compared = ofNumbers(wanted, digits);
    if (!texts) return compared ? { test: (value) => isNumber(value) && compared(value) } : { fault: FORMS };
    const exact = wanted.match(/^=\s*(.*)$/);
    const begun = /^[<>≤≥=]=?\s*$/.test(wanted) || (!numbers && compared && /^[<>≤≥]/.test(wanted));
    if (begun) return { fault: numbers ? `text, ${FORMS}` : "text, = text, !text" };
    const among = exact ? (value) => !isAbsent(value) && String(value) === exact[1] : containing(wanted);
    return { test: (value) => (isNumber(value) && compared ? compared(value) : among(value)) };
  }

  Object.assign(window.unitcad, { filterOf, containing, kindsOf });
})();
