// Which fields were changed since a text was accepted, and the edits that take them back. `before` are its fields by path.
(() => {
  "use strict";
  const MOST = 5;

  function newestFirst(path, paths) { return [path, ...paths.filter((one) => one !== path)].slice(0, MOST); }

  // The edits that give back to changed fields what they were.
  function takenBack(changed, before) {
    return changed.filter((path) => before.has(path)).map((path) => {
      const field = before.get(path);
      return field.given ? { path, value: field.value, ...(field.kind === "toml" ? { toml: true } : {}) } : { path, remove: true };
    });
  }

  // The fields of a form whose given values are others than before; none where they are many: that is another spec.
  function unlike(groups, before) {
    const given = (field) => JSON.stringify(field.given ? [field.value] : []);
    const fields = groups.flatMap((group) => group.fields || []).filter(({ path }) => before.has(path));
    const found = fields.filter((field) => given(field) !== given(before.get(field.path))).map(({ path }) => path);
    return found.length > MOST ? [] : found;
  }

  Object.assign(window.unitcad, { newestFirst, takenBack, unlike });
})();
