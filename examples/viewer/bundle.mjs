// node bundle.mjs FOLDER
//
// Makes the viewer's page (FOLDER/viewer.html), the page of a batch (FOLDER/gallery.html) and the npm package of the element
// (FOLDER/photo-3d/). Requires that `npm ci` has run in this folder.

import { copyFile, mkdir, readFile, rename, writeFile } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { build, transform } from "esbuild";

const here = dirname(fileURLToPath(import.meta.url));
const source = join(here, "source");

/** Embeds style sheets as strings in the modules that import them. */
const styleSheets = {
    name: "style sheets",
    setup(builder) {
        builder.onLoad({ filter: /\.css$/ }, async ({ path }) => {
            const { code } = await transform(await readFile(path, "utf8"), { loader: "css", minify: true });
            return { contents: code, loader: "text" };
        });
    },
};

/** Bundles a module and its imports with esbuild, and returns the text. */
async function bundle(file, format) {
    const result = await build({
        entryPoints: [join(source, file)],
        bundle: true,
        minify: true,
        legalComments: "inline", // keeps the license of three.js in the code
        write: false,
        logLevel: "warning",
        target: ["es2022"],
        plugins: [styleSheets],
        format,
    });
    return result.outputFiles[0].text;
}

/** Replaces a marker in a page. Throws an error unless the marker occurs exactly once. */
function fill(page, marker, content) {
    const parts = page.split(marker);
    if (parts.length !== 2) throw new Error(`page: expected ${marker} once, found it ${parts.length - 1} times`);
    return parts.join(content);
}

/** Writes a file under a temporary name and renames it when it is complete. */
async function write(file, text) {
    await mkdir(dirname(file), { recursive: true });
    const unfinished = `${file}.${process.pid}.tmp`; // another process may write the same file
    await writeFile(unfinished, text);
    await rename(unfinished, file);
    console.log(file);
}

const output = process.argv[2];
if (!output) {
    console.error("usage: node bundle.mjs FOLDER");
    process.exit(2);
}
/** Returns a page in one file, with its style sheet and its program. */
async function makePage(name) {
    const style = await transform(await readFile(join(source, `${name}.css`), "utf8"), { loader: "css", minify: true });
    const page = fill(await readFile(join(source, `${name}.html`), "utf8"), "/* the style goes here */", style.code.trim());
    return fill(page, "/* the program goes here */", await bundle(`${name}.js`, "iife"));
}

await write(join(output, "photo-3d/photo-3d.js"), await bundle("element.js", "esm"));
for (const file of ["package.json", "README.md", "photo-3d.d.ts"]) await copyFile(join(here, "package", file), join(output, "photo-3d", file));
await copyFile(join(here, "../../LICENSE"), join(output, "photo-3d/LICENSE"));
await write(join(output, "gallery.html"), await makePage("gallery"));
await write(join(output, "viewer.html"), await makePage("page"));
