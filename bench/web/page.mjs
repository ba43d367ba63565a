// node page.mjs ROUNDS: times examples/web in Chromium and Firefox. Each round opens the page anew, waits until it is ready, and converts
// the sample (1152 x 1536) five times. Prints medians; the last number is Chromium's for the photos after the first, in milliseconds.

import { readdir, readFile, stat } from "node:fs/promises";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";
import { convert, openPage, startBrowser } from "../../tests/web/browsers.mjs";

const top = join(dirname(fileURLToPath(import.meta.url)), "../..");
const rounds = Number(process.argv[2] ?? 5);
const sample = await readFile(join(top, "examples/photo3d/sample.jpg"));
const site = join(top, "build/web/site");
const address = pathToFileURL(join(top, "build/web/photo3d.html")).href;

const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];
const print = (name, value, unit = "ms") => console.log(`${name.padEnd(44)} ${value.toFixed(0).padStart(7)} ${unit}`);

const sizes = await Promise.all((await readdir(site)).map((name) => stat(join(site, name))));
print("download", sizes.reduce((sum, { size }) => sum + size, 0) / 1000, "kB");
const results = {};
for (const kind of ["chromium", "firefox"]) {
    const [ready, first, next, stages] = [[], [], [], {}];
    let heap = 0;
    for (let round = 0; round < rounds; ++round) {
        const browser = await startBrowser(kind);
        const page = await openPage(browser, address);
        ready.push((await page.evaluate(() => window.photo3d.converter.ready)).milliseconds);
        for (let i = 0; i < 5; ++i) {
            const { milliseconds, facts } = await convert(page, "sample.jpg", sample);
            (i === 0 ? first : next).push(milliseconds);
            heap = Math.max(heap, facts.heap);
            if (i > 0) for (const [stage, time] of Object.entries(facts.stages)) (stages[stage] ??= []).push(time);
        }
        await browser.close();
    }
    print(`${kind}: networks and warm-up, before a photo`, median(ready));
    print(`${kind}: first photo`, median(first));
    print(`${kind}: next photo`, median(next));
    for (const [stage, times] of Object.entries(stages)) print(`    ${stage}`, median(times));
    print(`${kind}: memory of the converter`, heap / 1e6, "MB");
    results[kind] = median(next);
}
console.log(`chromium, next photo: ${results.chromium.toFixed(1)}`);
