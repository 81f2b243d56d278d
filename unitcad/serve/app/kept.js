// What a tab holds over a reload: what was changed and not saved, what undo goes back to, the pinned variant, and the files
// that it knows, while the server's own text is the same.
(() => {
  "use strict";
  const KEY = "unitcad-text";
  const MOST_STEPS = 50;

  // Returns {text, past, pinned, file, known, back, keep}: what to begin with, whether it is from before, and what keeps something newer.
  function keepText(first) {
    const keep = ({ past, ...rest }) => {
      try {
        sessionStorage.setItem(KEY, JSON.stringify({ first, past: past.slice(-MOST_STEPS), ...rest }));
      } catch {
        // Storage that is off or full: a reload then begins with the server's text.
      }
    };
    const anew = { text: first, past: [], pinned: null, back: false, keep };
    try {
      const { first: of, text, past, pinned, file, known } = JSON.parse(sessionStorage.getItem(KEY) || "{}");
      if (of === first && typeof text === "string" && Array.isArray(past)) return { text, past, pinned: pinned || null, file, known, back: past.length > 0 && text !== first, keep };
    } catch {
      // As above.
    }
    return anew;
  }

  Object.assign(window.unitcad, { keepText });
})();
