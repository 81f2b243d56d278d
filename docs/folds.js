// A link to a heading that is folded away opens its fold, and printing opens all.
const unfold = () => {
  const at = location.hash && document.getElementById(location.hash.slice(1));
  const fold = at && at.closest("details");
  if (!fold) return;
  fold.open = true;
  at.scrollIntoView();
};
addEventListener("hashchange", unfold);
addEventListener("DOMContentLoaded", unfold);
addEventListener("beforeprint", () => document.querySelectorAll("article details").forEach((fold) => { fold.open = true; }));
