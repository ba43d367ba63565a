// node bundle.mjs BUILT VIEWER.html MODELS OUT: writes both forms of the page.
//
//   OUT/photo3d.html   one file that opens by double click
//   OUT/site/          a folder for a server: index.html, its files, and a service worker
//
// BUILT has Emscripten's output: converter.js and converter.wasm, and converter_threads with threads. MODELS has the weights.

import { createHash } from "node:crypto";
import { mkdir, readFile, rm, writeFile } from "node:fs/promises";
import { createRequire } from "node:module";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import zopfli from "@gfx/zopfli";
import { shortened } from "./short_halves.mjs";

const here = dirname(fileURLToPath(import.meta.url));
const { build } = createRequire(join(here, "../viewer/package.json"))("esbuild");
const source = join(here, "source");
const [built, viewer, models, output] = process.argv.slice(2);
if (!output) {
    console.error("usage: node bundle.mjs BUILT VIEWER.html MODELS OUT");
    process.exit(2);
}

/** Bundles a file and its imports with esbuild. Returns the text. */
async function bundle(entry, options = {}) {
    const result = await build({ bundle: true, minify: true, write: false, logLevel: "warning", target: ["es2022"], ...options, ...entry });
    return result.outputFiles[0].text;
}
const bundleFile = (name, options) => bundle({ entryPoints: [join(source, name)] }, options);

/** Replaces a marker in a text. Throws an error unless the marker occurs exactly once. */
function fill(text, marker, content) {
    const parts = text.split(marker);
    if (parts.length !== 2) throw new Error(`expected ${marker} once, found it ${parts.length - 1} times`);
    return parts.join(content);
}

const hashOf = (text) => `'sha256-${createHash("sha256").update(text).digest("base64")}'`;

/** Stores the low bytes of all 16-bit numbers before all high bytes, for better compression. assets.js reverses this. */
function splitHalves(bytes) {
    const halves = Buffer.alloc(bytes.length);
    const low = Math.ceil(bytes.length / 2);
    for (let i = 0; i < bytes.length; ++i) halves[i % 2 === 0 ? i / 2 : low + (i - 1) / 2] = bytes[i];
    return halves;
}

/** Compresses a file with gzip at maximum level, which all browsers unpack. */
const pack = async (bytes) => Buffer.from(await zopfli.gzipAsync(bytes, { numiterations: 8, blocksplittingmax: 200 }));

/** Minifies a JavaScript file that Emscripten wrote. */
const minify = async (name) => Buffer.from(await bundle({ stdin: { contents: await readFile(join(built, name), "utf8"), loader: "js" } }, { bundle: false }));

const viewerPage = await readFile(viewer, "utf8");
const viewerScripts = [...viewerPage.matchAll(/<script>([^]*?)<\/script>/g)].map(([, script]) => script);
const assets = {
    "worker.js": Buffer.from(await bundleFile("worker.js")),
    "converter.js": await minify("converter.js"),
    "converter.wasm": await readFile(join(built, "converter.wasm")),
    "depth.safetensors": await readFile(join(models, "tiefenrausch_small.safetensors")),
    "inpainting.halves": splitHalves(shortened(await readFile(join(models, "farbrausch.safetensors")))),
    "silhouettes.halves": splitHalves(await readFile(join(models, "silhouettes.safetensors"))),
    "viewer.html": Buffer.from(viewerPage),
};
/** Files that replace the converter on pages where browsers allow threads. Only pages from a server can have threads. */
const assetsOfThreads = {
    "converter_threads.js": await minify("converter_threads.js"),
    "converter_threads.worker.js": await minify("converter_threads.worker.js"),
    "converter_threads.wasm": await readFile(join(built, "converter_threads.wasm")),
};
/**
 * Files that the page loads for the first HEIC photo. Only the folder has them, because they would enlarge the single-file page by an eighth.
 */
