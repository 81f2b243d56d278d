// The text of a tab over a reload: what was changed and not saved comes back while the server's own text is the same.
(() => {
  "use strict";
  const KEY = "unitcad-text";

  // Returns the text to begin with, whether it is one from before, and what keeps a newer one.
  function keepText(first) {
    const keep = (text) => {
      try {
        sessionStorage.setItem(KEY, JSON.stringify({ first, text }));
      } catch {
        // Storage that is off or full: a reload then begins with the server's text.
      }
    };
    try {
      const kept = JSON.parse(sessionStorage.getItem(KEY) || "null");
      if (kept && kept.first === first && typeof kept.text === "string" && kept.text !== first) return { text: kept.text, back: true, keep };
    } catch {
      // As above.
    }
    return { text: first, back: false, keep };
  }

  Object.assign(window.unitcad, { keepText });
})();
