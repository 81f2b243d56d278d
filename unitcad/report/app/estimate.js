(() => {
  "use strict";
  const { el, section, facts, absent } = window.unitcad;
  window.unitcad.estimate = (variant) => section("estimate", "Attenuation estimate",
    variant.estimate ? facts(variant.estimate) : el("p", { className: "absent" }, "No estimate here. Ask for it with ", el("code", {}, "unitcad build SPEC --only estimate")));
})();