const assetsOfHeic = {
    "heic.js": Buffer.concat([await minify("heic.js"), Buffer.from("\n"), Buffer.from(await bundleFile("heic.js"))]),
    "heic.wasm": await readFile(join(built, "heic.wasm")),
};
for (const group of [assets, assetsOfThreads, assetsOfHeic]) for (const name of Object.keys(group)) group[name] = await pack(group[name]);

const style = await bundleFile("style.css");
const program = (await bundleFile("main.js", { format: "iife" })).replace(/<\/script/g, "<\\/script");
const template = await readFile(join(source, "page.html"), "utf8");

/**
 * Returns the HTML of the page.
 *
 * @param {string} assetsText  script elements that contain the assets; empty if the page reads them from the server
 * @param {string} server  origins from which the page may read files, as in a Content-Security-Policy
 * @param {string} heic  end of the sentence "HEIC ..." on the page: the condition under which the page reads HEIC
 */
function makePage(assetsText, server, heic) {
    const scripts = [program, ...viewerScripts].map(hashOf).join(" ");
    const policy =
        `default-src 'none'; script-src ${scripts} 'wasm-unsafe-eval' blob:; worker-src blob:${server}; style-src 'unsafe-inline'; ` +
        `img-src data: blob:; media-src blob:; connect-src data: blob:${server}; form-action 'none'; base-uri 'none'`;
    let page = fill(template, "THE POLICY", policy);
    page = fill(page, "THE FORMATS", `JPEG, PNG, GIF, BMP, WebP and AVIF; HEIC ${heic}.`);
    page = fill(page, "/* the style goes here */", style);
    page = fill(page, "<!-- the assets go here -->", assetsText).replace(/<!-- [^]*? -->\n/g, "");
    return fill(page, "/* the program goes here */", program);
}

const inPage = Object.entries(assets).map(([name, bytes]) => `<script id="asset ${name}" type="application/gzip;base64">${bytes.toString("base64")}</script>`);
const site = join(output, "site");
await rm(site, { recursive: true, force: true });
await mkdir(site, { recursive: true });
await writeFile(join(output, "photo3d.html"), makePage(inPage.join("\n"), "", "where the browser reads it"));

const files = new Map([["index.html", Buffer.from(makePage("", " 'self'", "with the depth inside"))]]);
for (const [name, bytes] of Object.entries({ ...assets, ...assetsOfThreads })) files.set(`${name}.gz`, bytes);
const version = createHash("sha256");
for (const bytes of [...files.values(), ...Object.values(assetsOfHeic)]) version.update(bytes);
let offline = await readFile(join(source, "offline.js"), "utf8");
offline = fill(offline, '"VERSION"', JSON.stringify(version.digest("hex").slice(0, 16)));
offline = fill(offline, '["FILES"]', JSON.stringify(["./", ...files.keys()]));
offline = fill(offline, '["HEIC"]', JSON.stringify(Object.keys(assetsOfHeic).map((name) => `${name}.gz`)));
files.set("offline.js", Buffer.from(offline));
for (const [name, bytes] of Object.entries(assetsOfHeic)) files.set(`${name}.gz`, bytes);
for (const [name, bytes] of files) await writeFile(join(site, name), bytes);

const kilobytes = (bytes) => `${(bytes / 1000).toFixed(0)} kB`;
for (const [name, bytes] of files) console.error(`${name}: ${kilobytes(bytes.length)}`);
const sum = (isRead) => [...files].reduce((total, [name, bytes]) => total + (isRead(name) ? bytes.length : 0), 0);
const isOfThreads = (name) => name.startsWith("converter_threads"), isOfHeic = (name) => name.startsWith("heic.");
console.error(
    `download: ${kilobytes(sum((name) => !isOfThreads(name) && !isOfHeic(name)))}, with threads ` +
        `${kilobytes(sum((name) => !/^converter[.]/.test(name) && !isOfHeic(name)))}, HEIC reader ${kilobytes(sum(isOfHeic))}`,
);
console.log(join(output, "photo3d.html"));
