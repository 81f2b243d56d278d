// A page whose markup is there, such as an array's: this draws the 3D view and the map of the skin's motion into it.
(() => {
  "use strict";
  const U = window.unitcad;
  const [view, map] = [".stage-host", ".skin-map-host"].map((host) => document.querySelector(host));

  // An error stays in its own part of the page.
  async function part(host, instead, draw) {
    try {
      if (host) await draw();
    } catch (error) {
      U.clear(host, U.el("p", { className: "absent" }, `${instead} (${error.message}).`));
    }
  }

  async function start() {
    const model = JSON.parse(new TextDecoder().decode(await U.unpacked(document.getElementById("data").textContent)));
    await part(map, "This browser draws no map of the skin's motion", () => U.createSkinMap(map, model.skin_map));
    await part(view, "This browser draws no 3D; the pictures below replace it", () => U.createStage(view, model));
  }

  start().finally(() => { document.documentElement.dataset.ready = "yes"; });
})();
