(() => {
  "use strict";
  const { el, section, facts } = window.unitcad;
  window.unitcad.procedure = (variant) => section("procedure", "Procedure",
    variant.casting ? facts(variant.casting) : el("p", { className: "absent" }, "No procedure here. Ask for it with ", el("code", {}, "unitcad build SPEC --only casting")));
})();
