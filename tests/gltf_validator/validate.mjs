// node validate.mjs FILE.glb...
//
// Runs the Khronos glTF validator on GLB files. Ends with 0 if none has an error or a warning; infos and hints are only printed.
// Needs `npm ci` in this folder, once.

import { readFile } from "node:fs/promises";
import { basename } from "node:path";
import validator from "gltf-validator";

const severities = ["error", "warning", "info", "hint"];

async function validate(path) {
    const bytes = new Uint8Array(await readFile(path));
    const report = await validator.validateBytes(bytes, { uri: basename(path), maxIssues: 0 });
    const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
    for (const { severity, code, message, pointer } of messages)
        console.log(`${path}: ${severities[severity]} ${code} at ${pointer ?? "the file"}: ${message}`);
    const { totalTriangleCount, totalVertexCount } = report.info ?? {};
    console.log(
        `${path}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos, ${numHints} hints; ` +
            `${bytes.length} bytes, ${totalTriangleCount} triangles, ${totalVertexCount} vertices`,
    );
    return numErrors === 0 && numWarnings === 0;
}

const paths = process.argv.slice(2);
if (paths.length === 0) {
    console.error("usage: node validate.mjs FILE.glb...");
    process.exit(2);
}
let clean = true;
for (const path of paths) {
    try {
        clean = (await validate(path)) && clean;
    } catch (failure) {
        console.error(`${path}: ${failure.message ?? failure}`);
        clean = false;
    }
}
process.exit(clean ? 0 : 1);
