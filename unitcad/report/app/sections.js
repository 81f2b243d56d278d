// The parts of a variant's page but for the 3D view, the estimate and the procedure.
(() => {
  "use strict";
  const { el, number, bytes, section, table, facts, partName } = window.unitcad;

  const drawing = (svg, alt) => el("img", { className: "drawing", src: `data:image/svg+xml;charset=utf-8,${encodeURIComponent(svg)}`, alt });

  // A drawing as wide as the page. Where that leaves its text small, a button shows it as large as it was drawn.
  function framed(svg, alt, label) {
    const frame = el("div", { className: "scroll", tabindex: "0", role: "group", "aria-label": label }, drawing(svg, alt));
    const button = el("button", { type: "button", className: "enlarge", "aria-pressed": "false", onclick: () => {
      button.setAttribute("aria-pressed", String(frame.classList.toggle("full")));
    } }, "Full size");
    return [frame, button];
  }

  const absent = (what, ask) => el("p", { className: "absent" }, `${what} `, el("code", {}, ask));

  // Path parts are kept from being read as anything but a path.
  const link = (folder, path) => [folder, path].filter(Boolean).join("/").split("/").map(encodeURIComponent).join("/");

  function verdict(manifest) {
    const checks = manifest.mould_checks || [];
    const failed = checks.filter((check) => !check.ok).length;
    const errors = manifest.check ? manifest.check.errors : 0;
    if (!checks.length) return { state: "unknown", text: "checks: not run" };
    if (failed) return { state: "bad", text: `checks: ${checks.length - failed} of ${checks.length}` };
    if (errors) return { state: "bad", text: `${errors} errors in files` };
    return { state: "good", text: `checks: ${checks.length} of ${checks.length}` };
  }

  function sectionDrawing(variant) {
    const svg = variant.drawings["section.svg"];
    return section("section", "Section", svg ? el("figure", {}, framed(svg, "The unit cut along its tail, with its main dimensions", "Section drawing"),
      el("figcaption", {}, "Cut along the tail; lengths in mm; z = 0 is the skin."))
      : absent("No section drawing here. Make it with", "unitcad build SPEC --only unit"));
  }

  function checks(variant) {
    const { manifest } = variant;
    const all = manifest.mould_checks || [];
    const row = (check) => ({ className: check.ok ? undefined : "bad", cells: [check.code, check.where, check.value, check.limit, check.unit || "", check.ok ? "passed" : "failed"] });
    const head = ["Check", "Place", "Value", "Limit", "Unit", ""];
    const failed = all.filter((check) => !check.ok);
    const findings = (manifest.check && manifest.check.findings) || [];
    const content = [el("p", { className: `verdict ${verdict(manifest).state}` }, verdict(manifest).text)];
    if (failed.length) content.push(table(head, failed.map(row), { caption: "Failed" }));
    if (all.length) content.push(el("details", {}, el("summary", {}, `All ${all.length} mould checks`), table(head, all.map(row), { label: "All mould checks" })));
    else content.push(absent("The mould checks were not run. Run them with", "unitcad build SPEC --only unit,moulds"));
    content.push(findings.length
      ? table(["File", "Rule", "Severity", "Message"], findings.map((f) => ({ className: f.severity === "error" ? "bad" : undefined, cells: [f.path, f.code, f.severity, f.message] })), { caption: "Findings in files" })
      : manifest.check && el("p", {}, all.length ? "The rules for files found no fault." : ""));
    const lines = (title, list) => list.length > 0 && [el("h3", {}, title), el("ul", {}, list.map((text) => el("li", {}, text)))];
    content.push(lines("Warnings", manifest.warnings || []));
    content.push(lines("Skipped", (manifest.skipped || []).map((entry) => `${entry.output}: ${entry.reason}`)));
    return section("checks", "Mould checks and mesh checks", content);
  }

  function parts(variant) {
    const list = variant.manifest.parts || [];
    const size = (box) => [0, 1, 2].map((i) => number(box[i + 3] - box[i], 4)).join(" × ");
    const rows = list.map((part) => [partName(part.name), part.role, part.made || "", part.material || "", part.volume_mm3, size(part.bbox_mm), part.triangles]);
    return section("parts", "Parts", list.length ? table(["Part", "Role", "Made", "Material", "Volume (mm³)", "Size (mm)", "Triangles"], rows, { label: "Parts" })
      : absent("No parts here. Make them with", "unitcad build SPEC --only unit,moulds"));
  }

  function files(variant) {
    const groups = new Map();
    for (const [path, size] of variant.files) {
      const folder = path.includes("/") ? path.slice(0, path.lastIndexOf("/")) : "";
      if (!groups.has(folder)) groups.set(folder, []);
      groups.get(folder).push([path, size]);
    }
    const item = ([path, size]) => el("li", {}, el("a", { href: link(variant.folder, path), download: true }, path.split("/").pop()), el("span", { className: "size" }, bytes(size)));
    return section("files", "Files", el("div", { className: "folders" }, [...groups].map(([folder, entries]) =>
      el("div", {}, el("h3", {}, folder || "This folder"), el("ul", { className: "files" }, entries.map(item))))));
  }

  function spec(variant) {
    if (!variant.spec) return section("spec", "Spec", el("p", {}, variant.no_model));
    const { layers, moulds, name, ...rest } = variant.spec;
    return section("spec", "Spec", el("details", {}, el("summary", {}, "Every value, defaults written out"), facts({ name, ...rest, layers, moulds }),
      el("h3", {}, "Made by"), facts(variant.manifest.versions)));
  }

  Object.assign(window.unitcad, { drawing, framed, absent, verdict, link, parts: { sectionDrawing, checks, parts, files, spec } });
})();
