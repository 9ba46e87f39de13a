// Validates glTF files with the Khronos validator and prints one JSON report for all of them:
//   node validate.mjs FOLDER_WITH_NODE_MODULES FILE...
// [{ "file", "errors", "warnings", "messages": [{ "code", "severity", "pointer", "message" }] }]
import { readFile } from "node:fs/promises";
import { createRequire } from "node:module";
import path from "node:path";

const [modules, ...files] = process.argv.slice(2);
const { validateBytes } = createRequire(path.join(path.resolve(modules), "package.json"))("gltf-validator");

async function validate(file) {
  const report = await validateBytes(new Uint8Array(await readFile(file)), {
    uri: path.basename(file),
    maxIssues: 0,
    writeTimestamp: false,
    externalResourceFunction: async (uri) =>
      new Uint8Array(await readFile(path.join(path.dirname(file), decodeURIComponent(uri)))),
  });
  const { numErrors, numWarnings, messages } = report.issues;
  return { file, errors: numErrors, warnings: numWarnings, messages };
}

console.log(JSON.stringify(await Promise.all(files.map(validate))));
