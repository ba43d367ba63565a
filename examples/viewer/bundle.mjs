// node bundle.mjs OUT.html
//
// Puts the style sheet and the bundled modules into the page, so that one file holds all. Needs `npm ci` in this folder, once.

import { mkdir, readFile, rename, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const source = join(dirname(fileURLToPath(import.meta.url)), "source");

/** The text that esbuild makes of a file and all that the file imports. */
async function bundle(file, options) {
    const result = await build({
        entryPoints: [join(source, file)],
        bundle: true,
        minify: true,
        legalComments: "inline", // the license of three.js stays with its code
        write: false,
        logLevel: "warning",
        ...options,
    });
    return result.outputFiles[0].text;
}

/** Replaces a marker that stands in the page exactly once. */
function fill(page, marker, content) {
    const parts = page.split(marker);
    if (parts.length !== 2) throw new Error(`page.html: expected ${marker} once, found it ${parts.length - 1} times`);
    return parts.join(content);
}

const output = process.argv[2];
if (!output) {
    console.error("usage: node bundle.mjs OUT.html");
    process.exit(2);
}
let page = await readFile(join(source, "page.html"), "utf8");
page = fill(page, "/* the style goes here */", await bundle("style.css"));
page = fill(page, "/* the program goes here */", await bundle("main.js", { format: "iife", target: ["es2022"] }));
await mkdir(dirname(output), { recursive: true });
await writeFile(output + ".tmp", page);
await rename(output + ".tmp", output);
console.log(output);
