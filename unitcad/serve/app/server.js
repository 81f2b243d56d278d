// Questions to the server that this page came from. Every message carries the token of the address that was opened.
(() => {
  "use strict";

  const KEY = "unitcad-token";
  const LONG_MS = 1500;

  // The token stands in no address that is copied, bookmarked or kept as history. The browser holds it for this address and
  // port, of which a reload and other tabs take it.
  function takeToken() {
    const given = new URLSearchParams(location.search).get("token");
    history.replaceState(null, "", location.pathname + location.hash);
    try {
      if (given) localStorage.setItem(KEY, given);
      return given || localStorage.getItem(KEY) || "";
    } catch {
      return given || "";
    }
  }

  function createServer() {
    const token = takeToken();
    const page = Math.random().toString(36).slice(2, 14);
    const newest = {};
    const underWay = {};

    const LOST = { faults: [{ message: "The server does not answer. Was unitcad serve ended?" }], lost: true };

    // The answer to a message; a server that is gone is an answer too.
    async function send(path, message) {
      try {
        return await sent(path, message);
      } catch {
        return LOST;
      }
    }

    async function sent(path, message) {
      const response = await fetch(path, {
        method: message === undefined ? "GET" : "POST", cache: "no-store", redirect: "error",
        headers: { "X-Unitcad-Token": token, ...(message === undefined ? {} : { "Content-Type": "application/json" }) },
        body: message === undefined ? undefined : JSON.stringify(message),
      });
      if ((response.headers.get("content-type") || "").startsWith("application/json")) return { status: response.status, ...(await response.json()) };
      return { status: response.status, faults: [{ message: (await response.text()).trim() }] };
    }

    // The answer to a question about a text, or null where a newer question of that kind has been put meanwhile. One of a
    // kind is under way; of those put meanwhile the newest follows it. A drag so never fills the server's line. One that
    // takes long is not waited for: the server ends it for the newer one.
    async function ask(what, text, edits = [], since = []) {
      const mine = (newest[what] = (newest[what] || 0) + 1);
      while (underWay[what]) {
        const before = underWay[what];
        await Promise.race([before.answer, before.long]);
        if (mine !== newest[what]) return null;
        if (before === underWay[what]) underWay[what] = null;
      }
      const own = { answer: sent("/ask", { text, what, edits, since, page }).catch(() => LOST), long: new Promise((done) => setTimeout(done, LONG_MS)) };
      underWay[what] = own;
      const answer = await own.answer;
      if (underWay[what] === own) underWay[what] = null;
      return mine === newest[what] && !answer.superseded ? answer : null;
    }

    return { ask, send };
  }

  Object.assign(window.unitcad, { createServer });
})();
