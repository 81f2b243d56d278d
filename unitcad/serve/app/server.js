// Questions to the server that this page came from. Every message carries the token that the page was given.
(() => {
  "use strict";

  function createServer(token) {
    const page = Math.random().toString(36).slice(2, 14);
    const waiting = {};

    const LOST = { faults: [{ message: "The server does not answer. Was unitcad serve ended?" }], lost: true };

    // The answer to a message; a server that is gone is an answer too.
    async function send(path, message) {
      try {
        return await sent(path, message);
      } catch {
        return LOST;
      }
    }

    async function sent(path, message, signal) {
      const response = await fetch(path, {
        method: message === undefined ? "GET" : "POST", signal, cache: "no-store", redirect: "error",
        headers: { "X-Unitcad-Token": token, ...(message === undefined ? {} : { "Content-Type": "application/json" }) },
        body: message === undefined ? undefined : JSON.stringify(message),
      });
      if ((response.headers.get("content-type") || "").startsWith("application/json")) return { status: response.status, ...(await response.json()) };
      return { status: response.status, faults: [{ message: (await response.text()).trim() }] };
    }

    // The answer to a question about a text, or null where a newer question of that kind has been put meanwhile.
    async function ask(what, text, edits = []) {
      if (waiting[what]) waiting[what].abort();
      const mine = (waiting[what] = new AbortController());
      try {
        const answer = await sent("/ask", { text, what, edits, page }, mine.signal);
        return waiting[what] === mine && answer.status !== 409 ? answer : null;
      } catch (error) {
        if (error.name === "AbortError" || waiting[what] !== mine) return null;
        return LOST;
      }
    }

    return { ask, send };
  }

  Object.assign(window.unitcad, { createServer });
})();
