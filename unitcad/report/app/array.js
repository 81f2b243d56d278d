// The page of an array: its markup is there; this draws the 3D view and the skin's motion into it.
(() => {
  "use strict";
  const U = window.unitcad;
  const host = document.querySelector(".stage-host");

  async function start() {
    const model = JSON.parse(new TextDecoder().decode(await U.unpacked(document.getElementById("data").textContent)));
    const map = document.querySelector(".skin-map-host");
    if (map && model.skin_map) U.createSkinMap(map, model.skin_map);
    await U.createStage(host, model);
  }

  start()
    .catch((error) => U.clear(host, U.el("p", { className: "absent" }, `This browser draws no 3D (${error.message}); the pictures below replace it.`)))
    .finally(() => { document.documentElement.dataset.ready = "yes"; });
})();
